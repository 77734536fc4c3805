"""A bridge that loses a part of the command: dead zone, and dead time of its switches."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds


@dataclass(frozen=True, kw_only=True)
class DriveDeadZone(Term):
    """No output for small duties, as a bridge with dead time between its switches.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "drive-dead-zone"
    law: ClassVar[str] = "dead-zone"
    port: ClassVar[Port] = Port.DRIVE

    width_duty: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="half-width; dead time over switching period; a fit",
        meaning="Duties smaller than this give no voltage; larger ones lose it.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Half-width of the zone."""
        return {"width_duty": self.width_duty}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The half-width."""
        return {"dead_zone": self.width_duty}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Its unit is duty."""
        return None if command_name == "duty" else "needs a drive by duty"

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"acting duty = duty - {self.width_duty:g} sgn(duty)"
            f" where |duty| > {self.width_duty:g}, else 0"
        )


@dataclass(frozen=True, kw_only=True)
class DriveDeadTime(Term):
    """The dead time of a bridge: voltage lost against the current, whatever the command.

    While both switches of a leg are open the current chooses its diode, so that the winding
    lacks dead time over period times the supply, softly about zero current where it ripples.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Jeong & Park, The analysis and compensation of dead-time effects in PWM inverters, IEEE
    Trans. Ind. Electron. 38 (1991) 108; tanh for the passage through zero is ours.
    """

    effect: ClassVar[str] = "drive-dead-zone"
    law: ClassVar[str] = "dead-time"
    port: ClassVar[Port] = Port.DRIVE

    width_duty: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="dead time over switching period; a fit",
        meaning="Share of the supply that the winding lacks, against its current.",
    )
    crossover_A: float = parameter(
        0.05,
        unit="A",
        bounds=(1e-3, 10.0),
        source="0.05: ripple of the current; a fit",
        meaning="Current at which three quarters of it are lost.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Share and crossover."""
        return {"width_duty": self.width_duty, "crossover_A": self.crossover_A}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Share and crossover."""
        return {"dead_time_duty": self.width_duty, "dead_time_current": self.crossover_A}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Its unit is duty."""
        return None if command_name == "duty" else "needs a drive by duty"

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"winding voltage = supply_voltage (duty - {self.width_duty:g}"
            f" tanh(i / {self.crossover_A:g} A))"
        )
