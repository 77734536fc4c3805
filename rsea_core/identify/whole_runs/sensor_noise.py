"""Fits of whole recordings whose errors the sensors' noise alone may fill.

The filter of the multistep search takes what a model lacks for an unknown torque, which the noise
of each hypothesis is free to hold: a slow torque takes the place of a parallel spring. Here the
readings keep the noise that their fastest changes show, and unknown torques are as good as none.
A model that is complete leaves one deviation of that noise; what leaves many lacks something.
The output-error structure: Ljung, System Identification (1999), section 4.2; the analysis of what
is left: section 16.6.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import at_bound
from rsea_core.identify.multistep.criteria import (
    COMPLETE,
    COMPLETE_SHARE,
    EXPLAINED,
    LEAST_GAIN,
    NEGLIGIBLE_FALL,
    SCANS,
    SENSOR_COLOUR_ROWS,
    SENSORS_ALONE,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import with_windows
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import Track, from_rest, prepared
from rsea_core.identify.smoothing.encoder_quantisation import UNIFORM, changes_by_counts, count_of

DECORRELATED = 5.0  # time constants after which coloured noise is taken for uncorrelated
LARGEST_NOISE = 10.0  # of what fourth differences of a reading show: coloured noise has more
UNSURE = 10.0  # by so much the smoother's deviations are too small after unknown commands
STEPS = np.geomspace(0.05, 6.0, 28)  # of a value, in tolerances
MOVES = np.concatenate([-STEPS[::-1], [0.0], STEPS])
LEAST_OF_FLOOR = 1e-3  # noise that is left, of the floor by differences between rows, at least
CONVERGED = 60  # iterations at most, of the law that is taken: its minimum may be flat


def in_sensor_noise(estimator: Estimator, fit: Estimate | None = None) -> Estimator:
    """Another estimator, of whole recordings, with the readings' noise and hardly any torques'.

    Errors that last over many rows are the model's: a sensor's colour is its filter's. If the
    unknown torque was estimated so large that it explains single counts, the estimated noise of an
    encoder is too small: that of the counts is its lower limit.

    Parameters
    ----------
    fit : Estimate or None
        What states how late commands act. A recording that begins in motion does not hold the
        commands that act in its first rows: these do not count. The errors of this fit also
        limit the noise (`std_of_differences`).
    """
    late_s = 0.0 if fit is None else _delay_s(estimator, fit)
    tracks = []
    for t in with_windows(estimator, None):
        t = from_rest(_without_lead(t, late_s), certain=False)
        noise, readings = t.noise, t.noise.readings
        if _of_sensor(t):
            readings = np.hypot(readings, noise.colours)
        readings = np.maximum(readings, _quantisation(t))
        inputs, colours = SENSORS_ALONE * noise.inputs, 0.0 * noise.colours
        noise = replace(noise, inputs=inputs, readings=readings, colours=colours)
        tracks.append(prepared(t, noise=noise))
    if fit is not None:
        tracks = _with_limited_noise(estimator.having(tracks), fit)
    own = estimator.having(tracks)
    own.tempering = 1.0
    return own


def _with_limited_noise(own: Estimator, fit: Estimate) -> list[Track]:
    """Tracks whose readings have no more noise than differences of a fit's errors show.

    Noise that was estimated without a law that the machine has includes the model's error; a drift
    can exceed the sensor's noise many times. Where no values predict the machine, their errors are
    no limit, and the readings' own changes are one.
    """
    tracks = []
    for t, r in zip(own.tracks, own.residuals([(fit.hypothesis, fit.x)]), strict=True):
        row_s = t.block * t.experiment.recording.sample_time_s
        lag = max(round(DECORRELATED * t.noise.colour_time_s / row_s), 1) if _of_sensor(t) else 1
        least = np.maximum(t.experiment.floor_of_each / t.block**0.5, _quantisation(t))
        most = np.minimum(
            std_of_differences(t.averaged(r[0]), lag),
            LARGEST_NOISE * std_of_fourth_differences(t.averaged(t.experiment.measured)),
        )
        most = np.maximum(most, least)
        if np.all(np.isfinite(most)):
            t = prepared(t, noise=replace(t.noise, readings=np.minimum(t.noise.readings, most)))
        tracks.append(t)
    return tracks


def std_of_differences(errors: NDArray, lag: int) -> NDArray:
    """Standard deviations (p,) of the noise in errors (n, p) by differences over some rows.

    Noise that is uncorrelated over the lag has this standard deviation (von Neumann et al., Ann.
    Math. Stat. 12 (1941) 153, at a lag of one row); slower errors of the model cancel.
    """
    return np.std(errors[lag:] - errors[:-lag], axis=0) / 2.0**0.5


def std_of_fourth_differences(readings: NDArray) -> NDArray:
    """Standard deviations (p,) of readings (n, p) beside a motion that is smooth over five rows.

    Of fourth differences, in which white noise of unit deviation has sqrt(70) and a cubic nothing:
    an upper limit of white noise; of noise with a time constant of r rows they see about r^-1/2.
    """
    return np.std(np.diff(readings, 4, axis=0), axis=0) / 70.0**0.5


def _quantisation(t: Track) -> NDArray:
    """Standard deviations (p,) of averaged readings by their counts alone; 0 without counts."""
    e = t.experiment
    found = np.zeros(len(e.channels))
    for j, (column, floor) in enumerate(zip(e.measured.T, e.floor_of_each, strict=True)):
        count = floor / UNIFORM**0.5  # where the file states counts, of these
        count = count if changes_by_counts(column, count) else count_of(column) or 0.0
        found[j] = count * (UNIFORM / t.block) ** 0.5
    return found


def _of_sensor(t: Track) -> bool:
    """Whether the colour of a track's readings is short enough to be the sensor's own."""
    row_s = t.block * t.experiment.recording.sample_time_s
    return bool(t.noise.colours.size and t.noise.colour_time_s < SENSOR_COLOUR_ROWS * row_s)


def is_coloured(estimator: Estimator) -> bool:
    """Whether most of a reading's noise is coloured, which may be the error of a missing law."""
    return any(
        _of_sensor(t) and np.any(t.noise.colours > t.noise.readings) for t in estimator.tracks
    )


