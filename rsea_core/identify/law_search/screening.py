"""Which laws could explain what the parameters leave: linear algebra on columns of innovations.

Each start of each law is predicted once; the change of the innovations is its column. With all
free values projected out, the fall of the cost at the best size follows without another
prediction, and the same with any block of rows left out: the gain on rows that the size was not
fitted to (docs/diagnosis-search.md 10.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.multistep.estimator import Estimate, Estimator, stretches_of
from rsea_core.identify.multistep.kalman_filter import huber_weights
from rsea_core.identify.multistep.tracks import Track

BATCH = 24  # trials predicted at once
SMALLEST, LARGEST = 1e-3, 1e3  # size of a start that is screened again
FAR_BELOW, REDUCED = 0.1, 0.01  # size below which all starts are; their size if none gained
TORQUE, ANGLE = "coulomb_Nm", "presliding_rad"  # of dry friction on either side of a gear


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One law, as the screening sees it.

    Attributes
    ----------
    start : tuple of float
        Values with the best size in them.
    gain : float
        Fall of the cost at the best size, all free values refitted.
    held_out : float
        The same on blocks that the size was not fitted to, summed.
    deviation : float
        Standard deviation of that sum, from the spread between blocks.
    size : float
        Of the start.
    start_values : array or None
        Values of everything else from which a fit begins, where they are not those of the fit
        that was screened.
    """

    law: Law
    start: tuple[float, ...]
    gain: float
    held_out: float
    deviation: float
    size: float
    start_values: NDArray | None = None


def quarter_turn(law: Law, start: Sequence[float]) -> tuple[float, ...] | None:
    """The start of a sine and cosine pair a quarter of a turn on; None where there is none."""
    names = [p.name for p in law.unknowns]
    turned, found = list(start), False
    for j, name in enumerate(names):
        if "sin_" in name:
            other = names.index(name.replace("sin_", "cos_"))
            turned[j], turned[other] = start[other], start[j]
            found = True
    return tuple(turned) if found else None


class Projection:
    """Innovations of a fit with its free values projected out, block by block."""

    def __init__(self, estimator: Estimator, fit: Estimate):
        self.estimator, self.fit = estimator, fit
        level, parts = estimator.jacobian(fit.hypothesis, fit.x)
        self.level = level
        e = np.concatenate([each.ravel() for each in level])
        J = np.concatenate([each.reshape(len(each), -1) for each in parts], axis=1)
        self.root = np.sqrt(estimator.tempering * huber_weights(e))
        self.J = J * self.root
        self.target = -e * self.root
        centre, weight = estimator.problem.prior(fit.hypothesis)
        A = self.J @ self.J.T + np.diag(weight**2 + 1e-9)
        self.L = np.linalg.cholesky(A)
        g = self.J @ self.target - weight**2 * (fit.x - centre)
        self.left = self.target - self.J.T @ np.linalg.solve(self.L.T, np.linalg.solve(self.L, g))
        self.blocks = _block_of_each(estimator.tracks)

    def column(self, innovations: Sequence[NDArray]) -> NDArray:
        """A trial's change of the innovations, weighted; not finite where it failed."""
        e = np.concatenate([each.ravel() for each in innovations])
        return (e * self.root) + self.target

    def columns(self, changes: Sequence[NDArray]) -> NDArray:
        """Weighted columns (m, n) of changes (m, blocks, p) of each recording's innovations."""
        found = np.concatenate([c.reshape(len(c), -1) for c in changes], axis=1)
        found *= self.root
        return found

    def judged(self, columns: NDArray) -> tuple | None:
        """Size (k,), gain, held-out gain and its deviation of columns (k, n)."""
        if not np.all(np.isfinite(columns)) or not np.any(columns):
            return None
        B = np.linalg.solve(self.L, self.J @ columns.T)
        free = columns - (self.J.T @ np.linalg.solve(self.L.T, B)).T
        G = columns @ columns.T - B.T @ B
        G = G + 1e-9 * np.trace(G) * np.eye(len(G)) + 1e-30 * np.eye(len(G))
        h = columns @ self.left
        size = np.linalg.solve(G, h)
        gain = 0.5 * float(h @ size)
        count = self.blocks[-1] + 1
        k = len(columns)
        xy = np.stack([np.bincount(self.blocks, c * self.left, count) for c in free], axis=1)
        xx = np.empty((count, k, k))
        for i in range(k):
            for j in range(k):
                xx[:, i, j] = np.bincount(self.blocks, free[i] * free[j], count)
        total_xx, total_xy = xx.sum(axis=0), xy.sum(axis=0)
        ridge = 1e-9 * np.trace(total_xx) * np.eye(k) + 1e-30 * np.eye(k)
        a = np.linalg.solve(total_xx - xx + ridge, (total_xy - xy)[:, :, None])[:, :, 0]
        falls = np.sum(a * xy, axis=1) - 0.5 * np.einsum("bi,bij,bj->b", a, xx, a)
        return size, gain, float(falls.sum()), float(np.std(falls) * np.sqrt(count))


