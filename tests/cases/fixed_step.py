"""A drive of the bench that moves it through all its effects, and raw numbers for the kernel."""

import numpy as np

import rsea_core.effects.layout as e
from rsea_core import ActuatorModel, Rig
from rsea_core.engines.fixed_step.replay import Numbers, Replay

BENCH = Rig.preset("rsea-bench")
TIME = np.arange(3001) * 1e-3
DUTY = np.round(
    0.12 * np.sin(4.4 * TIME) + 0.08 * np.sin(12.0 * TIME) + 0.05 * np.sin(33.0 * TIME), 2
)


def numbers_with(replay: Replay, rig: Rig = BENCH, **fx: float) -> Numbers:
    """The rig's numbers with effects by their names in EFFECTS."""
    numbers = replay.numbers(ActuatorModel(rig))
    array = numbers.fx.copy()
    for name, value in ({"any": 1.0} | fx).items():
        array[e.EFFECTS.index(name)] = value
    return numbers._replace(fx=array)
