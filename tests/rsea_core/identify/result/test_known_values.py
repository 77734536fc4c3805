"""Friction that a rig file states is no missing physics: the diagnosis corrects its value."""

import tomllib
from dataclasses import replace

import pytest

from rsea_core.effects.registry import DriveDelay, LoadFriction
from rsea_core.identify.diagnose import Diagnosis, diagnose
from rsea_core.terms.known import KnownTerm
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

TRUE_Nm = 0.15
ROWS = 400
KEY = "load-friction.coulomb_Nm"


def stated(coulomb_Nm: float) -> KnownTerm:
    return KnownTerm(term=LoadFriction(coulomb_Nm=coulomb_Nm), stated=("coulomb_Nm",))


def diagnosed(folder, *known: KnownTerm, delay_rows: float = 0.0) -> Diagnosis:
    """Four seconds of an axis with dry friction, by a quick look."""
    r = axis_recording(LoadFriction(coulomb_Nm=TRUE_Nm), seed=1, delay_rows=delay_rows)
    r = replace(r, columns={name: values[:ROWS] for name, values in r.columns.items()})
    case = replace(axis_case(folder, r, rig=axis_rig()), known=known)
    return diagnose(case, quick=True, next_experiment=False)


def questions(found: Diagnosis) -> list[str]:
    return [f.text for f in found.findings if "is the file right?" in f.text]


def coulomb_of(found: Diagnosis) -> float:
    """Of the [[term]] of the model's file."""
    (term,) = tomllib.loads(found.model.to_toml())["term"]
    assert term["effect"] == "load-friction"
    return term["coulomb_Nm"]


def test_friction_stated_within_its_tolerance_is_no_effect_and_the_model_has_its_value(tmp_path):
    found = diagnosed(tmp_path, stated(0.17))
    assert (found.verdict, found.effects, questions(found)) == ("no-mismatch", [], [])
    row = found.document["parameters_corrected"][KEY]
    assert (row["from"], row["identifiable"]) == (0.17, True)
    assert row["to"] == coulomb_of(found) == pytest.approx(TRUE_Nm, rel=0.04)
    assert abs(row["to"] - TRUE_Nm) < 3.0 * row["std"] < 0.2 * TRUE_Nm


def test_friction_stated_three_times_too_small_is_another_value(tmp_path):
    found = diagnosed(tmp_path, stated(TRUE_Nm / 3.0))
    assert (found.verdict, found.effects, questions(found)) == ("parameters-only", [], [])
    assert coulomb_of(found) == pytest.approx(TRUE_Nm, rel=0.04)
    assert f"Moved most: {KEY} 0.05 -> 0.1" in found.summary


def test_a_value_beyond_three_tolerances_is_a_question_and_its_unit_is_the_terms(tmp_path):
    delay = KnownTerm(term=DriveDelay(delay_s=0.1 * ROW_s), stated=("delay_s",))
    found = diagnosed(tmp_path, stated(0.02), delay, delay_rows=1.0)
    assert found.verdict == "parameters-only"
    friction, late = sorted(questions(found), reverse=True)
    assert friction.startswith(f"{KEY} ended 4.0 of its tolerances from the rig file's value (0.02")
    assert late.startswith("drive-delay.delay_s ended 4.6 of its tolerances")
    units = {row["name"]: row["unit"] for row in found.report_data()["parameters"]}
    assert (units[KEY], units["drive-delay.delay_s"]) == ("Nm", "s")


def test_a_peak_at_rest_above_the_stated_level_is_found_and_takes_its_place(tmp_path):
    peak = LoadFriction(coulomb_Nm=TRUE_Nm, stribeck_rise=1.5, stribeck_velocity_rad_per_s=0.5)
    case = axis_case(tmp_path, axis_recording(peak, seed=1), rig=axis_rig())
    found = diagnose(replace(case, known=(stated(TRUE_Nm),)), next_experiment=False)
    (effect,) = found.effects
    assert (found.verdict, effect["name"]) == ("missing-physics", "load-friction")
    assert KEY not in found.document["parameters_corrected"]
    model = tomllib.loads(found.model.to_toml())
    assert "term" not in model
    values = next(w["values"] for w in model["law"] if w["effect"] == "load-friction")
    assert values["coulomb_Nm"] == pytest.approx(TRUE_Nm, rel=0.03)
    assert values["stribeck_rise"] == pytest.approx(1.5, rel=0.05)


@pytest.mark.parametrize("presliding_rad", [0.0, 0.02])
def test_friction_that_is_stated_by_its_level_holds_in_the_form_that_recordings_show(
    tmp_path, presliding_rad
):
    dry = LoadFriction(coulomb_Nm=TRUE_Nm, presliding_rad=presliding_rad)
    case = axis_case(tmp_path, axis_recording(dry, seed=1), rig=axis_rig())
    found = diagnose(replace(case, known=(stated(0.1),)), next_experiment=False)
    named = {effect["name"] for effect in found.effects}
    assert not named & {"load-friction", "gear-friction"}
    assert presliding_rad or found.verdict == "parameters-only"  # coarse steps made the elastic one
    (term,) = tomllib.loads(found.model.to_toml())["term"]
    assert term["coulomb_Nm"] == pytest.approx(TRUE_Nm, rel=0.03)
    assert term["presliding_rad"] == pytest.approx(presliding_rad, rel=0.05)