def in_noise_left_by(own: Estimator, fit: Estimate, *, apart: bool = False) -> Estimator:
    """Another estimator, the noise of each reading as large as the errors that a fit leaves.

    Noise that was estimated while a law was missing includes the error that this law explains. It
    is no less than that of the counts. The differences between rows are no lower limit: where a
    cycle has few rows they show the motion.

    Parameters
    ----------
    apart : bool
        The noise of each recording is what is left of it; else the ratio of noises stays.
    """
    found = own.innovations([(fit.hypothesis, fit.x)])
    sizes = [np.sqrt(np.mean(huber_squares(e[0]), axis=0)) for e in found]
    largest: dict[str, float] = {}
    for t, size in zip(own.tracks, sizes, strict=True):
        for name, each in zip(t.experiment.channels, size, strict=True):
            largest[name] = max(largest.get(name, 0.0), float(each))
    tracks = []
    for t, size in zip(own.tracks, sizes, strict=True):
        share = size if apart else np.array([largest[name] for name in t.experiment.channels])
        least = LEAST_OF_FLOOR * t.experiment.floor_of_each / t.block**0.5
        least = np.minimum(np.maximum(_quantisation(t), least), t.noise.readings)
        readings = np.maximum(share * t.noise.readings, least)
        tracks.append(prepared(t, noise=replace(t.noise, readings=readings)))
    return own.having(tracks)


def _delay_s(estimator: Estimator, fit: Estimate) -> float:
    """How late commands act, by a fit."""
    _, values = estimator.problem.values(fit.hypothesis, fit.x)
    laws = zip(fit.hypothesis.laws, values, strict=True)
    return max((v["delay_s"] for law, v in laws if law.kind is DriveDelay), default=0.0)


def _without_lead(t: Track, late_s: float) -> Track:
    """A track of a whole recording without rows in which commands before it act.

    The smoother, which did not know these, is sure of a wrong motion at their end.
    """
    r, whole = t.experiment.recording, t.windows
    late_rows = late_s / r.sample_time_s
    lead = t.block * int(np.ceil(max(late_rows, 2.0) / t.block))  # a window has two rows at least
    if r.initial_rest or late_s == 0.0 or lead > whole.rows[-1, 1] // 2:
        return t
    rows = np.array([[0, lead - 1], [lead, whole.rows[-1, 1]]])
    spread = np.concatenate([t.motion_std[:lead], UNSURE * t.motion_std[lead:]])
    return replace(t, windows=replace(whole, rows=rows), motion_std=spread, lead=lead)


