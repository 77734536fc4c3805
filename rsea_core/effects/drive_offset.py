"""A drive that gives something where nothing is commanded: the zero of its amplifier."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from numba import njit

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.drive_dead_zone import beyond_dead_zone
from rsea_core.effects.drive_nonlinear_gain import with_nonlinear_gain
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, writes_numbers

COMMAND_OFFSET = slots("command_offset")


@njit(error_model="numpy", inline="always")
def acting_command(fx, command):
    """What a drive makes of a command: its amplifier's zero added, dead zone, then its gain."""
    return with_nonlinear_gain(fx, beyond_dead_zone(fx, command + fx[COMMAND_OFFSET]))


@dataclass(frozen=True, kw_only=True)
class DriveOffset(Term):
    """A constant that the amplifier adds to every command.

    It belongs to the experiment and not to the machine's physics: a fit may always move it, and
    a diagnosis never claims it.
    """

    effect: ClassVar[str] = "drive-offset"
    law: ClassVar[str] = "constant"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "Amplifier offset: the drive acts where nothing is commanded."
    figure_units: ClassVar[Mapping[str, str]] = {"offset": "-"}

    offset: float = parameter(
        unit="-",
        bounds=(-1e6, 1e6),
        source="an amplifier's data sheet; a fit",
        meaning="Added to every command, in the command's own unit.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The offset."""
        return {"command_offset": self.offset}

    def equation(self) -> str:
        return f"acting command = command + {self.offset:g}"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """None: it is part of every hypothesis (`nuisance`)."""
        return ()

    @classmethod
    def nuisance(cls, span: float, prior: float) -> Law:
        """The offset as a free value of every hypothesis.

        Parameters
        ----------
        span : float
            Largest command, in its unit.
        prior : float
            Standard deviation of the offset, as a share of it.
        """
        offset = Unknown(
            name="offset", unit="-", low=-span, high=span, scale=0.1 * prior * span,
            prior=prior * span,
        )  # fmt: skip
        return Law(
            effect=cls.effect, law=cls.law, subsystem="drive", kind=cls,
            write=writes_numbers(cls), unknowns=(offset,), starts=((0.0,),), nuisance=True,
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The offset."""
        return f"an amplifier that adds {f('offset', '')} to every command"
