"""Screening: which laws could explain what the parameters leave, by linear algebra on innovations.

Each variant of each law is replayed once at a small amplitude around the fitted parameters; the
change of the innovations is its column, exact in stick and slip because the engine made it. Gram
matrices of each recording then give, without another replay: the fall of the cost with all
parameters re-fitted, the share of the mismatch that only this law can explain, and the angle
between any two laws once parameters are projected out.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.least_squares import STEP, Fitter, robust
from rsea_core.identify.fitting.periodic_regressors import periodic_columns, torque_columns
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One variant of one law, as the screening sees it.

    Attributes
    ----------
    start : tuple of float
        Values at which it was replayed.
    drop : float
        Predicted fall of the tempered cost, parameters re-fitted, at the best positive size.
    size : float
        That size, in units of the start.
    share : float
        Of the squared innovations that no parameter can mimic.
    column : (n,) array
        Unit vector of the law's own direction, parameters projected out.
    by_recording : (recordings,) array
        How the fall divides over the recordings.
    shift : (n,) array
        How the base's unknowns move with it.
    kept : (recordings,) array
        Share of each recording's squared innovations that would be left.
    """

    law: Law
    start: tuple[float, ...]
    drop: float
    size: float
    share: float
    column: NDArray
    by_recording: NDArray
    shift: NDArray
    kept: NDArray


def _rotated(law: Law, start: Sequence[float]) -> tuple[float, ...] | None:
    """The start of a sine and cosine pair a quarter of a turn on."""
    names = [parameter.name for parameter in law.unknowns]
    turned = list(start)
    found = False
    for j, name in enumerate(names):
        if "sin_" in name:
            other = names.index(name.replace("sin_", "cos_"))
            turned[j], turned[other] = start[other], start[j]
            found = True
    return tuple(turned) if found else None


def screen(
    fitter: Fitter,
    base: Hypothesis,
    x: NDArray,
    laws: Sequence[Law],
    *,
    tempering: float,
    recordings: Sequence[PreparedRecording] | None = None,
) -> list[Candidate]:
    """Candidates in the order of their predicted fall.

    Parameters
    ----------
    x : (n,) array
        Fitted unknowns of the base hypothesis.
    tempering : float
        As in `Fitter.fit`.
    recordings : sequence of PreparedRecording or None
        The recordings as they are replayed; None: free runs of all that are fitted.
    """
    linear = _linearised(fitter, base, x, tempering, recordings)
    periodic = [law for law in laws if law.effect == MotorCogging.effect]
    smooth = [law for law in laws if law not in periodic]
    columns = _replayed_columns(fitter, base, x, smooth, recordings, linear)
    if periodic:
        used = recordings or fitter.problem.fitted
        columns |= _periodic_columns(fitter.problem, periodic, linear.root, used)
    found = [_best_start(linear, law, columns) for law in laws]
    results = sorted((c for c in found if c is not None), key=lambda c: -c.drop)
    first_wave = next((j for j, c in enumerate(results) if c.law in periodic), None)
    if first_wave is not None:
        law = results[first_wave].law
        raw = np.array([columns[law.key, s] for s in (law.starts[0], _rotated(law, law.starts[0]))])
        results[first_wave] = _refined(results[first_wave], fitter.far, linear, raw / linear.root)
    return results


@dataclass(frozen=True, kw_only=True)
class _Linear:
    """All innovations (n,) around fitted unknowns (m,), and what those can mimic.

    Attributes
    ----------
    level, root : (n,) array
        Innovations, and the square roots of their weights.
    raw, J : (m, n) array
        Their derivatives, and these weighted.
    prior_weight : (m,) array
    L : (m, m) array
        Cholesky factor of the Gauss-Newton matrix with priors.
    left : (n,) array
        Weighted innovations that re-fitted unknowns leave, with the sign of a step.
    total : float
        Sum of its squares.
    edges : (recordings + 1,) array
        Where a recording's innovations begin.
    """

    level: NDArray
    root: NDArray
    raw: NDArray
    J: NDArray
    prior_weight: NDArray
    L: NDArray
    left: NDArray
    total: float
    edges: NDArray


