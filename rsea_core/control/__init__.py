"""Controllers that run at their own sample time inside the compiled simulation loop."""

from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.adaptive_impedance import AdaptiveImpedance
from rsea_core.control.laws.base import CompiledController, Controller
from rsea_core.control.laws.fractional import FractionalPidTorque
from rsea_core.control.laws.fuzzy_torque import FuzzyTorque
from rsea_core.control.laws.impedance import HybridImpedance
from rsea_core.control.laws.observer import DisturbanceObserverTorque
from rsea_core.control.laws.pid import PidTorque
from rsea_core.control.laws.state_feedback import LqgTorque
from rsea_core.control.stability.margins import LoopMargins, loop_margins, require_stable

CONTROLLERS: dict[str, type[Controller]] = {
    c.kind: c
    for c in (
        PidTorque,
        FuzzyTorque,
        DisturbanceObserverTorque,
        LqgTorque,
        FractionalPidTorque,
        HybridImpedance,
        AdaptiveImpedance,
    )
}

__all__ = [
    "CONTROLLERS",
    "AdaptiveImpedance",
    "CompiledController",
    "Controller",
    "DisturbanceObserverTorque",
    "FractionalPidTorque",
    "FuzzyTorque",
    "HybridImpedance",
    "LoopMargins",
    "LqgTorque",
    "PidTorque",
    "loop_margins",
    "require_stable",
    "simulate_closed_loop",
]
