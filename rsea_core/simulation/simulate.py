"""Simulation: a model, its inputs, and what the engine that fits makes of them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.sampled_run import SampledRun, solve
from rsea_core.simulation.trajectory import Trajectory


def simulate(
    model: ActuatorModel,
    inputs: Inputs,
    *,
    step_s: float | None = None,
    engine: str | None = None,
) -> Trajectory:
    """What the machine does under given inputs.

    Parameters
    ----------
    step_s : float or None
        Longest step of the event-driven engine, which runs where it is given; rows are divided
        into equal steps no longer than it. None takes what the fastest mode allows (half its
        time constant: errors below 1e-9 Nm on the bench).
    engine : str or None
        "piecewise-linear": exact exponentials between events. "event-driven": order 8 with
        located events. None: the first where the machine is linear between events and rows are
        even, else the second. They agree within 1e-9 of a signal's span.

    Returns
    -------
    Trajectory
        One row for each row of the inputs; `engine` says what ran, `engine_reason` why.

    Raises
    ------
    RigError, InputError
        If the rig lacks a value, the inputs do not fit it, or the step is too long.
    SimulationError
        If the states leave the range of numbers, or the engine asked for cannot run the model.
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
        engine=engine,
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
    engine: str | None = None,
) -> Trajectory:
    """Run a compiled controller (`equations.CONTROLLER`) on a model.

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
    step_s, engine
        As `simulate`.

    Raises
    ------
    RigError, InputError, SimulationError
        As `simulate`.
    """
    held = None
    if load_angle_rad is not None:
        angle = np.array(load_angle_rad, dtype=float)
        held = angle, np.gradient(angle, time_s, edge_order=2 if time_s.size > 2 else 1)
    run = SampledRun(
        model=model,
        command_name=command_name,
        load=load,
        time_s=time_s,
        controller=controller,
        parameters=parameters,
        state=state,
        reference=reference,
        held=held,
        initial_angles_rad=initial_angles_rad,
        rows_per_sample=rows_per_sample,
        delay_samples=delay_samples,
        command_limit=command_limit,
        step_s=step_s,
        reference_name=reference_name,
    )
    return solve(run, engine)
