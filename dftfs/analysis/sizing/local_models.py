"""Trust regions with quadratic models of the objective and of every limit's margin.

At the best spring several limits are active at once. An evolutionary search approaches such a point
slowly, because most steps towards it violate one of the limits. Objective and margins are smooth
functions of the dimensions, however: a quadratic is fitted to each from the candidates evaluated
nearby (nearer ones weigh more, second derivatives are damped), SLSQP minimises the objective
subject to the margins within a trust region, and the points of the grid around the minimum are
evaluated. The region moves to a better candidate, and shrinks if there is none (Conn, Gould &
Toint, Trust-Region Methods, 2000). Number of arms and material stay those of the region's centre.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from dftfs.analysis.sizing.archive import Archive
from dftfs.analysis.sizing.limits import STIFFNESS, Limit
from dftfs.analysis.sizing.rod_candidate import Candidate
from dftfs.analysis.sizing.task import SizingTask

_CHOSEN = ("n_arms", "material_number")  # no quadratic runs through them
_FIRST_REACH = 0.06  # of the grids
_WIDER, _NARROWER = 1.5, 0.5
_LEAST_REACH = 0.75  # steps of the grid: narrower regions hold nothing but their centre
_FURTHEST = 4.0  # reaches from the centre to a candidate that a model may use
_MOST_USED = 160
_DAMPING = 0.03  # of second derivatives, against the fit's residuals
_RESERVES = (0.0, 1.0, -1.0)  # fit's errors that are kept to a limit
_POINTS_EACH = 4  # of the grid, of each minimum
_AT_RANDOM = 4  # in the region, so that the next fit knows all of it
_ROUNDS = 14
_APART = 0.05  # of the grids, in some dimension: other regions


@dataclass
class Region:
    """Where a model is trusted: around a candidate, so many steps of each grid."""

    centre: Candidate
    reach: NDArray

    @property
    def open(self) -> bool:
        """Whether there is anything left to look for."""
        return bool(np.any(self.reach >= _LEAST_REACH))


@dataclass(frozen=True, kw_only=True)
class Quadratics:
    """Quadratic functions of the steps from a centre over the reach, each a column of numbers.

    The first is the objective, the others margins of limits that must stay positive; ``errors``
    are the fit's (root mean square of the residuals).
    """

    numbers: NDArray
    errors: NDArray

    def values(self, z: NDArray) -> NDArray:
        """Values (..., m) at points (..., n)."""
        return _terms(z) @ self.numbers

    def jacobian(self, z: NDArray) -> NDArray:
        """Derivatives (n, m) at a point (n,)."""
        n = len(z)
        found = np.empty((n, self.numbers.shape[1]))
        for k in range(n):
            ahead, behind = z.copy(), z.copy()
            ahead[k] += 0.5
            behind[k] -= 0.5
            found[k] = self.values(ahead) - self.values(behind)  # exact of a quadratic
        return found


def follow_models(
    archive: Archive,
    starts: Sequence[Candidate],
    *,
    seed: int,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Candidate:
    """Evaluate the minima of local models around some candidates until none is an improvement.

    The points of all regions are evaluated in one batch, so that several processes are busy.
    """
    rng, steps = np.random.default_rng((seed, len(_CHOSEN))), _free_steps(archive.task)
    regions = [Region(start, np.maximum(_FIRST_REACH * steps, 2.0)) for start in starts]
    for turn in range(_ROUNDS):
        regions = [region for region in regions if region.open]
        wanted = [_promised(archive, region, rng) for region in regions]
        archive.judge(index for indices in wanted for index in indices)
        for region, indices in zip(regions, wanted):
            _update(archive, region, indices)
        regions = _apart(archive, regions)
        if not regions:
            break
        best = archive.merit(archive.best)
        on_progress(f"models {turn + 1}: {len(archive.known)} judged, {best:.5g}")
    return archive.best


def distinct(archive: Archive, most: int) -> list[Candidate]:
    """The best feasible candidates that are not near a better one."""
    found: list[Candidate] = []
    for candidate in archive.feasible:
        if len(found) == most:
            break
        if not any(_near(archive.task, candidate, other) for other in found):
            found.append(candidate)
    return found


def _free(task: SizingTask) -> list[int]:
    return [k for k, g in enumerate(task.searched) if g.steps and g.name not in _CHOSEN]


def _free_steps(task: SizingTask) -> NDArray:
    return np.array([task.searched[k].steps for k in _free(task)], dtype=float)


def _chosen(task: SizingTask, index: Sequence[int]) -> tuple[int, ...]:
    return tuple(index[k] for k, grid in enumerate(task.searched) if grid.name in _CHOSEN)


def _near(task: SizingTask, one: Candidate, other: Candidate) -> bool:
    if _chosen(task, one.index) != _chosen(task, other.index):
        return False
    free = _free(task)
    apart = np.abs(np.subtract(one.index, other.index))[free]
    return bool(np.all(apart <= np.maximum(_APART * _free_steps(task), 1.0)))


def _update(archive: Archive, region: Region, indices: Sequence[tuple[int, ...]]) -> None:
    found = [archive.known[index] for index in indices]
    best = min(found, key=lambda c: (archive.merit(c), c.index), default=region.centre)
    if archive.merit(best) < archive.merit(region.centre):
        free = _free(archive.task)
        far = np.abs(np.subtract(best.index, region.centre.index))[free] > 0.5 * region.reach
        region.reach = region.reach * (_WIDER if far.any() else 1.0)
        region.centre = best
    else:
        region.reach = region.reach * _NARROWER


def _apart(archive: Archive, regions: Sequence[Region]) -> list[Region]:
    """Regions without those that have come near a better one."""
    kept: list[Region] = []
    for region in sorted(regions, key=lambda r: (archive.merit(r.centre), r.centre.index)):
        if not any(_near(archive.task, region.centre, other.centre) for other in kept):
            kept.append(region)
    return kept


def _promised(archive: Archive, region: Region, rng: np.random.Generator) -> list[tuple[int, ...]]:
    """Numbers of the grid to evaluate next, none of them known."""
    task, free = archive.task, _free(archive.task)
    centre = np.array(region.centre.index, dtype=float)[free]
    low = np.maximum(-centre, -region.reach) / region.reach
    high = np.minimum(_free_steps(task) - centre, region.reach) / region.reach
    models = _fitted(archive, region)
    found: dict[tuple[int, ...], None] = {}

    def add(z: NDArray) -> None:
        moved = np.rint(np.clip(centre + z * region.reach, 0, _free_steps(task)))
        index = list(region.centre.index)
        for k, value in zip(free, moved):
            index[k] = int(value)
        if tuple(index) not in archive.known:
            found[tuple(index)] = None

    for reserve in _RESERVES if models is not None else ():
        z = _least(models, low, high, reserve)
        around = _grid_points(z, centre, region.reach, low, high)
        ranked = _ranking(models, around, reserve)
        for point in around[ranked[:_POINTS_EACH]]:
            add(point)
    count = _AT_RANDOM if models is not None else 2 * _AT_RANDOM
    for point in low + rng.random((count, len(free))) * (high - low):
        add(point / 2 if models is not None else point)
    return list(found)


def _fitted(archive: Archive, region: Region) -> Quadratics | None:
    """Models of the candidates around; None if too few of them were loaded."""
    task, free = archive.task, _free(archive.task)
    chosen = _chosen(task, region.centre.index)
    names = [limit.name for limit in region.centre.limits]
    used = [
        candidate
        for candidate in archive.known.values()
        if candidate.stress_Pa is not None
        and _chosen(task, candidate.index) == chosen
        and [limit.name for limit in candidate.limits[: len(names)]] == names
    ]
    if not used:
        return None
    index = np.array([candidate.index for candidate in used], dtype=float)[:, free]
    z = (index - np.array(region.centre.index, dtype=float)[free]) / region.reach
    distance = np.max(np.abs(z), axis=1)
    order = np.argsort(distance, kind="stable")[:_MOST_USED]
    order = order[distance[order] <= _FURTHEST]
    if len(order) < len(free) + 2:
        return None
    values = np.array([_exact(task, used[k], len(names)) for k in order])
    return _fit(z[order], values)


def _exact(task: SizingTask, candidate: Candidate, count: int) -> list[float]:
    """Objective and margins at the width that gives the stiffness exactly, before it is rounded.

    Torque and mass are proportional to the width, stress inversely: rounding makes them jump.
    """
    grid, width = task.by_name["width_mm"], candidate.width_mm or 0.0
    share = task.stiffness_Nm_per_rad / (candidate.stiffness_Nm_per_rad or np.inf)
    # that width may lie outside of the grid by the tolerance of the stiffness
    spare = 1 + task.stiffness_tolerance
    widths = [share * width / grid.low - 1 / spare, spare - share * width / grid.value(grid.steps)]
    if grid.nearest(width) in (0, grid.steps):
        share = 1.0
    power = {"mass": 1.0, "stress": -1.0, "travel": 0.0}[task.objective]
    found = [candidate.objective(task.objective) * share**power]
    for limit in candidate.limits[:count]:
        if limit.name == STIFFNESS:
            found += widths
        elif limit.stage == "contact":
            found.append((1 + limit.margin) * share - 1)
        elif limit.stage in ("stress", "life"):
            found += _of_each_stress(candidate, limit, share)
        else:
            found.append(limit.margin)
    return found


def _of_each_stress(candidate: Candidate, limit: Limit, share: float) -> list[float]:
    """Margins of each stress that enters a limit: their maximum is not differentiable."""
    stresses = candidate.stresses_Pa
    if limit.stage == "life":
        stresses = stresses[::2] if " arm " in limit.name else stresses[1::2]
    used = (1 - limit.margin) / share / max(stresses)
    return [1 - used * stress for stress in stresses]


def _fit(z: NDArray, values: NDArray) -> Quadratics:
    """Weighted least squares, second derivatives damped; values in units of their spread."""
    n = z.shape[1]
    weight = np.exp(-0.5 * np.sum((z / 1.5) ** 2, axis=1) / n) + 1e-3
    terms = _terms(z)
    scale = np.maximum(np.std(values, axis=0), 1e-12)
    mean = values.mean(axis=0)
    damped = np.zeros(terms.shape[1])
    damped[1 + n :] = np.sqrt(_DAMPING)
    damped[1 : 1 + n] = 1e-4
    left = np.vstack([weight[:, None] * terms, np.diag(damped)])
    scaled = (values - mean) / scale
    right = np.vstack([weight[:, None] * scaled, np.zeros((len(damped), values.shape[1]))])
    numbers = np.linalg.lstsq(left, right, rcond=None)[0]
    residual = terms @ numbers - scaled
    errors = np.sqrt(np.average(residual**2, axis=0, weights=weight**2))
    numbers = numbers * scale
    numbers[0] += mean
    return Quadratics(numbers=numbers, errors=errors * scale)


def _terms(z: NDArray) -> NDArray:
    n = z.shape[-1]
    pairs = [z[..., i] * z[..., j] for i, j in itertools.combinations_with_replacement(range(n), 2)]
    return np.stack([np.ones(z.shape[:-1]), *np.moveaxis(z, -1, 0), *pairs], axis=-1)


def _least(models: Quadratics, low: NDArray, high: NDArray, reserve: float) -> NDArray:
    """The objective's least value inside a box where all margins are kept, by the models."""
    kept = reserve * models.errors[1:]
    unit = max(models.errors[0], 1e-9 * abs(models.numbers[0, 0]), 1e-12)
    found = minimize(
        lambda z: models.values(z)[0] / unit,
        np.zeros(len(low)),
        jac=lambda z: models.jacobian(z)[:, 0] / unit,
        bounds=list(zip(low, high)),
        constraints={
            "type": "ineq",
            "fun": lambda z: models.values(z)[1:] - kept,
            "jac": lambda z: models.jacobian(z)[:, 1:].T,
        },
        method="SLSQP",
        options={"maxiter": 60, "ftol": 1e-7},
    )
    return np.clip(np.nan_to_num(found.x), low, high)


def _grid_points(
    z: NDArray, centre: NDArray, reach: NDArray, low: NDArray, high: NDArray
) -> NDArray:
    """Points of the grid on all sides of a point, as steps over the reach."""
    place = centre + z * reach
    sides = [sorted({np.floor(x), np.ceil(x)}) for x in place]
    points = (np.array(list(itertools.product(*sides))) - centre) / reach
    inside = np.all((points >= low - 1e-9) & (points <= high + 1e-9), axis=1)
    return points[inside] if inside.any() else points


def _ranking(models: Quadratics, points: NDArray, reserve: float) -> NDArray:
    """Places of points from the best on: by shortfall, then by the objective."""
    values = models.values(points)
    short = np.sum(np.maximum(reserve * models.errors[1:] - values[:, 1:], 0.0), axis=1)
    return np.lexsort((values[:, 0], short))
