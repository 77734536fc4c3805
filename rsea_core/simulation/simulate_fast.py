"""Simulation by the fixed-step engine, with the event-driven engine's columns."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.effects.layout as e
from rsea_core.effects.registry import DriveThermal
from rsea_core.effects.sensor_reading import reading
from rsea_core.engines.fixed_step.layout import (
    CASE_RISE,
    CHANNELS,
    GEAR_SPEED,
    LINK,
    LINK_SPEED,
    LOAD,
    LOAD_SPEED,
    OUTPUT,
    OUTPUT_SPEED,
    READ_CURRENT,
    WINDING_RISE,
)
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.machine.inputs import Inputs
from rsea_core.machine.plant import Plant
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.simulation.trajectory import FIXED_STEP, Trajectory


def simulate_stepping(
    model: ActuatorModel,
    inputs: Inputs,
    *,
    supply_V: ArrayLike | None = None,
    drive_enabled: ArrayLike | None = None,
    step_s: float | None = None,
) -> Trajectory:
    """What the machine does under given inputs, by fixed steps of second order.

    About seventy times faster than `simulate` on the bench rig (10 s of 1 ms rows, with and
    without friction), and good to a tenth of an encoder count there at the default step
    (`benchmarks/step_halving.py`).

    Parameters
    ----------
    supply_V, drive_enabled : (n,) array or None
        As `Replay`.
    step_s : float or None
        Longest step; None: 1 ms, or less where a stiff mode needs it.

    Returns
    -------
    Trajectory
        Without an energy ledger. Times at limits, in contact and stuck are counted by rows.

    Raises
    ------
    RigError, TermError, InputError, SimulationError
        As `simulate`.
    """
    replay = Replay.of(inputs, supply_V=supply_V, drive_enabled=drive_enabled, step_s=step_s)
    numbers = replay.numbers(model)
    rows, states = replay.run(numbers, with_states=True)
    found = {name: read_only(np.ascontiguousarray(rows[:, j])) for j, name in enumerate(CHANNELS)}
    del found["case_rise_K"]
    plant, time, name = model.plant(inputs.command_name, inputs.load), inputs.time_s, None
    command = np.zeros(time.size)
    if inputs.command_name is not None:
        name = inputs.command_name
        command = np.array(getattr(inputs, name))
    return Trajectory(
        model=model,
        load=inputs.load,
        command_name=name,
        reference=None,
        reference_name=None,
        time_s=time,
        command=read_only(command),
        unsaturated_command=read_only(command.copy()),
        **found,
        encoder_motor_angle_rad=_read(model, time, found, "motor", plant.motor_count),
        encoder_load_angle_rad=_read(model, time, found, "load", plant.load_count),
        **_held_times(plant, numbers.fx, time, states, rows[:, READ_CURRENT]),
        engine=FIXED_STEP,
        engine_reason="fixed steps were asked for",
        ledger=None,
        **_behind(model, numbers.fx, states),
        spring_valid_range_rad=model.spring_table(inputs.load)[1:],
    )


def _held_times(plant: Plant, fx: NDArray, time: NDArray, states: NDArray, current: NDArray):
    """Times at the current limit, in contact and stuck so far, by rows."""
    return {
        "current_limited_s": _time(time, np.abs(current) >= plant.current_limit),
        "contact_s": _time(time, states[:, LOAD] > plant.contact_angle),
        "wheel_stuck_s": _time(time, (fx[e.WHEEL_DRY] != 0.0) & (states[:, GEAR_SPEED] == 0.0)),
        "load_stuck_s": _time(time, (fx[e.LOAD_DRY] != 0.0) & (states[:, LOAD_SPEED] == 0.0)),
    }


def _behind(model: ActuatorModel, fx: NDArray, states: NDArray) -> dict[str, NDArray]:
    """Columns of the wheel, and those that only some terms have."""
    found = {
        "wheel_angle_rad": _kept(states[:, OUTPUT]),
        "wheel_velocity_rad_per_s": _kept(states[:, OUTPUT_SPEED]),
    }
    if fx[e.LINK_STIFFNESS] > 0.0:
        found["link_angle_rad"] = _kept(states[:, LINK])
        found["link_velocity_rad_per_s"] = _kept(states[:, LINK_SPEED])
    for term in model.terms:
        if isinstance(term, DriveThermal):
            found["winding_temperature_C"] = _kept(states[:, WINDING_RISE] + term.ambient_C)
            found["case_temperature_C"] = _kept(states[:, CASE_RISE] + term.ambient_C)
    return found


def _kept(column: NDArray) -> NDArray:
    return read_only(np.ascontiguousarray(column))


def _read(model: ActuatorModel, time_s: NDArray, found, part: str, count: float) -> NDArray:
    column, rates = f"{part}_angle_rad", found[f"{part}_velocity_rad_per_s"]
    angle = reading(model.terms, column, time_s, found[column], rates)
    return read_only(np.floor(angle / count) * count if count > 0.0 else angle)


def _time(time_s: NDArray, holds: NDArray) -> NDArray:
    """Time so far in which something held, by the rows at whose both ends it does."""
    both = holds[1:] & holds[:-1]
    return read_only(np.concatenate(([0.0], np.cumsum(np.diff(time_s) * both))))
