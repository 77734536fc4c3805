"""What is typical of a machine's recordings, by which starts and steps of laws are scaled."""

from dataclasses import dataclass

import numpy as np

from rsea_core.recordings.case import Case


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What is typical of a machine's recordings."""

    torque_Nm: float  # through the spring
    motor_torque_Nm: float
    current_A: float
    load_torque_Nm: float
    deflection_rad: float
    stiffness: float
    speed_rad_per_s: float  # of the load
    columns: tuple[str, ...]
    loads: tuple[str, ...]


def scales_of(case: Case) -> Scales:
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
    load = max(gravity * min(swing, 1.0), 0.02 * motor * N, 1e-6)
    torque = torque or motor * N
    return Scales(
        torque_Nm=torque,
        motor_torque_Nm=motor,
        current_A=current,
        load_torque_Nm=load,
        deflection_rad=torque / K,
        stiffness=K,
        speed_rad_per_s=max(speed, 1e-3),
        columns=tuple({c for r in case.identification for c in r.responses}),
        loads=tuple({r.load.kind for r in case.identification}),
    )
