"""The best spring for a task: a search on its grid with the rod model inside.

Differential evolution on the grids' numbers (Storn & Price 1997, as in scipy, integrality on)
with Deb's rule for the limits (feasible before infeasible, then by violation; CMAME 186, 2000),
then a pattern search over single and paired steps of the grid from the best found. Everything
that was judged on the way is kept: the front of mass, stress and travel is what no other feasible
candidate beats in all three. Deterministic by seed, whatever the number of processes.
"""

import itertools
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import differential_evolution

from dftfs.analysis.sizing.rod_candidate import Candidate, assess
from dftfs.analysis.sizing.task import SizingTask
from dftfs.errors import SolveError

Assess = Callable[[Sequence[tuple[int, ...]]], Iterable[Candidate]]

_POPULATION = 48
_GENERATIONS = 16
_MOST_ROUNDS = 12
_STEPS = (1, -1, 4, -4, 16, -16)


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


@dataclass
class _Archive:
    """Candidates by their index; each is judged once."""

    task: SizingTask
    assess: Assess
    known: dict[tuple[int, ...], Candidate] = field(default_factory=dict)

    def judge(self, indices: Iterable[tuple[int, ...]]) -> list[Candidate]:
        wanted = list(indices)
        new = [index for index in dict.fromkeys(wanted) if index not in self.known]
        for candidate in self.assess(new) if new else ():
            self.known[candidate.index] = candidate
        return [self.known[index] for index in wanted]

    @property
    def feasible(self) -> list[Candidate]:
        """All feasible ones, the best first; ties by index, so that the order is one."""
        found = [candidate for candidate in self.known.values() if candidate.feasible]
        return sorted(found, key=lambda c: (c.merit(self.task.objective), c.index))


def size(
    task: SizingTask,
    *,
    seed: int = 0,
    judge: Assess | None = None,
    starts: Sequence[tuple[int, ...]] = (),
    on_progress: Callable[[str], None] = lambda message: None,
) -> Sizing:
    """Find the best candidate on the task's grids.

    Parameters
    ----------
    judge : callable, optional
        Judges many numbers of the grid, in their order; in this process without it.
    starts : sequence of index tuples
        Candidates to begin with beside the random ones.

    Raises
    ------
    SolveError
        If nothing on the grids keeps every limit; the message names the nearest and its limit.
    """
    begun = time.perf_counter()
    archive = _Archive(task=task, assess=judge or (lambda many: (assess(task, i) for i in many)))
    _evolve(archive, seed, starts, on_progress)
    best = _best(archive)
    best, around = _refine(archive, best, on_progress)
    if not best.feasible:
        raise SolveError(_no_answer(task, best))
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


def _evolve(archive: _Archive, seed: int, starts: Sequence[tuple[int, ...]], say: Callable) -> None:
    grids, name = archive.task.searched, archive.task.objective
    bounds = [(0, grid.steps) for grid in grids]
    rng = np.random.default_rng(seed)
    first = np.stack([rng.permutation(np.linspace(0, high, _POPULATION)) for _, high in bounds], 1)
    for row, start in zip(first, starts):
        row[:] = start

    def many(_: Callable, rows: Iterable[np.ndarray]) -> list[float]:
        indices = [tuple(round(float(x)) for x in row) for row in rows]
        return [candidate.merit(name) for candidate in archive.judge(indices)]

    generation = itertools.count(1)

    def tell(intermediate_result: object) -> None:
        best = _best(archive)
        state = f"{name} {best.objective(name):.4g}" if best.feasible else f"not yet: {best.why}"
        say(f"generation {next(generation)}: {len(archive.known)} judged, {state}")

    differential_evolution(
        lambda row: many(None, [row])[0],
        bounds,
        init=first,
        maxiter=_GENERATIONS,
        strategy="currenttobest1bin",
        mutation=(0.4, 0.9),
        recombination=0.85,
        tol=0.0,
        polish=False,
        rng=np.random.default_rng(seed),
        integrality=[high > 0 for _, high in bounds],
        updating="deferred",
        workers=many,
        callback=tell,
    )


def _best(archive: _Archive) -> Candidate:
    name = archive.task.objective
    return min(archive.known.values(), key=lambda c: (c.merit(name), c.index))


def _refine(
    archive: _Archive, best: Candidate, say: Callable
) -> tuple[Candidate, list[tuple[str, Candidate]]]:
    """Steps of the grid from the best until none helps; the last round's neighbours with names."""
    name = archive.task.objective
    for turn in range(_MOST_ROUNDS):
        around = _neighbours(archive.task, best.index)
        found = archive.judge(index for _, index in around)
        better = min(found, key=lambda c: (c.merit(name), c.index))
        if better.merit(name) >= best.merit(name):
            break
        best = better
        say(f"grid {turn + 1}: {len(archive.known)} judged, {name} {best.objective(name):.5g}")
    single = [(step, archive.known[index]) for step, index in around if "," not in step]
    return best, single


def _neighbours(task: SizingTask, index: tuple[int, ...]) -> list[tuple[str, tuple[int, ...]]]:
    """Single steps of several sizes and paired smallest ones, inside the bounds."""
    grids = task.searched
    moves: list[dict[int, int]] = [{k: s} for s in _STEPS for k in range(len(grids))]
    for a, b in itertools.combinations(range(len(grids)), 2):
        moves += [{a: i, b: j} for i in (1, -1) for j in (1, -1)]
    found = []
    for move in moves:
        moved = tuple(v + move.get(k, 0) for k, v in enumerate(index))
        if all(0 <= v <= grid.steps for v, grid in zip(moved, grids)):
            words = ", ".join(
                f"{grids[k].name} {s * grids[k].increment:+.4g}" for k, s in move.items()
            )
            found.append((words, moved))
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


def _no_answer(task: SizingTask, nearest: Candidate) -> str:
    size = ", ".join(f"{name} {value:g}" for name, value in nearest.values_mm)
    broken = [
        f"{limit.name} {limit.found:.4g} {limit.unit} against {limit.asked:.4g}"
        for limit in nearest.limits
        if limit.margin < 0
    ]
    return (
        f"task {task.name}: no candidate on the grids is within every limit; the nearest is {size}:"
        f" {'; '.join(broken) or nearest.why}. A wider range, a less strict limit or another"
        " material would work"
    )
