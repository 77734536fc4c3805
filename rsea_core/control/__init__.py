"""Controllers that run at their own sample time inside the compiled simulation loop."""

from rsea_core.control.base import CompiledController, Controller
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.margins import LoopMargins, loop_margins, require_stable
from rsea_core.control.pid import PidTorque

CONTROLLERS: dict[str, type[Controller]] = {"pid-torque": PidTorque}

__all__ = [
    "CONTROLLERS",
    "CompiledController",
    "Controller",
    "LoopMargins",
    "PidTorque",
    "loop_margins",
    "require_stable",
    "simulate_closed_loop",
]
