"""What limits torque tracking: every candidate with its number, and the one that binds."""

import math
from dataclasses import dataclass

import numpy as np

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.margins import linear_tracking
from rsea_core.engines.linear.linearise import LinearModel, linearise
from rsea_core.machine.quantities import count_angle_rad, motion_to_output
from rsea_core.machine.spring_table import SpringTable, spring_tangent_Nm_per_rad, spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.tracking_metrics import AngleMetrics, TrackingMetrics
from rsea_core.simulation.trajectory import Trajectory

SATURATED = 0.005  # share of time at a limit from which on it counts as binding


@dataclass(frozen=True, kw_only=True)
class TrackingLimits:
    """What stands between torque and reference.

    Attributes
    ----------
    binding : str
        "spring range", "current", "speed", "voltage", "loop", "encoder"; "angle" where an angle is
        followed and no limit binds.
    sentence : str
        The binding limit in words and numbers.
    share_command_limited, share_current_limited, share_outside_spring_range : float
        Of the time.
    torque_rate_needed_Nm_per_s : float
        Largest rate of the reference; 0 where an angle is followed.
    torque_rate_available_Nm_per_s : float or None
        The spring wound at the motor's no-load speed; None where no voltage drives it.
    encoder_step_Nm : float
        Torque that one load-encoder count stands for, K times the count.
    encoder_error_Nm, loop_error_Nm : float
        Root mean square errors: of reading the encoders that move in whole counts; of the
        linear loop at the reference's frequency, where it is a sine (0 otherwise).
    largest_amplitude_Nm : float or None
        Largest undistorted sine amplitude at the reference's frequency, the smallest of the
        three below. None where the reference is not a sine.
    largest_by_voltage_Nm, largest_by_current_Nm, largest_by_spring_Nm : float or None
        What the full command, the current limit and the spring's valid range allow; None where
        there is no such limit.
    """

    binding: str
    sentence: str
    share_command_limited: float
    share_current_limited: float
    share_outside_spring_range: float
    torque_rate_needed_Nm_per_s: float
    torque_rate_available_Nm_per_s: float | None
    encoder_step_Nm: float
    encoder_error_Nm: float
    loop_error_Nm: float
    largest_amplitude_Nm: float | None
    largest_by_voltage_Nm: float | None
    largest_by_current_Nm: float | None
    largest_by_spring_Nm: float | None


def tracking_limits(
    model: ActuatorModel,
    controller: Controller,
    reference: Reference | AngleReference,
    trajectory: Trajectory,
    metrics: TrackingMetrics | AngleMetrics,
) -> TrackingLimits:
    """Find what limits a simulated torque loop.

    Shares of time decide first: a limit that is met for 0.5 % of the time binds. Otherwise the
    larger of the linear loop's own error (gains, sampling, delay) and the encoders' does.
    Amplitudes are those of the machine linearised at rest, with the load it has.

    Raises
    ------
    RseaError
        If model, controller and load do not go together.
    """
    load, name = trajectory.load, trajectory.command_name
    plant, spring = model.plant(name, load), model.spring_table(load)
    rows = trajectory.time_s >= metrics.from_s
    span = trajectory.time_s[-1] - metrics.from_s
    held = trajectory.current_limited_s
    of_torque = reference.unit == "Nm"
    rates = reference.sample(trajectory.time_s[rows])[:, 1] if of_torque else np.zeros(1)
    stiffness = float(spring_tangent_Nm_per_rad(spring, 0.0))
    linear = linearise(model, command_name=name, load=load)
    counts = _counts(model)
    moving = (counts[0], 0.0 if load.is_held else counts[1])
    frequency = reference.frequency_Hz if of_torque and reference.kind == "sine" else None
    amplitudes = (np.inf, np.inf, np.inf)
    loop_error = 0.0
    if frequency is not None:
        limit = controller.compile(model, load).command_limit
        amplitudes = _largest(plant, spring, linear, frequency, limit)
        miss = abs(1.0 - linear_tracking(model, controller, load, frequency))
        loop_error = miss * abs(reference.amplitude_Nm) / math.sqrt(2.0)
    found = {
        "share_command_limited": float(trajectory.command_limited[rows].mean()),
        "share_current_limited": float((held[-1] - held[rows][0]) / span),
        "share_outside_spring_range": float(trajectory.outside_valid_range[rows].mean()),
        "torque_rate_needed_Nm_per_s": float(np.abs(rates).max()),
        "torque_rate_available_Nm_per_s": _available_rate(plant, stiffness, model),
        "encoder_step_Nm": stiffness * counts[1],
        "encoder_error_Nm": stiffness * math.hypot(*moving) / math.sqrt(12.0),
        "loop_error_Nm": loop_error,
        "largest_by_voltage_Nm": _finite(amplitudes[0]),
        "largest_by_current_Nm": _finite(amplitudes[1]),
        "largest_by_spring_Nm": _finite(amplitudes[2]),
        "largest_amplitude_Nm": _finite(min(amplitudes)),
    }
    binding, sentence = binding_limit(found, trajectory, reference, controller, metrics)
    return TrackingLimits(binding=binding, sentence=sentence, **found)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _counts(model: ActuatorModel) -> tuple[float, float]:
    """Encoder counts as angles at the output, motor side and load side."""
    rig = model.rig
    motor, load = rig.motor_encoder_counts_per_rev, rig.load_encoder_counts_per_rev
    return (
        0.0 if motor is None else motion_to_output(count_angle_rad(motor), rig.gear_ratio),
        0.0 if load is None else count_angle_rad(load),
    )


