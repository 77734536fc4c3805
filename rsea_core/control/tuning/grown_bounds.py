"""A search whose box grows until the optimum lies inside, with the evaluations of a plain one.

The budget is spent in rounds. After each, a side of the box at which the best point lies is moved
outwards, and the next round starts from that point. A side beyond which the controller refuses
values (a negative gain, an exponent above 1) is a physical limit and stays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.tuning.optimisers import search
from rsea_core.control.tuning.search_record import LEADERS, Box, Cost, Search

ROUNDS = 4
SHORTEST = 5  # generations that a round needs
GROWTH = 4.0  # of an upper bound above zero
AT_BOUND = 0.01  # of the box: as near as this to a side is at it
NEAR_BOUND = 0.15  # as near as this, the side is moved

Accepts = Callable[[str, float], bool]
"""Whether the controller takes a value of a field."""


@dataclass(frozen=True, kw_only=True)
class AtBound:
    """A value that a search left at a side of its box.

    Attributes
    ----------
    name : str
    value, bound : float
    is_physical : bool
        The controller refuses values beyond it: a larger box would change nothing.
    """

    name: str
    value: float
    bound: float
    is_physical: bool

    def __str__(self) -> str:
        why = "its physical limit" if self.is_physical else "the end of what was searched"
        return f"{self.name} = {self.value:.4g} at {self.bound:.4g}, {why}"


def at_bounds(
    point: NDArray, box: Box, accepts: Accepts, *, within: float = AT_BOUND
) -> tuple[AtBound, ...]:
    """The values of a point that lie at a side of the box."""
    found = []
    for name, value, low, high in zip(box.names, point, box.low, box.high, strict=True):
        near, past = within * (high - low), AT_BOUND * (high - low)
        for bound, beyond in ((low, low - past), (high, high + past)):
            if abs(value - bound) <= near:
                own = {"name": name, "value": float(value), "bound": float(bound)}
                found.append(AtBound(**own, is_physical=not accepts(name, float(beyond))))
    return tuple(found)


def grown(box: Box, point: NDArray, accepts: Accepts) -> Box:
    """The box with every side moved outwards at which the point lies and that is not physical."""
    low, high = box.low.copy(), box.high.copy()
    for bound in at_bounds(point, box, accepts, within=NEAR_BOUND):
        j = box.names.index(bound.name)
        if bound.is_physical:
            continue
        if bound.bound == box.high[j]:
            high[j] = _moved(accepts, bound.name, high[j], _upwards(low[j], high[j]))
        else:
            beyond = 0.0 if low[j] > 0.0 else low[j] - (GROWTH - 1.0) * (high[j] - low[j])
            low[j] = _moved(accepts, bound.name, low[j], beyond)
    return Box(names=box.names, low=low, high=high)


def _upwards(low: float, high: float) -> float:
    return high * GROWTH if high > 0.0 else high + (GROWTH - 1.0) * (high - low)


def _moved(accepts: Accepts, name: str, bound: float, beyond: float) -> float:
    """As far beyond a bound as the controller takes values, to 1 % of the distance."""
    if accepts(name, beyond):
        return beyond
    inside, outside = bound, beyond
    for _ in range(7):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if accepts(name, middle) else (inside, middle)
    return inside


def search_and_grow(
    cost: Cost,
    box: Box,
    accepts: Accepts,
    *,
    method: str,
    seed: int,
    population: int,
    generations: int,
) -> Search:
    """One search in rounds, population x generations evaluations in all.

    Raises
    ------
    InputError
        If the method is unknown or the budget too small.
    """
    rounds = max(min(ROUNDS, generations // SHORTEST), 1)
    shares = np.diff(np.linspace(0, generations, rounds + 1).round().astype(int))
    parts: list[Search] = []
    for number, share in enumerate(shares):
        start = min(parts, key=lambda s: s.cost).best if parts else None
        parts.append(
            search(
                cost,
                box,
                method=method,
                seed=seed + 1000 * number,
                population=population,
                generations=int(share),
                start=start,
            )
        )
        best = min(parts, key=lambda s: s.cost)
        if number + 1 < rounds and np.isfinite(best.cost):
            box = grown(box, best.best, accepts)
    return _joined(parts, seed)


def _joined(parts: Sequence[Search], seed: int) -> Search:
    best = min(parts, key=lambda s: s.cost)
    points = np.vstack([p.leaders for p in parts])
    costs = np.concatenate([p.leader_costs for p in parts])
    _, once = np.unique(points, axis=0, return_index=True)
    order = once[np.argsort(costs[once], kind="stable")][:LEADERS]
    return Search(
        method=best.method,
        seed=seed,
        best=best.best,
        cost=best.cost,
        history=np.minimum.accumulate(np.concatenate([p.history for p in parts])),
        evaluations=sum(p.evaluations for p in parts),
        leaders=points[order],
        leader_costs=costs[order],
        low=parts[-1].low,
        high=parts[-1].high,
    )
