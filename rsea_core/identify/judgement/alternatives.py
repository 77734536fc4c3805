"""What else was considered, and by how much it was rejected.

A rival is an explanation that names another effect and is no longer than the chosen one. Those that
were fitted stand with their score. The screening saw all others: it predicts what a law would
leave at its linear solution, on the same scale. Either is behind by `Search.behind`, the distance
that confidences are made of; what was measured of it scatters as its sum over the recordings'
stretches does (likelihood ratios of laws that are none of them true: Vuong, Econometrica 57 (1989)
307), and what was only predicted is as unsure as evidence that is tempered by `TEMPERATURE`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.least_squares import Fit, robust
from rsea_core.identify.selection.criteria import LEAST_MSNI, TEMPERATURE, Search

LISTED = 8


PIECE_s = 0.5  # innovations of a wrong law are dependent for less


@dataclass(frozen=True, kw_only=True)
class Considered:
    """An explanation that was not chosen.

    Attributes
    ----------
    fit : Fit
        Its `msni` and `x` are predictions where it was not fitted.
    behind, se : float
        Log-likelihood units behind the chosen fit, and their standard error.
    fitted : bool
        Else only the screening saw it.
    """

    fit: Fit
    behind: float
    se: float
    fitted: bool


def considered(
    search: Search,
    chosen: Fit,
    *,
    effects: int | None = None,
    fits: Callable[[Fit], bool] = lambda _: True,
) -> list[Considered]:
    """Explanations other than a fit's, the nearest first.

    Parameters
    ----------
    effects : int or None
        That an explanation may name at most; None: as many as the chosen one.
    fits : callable
        Which ones count.
    """
    mine = frozenset(chosen.hypothesis.effects)
    most = len(mine) if effects is None else effects
    best: dict[frozenset, Fit] = {}
    for other in search.ranked():
        named = frozenset(other.hypothesis.effects)
        if named and named != mine and len(named) <= most and fits(other):
            best.setdefault(named, other)
    fitted = list(best.values())
    promised = [
        fit for named, fit in search.predicted.items()
        if named not in best and named != mine and len(named) <= most and fits(fit)
    ]  # fmt: skip
    rows = [
        Considered(fit=fit, behind=search.behind(chosen, fit), se=se, fitted=True)
        for fit, se in zip(fitted, distance_errors(search, chosen, fitted), strict=True)
    ]
    for fit in promised:
        behind = search.behind(chosen, fit)
        rows.append(Considered(fit=fit, behind=behind, se=tempered_error(behind), fitted=False))
    return sorted((r for r in rows if np.isfinite(r.behind)), key=lambda r: r.behind)


def nearest(search: Search, chosen: Fit, rows: Sequence[Considered], name: str) -> list[Considered]:
    """What could stand in the place of one of a fit's effects, at most `LISTED`, nearest first.

    Those that do no better than parameters alone are all as far behind; of them the ones whose own
    traces look most like the effect's are worth a word.

    Parameters
    ----------
    rows : sequence of Considered
        The nearest first; of each other effect the first that does without the named one counts.
    """
    mine = set(chosen.hypothesis.effects)
    first: dict[str, Considered] = {}
    for row in rows:
        if name not in row.fit.hypothesis.effects:
            for other in set(row.fit.hypothesis.effects) - mine:
                first.setdefault(other, row)
    bar = search.behind(chosen, search.parameters) - TEMPERATURE
    alike = likeness(search, name)
    ahead = sorted(first, key=lambda o: (min(first[o].behind, bar), -alike.get(o, 0.0)))
    kept = {id(first[other]): first[other] for other in ahead[:LISTED]}
    return sorted(kept.values(), key=lambda row: row.behind)


def likeness(search: Search, name: str) -> dict[str, float]:
    """How much the traces of other effects look like one's: the largest cosine of their laws.

    Of the first screening's columns, what parameters can mimic left out of them.
    """
    own = next((c.column for c in search.candidates if c.law.effect == name), None)
    found: dict[str, float] = {}
    for c in search.candidates if own is not None else ():
        found[c.law.effect] = max(found.get(c.law.effect, 0.0), abs(float(c.column @ own)))
    return found


def listed_rivals(rows: Sequence[Considered], mine: Sequence[str]) -> list[dict]:
    """The contract's `alternatives` of an effect.

    Parameters
    ----------
    rows : sequence of Considered
        From `nearest`.
    mine : sequence of str
        All effects of the chosen explanation.
    """
    found: dict[str, dict] = {}
    for row in rows:
        for other in row.fit.hypothesis.effects:
            if other in mine or other in found:
                continue
            found[other] = {
                "name": other, "delta_score": round(row.behind, 1), "se": round(row.se, 1),
            } | ({} if row.fitted else {"screened": True})  # fmt: skip
    return list(found.values())


def tempered_error(behind: float) -> float:
    """Standard error of a distance [log-likelihood] that counts one part in `TEMPERATURE`.

    A sum of normal log-likelihood ratios has twice its mean as variance.
    """
    return float(np.sqrt(2.0 * TEMPERATURE * max(abs(behind), 1.0)))


def distance_errors(search: Search, chosen: Fit, others: Sequence[Fit]) -> list[float]:
    """Standard errors of fits' distances to a chosen one, from the scatter over blocks."""
    if not others:
        return []
    problem = search.problem
    found = problem.innovations_of([(f.hypothesis, f.x) for f in (chosen, *others)])
    variance = np.zeros(len(others))
    weights = 0.5 * search.independent_blocks()
    for prepared, e, weight in zip(problem.fitted, found, weights, strict=True):
        squares = e**2 if np.isinf(search.fitter.far) else robust(e, search.fitter.far)[0]
        row_s = prepared.recording.sample_time_s * prepared.whitener.block
        length = max(1, round(PIECE_s / row_s))
        variance += weight**2 * variance_of_difference(squares.mean(axis=2), length)
    plain = [tempered_error(search.behind(chosen, f)) for f in others]
    return [
        float(np.sqrt(v)) if np.isfinite(v) else known
        for v, known in zip(variance, plain, strict=True)
    ]


def variance_of_difference(squares: NDArray, length: int) -> NDArray:
    """Variance (m,) of the difference of log mean squares (1 + m, blocks) to the first row's."""
    msni = squares.mean(axis=1, keepdims=True)
    # an MSNI that the score holds at its least does not move it
    felt = np.broadcast_to(msni > LEAST_MSNI, squares.shape)
    relative = np.divide(squares, msni, out=np.ones_like(squares), where=felt) - 1.0
    apart = (relative[1:] - relative[0]) / squares.shape[1]
    sums = np.add.reduceat(apart, np.arange(0, squares.shape[1], length), axis=1)
    return np.sum(sums**2, axis=1)
