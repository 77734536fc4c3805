"""Readings whose zero differs in one recording (docs/diagnosis-search.md 10.4).

The zero of a sensor can change when its amplifier is restarted or the sensor is mounted again. No
law of the machine explains that: an offset acts in every recording, and a drift grows. The zero of
such a reading is a state of the error model in that recording.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.sensor_base import FITTED
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import settled
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.criteria import LEAST_EXCESS, ZERO_ELSEWHERE, ZERO_SHARE
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import smooth
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import Track, prepared
from rsea_core.identify.whole_runs.sensor_noise import excess, in_sensor_noise

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
    if not zeros and fit.hypothesis == found.base.hypothesis:
        # smoothed beside a wrong zero, the motion has taken up most of it
        zeros = single_zeros(own, fit, share=0.0)
        if not (zeros and _explain(found, own, fit, zeros)):
            return found
    for at, j in zeros:
        e = own.tracks[at].experiment
        say(f"the zero of {e.channels[j]} differs in {e.recording.file} alone")
    return _begun_anew(found, zeros) if zeros else found


def _explain(found: Found, own: Estimator, plain: Estimate, zeros: Sequence[Zero]) -> bool:
    """Whether zeros, smoothed anew, explain `ZERO_SHARE` of what parameters alone leave."""
    other = _begun_anew(found, zeros)
    anew = in_sensor_noise(other.base_estimator, other.base)
    fit = anew.fit(other.base.hypothesis, other.base.x, iterations=12)
    left = excess(anew, fit.hypothesis, fit.x)
    return left < (1.0 - ZERO_SHARE) * excess(own, plain.hypothesis, plain.x)


def _begun_anew(found: Found, zeros: Sequence[Zero]) -> Found:
    """Parameters alone, smoothed and fitted with zeros of single recordings."""
    tracks = list(found.base_estimator.tracks)
    for at, j in zeros:
        tracks[at] = prepared(tracks[at], zeros=(*tracks[at].zeros, j))
    estimator = found.base_estimator.having(tracks)
    h, x = found.base.hypothesis, found.base.x
    smooth(estimator, h, x)
    estimator = estimator.having([prepared(t) for t in estimator.tracks])
    estimator, base = settled(estimator, estimator.fit(h, x))
    return replace(
        found.without_laws(), base_estimator=estimator, estimator=estimator, base=base, best=base
    )


def single_zeros(own: Estimator, fit: Estimate, share: float = ZERO_SHARE) -> list[Zero]:
    """Zeros that explain a share of what a fit leaves of a reading in one recording and no other.

    A reading has at most one such zero: one that differs in several recordings may be a law's, and
    so may that of the only recording if its column has a law of an offset.
    """
    residuals = own.residuals([(fit.hypothesis, fit.x)])
    known = {t.experiment.channels[j] for t in own.tracks for j in t.zeros}
    falls: dict[str, list[tuple[float, Zero]]] = {}
    for at, (t, residual) in enumerate(zip(own.tracks, residuals, strict=True)):
        for j, name in enumerate(t.experiment.channels):
            if name not in known and not name.endswith("angle_rad"):  # angles have them anyway
                falls.setdefault(name, []).append((_fall(t, residual, j, share), (at, j)))
    found = []
    for name, each in falls.items():
        (largest, zero), *others = sorted(each, reverse=True)
        alone = np.inf if name in FITTED else 0.0
        rest = max((fall for fall, _ in others), default=alone)
        if largest > LEAST_EXCESS and rest < ZERO_ELSEWHERE * largest:
            found.append(zero)
    return found


def _fall(t: Track, residual: NDArray, j: int, share: float) -> float:
    """Fall of a recording's cost if a reading has its own zero.

    0 where this explains less than a share of that reading's cost above that of noise.
    """
    free = prepared(t, zeros=(*t.zeros, j))
    before, after = (huber_squares(each.innovations(residual)[0]) for each in (t, free))
    above, left = (float(np.sum(power[:, j] - 1.0)) for power in (before, after))
    if not left < (1.0 - share) * above:
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
