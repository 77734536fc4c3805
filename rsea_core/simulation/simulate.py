"""Simulation: a model, its inputs, and what the engine that fits makes of them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.machine.inputs import Inputs
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.sampled_run import MachineNumbers, SampledRun, solve
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
        lead = MachineNumbers.of(model, inputs.command_name, inputs.load).plant.goal_rate_s
        if lead > 0.0:
            goal, times = reference[:, 0].copy(), inputs.time_s
            reference[1:, 0] += lead * np.diff(goal) / np.diff(times)
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
    time_s: NDArray,
    load_angle_rad: ArrayLike | None = None,
    engine: str | None = None,
    **given,
) -> Trajectory:
    """Run a compiled controller (`states.CONTROLLER`) on a model.

    Parameters
    ----------
    load_angle_rad : (n,) array or None
        Of a load whose motion is given; between rows it is a cubic.
    **given
        As `SampledRun`; needed are command_name, load, controller, parameters, state, reference.
    engine
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
    return solve(SampledRun(model=model, time_s=time_s, held=held, **given), engine)
