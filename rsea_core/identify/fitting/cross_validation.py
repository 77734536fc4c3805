"""Replays in windows that start from smoothed states: what a law predicts a while ahead.

A free run over a whole recording adds up every small error: on a machine without a restoring
torque it ranks the luck of its offset, not its physics. Windows of a few seconds, each started
from the smoothed state (`smooth`) with what the motion does not show (presliding, play, spring
memory, heat) carried along the measured motion by the law's own equations (`Replay.warm`), rank
the physics. The cross-validated figure fits on some windows and measures on the others; folds are
interleaved in time, so that each sees the whole recording's conditions. A diagnosis fits to windows
(`selection/final_refinement.py`) and does not cross-validate: `cross_validate` serves
`benchmarks/real_recordings_figures.py`.

Sources: multiple shooting with given starts, docs/diagnosis.md 5.3, 5.4; folds of blocks instead of
rows because errors of neighbouring rows go together (Roberts et al., Ecography 40 (2017) 913).
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.predictions import predict_readings
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.fitting.window_predictions import (
    Cut,
    WINDOW_s,
    cut,
    predict_many,
    predict_windows,
)

FOLDS = 10
FREE_RUN = (
    0.2  # weight of the whole recording together with its windows, each in units of its own error
)
EFFECTIVE = 4.0  # independent errors that a window is worth, each channel
ITERATIONS, ROUNDS = 10, 3
FAR = np.inf  # errors of laws have no outliers


@dataclass(frozen=True, kw_only=True)
class WindowError:
    """Prediction error of one channel of one recording over all its windows.

    Attributes
    ----------
    rmse : float
        Root mean square over the rows of all windows, unit of the channel.
    by_window : (w,) array
        Root mean square of each.
    spread : float
        Standard deviation of the readings over the recording.
    """

    file: str
    role: str
    signal: str
    windows: int
    rmse: float
    by_window: NDArray
    spread: float


@dataclass(frozen=True, kw_only=True)
class CrossValidated:
    """Errors of windows that took no part in the fit that predicts them.

    Attributes
    ----------
    errors : tuple of WindowError
        One for each recording and channel.
    fits : tuple of Fit
        One for each fold.
    """

    window_s: float
    folds: int
    errors: tuple[WindowError, ...]
    fits: tuple[Fit, ...] = field(repr=False)


class WindowedProblem(Problem):
    """A problem whose innovations are the errors of windows, in units of a scale of each channel.

    Parameters
    ----------
    problem : Problem
    cuts : sequence of Cut
        Recordings that are too short for a window are not among them.
    scale : mapping of channel -> float
    """

    def __init__(self, problem: Problem, cuts: Sequence[Cut], scale: Mapping[str, float]):
        self.__dict__.update(copy.copy(problem.__dict__))
        self.cuts = {c.prepared.recording.file: c for c in cuts}
        self.used = {c.prepared.recording.file: np.ones(len(c.overlapping), bool) for c in cuts}
        self.scale = scale
        self.free_scale: dict[str, NDArray] = {}  # of free runs; those without one do not count
        self.fitted = [b for b in problem.fitted if b.recording.file in self.cuts]

    def innovations_of(self, trials, recordings=None) -> list[NDArray]:
        """Errors (m, rows of the used windows, channels) over the scale."""
        found = []
        for prepared in self.fitted if recordings is None else recordings:
            piece = self.cuts[prepared.recording.file]
            windows = piece.overlapping[self.used[prepared.recording.file]]
            scale = np.array([self.scale[name] for name in prepared.channels])
            machines = [self.trial_machine(prepared, hypothesis, x) for hypothesis, x in trials]
            every = piece.decimation
            measured = [prepared.measured[a : b + 1 : every] for a, b in windows]
            errors = np.stack(
                [
                    np.concatenate([m - y[::every] for m, y in zip(measured, run, strict=True)])
                    / scale
                    for run in predict_many(piece, machines, windows)
                ]
            )
            if prepared.recording.file in self.free_scale:
                whole = predict_readings(
                    prepared.replay, machines, prepared.channels, prepared.where
                )
                whole = whole[:, ::every]
                share = np.sqrt(FREE_RUN * errors.shape[1] / whole.shape[1])
                free = prepared.measured[None, ::every] - whole
                free = free / self.free_scale[prepared.recording.file]
                errors = np.concatenate([errors, share * free], axis=1)
            found.append(errors)
        return found

    def weigh_free_runs(self, hypothesis: Hypothesis, x: NDArray) -> None:
        """Let free runs count with the windows: together `FREE_RUN` of what these leave."""
        errors = {e[0]: e[1] for e in self._rms(hypothesis, x)}
        for prepared in self.fitted:
            machine = self.trial_machine(prepared, hypothesis, x)
            whole = predict_readings(prepared.replay, [machine], prepared.channels, prepared.where)[
                0
            ]
            free = np.sqrt(np.mean((prepared.measured - whole) ** 2, axis=0))
            windows = errors[prepared.recording.file]
            scale = np.array([self.scale[name] for name in prepared.channels])
            if np.all(np.isfinite(free) & (free > 0.0) & (windows > 0.0)):
                self.free_scale[prepared.recording.file] = scale * free / windows

    def _rms(self, hypothesis: Hypothesis, x: NDArray):
        for prepared in self.fitted:
            piece = self.cuts[prepared.recording.file]
            runs = predict_windows(
                piece, self.trial_machine(prepared, hypothesis, x), piece.overlapping
            )
            pairs = zip(runs, piece.overlapping, strict=True)
            left = np.concatenate([y - prepared.measured[a : b + 1] for y, (a, b) in pairs])
            yield prepared.recording.file, np.sqrt(np.mean(left**2, axis=0))

    @property
    def tempering(self) -> float:
        """Independent errors over rows."""
        rows = sum(
            int(np.sum(np.diff(c.overlapping, axis=1)[self.used[f], 0])) // c.decimation
            for f, c in self.cuts.items()
        )
        windows = sum(float(u.mean()) * len(self.cuts[f].windows) for f, u in self.used.items())
        return EFFECTIVE * windows / max(rows, 1)


def window_errors(
    problem: Problem, hypothesis: Hypothesis, x: NDArray, cuts: Sequence[Cut]
) -> tuple[WindowError, ...]:
    """Errors of a fitted hypothesis over the windows of recordings."""
    found = []
    for piece in cuts:
        runs = predict_windows(piece, problem.trial_machine(piece.prepared, hypothesis, x))
        found += _errors(piece, runs)
    return tuple(found)


def _errors(piece: Cut, runs: Sequence[NDArray]) -> list[WindowError]:
    prepared, found = piece.prepared, []
    for j, name in enumerate(prepared.channels):
        squares = [
            (y[:, j] - prepared.measured[a : b + 1, j]) ** 2
            for y, (a, b) in zip(runs, piece.windows, strict=True)
        ]
        found.append(
            WindowError(
                file=prepared.recording.file,
                role=prepared.recording.role,
                signal=name,
                windows=len(squares),
                rmse=float(np.sqrt(np.mean(np.concatenate(squares)))),
                by_window=np.sqrt([s.mean() for s in squares]),
                spread=float(np.std(prepared.measured[:, j])),
            )
        )
    return found


def windowed(problem: Problem, window_s: float = WINDOW_s) -> WindowedProblem:
    """The identification recordings of a problem in windows, scaled by what parameters leave.

    Raises
    ------
    RecordingError
        If no recording is long enough.
    """
    cuts, refusal = [], ""
    for prepared in problem.fitted:
        try:
            cuts.append(cut(problem, prepared, window_s))
        except RecordingError as refused:
            refusal = str(refused)
    if not cuts:
        raise RecordingError(refusal or "nothing to cut into windows")
    plain = Hypothesis()
    errors = window_errors(problem, plain, problem.start(plain), cuts)
    scale: dict[str, float] = {}
    for e in errors:
        size = e.rmse if np.isfinite(e.rmse) else e.spread
        scale[e.signal] = max(scale.get(e.signal, 0.0), size, 1e-12)
    return WindowedProblem(problem, cuts, scale)


def fit_windows(
    problem: WindowedProblem,
    hypothesis: Hypothesis,
    x: NDArray,
    *,
    with_free_run: bool = False,
) -> Fit:
    """Fit a hypothesis to the used windows; its errors' scale follows what each round leaves."""
    fitter = Fitter(problem, far=FAR)
    fit = None
    problem.free_scale = {}
    for round_ in range(ROUNDS):
        if with_free_run and round_ > 0:
            problem.weigh_free_runs(hypothesis, x)
            fit = None
        msni = fitter.evaluate(hypothesis, x[None])[1][0] if fit is None else fit.msni
        left = float(np.median(msni))
        if not np.isfinite(left) or left <= 0.0:
            break
        tempering = problem.tempering / left
        fit = fitter.fit(hypothesis, x, iterations=ITERATIONS, tempering=tempering)
        x = fit.x
    return fitter.fit(hypothesis, x, iterations=1) if fit is None else fit


