"""A second opinion replaces the first only where it predicts clearly better, or is complete."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rsea_core.identify.window_diagnosis as window_diagnosis
from rsea_core.effects.drive_saturation import DriveSaturation
from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.gear_load_friction import GearLoadFriction
from rsea_core.identify.diagnose import (
    WINDOWS_FAILED,
    diagnose_machine,
    held_out_error,
    with_disagreement,
)
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.window_diagnosis import CURTAILED
from rsea_core.recordings.case import Case, read_case
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.places import SHARED_DATA

HERE = "rsea_core.identify.diagnose"


def opinion(error: float, alone: float):
    """A diagnosis whose free runs err by a share of the recordings' spread."""
    rows = [
        {"role": role, "nrmse_after": error, "nrmse_parameters_only": alone}
        for role in ("identification", "validation")
    ]
    fit = SimpleNamespace(hypothesis=SimpleNamespace(laws=()))
    found = SimpleNamespace(complete=False, explained=0.0, best=fit)
    doubtful = SimpleNamespace(found=found, estimator=SimpleNamespace(tempering=0.1))
    document = {"verdict": "missing-physics", "fit": {"recordings": rows}, "effects": []}
    return SimpleNamespace(document=document, conclusion=doubtful, findings=())


@pytest.mark.parametrize(
    ("windows", "free_runs", "taken"),
    [
        (0.30, 0.10, "free runs"),
        (0.30, 0.29, "windows"),  # no clear difference
        (4.20, 2.10, "windows"),  # both err by more than the machine moves
    ],
)
def test_free_runs_replace_windows_only_where_they_predict_clearly_better(
    tmp_path, monkeypatch, windows, free_runs, taken
):
    """A floating stage: of two useless free runs the better one renamed its motor's cogging."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    held_out = replace(case.recordings[0], role="validation")
    case = replace(case, recordings=(*case.recordings, held_out))
    alone = 10.0 * max(windows, free_runs)
    opinions = {"windows": opinion(windows, alone), "free runs": opinion(free_runs, alone)}
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: opinions["windows"])
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinions["free runs"])
    assert diagnose_machine(case) is opinions[taken]


@pytest.mark.parametrize(("confidence", "is_noted"), [(0.45, True), (0.1, False)])
def test_a_law_that_the_model_taken_does_not_have_is_noted_and_a_nearest_name_is_not(
    confidence, is_noted
):
    cogging = {"name": "motor-cogging", "law": "84 per turn", "confidence": confidence}
    document = {"effects": [], "findings": []}
    taken = Diagnosis(document=document, model=None, conclusion=None)
    other = replace(taken, document=document | {"effects": [cogging]})
    noted = " ".join(with_disagreement(taken, other).document["findings"])
    assert ("motor-cogging (84 per turn)" in noted) is is_noted


def test_of_two_unexplained_opinions_of_a_bench_the_one_that_predicts_better_stands(
    tmp_path, monkeypatch
):
    """Free runs claim nothing either, and do not model the errors of a log."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    held_out = replace(case.recordings[0], role="validation")
    case = replace(case, recordings=(*case.recordings, held_out))
    opinions = {"windows": opinion(0.1, 0.1), "free runs": opinion(0.3, 1.0)}
    for each in opinions.values():
        each.document["verdict"] = "unexplained"
    monkeypatch.setattr(f"{HERE}.is_bench", lambda case: True)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: opinions["windows"])
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinions["free runs"])
    assert diagnose_machine(case) is opinions["windows"]


@pytest.mark.parametrize(
    ("verdict", "share", "error", "taken"),
    [
        ("missing-physics", 0.1, 0.3, "free runs"),
        ("unexplained", 0.9, 0.3, "free runs"),
        ("missing-physics", 0.9, 0.3, "windows"),
        ("unexplained", 0.9, 0.015, "windows"),  # predicted well
    ],
)
def test_a_second_opinion_is_asked_where_innovations_depend_or_nothing_is_named(
    tmp_path, monkeypatch, verdict, share, error, taken
):
    """A servo with a pendulum (Duclusaud et al. 2025) is diagnosed by it in both cases."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    held_out = replace(case.recordings[0], role="validation")
    case = replace(case, recordings=(*case.recordings, held_out))
    opinions = {"windows": opinion(error, 3.0), "free runs": opinion(0.5 * error, 3.0)}
    opinions["windows"].document["verdict"] = verdict
    opinions["windows"].conclusion.estimator.tempering = share
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: opinions["windows"])
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinions["free runs"])
    assert diagnose_machine(case) is opinions[taken]


def test_a_second_opinion_is_asked_where_the_work_of_the_first_was_limited_too(
    tmp_path, monkeypatch
):
    """EMPS needs it (the last test)."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    held_out = replace(case.recordings[0], role="validation")
    case = replace(case, recordings=(*case.recordings, held_out))
    first = opinion(0.3, 3.0)
    first.findings, second = (CURTAILED,), opinion(0.1, 3.0)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: first)
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: second)
    assert diagnose_machine(case) is second


