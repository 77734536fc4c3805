"""Variants of the effects that a diagnosis can put into a machine.

A variant has unknowns (its free values), a grid of starts, and a function that writes a machine's
numbers. Several variants may stand for one effect: a richer one is tried before a second effect
is named (`richer`). Values are those of the effects, on the side of the gear that their names
say, or unknowns in which a fit is well conditioned: `parameters` turns them into the effect's.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.effects.base import Context, Free, Gear, Port, Term
from rsea_core.effects.hooks import OUTSIDE, OUTSIDE_HOOKS, USER
from rsea_core.effects.slots import ANY, INTERNAL_STATES, REMEMBERS, USER_PLACES, place_of
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.machine.rig import Rig
from rsea_core.machine.spring_table import linear_table, with_dead_zone

PLANT = {name: j for j, name in enumerate(mp.Plant._fields)}


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """A free value of a variant.

    Attributes
    ----------
    scale : float
        A change of this size is a step worth taking; for `log` unknowns of the logarithm.
    log : bool
        The fit moves the logarithm: times, yields, ratios of stiffness.
    prior : float or None
        Standard deviation about zero (about the start for `log`), None: none.
    closed : bool
        Whether the bounds belong to the law: a fit that ends there has found a value.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float
    log: bool = False
    prior: float | None = None
    closed: bool = False


@dataclass(frozen=True, kw_only=True)
class RunConditions:
    """The recording that numbers are written for."""

    index: int
    file: str
    kind: str
    ratio: float
    session_s: float  # when the recording began, counted over all recordings
    case_rise_K: float  # of the motor case at the start
    time_s: NDArray
    past: NDArray = field(default_factory=lambda: np.zeros((0, 2)))  # see `initial_rises`
    initial_rises_K: tuple[float, float] | None = (
        None  # in place of `past`: see `motor_heat.rested`
    )
    start_torque_Nm: float | None = None  # that the spring's sensor reads in the first row


@dataclass
class TrialMachine:
    """Numbers of one model on one recording while laws write into them."""

    plant: NDArray
    fx: NDArray
    stiffness: float
    spring: NDArray | None = None  # regions of a `SpringTable` in place of the stiffness
    series_backlash_rad: float = 0.0  # in series with the spring
    start_motor_rad: float = 0.0  # added to the start of the simulation
    start_load_rad: float = 0.0
    start_motor_scale: float = 1.0  # true angles and speeds at the start over those that are read
    start_load_scale: float = 1.0
    start_deflection_rad: float = (
        0.0  # of the spring, where a play lets the wheel rest away from slack
    )
    start_remembered: float = (
        1.0  # share of what a spring that begins bent remembers of getting there
    )
    reads: list = field(default_factory=list)

    @property
    def machine(self) -> bytes:
        """Equal for machines that run alike, whatever their sensors read."""
        rest = [
            self.stiffness, self.start_motor_rad, self.start_load_rad, self.start_deflection_rad,
            self.start_motor_scale, self.start_load_scale, self.start_remembered,
            self.series_backlash_rad,
            *(() if self.spring is None else self.spring.ravel()),
        ]  # fmt: skip
        return np.concatenate([self.plant, self.fx, rest]).tobytes()

    @property
    def regions(self) -> NDArray:
        """Regions of the spring's `SpringTable`, (n, 6)."""
        table = linear_table(self.stiffness).regions if self.spring is None else self.spring
        return (
            with_dead_zone(table, self.series_backlash_rad)
            if self.series_backlash_rad > 0.0
            else table
        )

    @property
    def machine_numbers(self) -> mp.Plant:
        """The plant as it is now."""
        numbers = self.plant.tolist()
        return mp.Plant(int(numbers[0]), int(numbers[1]), *numbers[2:])

    def put(self, index: int, value: float) -> None:
        """One number of `effects.EFFECTS`."""
        self.fx[index] = value
        self.fx[ANY] = 1.0
        if index in REMEMBERS:
            self.fx[INTERNAL_STATES] = 1.0
        if USER <= index < USER + USER_PLACES:
            self.fx[OUTSIDE] = OUTSIDE_HOOKS.address()