def cross_validate(
    problem: WindowedProblem, hypothesis: Hypothesis, x: NDArray, *, folds: int = FOLDS
) -> CrossValidated:
    """Error of each window as predicted by a fit to windows of other folds.

    Parameters
    ----------
    x : (n,) array
        Where the fits begin: unknowns of the hypothesis.

    Raises
    ------
    RecordingError
        If there are fewer windows than folds.
    """
    every = {file: np.arange(len(c.windows)) for file, c in problem.cuts.items()}
    if max(len(index) for index in every.values()) < 2:
        raise RecordingError("cross-validation needs at least two windows in a recording")
    folds = min(folds, max(len(index) for index in every.values()))
    predicted: dict[str, list] = {f: [None] * len(i) for f, i in every.items()}
    fits = []
    try:
        for fold in range(folds):
            problem.used = {
                f: without_overlap(c.overlapping, c.windows[every[f] % folds == fold])
                for f, c in problem.cuts.items()
            }
            kept = [b for b in problem.fitted if problem.used[b.recording.file].any()]
            inside, problem.fitted = problem.fitted, kept
            try:
                fit = fit_windows(problem, hypothesis, x)
            finally:
                problem.fitted = inside
            fits.append(fit)
            for file, piece in problem.cuts.items():
                out = np.flatnonzero(every[file] % folds == fold)
                if out.size:
                    machine = problem.trial_machine(piece.prepared, hypothesis, fit.x)
                    runs = predict_windows(piece, machine, piece.windows[out])
                    for w, run in zip(out, runs, strict=True):
                        predicted[file][w] = run
    finally:
        problem.used = {f: np.ones(len(c.overlapping), bool) for f, c in problem.cuts.items()}
    errors = [e for file, c in problem.cuts.items() for e in _errors(c, predicted[file])]
    first = next(iter(problem.cuts.values()))
    row_s = first.prepared.recording.sample_time_s
    return CrossValidated(
        window_s=float((first.windows[0, 1] - first.windows[0, 0]) * row_s),
        folds=folds, errors=tuple(errors), fits=tuple(fits),
    )  # fmt: skip


def without_overlap(windows: NDArray, held_out: NDArray) -> NDArray:
    """Which windows share no time with held-out ones."""
    before = windows[:, 1, None] <= held_out[None, :, 0]
    after = windows[:, 0, None] >= held_out[None, :, 1]
    return np.all(before | after, axis=1)
