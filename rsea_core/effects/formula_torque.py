"""A torque that no named law has, as a sum of terms over the states of one body.

Each term is a coefficient times a function of the body's angle times one of its speed. A diagnosis
finds them by sparse regression (docs/diagnosis-search.md 10.5); a file of a model holds them by
number.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.load_base import HELD
from rsea_core.effects.slots import block, slots
from rsea_core.effects.variant import (
    Law,
    RunConditions,
    TrialMachine,
    Unknown,
    Values,
    writes_numbers,
)
from rsea_core.errors import TermError

MOST_TERMS = 3
ANGLE_FUNCTIONS = {
    0: "",
    1: "theta",
    2: "theta^2",
    3: "theta^3",
    11: "sin(theta)",
    12: "sin(2 theta)",
    21: "cos(theta)",
    22: "cos(2 theta)",
}
SPEED_FUNCTIONS = {0: "", 1: "sgn(omega)", 2: "omega", 3: "omega |omega|"}
SPEED_POWER = {0: 0, 1: 0, 2: 1, 3: 2}
SMOOTH = 0.01  # of the usual speed, over which the sign of a speed turns

GEAR_TERMS, LOAD_TERMS = (block(f"formula_{side}_Nm", MOST_TERMS) for side in ("gear", "load"))
GEAR_ANGLES, LOAD_ANGLES = (block(f"formula_{side}_angle", MOST_TERMS) for side in ("gear", "load"))
GEAR_SPEEDS, LOAD_SPEEDS = (block(f"formula_{side}_speed", MOST_TERMS) for side in ("gear", "load"))
GEAR_USUAL, LOAD_USUAL = slots("formula_gear_usual", "formula_load_usual")


@njit(error_model="numpy")
def of_angle(kind, angle):
    """Function of an angle [rad] by its number (`ANGLE_FUNCTIONS`)."""
    if kind < 4.0:
        return angle**kind
    return np.sin((kind - 10.0) * angle) if kind < 20.0 else np.cos((kind - 20.0) * angle)


@njit(error_model="numpy")
def of_speed(kind, speed, usual):
    """Function of a speed by its number (`SPEED_FUNCTIONS`), in units of the usual one."""
    share = speed / usual
    if kind == 0.0:
        return 1.0
    if kind == 1.0:
        return np.tanh(share / SMOOTH)
    return share if kind == 2.0 else share * abs(share)


@njit(error_model="numpy")
def _sum(fx, terms, angles, speeds, usual, angle, speed):
    found = 0.0
    for j in range(MOST_TERMS):
        if fx[terms + j] != 0.0:
            found += (
                fx[terms + j]
                * of_angle(fx[angles + j], angle)
                * of_speed(fx[speeds + j], speed, usual)
            )
    return found


@hook("output_torque")
def gear_formula(fx, angle, speed, torque):
    """At the gear, by the motor's motion over the ratio."""
    if fx[GEAR_USUAL] != 0.0:
        torque += _sum(fx, GEAR_TERMS, GEAR_ANGLES, GEAR_SPEEDS, fx[GEAR_USUAL], angle, speed)
    return torque


@hook("load_torque")
def load_formula(fx, angle, speed, torque):
    """On the load."""
    if fx[LOAD_USUAL] != 0.0:
        torque += _sum(fx, LOAD_TERMS, LOAD_ANGLES, LOAD_SPEEDS, fx[LOAD_USUAL], angle, speed)
    return torque


def _coefficient(j: int):
    return parameter(
        0.0, unit="Nm", bounds=(-1e9, 1e9), source="a fit", free=False,
        meaning=f"Torque of term {j} where both functions are 1.",
    )  # fmt: skip


