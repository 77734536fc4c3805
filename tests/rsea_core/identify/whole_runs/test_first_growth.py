"""Complete laws of whole recordings, with the right timing, make other growths needless."""

from dataclasses import replace

import pytest

import rsea_core.identify.investigate as investigate_module
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.identify.investigate import investigate
from rsea_core.identify.law_search.search import begun
from rsea_core.identify.whole_runs.complete import laws_added, of_first_growth
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


def test_complete_laws_in_doubt_stand_where_another_growth_finds_none(tmp_path, grown, monkeypatch):
    ends = []

    def doubted(*given):
        ends.append(of_first_growth(*given)[0])
        return ends[0], True

    def incomplete(found, search, say):
        return replace(found, complete=False, sound_below=0.0), None

    monkeypatch.setattr(investigate_module, "of_first_growth", doubted)
    monkeypatch.setattr(investigate_module, "concluded", incomplete)
    found = investigate(axis(tmp_path))
    assert_friction(found)
    assert grown
    assert found is ends[0]


def test_a_search_is_continued_from_another_growth_that_ends_alike(tmp_path):
    found = begun(axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig()), None, print)
    _, search = laws_added(found, print)
    again, same = laws_added(found, print, known=search)
    assert same is search
    assert same.found is again
    search.plain = replace(search.plain, x=search.plain.x + 1.0)
    assert laws_added(found, print, known=search)[1] is not search
