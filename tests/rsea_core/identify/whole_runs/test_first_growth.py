"""Complete laws of whole recordings, with the right timing, make other growths needless."""

from dataclasses import replace

import pytest

import rsea_core.identify.investigate as investigate_module
import rsea_core.identify.window_diagnosis as window_diagnosis
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.identify.investigate import investigate
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.multistep.command_timing import CommandTiming
from rsea_core.identify.whole_runs import complete
from rsea_core.identify.whole_runs.complete import begins_no_better, laws_added, of_first_growth
from rsea_core.recordings.case import Case
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

FRICTION_Nm = 0.05


@pytest.fixture
def grown(monkeypatch):
    """Growths from output errors, counted."""
    calls, plain = [], investigate_module.grown_again
    monkeypatch.setattr(
        investigate_module,
        "grown_again",
        lambda *given, **how: calls.append(1) or plain(*given, **how),
    )
    return calls


def axis(folder) -> Case:
    """An axis with friction that its rig file lacks, its command linear between rows."""
    recording = axis_recording(LoadFriction(coulomb_Nm=FRICTION_Nm), seed=1, linear=True)
    return axis_case(folder, recording, rig=axis_rig())


def assert_friction(found) -> None:
    assert found.complete
    assert found.problem.timing.linear
    assert [step.law.effect for step in found.steps] == [LoadFriction.effect]


def test_windows_are_grown_once_where_a_law_of_whole_recordings_is_complete(tmp_path, grown):
    assert_friction(investigate(axis(tmp_path)))
    assert not grown


def test_windows_are_grown_again_where_laws_were_found_with_a_wrong_timing(
    tmp_path, grown, monkeypatch
):
    """The first growth assumes held commands; its better timing is withheld here."""
    monkeypatch.setattr(investigate_module, "in_better_timing", lambda growth, *_: growth)
    assert_friction(investigate(axis(tmp_path)))
    assert grown


def test_complete_laws_are_searched_again_in_the_same_windows_where_another_timing_is_likelier(
    tmp_path, grown, monkeypatch
):
    def held(*given):
        linear = CommandTiming(linear=True)
        return of_first_growth(*given)._replace(timing=linear, doubted=True)

    monkeypatch.setattr(investigate_module, "of_first_growth", held)
    lines = []
    assert_friction(investigate(axis(tmp_path), say=lines.append))
    assert any("with commands at other times" in line for line in lines)
    assert not grown


def test_complete_laws_in_doubt_stand_where_another_growth_finds_none(tmp_path, grown, monkeypatch):
    ends = []

    def doubted(*given):
        end = of_first_growth(*given)
        ends.append(end.found)
        return end._replace(timing=None, doubted=True)

    def incomplete(found, search, say):
        return replace(found, complete=False, sound_below=0.0), None

    monkeypatch.setattr(investigate_module, "of_first_growth", doubted)
    monkeypatch.setattr(investigate_module, "concluded", incomplete)
    found = investigate(axis(tmp_path))
    assert_friction(found)
    assert grown
    assert found is ends[0]


def test_another_growth_gains_nothing_unless_whole_recordings_are_likelier_with_it(
    tmp_path, monkeypatch
):
    """Friction, which is missing, is the only law tried: all laws take longer."""
    monkeypatch.setattr(complete, "laws_of", lambda found: [
        law for law in laws_of(found) if law.effect == LoadFriction.effect
    ])  # fmt: skip
    case = axis(tmp_path)
    held, linear = (begun(case, CommandTiming(linear=each), print) for each in (False, True))
    _, search = laws_added(linear, print)
    assert begins_no_better(search, linear)
    assert begins_no_better(search, held)
    _, search = laws_added(held, print)
    assert not begins_no_better(search, linear)


def test_a_search_that_is_left_out_for_the_limit_of_work_is_stated(tmp_path, grown, monkeypatch):
    """Complete laws in doubt; without doubt nothing is left out and nothing stated."""
    monkeypatch.setattr(window_diagnosis, "MOST_WORK", 1.0)
    case = axis(tmp_path)
    assert window_diagnosis.CURTAILED not in window_diagnosis.diagnose_windows(case).findings

    def doubted(*given):
        return of_first_growth(*given)._replace(timing=None, doubted=True)

    monkeypatch.setattr(investigate_module, "of_first_growth", doubted)
    found = window_diagnosis.diagnose_windows(case)
    assert window_diagnosis.CURTAILED in found.findings
    assert found.document["effects"][0]["name"] == LoadFriction.effect
    assert not grown