def converged(own: Estimator, h: Hypothesis, x: NDArray) -> Estimate:
    """A fit that is repeated from its end until the cost no longer falls.

    Damping that was once increased keeps steps short, so that a fit stops early where the cost is
    flat.
    """
    fit = own.fit(h, x, iterations=CONVERGED, fine=True)
    for _ in range(SCANS):
        before, fit = fit, own.fit(h, fit.x, iterations=CONVERGED, fine=True)
        if before.cost - fit.cost < max(LEAST_GAIN, NEGLIGIBLE_FALL * abs(fit.cost)):
            break
    return fit


def refitted_from_rig(own: Estimator, fit: Estimate) -> Estimate:
    """A fit, or a likelier one that starts from the rig file's values with the fit's laws.

    Where no reading states a torque, a common scale factor of torques and inertias changes only the
    prior's cost. Levenberg-Marquardt converges slowly along such a curved valley, and a fit may
    stop far from the rig file's values.
    """
    x = fit.x.copy()
    x[: len(own.problem.nominals)] = 0.0
    other = own.fit(fit.hypothesis, x, iterations=CONVERGED, fine=True)
    stopped = any(at_bound(own.problem, other, law) for law in fit.hypothesis.laws)
    return fit if stopped or not other.cost < fit.cost else other


def well_fitted(own: Estimator, fit: Estimate) -> Estimate:
    """A fit, or a likelier one that begins where one of the machine's values is better elsewhere.

    The errors of a machine that swings lightly damped have a minimum for each cycle by which the
    simulation is early or late: a fit that is three percent off in frequency stays there.
    """
    fit = refitted_from_rig(own, fit)
    h, count = fit.hypothesis, len(own.problem.nominals)
    for _ in range(SCANS):
        moves = np.kron(np.eye(count, fit.x.size), MOVES[:, None])
        costs = np.array(own.costs([(h, fit.x + move) for move in moves])).reshape(count, -1)
        lowest = _minima(np.where(np.isfinite(costs), costs, np.inf))
        starts = [fit.x + moves[k] for k in lowest[:SCANS]] or [fit.x]
        other = min((own.fit(h, x, iterations=12) for x in starts), key=lambda f: f.cost)
        fall = fit.cost - other.cost
        fit = other if fall > 0.0 else fit
        if fall < max(LEAST_GAIN, NEGLIGIBLE_FALL * abs(fit.cost)):
            break
    return fit


def _minima(costs: NDArray) -> NDArray:
    """Flat indices of the local minima in rows of costs (n, k), the lowest first.

    The middle column is the fit itself and is left out.
    """
    inner = (costs[:, 1:-1] < costs[:, :-2]) & (costs[:, 1:-1] <= costs[:, 2:])
    inner[:, costs.shape[1] // 2 - 1] = False
    places = np.flatnonzero(np.pad(inner, ((0, 0), (1, 1))))
    return places[np.argsort(costs.ravel()[places])]


def misfit(own: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Largest root mean square error of a reading, in deviations of its noise; inf: no prediction.

    Errors beyond Huber's bound count linearly, so that a few rows that read nonsense do not decide.
    """
    worst = 0.0
    for e in own.innovations([(h, x)]):
        if not np.all(np.isfinite(e[0])):
            return np.inf
        worst = max(worst, float(np.sqrt(np.max(np.mean(huber_squares(e[0]), axis=0)))))
    return worst


def excess(own: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Cost of the errors beyond that of the noise, in units; 0 where noise alone costs as much."""
    found = own.innovations([(h, x)])
    return max(sum(0.5 * float(np.sum(huber_squares(e) - 1.0)) for e in found), 0.0)


def complete_below(left: float) -> float:
    """Misfit below which laws are complete, by what parameters alone leave."""
    most = float(np.sqrt(1.0 + (1.0 - EXPLAINED) * max(left**2 - 1.0, 0.0)))
    return max(min(COMPLETE, most), COMPLETE_SHARE * left)
