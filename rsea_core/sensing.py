"""Readings: the truth as the sensors of a model show it, to a controller and in a recording."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.arrays import read_only
from rsea_core.terms import (
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    Term,
)

# numbers of a sensor
SCALE, OFFSET, RATE, DELAY = range(4)
READ_BY_CONTROLLERS = ("motor_angle_rad", "load_angle_rad", "current_A")
# columns of truth that a recording can have, with their own rate where it is known
TRUTH = {
    "motor_angle_rad": "motor_velocity_rad_per_s",
    "load_angle_rad": "load_velocity_rad_per_s",
    "spring_deflection_rad": None,
    "motor_velocity_rad_per_s": None,
    "load_velocity_rad_per_s": None,
    "current_A": None,
    "torque_Nm": None,
}


class Sensors(NamedTuple):
    """What stands between the truth and a controller; empty arrays where nothing does."""

    numbers: NDArray  # (3 or 0, 4) of READ_BY_CONTROLLERS
    noise: NDArray  # (n or 0, 3)


def controller_sensors(terms: Iterable[Term], rows: int) -> Sensors:
    """What a model's terms put between the truth and a controller."""
    terms = tuple(terms)
    columns = {getattr(term, "column", None) for term in terms}
    if not columns & set(READ_BY_CONTROLLERS):
        return Sensors(np.zeros((0, 4)), np.zeros((0, 3)))
    pairs = [_sensor(terms, column, rows) for column in READ_BY_CONTROLLERS]
    noise = np.ascontiguousarray(np.array([noise for _, noise in pairs]).T)
    return Sensors(np.array([numbers for numbers, _ in pairs]), noise)


def readings(trajectory) -> dict[str, NDArray]:
    """What the machine's sensors show of a `Trajectory`, by a recording's columns.

    Encoders count whole counts of what their sensor terms leave of the angle; the rig's noise
    is not added (`SensorNoise` is).

    Returns
    -------
    dict of (n,) arrays
        `temperature_C` (of the case) where the model has a `DriveThermal`.
    """
    terms, time = trajectory.model.terms, trajectory.time_s
    rig = trajectory.model.rig
    counts = {
        "motor_angle_rad": rig.motor_encoder_counts_per_rev,
        "load_angle_rad": rig.load_encoder_counts_per_rev,
    }
    found = {}
    for column, rate in TRUTH.items():
        values = getattr(trajectory, column)
        known = rate is not None
        rates = getattr(trajectory, rate) if known else np.zeros(time.size)
        found[column] = _reading(terms, column, time, values, rates, known)
        if counts.get(column):
            count = 2.0 * np.pi / counts[column]
            found[column] = np.floor(found[column] / count) * count
    if trajectory.case_temperature_C is not None:
        values = trajectory.case_temperature_C
        found["temperature_C"] = _reading(
            terms, "temperature_C", time, values, np.zeros(time.size), False
        )
    return {name: read_only(values) for name, values in found.items()}


def _reading(terms, column, time, values, rates, known) -> NDArray:
    numbers, noise = _sensor(terms, column, time.size)
    return (
        np.array([sensed(time, values, rates, known, k, numbers) for k in range(time.size)]) + noise
    )


def _sensor(terms: Iterable[Term], column: str, rows: int) -> tuple[NDArray, NDArray]:
    numbers, noise = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(rows)
    for term in terms:
        if getattr(term, "column", None) != column:
            continue
        if isinstance(term, SensorScale):
            numbers[SCALE] = term.scale
        elif isinstance(term, SensorOffset):
            numbers[OFFSET] = term.offset
        elif isinstance(term, SensorDrift):
            numbers[RATE] = term.rate_per_s
        elif isinstance(term, SensorDelay):
            numbers[DELAY] = term.delay_s
        elif isinstance(term, SensorNoise):
            rng = np.random.default_rng(int(term.seed))
            noise = term.standard_deviation * rng.standard_normal(rows)
    return numbers, noise


@njit(error_model="numpy")
def sensed(time, values, rates, known, row, numbers):
    """What a sensor without noise shows at a row, of the truth until then.

    Between rows the truth is the cubic of its values and rates where those are known, else
    straight.
    """
    wanted = time[row] - numbers[DELAY]
    value = values[row]
    if wanted <= time[0]:
        value = values[0]
    elif numbers[DELAY] > 0.0:
        j = np.searchsorted(time[: row + 1], wanted) - 1
        h = time[j + 1] - time[j]
        s, rise = (wanted - time[j]) / h, values[j + 1] - values[j]
        value = values[j] + s * rise
        if known:
            before, after = h * rates[j] - rise, h * rates[j + 1] - rise
            value += s * (1.0 - s) * ((1.0 - s) * before - s * after)
    return numbers[SCALE] * value + numbers[OFFSET] + numbers[RATE] * (time[row] - time[0])
