"""A drive whose output is not in proportion to its command: gain by sign, size and square."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from numba import njit

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, writes_numbers

BY_SIGN, BY_SIZE, BY_SQUARE = slots(
    "command_gain_by_sign", "command_gain_by_size", "command_gain_by_square"
)

GAIN_PRIOR = 0.3  # standard deviation of the change of the gain up to the largest command


@njit(error_model="numpy", inline="always")
def with_nonlinear_gain(fx, command):
    """What a drive with such a gain makes of a command."""
    curved = (fx[BY_SIGN] + fx[BY_SIZE] * command) * abs(command)
    return command + curved + fx[BY_SQUARE] * command * command * command


@dataclass(frozen=True, kw_only=True)
class DriveNonlinearGain(Term):
    """An amplifier that gives less in one direction, or more or less of large commands.

    acting command = u + by_sign |u| + by_size u |u| + by_square u^3. A motor with magnetic
    saturation is one under a commanded current: k_t falls with the current's square. A diagnosis
    that finds it names no effect of the contract: the verdict is `unexplained` with this formula.

    Source
    ------
    The lowest terms of a static input nonlinearity (Hammerstein model: Ljung, System
    Identification, 1999, section 5.2).
    """

    effect: ClassVar[str] = "drive-nonlinear-gain"
    law: ClassVar[str] = "third-order"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The drive's output is not in proportion to its command."
    figure_units: ClassVar[Mapping[str, str]] = {"by_sign": "-", "by_size": "-", "by_square": "-"}

    by_sign: float = parameter(
        0.0, unit="-", bounds=(-1.0, 1.0), source="a fit",
        meaning="Half the difference of the gains for positive and negative commands.",
    )  # fmt: skip
    by_size: float = parameter(
        0.0, unit="-", bounds=(-1e9, 1e9), source="a fit",
        meaning="Change of the gain for each unit of the command's size (duty, V or A).",
    )  # fmt: skip
    by_square: float = parameter(
        0.0, unit="-", bounds=(-1e9, 1e9), source="a fit",
        meaning="Change of the gain for each unit of the command's square.",
    )  # fmt: skip

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The changes of the gain, those by size and square at the full command."""
        full = context.full_command
        return {"by_sign": self.by_sign, "by_size": self.by_size * full,
                "by_square": self.by_square * full**2}  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The changes of the gain."""
        return {"command_gain_by_sign": self.by_sign, "command_gain_by_size": self.by_size,
                "command_gain_by_square": self.by_square}  # fmt: skip

    def equation(self) -> str:
        square = f" + {self.by_square:.4g} u^3" if self.by_square != 0.0 else ""
        return f"acting command = u + {self.by_sign:.4g} |u| + {self.by_size:.4g} u |u|{square}"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """None: it is tried where no effect of the contract is found (`unnamed`)."""
        return ()

    @classmethod
    def unnamed(cls, span: float) -> Law:
        """The gain as free values.

        Parameters
        ----------
        span : float
            Largest command, in its unit.
        """
        # two levels of the command determine neither size nor square: only the priors bound them
        sign = Unknown(name="by_sign", unit="-", low=-0.9, high=0.9, scale=0.005, prior=GAIN_PRIOR)
        size = Unknown(name="by_size", unit="-", low=-0.9 / span, high=0.9 / span,
                       scale=0.01 / span, prior=GAIN_PRIOR / span)  # fmt: skip
        square = Unknown(name="by_square", unit="-", low=-0.9 / span**2, high=0.9 / span**2,
                         scale=0.01 / span**2, prior=GAIN_PRIOR / span**2)  # fmt: skip
        return Law(
            effect=cls.effect, law=cls.law, subsystem="drive", kind=cls,
            write=writes_numbers(cls), unknowns=(sign, size, square), starts=((0.0, 0.0, 0.0),),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The changes."""
        sign, size = f.figures["by_sign"], f.figures["by_size"] + f.figures.get("by_square", 0.0)
        return f"a drive whose gain changes by {sign:+.2%} with the sign, {size:+.2%} up to full"