def _block_of_each(tracks: Sequence[Track]) -> NDArray:
    """Block of each innovation (n,), recording after recording."""
    found, begun = [], 0
    for block, t in zip(stretches_of(tracks), tracks, strict=True):
        found.append(np.repeat(begun + block, len(t.experiment.channels)))
        begun += block[-1] + 1
    return np.concatenate(found)


def screen(
    estimator: Estimator,
    fit: Estimate,
    laws: Sequence[Law],
    *,
    wrong_signs: bool = False,
    projection: Projection | None = None,
) -> list[Candidate]:
    """Candidates, the largest held-out gain first; no laws that follow another one.

    Parameters
    ----------
    wrong_signs : bool
        Also laws whose linearised size is negative where only a positive one is physical, with
        no gain: parameters biased by the missing law can turn its sign.
    projection : Projection or None
        Of that estimator and fit; None: it is made here.
    """
    laws = [law for law in laws if not law.follows]
    projection = projection or Projection(estimator, fit)
    problem = estimator.problem
    starts = {w.key: [_from_stated(problem, fit, w, s) for s in w.starts] for w in laws}
    jobs = [
        (law, start)
        for law in laws
        for begin in starts[law.key]
        for start in (begin, quarter_turn(law, begin))
        if start is not None
    ]
    columns = _columns(projection, jobs)
    best: dict[str, Candidate] = {}
    for law in laws:
        for start in starts[law.key]:
            turned = quarter_turn(law, start)
            pair = [columns[law.key, s] for s in (start, turned) if s is not None]
            judged = projection.judged(np.array(pair))
            if judged is None:
                continue
            size, gain, held_out, deviation = judged
            if not law.signed and turned is None and size[0] <= 0.0:
                if not wrong_signs:
                    continue
                size, gain, held_out = np.abs(size), 0.0, 0.0
            scale = float(np.hypot(*size)) if turned is not None else float(size[0])
            begun = _mixed(law, start, size) if turned is not None else start
            candidate = Candidate(
                law=law, start=begun, gain=gain, held_out=held_out, deviation=deviation,
                size=1.0 if turned is not None else scale,
            )  # fmt: skip
            old = best.get(law.key)
            if old is None or (gain > 0.0, held_out) > (old.gain > 0.0, old.held_out):
                best[law.key] = candidate
    return sorted(best.values(), key=lambda c: -c.held_out)


def _columns(
    projection: Projection, jobs: Sequence[tuple[Law, tuple[float, ...]]]
) -> dict[tuple, NDArray]:
    """Column of each law and start, by the law's key and the start."""
    estimator, fit = projection.estimator, projection.fit
    problem, columns = estimator.problem, {}
    n = len(problem.nominals)
    for at in range(0, len(jobs), BATCH):
        part = jobs[at : at + BATCH]
        trials = []
        for law, start in part:
            own = problem.start(Hypothesis(laws=(law,)), [start])[n:]
            h = Hypothesis(laws=(*fit.hypothesis.laws, law))
            trials.append((h, np.concatenate([fit.x, own])))
        found = estimator.innovations(trials)
        for j, (law, start) in enumerate(part):
            columns[law.key, start] = projection.column([e[j] for e in found])
    return columns


