"""A requirement is judged by the number that was computed, with its error bar and its range."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from dftfs.analysis.strength.checks import yield_check
from dftfs.analysis.study.run import beyond_for, study_checks
from dftfs.design import Requirements, load_design
from tests.cases.report_study import small_study

ALUMINIUM = replace(load_design("al1").material, yield_strength_Pa=276e6)
NEEDS = Requirements(operating_torque_Nm=10.0, min_safety_factor_yield=1.2)


def judged(stress_MPa, **more):
    (check,) = yield_check(
        NEEDS,
        stress_per_torque={"winding": stress_MPa * 1e5, "unwinding": 1e5},
        material=ALUMINIUM,
        model="3D hex20",
        **more,
    )
    return check


def test_the_stress_passes_only_with_its_mesh_bar():
    assert judged(225.0).passed  # 276 over 225 is 1.227
    assert judged(225.0, bar=0.01).passed
    check = judged(225.0, bar=0.04)
    assert check.passed is False
    assert check.value == pytest.approx(276 / 225)
    assert "225 +- 9 MPa winding" in check.line()
    assert check.line().endswith("[3D hex20]")
    assert judged(225.0, bar=float("inf")).passed is None
    assert judged(300.0, bar=float("inf")).passed is False


def test_what_is_extrapolated_says_so_and_passes_nothing():
    check = judged(225.0, reached_Nm={"winding": 8.0, "unwinding": 10.0})
    assert check.passed is None
    assert "extrapolated in proportion from 8 Nm" in check.note
    assert judged(300.0, reached_Nm={"winding": 8.0, "unwinding": 10.0}).passed is False
    assert judged(225.0, reached_Nm={"winding": 10.0, "unwinding": 8.0}).passed


def test_a_curve_goes_on_past_its_contacts_to_the_operating_torque():
    touches = {
        "winding": SimpleNamespace(torque_Nm=24.26),
        "unwinding": SimpleNamespace(torque_Nm=-13.38),
    }
    free = SimpleNamespace(contact_onset=touches)
    assert beyond_for(free, 15.2, 1.0) == pytest.approx(1.02 * 15.2 / 13.38)
    assert beyond_for(free, 10.0, 1.0) == 1.0
    assert beyond_for(free, None, 1.3) == 1.3
    assert beyond_for(free, 100.0, 1.0) == 3.0


@pytest.mark.needs_cad
def test_every_line_of_a_study_names_its_model(tmp_path):
    solid = replace(small_study(tmp_path).solid, model="3D hex20")
    checks = study_checks(load_design("al1"), solid)
    assert len(checks) == 4
    assert {check.source for check in checks} == {"3D hex20"}
