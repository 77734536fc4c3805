"""What a search fits of a case: so many rows, of motion and not of standstill.

A search simulates every row some thousand times. A recording with more rows than its share is cut;
what is kept begins where its motion does. Rows that a search leaves out are held out: laws must
predict them (`with_excerpts`). A quick look has few rows. Where a cycle of a slow motion has more
rows than that, only every so manieth row is kept, as far as the fastest cycle of machine and motion
allows.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rsea_core.identify.candidates.motion_cycles import cycle_s, rate_without_noise
from rsea_core.identify.fitting.decimation import decimate
from rsea_core.identify.fitting.problem import machine_of
from rsea_core.identify.fitting.truncation import common_limit, rows_between
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

BRIEF_ROWS, BRIEF_ROWS_OF_EACH = 2500, 250  # fitted: of all recordings, or more of many
SEARCH_ROWS, SEARCH_ROWS_OF_EACH = 12_000, 1000  # the same of a search that is no quick look
SEARCH_CYCLES = 1.0  # of its own motion, that a recording shows in its rows searched
MOST_SEARCH_ROWS = 16_000
LONG = 1.25  # times these rows, that a recording has which is cut
MOST_ROWS = 2  # times as many, where motions are slow
ROWS_OF_CYCLE = 10  # of the fastest cycle, at least
CYCLES = 1.0  # of its own motion, that a recording should show
MOVED = 10.0  # noise deviations that a reading moves where a motion begins
LEAD = 0.05  # of the rows that are kept, before it
REASON = "without --quick all rows are"


def brief_case(case: Case) -> tuple[Case, tuple[Finding, ...]]:
    """The case with few rows of each recording that is fitted, and what was left out.

    Returns
    -------
    Case
        The same one where it is short enough.
    tuple of Finding
        What was taken together or cut.
    """
    most = max(BRIEF_ROWS, BRIEF_ROWS_OF_EACH * len(case.identification))
    if sum(r.rows for r in case.identification) <= most:
        return case, ()
    coarse, findings = _in_coarse_rows(case, most)
    most = min(max(most, _rows_of_motion(coarse)), MOST_ROWS * most)
    limits = _shared_out(coarse, most)
    recordings = []
    for r in coarse.recordings:
        limit = limits.get(id(r), r.rows)
        if limit >= r.rows:
            recordings.append(r)
            continue
        kept = f"{limit * r.sample_time_s:.4g} s of its {r.rows * r.sample_time_s:.4g} s were"
        text = f"only {kept} fitted: {REASON}" if limit else f"not fitted: {REASON}"
        findings += (Finding(kind=Kind.TRUNCATED, file=r.file, text=text),)
        if limit:
            recordings.append(rows_between(_from_first_motion(coarse, r, limit), 0, limit))
    return replace(coarse, recordings=tuple(recordings)), findings


def _shared_out(case: Case, most: int) -> dict[int, int]:
    """Rows that are fitted of each identification recording, by its id; 0: it is left out.

    Recordings whose motion shows a cycle in the fewest rows come first, one of each kind of load
    before all others: a whole cycle of some says more than the beginning of all.
    """
    chosen = [r for r in case.identification if not r.quasi_static]
    least = min(BRIEF_ROWS_OF_EACH, most // max(len(chosen), 1))
    wanted = {id(r): min(r.rows, max(least, int(_span_s(r) / r.sample_time_s))) for r in chosen}
    order = sorted(chosen, key=lambda r: wanted[id(r)])
    firsts = [next(r for r in order if r.load.kind == k) for k in {r.load.kind: 0 for r in order}]
    limits, left = dict.fromkeys(wanted, 0), most
    for r in (*firsts, *(r for r in order if not any(r is f for f in firsts))):
        forced = any(r is f for f in firsts)
        if wanted[id(r)] <= left or forced:
            limits[id(r)] = max(min(wanted[id(r)], left), least)
            left -= limits[id(r)]
    kept = [r for r in chosen if limits[id(r)]]
    level = common_limit([r.rows for r in kept], most)
    for r in sorted(kept, key=lambda r: limits[id(r)]):
        more = min(max(int(min(level, r.rows)) - limits[id(r)], 0), max(left, 0))
        limits[id(r)] += more
        left -= more
    return limits


def with_excerpts(case: Case) -> tuple[Case, tuple[Finding, ...]]:
    """The case with long recordings fitted by their first rows of motion, the rest held out.

    Returns
    -------
    Case
        The same one where it is short enough.
    tuple of Finding
        What was held out.
    """
    chosen = [r for r in case.identification if not r.quasi_static]
    least = max(SEARCH_ROWS // max(len(chosen), 1), SEARCH_ROWS_OF_EACH)
    wanted = [max(least, int(_span_s(r, SEARCH_CYCLES) / r.sample_time_s)) for r in chosen]
    wanted = [min(rows, r.rows) for rows, r in zip(wanted, chosen, strict=True)]
    longest = common_limit(wanted, max(MOST_SEARCH_ROWS, least * len(chosen)))
    limits = {id(r): int(min(rows, longest)) for rows, r in zip(wanted, chosen, strict=True)}
    if sum(r.rows for r in chosen) < LONG * sum(limits.values()):
        return case, ()
    recordings, findings = [], []
    for r in case.recordings:
        limit = limits.get(id(r), r.rows)
        if r.rows < LONG * limit:
            recordings.append(r)
            continue
        moving = _from_first_motion(case, r, limit)
        rest = rows_between(moving, limit, moving.rows, keep_time=True)
        recordings += [
            rows_between(moving, 0, limit),
            replace(rest, role="validation", initial_rest=False),
        ]
        text = (
            f"{limit * r.sample_time_s:.3g} s of its {r.rows * r.sample_time_s:.3g} s were fitted,"
            " the rest was held out"
        )
        findings.append(Finding(kind=Kind.TRUNCATED, text=text, file=r.file))
    return replace(case, recordings=tuple(recordings)), tuple(findings)


def _rows_of_motion(case: Case) -> int:
    """Rows in which every recording shows a cycle of its own motion."""
    longest = max(_span_s(r) / r.sample_time_s for r in case.identification)
    return int(longest * len(case.identification))


def _span_s(r: Recording, cycles: float = CYCLES) -> float:
    """Seconds in which a recording shows so many cycles of its motion; all of it at most."""
    return min(cycles * 2.0 * np.pi / max(rate_without_noise(r), 1e-9), r.rows * r.sample_time_s)


def _in_coarse_rows(case: Case, most: int) -> tuple[Case, tuple[Finding, ...]]:
    """Rows as long as the fastest cycle of all recordings allows, and no longer than needed."""
    problem = MultistepProblem(case)
    cycles = [
        cycle_s(machine_of(e.base), e.stiffness, e.recording, rate=rate_without_noise(e.recording))
        for e in problem.prepared
    ]
    longest_s = min(cycles) / ROWS_OF_CYCLE
    share = most / len(case.identification)
    needed_s = max(_span_s(r) for r in case.identification) / share
    coarse = decimate(case, min(longest_s, needed_s), jumps=True)
    made = zip(case.recordings, coarse.recordings, strict=True)
    # rows at uneven times cannot be counted off
    made = tuple(new if old.logged is None else old for old, new in made)
    coarse = replace(coarse, recordings=made)
    findings = tuple(
        Finding(
            kind=Kind.TRUNCATED,
            file=new.file,
            text=f"every {round(new.sample_time_s / old.sample_time_s)}th row was fitted, with the"
            f" mean of the command between: {REASON}",
        )
        for old, new in zip(case.recordings, coarse.recordings, strict=True)
        if new.rows < old.rows and new.role == "identification"
    )
    return coarse, findings


def _from_first_motion(case: Case, r: Recording, limit: int) -> Recording:
    """A recording without the standstill at its beginning, as far as more than `limit` are left."""
    spare = r.rows - limit
    if r.role != "identification" or r.quasi_static or not r.initial_rest or spare <= 0:
        return r
    floors = noise_floor(case.rig, r)
    begins = [_first_beyond(r[name], MOVED * floors[name]) for name in r.responses]
    lead = int(LEAD * (r.rows - spare))
    first = min(max(min(begins) - lead, 0), spare) if begins else 0
    return rows_between(r, first, r.rows) if first else r


def _first_beyond(values: Sequence[float], allowed: float) -> int:
    """The first row that differs from the first one by more than is allowed; all rows if none."""
    far = np.abs(np.asarray(values) - values[0]) > allowed
    return int(np.argmax(far)) if far.any() else len(values)
