"""Machines drawn from what a diagnosis leaves open scatter as its document states."""

import json

import numpy as np
import pytest

from rsea_core import ActuatorModel, Rig
from rsea_core.effects import GearFriction
from rsea_core.errors import RigError, RseaError
from rsea_core.model.model_file import write_model
from rsea_core.model.perturbed import Deviation, perturbed_models
from rsea_core.model.posterior import read_posterior
from rsea_core.scenarios.comparison_file import read_comparison

RIG = Rig.preset("rsea-bench")
MODEL = ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.02),))
R, K_T = RIG.terminal_resistance_ohm, RIG.torque_constant_Nm_per_A
COMPARISON = """
rig = "model.toml"
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 1.0
[task]
duration_s = 1.0
[tolerances]
diagnosis = "diagnosis.json"
motor_inertia_kgm2 = 0.1
[[controller]]
kind = "pid-torque"
"""


def diagnosis(folder, *, resistance=R, **more):
    def moved(value, std):
        return {"from": value, "to": value, "std": std, "identifiable": True}

    document = {
        "parameters_corrected": {
            "terminal_resistance_ohm": moved(resistance, 0.03 * R),
            "torque_constant_Nm_per_A": moved(K_T, 0.01 * K_T),
            "gravity_angle_offset_rad": moved(0.0, 0.01),
            "unknown_to_rigs": moved(1.0, 0.1),
        },
        "effects": [
            {"name": "gear-friction", "parameters": {
                "coulomb_Nm": {"value": 0.02, "std": 0.015, "unit": "Nm"},
                "peak_C": {"value": 3.0, "std": 1.0, "unit": "C"},
            }},
        ],
    }  # fmt: skip
    path = folder / "diagnosis.json"
    path.write_text(json.dumps(document | more), encoding="utf-8")
    return path


def test_every_value_scatters_by_its_own_deviation_and_what_cannot_be_is_drawn_again(tmp_path):
    found = read_posterior(diagnosis(tmp_path), MODEL)
    assert found.deviations["gear-friction.coulomb_Nm"] == 0.015
    assert set(found.held) == {"unknown_to_rigs", "gear-friction.peak_C"}
    spread = {key: Deviation(size=size) for key, size in found.deviations.items()}
    machines = perturbed_models(MODEL, 1500, 1, spread)
    for name, std in (("terminal_resistance_ohm", 0.03 * R), ("gravity_angle_offset_rad", 0.01)):
        drawn = np.array([getattr(m.rig, name) for m in machines])
        assert drawn.std() == pytest.approx(0.96 * std, rel=0.05)  # cut at two deviations
    friction = np.array([m.terms[0].coulomb_Nm for m in machines])
    assert friction.min() >= 0.0
    ratio = {m.rig.back_emf_constant_Vs_per_rad / m.rig.torque_constant_Nm_per_A for m in machines}
    assert np.ptp(list(ratio)) < 1e-12  # it has no spread of its own: it moves along


def test_a_comparison_takes_the_spreads_of_a_diagnosis_and_stated_ones(tmp_path):
    diagnosis(tmp_path)
    write_model(MODEL, tmp_path / "model.toml")
    path = tmp_path / "compare.toml"
    path.write_text(COMPARISON, encoding="utf-8")
    found = read_comparison(path)
    assert found.tolerances["terminal_resistance_ohm"] == Deviation(size=0.03 * R)
    assert found.tolerances["motor_inertia_kgm2"] == 0.1
    assert any("not varied" in note and "peak_C" in note for note in found.notes)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"resistance": 2.0 * R}, "it is of another machine"),
        ({"effects": 3}, "is not the diagnosis.json"),
        ({"effects": [1]}, "is not the diagnosis.json"),
        ({"parameters_corrected": {"terminal_resistance_ohm": 1.0}}, "is not the diagnosis.json"),
        ({"parameters_corrected": None}, "is not the diagnosis.json"),
    ],
)
def test_what_is_no_diagnosis_of_this_machine_is_refused(tmp_path, more, says):
    with pytest.raises(RigError, match=says):
        read_posterior(diagnosis(tmp_path, **more), MODEL)
    with pytest.raises(RseaError, match="cannot be read"):
        read_posterior(tmp_path / "none.json", MODEL)


def test_a_value_that_the_rig_file_stated_of_a_law_is_the_terms_parameter(tmp_path):
    known = {"from": 0.01, "to": 0.02, "std": 0.004, "identifiable": True}
    path = diagnosis(tmp_path, parameters_corrected={
        "gear-friction.coulomb_Nm": known, "load-friction.coulomb_Nm": known,
    }, effects=[])  # fmt: skip
    found = read_posterior(path, MODEL)
    assert found.deviations == {"gear-friction.coulomb_Nm": 0.004}
    assert found.held == ("load-friction.coulomb_Nm",)
