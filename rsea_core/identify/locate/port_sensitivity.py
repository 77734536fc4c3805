"""What torques at the ports, and errors of the rig's values, put into the innovations.

A steady predictor of the nominal machine leaves innovations that are linear in every port signal
(Willsky & Jones, IEEE TAC 21 (1976)). An error of a rig value acts like a port signal too, its own
share of the equation that it stands in, so both are columns of one regression in units of the
sensors' noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.identify.smoothing.kalman as kalman
import rsea_core.machine.plant as mp
from rsea_core.identify.smoothing.linear_system import discretise
from rsea_core.identify.smoothing.smoother import Smoothed
from rsea_core.identify.smoothing.smoother_input import Recorded
from rsea_core.identify.smoothing.smoother_setup import setup_of
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording

FORGET_s = 0.05  # how long the predictor remembers a port's torque
EXPECTED = 3e-4  # of a port's scale: what the predictor takes for noise
UNREPEATED_COUNTS = 8.0  # of the motor encoder, rms: what a bridge does not repeat
UNREPEATED_s = 0.7  # how slowly
TOLERANCE = {
    "spring_stiffness_Nm_per_rad": 0.15,
    "torque_constant_Nm_per_A": 0.08,
    "back_emf_constant_Vs_per_rad": 0.08,
    "terminal_resistance_ohm": 0.15,
    "supply_voltage_V": 0.02,
    "motor_viscous_Nms_per_rad": 0.7,
    "load_mass_kg": 0.03,
    "load_viscous_Nms_per_rad": 0.7,
    "gravity_angle_offset_rad": 0.015,
    "contact_stiffness_Nm_per_rad": 0.1,
    "contact_damping_Nms_per_rad": 0.4,
    "contact_angle_rad": 0.005,
}
"""Relative standard deviations of rig values where the rig states none; of angles absolute."""


@dataclass(frozen=True, kw_only=True)
class PortSensitivity:
    """One recording's innovations and their linear causes.

    Attributes
    ----------
    total : (n, p) array
        The innovations, in standard deviations of the predictor's own noise.
    by_port : mapping of str to (n, p) array
        What the smoothed torque of each port puts into them.
    by_parameter : mapping of str to (n, p) array
        What one tolerance of each rig value would put into them.
    signals : mapping of str to list of (port, (n,) array)
        What one tolerance of each rig value adds at which ports.
    unrepeated : (n, p) array
        What one draw of a bridge's slow unrepeatability puts into them: no missing physics.
    channels : tuple of str
    """

    total: NDArray
    by_port: Mapping[str, NDArray]
    by_parameter: Mapping[str, NDArray]
    signals: Mapping[str, list[tuple[str, NDArray]]]
    unrepeated: NDArray
    channels: tuple[str, ...]


def port_sensitivity(rig: Rig, recording: Recording, found: Smoothed) -> PortSensitivity:
    """Innovations of a smoothed recording with their causes.

    Raises
    ------
    InputError, RigError
        As `smooth`.
    """
    recorded = Recorded.of(rig, recording.load, recording.columns, recording.derived)
    if recorded.needs_second_pass():
        recorded = recorded.refined(
            found.signals.get("load_angle_rad"), found.signals.get("wheel_velocity_rad_per_s")
        )
    setup = setup_of(recorded, False, latent=False)
    _, held = discretise(recorded.machine, recorded.row_s)
    expected = {port: EXPECTED * setup.magnitudes[port] for port in found.ports}
    Q = sum(
        (size**2 * FORGET_s / recorded.row_s) * np.outer(held[port][0], held[port][0])
        for port, size in expected.items()
    )
    _, _, filtered = kalman.filter_rows(
        kalman.Dynamics(setup.A, setup.mode, setup.drift), Q, setup.H, setup.readings,
        setup.variance, setup.x0, setup.P0, True,
    )  # fmt: skip

    def innovations(drift: NDArray, readings: NDArray, start: NDArray) -> NDArray:
        dynamics = kalman.Dynamics(setup.A, setup.mode, drift)
        return kalman.innovations_of(dynamics, setup.H, readings, start, filtered)

    def caused(port: str, values: NDArray) -> NDArray:
        readings = np.zeros_like(setup.readings)
        for j, name in enumerate(setup.channels):
            direct = recorded.machine.direct.get(name, {}).get(port, 0.0)
            readings[:, j] = direct * values
        drift = -held[port][setup.mode] * values[:, None]
        return innovations(drift, readings, np.zeros_like(setup.x0))

    signals = parameter_signals(rig, recorded, found)
    parameters: dict[str, NDArray] = {}
    for name, acting in signals.items():
        parameters[name] = sum(caused(port, values) for port, values in acting)
    return PortSensitivity(
        total=innovations(setup.drift, setup.readings, setup.x0),
        by_port={port: caused(port, values) for port, values in found.ports.items()},
        by_parameter=parameters,
        signals=signals,
        unrepeated=caused("V", _unrepeated_volts(rig, recorded)),
        channels=setup.channels,
    )


def _unrepeated_volts(rig: Rig, recorded: Recorded) -> NDArray:
    """A draw of the slow voltage that moves a free motor by some counts; none without a bridge."""
    plant, n = recorded.machine.plant, recorded.columns["time_s"].size
    if plant.drive not in (mp.DUTY, mp.VOLTAGE):
        return np.zeros(n)
    count = rig.motor_encoder_counts_per_rev
    moved = UNREPEATED_COUNTS * (2.0 * np.pi / count if count else 1e-4 * plant.gear_ratio)
    rms = plant.volts_per_speed * moved / plant.gear_ratio / UNREPEATED_s
    decay = np.exp(-recorded.row_s / UNREPEATED_s)
    noise = np.random.default_rng(n).standard_normal(n) * np.sqrt(1.0 - decay**2)
    from scipy.signal import lfilter  # takes a second to import, rarely needed

    return rms * lfilter([1.0], [1.0, -decay], noise)


def parameter_signals(
    rig: Rig, recorded: Recorded, found: Smoothed
) -> dict[str, list[tuple[str, NDArray]]]:
    """What one tolerance of each rig value adds at which ports, from the smoothed states.

    Inductance and inertias are left out: with every value of an equation free, all of them times
    zero explain anything.
    """
    plant, s = recorded.machine.plant, found.signals
    tolerance = {**TOLERANCE, **dict(rig.tolerances)}
    zero = np.zeros(found.time_s.size)
    speed, current = s["wheel_velocity_rad_per_s"], s.get("current_A", zero)
    rigid = plant.structure == mp.RIGID_FREE
    load_speed = speed if rigid else s.get("load_velocity_rad_per_s", zero)
    angle = recorded.load_angle() if not recorded.load.is_held else zero
    drive = plant.torque_per_ampere * current
    if plant.drive == mp.MOTOR_TORQUE:
        drive = plant.torque_per_motor_torque * recorded.commanded()
    gravity = -plant.gravity * np.sin(angle + plant.gravity_offset)
    acting: dict[str, list[tuple[str, NDArray]]] = {}

    def add(name: str, port: str, values: NDArray) -> None:
        if name not in rig.anchors and np.any(values != 0.0):
            acting.setdefault(name, []).append((port, tolerance[name] * values))

    if plant.drive in (mp.DUTY, mp.VOLTAGE):
        add("terminal_resistance_ohm", "V", -plant.resistance * current)
        add("back_emf_constant_Vs_per_rad", "V", -plant.volts_per_speed * speed)
    if plant.drive == mp.DUTY:
        add("supply_voltage_V", "V", plant.volts_per_command * recorded.commanded())
    if plant.drive in (mp.DUTY, mp.VOLTAGE, mp.CURRENT):
        add("torque_constant_Nm_per_A", "G", drive)
    if rig.has("gear"):
        add("motor_viscous_Nms_per_rad", "G", -plant.damping * speed)
    if recorded.machine.elastic:
        deflection = s["spring_deflection_rad"]
        add("spring_stiffness_Nm_per_rad", "S", recorded.machine.stiffness * deflection)
    if not recorded.load.is_held and rig.has("load"):
        add("load_mass_kg", "L", gravity)
        slope = -plant.gravity * np.cos(angle + plant.gravity_offset)
        add("gravity_angle_offset_rad", "L", slope)
        add("load_viscous_Nms_per_rad", "L", -plant.load_damping * load_speed)
    if found.in_contact.any():
        inside = found.in_contact.astype(float)
        depth = inside * (angle - plant.contact_angle)
        add("contact_stiffness_Nm_per_rad", "L", -plant.contact_stiffness * depth)
        add("contact_damping_Nms_per_rad", "L", -plant.contact_damping * inside * load_speed)
        add("contact_angle_rad", "L", plant.contact_stiffness * inside)
    return acting
