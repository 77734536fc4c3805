"""A bridge that loses a part of the command: dead zone, and dead time of its switches."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import njit

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, writes_numbers

DEAD_ZONE, DEAD_TIME, DEAD_TIME_CURRENT = slots("dead_zone", "dead_time_duty", "dead_time_current")
GOAL_DEAD_BAND = slots("goal_dead_band")
ROUNDED_ZONE, AFTER_ZONE = slots("rounded_dead_zone", "offset_after_dead_zone")
THRESHOLD = slots("command_threshold")
STEEP = 0.03  # of the threshold: commands about it over which a drive begins to act
THRESHOLDS_TRIED = (0.007, 0.014, 0.027, 0.04, 0.055, 0.075, 0.1, 0.14, 0.2, 0.28, 0.4)
SERVO = "position_command_rad"
ACTED_ON = frozenset({"duty", "voltage_V", "current_command_A", "motor_torque_Nm"})


@njit(error_model="numpy", inline="always")
def beyond_dead_zone(fx, command):
    """What a drive with a dead zone makes of a command."""
    if fx[ROUNDED_ZONE] != 0.0:
        command -= fx[ROUNDED_ZONE] * np.tanh(command / fx[ROUNDED_ZONE])
    if fx[THRESHOLD] != 0.0:
        beyond = (abs(command) / fx[THRESHOLD] - 1.0) / STEEP
        command *= 0.5 + 0.5 * np.tanh(beyond)
    if abs(command) <= fx[DEAD_ZONE]:
        return fx[AFTER_ZONE]
    less = command - fx[DEAD_ZONE] if command > 0.0 else command + fx[DEAD_ZONE]
    return less + fx[AFTER_ZONE]


@njit(error_model="numpy", inline="always")
def servo_torque(plant, fx, limited, goal, angle, speed):
    """Torque [Nm] of a servo (`Plant`) at its goal's distance and its speed; -1, 1: its limit."""
    if limited != 0:
        return limited * plant.current_limit
    band, short = plant.goal_dead_band + fx[GOAL_DEAD_BAND], goal - angle
    if band > 0.0:
        short = max(short - band, 0.0) + min(short + band, 0.0)
    return plant.volts_per_command * short - plant.volts_per_speed * speed


@njit(error_model="numpy")
def dead_time_volts(fx, plant, current):
    """What the dead time of a bridge takes of the winding's voltage [V]."""
    if fx[DEAD_TIME] == 0.0:
        return 0.0
    lost = fx[DEAD_TIME] * plant.volts_per_command
    return lost * np.tanh(current / fx[DEAD_TIME_CURRENT])


@njit(error_model="numpy")
def dead_time_current(fx, plant, volts, resistance):
    """The current [A] of a winding without inductance, R i + dead time's loss = volts."""
    if fx[DEAD_TIME] == 0.0:
        return volts / resistance
    # Newton from below: the sum is concave in |i|, so that no step passes the root
    wanted, lost = abs(volts), fx[DEAD_TIME] * plant.volts_per_command
    current = max(wanted - lost, 0.0) / resistance
    for _ in range(60):
        share = np.tanh(current / fx[DEAD_TIME_CURRENT])
        slope = resistance + lost * (1.0 - share * share) / fx[DEAD_TIME_CURRENT]
        step = (wanted - resistance * current - lost * share) / slope
        current += step
        if abs(step) <= 1e-15 * current:
            break
    return current if volts > 0.0 else -current


@njit(cache=True, error_model="numpy")
def _acting_commands(fx, commands):
    """Commands (n,) that act."""
    return np.array([beyond_dead_zone(fx, u) for u in commands])


@njit(cache=True, error_model="numpy")
def _dead_time_volts(fx, plant, currents):
    """Volts (n,) that the dead time of a bridge takes."""
    return np.array([dead_time_volts(fx, plant, i) for i in currents])


