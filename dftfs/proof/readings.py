"""What the sensors of a rig make of an exact motion."""

from dataclasses import dataclass, field, replace

import numpy as np

SENSED = ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm", "temperature_C")
DECIMALS = {"time_s": 3, "current_A": 3, "torque_Nm": 3, "temperature_C": 1}


@dataclass(frozen=True, kw_only=True)
class Fault:
    """What is wrong with one reading; the defaults are a healthy sensor.

    ``ripple`` and ``ripple_cycles``: an error periodic in the angle, per radian; ``clip``: the
    largest reading; ``fade``: the reading at which an amplifier has lost a quarter;
    ``lost_share`` of the motion faster than ``lost_above_per_s`` is not counted.
    """

    offset: float = 0.0
    scale: float = 1.0
    delay_s: float = 0.0
    rate_per_s: float = 0.0
    ripple: float = 0.0
    ripple_cycles: float = 0.0
    clip: float = np.inf
    fade: float = np.inf
    lost_share: float = 0.0
    lost_above_per_s: float = np.inf


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """The sensors that a rig has."""

    columns: tuple[str, ...] = SENSED[:4]
    motor_counts_per_rev: int = 8192
    load_counts_per_rev: int = 8192
    torque_noise_Nm: float = 0.02
    current_noise_A: float = 0.005
    temperature_noise_K: float = 0.1
    faults: dict[str, Fault] = field(default_factory=dict)

    def noise(self, column: str) -> float:
        """Standard deviation of a healthy reading; a count's is its width over root twelve."""
        return {
            "motor_angle_rad": 2 * np.pi / self.motor_counts_per_rev / np.sqrt(12.0),
            "load_angle_rad": 2 * np.pi / self.load_counts_per_rev / np.sqrt(12.0),
            "torque_Nm": self.torque_noise_Nm,
            "current_A": self.current_noise_A,
            "temperature_C": self.temperature_noise_K,
        }[column]

    def with_fault(self, column: str, fault: Fault) -> "Sensors":
        return replace(self, faults={**self.faults, column: fault})


def exact_reading(values: np.ndarray, time_s: np.ndarray, fault: Fault) -> np.ndarray:
    """The faulty reading before noise and counts; a drifting sensor is zeroed at every start."""
    if fault.delay_s > 0.0:
        values = np.interp(time_s - fault.delay_s, time_s, values)
    if fault.lost_share > 0.0:
        speed = np.gradient(values, time_s)
        uncounted = fault.lost_share * speed * (np.abs(speed) > fault.lost_above_per_s)
        values = values - np.cumsum(uncounted) * (time_s[1] - time_s[0])
    if np.isfinite(fault.fade):
        values = values / (1.0 + (values / fault.fade) ** 2 / 3.0)
    values = values + fault.ripple * np.sin(fault.ripple_cycles * values)
    values = fault.scale * values + fault.offset + fault.rate_per_s * time_s
    return np.clip(values, -fault.clip, fault.clip)


def expected(
    motion: dict[str, np.ndarray], time_s: np.ndarray, sensors: Sensors
) -> dict[str, np.ndarray]:
    """The readings without noise and counts."""
    return {
        c: exact_reading(motion[c], time_s, sensors.faults.get(c, Fault())) for c in sensors.columns
    }


def readings(
    motion: dict[str, np.ndarray],
    time_s: np.ndarray,
    sensors: Sensors,
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    """Readings with noise; incremental encoders count from a random place between two counts."""
    out = {}
    for column, values in expected(motion, time_s, sensors).items():
        if column.endswith("angle_rad"):
            counts = (
                sensors.motor_counts_per_rev
                if column.startswith("motor")
                else sensors.load_counts_per_rev
            )
            width = 2 * np.pi / counts
            phase = rng.uniform(0.0, 1.0)
            values = width * np.floor(values / width + phase)
        else:
            values = values + rng.normal(0.0, sensors.noise(column), values.size)
        out[column] = np.round(values, DECIMALS.get(column, 5))
    return out
