"""Unknown torques at the machine's ports, and how steady recordings give them without dynamics."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.quantities as q
from rsea_core.errors import InputError
from rsea_core.identify.smoothing.measurement_model import Channel, channels_of
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import GRAVITY_m_per_s2
from rsea_core.numeric.arrays import read_only


@dataclass(frozen=True, kw_only=True)
class PortTorques:
    """Signals and port torques, row by row; arrays are (n,) and read-only.

    Attributes
    ----------
    time_s : array
    signals : mapping of str to array
        "wheel_angle_rad", "wheel_velocity_rad_per_s", "load_angle_rad",
        "load_velocity_rad_per_s", "current_A", "spring_deflection_rad" and "torque_Nm" (the
        spring's whole torque, its port's included), those that the machine has.
    signals_std : mapping of str to array
    ports : mapping of str to array
        Torque [Nm] at "G" (on the wheel), "S" (in the spring), "L" (on the load, the contact's
        included), volts (for a current drive amperes) at "V": what must be added to the nominal
        equations.
    ports_std : mapping of str to array
        One standard deviation, an encoder's unknown constant offset of up to half a count
        included.
    """

    time_s: NDArray
    signals: Mapping[str, NDArray]
    signals_std: Mapping[str, NDArray]
    ports: Mapping[str, NDArray]
    ports_std: Mapping[str, NDArray]


def steady_ports(
    rig: Rig, load: Load, columns: Mapping[str, NDArray], *, ignore: tuple[str, ...] = ()
) -> PortTorques:
    """Port torques of a recording whose accelerations do not matter: rows are states of rest.

    For quasi-static recordings, a spring on a bench, and machines whose inertia is not known. A
    spring of unknown stiffness is compared with its own best straight line.

        S = torque - K deflection,    G = torque + B w - N k_t i    (torque at the gear's output)

    Raises
    ------
    InputError
        If the columns give neither.
    """
    channels = channels_of(rig, columns, ignore)
    signals, spread = _signals(rig, load, columns, channels)
    ports, ports_std = {}, {}
    if {"torque_Nm", "spring_deflection_rad"} <= signals.keys() and "torque_Nm" in channels:
        K = rig.spring_stiffness_Nm_per_rad
        deflection, torque = signals["spring_deflection_rad"], signals["torque_Nm"]
        if K is None:
            K = float(np.polyfit(deflection, torque, 1)[0])
        ports["S"] = torque - K * deflection
        ports_std["S"] = np.hypot(spread["torque_Nm"], K * spread["spring_deflection_rad"])
    passed = _output_torque(rig, load, signals, spread)
    driven = _drive_torque(rig, columns, channels)
    if passed is not None and driven is not None:
        viscous = q.impedance_to_output(rig.motor_viscous_Nms_per_rad or 0.0, rig.gear_ratio)
        viscous += rig.output_viscous_Nms_per_rad or 0.0
        speed = signals.get("wheel_velocity_rad_per_s", np.zeros_like(passed[0]))
        ports["G"] = passed[0] + viscous * speed - driven[0]
        ports_std["G"] = np.hypot(passed[1], driven[1])
    if not ports:
        raise InputError(
            "steady rows need torque_Nm with a deflection, or a drive torque with a known output"
            f" torque; given: {', '.join(columns)}"
        )
    return PortTorques(
        time_s=read_only(np.array(columns["time_s"], dtype=float)),
        signals={name: read_only(v.copy()) for name, v in signals.items()},
        signals_std={name: read_only(v.copy()) for name, v in spread.items()},
        ports={name: read_only(v) for name, v in ports.items()},
        ports_std={name: read_only(v) for name, v in ports_std.items()},
    )


def _signals(
    rig: Rig, load: Load, columns: Mapping[str, NDArray], channels: Mapping[str, Channel]
) -> tuple[dict[str, NDArray], dict[str, NDArray]]:
    """What the rows read, on the output side, and its standard deviation."""
    n = np.asarray(columns["time_s"]).size
    ratio = rig.gear_ratio if rig.has("gear") else 1.0
    values = {name: np.asarray(columns[name], dtype=float) for name in channels}
    spread = {name: np.full(n, channel.floor) for name, channel in channels.items()}
    if "motor_angle_rad" in values:
        values["wheel_angle_rad"] = q.motion_to_output(values.pop("motor_angle_rad"), ratio)
        spread["wheel_angle_rad"] = q.motion_to_output(spread.pop("motor_angle_rad"), ratio)
    if "motor_velocity_rad_per_s" in columns:
        speed = np.asarray(columns["motor_velocity_rad_per_s"], dtype=float)
        values["wheel_velocity_rad_per_s"] = q.motion_to_output(speed, ratio)
        spread["wheel_velocity_rad_per_s"] = np.zeros(n)
    known = "spring_deflection_rad" in values
    if not known and rig.has("spring") and "wheel_angle_rad" in values:
        held = values.get("load_angle_rad", np.zeros(n) if load.is_held else None)
        if held is not None:
            values["spring_deflection_rad"] = values["wheel_angle_rad"] - held
            other = spread.get("load_angle_rad", np.zeros(n))
            spread["spring_deflection_rad"] = np.hypot(spread["wheel_angle_rad"], other)
    return values, spread


def _output_torque(
    rig: Rig, load: Load, signals: Mapping[str, NDArray], spread: Mapping[str, NDArray]
) -> tuple[NDArray, NDArray] | None:
    """Torque that the gear passes on, and its standard deviation."""
    if "torque_Nm" in signals:
        return signals["torque_Nm"], spread["torque_Nm"]
    K = rig.spring_stiffness_Nm_per_rad
    if rig.has("spring") and K is not None and "spring_deflection_rad" in signals:
        name = "spring_deflection_rad"
        return K * signals[name], K * spread[name]
    speed = signals.get("wheel_velocity_rad_per_s")
    if speed is not None and load.kind == "constant-torque":
        torque = (rig.load_viscous_Nms_per_rad or 0.0) * speed - load.load_torque_Nm
        return torque, np.zeros_like(torque)
    angle = signals.get("load_angle_rad", signals.get("wheel_angle_rad"))
    if angle is not None and load.kind == "pendulum" and rig.load_mass_kg is not None:
        weight = rig.load_mass_kg * GRAVITY_m_per_s2 * (rig.load_distance_m or 0.0)
        torque = weight * np.sin(angle + (rig.gravity_angle_offset_rad or 0.0))
        return torque, np.zeros_like(torque)
    return None


def _drive_torque(
    rig: Rig, columns: Mapping[str, NDArray], channels: Mapping[str, Channel]
) -> tuple[NDArray, NDArray] | None:
    """Torque of the motor at the gear's output, and its standard deviation."""
    if not rig.has("gear"):
        return None
    if "motor_torque_Nm" in columns:
        torque = np.asarray(columns["motor_torque_Nm"], dtype=float)
        return q.torque_to_output(torque, rig.gear_ratio), np.zeros_like(torque)
    k_t = rig.torque_constant_Nm_per_A
    name = next((c for c in ("current_A", "current_command_A") if c in columns), None)
    if k_t is None or name is None:
        return None
    current = np.asarray(columns[name], dtype=float)
    floor = channels["current_A"].floor if name in channels else 0.0
    scale = q.transducer_to_output(k_t, rig.gear_ratio)
    return scale * current, np.full(current.size, scale * floor)
