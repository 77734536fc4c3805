"""A spring between the load and the frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.load_base import HELD, draw_over_angle
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values

PARALLEL, PARALLEL_REST = slots("parallel_stiffness", "parallel_rest_angle")


@hook("load_torque")
def parallel_torque(fx, angle, speed, torque):
    """A linear spring to the frame."""
    return torque - fx[PARALLEL] * (angle - fx[PARALLEL_REST])


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind in HELD:
        return
    d.put(PARALLEL, v["stiffness_Nm_per_rad"])
    d.put(PARALLEL_REST, v.get("rest_angle_rad", 0.0))


@dataclass(frozen=True, kw_only=True)
class SpringParallel(Term):
    """A second spring between the load and the ground."""

    effect: ClassVar[str] = "spring-parallel"
    law: ClassVar[str] = "linear"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "A second spring acts on the load."
    figure_units: ClassVar[Mapping[str, str]] = {"stiffness_Nm_per_rad": "Nm/rad"}
    curve: ClassVar = draw_over_angle()
    relevant: ClassVar = RelevantSize(
        variant="linear", part="load",
        size=lambda m: (
            (m.load_torque_Nm, 0.0), f"a parallel spring of {m.load_torque_Nm:.2g} Nm/rad",
        ),
    )  # fmt: skip

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(0.0, 1e9),
        source="cables, a balancing spring; a fit",
        meaning="Stiffness of the second spring between load and ground.",
    )
    rest_angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it rests where the load does",
        meaning="Load angle at which the second spring is unloaded.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and rest angle."""
        return {
            "parallel_stiffness": self.stiffness_Nm_per_rad,
            "parallel_rest_angle": self.rest_angle_rad,
        }

    def equation(self) -> str:
        return f"-{self.stiffness_Nm_per_rad:g} (theta_l - {self.rest_angle_rad:g}) on the load"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Stiffness and rest angle."""
        t, high, turn = typical.load_torque_Nm, 10 * typical.stiffness, 1.0
        if typical.relative:
            t /= typical.angle_rad
            high, turn = 100 * t, min(10 * typical.angle_rad, 7.0)
        return (
            Law(effect=cls.effect, law="linear", subsystem="load", write=_write, kind=cls,
                unknowns=(Unknown(name="stiffness_Nm_per_rad", unit="Nm/rad", low=0.0,
                                  high=high, scale=0.1 * t),
                          Unknown(name="rest_angle_rad", unit="rad", low=-turn, high=turn,
                                  scale=0.02 * turn, prior=0.1 * turn)),
                starts=((0.3 * t, 0.0), (2.0 * t, 0.0))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The stiffness."""
        return f"a second spring at the load, {f('stiffness_Nm_per_rad', 'Nm/rad')}"
