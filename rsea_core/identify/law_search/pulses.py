"""Where in time an external torque on the load could have acted: a matched filter over intervals.

The innovations are projected on short torques side by side, all free values taken out; sums over
any interval follow from cumulative sums, so that every start and end is judged (generalised
likelihood ratio over onset and duration: Basseville & Nikiforov, Detection of Abrupt Changes,
1993, section 7.2). A torque that acts once says nothing elsewhere: it is judged against how much
the other stretches of the same recording scatter (`pulse_ratio`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.effects.load_disturbance import LONGEST, disturbance
from rsea_core.identify.fitting.problem import machine_of
from rsea_core.identify.law_search.screening import Candidate, Projection
from rsea_core.identify.law_search.shape_search import responses
from rsea_core.identify.multistep.criteria import PULSE_GAIN
from rsea_core.identify.multistep.estimator import Estimate, Estimator, stretches_of
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import Track

CELL, BEGIN = 0.5, 2.0  # time scales of the motion: width, and earliest onset
MOST_CELLS = 100  # of a recording
LONGEST_SCALE = 0.05  # of a recording: with steady rotation the time scale grows with the angle
STEP = 0.05  # of the width: scale of a fit's onset


def pulses(projection: Projection) -> list[Candidate]:
    """The most likely torque on the load in each recording whose load can move, best first.

    Its `deviation` is the best gain of such a torque in any other recording, or elsewhere in the
    only one.
    """
    found, elsewhere = [], []
    for number, t in enumerate(projection.estimator.tracks):
        plant = machine_of(t.experiment.base)
        if plant.structure in (mp.ELASTIC_FREE, mp.RIGID_FREE):
            candidate = _best_pulse(projection, number, t)
            if candidate is not None:
                elsewhere.append(candidate.gain)
            if candidate is not None and candidate.gain > PULSE_GAIN:
                found.append(candidate)
    return [
        replace(c, deviation=max([g for g in elsewhere if g != c.gain], default=c.deviation))
        for c in sorted(found, key=lambda c: -c.gain)
    ]


def _best_pulse(projection: Projection, number: int, t: Track) -> Candidate | None:
    r = t.experiment.recording
    length = float(r.time_s[-1] - r.time_s[0])
    time_s = min(t.scale.time_s, LONGEST_SCALE * length)
    cells = int(np.clip(length / (CELL * time_s), 4, MOST_CELLS))
    width = length / cells
    at = np.minimum(((r.time_s - r.time_s[0]) / width).astype(int), cells - 1)
    torque = float(t.scale.torque_Nm[1])
    changes = [np.zeros((cells, *e.shape)) for e in projection.level]
    changes[number] = responses(t, "L", torque * (at == np.arange(cells)[:, None]))
    columns = projection.columns(changes)
    if not np.all(np.isfinite(columns)):
        return None
    B = np.linalg.solve(projection.L, projection.J @ columns.T)
    G = columns @ columns.T - B.T @ B
    h = columns @ projection.left
    begin = min(int(np.ceil(BEGIN * time_s / width)), cells - 2)
    first, last, size, gain = _best_interval(G, h, begin)
    if gain <= 0.0:
        return None
    around = [(slice(begin, 2 * first - last), 0), (slice(2 * last - first, cells), 0)]
    others = [_best_interval(G[at, at], h[at], b)[3] for at, b in around if at.stop - at.start > 1]
    start = (float(r.time_s[0] + first * width), (last - first) * width, size * torque)
    law = disturbance(
        r.file, t.experiment.where.index, start, torque, float(r.time_s[-1]),
        step_s=STEP * width * (last - first),
    )  # fmt: skip
    return Candidate(
        law=law, start=law.starts[0], gain=gain, held_out=gain, size=1.0,
        deviation=max(others, default=0.0),
    )  # fmt: skip


def _best_interval(G: NDArray, h: NDArray, begin: int) -> tuple[int, int, float, float]:
    """First and one past the last cell, size and gain of the best constant torque.

    From cell `begin` on: what a start's error leaves is no torque.
    """
    cells = len(h)
    H = np.concatenate(([0.0], np.cumsum(h)))
    S = np.zeros((cells + 1, cells + 1))
    S[1:, 1:] = G.cumsum(0).cumsum(1)
    best = (begin, begin + 1, 0.0, 0.0)
    for a in range(begin, cells):
        b = np.arange(a + 1, min(cells, a + max(int(LONGEST * cells), 1)) + 1)
        energy = S[b, b] - S[a, b] - S[b, a] + S[a, a]
        inner = H[b] - H[a]
        gain = np.divide(0.5 * inner**2, energy, out=np.zeros_like(inner), where=energy > 1e-9)
        most = int(np.argmax(gain))
        if gain[most] > best[3]:
            best = (a, int(b[most]), float(inner[most] / energy[most]), float(gain[most]))
    return best


def pulse_ratio(own: Estimator, base: Estimate, fit: Estimate) -> float:
    """Gain of a torque that acts once, over the scatter of the other stretches' power.

    A machine that is not quite the model's has such stretches everywhere: then one more is no
    event.
    """
    plain = own.fit(base.hypothesis, base.x, iterations=5)
    before = own.innovations([(base.hypothesis, plain.x)])
    after = own.innovations([(fit.hypothesis, fit.x)])
    falls, powers = _of_stretches(own, before, after)
    gain = float(falls.sum())
    hit = falls > 0.02 * max(gain, 1e-9)
    left = powers[~hit] if np.count_nonzero(~hit) > 4 else powers
    scatter = 1.4826 * float(np.median(np.abs(left - np.median(left))))
    return gain / max(scatter * np.sqrt(np.count_nonzero(hit) or 1), 1e-9)


def _of_stretches(
    own: Estimator, before: Sequence[NDArray], after: Sequence[NDArray]
) -> tuple[NDArray, NDArray]:
    """Falls of the cost, and costs after, of the stretches of all recordings."""
    falls, powers = [], []
    for block, e, f in zip(stretches_of(own.tracks), before, after, strict=True):
        had = 0.5 * own.tempering * huber_squares(e[0]).sum(axis=1)
        left = 0.5 * own.tempering * huber_squares(f[0]).sum(axis=1)
        falls.append(np.bincount(block, had - left))
        powers.append(np.bincount(block, left))
    return np.concatenate(falls), np.concatenate(powers)