def _function(j: int, of: str):
    return parameter(
        0.0, unit="-", bounds=(0.0, 22.0), source="a diagnosis", free=False,
        meaning=f"Number of the function of the {of} in term {j}.",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FormulaTorque(Term):
    """A torque on the load: up to three products of a function of its angle and one of its speed.

    Functions of the angle theta: 0: 1, 1 to 3: its powers, 11 and 12: sin(theta), sin(2 theta),
    21 and 22: the cosines. Of the speed omega in units of the usual one: 0: 1, 1: its sign (smooth
    within a hundredth of the usual speed), 2: omega, 3: omega |omega|.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or a function has another number.

    Source
    ------
    Brunton, Proctor & Kutz, Discovering governing equations from data by sparse identification,
    PNAS 113 (2016) 3932: a library of functions of the states.
    """

    effect: ClassVar[str] = "formula-torque"
    law: ClassVar[str] = "on-the-load"
    port: ClassVar[Port] = Port.LOAD
    side: ClassVar[str] = "load"

    usual_speed_rad_per_s: float = parameter(
        unit="rad/s", bounds=(1e-12, 1e12), source="rms speed of the recordings", free=False,
        meaning="Unit of the speed in the functions.",
    )  # fmt: skip
    coefficient_1_Nm: float = _coefficient(1)
    angle_function_1: float = _function(1, "angle")
    speed_function_1: float = _function(1, "speed")
    coefficient_2_Nm: float = _coefficient(2)
    angle_function_2: float = _function(2, "angle")
    speed_function_2: float = _function(2, "speed")
    coefficient_3_Nm: float = _coefficient(3)
    angle_function_3: float = _function(3, "angle")
    speed_function_3: float = _function(3, "speed")

    def __post_init__(self):
        super().__post_init__()
        for j in range(1, MOST_TERMS + 1):
            for of, known in (("angle", ANGLE_FUNCTIONS), ("speed", SPEED_FUNCTIONS)):
                name = f"{of}_function_{j}"
                if getattr(self, name) not in known:
                    raise TermError(
                        f"{self.effect}: {name} = {getattr(self, name):g} is none of"
                        f" {', '.join(map(str, known))}"
                    )

    @property
    def terms(self) -> tuple[tuple[float, "FormulaTerm"], ...]:
        """Coefficients and functions of the terms that are there."""
        own = {f.name: getattr(self, f.name) for f in fields(self)}
        return tuple(
            (own[f"coefficient_{j}_Nm"], FormulaTerm(
                angle=int(own[f"angle_function_{j}"]), speed=int(own[f"speed_function_{j}"])))
            for j in range(1, MOST_TERMS + 1) if own[f"coefficient_{j}_Nm"] != 0.0
        )  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Coefficients and functions."""
        found = {f"formula_{self.side}_usual": self.usual_speed_rad_per_s}
        for j in range(1, MOST_TERMS + 1):
            found[f"formula_{self.side}_Nm_{j}"] = getattr(self, f"coefficient_{j}_Nm")
            for of in ("angle", "speed"):
                found[f"formula_{self.side}_{of}_{j}"] = getattr(self, f"{of}_function_{j}")
        return found

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float]:
        """The coefficients of the terms."""
        names = [f"coefficient_{j}_Nm" for j in range(1, MOST_TERMS + 1)]
        return {name: getattr(self, name) for name in names}

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """What it is: it has no name, so no headline either."""
        sizes = ", ".join(f"{value:.3g}" for value in f.figures.values())
        return f"a torque that has no name, a formula with coefficients of {sizes} Nm"

    def equation(self) -> str:
        return f"{self.sum_text()} on the load"

    def sum_text(self, deviations: Sequence[float] = ()) -> str:
        """The sum, its coefficients in SI units, with standard deviations [Nm] if given."""
        parts = []
        for number, (size, term) in enumerate(self.terms):
            unit = self.usual_speed_rad_per_s ** SPEED_POWER[term.speed]
            error = f" +- {deviations[number] / unit:.2g}" if deviations else ""
            parts.append(f"({size / unit:.4g}{error}) {term.unit()} {term.text()}".rstrip())
        return " + ".join(parts) or "0"


@dataclass(frozen=True, kw_only=True)
class GearFormulaTorque(FormulaTorque):
    """The same at the gear's output, of the motor's angle and speed over the ratio.

    Raises
    ------
    TermError
        As of a `FormulaTorque`.
    """

    law: ClassVar[str] = "at-the-gear"
    port: ClassVar[Port] = Port.GEAR
    side: ClassVar[str] = "gear"

    def equation(self) -> str:
        return f"{self.sum_text()} at the gear's output"


@dataclass(frozen=True, kw_only=True)
class FormulaTerm:
    """Functions of one term, by number."""

    angle: int
    speed: int

    def values(self, angle_rad: NDArray, speed: NDArray, usual: float) -> NDArray:
        """The term with a coefficient of 1, of angles and speeds (n,): (n,)."""
        share = speed / usual
        by_speed = {0: np.ones_like(share), 1: np.sign(share), 2: share, 3: share * np.abs(share)}
        if self.angle < 4:
            by_angle = angle_rad**self.angle
        else:
            wave = np.sin if self.angle < 20 else np.cos
            by_angle = wave((self.angle % 10) * angle_rad)
        return by_angle * by_speed[self.speed]

    def text(self) -> str:
        """The functions as they are written."""
        both = (ANGLE_FUNCTIONS[self.angle], SPEED_FUNCTIONS[self.speed])
        return " ".join(part for part in both if part) or "1"

    def unit(self) -> str:
        """Of the coefficient, in SI."""
        power, turns = SPEED_POWER[self.speed], (self.angle if self.angle < 4 else 0)
        unit = "Nm" + ("" if power == 0 else "s" if power == 1 else f"s^{power}")
        below = power + turns
        return unit + ("" if below == 0 else "/rad" if below == 1 else f"/rad^{below}")


FORMULAS = {"G": GearFormulaTorque, "L": FormulaTorque}
"""Its class by the port of an unknown torque."""


def formula_law(port: str, terms: Sequence[FormulaTerm], usual: float, torque_Nm: float) -> Law:
    """A law of up to three terms whose coefficients are free.

    Parameters
    ----------
    port : str
        G (gear) or L (load).
    usual : float
        Speed [rad/s] in whose units speeds are.
    torque_Nm : float
        Typical torque, for the scale of the coefficients.
    """
    kind = FORMULAS[port]
    held = [("usual_speed_rad_per_s", usual)]
    free = []
    for j, term in enumerate(terms, start=1):
        free.append(
            Unknown(name=f"coefficient_{j}_Nm", unit="Nm", low=-100.0 * torque_Nm,
                    high=100.0 * torque_Nm, scale=0.02 * torque_Nm)
        )  # fmt: skip
        held += [(f"angle_function_{j}", term.angle), (f"speed_function_{j}", term.speed)]
    fixed = [Unknown(name=n, unit="-", low=v, high=v, scale=0.0) for n, v in held]
    return Law(
        effect=kind.effect, law=kind.law, subsystem=kind.side, unknowns=(*free, *fixed), kind=kind,
        starts=((*(0.0 for _ in free), *(float(v) for _, v in held)),), write=_written(kind),
    )  # fmt: skip


def formulas_to_read() -> list[Law]:
    """The laws that a file may hold: the most terms, any values."""
    most = [FormulaTerm(angle=0, speed=0)] * MOST_TERMS
    return [formula_law(port, most, 1.0, 1.0) for port in FORMULAS]


def _written(kind: type[FormulaTorque]):
    numbers = writes_numbers(kind)

    def write(v: Values, d: TrialMachine, w: RunConditions) -> None:
        if kind.port is Port.GEAR or w.kind not in HELD:
            numbers(v, d, w)

    return write