def _available_rate(plant: mp.Plant, stiffness: float, model: ActuatorModel) -> float | None:
    if plant.drive not in (mp.DUTY, mp.VOLTAGE) or model.rig.supply_voltage_V is None:
        return None
    return model.rig.supply_voltage_V / plant.volts_per_speed * stiffness


def _largest(
    plant: mp.Plant, spring: SpringTable, linear: LinearModel, frequency: float, limit: float
) -> tuple[float, float, float]:
    """Torque amplitudes that full command, current limit and spring allow; inf: no limit."""
    s = 2j * np.pi * frequency
    states = np.linalg.solve(s * np.eye(k.N_STATES) - linear.A, linear.b)
    torque = abs(linear.torque_row @ states)
    by_voltage, by_current = np.inf, torque * limit
    if plant.drive in (mp.DUTY, mp.VOLTAGE):
        current = abs(states[k.IM])
        if not plant.inductance > 0.0:
            volts = plant.volts_per_command - plant.volts_per_speed * states[k.WW]
            current = abs(volts) / plant.resistance
        by_voltage, by_current = torque * limit, torque / current * plant.current_limit
    ends = (spring.valid_low_rad, spring.valid_high_rad)
    known = [abs(float(spring_torque_Nm(spring, d))) for d in ends if np.isfinite(d)]
    return float(by_voltage), float(by_current), min(known, default=np.inf)


def binding_limit(found, trajectory, reference, controller, metrics) -> tuple[str, str]:
    """What binds, and the sentence that says so, from the figures of `TrackingLimits`."""
    rmse = metrics.sentence
    if found["share_outside_spring_range"] > 0.0:
        low, high = trajectory.spring_valid_range_rad
        return "spring range", (
            f"The spring is outside its valid range ({low:.3g}..{high:.3g} rad) for"
            f" {found['share_outside_spring_range']:.1%} of the time, first at"
            f" {trajectory.left_valid_range_s:.4g} s: torques beyond it are not vouched for."
        )
    if found["share_current_limited"] > SATURATED:
        return "current", (
            f"The current is at its limit of {trajectory.model.rig.current_limit_A:g} A for"
            f" {found['share_current_limited']:.1%} of the time; {rmse}."
        )
    if found["share_command_limited"] > SATURATED:
        needed, available = (
            found["torque_rate_needed_Nm_per_s"],
            found["torque_rate_available_Nm_per_s"],
        )
        text = (
            f"The {trajectory.command_name} is at its limit for"
            f" {found['share_command_limited']:.1%} of the time; {rmse}"
        )
        if available is not None and needed > available:
            return "speed", (
                f"{text}: the reference asks for {needed:.3g} Nm/s, the motor at its no-load"
                f" speed winds the spring by {available:.3g} Nm/s."
            )
        return "voltage", f"{text}."
    if reference.unit != "Nm":
        return "angle", f"No drive limit was reached; {rmse}."
    loop, encoder = found["loop_error_Nm"], found["encoder_error_Nm"]
    if loop >= encoder and controller.gain_varies:
        return "loop", (
            f"No drive limit was reached; {rmse}; the loop linear at rest would have {loop:.3g} Nm,"
            " but this law's gain varies with its error."
        )
    if loop >= encoder:
        return "loop", (
            f"No drive limit was reached; {rmse}, and the linear loop alone (gains, sampling every"
            f" {controller.sample_time_s:g} s, {controller.delay_samples} sample of delay) has"
            f" {loop:.3g} Nm."
        )
    return "encoder", (
        f"No drive limit was reached; {rmse}, and reading torque in encoder counts of"
        f" {found['encoder_step_Nm']:.3g} Nm explains {encoder:.3g} Nm, the linear loop"
        f" {loop:.2g} Nm."
    )
