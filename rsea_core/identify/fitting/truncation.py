"""A case with no more motion to fit than a diagnosis can replay in the time that it may take.

A search replays every recording that it fits some thousand times; hours of logging would take
hours. The longest recordings are cut to their first part, all to the same length, and a finding
reports it.
"""

from collections.abc import Sequence
from dataclasses import replace

from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

MOST_STEPS, MOST_STEPS_QUICK = 60_000, 30_000  # of one replay of all fitted recordings
LONG = (
    "all recordings together are longer than a diagnosis can replay in its time (--thorough takes"
    " all of it)"
)


def truncate(
    case: Case, step_s: float, most: int, *, reason: str = LONG
) -> tuple[Case, tuple[Finding, ...]]:
    """The case with at most so many steps in a replay of its identification recordings.

    Parameters
    ----------
    step_s : float
        Longest step of a replay; every row takes one at least, and with inf no more.
    reason : str
        What the findings state.

    Returns
    -------
    Case
        The same one where it is short enough.
    tuple of Finding
        What was cut.
    """
    chosen = [r for r in case.identification if not r.quasi_static]
    row_steps = {r.file: max(1.0, r.sample_time_s / step_s) for r in chosen}
    limit = common_limit([r.rows * row_steps[r.file] for r in chosen], most)
    kept, findings = [], []
    for r in case.recordings:
        steps = row_steps.get(r.file, 0.0)
        if r.rows * steps <= limit:
            kept.append(r)
            continue
        rows = int(limit / steps)
        kept.append(rows_between(r, 0, rows))
        text = (
            f"only its first {rows * r.sample_time_s:.4g} s of"
            f" {r.rows * r.sample_time_s:.4g} s were fitted: {reason}"
        )
        findings.append(Finding(kind=Kind.TRUNCATED, text=text, file=r.file))
    return replace(case, recordings=tuple(kept)), tuple(findings)


def common_limit(sizes: Sequence[float], most: float) -> float:
    """The largest size to which sizes can be cut so that their sum is no more than that."""
    left = float(most)
    for count, size in zip(range(len(sizes), 0, -1), sorted(sizes), strict=True):
        if size > left / count:
            return left / count
        left -= size
    return float("inf")


def rows_between(r: Recording, first: int, end: int, *, keep_time: bool = False) -> Recording:
    """The rows from `first` up to `end` of a recording, of its log as well, from time 0 on.

    keep_time : on from the time of the first of them
    """
    columns = {name: read_only(values[first:end].copy()) for name, values in r.columns.items()}
    begin, last = columns["time_s"][0], columns["time_s"][-1]
    zero = 0.0 if keep_time else begin
    columns["time_s"] = read_only(columns["time_s"] - zero)
    logged = r.logged
    if logged is not None:
        reach = 0.5 * r.sample_time_s
        kept = (logged["time_s"] >= begin - reach) & (logged["time_s"] <= last + reach)
        logged = {name: read_only(values[kept]) for name, values in logged.items()}
        logged["time_s"] = read_only(logged["time_s"] - zero)
    return replace(r, columns=columns, logged=logged)
