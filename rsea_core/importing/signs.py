"""Signs of the columns of a log: those that make the machine's laws positive, where seen."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.hypotheses import Choice
from rsea_core.importing.unit_evidence import correlation_of
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig

LEAST_PART, CLEARLY, SMOOTHED_ROWS = 0.01, 5.0, 50.0  # of a current's part in the volts; in std
DRIVING = ("duty", "voltage_V", "current_command_A", "current_A")
AGAINST_NOISE = 0.3  # correlation below which a sign is not seen


def signs_of(by_target: Mapping[str, Choice], raw: Mapping[str, NDArray], rig: Rig | None, laws):
    """Signs that make the machine's laws positive, and whether each is seen."""
    data = {t: c.factor * raw[c.name] for t, c in by_target.items()}
    ratio = 1.0 if rig is None else rig.gear_ratio or 1.0
    signs, seen = {}, {}
    motor, load = data.get("motor_angle_rad"), data.get("load_angle_rad")
    time = data.get("time_s", np.arange(next(iter(data.values())).size, dtype=float))
    if motor is not None and load is not None:
        signs["load_angle_rad"], seen["load_angle_rad"] = _load_sign(motor / ratio, load, data)
        load = signs["load_angle_rad"] * load
    angle = motor if motor is not None else load
    for side, own in (("motor", motor), ("load", load)):
        speed = f"{side}_velocity_rad_per_s"
        if own is not None and speed in data:
            signs[speed], seen[speed] = _sign_of(np.gradient(own, time), data[speed], time)
    command = next((n for n in DRIVING if n in data), None)
    if command is not None and angle is not None:
        signs[command], seen[command] = _command_sign(data[command], angle, time)
        moving = ("motor_angle_rad",) if motor is not None else ("load_angle_rad",)
        for law in laws:  # laws of motion and winding see signs without being misled by inertia
            if law.columns[0] == command and law.columns[1] in moving:
                signs[command], seen[command] = int(np.sign(law.ratio)) or 1, True
        if "current_A" in data and command != "current_A":
            signs["current_A"], seen["current_A"] = _current_sign(
                signs[command] * data[command], data["current_A"], angle, time
            )
            for law in laws:
                if law.columns == (command, "current_A"):
                    turned = int(np.sign(law.ratio)) * signs[command]
                    known = command != "current_command_A" or seen[command]
                    signs["current_A"], seen["current_A"] = turned or 1, known
    if POSITION_COMMAND in data and angle is not None:
        signs[POSITION_COMMAND], seen[POSITION_COMMAND] = _sign_of(
            angle, data[POSITION_COMMAND], time
        )
    if "torque_Nm" in data and motor is not None:
        deflection = motor / ratio - (0.0 if load is None else load)
        signs["torque_Nm"], seen["torque_Nm"] = _sign_of(deflection, data["torque_Nm"], time)
    return _with_fewest_turned(signs, by_target), seen


def _with_fewest_turned(signs: dict[str, int], by_target: Mapping[str, Choice]) -> dict[str, int]:
    """The signs, or all turned where fewer columns are: the machine's + direction is free."""
    signed = [t for t in by_target if t in signs or t.endswith(("angle_rad", "rad_per_s"))]
    turned = [t for t in signed if signs.get(t, 1) < 0]
    if 2 * len(turned) <= len(signed):
        return signs
    return {t: -signs.get(t, 1) for t in signed}


def _slow(values: NDArray, time: NDArray) -> NDArray:
    n = int(
        np.clip(0.05 / max(float(np.median(np.diff(time))), 1e-9), 1, max(1, values.size // 20))
    )
    sums = np.cumsum(np.concatenate(([0.0], values - values.mean())))
    return (sums[n:] - sums[:-n]) / n


def _sign_of(x: NDArray, y: NDArray, time: NDArray) -> tuple[int, bool]:
    x, y = _slow(x, time), _slow(y, time)
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 1, False
    together = correlation_of(x, y)
    return (1 if together >= 0.0 else -1), abs(together) > AGAINST_NOISE


def _load_sign(output: NDArray, load: NDArray, data) -> tuple[int, bool]:
    """The load follows the motor; where it hardly moves, the spring's torque decides."""
    if np.ptp(load) == 0.0:
        return 1, True
    together = correlation_of(output, load)
    if abs(together) > 0.8:
        return (1 if together > 0.0 else -1), True
    if "torque_Nm" in data and np.ptp(data["torque_Nm"]) > 0.0:
        fits = [abs(correlation_of(output - s * load, data["torque_Nm"])) for s in (1, -1)]
        better = 1 if fits[0] >= fits[1] else -1
        return better, max(fits) > 0.9 and max(fits) - min(fits) > 0.02
    return (1 if together >= 0.0 else -1), abs(together) > 0.5


def _command_sign(command, angle, time) -> tuple[int, bool]:
    """A drive puts work in: the command goes with the speed, over the whole record."""
    speed = np.gradient(angle, time)
    x, y = _slow(command, time), _slow(speed, time)
    work, size = float(np.sum(x * y)), float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    if size == 0.0:
        return 1, False
    return (1 if work >= 0.0 else -1), abs(work) > AGAINST_NOISE * size


def _current_sign(command, current, angle, time) -> tuple[int, bool]:
    """R i = V - k_e w: the part of the command that the speed does not explain goes with it."""
    speed = _slow(np.gradient(angle, time), time)
    x, y = _slow(command, time), _slow(current, time)
    A = np.stack([y, speed], axis=1)
    scale = np.std(A, axis=0)
    if np.any(scale == 0.0) or np.std(x) == 0.0:
        return 1, False
    B, y = A / scale, x / np.std(x)
    found, *_ = np.linalg.lstsq(B, y, rcond=None)
    left = float(np.mean((y - B @ found) ** 2))
    std = np.sqrt(left * np.linalg.pinv(B.T @ B)[0, 0] * SMOOTHED_ROWS)
    return (1 if found[0] >= 0.0 else -1), abs(found[0]) > max(LEAST_PART, CLEARLY * std)
