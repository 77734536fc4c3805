"""Typical magnitudes of a case, by which starts and steps of variants are scaled."""

import numpy as np

from rsea_core.effects.sensor_base import FITTED
from rsea_core.effects.typical import Scales
from rsea_core.recordings.case import Case

BENT = 0.1  # of the largest deflection: more is no encoder's doing


def scales_of(case: Case, *, relative: bool = False) -> Scales:
    """Typical magnitudes of a case, from the rig and the spans of its columns."""
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
    load = max(gravity * min(swing, 1.0), 0.02 * motor * N, 1e-300 if relative else 1e-6)
    torque = torque or motor * N
    return Scales(
        torque_Nm=torque,
        motor_torque_Nm=motor,
        current_A=current,
        load_torque_Nm=load,
        deflection_rad=torque / K,
        stiffness=K,
        speed_rad_per_s=max(speed, 1e-300 if relative else 1e-3),
        columns=tuple({c for r in case.identification for c in r.responses}),
        loads=tuple({r.load.kind for r in case.identification}),
        rig=rig,
        commands=frozenset(r.command_name for r in case.identification),
        peak_current_A=_peak_current_A(case),
        command=_command(case),
        relative=relative,
        begins_bent=_begins_bent(case, torque / K),
        spans={column: _span(case, column) for column in FITTED},
    )


def _peak_current_A(case: Case) -> float | None:
    """The largest current that was read and not commanded; None where there is none."""
    seen = [
        float(np.percentile(np.abs(r["current_A"]), 99.9))
        for r in case.identification
        if "current_A" in r and r.command_name != "current_A"
    ]
    return max(seen, default=None)


def _command(case: Case) -> float:
    """Largest standard deviation of a recording's command, in its own unit."""
    spreads = [
        float(np.std(r[r.command_name]))
        for r in case.identification
        if r.command_name not in (None, "current_A")
    ]
    return max(spreads, default=0.0) or 0.3


def _begins_bent(case: Case, deflection_rad: float) -> bool:
    """Whether a recording begins with the spring bent: let go from an angle."""
    ratio = case.rig.gear_ratio or 1.0
    for r in case.identification:
        if "load_angle_rad" in r and "motor_angle_rad" in r:
            bend = r["motor_angle_rad"][0] / ratio - r["load_angle_rad"][0]
            if abs(bend) > BENT * deflection_rad:
                return True
    return False


def _span(case: Case, column: str) -> tuple[float, float]:
    """Largest standard deviation of a column, longest duration of all recordings [s]."""
    spreads = [float(np.std(r[column])) for r in case.identification if column in r]
    longest = max(float(r.time_s[-1] - r.time_s[0]) for r in case.identification)
    return max(spreads, default=1.0), longest
