"""What the inner position loop of a servo adds to its gains: a dead band, a torque limit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.drive_dead_zone import SERVO
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import (
    PLANT,
    Law,
    RunConditions,
    TrialMachine,
    Unknown,
    Values,
    writes_numbers,
)


@dataclass(frozen=True, kw_only=True)
class GoalDeadBand(Term):
    """A servo without torque near its goal: a dead zone of its position error."""

    effect: ClassVar[str] = "drive-dead-zone"
    law: ClassVar[str] = "goal"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The servo has a dead zone: it gives no torque near its goal."
    figure_units: ClassVar[Mapping[str, str]] = {"width_rad": "rad"}

    width_rad: float = parameter(
        unit="rad",
        bounds=(0.0, 1e5),
        source="half-width; firmware of the servo; a fit",
        meaning="Position errors smaller than this give no torque; larger ones lose it.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The half-width."""
        return {"goal_dead_band": self.width_rad}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It is that of a position error."""
        return None if command_name == SERVO else f"needs a drive by {SERVO}"

    def equation(self) -> str:
        return (
            f"acting error = error - {self.width_rad:g} sgn(error)"
            f" where |goal - theta_w| > {self.width_rad:g}, else 0"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A width."""
        if SERVO not in typical.commands:
            return ()
        x = typical.angle_rad
        width = Unknown(name="width_rad", unit="rad", low=0.0, high=x, scale=0.005 * x)
        return (
            Law(effect=cls.effect, law="goal", subsystem="drive", kind=cls,
                write=writes_numbers(cls), unknowns=(width,),
                starts=((0.01 * x,), (0.03 * x,), (0.1 * x,))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The width."""
        return f"a dead zone of the servo, position errors below {f('width_rad', 'rad')}"


def _write_limit(v: Values, d: TrialMachine, w: RunConditions) -> None:
    at = PLANT["current_limit"]  # of a servo: its torque's
    d.plant[at] = min(d.plant[at], v["torque_limit_Nm"])


@dataclass(frozen=True, kw_only=True)
class ServoTorqueLimit(Term):
    """The largest torque of a servo, at the gear's output."""

    effect: ClassVar[str] = "drive-saturation"
    law: ClassVar[str] = "torque-limit"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The servo saturates: it gives less torque than its gains ask for."
    figure_units: ClassVar[Mapping[str, str]] = {"torque_limit_Nm": "Nm"}

    torque_limit_Nm: float = parameter(
        unit="Nm",
        bounds=(1e-12, 1e12),
        source="stall torque of a data sheet; a fit",
        meaning="The torque beyond which the servo gives no more, whatever its error.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """None: it is a number of the plant."""
        return {}

    def on_plant(self, plant):
        """The machine with the lower limit of both."""
        return plant._replace(current_limit=min(plant.current_limit, self.torque_limit_Nm))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It is that of a servo."""
        return None if command_name == SERVO else f"needs a drive by {SERVO}"

    def equation(self) -> str:
        return f"|tau_drive| <= {self.torque_limit_Nm:g} Nm"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A limit, from a fraction of the usual torque to what no motion reaches."""
        if SERVO not in typical.commands:
            return ()
        ratio = 1.0 if typical.rig is None else typical.rig.gear_ratio or 1.0
        usual = typical.motor_torque_Nm * ratio
        limit = Unknown(name="torque_limit_Nm", unit="Nm", low=0.1 * usual, high=20.0 * usual,
                        scale=0.03, log=True)  # fmt: skip
        starts = tuple((share * usual,) for share in (4.0, 2.5, 1.5, 1.0))
        return (
            Law(effect=cls.effect, law="torque limit", subsystem="drive", kind=cls,
                write=_write_limit, unknowns=(limit,), starts=starts),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The limit."""
        return f"a torque limit of the servo of {f('torque_limit_Nm', 'Nm')}"
