"""The fastest cycle of a machine and of a recording's motion."""

import numpy as np

import rsea_core.machine.plant as mp
from rsea_core.recordings.recording import Recording

# a logged velocity is what the drive's filter made of it: read where there is no angle
VELOCITIES = {
    "motor_angle_rad": "motor_velocity_rad_per_s",
    "load_angle_rad": "load_velocity_rad_per_s",
}


NOISE_DEVIATIONS = 3.0  # by which a mean square speed must exceed what noise alone causes


def cycle_s(plant: mp.Plant, stiffness: float, r: Recording, *, rate: float | None = None) -> float:
    """Period of the fastest swing: of the machine, of gravity's, of the motion's.

    rate : of the motion [1/s]; None: `motion_rate`
    """
    rates = [2.0 * np.pi / (r.time_s[-1] - r.time_s[0])]
    elastic = plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
    whole = plant.inertia + plant.load_inertia
    if elastic and stiffness > 0.0:
        free = plant.structure == mp.ELASTIC_FREE and plant.load_inertia > 0.0
        rates.append(
            np.sqrt(stiffness * (1.0 / plant.inertia + free / (plant.load_inertia or 1.0)))
        )
    if plant.gravity > 0.0 and whole > 0.0:
        rates.append(np.sqrt(plant.gravity / (plant.load_inertia if elastic else whole)))
    if plant.drive == mp.POSITION:  # the slower of its two real modes, where they are real
        damping = (plant.volts_per_speed + plant.damping + plant.load_damping) or 1e-300
        swing = np.sqrt(plant.volts_per_command / whole) if whole > 0.0 else np.inf
        rates.append(min(swing, plant.volts_per_command / damping))
    rates.append(motion_rate(r) if rate is None else rate)
    return float(2.0 * np.pi / max(rates))


def motion_rate(r: Recording) -> float:
    """Speed over angle [1/s] of a recording's motion, the fastest of its angles."""
    rates = [0.0]
    for name in (*VELOCITIES, *VELOCITIES.values()):
        if name in r:
            spread = float(np.std(r[name])) or 1.0
            rates.append(float(np.std(np.diff(r[name]))) / r.sample_time_s / spread)
    return max(rates)


def rate_without_noise(r: Recording) -> float:
    """As `motion_rate`, of what the readings show beyond white noise.

    Differences over L rows have the mean square v^2 L^2 + 2 s^2 of a speed v a row and a noise s;
    those over L and 2 L rows give v without s. The lag with the largest v that is beyond chance
    counts: with short lags noise prevails, over long ones a swing turns back.
    """
    rates = [0.0]
    for name in (*VELOCITIES, *VELOCITIES.values()):
        if name not in r:
            continue
        spread = float(np.std(r[name])) or 1.0
        lags = 2 ** np.arange(int(np.log2(max(r.rows // 8, 1))) + 1)
        squares = [float(np.mean((r[name][lag:] - r[name][:-lag]) ** 2)) for lag in 2 * lags]
        squares = [float(np.mean(np.diff(r[name]) ** 2)), *squares]
        powers = np.diff(squares) / (3.0 * lags**2)
        chance = np.array(squares[:-1]) * np.sqrt(2.0 / r.rows) / (3.0 * lags**2)
        largest = float(np.max(powers - NOISE_DEVIATIONS * chance))
        rates.append(np.sqrt(max(largest, 0.0)) / r.sample_time_s / spread)
    return max(rates)
