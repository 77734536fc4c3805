"""A scenario or comparison on a `model.toml` takes rig and effects from that file."""

import pytest

from rsea_core import Rig, Scenario
from rsea_core.effects.registry import DriveDelay, GearFriction, SpringCurve
from rsea_core.errors import ScenarioError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.model_file import write_model
from rsea_core.scenarios.comparison_file import read_comparison
from rsea_core.scenarios.scenario import run_scenario

TAIL = """
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 1.0
"""
SCENARIO = TAIL + '[controller]\nkind = "pid-torque"\n[simulation]\nduration_s = 1.5\n'
COMPARISON = TAIL + '[task]\nduration_s = 1.5\n[[controller]]\nkind = "pid-torque"\n'
TERMS = (GearFriction(coulomb_Nm=0.0123), DriveDelay(delay_s=0.002))


def file_on(folder, text, terms=TERMS, more=""):
    write_model(ActuatorModel(Rig.preset("rsea-bench"), terms), folder / "model.toml")
    path = folder / "experiment.toml"
    path.write_text('rig = "model.toml"\n' + text + more, encoding="utf-8")
    return path


def test_scenario_takes_rig_and_terms_of_a_model_file(tmp_path):
    scenario = Scenario.from_toml(file_on(tmp_path, SCENARIO))
    assert scenario.rig == Rig.preset("rsea-bench")
    assert scenario.terms == TERMS


def test_comparison_takes_rig_and_terms_of_a_model_file(tmp_path):
    model = read_comparison(file_on(tmp_path, COMPARISON)).task.model
    assert model.rig == Rig.preset("rsea-bench")
    assert tuple(model.terms) == TERMS


@pytest.mark.parametrize("text", [SCENARIO, COMPARISON])
def test_second_spring_next_to_that_of_a_model_file_is_refused(tmp_path, text):
    curve = SpringCurve(deflection_rad=[-0.3, 0.0, 0.3], torque_Nm=[-30.0, 0.0, 30.0])
    more = "[spring]\nstiffness_Nm_per_rad = 90.0\n"
    path = file_on(tmp_path, text, (curve,), more)
    read = Scenario.from_toml if text is SCENARIO else read_comparison
    with pytest.raises(ScenarioError, match=r"spring-curve of model.toml: give one of them"):
        read(path)


def test_the_rig_file_of_a_case_is_a_machine_with_the_physics_that_it_states(tmp_path):
    rig = Rig.preset("rsea-bench").to_toml()
    listed = '[[recording]]\nfile = "a.csv"\nload = "locked"\n'
    stated = '[[term]]\neffect = "gear-friction"\ncoulomb_Nm = 0.0123\ntolerance = 0.2\n'
    path = tmp_path / "experiment.toml"
    path.write_text('rig = "rig.toml"\n' + SCENARIO, encoding="utf-8")
    errors = []
    for terms in ("", stated):
        (tmp_path / "rig.toml").write_text(f"{rig}\n{terms}\n{listed}", encoding="utf-8")
        scenario = Scenario.from_toml(path)
        assert scenario.rig == Rig.preset("rsea-bench")
        errors.append(run_scenario(scenario).metrics.rmse_Nm)
    assert scenario.terms == (GearFriction(coulomb_Nm=0.0123),)
    assert errors[1] > 1.05 * errors[0]
