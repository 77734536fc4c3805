"""A recording made ready for replays: its inputs, and the state that it starts from."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.engines.fixed_step.replay import Numbers, Replay
from rsea_core.engines.fixed_step.step_length import STEP_PER_MODE, longest_step_s
from rsea_core.machine.inputs import Inputs
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import noise_floor
from rsea_core.recordings.initial_speed import start_speeds
from rsea_core.recordings.recording import Recording

FINEST = 4.0  # so much shorter a stiff machine's steps may be: work is bounded


def prepare(model: ActuatorModel, r: Recording, *, step_s: float | None) -> tuple[Replay, Numbers]:
    """The replay of a recording and the nominal machine's numbers for it."""
    more = {}
    if "drive_enabled" in r and r.command_name is not None:
        more["drive_enabled"] = r["drive_enabled"]
    if "supply_V" in r and r.command_name == "duty":
        more["supply_V"] = r["supply_V"]
    inputs = r.inputs()
    start = _start(model, r, inputs)
    if not r.initial_rest:
        ratio = model.rig.gear_ratio or 1.0
        speeds = start_speeds(r, ratio, noise_floor(model.rig, r))
        more["initial_speeds_rad_per_s"] = tuple(each.speed for each in speeds)
    replay = Replay.of(start, step_s=step_s, **more)
    numbers = replay.numbers(model)
    if step_s is not None:
        stable = longest_step_s(numbers.plant, numbers.spring, numbers.fx) / STEP_PER_MODE
        if stable < step_s:  # a spring as stiff as a gear's: a longer step leaves all numbers
            stable = max(stable, step_s / FINEST)
            replay = Replay.of(start, step_s=stable, **more)
    return replay, numbers


def start_std(r: Recording, ratio: float, floors: Mapping[str, float]) -> NDArray:
    """Standard deviations (5,) of a start in motion, as `Windows.motion`."""
    motor, load = start_speeds(r, ratio, floors)
    at_load = floors.get("load_angle_rad", floors.get("motor_angle_rad", 0.0) / ratio)
    at_wheel = floors["motor_angle_rad"] / ratio if "motor_angle_rad" in floors else at_load
    return np.array([0.0, at_wheel, motor.std / ratio, at_load, load.std])


def _start(model: ActuatorModel, r: Recording, inputs: Inputs) -> Inputs:
    """The start of a machine some of whose angles are not read: those that go with the rest."""
    ratio = model.rig.gear_ratio or 1.0
    if "motor_angle_rad" not in r and "load_angle_rad" in r:
        return replace(inputs, initial_motor_angle_rad=ratio * r.first("load_angle_rad"))
    return inputs
