"""Where an unknown signal would have to enter the machine to leave what the parameters leave.

A mismatch that no law explains is still heard through the machine: a torque on the load bends the
spring before it turns the motor, a count that an encoder loses moves nothing else. The residuals
of a replay are filtered by the linear machine with one unknown signal more - a first-order Gauss-
Markov process of unknown size and pace, in the winding, on the wheel, in the spring, on the load or
on one reading - and the likelihood of the readings, the nominal values profiled out, says through
which port it came. Nothing is assumed of the signal's law, so that it can be asked after every law
has failed. (Likelihood of innovations: Schweppe, IEEE Trans. Inf. Theory 11 (1965) 61; unknown
inputs by generalised likelihood ratios: Willsky & Jones, IEEE TAC 21 (1976) 108; latent forces:
Alvarez, Luengo & Lawrence, IEEE TPAMI 35 (2013) 2693.)
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from rsea_core.engines.fixed_step.replay import Numbers
from rsea_core.identify.fitting.least_squares import STEP, Fit
from rsea_core.identify.fitting.problem import (
    Hypothesis,
    PreparedRecording,
    Problem,
    machine_of,
    observed,
)
from rsea_core.identify.locate.signal_filter import SignalModel, signal_likelihoods, smooth_errors
from rsea_core.identify.smoothing.error_model import READING, ErrorModel, error_model

BLOCK_s = 0.008  # finer than any mode that tells one port from another
PACES_s = (0.02, 0.15, 1.5)  # correlation times of the unknown signal
LEVELS = np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 15)])  # of its size, in the port's scale
ROUNDS = 3
TORQUE_SHARE, LEAST_TORQUE_Nm = 0.02, 0.1  # of the drive's torque: a size to begin with
COUNTS = 1e3  # the same of a reading, in deviations of its sensor
RELAXED, SETTLED = (
    8,
    1.0,
)  # steps of the values, and the log-likelihood units that one must still gain


@dataclass(frozen=True, kw_only=True)
class RankedPort:
    """How well an unknown signal at one port explains what is left.

    Attributes
    ----------
    port : str
        "V", "G", "S", "L", "E" or "Y:<column>".
    gain : float
        Log-likelihood units over no unknown signal at all.
    log_posterior : float
        Log-likelihood of the readings with log prior, up to a constant.
    pace_s : float
        Correlation time.
    levels : (recordings,) array
        Its standard deviation in each recording: V, Nm or the reading's unit.
    scale : float
        Unit of the levels that were tried.
    """

    port: str
    gain: float
    log_posterior: float
    pace_s: float
    levels: NDArray
    scale: float


def ranked_ports(problem: Problem, fit: Fit) -> list[RankedPort]:
    """Ports by how well an unknown signal there explains what a fit leaves, best first."""
    columns = [_columns(problem, fit, prepared) for prepared in problem.fitted]
    models = [model_of(problem, fit, prepared) for prepared in problem.fitted]
    prior = _prior(problem, fit)
    magnitudes: dict[str, float] = {}
    for prepared, model in zip(problem.fitted, models, strict=True):
        for name, scale in _magnitudes(prepared, model).items():
            magnitudes[name] = max(scale, magnitudes.get(name, 0.0))
    jobs = [(name, scale, pace) for name, scale in magnitudes.items() for pace in PACES_s]

    def tried(job: tuple[str, float, float]) -> RankedPort:
        name, scale, pace = job
        stats = [
            _statistics(model, r, name, LEVELS * scale, pace)
            for model, r in zip(models, columns, strict=True)
        ]
        value, levels = _most_likely(stats, prior)
        without, _, _ = profiled_log_posterior(stats, [0] * len(stats), prior)
        sizes = LEVELS[np.array(levels)] * scale
        return RankedPort(
            port=name, gain=value - without, log_posterior=value, pace_s=pace, levels=sizes,
            scale=scale,
        )  # fmt: skip

    with ThreadPoolExecutor(get_num_threads()) as pool:
        found = list(pool.map(tried, jobs))
    best: dict[str, RankedPort] = {}
    for ranked in sorted(found, key=lambda e: -e.gain):
        best.setdefault(ranked.port, ranked)
    return list(best.values())


@dataclass(frozen=True, kw_only=True)
class JointFit:
    """A fit's unknowns jointly with an unknown signal.

    Attributes
    ----------
    entry : Entry
        The signal, its levels as they are there.
    x : (n,) array
    covariance : (n, n) array
        Of the unknowns, with the signal's levels as they are.
    log_posterior : float
        Log-likelihood of the readings with log prior, up to a constant.
    share : float
        Of the squared innovations above their noise, what the signal takes away.
    """

    ranked: RankedPort
    x: NDArray
    covariance: NDArray
    log_posterior: float
    share: float


def fit_jointly(problem: Problem, start: Fit, ranked: RankedPort) -> JointFit:
    """The unknowns at their best jointly with an unknown signal, from a fit and from the nominal
    values.

    A fit without the signal takes it for wrong values of the rig, and may have gone far.
    """
    prior_mean = np.concatenate([np.zeros(len(problem.nominals)), start.x[len(problem.nominals) :]])
    found = [_relaxed(problem, start.hypothesis, x, ranked) for x in (start.x, prior_mean)]
    return max(found, key=lambda b: b.log_posterior)


def _relaxed(problem: Problem, hypothesis: Hypothesis, x: NDArray, ranked: RankedPort) -> JointFit:
    low, high = problem.bounds(hypothesis)
    best, trial, scale, readings = None, x, ranked.scale, 0
    for prepared in problem.fitted:
        model = model_of(problem, _at(problem, hypothesis, x), prepared)
        readings += model.modes.size * len(prepared.channels)
    for _ in range(RELAXED):
        at = _at(problem, hypothesis, trial)
        columns = [_columns(problem, at, prepared) for prepared in problem.fitted]
        models = [model_of(problem, at, prepared) for prepared in problem.fitted]
        with ThreadPoolExecutor(get_num_threads()) as pool:
            stats = list(
                pool.map(
                    lambda model, left: _statistics(
                        model, left, ranked.port, LEVELS * scale, ranked.pace_s
                    ),
                    models,
                    columns,
                )
            )
        prior = _prior(problem, at)
        value, levels = _most_likely(stats, prior)
        _, move, covariance = profiled_log_posterior(stats, levels, prior)
        here = value - 0.5 * _fall(stats, levels, move, prior)
        if best is not None and not here > best.log_posterior:
            trial = 0.5 * (best.x + trial)
            continue
        gained = np.inf if best is None else here - best.log_posterior
        sizes = LEVELS[np.array(levels)] * scale
        best = JointFit(
            ranked=replace(ranked, levels=sizes), x=trial, covariance=covariance,
            log_posterior=here, share=_taken_away(stats, levels, readings),
        )  # fmt: skip
        if gained < SETTLED:
            break
        trial = np.clip(trial + move, low, high)
    return best


def _at(problem: Problem, hypothesis: Hypothesis, x: NDArray) -> Fit:
    msni = np.full(len(problem.fitted), np.inf)
    return Fit(hypothesis=hypothesis, x=x, cost=np.inf, prior_cost=0.0, msni=msni)


def _prior(problem: Problem, fit: Fit) -> tuple[NDArray, NDArray]:
    centre, weight = problem.prior(fit.hypothesis)
    return weight**2 + 1e-9, fit.x - centre


def _columns(problem: Problem, fit: Fit, prepared: PreparedRecording) -> NDArray:
    """(1 + n, rows, channels): what the replay leaves, and its derivatives by the unknowns."""
    n = fit.x.size
    X = np.vstack([fit.x, *(fit.x + STEP * np.eye(n))])
    out = problem.predict(prepared, fit.hypothesis, X)
    columns = np.empty_like(out)
    columns[0] = prepared.measured - out[0]
    columns[1:] = -(out[1:] - out[0]) / STEP
    columns[~np.all(np.isfinite(columns), axis=(1, 2))] = 0.0
    return columns


def model_of(problem: Problem, fit: Fit, prepared: PreparedRecording) -> ErrorModel:
    """The errors' model of a recording around a fit."""
    machine = problem.trial_machine(prepared, fit.hypothesis, fit.x)
    r = prepared.recording
    plant = machine_of(Numbers(machine.plant, prepared.base.spring, machine.fx))
    return error_model(
        plant, machine.stiffness, channels=prepared.channels, floors=prepared.floors,
        row_s=r.sample_time_s, rows=r.rows, block=max(1, round(BLOCK_s / r.sample_time_s)),
        **observed(plant, r),
    )  # fmt: skip


