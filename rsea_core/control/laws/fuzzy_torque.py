"""Fuzzy torque control: the thesis' FL-FFC, and FTC-FC with its friction compensation.

    duty = G_u (U(-G_e e, -G_de de/dt) - 50) / 50 + R (u + K_i int e) / (N k_t V) + back-EMF

U is the fuzzy table's answer in per cent of PWM, 50 of which is neutral; u is what `torque_loop`
prepares (feedforward, and friction compensation for FTC-FC, whose law the thesis leaves out:
section 4.3.4). The signs are those that make the table's rules push against the error.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import cfunc

import rsea_core.control.laws.torque_loop as loop
import rsea_core.engines.event_driven.states as k
from rsea_core.control.fuzzy.inference import AGGREGATIONS, FuzzySystem, infer
from rsea_core.control.fuzzy.thesis_rules import TABLES, torque_table
from rsea_core.control.laws.base import require_choices
from rsea_core.numeric.source_version import SOURCE_VERSION

PER_ERROR, PER_RATE, PER_PERCENT, KI, SIZE = range(loop.N_SHARED, loop.N_SHARED + 5)
TABLE = loop.N_SHARED + 5


@dataclass(frozen=True, kw_only=True)
class FuzzyTorque(loop.TorqueLoop):
    """Mamdani torque loop with feedforward and, as FTC-FC, friction compensation.

    Attributes
    ----------
    error_scale_per_Nm : float
        G_e: table units per Nm. The table spans +-9.
    rate_scale_s_per_Nm : float
        G_de: table units per Nm/s. The table spans +-6; one encoder count at 1 kHz is already
        50 Nm/s, so that the printed scale of 1 knows only its outermost sets.
    output_scale : float
        G_u: share of the full command that the table's full range commands.
    ki : float
        1/s, of an integral beside the table; the thesis has none.
    table : "corrected" or "printed"
    aggregation : "sum" (the thesis' 4.10) or "max"

    The others, and what is raised, are those of `torque_loop.TorqueLoop`.
    """

    kind: ClassVar[str] = "fuzzy-torque"
    gain_varies: ClassVar[bool] = True
    gains: ClassVar[tuple[str, ...]] = (
        "error_scale_per_Nm", "rate_scale_s_per_Nm", "output_scale", "ki"
    )  # fmt: skip

    error_scale_per_Nm: float = 0.5
    rate_scale_s_per_Nm: float = 0.001
    output_scale: float = 1.0
    ki: float = 10.0
    table: str = "corrected"
    aggregation: str = "sum"

    def __post_init__(self):
        super().__post_init__()
        require_choices(self, table=TABLES, aggregation=AGGREGATIONS)

    def system(self) -> FuzzySystem:
        """The table that it asks."""
        return torque_table(self.table, self.aggregation)

    def own(self, machine: loop.LoopMachine):
        """Scales, the integral's gain and the table."""
        packed = self.system().packed()
        percent = self.output_scale * machine.limit / 50.0
        own = [self.error_scale_per_Nm, self.rate_scale_s_per_Nm, percent, self.ki, packed.size]
        return _compiled(SOURCE_VERSION), np.concatenate((own, packed))


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def fuzzy(p, s, y, command):
        if version < 0:
            return
        size = int(p[SIZE])
        spring = p[TABLE + size :].reshape(-1, 6)
        error = loop.sense(p, s, y, spring)
        torque, friction, compensated = loop.prepared(p, s, y, spring)
        percent = infer(
            p[TABLE : TABLE + size], -p[PER_ERROR] * error, -p[PER_RATE] * s[loop.SLOPE_E]
        )
        base = p[PER_PERCENT] * (percent - 50.0)
        base += p[loop.PER_TORQUE] * (torque + friction) + p[loop.PER_SPEED] * compensated
        loop.give(p, command, loop.integrated(p, s, base, p[KI] * p[loop.T] * error))

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(fuzzy)
