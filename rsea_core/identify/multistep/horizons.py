"""How far a machine is predictable: windows of growing length, with the noise that they show.

A horizon whose error stays near the spread of the readings ends the growth; the longest one that
is kept is where laws are judged (docs/diagnosis-search.md 10.3).
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.coloured_noise import with_coloured_readings
from rsea_core.identify.multistep.criteria import (
    DELAY_FIT,
    DELAYS,
    DELAYS_FITTED,
    FINE_STEPS,
    FIRST_STEPS,
    HORIZONS,
    LEAST_FINENESS,
    LEAST_ROWS,
    LINEAR_GAIN,
    LOST,
    OUTPUT_ERROR,
    QUIET,
    RICHARDSON,
    STEP_ERROR,
    STEP_ROUNDS,
)
from rsea_core.identify.multistep.estimator import (
    Estimate,
    Estimator,
    independent_share,
    initial_estimator,
)
from rsea_core.identify.multistep.experiment import (
    DELAY_STEP_ROWS,
    EngineSteps,
    MultistepProblem,
)
from rsea_core.identify.multistep.noise_estimate import NOISE_STEPS, estimated_noise
from rsea_core.identify.multistep.tracks import (
    Track,
    about,
    prepared,
    resmoothed,
    windows_of,
)


def with_windows(estimator: Estimator, horizon: float | None) -> list[Track]:
    """The tracks in windows of a length in time scales of the motion."""
    found = []
    for t in estimator.tracks:
        e = t.experiment
        rows = e.rows
        if horizon is not None:
            rows = int(horizon * t.scale.time_s / e.recording.sample_time_s)
        found.append(prepared(t, windows=windows_of(e.rows, rows, t.motion, t.block)))
    return found


def smooth(estimator: Estimator, h: Hypothesis, x: NDArray) -> None:
    """Take the motion that a fit and the readings show together."""
    found = []
    for t in estimator.tracks:
        e = t.experiment
        machine = [estimator.problem.trial_machine(e, h, x)]
        run = e.runs(machine, t.windows)
        residual = e.measured - e.readings(run, machine, t.windows)[0]
        if np.all(np.isfinite(residual)) and np.max(np.abs(residual)) < 1e12:
            with suppress(np.linalg.LinAlgError):  # the motion before stays
                t = resmoothed(about(t, machine[0], h), run[0], residual)
        found.append(t)
    estimator.tracks = found


def with_noise(
    estimator: Estimator, h: Hypothesis, x: NDArray, *, steps: Sequence[float] = FINE_STEPS
) -> Estimator:
    """Another estimator whose noise is that of a fit."""
    residuals = [r[0] for r in estimator.residuals([(h, x)])]
    if not all(np.all(np.isfinite(r)) for r in residuals):
        return estimator
    trial = estimator.problem.trial_machine
    tracks = [about(t, trial(t.experiment, h, x), h) for t in estimator.tracks]
    return estimator.having(estimated_noise(tracks, residuals, steps=steps))


def with_output_error(estimator: Estimator, h: Hypothesis, x: NDArray) -> Estimator:
    """Another estimator that takes what a fit leaves for noise of the readings, and for no torque.

    Its fit is that of least squares over whole windows.
    """
    tracks = []
    for t, residual in zip(estimator.tracks, estimator.residuals([(h, x)]), strict=True):
        power = np.mean(t.averaged(residual[0]) ** 2, axis=0)
        readings = np.sqrt(np.maximum(power, t.noise.readings**2))
        noise = replace(t.noise, inputs=OUTPUT_ERROR * t.noise.inputs, readings=readings)
        tracks.append(prepared(t, noise=noise) if np.all(np.isfinite(power)) else t)
    return estimator.having(tracks)


def without_slow_torque(estimator: Estimator) -> Estimator:
    """Another estimator, in which a torque that acts once is not taken for one that wanders."""
    tracks = []
    for t in estimator.tracks:
        inputs = t.noise.inputs * np.array([1.0, 1.0, 1.0, OUTPUT_ERROR, 1.0])
        tracks.append(prepared(t, noise=replace(t.noise, inputs=inputs)))
    return estimator.having(tracks)


def relative_error(estimator: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Largest error of an angle over its spread, over all recordings."""
    worst = 0.0
    for t, r in zip(estimator.tracks, estimator.residuals([(h, x)]), strict=True):
        for j, name in enumerate(t.experiment.channels):
            moved = np.std(t.experiment.measured[:, j]) > QUIET * t.experiment.floor_of_each[j]
            if name.endswith(("angle_rad", "rad_per_s")) and moved:
                spread = np.std(t.experiment.measured[:, j]) or 1.0
                worst = max(worst, float(np.sqrt(np.mean(r[0, :, j] ** 2))) / spread)
    return worst if np.isfinite(worst) else np.inf


