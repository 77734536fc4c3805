"""A recorded torque as blocks of load: rainflow counting (ASTM E1049-85), library rainflow."""

import csv
from pathlib import Path

import numpy as np

from dftfs.analysis.strength.fatigue import LoadBlock
from dftfs.errors import DesignError

COLUMN = "torque_Nm"
_BINS = 200  # of the largest range: ranges and means are counted together to this


def read_blocks(path: Path, times: float = 1.0) -> list[LoadBlock]:
    """Blocks of a CSV file with a column ``torque_Nm`` (one row a sample), repeated so often.

    Lines that begin with ``#`` are notes. Half cycles count one half.

    Raises
    ------
    DesignError
        If the file cannot be read, has no such column, a value is no number, or the torque never
        turns.
    """
    if not (np.isfinite(times) and times > 0):
        raise DesignError(f"--history-times {times} must be above 0")
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.DictReader(line for line in file if not line.startswith("#"))
            if COLUMN not in (rows.fieldnames or ()):
                found = ", ".join(rows.fieldnames or ()) or "none"
                raise DesignError(f"torque history {path}: no column {COLUMN}; it has {found}")
            values = [row[COLUMN] for row in rows]
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise DesignError(f"torque history {path}: cannot be read: {reason}") from None
    try:
        torque = np.array(values, dtype=float)
    except (TypeError, ValueError):
        torque = np.array([np.nan])
    if not np.isfinite(torque).all():
        raise DesignError(f"torque history {path}: every {COLUMN} must be a number")
    return count_blocks(torque, times, str(path))


def count_blocks(torque_Nm: np.ndarray, times: float, where: str) -> list[LoadBlock]:
    """Blocks of a torque history.

    Raises
    ------
    DesignError
        If the torque does not change.
    """
    import rainflow

    span = float(np.ptp(torque_Nm)) if torque_Nm.size else 0.0
    if span == 0:
        raise DesignError(f"torque history {where}: the torque does not change")
    blocks: dict[tuple[int, int], float] = {}
    step = span / _BINS
    for size, mean, count, _, _ in rainflow.extract_cycles(torque_Nm):
        key = (int(np.ceil(size / step - 1e-9)), round(mean / step))  # ranges rounded up
        blocks[key] = blocks.get(key, 0.0) + count
    return [
        LoadBlock(
            low_Nm=float(mean * step - size * step / 2),
            high_Nm=float(mean * step + size * step / 2),
            cycles=count * times,
        )
        for (size, mean), count in sorted(blocks.items())
        if size > 0
    ]
