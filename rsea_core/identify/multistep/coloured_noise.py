"""Readings whose noise is coloured, where that is likelier than white noise.

A sensor's filter, vibration or interference leaves errors that last for some rows. Taken for white,
they pass for an unknown torque, and beside a large unknown torque no law stands out. The noise of
each reading has a white part and an autoregression of first order (Ljung, System Identification,
2nd ed. 1999, section 4.2); its time constant is chosen before the search.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.criteria import COLOUR_GAIN, COLOUR_ROWS, COLOUR_SHARE
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER
from rsea_core.identify.multistep.noise_estimate import estimated_noise
from rsea_core.identify.multistep.tracks import Track, prepared

SHORTER = 3.0  # log-likelihood by which a later trial must be better: short time constants first
SMALLER = 0.1  # unknown inputs beside which coloured noise is looked for too


def with_coloured_readings(estimator: Estimator, h: Hypothesis, x: NDArray, say) -> Estimator:
    """The estimator with the colour of the readings' noise that makes them likeliest.

    None is looked for where a gear's mesh stands for a spring: errors of the missing backlash are
    coloured too.
    """
    if any(law.effect == MESH_DAMPER for law in h.laws):
        return estimator
    residuals = [r[0] for r in estimator.residuals([(h, x)])]
    if not all(np.all(np.isfinite(r)) for r in residuals):
        return estimator
    best, least = estimator, _log_posterior(estimator, h, x) + COLOUR_GAIN
    for rows in COLOUR_ROWS:
        time = rows * max(t.experiment.recording.sample_time_s for t in estimator.tracks)
        if not all(_tells(t, time) for t in estimator.tracks):
            continue
        for share in (1.0, SMALLER):
            own = estimator.having(
                estimated_noise([_coloured(t, time, share) for t in estimator.tracks], residuals)
            )
            log_posterior = _log_posterior(own, h, x)
            if log_posterior > least + (0.0 if best is estimator else SHORTER):
                best, least = own, log_posterior
    if best is not estimator:
        gain = least - _log_posterior(estimator, h, x)
        time = best.tracks[0].noise.colour_time_s
        say(f"coloured readings, time constant {time:.3g} s: {gain:.1f} units likelier")
    return best


def _tells(t: Track, time_s: float) -> bool:
    """Whether averaged rows resolve this time constant, and it is short against the motion's."""
    row = t.block * t.experiment.recording.sample_time_s
    return row < time_s < COLOUR_SHARE * t.scale.time_s


def _coloured(t: Track, time_s: float, share: float) -> Track:
    inputs = share * t.noise.inputs
    noise = replace(t.noise, inputs=inputs, colours=t.noise.readings.copy(), colour_time_s=time_s)
    return prepared(t, noise=noise)


def _log_posterior(estimator: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Log-likelihood of all rows, not tempered, and of the prior."""
    plain = Estimator(estimator.problem, estimator.tracks, cache=estimator.cache)
    return -float(plain.costs([(h, x)])[0])
