"""One call diagnoses a spring, a map of steady speeds or a machine, as the command does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rsea_core
from rsea_core.effects.registry import GearFriction, SpringCurve
from rsea_core.identify.diagnose import TERMS_UNUSED, is_bench
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.spring_bench.diagnose import SpringConclusion
from rsea_core.identify.steady_map.diagnose import MapDiagnosis
from rsea_core.terms.known import KnownTerm
from tests.cases.one_axis import axis_recording, axis_rig
from tests.cases.planted import planted
from tests.cases.recorded import map_case, write_rig

HERE = "rsea_core.identify.diagnose"
ASKED = SimpleNamespace(
    sentence="lock the load", load=SimpleNamespace(kind="locked"), extra_mass_kg=0.0,
    best=SimpleNamespace(sensors=("current_A",), separation=np.float64(7.0)), rivals=("a", "b"),
    columns={"time_s": np.arange(3.0)}, recording_toml=lambda file: f'file = "{file}"\n',
)  # fmt: skip
CURVE = SpringCurve(deflection_rad=np.linspace(-1, 1, 5), torque_Nm=np.linspace(-50, 50, 5))


def machine_case() -> rsea_core.Case:
    """A moving machine, whose search is replaced by `found_of`."""
    recordings = (axis_recording(seed=1),)
    return rsea_core.Case(name="axis", folder=None, rig=axis_rig(), recordings=recordings)


@pytest.fixture
def searched(monkeypatch):
    """Replaces search and experiment: what the search was asked, and sets its verdict."""
    asked = {"verdict": "missing-physics"}

    def search(case, **given):
        document = {
            "verdict": asked["verdict"],
            "next_experiment": None,
            "error": np.float64("nan"),
        }
        conclusion = SimpleNamespace(
            verdict=asked["verdict"],
            residual=SimpleNamespace(columns=lambda: {"time_s": np.arange(2.0)}),
        )
        asked["given"] = given
        model = FoundModel(rig=case.rig, contact={}, laws=())
        return Diagnosis(document=document, model=model, conclusion=conclusion)

    monkeypatch.setattr(f"{HERE}.diagnose_machine", search)
    monkeypatch.setattr(f"{HERE}.decisive_experiment", lambda conclusion: ASKED)
    return asked


def test_a_machine_gets_its_next_experiment_its_unexplained_signal_and_plain_data(searched):
    found = rsea_core.diagnose(machine_case(), thorough=True)
    assert searched["given"].items() >= {"quick": False, "thorough": True}.items()
    assert found.next_experiment == {
        "sentence": "lock the load", "load": "locked", "extra_mass_kg": 0.0, "file": "next.csv",
        "sensors": ["current_A"], "rivals": ["a", "b"], "predicted_separation": 7.0,
    }  # fmt: skip
    assert found.next_columns is ASKED.columns
    assert found.next_recording == 'file = "next.csv"\n'
    assert list(found.unexplained_columns) == ["time_s"]
    assert found.document["error"] is None
    assert type(found.next_experiment["predicted_separation"]) is float


@pytest.mark.parametrize(
    ("quick", "wanted", "verdict", "there"),
    [
        (True, None, "missing-physics", False),
        (True, None, "insufficient-data", True),
        (True, True, "missing-physics", True),
        (False, False, "missing-physics", False),
        (False, False, "insufficient-data", True),
    ],
)
def test_the_next_experiment_can_be_left_out_but_not_where_the_verdict_rests_on_it(
    searched, quick, wanted, verdict, there
):
    searched["verdict"] = verdict
    found = rsea_core.diagnose(machine_case(), quick=quick, next_experiment=wanted)
    assert (found.next_experiment is not None) == (found.next_columns is not None) == there


def test_what_excludes_one_another_or_fits_no_machine_is_refused():
    with pytest.raises(rsea_core.InputError, match="exclude one another"):
        rsea_core.diagnose(machine_case(), quick=True, thorough=True)
    with pytest.raises(rsea_core.InputError, match="design: axis is no spring test bench"):
        rsea_core.diagnose(machine_case(), design=CURVE)


def test_a_folder_with_a_map_of_steady_speeds_is_diagnosed_by_its_path(tmp_path):
    map_case(tmp_path, lambda speed, load: np.sign(speed) * 3e-4 + 5e-6 * speed)
    found = rsea_core.diagnose(str(tmp_path))
    assert isinstance(found.conclusion, MapDiagnosis)
    assert [effect["name"] for effect in found.effects] == ["gear-friction"]
    (term,) = found.actuator_model().terms
    assert term.coulomb_Nm == pytest.approx(3e-4, rel=0.05)
    assert found.report_data()["verdict"] == found.verdict == "missing-physics"
    assert [f.sentence() for f in found.findings] == found.document["findings"]


def test_a_map_of_steady_speeds_says_that_it_does_not_use_stated_terms(tmp_path):
    case = map_case(tmp_path, lambda speed, load: np.sign(speed) * 3e-4 + 5e-6 * speed)
    known = KnownTerm(term=GearFriction(coulomb_Nm=3e-4), stated=("coulomb_Nm",))
    found = rsea_core.diagnose(replace(case, known=(known,)))
    assert found.findings[-1] is TERMS_UNUSED
    assert "[[term]] tables of the rig file are not used" in found.document["findings"][-1]


def test_a_case_with_stated_terms_is_of_no_bench(tmp_path):
    case = planted(tmp_path).case
    known = KnownTerm(term=GearFriction(coulomb_Nm=3e-4), stated=("coulomb_Nm",))
    assert is_bench(case)
    assert not is_bench(replace(case, known=(known,)))


def test_a_spring_is_compared_with_its_design_and_predicted(tmp_path):
    turned = 0.1 * np.sin(np.linspace(0.0, 4.0 * np.pi, 400))
    torque = 55.0 * turned + 0.01 * np.random.default_rng(3).standard_normal(400)
    rows = np.column_stack([np.arange(400), turned, torque])
    header = "time_s,spring_deflection_rad,torque_Nm"
    np.savetxt(tmp_path / "loop.csv", rows, delimiter=",", header=header, comments="")
    recording = {"file": "loop.csv", "load": "imposed"}
    write_rig(
        tmp_path, {"name": "bench", "torque_sensor_noise_Nm": 0.01}, ["spring"],
        [recording | {"role": "identification", "quasi_static": True}],
    )  # fmt: skip
    found = rsea_core.diagnose(tmp_path, design=CURVE)
    assert isinstance(found.conclusion, SpringConclusion)
    assert found.verdict == "parameters-only"
    assert found.document["spring"]["thickness_ratio"] == pytest.approx(1.1 ** (1 / 3), abs=2e-3)
    assert found.report_data()["summary"] == found.summary
    time = np.arange(100) * 1e-2
    test = np.column_stack([time, 0.05 * np.sin(time)])
    header = "time_s,spring_deflection_rad"
    np.savetxt(tmp_path / "input.csv", test, delimiter=",", header=header, comments="")
    (tmp_path / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "imposed"\n')
    torque = rsea_core.predict(found, tmp_path)["input.csv"]["torque_Nm"]
    assert torque == pytest.approx(55.0 * test[:, 1], abs=0.01)
    path = found.save(tmp_path / "found")["model.toml"]
    again = rsea_core.predict(path, tmp_path)["input.csv"]["torque_Nm"]
    assert np.array_equal(torque, again)