def _linearised(
    fitter: Fitter,
    base: Hypothesis,
    x: NDArray,
    tempering: float,
    recordings: Sequence[PreparedRecording] | None,
) -> _Linear:
    X = np.vstack([x, *(x + STEP * np.eye(x.size))])
    _, _, found = fitter.evaluate(base, X, recordings)
    flat = np.concatenate([e.reshape(len(X), -1) for e in found], axis=1)
    e0 = flat[0]
    root = np.ones_like(e0) if np.isinf(fitter.far) else np.sqrt(robust(e0, fitter.far)[1])
    root = root * np.sqrt(tempering)
    raw = (flat[1:] - e0) / STEP
    J = raw * root
    J[~np.all(np.isfinite(J), axis=1)] = 0.0
    target = -e0 * root
    centre, weight = fitter.problem.prior(base)
    prior_weight = weight**2 + 1e-9
    L = np.linalg.cholesky(J @ J.T + np.diag(prior_weight))
    g = J @ target - prior_weight * (x - centre) * (weight > 0)
    left = target - J.T @ np.linalg.solve(L.T, np.linalg.solve(L, g))
    edges = np.concatenate(([0], np.cumsum([e.shape[1] * e.shape[2] for e in found])))
    return _Linear(
        level=e0, root=root, raw=raw, J=J, prior_weight=prior_weight, L=L, left=left,
        total=float(left @ left), edges=edges,
    )  # fmt: skip


def _replayed_columns(
    fitter: Fitter, base: Hypothesis, x: NDArray, laws: Sequence[Law], recordings, linear: _Linear
) -> dict[tuple, NDArray]:
    """What each law changes (n,) by (key, start), pairs also a quarter of a turn on."""
    jobs = [
        (law, start)
        for law in laws
        for begin in law.starts
        for start in (begin, _rotated(law, begin))
        if start is not None
    ]
    problem, trials = fitter.problem, []
    for law, start in jobs:
        own = problem.start(Hypothesis(laws=(law,)), [start])[len(problem.nominals) :]
        trials.append((Hypothesis(laws=(*base.laws, law)), np.concatenate([x, own])))
    fitter.replays += len(trials)
    parts = problem.innovations_of(trials, recordings) if trials else []
    columns = {}
    for j, (law, start) in enumerate(jobs):
        e = np.concatenate([part[j].reshape(-1) for part in parts])
        columns[law.key, start] = (e - linear.level) * linear.root
    return columns


def _best_start(linear: _Linear, law: Law, columns: dict[tuple, NDArray]) -> Candidate | None:
    """The law begun where its fall is largest."""
    best = None
    for start in law.starts:
        turned = _rotated(law, start)
        own = [columns[law.key, at] for at in (start, turned) if at is not None]
        candidate = _judge(linear, law, start, turned, np.array(own))
        if candidate is not None and (best is None or candidate.drop > best.drop):
            best = candidate
    return best


def _refined(c: Candidate, far: float, linear: _Linear, periodic: NDArray) -> Candidate:
    """A wave's amplitudes and the unknowns with it, by reweighted least squares.

    The weights of a replay that has diverged say nothing; those of what the wave leaves do.
    """
    e0 = linear.level
    rows = np.concatenate([np.nan_to_num(linear.raw), periodic])
    prior = np.concatenate([linear.prior_weight, [1e-9, 1e-9]])
    solution = np.zeros(len(rows))
    for _ in range(6):
        left = e0 + rows.T @ solution
        scale = max(far, 1.5 * float(np.median(np.abs(left)))) if np.isfinite(far) else np.inf
        weight = 1.0 / (1.0 + (left / scale) ** 2)
        A = (rows * weight) @ rows.T + np.diag(prior)
        solution = -np.linalg.solve(A, (rows * weight) @ e0)
    size = solution[-2:]
    return replace(c, start=_mixed(c.law, c.law.starts[0], size), size=1.0, shift=solution[:-2])


