"""A torque that acts once must stand out in windows, where an unknown torque acts all the time."""

from types import SimpleNamespace

import pytest

from rsea_core.identify.multistep.criteria import PULSE_IN_WINDOWS
from rsea_core.identify.whole_runs import search
from rsea_core.identify.whole_runs.search import WholeSearch

LASTING, PULSE = SimpleNamespace(key="friction", only=None), SimpleNamespace(key="pulse", only=1)


@pytest.mark.parametrize(("law", "ratio", "kept"), [
    (PULSE, 0.5 * PULSE_IN_WINDOWS, False),
    (PULSE, 2.0 * PULSE_IN_WINDOWS, True),
    (LASTING, 0.0, True),
])  # fmt: skip
def test_only_a_pulse_must_stand_out_in_windows(monkeypatch, law, ratio, kept):
    """Rows unseen do not tell whether a torque acted once."""
    monkeypatch.setattr(search, "without", lambda own, fit, law: SimpleNamespace())
    monkeypatch.setattr(search, "needed", lambda own, fit, law, less: (True, 9.0))
    begun = SimpleNamespace(
        own=None, fit=None, taken=[law], ratios={}, ratio_in_windows=lambda less: ratio
    )
    WholeSearch.predict(begun, lambda text: None)
    assert begun.taken == ([law] if kept else [])
    assert begun.ratios[law.key] == (9.0 if law is LASTING else ratio)
