"""An external torque on the load during part of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds
from rsea_core.errors import TermError


@dataclass(frozen=True, kw_only=True)
class LoadDisturbance(Term):
    """An outside torque on the load between two times of the recording.

    Raises
    ------
    TermError
        If a parameter is outside its bounds or the end is not after the start.
    """

    effect: ClassVar[str] = "load-disturbance"
    law: ClassVar[str] = "pulse"
    port: ClassVar[Port] = Port.LOAD

    start_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the outside torque begins.",
    )
    end_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the outside torque ends.",
    )
    peak_Nm: float = parameter(
        unit="Nm",
        bounds=(-100.0, 100.0),
        source="a fit",
        meaning="The outside torque, positive where it helps positive motion.",
    )
    rise_s: float = parameter(
        0.0,
        unit="s",
        bounds=(0.0, 1e6),
        source="0: a pulse",
        free=False,
        meaning="Time within which it rises in proportion to time.",
    )

    def __post_init__(self):
        require_bounds(self)
        if not self.end_s > self.start_s:
            raise TermError(
                f"{self.effect}: end_s = {self.end_s} must come after start_s = {self.start_s}"
            )
        if self.rise_s > self.end_s - self.start_s:
            raise TermError(
                f"{self.effect}: rise_s = {self.rise_s} is longer than it lasts,"
                f" {self.end_s - self.start_s:g} s"
            )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Where in which recording, and how much."""
        return {
            "recording": context.need(self.effect, "recording"),
            "start_s": self.start_s,
            "end_s": self.end_s,
            "peak_Nm": self.peak_Nm,
        }

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque and times."""
        found = {
            "pulse_torque": self.peak_Nm,
            "pulse_start": self.start_s,
            "pulse_end": self.end_s,
        }
        if self.rise_s > 0.0:
            found |= {"pulse_rise": self.rise_s, "memory": 1.0}
        return found

    def equation(self) -> str:
        """The law in one line."""
        text = f"{self.peak_Nm:g} Nm on the load where {self.start_s:g} s <= t < {self.end_s:g} s"
        return text + (f", rising for {self.rise_s:g} s" if self.rise_s > 0.0 else "")
