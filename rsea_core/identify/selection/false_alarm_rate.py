"""How much an effect seems to bring where there is none: the pipeline on replays of the null.

The fitted parameters-only machine is replayed through the same readings with the noise that the
whitener's model stands for - quantised and noisy sensors, the start within a count, the bridge's
wandering zero and gain - and searched by the same parameter fit, screening and law fits as the
recordings were. The largest score that any law gains there is what chance gives, the size of the
library included; its upper quantile by a Gumbel distribution is the threshold for the recordings
(parametric bootstrap of the maximum: Efron & Tibshirani, An Introduction to the Bootstrap (1993)
ch. 16; Gumbel, Statistics of Extremes (1958)).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording, Problem
from rsea_core.identify.selection.criteria import FALSE_ALARMS
from rsea_core.identify.smoothing.whitening import Whitener

REPLAYS = 4
EULER = 0.5772156649


def bootstrap_recordings(
    problem: Problem, fit: Fit, rng: np.random.Generator
) -> list[PreparedRecording]:
    """The fitted recordings as if the fit were the truth, with noise drawn anew."""
    plain = Hypothesis()
    found = []
    for prepared in problem.fitted:
        expected = problem.predict(prepared, plain, fit.x[None])[0]
        noise = np.repeat(coloured(prepared.whitener, rng), prepared.whitener.block, axis=0)
        rows = len(noise)
        measured = prepared.measured.copy()
        measured[:rows] = expected[:rows] + noise
        found.append(replace(prepared, measured=measured))
    return found


def coloured(whitener: Whitener, rng: np.random.Generator) -> NDArray:
    """Residuals (blocks, channels) whose innovations are white with unit variance."""
    white = rng.standard_normal((whitener.blocks, len(whitener.channels)))
    out = np.empty_like(white)
    _colour(white, whitener.filter, out)
    return out


@njit(cache=True, error_model="numpy")
def _colour(white, errors, out):
    """The filter of `whitening` run the other way round."""
    A, modes, drive, C, gain, root, begins = errors
    n = white.shape[0]
    d = A.shape[1]
    x = np.zeros(d)
    for t in range(n):
        if begins[t]:
            x[:] = 0.0
        e = np.linalg.solve(root[t], white[t])
        out[t] = C @ x + e
        z = x + gain[t] @ e
        a = A[modes[t]].copy()
        a[:-1, -1] *= drive[t]
        x = a @ z


def false_alarm_threshold(gains: Sequence[float]) -> float:
    """The gain that chance exceeds once in `1 / FALSE_ALARMS`, by a Gumbel fit of the moments."""
    values = np.asarray(gains, dtype=float)
    scale = float(np.std(values, ddof=1)) * np.sqrt(6.0) / np.pi if values.size > 1 else 0.0
    scale = max(scale, 1.0)
    mode = float(np.mean(values)) - EULER * scale
    return mode - scale * float(np.log(-np.log(1.0 - FALSE_ALARMS)))


def bootstrap_gains(
    problem: Problem,
    fit: Fit,
    search_gain: Callable[[Problem, int], float],
    *,
    replays: int = REPLAYS,
    seed: int = 0,
) -> list[float]:
    """Largest gains of a search on replays of the null.

    Parameters
    ----------
    search_gain : function of (problem, replay number)
        The gain of the best law over parameters alone on a problem.
    """
    rng = np.random.default_rng(seed)
    gains = []
    for number in range(replays):
        gains.append(
            search_gain(problem.with_fitted(bootstrap_recordings(problem, fit, rng)), number)
        )
    return gains
