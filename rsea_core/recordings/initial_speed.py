"""How fast a machine already moves at the first row of a recording.

A recording that was cut out of a longer one, or whose controller ran before its logger did, does
not begin at rest. A replay that starts at rest then misses the motion by speed times time constant
for good where nothing pulls the machine back.

The speed is the slope, at the first row, of a parabola through the first rows. A long parabola
averages noise and a short one follows the motion: the longest is taken whose slope agrees with
those of all shorter ones within their noise (Lepski, Theory Probab. Appl. 35 (1990) 454).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rsea_core.recordings.recording import Recording

ANGLES = ("motor_angle_rad", "load_angle_rad")
LENGTHS = (4, 6, 8, 11, 16, 22, 32, 45, 64, 90, 128)  # rows of the parabolas
LONGEST_s = 0.25
WITHIN = 2.0  # standard deviations that slopes may differ by
MOVING = 6.0  # standard deviations of the speed of the very first rows, and
MOVES = 0.02  # of the largest speed: above both the machine already moves


@dataclass(frozen=True, kw_only=True)
class FirstSpeed:
    """A speed at the first row and its standard deviation, the unit of the reading a second."""

    speed: float
    std: float


def first_speed(angle: ArrayLike, row_s: float, noise: float) -> FirstSpeed:
    """Speed of a reading at its first row.

    Parameters
    ----------
    angle : (n,) array
    row_s : float
        Time between rows [s].
    noise : float
        Standard deviation of the reading, above zero.

    Raises
    ------
    ValueError
        If there are fewer rows than the shortest parabola needs.
    """
    angle = np.asarray(angle, dtype=float)
    if angle.size < LENGTHS[0]:
        raise ValueError(f"a first speed needs {LENGTHS[0]} rows, not {angle.size}")
    low, high, found = -np.inf, np.inf, None
    for n in LENGTHS:
        if n > angle.size or (found is not None and n * row_s > LONGEST_s):
            break
        t = np.arange(n) / (n - 1.0)
        inverse = np.linalg.pinv(np.stack([np.ones(n), t, t * t], axis=1))[1]
        length = (n - 1) * row_s
        slope = float(inverse @ (angle[:n] - angle[0])) / length
        std = noise * float(np.linalg.norm(inverse)) / length
        low, high = max(low, slope - WITHIN * std), min(high, slope + WITHIN * std)
        if found is not None and low > high:
            break
        found = FirstSpeed(speed=slope, std=std)
    return found


def start_speeds(
    r: Recording, gear_ratio: float, floors: dict[str, float]
) -> tuple[FirstSpeed, FirstSpeed]:
    """Speeds of motor and load at the first row [rad/s]; zero where nothing reads a motion.

    Parameters
    ----------
    floors : mapping of column -> float
        Standard deviations of the readings (`noise_floor`).
    """
    still = FirstSpeed(speed=0.0, std=0.0)
    found = {
        name: first_speed(r[name], r.sample_time_s, floors[name])
        for name in ANGLES
        if name in r.responses and r.rows >= LENGTHS[0]
    }
    motor, load = found.get("motor_angle_rad"), found.get("load_angle_rad")
    if r.load.is_held:
        load = still
    elif load is None and motor is not None:
        load = FirstSpeed(speed=motor.speed / gear_ratio, std=motor.std / gear_ratio)
    if motor is None and load is not None:
        motor = FirstSpeed(speed=load.speed * gear_ratio, std=load.std * gear_ratio)
    return motor or still, load or still


def initial_motion(
    r: Recording, name: str, noise: float, least: float = MOVES
) -> FirstSpeed | None:
    """The speed of an angle at the first row, if it is one; None at rest.

    Over more than the fewest rows a drive that just came on looks like a speed.

    Parameters
    ----------
    name : str
        Column.
    noise : float
        Standard deviation of the reading, above zero.
    least : float
        Share of the largest speed that counts.
    """
    angle = r[name]
    first = first_speed(angle[: LENGTHS[0]], r.sample_time_s, noise)
    if abs(first.speed) <= MOVING * first.std:
        return None
    short, long = LENGTHS[0] - 1, max(2, min(round(0.05 / r.sample_time_s), r.rows // 10))
    # over less than a cycle of a fast oscillation too; what noise adds there is taken off
    distances = {rows: np.max(np.abs(angle[rows:] - angle[:-rows])) for rows in (short, long)}
    distances[short] -= MOVING * noise
    largest = max(distance / (rows * r.sample_time_s) for rows, distance in distances.items())
    return first if abs(first.speed) > least * largest else None


def begins_at_rest(r: Recording, floors: dict[str, float]) -> bool:
    """Whether a recording is said to begin at rest, and no angle is seen to move at its first row.

    Parameters
    ----------
    floors : mapping of column -> float
        Standard deviations of the readings (`noise_floor`).
    """
    angles = [name for name in ANGLES if name in r.responses and r.rows >= LENGTHS[0]]
    moves = any(initial_motion(r, name, floors[name]) for name in angles)
    return r.initial_rest and bool(angles) and not moves
