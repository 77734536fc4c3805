"""The engine's error over whole recordings is not mistaken for missing physics."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.load_friction import LoadFriction
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.law_search.search import begun
from rsea_core.identify.multistep.criteria import SOUND
from rsea_core.identify.multistep.experiment import EngineSteps
from rsea_core.identify.multistep.horizons import in_steps
from rsea_core.identify.multistep.tracks import prepared
from rsea_core.identify.whole_runs.parameters_alone import (
    found_sound,
    parameters_alone,
    step_error,
)
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.whole_runs import searched_axis

NOISE_rad = 1e-6


@pytest.fixture(scope="module")
def precise(tmp_path_factory):
    """Whole recordings of an axis that is read to a microradian, in steps of a whole row."""
    given = axis_recording(seed=3)
    command = given["current_command_A"]
    inputs = Inputs(time_s=given.time_s, current_command_A=command, load=Load(kind="free"))
    angle = Replay.of(inputs, step_s=1e-4).run(ActuatorModel(axis_rig()))[:, 0]
    angle = angle + NOISE_rad * np.random.default_rng(2).standard_normal(len(angle))
    recording = replace(given, columns={**given.columns, "motor_angle_rad": angle})
    _, own, plain = searched_axis(tmp_path_factory.mktemp("axis"), recording)
    own = own.having(
        [prepared(t, noise=replace(t.noise, readings=0.0 * t.noise.readings + NOISE_rad))
         for t in own.tracks]
    )  # fmt: skip
    return in_steps(own, EngineSteps(per_cycle=2.0)), plain


def test_steps_are_shortened_until_they_no_longer_cause_the_misfit(precise):
    own, plain = precise
    lines = []
    finer, fit, left = parameters_alone(own, plain, lines.append)
    coarse = own.problem.steps.fineness
    assert finer.problem.steps.fineness < coarse, lines
    assert left < SOUND
    assert any("half of the engine's step" in line for line in lines)
    half = in_steps(
        finer, finer.problem.steps._replace(fineness=0.5 * finer.problem.steps.fineness)
    )
    assert step_error(finer, half, fit) < step_error(own, finer, fit)


def test_recordings_may_have_different_readings(tmp_path):
    given, other = (axis_recording(seed=s) for s in (3, 4))
    both = {**other.columns, "load_angle_rad": other["motor_angle_rad"]}
    _, own, plain = searched_axis(tmp_path, given, replace(other, columns=both))
    half = in_steps(own, own.problem.steps._replace(fineness=0.5))
    assert 0.0 < step_error(own, half, plain) < 1.0


@pytest.mark.parametrize(("friction_Nm", "sound"), [(0.0, True), (0.06, False)])
def test_a_brief_look_knows_that_parameters_alone_leave_nothing_but_noise(
    tmp_path, friction_Nm, sound
):
    case = axis_case(
        tmp_path, axis_recording(LoadFriction(coulomb_Nm=friction_Nm), seed=1), rig=axis_rig()
    )
    found = begun(case, None, lambda text: None, quick=True)
    assert found_sound(found, lambda text: None).sound is sound
    unpredictable = replace(found, base_horizon=0.5)
    assert found_sound(unpredictable, lambda text: None) is unpredictable
