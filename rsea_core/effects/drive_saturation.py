"""What a drive can give at most: its current limit and the sag of its supply."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds

NO_LIMIT_A = 1e3


@dataclass(frozen=True, kw_only=True)
class DriveSaturation(Term):
    """A supply that sags under its current, and a current limit below the nominal one.

    A bridge draws duty times the winding's current from the supply, evenly where a capacitor
    carries the ripple, so that the winding gets duty (U - R_s duty i). Without one the supply
    carries all of i while the bridge is on: duty U - R_s |duty| i. While the motor brakes the
    same raises the bus, except where the supply takes nothing back.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Averaged model of a full bridge: Mohan, Undeland & Robbins, Power Electronics, ch. 7.
    """

    effect: ClassVar[str] = "drive-saturation"
    law: ClassVar[str] = "source-and-limit"
    port: ClassVar[Port] = Port.DRIVE

    source_resistance_ohm: float = parameter(
        0.0,
        unit="ohm",
        bounds=(0.0, 20.0),
        source="0: a stiff supply",
        meaning="Resistance of supply and cable, over which the bridge voltage sags.",
    )
    returned_share: float = parameter(
        1.0,
        unit="-",
        bounds=(0.0, 1.0),
        source="1: a battery; 0: a rectifier, what comes back is burnt in a brake chopper",
        meaning="Share of the returned current that raises the bus voltage.",
    )
    ripple_share: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 1.0),
        source="0: a capacitor at the bridge; 1: none",
        meaning="Share of the bridge's ripple current that the supply carries.",
    )
    current_limit_A: float = parameter(
        NO_LIMIT_A,
        unit="A",
        bounds=(1e-3, NO_LIMIT_A),
        source="1000: the rig's limit alone",
        meaning="The largest winding current that the amplifier lets flow.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Source resistance where it sags, current limit where it limits."""
        found = {}
        if self.source_resistance_ohm > 0.0 or self.current_limit_A == NO_LIMIT_A:
            found["source_resistance_ohm"] = self.source_resistance_ohm
        if self.current_limit_A < NO_LIMIT_A:
            found["current_limit_A"] = self.current_limit_A
        return found

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The source's resistance, and how currents pass it."""
        return {
            "source_resistance": self.source_resistance_ohm,
            "source_one_way": 1.0 - self.returned_share,
            "source_ripples": self.ripple_share,
        }

    def on_plant(self, plant):
        """The machine with the lower limit of both."""
        return plant._replace(current_limit=min(plant.current_limit, self.current_limit_A))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Sag is that of a bridge."""
        sags = self.source_resistance_ohm > 0.0
        return "needs a drive by duty" if sags and command_name != "duty" else None

    def equation(self) -> str:
        """The law in one line."""
        ripple = self.ripple_share
        drawn = f"duty^2 + {ripple:g} (|duty| - duty^2)" if ripple > 0.0 else "duty^2"
        back = self.returned_share
        braking = f" [{back:g} of it where duty i < 0]" if back < 1.0 else ""
        return (
            f"winding voltage = duty supply_voltage - {self.source_resistance_ohm:g} ({drawn}) i"
            f"{braking},  |i| <= {self.current_limit_A:g} A"
        )
