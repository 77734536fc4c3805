"""The best spring for a task: a search on its grid with the rod model inside.

Differential evolution on the grids' numbers (Storn & Price 1997, as in scipy, integrality on),
on the whole grids and then on a part of them around the best, with Deb's rule for the limits
(feasible before infeasible; CMAME 186, 2000) in stages (`limits.staged_violation`); then quadratic
models of what was judged around the best distinct candidates (`local_models`), and a pattern
search over single and paired steps of the grid. Everything that was judged on the way is
kept: the front of mass, stress and travel is what no other feasible candidate beats in all three.
Deterministic by seed, whatever the number of processes.
"""

import itertools
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution
from threadpoolctl import threadpool_limits

from dftfs.analysis.sizing.archive import Archive, Assess
from dftfs.analysis.sizing.local_models import distinct, follow_models
from dftfs.analysis.sizing.rod_candidate import INFEASIBLE, Candidate, promising
from dftfs.analysis.sizing.task import SizingTask

_POPULATION = 48
_DRAWS = 60  # random candidates for each one of the first population, until its coils stand apart
# share of the grids around the best, and generations there
_ZOOMS = ((1.0, 14), (0.15, 8), (0.04, 8))
_REGIONS = 6  # that local models follow
_MOST_ROUNDS = 6
_STEPS = (1, -1, 4, -4)


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A limit that binds at the best design, and the step that it forbids."""

    limit: str
    step: str
    gain: float


@dataclass(frozen=True, kw_only=True)
class Sizing:
    """What a search found.

    best : the best feasible candidate by the rod model. winners : the feasible candidates from the
    best on, at most one per planar shape. front : not beaten in mass, stress and travel at once.
    stops : limits that bind at the best. judged : number of distinct candidates evaluated.
    """

    task: SizingTask
    best: Candidate
    winners: tuple[Candidate, ...]
    front: tuple[Candidate, ...]
    stops: tuple[Stop, ...]
    judged: int
    wall_s: float


def search(
    archive: Archive,
    *,
    seed: int = 0,
    starts: Sequence[tuple[int, ...]] = (),
    zooms: Sequence[tuple[float, int]] = _ZOOMS,
    population: int = _POPULATION,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Candidate:
    """Fill an archive by evolution on the whole grids and around its best; return the best.

    ``zooms`` are shares of the grids and the generations there; an archive that holds candidates
    already may begin with a part. Nothing feasible after the first two ends the search.
    """
    for number, (share, generations) in enumerate(zooms):
        rng = np.random.default_rng((seed, number))
        if number > 1 and archive.merit(archive.best) >= INFEASIBLE:
            break
        if share == 1.0:
            bounds = [(0, grid.steps) for grid in archive.task.searched]
            first = _first_population(archive.task, rng, starts, population)
        else:
            bounds = _around(archive.task, archive.best.index, share)
            low, high = np.array(bounds, dtype=float).T
            first = np.rint(low + rng.random((population, len(low))) * (high - low))
            first[0] = archive.best.index
        _evolve(archive, bounds, first, generations, rng)
        best = archive.best
        state = (
            f"best so far {archive.merit(best):.4g}" if best.feasible else f"not yet: {best.why}"
        )
        on_progress(f"{len(archive.known)} judged, {state}")
    return archive.best


# with several threads, different round-off would lead to different candidates
@threadpool_limits.wrap(limits=1, user_api="blas")
def size(
    task: SizingTask,
    *,
    seed: int = 0,
    judge: Assess | None = None,
    starts: Sequence[tuple[int, ...]] = (),
    on_progress: Callable[[str], None] = lambda message: None,
) -> Sizing | Archive:
    """Find the best candidate on the task's grids.

    Parameters
    ----------
    judge : callable, optional
        Judges many numbers of the grid, in their order; in this process without it.
    starts : sequence of index tuples
        Candidates to begin with beside the random ones.

    Returns
    -------
    Sizing, or the Archive where nothing that was judged keeps every limit
    (`dftfs.analysis.sizing.relaxation.relaxations` then says which requirement is in the way).
    """
    begun = time.perf_counter()
    archive = Archive.of(task, judge)
    best = search(archive, seed=seed, starts=starts, on_progress=on_progress)
    if not best.feasible:
        return archive
    best = follow_models(archive, distinct(archive, _REGIONS), seed=seed, on_progress=on_progress)
    best, around = _refine(archive, best, on_progress)
    feasible = archive.feasible
    return Sizing(
        task=task,
        best=best,
        winners=tuple(feasible[:12]),
        front=tuple(pareto_front(feasible)),
        stops=_stops(task, best, around),
        judged=len(archive.known),
        wall_s=time.perf_counter() - begun,
    )


def _first_population(
    task: SizingTask,
    rng: np.random.Generator,
    starts: Sequence[tuple[int, ...]],
    population: int,
) -> NDArray:
    """Random candidates whose coils stand apart, as far as so many draws find them."""
    high = np.array([grid.steps for grid in task.searched])
    draws = rng.integers(0, high + 1, size=(_DRAWS * population, len(high)))
    found: list[NDArray] = [np.array(start) for start in starts]
    for draw in draws:
        if len(found) >= population:
            break
        if promising(task, draw):
            found.append(draw)
    found += list(draws[: population - len(found)])
    return np.array(found, dtype=float)


def _around(task: SizingTask, index: tuple[int, ...], share: float) -> list[tuple[int, int]]:
    bounds = []
    for grid, k in zip(task.searched, index):
        reach = max(2, round(share * grid.steps))
        bounds.append((max(0, k - reach), min(grid.steps, k + reach)))
    return bounds


def _evolve(
    archive: Archive,
    bounds: Sequence[tuple[int, int]],
    first: NDArray,
    generations: int,
    rng: np.random.Generator,
) -> None:
    def many(_: Callable, rows: Iterable[np.ndarray]) -> list[float]:
        indices = [tuple(round(float(x)) for x in row) for row in rows]
        return [archive.merit(candidate) for candidate in archive.judge(indices)]

    differential_evolution(
        lambda row: many(None, [row])[0],
        bounds,
        init=first,
        maxiter=generations,
        strategy="currenttobest1bin",
        mutation=(0.4, 0.9),
        recombination=0.85,
        tol=0.0,
        polish=False,
        rng=rng,
        integrality=[high > low for low, high in bounds],
        updating="deferred",
        workers=many,
    )


def _refine(
    archive: Archive, best: Candidate, say: Callable
) -> tuple[Candidate, list[tuple[str, Candidate]]]:
    """Steps of the grid from the best until none helps; the last round's neighbours with names."""
    for turn in range(_MOST_ROUNDS):
        around = _neighbours(archive.task, best.index)
        found = archive.judge(index for _, index in around)
        better = min(found, key=lambda c: (archive.merit(c), c.index))
        if archive.merit(better) >= archive.merit(best):
            break
        best = better
        say(f"grid {turn + 1}: {len(archive.known)} judged, {archive.merit(best):.5g}")
    single = [(step, archive.known[index]) for step, index in around if "," not in step]
    return best, single


