"""How an effect is written down: what it changes in the machine, and what the label says of it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from dftfs.proof.machine import Machine, Physics, Series
from dftfs.proof.readings import Fault


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """An external torque during part of one recording."""

    start_s: float
    end_s: float
    peak_Nm: float
    corner: float

    def torque(self, time_s: np.ndarray) -> np.ndarray:
        """A push with rounded ends: ``corner`` 1 is a half sine, small values are a plateau."""
        share = np.clip((time_s - self.start_s) / (self.end_s - self.start_s), 0.0, 1.0)
        return self.peak_Nm * np.sin(np.pi * share) ** self.corner * ((share > 0) & (share < 1))


@dataclass(frozen=True, kw_only=True)
class Applied:
    """One effect at one strength: changes by field name, and the comparable parameters."""

    name: str = ""
    subsystem: str = ""
    parameters: dict[str, float] = field(default_factory=dict)
    physics: dict[str, float] = field(default_factory=dict)
    series: dict[str, np.ndarray] = field(default_factory=dict)
    machine: dict[str, float] = field(default_factory=dict)
    faults: dict[str, Fault] = field(default_factory=dict)
    pulse: Pulse | None = None
    brown_out: float = 0.0
    description: str = ""


Effect = Callable[[float], Applied]
Draw = Callable[[np.random.Generator, Machine], Effect]


class Effects(dict[str, Draw]):
    """Functions that draw an effect, by its name, in the order in which they are written."""

    def add(self, name: str, subsystem: str) -> Callable[[Draw], Draw]:
        """Decorator: keep a function here, which need not repeat name and subsystem."""

        def put(draw: Draw) -> Draw:
            def named(rng: np.random.Generator, machine: Machine) -> Effect:
                at = draw(rng, machine)
                return lambda strength: replace(at(strength), name=name, subsystem=subsystem)

            self[name] = named
            return named

        return put


def changed(
    machine: Machine, applied: tuple[Applied, ...]
) -> tuple[Machine, Physics, Series, dict[str, Fault]]:
    """The machine with all these effects. Effects of one case never change the same field."""
    physics: dict[str, float] = {}
    series: dict[str, np.ndarray] = {}
    faults: dict[str, Fault] = {}
    constants: dict[str, float] = {}
    for one in applied:
        physics |= one.physics
        series |= one.series
        faults |= one.faults
        constants |= one.machine
    return (
        machine._replace(**constants),
        Physics(**physics),
        Series(**series),
        faults,
    )
