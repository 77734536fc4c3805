"""Readings: the truth as the sensors of a model show it, to a controller and in a recording."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.registry import (
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    SensorTable,
    Term,
)
from rsea_core.effects.sensor_table import OVER as STATES
from rsea_core.numeric.arrays import read_only

# numbers of a sensor; OVER: 0 without a table, else 1, 2, 3 for `terms.sensors.OVER`; NODES: the
# first of COUNT errors at FIRST, FIRST + STEP, ..., beyond which they go on straight if GROWS
SCALE, OFFSET, RATE, DELAY, OVER, FIRST, STEP, COUNT, GROWS, NODES = range(10)
VALUE, TURN, SPEED = range(1, 4)
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

    numbers: NDArray  # (3 or 0, NODES + the most of a table) of READ_BY_CONTROLLERS
    noise: NDArray  # (n or 0, 3)
    errors: NDArray  # (3 or 0, n) memory of the tables, filled row by row


NO_SENSORS = Sensors(np.zeros((0, NODES)), np.zeros((0, 3)), np.zeros((0, 0)))


def controller_sensors(terms: Iterable[Term], rows: int) -> Sensors:
    """What a model's terms put between the truth and a controller."""
    terms = tuple(terms)
    columns = {getattr(term, "column", None) for term in terms}
    if not columns & set(READ_BY_CONTROLLERS):
        return NO_SENSORS
    pairs = [_sensor(terms, column, rows) for column in READ_BY_CONTROLLERS]
    noise = np.ascontiguousarray(np.array([noise for _, noise in pairs]).T)
    numbers = np.zeros((len(pairs), max(own.size for own, _ in pairs)))
    for line, (own, _) in zip(numbers, pairs, strict=True):
        line[: own.size] = own
    return Sensors(numbers, noise, np.zeros((len(pairs), rows)))


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
        rates = None if rate is None else getattr(trajectory, rate)
        found[column] = reading(terms, column, time, getattr(trajectory, column), rates)
        if counts.get(column):
            count = 2.0 * np.pi / counts[column]
            found[column] = np.floor(found[column] / count) * count
    if trajectory.case_temperature_C is not None:
        values = trajectory.case_temperature_C
        found["temperature_C"] = reading(terms, "temperature_C", time, values)
    return {name: read_only(values) for name, values in found.items()}


def reading(
    terms: Iterable[Term],
    column: str,
    time_s: NDArray,
    values: NDArray,
    rates: NDArray | None = None,
) -> NDArray:
    """What the sensor terms of one column make of its truth (n,), without counts.

    Parameters
    ----------
    rates : (n,) array or None
        How fast the truth changes, where that is known: it is a cubic between rows then.
    """
    numbers, noise = _sensor(terms, column, time_s.size)
    known = rates is not None
    return sensed_rows(time_s, values, rates if known else values, known, numbers) + noise


def _sensor(terms: Iterable[Term], column: str, rows: int) -> tuple[NDArray, NDArray]:
    numbers, noise = np.zeros(NODES), np.zeros(rows)
    numbers[SCALE] = 1.0
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
        elif isinstance(term, SensorTable):
            numbers = np.concatenate([numbers[:NODES], term.errors])
            numbers[[OVER, COUNT]] = 1 + STATES.index(term.over), term.errors.size
            numbers[FIRST], numbers[STEP] = 0.0, 2.0 * np.pi / term.errors.size
            if term.over != "turn":
                span = term.last - term.first
                numbers[FIRST], numbers[STEP] = term.first, span / (term.errors.size - 1)
            numbers[GROWS] = term.over == "value" and not term.is_angle
    return numbers, noise


@njit(cache=True, error_model="numpy")
def sensed_rows(time, values, rates, known, numbers):
    """What a sensor without noise shows of a whole truth (n,)."""
    found, errors = np.empty(time.size), np.zeros(time.size)
    for row in range(time.size):
        found[row] = sensed(time, values, rates, known, row, numbers, errors, 1.0)
    return found


@njit(error_model="numpy")
def sensed(time, values, rates, known, row, numbers, errors, per):
    """What a sensor without noise shows at a row, of the truth until then, `per` times `values`.

    Between rows the truth is the cubic of its values and rates where those are known, else
    straight. `errors` (n,) keeps what its table says at the rows so far.
    """
    if numbers[OVER] != 0.0:
        errors[row] = _table_error(time, values, row, numbers, errors, per)
    wanted = time[row] - numbers[DELAY]
    value, error = per * values[row], 0.0
    if numbers[OVER] != 0.0:
        error = errors[row]
    if wanted <= time[0]:
        value = per * values[0]
        if numbers[OVER] != 0.0:
            error = errors[0]
    elif numbers[DELAY] > 0.0:
        j = np.searchsorted(time[: row + 1], wanted) - 1
        h = time[j + 1] - time[j]
        s, rise = (wanted - time[j]) / h, values[j + 1] - values[j]
        late = values[j] + s * rise
        if known:
            before, after = h * rates[j] - rise, h * rates[j + 1] - rise
            late += s * (1.0 - s) * ((1.0 - s) * before - s * after)
        value = per * late
        if numbers[OVER] != 0.0:
            error = errors[j] + s * (errors[j + 1] - errors[j])
    read = numbers[SCALE] * value + error
    return read + numbers[OFFSET] + numbers[RATE] * (time[row] - time[0])


@njit(error_model="numpy")
def _table_error(time, values, row, numbers, errors, per):
    """What a table adds to a reading; over the speed, to what it has added until the row before."""
    value = per * values[row]
    if numbers[OVER] == VALUE:
        return _between_nodes(numbers, value)
    if numbers[OVER] == TURN:
        return _between_nodes(numbers, np.mod(value, 2.0 * np.pi))
    if row == 0:
        return 0.0
    moved = value - per * values[row - 1]
    speed = abs(moved) / (time[row] - time[row - 1])
    return errors[row - 1] + moved * _between_nodes(numbers, speed)


@njit(error_model="numpy")
def _between_nodes(numbers, at):
    count = int(numbers[COUNT])
    place = (at - numbers[FIRST]) / numbers[STEP]
    last = count - 1
    if numbers[OVER] == TURN:
        last = count  # back at the first node
    if numbers[GROWS] == 0.0:
        place = min(max(place, 0.0), float(last))
    j = int(min(max(place, 0.0), last - 1.0))
    after = numbers[NODES + (j + 1) % count]
    return numbers[NODES + j] + (place - j) * (after - numbers[NODES + j])
