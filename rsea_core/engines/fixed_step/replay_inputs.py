"""What a replay accepts: commands, columns of rows, start states."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.engines.fixed_step.body_moves import N_STEP_STATES
from rsea_core.errors import InputError
from rsea_core.machine.inputs import COMMANDS


def known_command(name: str) -> str:
    """The name of a command column; `InputError` for another."""
    if name not in COMMANDS:
        raise InputError(f"command_name {name!r} is not one of {', '.join(COMMANDS)}")
    return name


def column(name: str, values: ArrayLike | None, n: int) -> NDArray:
    """Values (n,), finite; empty where there are none."""
    if values is None:
        return np.zeros(0)
    array = np.array(values, dtype=float)
    if array.shape != (n,):
        raise InputError(f"{name} has shape {array.shape}, time_s has {n} rows")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name}[{int(np.argmin(np.isfinite(array)))}] must be finite")
    return array


def start_states(values: ArrayLike, lead: tuple[int, ...]) -> NDArray:
    """Full states (*lead, N_STEP_STATES), finite; one state will do for a lead of one."""
    array = np.array(values, dtype=float)
    if array.ndim == 1 and lead == (1,):
        array = array[None]
    if array.shape != (*lead, N_STEP_STATES) or not np.all(np.isfinite(array)):
        raise InputError(
            f"start states of shape {array.shape} must be {(*lead, N_STEP_STATES)} finite numbers"
        )
    return array
