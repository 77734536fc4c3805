"""A spring between the load and the frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.load_base import HELD, draw_over_angle
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values

PARALLEL, PARALLEL_REST, PARALLEL_CUBIC, PARALLEL_UP_TO = slots(
    "parallel_stiffness", "parallel_rest_angle", "parallel_cubic", "parallel_up_to"
)


@hook("load_torque")
def parallel_torque(fx, angle, speed, torque):
    """A spring to the frame."""
    deflection = angle - fx[PARALLEL_REST]
    torque -= fx[PARALLEL] * deflection
    if fx[PARALLEL_CUBIC] != 0.0:
        cubic = min(max(deflection, -fx[PARALLEL_UP_TO]), fx[PARALLEL_UP_TO])
        torque -= fx[PARALLEL_CUBIC] * cubic**2 * (3.0 * deflection - 2.0 * cubic)
    return torque


@njit(error_model="numpy", inline="always")
def largest_parallel_stiffness(fx):
    """Largest tangent stiffness [Nm/rad]."""
    return fx[PARALLEL] + 3.0 * fx[PARALLEL_CUBIC] * fx[PARALLEL_UP_TO] ** 2


def parallel_energy_J(fx, angle):
    """Energy that the spring stores [J] for an array of load angles [rad]."""
    deflection = np.abs(angle - fx[PARALLEL_REST])
    cubic = np.minimum(deflection, fx[PARALLEL_UP_TO])
    beyond = deflection - cubic
    fourth = 0.25 * cubic**4 + cubic**3 * beyond + 1.5 * cubic**2 * beyond**2
    return 0.5 * fx[PARALLEL] * deflection**2 + fx[PARALLEL_CUBIC] * fourth


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind in HELD:
        return
    d.put(PARALLEL, v["stiffness_Nm_per_rad"])
    d.put(PARALLEL_REST, v.get("rest_angle_rad", 0.0))
    d.put(PARALLEL_CUBIC, v.get("cubic_Nm_per_rad3", 0.0))
    d.put(PARALLEL_UP_TO, v.get("up_to_rad", 0.0))


def _linear_unknowns(typical: TypicalMagnitudes) -> tuple[tuple[Unknown, ...], float]:
    """Stiffness and rest angle, and the stiffness that takes up a usual torque."""
    k, high, turn = typical.load_torque_Nm, 10 * typical.stiffness, 1.0
    if typical.relative:
        k /= typical.angle_rad
        high, turn = 100 * k, min(10 * typical.angle_rad, 7.0)
    return (
        Unknown(name="stiffness_Nm_per_rad", unit="Nm/rad", low=0.0, high=high, scale=0.1 * k),
        Unknown(name="rest_angle_rad", unit="rad", low=-turn, high=turn, scale=0.02 * turn,
                prior=0.1 * turn),
    ), k  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SpringParallel(Term):
    """A second spring between the load and the ground."""

    effect: ClassVar[str] = "spring-parallel"
    law: ClassVar[str] = "linear"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "A second spring acts on the load."
    figure_units: ClassVar[Mapping[str, str]] = {"stiffness_Nm_per_rad": "Nm/rad"}
    curve: ClassVar = draw_over_angle()
    relevant: ClassVar = RelevantSize(
        variant="linear", part="load",
        size=lambda m: (
            (m.load_torque_Nm, 0.0), f"a parallel spring of {m.load_torque_Nm:.2g} Nm/rad",
        ),
    )  # fmt: skip

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(0.0, 1e9),
        source="cables, a balancing spring; a fit",
        meaning="Stiffness of the second spring between load and ground.",
    )
    rest_angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it rests where the load does",
        meaning="Load angle at which the second spring is unloaded.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and rest angle."""
        return {
            "parallel_stiffness": self.stiffness_Nm_per_rad,
            "parallel_rest_angle": self.rest_angle_rad,
        }

    def equation(self) -> str:
        return f"-{self.stiffness_Nm_per_rad:g} (theta_l - {self.rest_angle_rad:g}) on the load"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Stiffness and rest angle."""
        unknowns, k = _linear_unknowns(typical)
        return (
            Law(effect=cls.effect, law=cls.law, subsystem="load", write=_write, kind=cls,
                unknowns=unknowns, starts=((0.3 * k, 0.0), (2.0 * k, 0.0))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The stiffness."""
        return f"a second spring at the load, {f('stiffness_Nm_per_rad', 'Nm/rad')}"


@dataclass(frozen=True, kw_only=True)
class StiffeningParallel(SpringParallel):
    """A spring between load and ground: k d + k_3 d^3 up to a deflection, straight beyond it.

    Source
    ------
    Nayfeh & Mook, Nonlinear Oscillations (1979), section 2.1: the restoring force of a hardening
    spring to its third order. The coefficient is a fit.
    """

    law: ClassVar[str] = "cubic"
    headline: ClassVar[str] = "A second spring, which stiffens, acts on the load."
    figure_units: ClassVar[Mapping[str, str]] = {
        **SpringParallel.figure_units, "cubic_Nm_per_rad3": "Nm/rad^3",
    }  # fmt: skip
    relevant: ClassVar = None

    cubic_Nm_per_rad3: float = parameter(
        unit="Nm/rad^3", bounds=(0.0, 1e12), source="a fit",
        meaning="Torque of the second spring in proportion to the deflection's third power.",
    )  # fmt: skip
    up_to_rad: float = parameter(
        unit="rad", bounds=(1e-9, 1e9), source="three times the usual motion of the recordings",
        meaning="Deflection up to which the law is a cubic; beyond it the law is a straight line.",
    )  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness at the rest angle, that angle, and the cubic coefficient."""
        return super().numbers(gear) | {
            "parallel_cubic": self.cubic_Nm_per_rad3, "parallel_up_to": self.up_to_rad,
        }  # fmt: skip

    def equation(self) -> str:
        d = f"(theta_l - {self.rest_angle_rad:g})"
        return (
            f"-{self.stiffness_Nm_per_rad:g} {d} - {self.cubic_Nm_per_rad3:g} {d}^3 on the load,"
            f" linear beyond {self.up_to_rad:g} rad of deflection"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Stiffness and rest angle, and a cubic part."""
        if not typical.relative:
            return ()
        unknowns, k = _linear_unknowns(typical)
        k3, up_to = k / typical.angle_rad**2, 3.0 * typical.angle_rad
        cubic = Unknown(name="cubic_Nm_per_rad3", unit="Nm/rad^3", low=0.0, high=100 * k3,
                        scale=0.1 * k3)  # fmt: skip
        held = Unknown(name="up_to_rad", unit="rad", low=up_to, high=up_to, scale=0.0)
        return (
            Law(effect=cls.effect, law=cls.law, subsystem="load", write=_write, kind=cls,
                unknowns=(*unknowns, cubic, held),
                starts=((0.3 * k, 0.0, 0.1 * k3, up_to), (0.3 * k, 0.0, 1.0 * k3, up_to))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The stiffness at the rest angle, and its growth."""
        growth = f("cubic_Nm_per_rad3", "Nm/rad^3")
        return f"{super().sentence(f)} where it is unloaded, which stiffens ({growth})"
