"""What a search keeps of laws that it does not take."""

import re

import rsea_core.identify.law_search.search as search
from rsea_core.effects.load_friction import LoadFriction
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


def test_the_laws_that_gain_most_are_the_nearest_names_also_if_they_gain_unevenly(
    tmp_path, monkeypatch
):
    """Screening is linear and orders laws otherwise than their fits do."""
    monkeypatch.setattr(search, "confirmed", lambda own, base, fit: 0.0)
    case = axis_case(tmp_path, axis_recording(LoadFriction(coulomb_Nm=0.1), seed=3), rig=axis_rig())
    texts: list[str] = []
    found = search.begun(case, None, texts.append, quick=True)
    laws = [law for law in search.laws_of(found) if "friction" in law.effect]
    search.add_all(found, laws, texts.append, quick=True)
    refused = [m[1] for text in texts if (m := re.match(r" *best (.*): gain", text))]
    assert found.steps == []
    assert len(refused) > 1
    assert [c.law.key for c in found.screened[: len(refused)]] == refused
    assert refused[0] in ("gear-friction/coulomb", "load-friction/coulomb")