AT_ONE = (
    "drive_efficiency",
    "backdrive_efficiency",
    "stiffness_ratio_at_0p15rad",
    "stiffness_after_over_before",
    "stiffness_rise_fast_over_static",
    "exponent",
    "scale",
)
FROM_ZERO = (
    "coulomb_Nm",
    "width_rad",
    "width_duty",
    "source_resistance_ohm",
    "delay_s",
    "stiffness_Nm_per_rad",
    "damping_Nms_per_rad",
    "torque_at_5_rad_per_s_Nm",
    "torque_Nm",
    "peak_Nm",
    "offset",
    "rate_per_s",
    "tip_share",
    *(f"stiffness_{j}_Nm_per_rad" for j in range(1, 7)),
    *(f"branch_stiffness_{j}_Nm_per_rad" for j in range(1, 4)),
    *(f"{at}{wave}_{unit}" for at in ("", "wheel_", "worm_") for wave in ("sin", "cos")
      for unit in ("rad", "Nm", "2_rad", "2_Nm", "3_Nm")),
)  # fmt: skip
"""Unknowns in proportion to which a law acts, counted from one and from zero."""

Values = Mapping[str, float]
Write = Callable[[Values, TrialMachine, RunConditions], None]


@dataclass(frozen=True, kw_only=True)
class Law:
    """One law of one effect.

    Attributes
    ----------
    unknowns : tuple of Unknown
    starts : tuple of tuple of float
        Values from which a fit starts; the first is the smallest.
    grid : tuple of tuple of float
        Starts of a law that brings replays into step at its right values alone (`from_grids`).
    write : function of (values, trial, where)
    richer : tuple of str
        Names of laws of the same effect that contain this one or replace it.
    always : tuple of str
        Those among them that are tried even where nothing is left above the noise: constants take
        up what they would explain, and are wrong then.
    follows : bool
        Tried only after a law that lists it: too like it for a screening to tell them apart.
    sensor : str or None
        The column whose reading it changes.
    swings : bool
        It has a motion of its own that no reading shows: short runs begin without it.
    kind : type of Term or None
        The class that simulates it; None of what belongs to a recording.
    parameters : function of (values, rig) or None
        The parameters of `kind` by the variant's values; None: they are the same.
    figure_values : mapping
        Reported figures that are values of the variant themselves, where `kind` has them only by
        numbers that a rig may lack.
    """

    effect: str
    law: str
    subsystem: str
    unknowns: tuple[Unknown, ...]
    starts: tuple[tuple[float, ...], ...]
    write: Write
    grid: tuple[tuple[float, ...], ...] = ()
    richer: tuple[str, ...] = ()
    always: tuple[str, ...] = ()
    follows: bool = False
    sensor: str | None = None
    swings: bool = False
    kind: type[Term] | None = None
    parameters: Callable[[Values, Rig], Values] | None = None
    figure_values: Mapping[str, str] = field(default_factory=dict)
    only: str | None = None  # file of the one recording that it acts on
    nuisance: bool = False  # part of every hypothesis, of the experiment and not of the machine
    known: bool = False  # a nuisance that is physics: the rig file states it
    own_form_spread: float | None = None  # in place of its class's, where it assumes more

    @property
    def form_spread(self) -> float:
        """Relative error of its figures by what it assumes."""
        return self.kind.form_spread if self.own_form_spread is None else self.own_form_spread

    @property
    def key(self) -> str:
        """Unique name."""
        place = self.sensor or self.only
        return f"{self.effect}/{self.law}" + (f"@{place}" if place else "")

    @property
    def fixed_numbers(self) -> dict[str, float]:
        """Numbers that no fit changes."""
        return {p.name: p.low for p in self.unknowns if p.low == p.high}

    def term(self, values: Values, rig: Rig, **more: float | str) -> Term:
        """The effect with these values, its bounds unchecked: a fit's are the unknowns' own.

        Parameters
        ----------
        more
            Parameters that no value of the variant says.
        """
        given = values if self.parameters is None else self.parameters(values, rig)
        column = {} if self.sensor is None else {"column": self.sensor}
        return self.kind.unchecked(**given, **column, **more)

    def figures(self, values: Values, rig: Rig, context: Context) -> dict[str, float | str]:
        """The figures that are reported of these values (`Term.comparable`); a table has none."""
        if self.kind.effect != self.effect:
            return {}
        if self.figure_values:
            return {figure: values[name] for figure, name in self.figure_values.items()}
        return dict(self.term(values, rig).comparable(context))

    def figure_unit(self, name: str) -> str:
        """Unit of a reported figure."""
        unit = self.kind.unit_of(name)
        reading = (self.sensor or "").rsplit("_", 1)[-1]
        return f"{reading}{unit}" if unit in ("", "/s") else unit

    @property
    def signed(self) -> bool:
        """Whether it can act either way: a rate, an offset, a factor on either side of one."""
        return any(
            (unknown.name in FROM_ZERO and unknown.low < 0.0)
            or (unknown.name in AT_ONE and unknown.low < 1.0 < unknown.high)
            for unknown in self.unknowns
        )

    def scaled(self, start: Sequence[float], factor: float) -> tuple[float, ...]:
        """A start at which the law acts `factor` times as much, within the unknowns' bounds."""
        found = []
        bouc_wen = self.law == "bouc-wen"
        for unknown, value in zip(self.unknowns, start, strict=True):
            if unknown.name in AT_ONE and not bouc_wen:
                value = 1.0 + factor * (value - 1.0)
            elif unknown.name in FROM_ZERO:
                value = factor * value
            elif unknown.name == "winding_heat_capacity_J_per_K":
                value = value / factor
            found.append(min(max(value, unknown.low), unknown.high))
        return tuple(found)

    def widened(self, names: Collection[str], factor: float) -> "Law":
        """The law with wider bounds of those of its sizes; itself where it has none of them.

        Sizes are what is counted from zero and has a unit: bounds of shares are physical.
        """
        wider = tuple(
            replace(u, low=factor * u.low, high=factor * u.high)
            if u.name in names and u.name in FROM_ZERO and u.unit != "-" else u
            for u in self.unknowns
        )  # fmt: skip
        return self if wider == self.unknowns else replace(self, unknowns=wider)

    def values(self, numbers: NDArray) -> dict[str, float]:
        """Values by name."""
        return {unknown.name: float(v) for unknown, v in zip(self.unknowns, numbers, strict=True)}


