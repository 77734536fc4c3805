"""Typical magnitudes of a case, by which starts and steps of variants are scaled."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.load_base import HELD
from rsea_core.effects.sensor_base import FITTED
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.recordings.case import Case, noise_floor

VOLTAGES = ("duty", "voltage_V")
DRIVEN = 99.0  # percentile: single rows in which a count changes are no speed
DEFLECTED_SHARE = 0.1  # of the largest deflection: more is no encoder's doing


def typical_magnitudes_of(case: Case, *, relative: bool = False) -> TypicalMagnitudes:
    """Typical magnitudes of a case, from the rig and the spans of its columns.

    Parameters
    ----------
    relative : bool
        Of any machine (`own_magnitudes`); else those of the bench, with its floors.
    """
    return own_magnitudes(case) if relative else _bench_magnitudes(case)


def own_magnitudes(case: Case) -> TypicalMagnitudes:
    """Typical magnitudes with no absolute number: of any machine, whatever its size.

    The largest of all recordings: speeds from differences over as many rows as it takes to leave
    the readings' noise, torques from what drives the motion and from what the motion takes.
    """
    rig = case.rig
    N = rig.gear_ratio or 1.0
    free = [r for r in case.identification if r.load.kind not in HELD] or case.identification
    motions = [m for r in free for m in (_motion(r, N, rig),) if m is not None]
    angle, speed = max(motions, default=(0.0, 0.0), key=lambda m: m[1])
    longest = max(float(r.time_s[-1] - r.time_s[0]) for r in case.identification)
    angle, widest = angle or 1e-9, max((m[0] for m in motions), default=0.0)
    speed = speed or angle / longest
    time = min(angle / speed, longest)
    drive = max((_drive_torque(case, r) for r in case.identification), default=0.0)
    gravity = (rig.load_mass_kg or 0.0) * 9.81 * (rig.load_distance_m or 0.0)
    moved = max(gravity * min(angle, 1.0), (rig.load_inertia_kgm2 or 0.0) * speed / time)
    taken, read = (
        max((float(np.std(r["torque_Nm"])) for r in some if "torque_Nm" in r), default=0.0)
        for some in (free, case.identification)
    )
    deflection = max((_deflection(r, N) for r in case.identification), default=0.0)
    sprung = (rig.spring_stiffness_Nm_per_rad or 0.0) * deflection
    # what the drive pushes against is unknown too: the friction of a slow load moves nothing
    load = max(moved, taken, min(drive, sprung) if sprung else drive) or 1e-300
    drive = drive or load
    K = rig.spring_stiffness_Nm_per_rad or load / angle
    kt = rig.torque_constant_Nm_per_A or 1.0
    return TypicalMagnitudes(
        torque_Nm=read or load, motor_torque_Nm=drive / N, current_A=drive / N / kt,
        load_torque_Nm=load, deflection_rad=deflection or load / K, stiffness=K,
        speed_rad_per_s=speed, angle_rad=angle, time_s=time, widest_angle_rad=widest or None,
        columns=tuple({c for r in case.identification for c in r.responses}),
        loads=tuple({r.load.kind for r in case.identification}),
        rig=rig, commands=frozenset(r.command_name for r in case.identification),
        peak_current_A=_peak_current_A(case) or _driven_current_A(case),
        often_read_A=_largest(case, "current_A", 98.0),
        command=_command(case), relative=True,
        begins_deflected=_begins_deflected(case, deflection or load / K),
        spans={column: _span(case, column) for column in FITTED},
        row_s=min(r.sample_time_s for r in case.identification),
    )  # fmt: skip


def _motion(r, ratio: float, rig) -> tuple[float, float] | None:
    """Standard deviation of the angle and root mean square speed at the output."""
    floors = noise_floor(rig, r)
    for name, side in (("load_angle_rad", 1.0), ("motor_angle_rad", ratio)):
        if name in r and np.std(r[name]) > 3.0 * floors[name]:
            x, lag = r[name], 1
            while np.std(x[lag:] - x[:-lag]) < 6.0 * floors[name] and lag < x.size // 8:
                lag *= 2
            times = r.time_s[lag:] - r.time_s[:-lag]
            speed = np.sqrt(np.mean(((x[lag:] - x[:-lag]) / times) ** 2))
            return float(np.std(x)) / side, float(speed) / side
    for name, side in (("load_velocity_rad_per_s", 1.0), ("motor_velocity_rad_per_s", ratio)):
        if name in r:
            travel = np.cumsum(r[name]) * r.sample_time_s
            return float(np.std(travel)) / side, float(np.sqrt(np.mean(r[name] ** 2))) / side
    return None


def _drive_torque(case: Case, r) -> float:
    """Standard deviation of the motor's torque at the output [Nm]."""
    rig, N = case.rig, case.rig.gear_ratio or 1.0
    kt = rig.torque_constant_Nm_per_A or 1.0
    if "current_A" in r:
        return float(np.std(r["current_A"])) * kt * N
    if r.command_name in VOLTAGES:
        given, left = _winding_voltage(rig, r)
        volts = min(float(np.std(left)), float(np.std(given)))
        return volts / (rig.terminal_resistance_ohm or 1.0) * kt * N
    if r.command_name == "current_command_A":
        return float(np.std(r[r.command_name])) * kt * N
    if r.command_name == POSITION_COMMAND:
        return _servo_torque(rig, r, N)
    return float(np.std(r[r.command_name])) * N if r.command_name else 0.0