def _magnitudes(prepared: PreparedRecording, model: ErrorModel) -> dict[str, float]:
    """Ports of a recording, and the size of a signal there to begin with."""
    plant = model.plant
    found = {f"{READING}{name}": COUNTS * prepared.floors[name] for name in prepared.channels}
    torque = max(plant.gravity, LEAST_TORQUE_Nm)
    if np.isfinite(plant.current_limit):
        torque = max(torque, TORQUE_SHARE * plant.current_limit * plant.torque_per_ampere)
    volts = max(plant.volts_per_command, 1.0)
    return found | {port: volts if port == "V" else torque for port in model.ports}


def _statistics(
    model: ErrorModel, columns: NDArray, port: str, sizes: NDArray, pace_s: float
) -> tuple[NDArray, NDArray]:
    """Log determinants (levels,) and Gram matrices (levels, 1+n, 1+n) of whitened columns."""
    m, _, p = columns.shape
    used = columns[:, : model.modes.size * model.block]
    used = np.ascontiguousarray(used.reshape(m, -1, model.block, p).mean(axis=2).swapaxes(0, 1))
    dets, grams = np.zeros(sizes.size), np.zeros((sizes.size, m, m))
    A, C, Q, P = model.with_input(port, pace_s)
    signal = SignalModel(A, C, model.R, Q, P, model.modes, model.drive)
    signal_likelihoods(used, signal, sizes, dets, grams)
    return dets, grams


