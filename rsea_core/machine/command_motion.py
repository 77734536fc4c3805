"""A command that moves linearly between its rows, as held values on finer rows."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.inputs import Inputs

FINER = 3  # rows into which a linearly moving command cuts a row


def between_rows(
    inputs: Inputs, more: Mapping[str, NDArray], finer: int
) -> tuple[Inputs, dict[str, NDArray]]:
    """Inputs on rows so many times finer, the command linear between the old ones.

    Parameters
    ----------
    more : mapping
        Columns (n,) that are held from row to row.
    """
    time = inputs.time_s
    n = time.size
    at = np.arange((n - 1) * finer + 1) / finer
    middle = np.minimum(at + 0.5 / finer, n - 1)
    name = inputs.command_name
    command = np.interp(middle, np.arange(n), getattr(inputs, name))
    held = {key: values[np.minimum(at.astype(int), n - 1)] for key, values in more.items()}
    fine = replace(inputs, time_s=np.interp(at, np.arange(n), time), **{name: command})
    return fine, held