@dataclass(frozen=True)
class Reflection(Gear):
    """Motor-side values at the output of a gear without losses."""

    ratio: float

    def torque_to_output(self, motor_side: float) -> float:
        """Torque [Nm]."""
        return self.ratio * motor_side

    def motion_to_output(self, motor_side: float) -> float:
        """Angle [rad] or speed [rad/s]."""
        return motor_side / self.ratio


def writes_numbers(kind: type[Term], *, moving_load: bool = False) -> Write:
    """What writes an effect's own numbers, for variants whose values are its parameters.

    Parameters
    ----------
    moving_load : bool
        Whether it acts on loads that are free to move only.
    """

    def write(v: Values, d: TrialMachine, w: RunConditions) -> None:
        if moving_load and w.kind in ("locked", "imposed"):
            return
        term = kind.unchecked(**v)
        for name, value in term.numbers(Reflection(w.ratio)).items():
            d.put(place_of(name), value)

    return write


def candidates_of(kind: type[Term], typical: TypicalMagnitudes) -> Sequence[Law]:
    """The variants of an effect: its own, else one by the `Free` of its parameters."""
    found = kind.candidates(typical)
    free = {f.name: f.metadata for f in fields(kind) if "fit" in f.metadata}
    if found or not free:
        return found
    unknowns, starts = [], []
    for name, info in free.items():
        fit: Free = info["fit"]
        size = 1.0 if fit.of is None else getattr(typical, fit.of)
        scaled = 1.0 if fit.log else size
        unknowns.append(
            Unknown(name=name, unit=info["unit"], low=fit.low * size, high=fit.high * size,
                    scale=fit.step * scaled, log=fit.log,
                    prior=None if fit.prior is None else fit.prior * scaled)
        )  # fmt: skip
        starts.append(tuple(value * size for value in fit.starts))
    moving = kind.port in (Port.LOAD, Port.ENVIRONMENT)
    return (
        Law(effect=kind.effect, law=kind.law, subsystem=kind.port.value[0], kind=kind,
            unknowns=tuple(unknowns), starts=tuple(product(*starts)),
            write=writes_numbers(kind, moving_load=moving)),
    )  # fmt: skip