def profiled_log_posterior(stats, at: Sequence[int], prior) -> tuple[float, NDArray, NDArray]:
    """Log posterior at given levels, the unknowns at their best; their move and covariance."""
    prior_weight, offset = prior
    det = sum(s[0][j] for s, j in zip(stats, at, strict=True))
    G = sum(s[1][j] for s, j in zip(stats, at, strict=True))
    g = G[1:, 0] + prior_weight * offset
    covariance = np.linalg.inv(G[1:, 1:] + np.diag(prior_weight))
    move = -covariance @ g
    total = G[0, 0] + offset @ (prior_weight * offset)
    return -0.5 * float(det + total + g @ move), move, covariance


def _fall(stats, at: Sequence[int], move: NDArray, prior) -> float:
    """By how much twice the negative log posterior falls over a move to its least."""
    prior_weight, offset = prior
    G = sum(s[1][j] for s, j in zip(stats, at, strict=True))
    return -float((G[1:, 0] + prior_weight * offset) @ move)


def _taken_away(stats, at: Sequence[int], readings: int) -> float:
    """Share of the squares above one per reading that levels other than zero take away."""
    squares = [
        sum(s[1][j][0, 0] for s, j in zip(stats, a, strict=True)) for a in ([0] * len(at), at)
    ]
    without, fit_jointly = (max(float(total) / readings - 1.0, 0.0) for total in squares)
    return 1.0 - min(fit_jointly / without, 1.0) if without > 0.0 else 0.0


def _most_likely(stats, prior) -> tuple[float, list[int]]:
    """The most likely levels, one recording after the other."""
    at, value = [0] * len(stats), -np.inf
    for _ in range(ROUNDS):
        before = value
        for b in range(len(stats)):
            tried = [
                profiled_log_posterior(stats, [*at[:b], j, *at[b + 1 :]], prior)[0]
                for j in range(LEVELS.size)
            ]
            at[b] = int(np.argmax(tried))
            value = tried[at[b]]
        if value - before < 0.5:
            break
    return value, at


def smoothed_signal(
    problem: Problem, hypothesis: Hypothesis, found: JointFit, index: int
) -> tuple[NDArray, NDArray, NDArray]:
    """The unknown signal in one fitted recording: times, values, standard deviations (blocks,).

    Fixed-interval smoothing of what the values leave (Rauch, Tung & Striebel, AIAA J. 3 (1965)
    1445).
    """
    prepared, ranked = problem.fitted[index], found.ranked
    model = model_of(problem, _at(problem, hypothesis, found.x), prepared)
    out = problem.predict(prepared, hypothesis, found.x[None])[0]
    n = model.modes.size
    left = (prepared.measured - out)[: n * model.block].reshape(n, model.block, -1).mean(axis=1)
    A, C, Q, P = model.with_input(ranked.port, ranked.pace_s)
    Q[0, 0] *= ranked.levels[index] ** 2
    P[0, 0] *= ranked.levels[index] ** 2
    mean, variance = smooth_errors(left, model.transitions(A), C, model.R, Q, P)
    time = prepared.recording.time_s[: n * model.block].reshape(n, -1).mean(axis=1)
    return time, mean, np.sqrt(np.maximum(variance, 0.0))
