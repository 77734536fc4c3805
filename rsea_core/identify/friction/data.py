"""What recordings say of friction: the torque that the balance of the motor's shaft leaves over.

    friction = k_t i - J dw/dt - tau_load / N        (motor side, J = J_m + J_o / N^2)

The current is the measured one, else what duty and speed give (the winding's lag left out); the
load's torque is the sensor's, else the link's own motion, whose inertia and gravity then enter as
corrections to be fitted beside friction. Speeds and accelerations come from angles by a local
cubic (Savitzky & Golay 1964), and torques pass the same one, so that the balance holds between
them. Rows at rest and rows whose window sees the motion turn say nothing of a sliding joint and
are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rsea_core.errors import RecordingError
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import GRAVITY_m_per_s2
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

WINDOW_s = 0.06  # of the local cubic: shorter than the fastest motion of interest
SLOWEST = 0.01  # of the largest speed: below it a row counts as being at rest
BLOCK_s = 0.5  # rows of one block share their errors
STEADY_BLOCKS = 4  # of a recording at constant speed


@dataclass(frozen=True, kw_only=True)
class FrictionData:
    """Rows in motion, (n,) arrays on the motor side.

    Attributes
    ----------
    friction_Nm : array
        What the balance leaves over.
    speed_rad_per_s : array
    load_Nm : array
        Torque that passes through the gear, positive when the motor feels it as resistance to
        positive motion.
    normal_N : array or None
        Force on the load's bearing (thesis 3.6, as a vector sum), where the link is known.
    corrections : mapping of name -> array
        Columns for the inertia and gravity of a link that no sensor sees.
    block : array of int
    held_out : array of bool
    gear_ratio : float
    split : str
        How the held-out rows were chosen, as text.
    """

    friction_Nm: NDArray
    speed_rad_per_s: NDArray
    load_Nm: NDArray
    normal_N: NDArray | None
    corrections: Mapping[str, NDArray]
    block: NDArray
    held_out: NDArray
    gear_ratio: float
    split: str


def friction_data(case: Case) -> FrictionData:
    """The balance of every recording of a case.

    Raises
    ------
    RecordingError
        If no recording shows both a torque of the motor and its motion, or nothing moves.
    """
    usable = [r for r in case.recordings if _speed_name(r) and _has_torque(case.rig, r)]
    if not usable:
        raise RecordingError(
            f"case {case.name!r}: friction needs a motor torque (motor_torque_Nm, current_A, or"
            " duty with the rig's resistance) and a motion (motor or load angle or velocity)"
        )
    parts, blocks = [], 0
    for recording in usable:
        part = _balance(case.rig, recording)
        part["block"] = blocks + part["block"]
        blocks = int(part["block"][-1]) + 1
        parts.append(part)
    names = set.intersection(*(set(part) for part in parts))
    rows = {name: np.concatenate([part[name] for part in parts]) for name in names}
    held, split = rows["validation"], "recordings with the role validation"
    if not held.any() or held.all():
        held, split = rows["block"] % 3 == 2, "every third block of rows"
    speed = rows["speed"]
    moving = (np.abs(speed) > SLOWEST * np.abs(speed).max()) & rows["one_way"]
    if not (moving & held).any() or not (moving & ~held).any():
        raise RecordingError(f"case {case.name!r}: nothing moves")

    def column(name: str) -> NDArray:
        return read_only(np.ascontiguousarray(rows[name][moving]))

    return FrictionData(
        friction_Nm=column("friction"),
        speed_rad_per_s=column("speed"),
        load_Nm=column("load"),
        normal_N=column("normal") if "normal" in names else None,
        corrections={n: column(n) for n in sorted(names) if n.endswith("_correction")},
        block=column("block"),
        held_out=read_only(held[moving]),
        gear_ratio=case.rig.gear_ratio or 1.0,
        split=split,
    )


def _speed_name(recording: Recording) -> str | None:
    names = ("motor_angle_rad", "load_angle_rad", "motor_velocity_rad_per_s")
    if recording.quasi_static:
        names = ("motor_velocity_rad_per_s",)
    return next((name for name in names if name in recording), None)


def _has_torque(rig: Rig, recording: Recording) -> bool:
    if "motor_torque_Nm" in recording or "current_A" in recording:
        return True
    known = rig.terminal_resistance_ohm is not None
    return "current_command_A" in recording or (known and "duty" in recording)


def motor_torque(rig: Rig, recording: Recording, speed: NDArray) -> NDArray:
    """Torque of the motor [Nm], (n,): measured, or of its current, or of duty and speed."""
    k_t = rig.torque_constant_Nm_per_A
    if "motor_torque_Nm" in recording:
        return recording["motor_torque_Nm"]
    if "current_A" in recording:
        return k_t * recording["current_A"]
    if "current_command_A" in recording:
        limit = rig.current_limit_A or np.inf
        return k_t * np.clip(recording["current_command_A"], -limit, limit)
    supply = recording.columns.get("supply_V", rig.supply_voltage_V)
    k_e = k_t if rig.back_emf_constant_Vs_per_rad is None else rig.back_emf_constant_Vs_per_rad
    current = (recording["duty"] * supply - k_e * speed) / rig.terminal_resistance_ohm
    if "drive_enabled" in recording:
        current = current * (recording["drive_enabled"] != 0.0)
    return k_t * current


def _balance(rig: Rig, recording: Recording) -> dict[str, NDArray]:
    ratio, n = rig.gear_ratio or 1.0, recording.rows
    if recording.quasi_static:
        speed = _steady(recording["motor_velocity_rad_per_s"])
        acceleration, angle, smooth = np.zeros(n), None, _as_it_is
        one_direction = np.ones(n, bool)
        block = np.arange(n) * STEADY_BLOCKS // n
    else:
        window = _window(recording)
        speed, acceleration, angle = _motion(recording, ratio, window)
        slow = SLOWEST * np.abs(speed).max()
        lowest, highest = minimum_filter1d(speed, window), maximum_filter1d(speed, window)
        one_direction = (lowest > slow) | (highest < -slow)

        def smooth(values: NDArray) -> NDArray:
            return _smoothed(values, window)

        block = (np.arange(n) * recording.sample_time_s / BLOCK_s).astype(int)
    inertia = (rig.motor_inertia_kgm2 or 0.0) + (rig.output_inertia_kgm2 or 0.0) / ratio**2
    found = {
        "speed": speed,
        "one_way": one_direction,
        "block": block,
        "validation": np.full(n, recording.role == "validation"),
    }
    load = np.zeros(n)
    if "torque_Nm" in recording and "torque_Nm" not in recording.derived:
        load = smooth(recording["torque_Nm"]) / ratio
    elif recording.load.kind == "constant-torque":
        load = np.full(n, -recording.load.load_torque_Nm / ratio)
    elif rig.has("load") and not rig.has("spring") and not recording.load.is_held:
        swing = (rig.load_inertia_kgm2 or 0.0) * acceleration / ratio
        found["inertia_correction"] = acceleration
        load = swing / ratio
        if recording.load.kind in ("pendulum", "contact") and angle is not None:
            tilt = angle + (rig.gravity_angle_offset_rad or 0.0)
            weight = rig.load_mass_kg * GRAVITY_m_per_s2
            load = load + weight * rig.load_distance_m * np.sin(tilt) / ratio
            found["gravity_correction"] = np.sin(tilt)
            spin = rig.load_mass_kg * rig.load_distance_m * (speed / ratio) ** 2
            found["normal"] = np.hypot(spin + weight * np.cos(tilt), weight * np.sin(tilt))
    found["load"] = load
    torque = smooth(motor_torque(rig, recording, speed))
    found["friction"] = torque - inertia * acceleration - load
    return found


def _steady(speed: NDArray) -> NDArray:
    """One speed for a recording at constant speed: its mean; an encoder shows it in steps."""
    return np.full(speed.size, speed.mean())


def _as_it_is(values: NDArray) -> NDArray:
    return values


def _window(recording: Recording) -> int:
    """Rows of the local cubic, an odd number."""
    window = max(2 * round(WINDOW_s / recording.sample_time_s / 2) + 1, 5)
    if window > recording.rows:
        raise RecordingError(f"{recording.file}: {recording.rows} rows are too few for a speed")
    return window


def _smoothed(values: NDArray, window: int, **more: float) -> NDArray:
    """Savitzky and Golay's cubics over a window of rows; derivatives with `deriv`, `delta`."""
    from scipy.signal import savgol_filter  # takes a second to import, rarely needed

    return savgol_filter(values, window, 3, **more)


def _motion(
    recording: Recording, ratio: float, window: int
) -> tuple[NDArray, NDArray, NDArray | None]:
    """Motor-side speed and acceleration, and the output's angle."""
    name, h = _speed_name(recording), recording.sample_time_s
    if name == "motor_velocity_rad_per_s":
        speed = _smoothed(recording[name], window)
        return speed, _smoothed(recording[name], window, deriv=1, delta=h), None
    values = recording[name]
    scale = 1.0 if name == "motor_angle_rad" else ratio
    speed = scale * _smoothed(values, window, deriv=1, delta=h)
    acceleration = scale * _smoothed(values, window, deriv=2, delta=h)
    return speed, acceleration, values * scale / ratio