def _winding_voltage(rig, r) -> tuple[NDArray, NDArray]:
    """Voltage (n,) at the winding, and what back-EMF leaves of it if the motor's angle is read."""
    given = r[r.command_name] * ((rig.supply_voltage_V or 1.0) if r.command_name == "duty" else 1.0)
    if "motor_angle_rad" not in r or not rig.back_emf_constant_Vs_per_rad:
        return given, given
    speed = np.gradient(r["motor_angle_rad"], r.time_s)
    return given, given - rig.back_emf_constant_Vs_per_rad * speed


def _servo_torque(rig, r, ratio: float) -> float:
    """Standard deviation of what a servo's gain makes of its goal's distance [Nm]."""
    short = r[POSITION_COMMAND]
    for name, side in (("load_angle_rad", 1.0), ("motor_angle_rad", ratio)):
        if name in r:
            short = short - r[name] / side
            break
    return float(np.std(short)) * (rig.servo_proportional_Nm_per_rad or 1.0)


def _deflection(r, ratio: float) -> float:
    """Standard deviation of the spring's deflection [rad], where both its ends are known."""
    if "spring_deflection_rad" in r:
        return float(np.std(r["spring_deflection_rad"]))
    if "motor_angle_rad" not in r:
        return 0.0
    if "load_angle_rad" in r:
        return float(np.std(r["motor_angle_rad"] / ratio - r["load_angle_rad"]))
    # a locked end: at resonance the spring deflects by many times torque over stiffness
    return float(np.std(r["motor_angle_rad"])) / ratio if r.load.kind == "locked" else 0.0


def _bench_magnitudes(case: Case) -> TypicalMagnitudes:
    """Typical magnitudes with the floors of the bench."""
    rig = case.rig
    K = rig.spring_stiffness_Nm_per_rad or 1.0
    N = rig.gear_ratio or 1.0
    swing, current, torque, speed, command = 0.0, 0.0, 0.0, 0.0, 0.0
    for r in case.identification:
        if "current_A" in r:
            current = max(current, float(np.std(r["current_A"])))
        if "torque_Nm" in r:
            torque = max(torque, float(np.std(r["torque_Nm"])))
        if "load_angle_rad" in r:
            swing = max(swing, float(np.std(r["load_angle_rad"])))
            spread = np.percentile(np.abs(np.diff(r["load_angle_rad"])), 99.0)
            speed = max(speed, float(spread) / r.sample_time_s)
        if r.command_name in ("duty", "voltage_V"):
            volts = rig.supply_voltage_V or 1.0 if r.command_name == "duty" else 1.0
            command = max(command, volts * float(np.std(r[r.command_name])))
        elif r.command_name is not None:
            command = max(command, float(np.std(r[r.command_name])))
    if current == 0.0:
        current = command / (rig.terminal_resistance_ohm or 1.0) * 0.2 or 1.0
    motor = current * (rig.torque_constant_Nm_per_A or 1.0)
    gravity = (rig.load_mass_kg or 0.0) * 9.81 * (rig.load_distance_m or 0.0)
    load = max(gravity * min(swing, 1.0), 0.02 * motor * N, 1e-6)
    torque = torque or motor * N
    return TypicalMagnitudes(
        torque_Nm=torque,
        motor_torque_Nm=motor,
        current_A=current,
        load_torque_Nm=load,
        deflection_rad=torque / K,
        stiffness=K,
        speed_rad_per_s=max(speed, 1e-3),
        columns=tuple({c for r in case.identification for c in r.responses}),
        loads=tuple({r.load.kind for r in case.identification}),
        rig=rig,
        commands=frozenset(r.command_name for r in case.identification),
        peak_current_A=_peak_current_A(case),
        command=_command(case),
        begins_deflected=_begins_deflected(case, torque / K),
        spans={column: _span(case, column) for column in FITTED},
    )


def _peak_current_A(case: Case) -> float | None:
    """The largest current that was read, or else commanded; None where there is none."""
    read = _largest(case, "current_A", 99.9)
    return _largest(case, "current_command_A", 99.9) if read is None else read


def _driven_current_A(case: Case) -> float | None:
    """The largest current that a voltage drives through the winding's resistance, without limit."""
    rig = case.rig
    driven = [r for r in case.identification if r.command_name in VOLTAGES]
    volts = [np.percentile(np.abs(_winding_voltage(rig, r)[1]), DRIVEN) for r in driven]
    return float(max(volts)) / (rig.terminal_resistance_ohm or 1.0) if volts else None


def _largest(case: Case, column: str, percentile: float) -> float | None:
    """Percentile of a column's sizes, the largest of all recordings; None where there is none."""
    seen = [
        np.percentile(np.abs(r[column]), percentile) for r in case.identification if column in r
    ]
    return float(max(seen)) if seen else None


def _command(case: Case) -> float:
    """Largest standard deviation of a recording's command, in its own unit."""
    spreads = [
        float(np.std(r[r.command_name]))
        for r in case.identification
        if r.command_name not in (None, "current_A")
    ]
    return max(spreads, default=0.0) or 0.3


def _begins_deflected(case: Case, deflection_rad: float) -> bool:
    """Whether a recording begins with the spring bent: let go from an angle."""
    ratio = case.rig.gear_ratio or 1.0
    for r in case.identification:
        if "load_angle_rad" in r and "motor_angle_rad" in r:
            first = r["motor_angle_rad"][0] / ratio - r["load_angle_rad"][0]
            if abs(first) > DEFLECTED_SHARE * deflection_rad:
                return True
    return False


def _span(case: Case, column: str) -> tuple[float, float]:
    """Largest standard deviation of a column, longest duration of all recordings [s]."""
    spreads = [float(np.std(r[column])) for r in case.identification if column in r]
    longest = max(float(r.time_s[-1] - r.time_s[0]) for r in case.identification)
    return max(spreads, default=1.0), longest
