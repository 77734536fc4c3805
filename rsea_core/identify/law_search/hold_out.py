"""Rows that values were not fitted to, and what a model found gains there.

Recordings that the case holds out serve as they are. Laws, values and noise come from the others,
but the states from which their windows start are smoothed on their own readings, with each model.
What they show is otherwise independent of the fit, and not of the search: laws that they refute are
dropped, and formulas that they do not confirm (`whole_runs/unseen.py` has further such uses).

A case without any, or with such that the laws do not concern, lends the last quarter of each
recording, after the search: both hypotheses are fitted to the rows before it once more. This tests
the values alone. The choice of the laws, the noise, the tempering and the smoothed starts of
windows were made from these rows too, so that their gain is no independent evidence of a law.

If only recordings held out let the load move, or include a contact, the others show nothing of it:
two thirds of these are fitted then, and the last third stays held out. So are two thirds of
recordings that parameters do not predict, although these suffice for those fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.load_base import HELD
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import even_ratio
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.criteria import (
    ERRORS_BEYOND,
    FEW_WINDOWS_ERROR,
    HORIZONS,
    KEPT_RATIO,
    LESS_ERROR,
    PREDICTABLE,
    SHORT,
    SILENT,
    UNEVEN_GAIN,
    WORSE,
)
from rsea_core.identify.multistep.criteria import LEAST_ROWS as LEAST_ROWS_OF_WINDOW
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import LEAST_ROWS, Experiment
from rsea_core.identify.multistep.horizons import smooth, with_windows
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import (
    Track,
    initial_track,
    prepared,
    scale_of,
    windows_of,
)
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

SHARED, LAST = 2.0 / 3.0, 0.25  # of a recording's rows
LEAST_WINDOWS = 3  # for a standard error
MOST_OF_REST = 2.0  # mean squared innovations over the largest of those fitted
PAUSES_s = (1.0, 30.0, 300.0, 3000.0)  # trial values of the pause between two recordings


def part_of(r: Recording, first: int, last: int, **changes) -> Recording:
    """Rows first to last (exclusive) of a recording."""
    columns = {name: values[first:last] for name, values in r.columns.items()}
    logged = r.logged and {name: values[first:last] for name, values in r.logged.items()}
    begun = {"initial_rest": r.initial_rest} if first == 0 else {"initial_rest": False}
    return replace(r, columns=columns, logged=logged, **begun, **changes)


def with_shared_recordings(
    case: Case, unpredicted: Sequence[str] = ()
) -> tuple[Case, dict[str, str]]:
    """The case with two thirds of the recordings fitted that alone show a kind of load.

    Parameters
    ----------
    unpredicted : sequence of str
        Files of recordings held out that values of the other recordings do not predict.

    Returns
    -------
    Case
    dict of str
        Why each of these recordings is shared, by file.
    """
    kinds = {r.load.kind for r in case.identification}
    recordings, shared = [], {}
    for r in case.recordings:
        why = None
        if r.role == "validation" and not r.quasi_static:
            why = _only_there(r.load.kind, kinds)
            if why is None and r.file in unpredicted:
                why = "values that explain the other recordings do not predict it"
        cut = int(SHARED * r.rows)
        if why is not None and cut >= LEAST_ROWS and r.rows - cut >= LEAST_ROWS:
            recordings += [part_of(r, 0, cut, role="identification"), part_of(r, cut, r.rows)]
            shared[r.file] = why
        else:
            recordings.append(r)
    return replace(case, recordings=tuple(recordings)), shared


def _only_there(kind: str, fitted: set[str]) -> str | None:
    """What only a recording with this kind of load shows; None if a fitted one shows it too."""
    if kind not in HELD and fitted <= set(HELD):
        return "no other recording lets the load move"
    if kind == "contact" and kind not in fitted:
        return "no other recording includes a contact"
    return None


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """What laws gain over parameters alone on rows held out.

    Attributes
    ----------
    gain : float
        In units.
    ratio : float
        Over its deviation between stretches; 0 where no whole recording is held out.
    """

    gain: float
    ratio: float = 0.0


def held_out(found: Found) -> HeldOut | None:
    """Gain of the laws over parameters alone on rows held out; None where there are none.

    Complete laws were tested on the last rows of each recording and on recordings held out
    (`whole_runs/unseen.py`).
    """
    if found.complete:
        return None
    trials = [(found.base.hypothesis, found.base.x), (found.best.hypothesis, found.best.x)]
    own, gain, ratio = found.estimator, 0.0, 0.0
    if any(b.recording.role == "validation" for b in found.problem.prepared):
        gain, ratio = _gain_held_out(found, trials, found.horizon)
    if abs(gain) < SILENT:  # recordings that do not move what the laws are about
        shortened = own.having([replace(t, seen=1.0 - LAST) for t in own.tracks])
        trials = [(h, shortened.fit(h, x, iterations=6).x) for h, x in trials]
        powers = [
            _power(own.innovations([trial])) - _power(shortened.innovations([trial]))
            for trial in trials
        ]
        gain, ratio = own.tempering * (powers[0] - powers[1]), 0.0
    return HeldOut(gain=gain, ratio=ratio) if np.isfinite(gain) else None


def beyond_chance(found: Found) -> tuple[Found, HeldOut | None]:
    """What was found and what it gains on rows held out; without laws that lose there, if weak.

    Laws that lose in windows as long as the machine seemed predictable, and gain evenly in short
    ones, are not refuted: the recordings held out are not predictable for so long. Lasting laws
    whose likelihood differs there are dropped if no reading is predicted better
    (`predicts_better`): in the small noise estimated with them any other model is unlikely, however
    well it predicts.
    """
    unseen = held_out(found) if found.steps else None
    if unseen is None or unseen.gain >= WORSE:
        lasting = any(step.law.only is None for step in found.steps)
        if unseen is not None and unseen.ratio and lasting and not predicts_better(found):
            return found.parameters_alone(), None
        return found, unseen
    shorter = held_out_in_short_windows(found)
    if shorter is not None and shorter.ratio > KEPT_RATIO:
        return found, shorter
    if found.steps[0].gain > UNEVEN_GAIN and not found.sound:
        return found, unseen
    return found.parameters_alone(), None


def predicts_better(found: Found) -> bool:
    """Whether laws predict any reading of recordings held out better than parameters alone do.

    Windows are from one time scale long to the longest in which the machine is predictable; if that
    is shorter, only these. A reading is predicted better if its error is lower beyond chance
    (`lower_beyond_chance`). True too if no window is long enough to judge by.
    """
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    longest = found.horizon or np.inf
    lengths = [h for h in HORIZONS if PREDICTABLE <= (h or np.inf) <= longest]
    lengths = [h for h in lengths or [found.horizon] if h is None or _long_enough(found, unseen, h)]
    for horizon in lengths:
        before = _squared_errors(found, unseen, found.base_estimator, found.base, horizon)
        after = _squared_errors(found, unseen, found.estimator, found.best, horizon)
        if any(lower_beyond_chance(after[name], old) for name, old in before.items()):
            return True
    return not lengths


def _long_enough(found: Found, experiments: list[Experiment], horizon: float) -> bool:
    """Whether windows of a length hold enough averaged rows of each recording."""
    block = max(t.block for t in found.estimator.tracks)
    rows = (horizon * scale_of(e).time_s / e.recording.sample_time_s for e in experiments)
    return min(rows) > LEAST_ROWS_OF_WINDOW * block


def lower_beyond_chance(new: NDArray, old: NDArray) -> bool:
    """Whether mean squared errors of windows (w,) are lower than others (w,) beyond chance.

    The root mean square of the errors must be below `LESS_ERROR` of the others', and the mean
    difference of the windows, relative to the sum of both, must exceed `ERRORS_BEYOND` of its
    standard errors. (If one window contributes nearly all of the squared error, absolute
    differences have a standard error as large as their mean.) With fewer than three
    windows the errors must be below `FEW_WINDOWS_ERROR`. True where only the new ones are finite.
    """
    if not np.all(np.isfinite(new)):
        return False
    if not np.all(np.isfinite(old)):
        return True
    if len(old) < LEAST_WINDOWS:
        return bool(np.mean(new) < FEW_WINDOWS_ERROR**2 * np.mean(old))
    relative = (old - new) / np.maximum(old + new, np.finfo(float).tiny)
    standard_error = np.std(relative, ddof=1) / len(old) ** 0.5
    lower = np.mean(new) < LESS_ERROR**2 * np.mean(old)
    return bool(lower and np.mean(relative) > ERRORS_BEYOND * standard_error)


def _squared_errors(
    found: Found, experiments: list[Experiment], like: Estimator, fit: Estimate,
    horizon: float | None,
) -> dict[str, NDArray]:  # fmt: skip
    """Mean squared errors of each reading in the windows of recordings (all windows,)."""
    trial = (fit.hypothesis, fit.x)
    own, errors = of_recordings(found, experiments, trial, horizon, like), {}
    for t, residual in zip(own.tracks, own.residuals([trial]), strict=True):
        first = t.windows.rows[:, 0]
        sums = np.add.reduceat(residual[0] ** 2, first, axis=0)
        means = sums / np.diff(np.append(first, t.experiment.rows))[:, None]
        for j, name in enumerate(t.experiment.channels):
            errors.setdefault(name, []).append(means[:, j])
    return {name: np.concatenate(parts) for name, parts in errors.items()}


def held_out_in_short_windows(found: Found) -> HeldOut | None:
    """Gain of the laws on recordings held out in windows of one time scale.

    A machine that stops at detents, or turns over, is not predictable for longer whatever its laws:
    the smallest error of the start decides where it comes to rest. None without such recordings.
    """
    if not any(b.recording.role == "validation" for b in found.problem.prepared):
        return None
    trials = [(found.base.hypothesis, found.base.x), (found.best.hypothesis, found.best.x)]
    gain, ratio = _gain_held_out(found, trials, PREDICTABLE)
    return HeldOut(gain=gain, ratio=ratio) if np.isfinite(gain) else None


def _gain_held_out(found: Found, trials: list, horizon: float | None) -> tuple[float, float]:
    """Gain of the second trial over the first on recordings held out, and over its deviation."""
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    others = [of_recordings(found, unseen, trial, horizon) for trial in trials]
    before, after = (o.innovations([t]) for o, t in zip(others, trials, strict=True))
    gain = found.estimator.tempering * (_power(before) - _power(after))
    return gain, even_ratio(others[1], before, after) if np.isfinite(gain) else 0.0


def with_pause_shown(
    found: Found, trial: tuple[Hypothesis, NDArray], horizon: float | None
) -> tuple[Hypothesis, NDArray]:
    """A trial with the pause before recordings held out that predicts these best.

    If one recording is fitted, none of its rows depends on the pause after it: the temperature at
    the next start is an unknown initial state, estimated as the other ones are.
    """
    h, _ = trial
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    if not unseen or len(found.problem.fitted) > 1 or DriveThermal.effect not in h.effects:
        return trial
    tried = [trial, *((h, _rested(found, trial, pause_s)) for pause_s in PAUSES_s)]
    costs = [_power(of_recordings(found, unseen, t, horizon).innovations([t])) for t in tried]
    return tried[int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))]


def _rested(found: Found, trial: tuple[Hypothesis, NDArray], pause_s: float) -> NDArray:
    h, x = trial
    _, values = found.problem.values(h, x)
    starts = [
        [pause_s if u.name == "pause_s" else v[u.name] for u in law.unknowns]
        for law, v in zip(h.laws, values, strict=True)
    ]
    moved = found.problem.start(h, starts)
    count = len(found.problem.nominals)
    return np.concatenate([x[:count], moved[count:]])


def free_run(found: Found, e: Experiment, trial: tuple[Hypothesis, NDArray]) -> NDArray:
    """Readings (n, p) that a trial predicts for all rows of a recording.

    One that begins in motion starts where the trial and the readings say together (smoothing in
    windows of `SHORT`); a machine at rest at the first readings, as the file contract says.
    """
    h, x = trial
    if e.recording.initial_rest:
        return found.problem.predict(e, h, x[None])[0]
    tracks = of_recordings(found, [e], trial, SHORT).tracks
    whole = windows_of(e.rows, e.rows, tracks[0].motion)
    machine = [found.problem.trial_machine(e, h, x)]
    return e.readings(e.runs(machine, whole), machine, whole)[0]


def predicts_rest(found: Found) -> bool:
    """Whether the rows held out of recordings that are fitted are predicted as well as the others.

    By the mean squared innovations in windows of one time scale: the rest begins in motion, and
    where nothing pulls a machine back a small error of its start prevails in longer ones.
    """
    trial, fitted = (found.best.hypothesis, found.best.x), found.problem.fitted
    files = {e.recording.file for e in fitted}
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    rest = [e for e in unseen if e.recording.file in files]
    if not rest:
        return True
    means = []
    for experiments in (fitted, rest):
        own = of_recordings(found, experiments, trial, PREDICTABLE)
        means.append([float(np.mean(huber_squares(e[0]))) for e in own.innovations([trial])])
    return max(means[1]) < MOST_OF_REST * max(*means[0], 1.0)


def _power(innovations: list[NDArray]) -> float:
    return sum(0.5 * float(np.sum(huber_squares(e))) for e in innovations)


def of_recordings(
    found: Found, experiments: list[Experiment], trial, horizon: float | None,
    like: Estimator | None = None,
) -> Estimator:  # fmt: skip
    """An estimator of other recordings, in windows of a length, noise and blocks of those fitted.

    Windows begin where the trial and the readings say together.

    Parameters
    ----------
    like : Estimator or None
        Whose noise and blocks are used; None: that of the laws found.
    """
    like = like or found.estimator
    tracks = []
    for e in experiments:
        same = [t for t in like.tracks if t.experiment.channels == e.channels]
        tracks.append(_track_like(e, (same or like.tracks)[0]))
    estimator = Estimator(found.problem, tracks, tempering=like.tempering, cache=like.cache)
    for _ in range(2):
        estimator.tracks = with_windows(estimator, horizon)
        smooth(estimator, *trial)
        estimator.tracks = [prepared(t) for t in estimator.tracks]
    return estimator


def _track_like(e: Experiment, like: Track) -> Track:
    """A recording with another's noise and block."""
    track = initial_track(e, like.block)
    return prepared(track, noise=like.noise) if e.channels == like.experiment.channels else track
