"""Controllers that run at their own sample time inside the compiled simulation loop."""

from rsea_core.control.adaptive_impedance import AdaptiveImpedance
from rsea_core.control.base import CompiledController, Controller
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.fractional import FractionalPidTorque
from rsea_core.control.fuzzy_torque import FuzzyTorque
from rsea_core.control.impedance import HybridImpedance
from rsea_core.control.margins import LoopMargins, loop_margins, require_stable
from rsea_core.control.observer import DisturbanceObserverTorque
from rsea_core.control.pid import PidTorque
from rsea_core.control.state_feedback import LqgTorque

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
