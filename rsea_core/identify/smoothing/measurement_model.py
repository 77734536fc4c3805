"""The readings of a recording as the smoother takes them: value, variance and unknown bias."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.quantities as q
from rsea_core.identify.smoothing.encoder_quantisation import UNIFORM, count_of, noise_of, sharpened
from rsea_core.identify.smoothing.separability import SENSED
from rsea_core.machine.rig import Rig

COUNTS = {
    "motor_angle_rad": "motor_encoder_counts_per_rev",
    "load_angle_rad": "load_encoder_counts_per_rev",
}
NOISES = {"torque_Nm": "torque_sensor_noise_Nm", "current_A": "current_sensor_noise_A"}


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One column of readings.

    Attributes
    ----------
    name : str
    value, variance : (n,) arrays
        Infinite variance: the row is not used.
    floor : float
        Standard deviation of one reading of a moving machine.
    bias : float
        Standard deviation of an error that stays the same over the recording: an encoder's
        phase within a count; zero for a channel that has no counts.
    """

    name: str
    value: NDArray
    variance: NDArray
    floor: float
    bias: float


def channels_of(
    rig: Rig, columns: Mapping[str, NDArray], ignore: tuple[str, ...] = ()
) -> dict[str, Channel]:
    """Every column that reads a signal of the machine, with what its sensor is worth.

    A count or noise that the rig does not state is taken from the readings themselves.
    """
    found = {}
    for name in SENSED:
        if name in columns and name not in ignore:
            found[name] = _channel(rig, name, np.asarray(columns[name], dtype=float))
    return found


def _channel(rig: Rig, name: str, values: NDArray) -> Channel:
    counts = getattr(rig, COUNTS[name]) if name in COUNTS else None
    noise = getattr(rig, NOISES[name]) if name in NOISES else None
    count = q.count_angle_rad(counts) if counts is not None else None
    if count is None and noise is None:
        count = count_of(values)
    if count is not None and noise is None:
        value, variance = sharpened(values, count)
        floor = count * np.sqrt(UNIFORM)
        return Channel(name=name, value=value, variance=variance, floor=floor, bias=floor)
    span = max(float(np.ptp(values)), float(np.abs(values).max()), 1e-12)
    floor = max(noise if noise is not None else noise_of(values), 1e-7 * span)
    variance = np.full(values.size, floor**2)
    return Channel(name=name, value=values, variance=variance, floor=floor, bias=0.0)
