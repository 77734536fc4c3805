"""Windows of a recording as jobs of the fast engine (`step_rows.run_jobs`)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.engines.fixed_step.rows import Columns
from rsea_core.errors import InputError


class Plan(NamedTuple):
    """Runs of m models that compiled code may start, w jobs each, model by model.

    All but the last row of a job's window are told by `step_rows.run_jobs`; each job writes at
    its own first row, so that every model can have one array of all rows.
    """

    plants: NDArray
    springs: NDArray
    ends: NDArray
    fx: NDArray
    columns: Columns
    jobs: NDArray  # (m w, 4)
    starts: NDArray  # (m w, N_STEP_STATES), overwritten by a run
    status: NDArray  # (m w,), filled by a run


def windows_of(windows: ArrayLike, rows: int) -> NDArray:
    """First and last rows (2, w) of windows (w, 2) within a recording."""
    first, last = found = np.atleast_2d(np.asarray(windows, dtype=np.int64)).T
    if np.any(first < 0) or np.any(last <= first) or np.any(last >= rows):
        raise InputError(f"windows must be rows first < last within 0..{rows - 1}")
    return found


def covering(windows: ArrayLike, rows: int) -> NDArray:
    """As `windows_of` windows that cover all rows, each once."""
    first, last = found = windows_of(windows, rows)
    if first[0] != 0 or last[-1] != rows - 1 or np.any(first[1:] != last[:-1] + 1):
        raise InputError(f"windows must cover rows 0..{rows - 1}, each once")
    return found


def cover(m: int, ends: NDArray, rows: int) -> NDArray:
    """Jobs (m w, 4) of m models, one after the other, on windows (2, w) that cover all rows."""
    first, last = ends
    model, window = np.divmod(np.arange(m * first.size), first.size)
    at = model * rows + first[window]
    return np.stack([model, first[window], last[window], at], axis=1)
