"""Noise of the greatest likelihood: sizes of unknown inputs and of the readings' noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import machine_of
from rsea_core.identify.multistep.criteria import MOST_COLOUR
from rsea_core.identify.multistep.error_filter import Noise, free_inputs, with_density
from rsea_core.identify.multistep.kalman_filter import (
    Filter,
    filter_gains,
    huber_squares,
    innovations,
)
from rsea_core.identify.multistep.tracks import Track, prepared, start_variances
from rsea_core.numeric.threads import share_out

MOST_SLOW = 0.1  # of the rated torque: more is no drift, and dry friction would pass for it
SLOW_INPUT = 3  # of the unknown inputs
NOISE_STEPS = (3.0, 1.8, 1.3)
QUIETER = (1.0, 0.1, 0.01)  # unknown torques of the second search's starts, over the first's
NOISE_BLOCKS, NOISE_LEAST = 2500, 250  # averaged rows that noise is estimated from


def estimated_noise(
    tracks: Sequence[Track], residuals: Sequence[NDArray], *, steps: Sequence[float] = NOISE_STEPS
) -> list[Track]:
    """The tracks with the noise of the greatest likelihood; densities are relative and common.

    One coordinate after the other, in steps that become finer: the likelihood is smooth and a
    factor of 1.3 in a density changes nothing that is decided with it. A part of each recording
    is enough for so few numbers. A second search begins with the readings' noise at the size of the
    fastest changes: the first does not leave a local maximum in which an unknown torque drives
    every row.
    """
    total = sum(t.blocks for t in tracks)
    parts = [
        _block(t, r, max(int(NOISE_BLOCKS * t.blocks / total), NOISE_LEAST))
        for t, r in zip(tracks, residuals, strict=True)
    ]
    free = {
        j
        for t in tracks
        for j, _ in free_inputs(machine_of(t.experiment.base), t.experiment.channels)
    }
    keys: list[tuple] = [("input", j) for j in sorted(free)]
    read = sorted({c for t in tracks for c in t.experiment.channels})
    keys += [("reading", c) for c in read]
    if tracks[0].noise.colours.size:
        keys += [("colour", c) for c in read]
    noises = [t.noise for t in tracks]
    values = _log_likelihoods(parts, noises)
    results = [_descended(parts, tracks, keys, steps, values, noises)]
    starts = [[_of_fast_changes(p, share) for p in parts] for share in QUIETER]
    likely = [_log_likelihoods(parts, trial) for trial in starts]
    best = max(range(len(starts)), key=lambda j: sum(likely[j]))
    if sum(likely[best]) > sum(values):
        results.append(_descended(parts, tracks, keys, steps, likely[best], starts[best]))
    _, noises = max(results, key=lambda result: result[0])
    return [prepared(t, noise=n) for t, n in zip(tracks, noises, strict=True)]


@dataclass(frozen=True, kw_only=True)
class _Block:
    """Averaged rows of one recording in a row, and what they leave."""

    track: Track
    rows: slice
    residual: NDArray

    def log_likelihood(self, noise: Noise) -> float:
        """Log-likelihood under a noise, robust."""
        t, rows = self.track, self.rows
        errors = with_density(t.errors, noise)
        begins, mode = t.begins[rows].copy(), errors.mode[rows]
        start = start_variances(t, errors)
        count = int(np.sum(t.begins[: rows.start + 1]))
        last = int(np.sum(t.begins[: rows.stop]))
        start = start[max(count - 1, 0) : last]
        if not begins[0]:
            begins[0] = True
            start = start.copy()
            start[0] *= 100.0
        gain, root = filter_gains(
            errors.A, errors.Q, mode, errors.C, noise.readings**2, start, begins
        )
        out = innovations(Filter(errors.A, mode, errors.C, gain, root, begins), self.residual[None])
        determinant = float(np.sum(np.log(np.diagonal(root, axis1=1, axis2=2))))
        return -0.5 * float(np.sum(huber_squares(out))) + determinant


def _descended(
    parts: Sequence[_Block], tracks: Sequence[Track], keys: Sequence[tuple],
    steps: Sequence[float], values: list[float], noises: list[Noise],
) -> tuple[float, list[Noise]]:  # fmt: skip
    """Log-likelihood and noises after a coordinate search from given noises."""
    for factor in steps:
        for key in keys:
            for up in (factor, 1.0 / factor):
                moved = False
                for _ in range(12):
                    trial = [_scaled(t, n, key, up) for t, n in zip(tracks, noises, strict=True)]
                    found = _log_likelihoods(parts, trial)
                    if not sum(found) > sum(values) + 0.1:
                        break
                    values, noises, moved = found, trial, True
                if moved:
                    break
    return sum(values), noises


def _log_likelihoods(parts: Sequence[_Block], noises: Sequence[Noise]) -> list[float]:
    """Log-likelihood of each part under its noise, on threads."""
    found = [0.0] * len(parts)

    def run(begin: int, end: int) -> None:
        for j in range(begin, end):
            found[j] = parts[j].log_likelihood(noises[j])

    share_out(run, len(parts))
    return found


def _block(track: Track, residual: NDArray, length: int) -> _Block:
    first = max((track.blocks - length) // 2, 0)
    rows = slice(first, min(first + length, track.blocks))
    left = np.ascontiguousarray(track.averaged(residual)[rows])
    return _Block(track=track, rows=rows, residual=left)


def _of_fast_changes(part: _Block, share: float) -> Noise:
    """Noise of readings by third differences of the residual, and a share of unknown torques.

    Third differences of white noise have 20 times its variance; those of a smooth motion are small.
    """
    noise = part.track.noise
    left = np.diff(part.residual, n=3, axis=0)
    size = np.median(np.abs(left), axis=0) / (0.6745 * 20.0**0.5) if len(left) else 0.0
    inputs = np.concatenate([share * noise.inputs[:SLOW_INPUT], noise.inputs[SLOW_INPUT:]])
    return replace(noise, inputs=inputs, readings=np.maximum(noise.readings, size))


def _scaled(track: Track, noise: Noise, key: tuple, factor: float) -> Noise:
    kind, at = key
    if kind == "input":
        inputs = noise.inputs.copy()
        inputs[at] *= factor
        if at == SLOW_INPUT:
            inputs[at] = min(inputs[at], MOST_SLOW * track.scale.torque_Nm[0])
        return replace(noise, inputs=inputs)
    if at not in track.experiment.channels:
        return noise
    j = track.experiment.channels.index(at)
    if kind == "colour":
        colours = noise.colours.copy()
        most = MOST_COLOUR * noise.readings[j] * track.block**0.5
        colours[j] = min(colours[j] * factor, most)
        return replace(noise, colours=colours)
    readings = noise.readings.copy()
    least = 0.5 * track.experiment.floor_of_each[j] / track.block**0.5
    readings[j] = max(readings[j] * factor, least)
    return replace(noise, readings=readings)