DELAY = f"{DriveDelay.effect}.delay_s"
Growth = tuple[Estimator, Estimate, float | None]
"""Parameters fitted, and the horizon up to which the machine is predictable with them."""


def parameters(
    problem: MultistepProblem, h: Hypothesis, say, *, output_errors: bool = False,
    delay: float | None = None,
) -> Growth:  # fmt: skip
    """Parameters and nuisances over growing horizons, as far as the machine is predictable.

    Parameters
    ----------
    output_errors : bool
        Fit each horizon from whole windows too: unknown torques that are once estimated large
        explain any motion, and no value is pulled out of its wrong place any more.
    delay : float or None
        The unknown of the command's delay as another growth found it: the start, without a search.
    """
    x = problem.start(h)
    if delay is not None:
        x[problem.names(h).index(DELAY)] = delay
    growth, late = _grown(problem, h, x, say, output_errors, delay is not None)
    if not late:
        return growth
    say("grown again with the delay that the longest windows show")
    at = problem.names(h).index(DELAY)
    x[at] = growth[1].x[at]
    again, _ = _grown(problem, h, x, say, output_errors, True)
    lost = relative_error(growth[0], h, growth[1].x) > LOST
    return again if lost else best_of(growth, again)


def delay_of(growth: Growth) -> float | None:
    """Unknown of the command's delay; None where none is free."""
    estimator, fit, _ = growth
    names = estimator.problem.names(fit.hypothesis)
    return float(fit.x[names.index(DELAY)]) if DELAY in names else None


def best_of(*ends: Growth) -> Growth:
    """The likeliest of those that are predictable for longest."""
    longest = max(_length(horizon) for *_, horizon in ends)
    ends = [end for end in ends if _length(end[2]) == longest]
    return *likelier(*(end[:2] for end in ends)), ends[0][2]


def _length(horizon: float | None) -> float:
    return np.inf if horizon is None else horizon


def _grown(
    problem: MultistepProblem, h: Hypothesis, x: NDArray, say, output_errors: bool,
    delay_is_known: bool,
) -> tuple[Growth, bool]:  # fmt: skip
    """Parameters from a start, and whether the longest windows alone showed the command's delay."""
    estimator = initial_estimator(problem)
    smooth(estimator, h, x)
    kept, known = None, False
    for horizon in HORIZONS:
        if horizon is not None and not long_enough(estimator, horizon):
            continue
        trial = estimator.having(with_windows(estimator, horizon))
        near = known or delay_is_known
        fit = trial.fit(h, x, iterations=5) if near else with_best_delay(trial, h, x)
        ends = [_in_own_noise(trial, fit)]
        if output_errors:
            ends.append(_from_output_error(trial, h, x, near))
        trial, fit = with_fine_steps(*likelier(*ends), say)
        error = relative_error(trial, h, fit.x)
        say(f"parameters over {horizon or 'all'} T: error {error:.3g} of the spread")
        if known and error > LOST:
            break
        x, estimator, kept, known = fit.x, trial, horizon, True
        smooth(estimator, h, x)
    estimator = with_noise(estimator.having(with_windows(estimator, kept)), h, x)
    estimator = with_coloured_readings(estimator, h, x, say)
    plain = estimator.fit(h, x)
    fit = with_best_delay(estimator, h, plain.x)  # short windows hardly show one
    late = fit.cost < plain.cost - LINEAR_GAIN
    if late:
        smooth(estimator, h, fit.x)
        estimator = estimator.having([prepared(t) for t in estimator.tracks])
        estimator = with_noise(estimator, h, fit.x, steps=NOISE_STEPS)
        fit = estimator.fit(h, fit.x)
    estimator.tempering = independent_share(estimator, h, fit.x)
    say(f"independent share of the innovations: {estimator.tempering:.3g}")
    return (estimator, estimator.fit(h, fit.x), kept), late


def likelier(*ends: tuple[Estimator, Estimate]) -> tuple[Estimator, Estimate]:
    """The likelier of some fits, at one share of independent innovations."""
    share = min(own.tempering for own, _ in ends)
    return min(ends, key=lambda end: share * end[1].negative_log_likelihood + end[1].prior_cost)


