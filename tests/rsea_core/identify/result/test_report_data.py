"""A diagnosis of recordings holds all that its report needs."""

from copy import copy
from dataclasses import asdict, replace

import numpy as np
import pytest

from dftfs.report.diagnosis.page import DiagnosisPage, page_from
from dftfs.report.diagnosis.render import render_diagnosis
from rsea_core.effects.registry import GearFriction
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.experiment.experiment_file import as_entry, as_page, experiment_of
from rsea_core.identify.result.report_data import report_data
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.bench_recordings import WITHOUT_ANCHORS, multisine, recorded
from tests.cases.diagnosis_page import example_page

TIME = np.arange(1500) * 2e-3


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory):
    recordings = []
    duties = (multisine(TIME), 0.12 * np.sin(4.4 * TIME), 0.1 * np.sin(6.0 * TIME))
    for k, duty in enumerate(duties):
        role = "validation" if k == 2 else "identification"
        _, columns = recorded(
            ActuatorModel(WITHOUT_ANCHORS, (GearFriction(coulomb_Nm=0.03),)), TIME, Load(),
            sensors=("current_A", "torque_Nm"), seed=k, duty=duty,
        )  # fmt: skip
        recordings.append(
            Recording(file=f"rec{k}.csv", role=role, columns=columns, sample_time_s=2e-3)
        )
    folder = tmp_path_factory.mktemp("case")
    return diagnose(
        Case(name="dry", folder=folder, rig=WITHOUT_ANCHORS, recordings=tuple(recordings)),
        quick=True,
    )


@pytest.fixture(scope="module")
def shown(diagnosis):
    return report_data(diagnosis, command="dftfs diagnose dry", seconds=1.0)


def test_account_is_a_page_and_the_page_a_report(shown):
    page = page_from(shown)
    assert isinstance(page, DiagnosisPage)
    html = render_diagnosis(page)
    assert page.headline in html
    assert 'id="fig-port-torques"' in html


def test_report_data_of_a_brief_look_make_a_page_and_state_what_is_left_out(diagnosis):
    brief = report_data(diagnosis, quick=True)
    html = render_diagnosis(page_from(brief))
    assert 'id="fig-port-torques"' not in html
    assert "run without --quick" in html
    assert brief["comparisons"]


def test_account_names_the_place_and_shows_held_out_recordings_first(shown, diagnosis):
    assert shown["subsystem"] == diagnosis.document["location"]["subsystem"] == "gear"
    assert max(shown["shares"], key=shown["shares"].get) == "gear"
    assert shown["comparisons"][0]["role"] == "validation"
    first = shown["comparisons"][0]
    assert first["nrmse_after"] < first["nrmse_parameters_only"] < first["nrmse_before"]
    assert any("gear's" in line for line in shown["signatures"])


def test_ranked_explanations_have_the_choice_and_parameters_alone(shown):
    names = [row["name"] for row in shown["ladder"]]
    chosen = [row for row in shown["ladder"] if row["chosen"]]
    assert "parameters only" in names
    assert len(chosen) == 1
    assert chosen[0]["gain"] == max(row["gain"] for row in shown["ladder"])


def test_alternatives_are_the_ranked_explanations_seen_from_the_choice(shown, diagnosis):
    effect = diagnosis.document["effects"][0]
    listed = effect["alternatives"]
    behind = [a["delta_score"] for a in listed]
    assert 4 <= len(listed) <= 8
    assert behind == sorted(behind)
    assert {a["name"] for a in listed}.isdisjoint({effect["name"]})
    assert {bool(a.get("screened")) for a in listed} == {True, False}
    rows = {row["name"]: row for row in shown["ladder"]}
    chosen = rows[effect["name"]]
    assert rows["parameters only"]["gain"] == pytest.approx(0.0, abs=1e-9)
    met = [a for a in listed if a["name"] in rows]
    assert len(met) > 2
    for a in met:
        row = rows[a["name"]]
        assert chosen["gain"] - row["gain"] == pytest.approx(a["delta_score"], abs=0.06)
        assert row["se"] == pytest.approx(a["se"], abs=0.06)
        assert row["note"].endswith("not fitted") == bool(a.get("screened"))


def test_two_fits_make_an_experiment_that_a_bench_can_run(diagnosis):
    conclusion = diagnosis.conclusion
    found = experiment_of(conclusion, (conclusion.fit, conclusion.search.parameters))
    entry, page = as_entry(found), as_page(found)
    assert entry["predicted_separation"] > 3.0
    assert np.abs(found.columns["duty"]).max() <= 1.0
    assert page["command"].shape == page["time_s"].shape == page["predicted"][0].shape
    assert as_entry(None) is as_page(None) is None


def test_page_of_plain_data_is_the_page_that_made_it():
    page = example_page()
    again = page_from(asdict(page))
    assert again.effects == page.effects
    assert again.scores == page.scores
    assert np.array_equal(again.state_map.level, page.state_map.level, equal_nan=True)
    with pytest.raises(TypeError):
        page_from(asdict(page) | {"surprise": 1})


def test_the_law_found_is_drawn_with_a_band_that_holds_the_truth(diagnosis, shown):
    (law,) = shown["laws"]
    assert law["title"] == "Friction of motor and gear"
    rig, found = diagnosis.conclusion.case.rig, diagnosis.conclusion.nominal
    damping = rig.gear_ratio**2 * found["motor_viscous_Nms_per_rad"]
    damping += rig.output_viscous_Nms_per_rad or 0.0
    fast = law["x"] > 0.5 * law["x"].max()
    truth = 0.03 * rig.gear_ratio + damping * law["x"]
    assert law["found"][fast] == pytest.approx(truth[fast], rel=0.03)
    assert np.all(law["low"] <= law["found"])
    assert np.all(law["found"] <= law["high"])
    assert np.all(law["nominal"][fast] < 0.5 * law["found"][fast])


def linear_page(diagnosis, **changes) -> dict:
    conclusion = copy(diagnosis.conclusion)
    case = conclusion.case
    conclusion.case = replace(case, rig=replace(case.rig, axis="linear", **changes))
    return report_data(replace(diagnosis, conclusion=conclusion), quick=True)


def units_of(page: dict) -> dict[str, str]:
    signals = {row["signal"]: row["unit"] for row in page["comparisons"] + page["scores"]}
    return signals | {row["name"]: row["unit"] for row in page["parameters"]}


def test_units_of_a_linear_machine_are_metres_and_newtons(diagnosis):
    page = linear_page(diagnosis, gear_ratio=1.0)
    units = set(units_of(page).values())
    assert {"N", "A", "m"} <= units
    assert not any("Nm" in unit or "rad" in unit or "m^2" in unit for unit in units)
    assert all("Nm" not in law["y_label"] for law in page["laws"])


def test_the_motor_of_a_screw_turns_in_radians(diagnosis):
    page = linear_page(diagnosis)
    units = units_of(page)
    assert units["motor_angle_rad"] == "rad"
    assert units["load_angle_rad"] == "m"
    assert units["torque_constant_Nm_per_A"] == "Nm/A"
    assert all("Nm" not in law["y_label"] for law in page["laws"])