def test_free_runs_have_no_opinion_on_laws_found_with_a_gear_mesh(tmp_path, monkeypatch):
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    held_out = replace(case.recordings[0], role="validation")
    case = replace(case, recordings=(*case.recordings, held_out))
    first = opinion(0.3, 3.0)
    first.conclusion.found.best.hypothesis.laws = (SimpleNamespace(effect=MESH_DAMPER),)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: first)
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinion(0.1, 3.0))
    assert diagnose_machine(case) is first


@pytest.mark.parametrize(
    ("explained", "complete", "taken"),
    [
        (0.74, True, "windows"),
        (0.74, False, "free runs"),
        (0.99, True, "free runs"),  # windows are not asked
    ],
)
def test_complete_laws_of_windows_replace_those_of_free_runs_that_leave_much(
    tmp_path, monkeypatch, explained, complete, taken
):
    """An offset of a current was claimed in place of dry friction (blind case 10001/013)."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    opinions = {name: opinion(0.1, 1.0) for name in ("windows", "free runs")}
    opinions["windows"].conclusion.found.complete = complete
    opinions["free runs"].conclusion.explained_excess = lambda: explained
    monkeypatch.setattr(f"{HERE}.is_bench", lambda case: True)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: opinions["windows"])
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinions["free runs"])
    assert diagnose_machine(case) is opinions[taken]


@pytest.mark.parametrize(
    ("name", "complete", "taken"),
    [
        ("load-unbalance", True, "windows"),
        ("sensor-offset", True, "windows"),
        ("sensor-offset", False, "free runs"),
        ("load-friction", True, "free runs"),  # windows are not asked
    ],
)
def test_complete_laws_of_windows_replace_what_acts_like_an_amplifier_offset(
    tmp_path, monkeypatch, name, complete, taken
):
    """A finger's offset was named an eccentric mass, beside both right laws (27001/n18)."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    opinions = {name: opinion(0.1, 1.0) for name in ("windows", "free runs")}
    opinions["windows"].conclusion.found.complete = complete
    opinions["free runs"].conclusion.explained_excess = lambda: 0.99
    opinions["free runs"].document["effects"].append({"name": name})
    monkeypatch.setattr(f"{HERE}.is_bench", lambda case: True)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", lambda *_, **__: opinions["windows"])
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: opinions["free runs"])
    assert diagnose_machine(case) is opinions[taken]


def test_a_search_in_windows_that_fails_is_stated_with_what_free_runs_found(tmp_path, monkeypatch):
    def fails(*_, **__):
        raise np.linalg.LinAlgError("Singular matrix")

    runs = Diagnosis(document={"findings": ["first"]}, model=None, conclusion=None)
    monkeypatch.setattr(f"{HERE}.diagnose_windows", fails)
    monkeypatch.setattr(f"{HERE}.diagnose_free_runs", lambda *_, **__: runs)
    found = diagnose_machine(axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig()))
    assert found.document["findings"] == ["first", WINDOWS_FAILED.sentence()]
    assert found.findings == (WINDOWS_FAILED,)
    assert runs.document["findings"] == ["first"]


def recorded(name: str) -> Case:
    """A case of real recordings."""
    folder = SHARED_DATA / "real" / name
    if not folder.exists():
        pytest.skip("the recordings are not part of this repository")
    return read_case(folder)


def test_a_servo_has_friction_that_grows_with_its_load_and_a_weak_supply(monkeypatch):
    """Servo and pendulum (Duclusaud et al. 2025), with little work for windows.

    Their better models have friction that depends on the load, too.
    """
    monkeypatch.setattr(window_diagnosis, "MOST_WORK", 2e7)
    found = diagnose_machine(recorded("bam-xl330"))
    assert found.document["verdict"] == "missing-physics"
    named = {effect["name"] for effect in found.document["effects"] if effect["confidence"] > 0.5}
    assert named == {GearLoadFriction.effect, DriveSaturation.effect}
    assert held_out_error(found) < 0.2


def test_dry_friction_of_a_ball_screw_is_named_and_predicts_the_record_held_out(monkeypatch):
    """EMPS (Janot, Gautier & Brunot 2019): an axis without a restoring force, simulated for 25 s.

    Free runs find the friction even if the search in windows has little work.
    """
    monkeypatch.setattr(window_diagnosis, "MOST_WORK", 2e7)
    found = diagnose_machine(recorded("emps"))
    assert found.document["verdict"] == "missing-physics"
    (effect,) = found.document["effects"]
    assert effect["name"] == GearFriction.effect
    level = effect["parameters"]["coulomb_Nm"]
    assert abs(level["value"] - 20.4) < 2.0 * level["std"]  # 20.4 N: Janot et al.
    assert held_out_error(found) < 0.1