def _neighbours(task: SizingTask, index: tuple[int, ...]) -> list[tuple[str, tuple[int, ...]]]:
    """Single steps of several sizes and paired smallest ones, inside the bounds."""
    grids = task.searched
    free = [k for k, grid in enumerate(grids) if grid.steps]
    moves: list[dict[int, int]] = [{k: s} for s in _STEPS for k in free]
    for a, b in itertools.combinations(free, 2):
        moves += [{a: i, b: j} for i in (1, -1) for j in (1, -1)]
    found = []
    for move in moves:
        moved = tuple(v + move.get(k, 0) for k, v in enumerate(index))
        if all(0 <= v <= grid.steps for v, grid in zip(moved, grids)):
            values_text = ", ".join(
                f"{grids[k].name} {s * grids[k].increment:+.4g}" for k, s in move.items()
            )
            found.append((values_text, moved))
    return found


def _stops(
    task: SizingTask, best: Candidate, around: Sequence[tuple[str, Candidate]]
) -> tuple[Stop, ...]:
    """Limits that forbid a better neighbour, and bounds of the grids that the best lies on."""
    name, stops = task.objective, []
    value = best.objective(name)
    for step, candidate in around:  # small steps first: the first to meet a limit names it
        if candidate.feasible or candidate.objective(name) >= value:
            continue
        gain = (value - candidate.objective(name)) / abs(value)
        for limit in candidate.limits:
            if limit.margin < 0 and limit.name not in {stop.limit for stop in stops}:
                stops.append(Stop(limit=limit.name, step=step, gain=gain))
    for grid, k in zip(task.searched, best.index):
        if grid.steps and k in (0, grid.steps):
            end = "minimum" if k == 0 else "maximum"
            stops.append(Stop(limit=f"{grid.name}'s {end}", step="bound", gain=0.0))
    width = task.by_name["width_mm"]
    if (
        best.width_mm is not None
        and width.steps
        and width.nearest(best.width_mm) in (0, width.steps)
    ):
        end = "minimum" if width.nearest(best.width_mm) == 0 else "maximum"
        stops.append(Stop(limit=f"width_mm's {end}", step="bound", gain=0.0))
    return tuple(stops)


def pareto_front(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that no other beats in mass, stress and travel at once, lightest first."""
    keys = np.array([[c.mass_kg, c.stress_Pa, -c.gap_left_m] for c in candidates]).reshape(-1, 3)
    front = []
    for k, key in enumerate(keys):
        beaten = np.all(keys <= key, axis=1) & np.any(keys < key, axis=1)
        if not beaten.any():
            front.append(candidates[k])
    return sorted(front, key=lambda c: (c.mass_kg, c.index))
