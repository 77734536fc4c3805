"""The bench program's own log, read as a recording.

Twenty-three columns in degrees and PWM percent; `Time` counts controller ticks. What the program
computes rather than measures is kept out or marked: velocities are filtered recursively, "Load
torque" is a factor times the two angles' difference. The identifiers R5-R10 are those of the
errata of the thesis that published the program.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError, RecordingError
from rsea_core.files.csv_columns import TEXT, read_columns
from rsea_core.machine.quantities import degrees_to_radians, pwm_to_duty
from rsea_core.recordings.finding import Finding, Kind

REQUIRED = ("Time", "Motor Angle", "Error Angle", "PWM out")
OPTIONAL = (
    "Motor Velocity",
    "FHIC_X",
    "FHIC_X_d",
    "FHIC_X_dd",
    "FHIC_Xr",
    "FHIC_Xr_d",
    "FHIC_Xr_dd",
    "FHIC_fr",
    "FHIC_fe",
    "FHIC_Kp",
    "FHIC_Kv",
    "FHIC_alfa",
    "FHIC_beta",
    "FHIC_gama",
    "FHIC_zeta",
    "FHIC_SEL",
    "Speed controller out",
    "Frequency",
    "Load torque",
)
TICK_s = 0.016  # R10: the controller's period, which the log does not state
DERIVED_CORRELATION = 0.9999  # of torque and deflection: no sensor is that good (R8)


def is_bench_log(path: str | Path) -> bool:
    """Whether a file's header is that of the bench program."""
    try:
        if not Path(path).is_file():
            return False
        with open(path, encoding=TEXT) as stream:
            header = [name.strip() for name in stream.readline(10_000).split(",")]
    except (OSError, ValueError):
        return False
    return "PWM out" in header and "Motor Angle" in header


def read_bench_log(
    path: str | Path, *, gear_ratio: float | None
) -> tuple[dict[str, NDArray], tuple[Finding, ...]]:
    """Columns of the contract from a bench log, and what was decided.

    The load's angle is motor angle less "Error Angle", by which the program defines the latter.

    Parameters
    ----------
    gear_ratio : float or None
        Of the rig; None takes angles as on one side.

    Raises
    ------
    RecordingError
        If a column is missing or unknown, or PWM is outside 0..100; names file, column and row.
    """
    data = read_columns(path, RecordingError, required=REQUIRED, optional=OPTIONAL)
    name = Path(path).name
    ticks = data["Time"]
    if ticks.size < 3:
        raise RecordingError(f"{path}: has {ticks.size} rows; a recording needs at least 3")
    motor = degrees_to_radians(data["Motor Angle"])
    load = motor - degrees_to_radians(data["Error Angle"])
    notes = {"Time": f"bench log, {TICK_s * 1e3:g} ms a tick assumed (the log counts ticks)"}
    ratio = 1.0 if gear_ratio is None else gear_ratio
    motor, notes["Motor Angle"] = _motor_side(motor, load, ratio)
    try:
        duty = pwm_to_duty(data["PWM out"])
    except InputError as problem:
        row = int(np.argmax((data["PWM out"] < 0.0) | (data["PWM out"] > 100.0))) + 2
        raise RecordingError(f"{path}: column PWM out, row {row}: {problem}") from problem
    columns = {"time_s": ticks * TICK_s, "duty": duty}
    columns |= {"motor_angle_rad": motor, "load_angle_rad": load}
    if "Load torque" in data:
        columns["torque_Nm"] = data["Load torque"]
        notes["Load torque"] = _torque_note(data["Load torque"], data["Error Angle"])
    if "Motor Velocity" in data:
        notes["Motor Velocity"] = "Motor Velocity is a recursive filter's output: not used"
    if "Frequency" in data:
        notes["Frequency"] = _frequency_note(data["Frequency"], duty)
    return columns, tuple(
        Finding(kind=Kind.READER, text=text, file=name, column=column)
        for column, text in notes.items()
    )


def _motor_side(motor: NDArray, load: NDArray, ratio: float) -> tuple[NDArray, str]:
    """The motor's angle on the motor side, and how it was decided (R5: span ratio)."""
    span = np.ptp(motor) / max(float(np.ptp(load)), 1e-9)
    on_motor = ratio > 1.0 and abs(np.log(max(span, 1e-9) / ratio)) < abs(np.log(max(span, 1e-9)))
    if on_motor:
        return motor, f"Motor Angle spans {span:.3g} times the load: taken as on the motor side"
    side = f"Motor Angle spans {span:.3g} times the load: taken as behind the gear, times {ratio:g}"
    return motor * ratio, side


def _torque_note(torque: NDArray, error_deg: NDArray) -> str:
    if np.ptp(torque) == 0.0 or np.ptp(error_deg) == 0.0:
        return "Load torque does not move"
    slope = float(np.polyfit(error_deg, torque, 1)[0])
    if abs(np.corrcoef(torque, error_deg)[0, 1]) > DERIVED_CORRELATION:
        return (
            f"Load torque is {slope:.4g} Nm per degree of Error Angle, computed, not"
            " sensed: it says nothing of stiffness or hysteresis"
        )
    return "Load torque is not a multiple of Error Angle; kept out as not understood"


def _frequency_note(frequency: NDArray, duty: NDArray) -> str:
    """R7: the setting is an alias of what the duty does; the duty's own peak is reported."""
    moving = duty - duty.mean()
    if not np.any(moving):
        return "Frequency column not trusted"
    spectrum = np.abs(np.fft.rfft(moving * np.hanning(moving.size)))
    peak = np.fft.rfftfreq(moving.size, TICK_s)[int(np.argmax(spectrum[1:])) + 1]
    return (
        f"Frequency column ({frequency[0]:g}) not trusted: the duty's main frequency is"
        f" {peak:.3g} Hz"
    )