def _in_own_noise(estimator: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit in the noise that it needs and with its share of independent innovations."""
    h = fit.hypothesis
    own = with_noise(estimator, h, fit.x, steps=NOISE_STEPS)
    own.tempering = independent_share(own, h, fit.x)
    return own, own.fit(h, fit.x, iterations=5)


def _from_output_error(
    estimator: Estimator, h: Hypothesis, x: NDArray, known: bool
) -> tuple[Estimator, Estimate]:
    """The same from a fit to whole windows."""
    for _ in range(2):  # the noise of the readings is first that of the values before
        output = with_output_error(estimator, h, x)
        fit = output.fit(h, x, iterations=5) if known else with_best_delay(output, h, x)
        x = fit.x
    return _in_own_noise(output, fit)


def with_best_delay(estimator: Estimator, h: Hypothesis, x: NDArray) -> Estimate:
    """A fit whose delay began where the cost is lowest.

    A late command is an error of phase: from a wrong delay a fit biases the machine's values.
    """
    names = estimator.problem.names(h)
    tried = [estimator.fit(h, x, iterations=DELAY_FIT)]
    stated = any(law.kind is DriveDelay and law.unknowns[0].log for law in h.laws)
    if DELAY in names and not stated:
        starts = [x.copy() for _ in DELAYS]
        for start, rows in zip(starts, DELAYS, strict=True):
            start[names.index(DELAY)] = rows / DELAY_STEP_ROWS
        costs = estimator.costs([(h, start) for start in starts])
        tried += [
            estimator.fit(h, starts[j], iterations=DELAY_FIT)
            for j in np.argsort(costs)[:DELAYS_FITTED]
        ]
    return estimator.fit(h, min(tried, key=lambda fit: fit.cost).x, iterations=5)


def long_enough(estimator: Estimator, horizon: float) -> bool:
    """Whether windows of a length hold enough rows to tell a start from a motion."""
    return all(
        horizon * t.scale.time_s > LEAST_ROWS * t.block * t.experiment.recording.sample_time_s
        for t in estimator.tracks
    )


def with_fine_steps(
    estimator: Estimator, base: Estimate, say, *, per_cycle: float = FIRST_STEPS
) -> tuple[Estimator, Estimate]:
    """The same fit with engine steps so short that no innovation shows them.

    The engine's error falls with the square of its step: what half of it changes tells what is
    needed. Noise that was estimated beside that error holds it, so that one look is not enough.

    Parameters
    ----------
    per_cycle : float
        Steps in the fastest cycle, at least.
    """
    h, steps = base.hypothesis, estimator.problem.steps
    if steps.per_cycle / steps.fineness < per_cycle:
        estimator = in_steps(estimator, EngineSteps(per_cycle))
        base = estimator.fit(h, base.x)
    for _ in range(STEP_ROUNDS):
        steps = estimator.problem.steps
        half = steps._replace(fineness=0.5 * steps.fineness)
        before = estimator.innovations([(h, base.x)])
        after = in_steps(estimator, half).innovations([(h, base.x)])
        error = max(
            float(np.sqrt(np.mean((e - f) ** 2))) for e, f in zip(before, after, strict=True)
        )
        if not error > STEP_ERROR or steps.fineness <= LEAST_FINENESS:
            break
        wanted = steps.fineness * np.sqrt(0.5 * STEP_ERROR / (RICHARDSON * error))
        finer = steps._replace(fineness=float(np.clip(wanted, LEAST_FINENESS, half.fineness)))
        say(f"steps moved the innovations by {error:.2g} deviations: {finer.fineness:.2g} of them")
        estimator = in_steps(estimator, finer)
        estimator = with_noise(estimator, h, estimator.fit(h, base.x).x, steps=NOISE_STEPS)
        smooth(estimator, h, base.x)
        estimator = estimator.having([prepared(t) for t in estimator.tracks])
        base = estimator.fit(h, base.x)
    return estimator, base


def in_steps(estimator: Estimator, steps: EngineSteps) -> Estimator:
    """The estimator with experiments in other steps."""
    problem = estimator.problem
    return with_problem(
        estimator, MultistepProblem(problem.case, timing=problem.timing, steps=steps)
    )


def with_problem(estimator: Estimator, problem: MultistepProblem) -> Estimator:
    """The estimator with the experiments of another problem, in the same windows and noise."""
    tracks = [
        prepared(replace(t, experiment=e))
        for t, e in zip(estimator.tracks, problem.fitted, strict=True)
    ]
    return Estimator(problem, tracks, tempering=estimator.tempering, cache=estimator.cache)