def screen_again(
    estimator: Estimator,
    fit: Estimate,
    candidates: Sequence[Candidate],
    *,
    projection: Projection | None = None,
) -> list[Candidate]:
    """Candidates screened at the sizes that a first screening found.

    A machine that turns freely does not respond in proportion to a torque that is ten times too
    large: it stops at a detent, and the column says nothing of the law. Sizes of laws without a
    sine and a cosine need not act in proportion, as a threshold does not: of these the better
    screening counts. Of laws that showed no gain, or whose size is far below their starts', all
    starts are screened again: a law that adds a tenth of the stiffness shifts the resonance of a
    lightly damped machine so far that the linear size, even its sign, is wrong.
    """
    known = {c.law.key: c.law for c in candidates}
    begun = [replace(c.law, starts=_starts_again(c)) for c in candidates]
    screened = screen(estimator, fit, begun, projection=projection)
    again = [replace(c, law=known[c.law.key]) for c in screened]
    best: dict[str, Candidate] = {}
    pairs = {c.law.key for c in again if quarter_turn(c.law, c.start) is not None}
    first = [c for c in candidates if c.law.key not in pairs]
    for c in sorted((*first, *again), key=lambda c: -c.gain):
        best.setdefault(c.law.key, c)
    return list(best.values())


def _starts_again(c: Candidate) -> tuple[tuple[float, ...], ...]:
    """The start at the size that a screening found; all starts, if that is far below theirs."""
    size = float(np.clip(abs(c.size), SMALLEST, LARGEST))
    if c.gain > 0.0 and size >= FAR_BELOW:
        return (c.law.scaled(c.start, size),)
    size = size if c.gain > 0.0 else REDUCED
    return tuple(c.law.scaled(start, size) for start in c.law.starts)


def _mixed(law: Law, start: Sequence[float], size: NDArray) -> tuple[float, ...]:
    names = [p.name for p in law.unknowns]
    mixed = list(start)
    for j, name in enumerate(names):
        if "sin_" in name:
            other = names.index(name.replace("sin_", "cos_"))
            mixed[j], mixed[other] = size[0] * start[j], size[1] * start[j]
    return tuple(mixed)


def _from_stated(
    problem: Problem, fit: Estimate, law: Law, start: Sequence[float]
) -> tuple[float, ...]:
    """A start of a law with the fitted values of the stated law whose place it takes, if any.

    The column must show what a richer law adds to a stated level of friction, and not that level.
    """
    laws, shared = fit.hypothesis.laws, {}
    if not any(w.known for w in laws):
        return tuple(start)
    values, together = problem.values(fit.hypothesis, fit.x)[1], Hypothesis(laws=(*laws, law))
    for stated, v in zip(laws, values, strict=True):
        if problem.acts(stated, fit.hypothesis) and not problem.acts(stated, together):
            free = {u.name: v[u.name] for u in stated.unknowns if u.scale > 0.0}
            shared |= _on_side_of(law, stated, free, problem.case.rig.gear_ratio or 1.0)
    return tuple(
        min(max(shared.get(u.name, value), u.low), u.high)
        for u, value in zip(law.unknowns, start, strict=True)
    )


def _on_side_of(law: Law, stated: Law, values: dict, ratio: float) -> dict:
    """Values of a stated law on the side of the gear that a law of the same body is stated on."""
    motor = GearFriction.effect
    if (law.effect == motor) == (stated.effect == motor):
        return values
    if LoadFriction.effect not in (law.effect, stated.effect):
        return {}
    up = ratio if law.effect == motor else 1.0 / ratio
    factors = {TORQUE: 1.0 / up, ANGLE: up}
    return {name: values[name] * factor for name, factor in factors.items() if name in values}
