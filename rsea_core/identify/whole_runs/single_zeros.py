"""Readings whose zero differs in one recording (docs/diagnosis.md 10.4).

The zero of a sensor can change when its amplifier is restarted or the sensor is mounted again. No
law of the machine explains that: an offset acts in every recording, and a drift grows. The zero of
such a reading is a state of the error model in that recording.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import settled
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.criteria import LEAST_EXCESS, ZERO_ELSEWHERE, ZERO_SHARE
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import smooth
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import Track, prepared

Zero = tuple[int, int]
"""Track and reading."""


def with_single_zeros(found: Found, own: Estimator, fit: Estimate, say) -> Found:
    """Parameters alone fitted anew with the zeros that single recordings have; else the same.

    Parameters
    ----------
    own : Estimator
        Of whole recordings in the sensors' noise.
    fit : Estimate
        What shows the zeros, with laws or without.
    """
    zeros = single_zeros(own, fit)
    if not zeros:
        return found
    tracks = list(found.base_estimator.tracks)
    for at, j in zeros:
        e = tracks[at].experiment
        say(f"the zero of {e.channels[j]} differs in {e.recording.file} alone")
        tracks[at] = prepared(tracks[at], zeros=(*tracks[at].zeros, j))
    estimator = found.base_estimator.having(tracks)
    h, x = found.base.hypothesis, found.base.x
    smooth(estimator, h, x)
    estimator = estimator.having([prepared(t) for t in estimator.tracks])
    estimator, base = settled(estimator, estimator.fit(h, x))
    return replace(
        found.without_laws(), base_estimator=estimator, estimator=estimator, base=base, best=base
    )


def single_zeros(own: Estimator, fit: Estimate) -> list[Zero]:
    """Zeros that explain most of what a fit leaves of a reading in one recording and no other.

    A reading has at most one such zero: one that differs in several recordings may be a law's.
    """
    residuals = own.residuals([(fit.hypothesis, fit.x)])
    known = {t.experiment.channels[j] for t in own.tracks for j in t.zeros}
    falls: dict[str, list[tuple[float, Zero]]] = {}
    for at, (t, residual) in enumerate(zip(own.tracks, residuals, strict=True)):
        for j, name in enumerate(t.experiment.channels):
            if name not in known and not name.endswith("angle_rad"):  # angles have them anyway
                falls.setdefault(name, []).append((_fall(t, residual, j), (at, j)))
    found = []
    for each in falls.values():
        (largest, zero), *others = sorted(each, reverse=True)
        rest = max((fall for fall, _ in others), default=np.inf)
        if largest > LEAST_EXCESS and rest < ZERO_ELSEWHERE * largest:
            found.append(zero)
    return found


def _fall(t: Track, residual: NDArray, j: int) -> float:
    """Fall of a recording's cost if a reading has its own zero.

    0 where this explains less than `ZERO_SHARE` of that reading's cost above that of noise.
    """
    free = prepared(t, zeros=(*t.zeros, j))
    before, after = (huber_squares(each.innovations(residual)[0]) for each in (t, free))
    above, left = (float(np.sum(power[:, j] - 1.0)) for power in (before, after))
    if not left < (1.0 - ZERO_SHARE) * above:
        return 0.0
    return 0.5 * (float(np.sum(before - after)) + t.log_det - free.log_det)


def zeros_of(estimator: Estimator, h: Hypothesis, x: NDArray) -> list[tuple[str, str, float]]:
    """Recording, column and size of each zero that one recording alone has, by a fit."""
    found = []
    for t, residual in zip(estimator.tracks, estimator.residuals([(h, x)]), strict=True):
        e = t.experiment
        sizes = np.median(residual[0], axis=0)
        found += [(e.recording.file, e.channels[j], float(sizes[j])) for j in t.zeros]
    return found
