"""A delay of the command."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, writes_numbers

COMMAND_DELAY = slots("command_delay")


@dataclass(frozen=True, kw_only=True)
class DriveDelay(Term):
    """The command acts after any delay; before the first one arrives nothing is commanded."""

    effect: ClassVar[str] = "drive-delay"
    law: ClassVar[str] = "delay"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The command takes effect with a delay."
    figure_units: ClassVar[Mapping[str, str]] = {"delay_s": "s"}
    relevant: ClassVar = RelevantSize(
        variant="dead time", part="drive", size=lambda m: ((0.005,), "a delay of 5 ms"),
        commands=frozenset({"duty", "voltage_V", "current_command_A"}),
    )  # fmt: skip

    delay_s: float = parameter(
        unit="s",
        bounds=(0.0, 1.0),
        source="bus and modulation, one to two samples; a fit",
        meaning="Time from a command to its acting at the winding.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The delay."""
        return {"command_delay": self.delay_s}

    def equation(self) -> str:
        return f"acting command(t) = command(t - {self.delay_s:g} s)"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A delay."""
        if not typical.commands - {None, "current_A"}:
            return ()
        return (
            Law(effect=cls.effect, law="dead time", subsystem="drive", kind=cls,
                write=writes_numbers(cls),
                unknowns=(Unknown(name="delay_s", unit="s", low=0.0, high=0.1, scale=0.001),),
                starts=((0.002,), (0.006,), (0.015,))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The delay."""
        return f"a command delay of {f('delay_s', 's')}"
