"""Simulation: a model, its inputs, and what the compiled loop makes of them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.integrator as integrator
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
import rsea_core.machine.quantities as q
from rsea_core.effects.sensor_reading import controller_sensors
from rsea_core.engines.event_driven.energy_balance import energy_ledger, memory_signals
from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.engines.linear.linearise import step_length_s
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.simulation.trajectory import Trajectory

MAX_STEPS = 2_000_000_000


def simulate(model: ActuatorModel, inputs: Inputs, *, step_s: float | None = None) -> Trajectory:
    """What the machine does under given inputs.

    Parameters
    ----------
    step_s : float or None
        Longest integration step; rows are divided into equal steps no longer than it. None
        takes what the fastest mode allows (half its time constant: errors below 1e-9 Nm on
        the bench). Results at rows do not otherwise depend on it.

    Returns
    -------
    Trajectory
        One row for each row of the inputs.

    Raises
    ------
    RigError, InputError
        If the rig lacks a value, the inputs do not fit it, or the step is too long.
    SimulationError
        If the states leave the range of numbers.
    """
    rows = inputs.time_s.size
    reference = np.zeros((rows, 3))
    if inputs.command_name is not None:
        reference[:, 0] = getattr(inputs, inputs.command_name)
    return run_sampled(
        model,
        command_name=inputs.command_name,
        load=inputs.load,
        time_s=inputs.time_s,
        controller=playback(),
        parameters=np.zeros(1),
        state=np.zeros(1),
        reference=reference,
        load_angle_rad=inputs.load_angle_rad,
        initial_angles_rad=(inputs.initial_motor_angle_rad, inputs.initial_load_angle_rad),
        step_s=step_s,
    )


def run_sampled(
    model: ActuatorModel,
    *,
    command_name: str | None,
    load: Load,
    time_s: NDArray,
    controller,
    parameters: NDArray,
    state: NDArray,
    reference: NDArray,
    load_angle_rad: ArrayLike | None = None,
    initial_angles_rad: tuple[float, float] = (0.0, 0.0),
    rows_per_sample: int = 1,
    delay_samples: int = 0,
    command_limit: float = np.inf,
    step_s: float | None = None,
    reference_name: str | None = None,
) -> Trajectory:
    """Run a compiled controller (`kernel.CONTROLLER`) on a model.

    Parameters
    ----------
    reference : (n, 3) array
        What the controller is given each row, with its first two time derivatives.
    rows_per_sample : int
        Rows between two actions of the controller; its command is held in between.
    reference_name : str or None
        Column under which the trajectory keeps the reference; None: it does not.
    delay_samples : int
        0, or 1 where a command acts one sample after the readings it was computed from.

    Raises
    ------
    RigError, InputError, SimulationError
        As `simulate`.
    """
    plant, spring = model.plant(command_name, load), model.spring_table(load)
    fx = model.effects(command_name, load)
    held = np.full(time_s.size, initial_angles_rad[1])
    velocity = np.zeros(time_s.size)
    if load_angle_rad is not None:
        held = np.array(load_angle_rad, dtype=float)
        velocity = np.gradient(held, time_s, edge_order=2 if time_s.size > 2 else 1)
    schedule = integrator.Schedule(
        time=np.array(time_s),
        steps=_steps(time_s, step_length_s(plant, spring, fx, step_s)),
        reference=np.ascontiguousarray(reference),
        load_angle=held,
        load_velocity=velocity,
        rows_per_sample=rows_per_sample,
        delay_samples=delay_samples,
        command_limit=float(command_limit),
    )
    y = np.zeros(k.N_Y)
    y[k.TW], y[k.TL] = q.motion_to_output(initial_angles_rad[0], plant.gear_ratio), held[0]
    log = np.zeros((time_s.size, k.N_LOG))
    memory = np.zeros((time_s.size if fx[e.MEMORY] != 0.0 else 0, k.N_Y))
    status, row = integrator.run(
        plant,
        spring.regions,
        fx,
        controller,
        integrator.Control(np.array(parameters), np.array(state)),
        schedule,
        controller_sensors(model.terms, time_s.size),
        integrator.Record(y, log, memory),
    )
    _require_done(status, float(time_s[row]))
    followed = None if reference_name is None else read_only(np.array(reference[:, 0]))
    return Trajectory(
        model=model,
        load=load,
        command_name=command_name,
        reference=followed,
        reference_name=reference_name,
        time_s=read_only(np.array(time_s)),
        **(_signals(plant, log) | memory_signals(fx, memory, model.terms)),
        energy=energy_ledger(plant, spring, fx, log, memory),
        spring_valid_range_rad=(spring.valid_low_rad, spring.valid_high_rad),
    )


def _steps(time_s: NDArray, longest_s: float) -> NDArray:
    """Integration steps within each row."""
    steps = np.maximum(np.ceil(np.diff(time_s) / longest_s - 1e-9), 1.0)
    if steps.sum() > MAX_STEPS:
        raise InputError(
            f"{steps.sum():.3g} integration steps of {longest_s:.3g} s are more than"
            f" {MAX_STEPS:.0e}: shorten the simulation or leave the fastest mode out of the rig"
        )
    return steps.astype(np.int64)


def _require_done(status: int, time_s: float) -> None:
    if status == integrator.NOT_FINITE:
        raise SimulationError(
            f"the states left the range of numbers at t = {time_s:.6g} s: is the loop unstable,"
            " or a value out by orders of magnitude?"
        )
    if status == integrator.TOO_MANY_SWITCHES:
        raise SimulationError(
            f"more than {integrator.MAX_SWITCHES_PER_ROW} switches of current limit, contact or"
            f" friction within the row at t = {time_s:.6g} s: shorten the rows or soften the"
            " contact"
        )


def _signals(plant: mp.Plant, log: NDArray) -> dict[str, NDArray]:
    def column(index: int) -> NDArray:
        return read_only(np.ascontiguousarray(log[:, index]))

    ratio = plant.gear_ratio
    wheel, speed = column(k.TW), column(k.WW)
    return {
        "command": column(k.LOG_COMMAND),
        "unsaturated_command": column(k.LOG_UNSATURATED),
        "motor_angle_rad": read_only(q.motion_to_motor(wheel, ratio)),
        "motor_velocity_rad_per_s": read_only(q.motion_to_motor(speed, ratio)),
        "load_angle_rad": column(k.TL),
        "load_velocity_rad_per_s": column(k.WL),
        "current_A": column(k.IM),
        "torque_Nm": column(k.LOG_TORQUE),
        "encoder_motor_angle_rad": column(k.LOG_READ_MOTOR),
        "encoder_load_angle_rad": column(k.LOG_READ_LOAD),
        "current_limited_s": column(k.LOG_INTEGRALS + k.LIMITED_TIME),
        "contact_s": column(k.LOG_INTEGRALS + k.CONTACT_TIME),
        "wheel_stuck_s": column(k.LOG_INTEGRALS + k.WHEEL_STUCK_TIME),
        "load_stuck_s": column(k.LOG_INTEGRALS + k.LOAD_STUCK_TIME),
        "wheel_angle_rad": wheel,
        "wheel_velocity_rad_per_s": speed,
    }