@dataclass(frozen=True, kw_only=True)
class DriveDeadZone(Term):
    """No output for small duties, as a bridge with dead time between its switches."""

    effect: ClassVar[str] = "drive-dead-zone"
    law: ClassVar[str] = "dead-zone"
    name: ClassVar[str] = "half-width"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The drive has a dead zone: small commands have no effect."
    figure_units: ClassVar[Mapping[str, str]] = {"width_duty": "-"}
    curve: ClassVar = EffectCurve(
        title="Dead zone of the drive", x_label="command", y_label="command that acts",
        over="command", evaluate=lambda d, v, x: _acting_commands(d.fx, x),
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="half-width", part="drive", commands=frozenset({"duty"}),
        size=lambda m: ((0.01,), "a dead zone of 1 % duty"),
    )  # fmt: skip

    width_duty: float = parameter(
        unit="-",
        bounds=(0.0, 1e5),
        source="half-width; dead time over switching period; a fit",
        meaning="Commands smaller than this give nothing; larger ones lose it. In the command's"
        " own unit: duty, V, A or Nm.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Half-width of the zone over the full command, as a duty is."""
        return {"width_duty": self.width_duty / context.full_command}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The half-width."""
        return {"dead_zone": self.width_duty}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """A command that is zero at rest."""
        return 'a servo\'s dead zone is the law "goal"' if command_name == SERVO else None

    def equation(self) -> str:
        return (
            f"acting duty = duty - {self.width_duty:g} sgn(duty)"
            f" where |duty| > {self.width_duty:g}, else 0"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A width."""
        if not typical.commands & (ACTED_ON if typical.relative else {"duty"}):
            return ()
        size, relative = typical.command, typical.relative
        high, step = (size, 0.007 * size) if relative else (0.3, 0.002)
        starts = (0.007 * size, 0.027 * size, 0.1 * size) if relative else (0.002, 0.008, 0.03)
        width = Unknown(name="width_duty", unit="-", low=0.0, high=high, scale=step)
        return (
            Law(effect=cls.effect, law=cls.name, subsystem="drive", kind=cls,
                write=writes_numbers(cls), unknowns=(width,), starts=tuple((w,) for w in starts),
                richer=(OffsetDeadZone.name, ThresholdDeadZone.name)),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The width."""
        return f"a dead zone of the drive, {f.of_command('width_duty')}"


@dataclass(frozen=True, kw_only=True)
class RoundedDeadZone(DriveDeadZone):
    """A dead zone without corners: u - w tanh(u / w), as of a bridge whose ripple dithers it.

    Small commands act with their cube, large ones lose the half-width w.

    Source
    ------
    As `DriveDeadTime`, with the current in proportion to the command.
    """

    law: ClassVar[str] = "rounded-dead-zone"
    name: ClassVar[str] = "rounded"

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The half-width."""
        return {"rounded_dead_zone": self.width_duty}

    def equation(self) -> str:
        return f"acting duty = duty - {self.width_duty:g} tanh(duty / {self.width_duty:g})"


@dataclass(frozen=True, kw_only=True)
class ThresholdDeadZone(DriveDeadZone):
    """A drive that leaves out small commands and takes others whole, as servo amplifiers do.

    acting command = u (1 + tanh((|u|/w - 1) / 0.03)) / 2: a step at w, of finite slope so that a
    fit sees it.

    Source
    ------
    A comparator before an amplifier; tanh for the step is ours.
    """

    law: ClassVar[str] = "threshold"
    name: ClassVar[str] = "threshold"

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The command below which nothing acts."""
        return {"command_threshold": self.width_duty}

    def equation(self) -> str:
        return (
            f"acting duty = duty where |duty| > {self.width_duty:g}, else 0;"
            f" the step is {100 * STEEP:g} % wide"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """As of the plain zone, of more widths: a step that is far off shows nothing."""
        if not typical.relative:
            return ()
        starts = tuple((share * typical.command,) for share in THRESHOLDS_TRIED)
        own = {"law": cls.name, "kind": cls, "write": writes_numbers(cls), "richer": ()}
        return tuple(
            replace(law, **own, starts=starts) for law in DriveDeadZone.candidates(typical)
        )


@dataclass(frozen=True, kw_only=True)
class OffsetDeadZone(DriveDeadZone):
    """A dead zone, and an offset of the amplifier after it, which acts at small commands too.

    The offset of `DriveOffset` is added to the command before the zone.
    """

    law: ClassVar[str] = "dead-zone-and-offset"
    name: ClassVar[str] = "half-width, offset after it"
    figure_units: ClassVar[Mapping[str, str]] = {"width_duty": "-", "offset_after": "-"}

    offset_after: float = parameter(
        0.0, unit="-", bounds=(-1e5, 1e5), source="an amplifier's data sheet; a fit",
        meaning="Added to what the zone leaves, in the command's own unit.",
    )  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The half-width and the offset."""
        return {"dead_zone": self.width_duty, "offset_after_dead_zone": self.offset_after}

    def equation(self) -> str:
        w, b = self.width_duty, self.offset_after
        return f"acting duty = {b:g} + (duty - {w:g} sgn(duty) where |duty| > {w:g}, else 0)"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """The width of the plain zone, and an offset."""
        found = DriveDeadZone.candidates(typical)
        if not typical.relative:
            return ()
        most = 0.3 * typical.command
        after = Unknown(name="offset_after", unit="-", low=-most, high=most,
                         scale=0.01 * typical.command)  # fmt: skip
        return tuple(
            replace(law, law=cls.name, kind=cls, write=writes_numbers(cls), richer=(),
                    unknowns=(*law.unknowns, after), starts=tuple((*s, 0.0) for s in law.starts))
            for law in found
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DriveDeadTime(Term):
    """The dead time of a bridge: voltage lost against the current, whatever the command.

    While both switches of a leg are open the current chooses its diode, so that the winding
    lacks dead time over period times the supply, softly about zero current where it ripples.

    Source
    ------
    Jeong & Park, The analysis and compensation of dead-time effects in PWM inverters, IEEE
    Trans. Ind. Electron. 38 (1991) 108; tanh for the passage through zero is ours.
    """

    effect: ClassVar[str] = "drive-dead-zone"
    law: ClassVar[str] = "dead-time"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = DriveDeadZone.headline
    figure_units: ClassVar[Mapping[str, str]] = DriveDeadZone.figure_units
    curve: ClassVar = EffectCurve(
        title="Dead time of the bridge", x_label="current (A)", y_label="voltage lost (V)",
        over="current", evaluate=lambda d, v, x: _dead_time_volts(d.fx, d.machine_numbers, x),
    )  # fmt: skip

    width_duty: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="dead time over switching period; a fit",
        meaning="Share of the supply that the winding lacks, against its current.",
    )
    crossover_A: float = parameter(
        0.05,
        unit="A",
        bounds=(1e-12, 1e9),
        source="0.05: ripple of the current; a fit",
        meaning="Current at which three quarters of it are lost.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Share of the supply that is lost."""
        return {"width_duty": self.width_duty}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Share and crossover."""
        return {"dead_time_duty": self.width_duty, "dead_time_current": self.crossover_A}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Its unit is duty."""
        return None if command_name == "duty" else "needs a drive by duty"

    def equation(self) -> str:
        return (
            f"winding voltage = supply_voltage (duty - {self.width_duty:g}"
            f" tanh(i / {self.crossover_A:g} A))"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A share, and the current within which it acts."""
        if "duty" not in typical.commands:
            return ()
        unknowns = (
            Unknown(name="width_duty", unit="-", low=0.0, high=0.3, scale=0.002),
            Unknown(name="crossover_A", unit="A", low=2e-3 * typical.current_A,
                    high=typical.current_A, scale=0.2, log=True, prior=1.5),
        )  # fmt: skip
        starts = ((0.002, 0.03 * typical.current_A), (0.008, 0.03 * typical.current_A))
        return (
            Law(effect=cls.effect, law="dead time", subsystem="drive", kind=cls,
                write=writes_numbers(cls), unknowns=unknowns, starts=starts),
        )  # fmt: skip

    sentence = DriveDeadZone.sentence
