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
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, writes_numbers

COMMAND_OFFSET, COMMAND_DRIFT = slots("command_offset", "command_drift")


@njit(error_model="numpy", inline="always")
def acting_command(fx, command):
    """What a drive makes of a command: its amplifier's offset added, dead zone, then its gain."""
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
    def drift(cls, file: str, span: float, prior: float, duration_s: float) -> Law:
        """A slow change of the offset in one recording, which no other one inherits.

        Parameters
        ----------
        file : str
            The recording's.
        span, prior
            As in `nuisance`: the offset that the drift adds by the end, as a share of `span`.
        duration_s : float
            Of the recording.
        """
        most = span / duration_s
        rate = Unknown(
            name="drift_per_s", unit="1/s", low=-most, high=most, scale=0.1 * prior * most,
            prior=prior * most,
        )  # fmt: skip

        def write(v: Mapping[str, float], d: TrialMachine, w: RunConditions) -> None:
            if w.file == file:
                d.put(COMMAND_DRIFT, v["drift_per_s"])

        return Law(
            effect=cls.effect, law="drift", subsystem="drive", kind=cls, only=file, write=write,
            unknowns=(rate,), starts=((0.0,),), nuisance=True,
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The offset."""
        return f"an amplifier that adds {f('offset', '')} to every command"