def _judge(
    linear: _Linear,
    law: Law,
    start: tuple[float, ...],
    turned: tuple[float, ...] | None,
    C: NDArray,
) -> Candidate | None:
    """The law with the best size of its columns C (1 or 2, n); None where it explains nothing."""
    J, L, left, edges = linear.J, linear.L, linear.left, linear.edges
    if not np.all(np.isfinite(C)) or not np.any(C):
        return None
    # what of the columns no parameter can mimic
    B = np.linalg.solve(L, J @ C.T)
    free = C - (J.T @ np.linalg.solve(L.T, B)).T
    G = C @ C.T - B.T @ B
    G = G + 1e-9 * np.trace(G) * np.eye(len(G)) + 1e-30 * np.eye(len(G))
    h = C @ left
    size = np.linalg.solve(G, h)
    if turned is None and size[0] <= 0.0 and not law.signed:
        return None
    drop = 0.5 * float(h @ size)
    direction = size @ free
    norm = float(np.linalg.norm(direction))
    if norm == 0.0:
        return None
    unit = direction / norm
    along = unit * left
    by_recording = np.array([along[a:b].sum() for a, b in itertools.pairwise(edges)])
    overall = by_recording.sum()
    shift = -np.linalg.solve(L.T, B @ size)
    share = float((unit @ left) ** 2 / linear.total) if linear.total > 0.0 else 0.0
    had, stays = _by_recording(left, edges), _by_recording(left - direction, edges)
    scale = float(np.hypot(*size)) if turned is not None else float(size[0])
    begun = start
    if turned is not None:
        begun = _mixed(law, start, size)
        scale = 1.0
    return Candidate(
        law=law, start=begun, drop=drop, size=scale, share=share,
        column=unit.astype(np.float32),
        by_recording=by_recording / overall if overall else by_recording, shift=shift,
        kept=stays / np.maximum(had, 1e-300),
    )  # fmt: skip


def _by_recording(e: NDArray, edges: NDArray) -> NDArray:
    """Sums of squares (recordings,) of all recordings' innovations (n,) side by side."""
    return np.array([float(e[a:b] @ e[a:b]) for a, b in itertools.pairwise(edges)])


def _mixed(law: Law, start: Sequence[float], size: NDArray) -> tuple[float, ...]:
    names = [parameter.name for parameter in law.unknowns]
    mixed = list(start)
    for j, name in enumerate(names):
        if "sin_" in name:
            other = names.index(name.replace("sin_", "cos_"))
            amplitude = start[j]
            mixed[j], mixed[other] = size[0] * amplitude, size[1] * amplitude
    return tuple(mixed)


def _periodic_columns(
    problem, periodic: Sequence[Law], root: NDArray, recordings: Sequence[PreparedRecording]
) -> dict[tuple, NDArray]:
    """Columns of torques periodic in the motor's angle, from the measured angle."""
    stiffness = problem.case.rig.spring_stiffness_Nm_per_rad or 0.0
    parts: list[NDArray] = []
    cycles = [law.starts[0][2] for law in periodic]
    for prepared in recordings:
        size = prepared.whitener.size
        if "motor_angle_rad" not in prepared.recording:
            parts.append(np.zeros((2 * len(periodic), size)))
            continue
        angle = prepared.recording["motor_angle_rad"]
        signals = -prepared.where.ratio * periodic_columns(angle, cycles)
        e = torque_columns(prepared, stiffness, signals, "G")
        parts.append(-e.reshape(len(signals), -1))
    whole = np.concatenate(parts, axis=1) * root
    found = {}
    for j, law in enumerate(periodic):
        start = law.starts[0]
        found[law.key, start] = whole[2 * j] * start[0]
        found[law.key, _rotated(law, start)] = whole[2 * j + 1] * start[0]
    return found
