"""A law that gains in few stretches of rows is removed, unless whole recordings show it too."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify.law_search import pruning
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.pruning import without_weak_end
from rsea_core.identify.multistep.criteria import KEPT_RATIO, UNEVEN_GAIN


def step(key, *, gain=40.0 * UNEVEN_GAIN, ratio=0.95 * KEPT_RATIO):
    law = SimpleNamespace(key=key, only=None, unknowns=(SimpleNamespace(scale=1.0),))
    return SimpleNamespace(law=law, gain=gain, ratio=ratio)


def found(*steps, whole=None):
    """What windows found, and the law that alone explains most of whole recordings."""
    by_whole_runs = None if whole is None else SimpleNamespace(steps=[step(whole)])
    estimator = SimpleNamespace(problem=SimpleNamespace(nominals=()), fit=fit)
    best = fit(SimpleNamespace(laws=tuple(s.law for s in steps)), np.zeros(len(steps)))
    return Found(problem=None, base_estimator=None, base=None, estimator=estimator, best=best,
                 horizon=None, steps=list(steps), by_whole_runs=by_whole_runs)  # fmt: skip


def fit(hypothesis, x, iterations=0):
    return SimpleNamespace(hypothesis=hypothesis, x=x)


@pytest.fixture(autouse=True)
def fits_stay(monkeypatch):
    monkeypatch.setattr(pruning, "settled", lambda estimator, fit, once: (estimator, fit))


def test_a_law_that_gains_unevenly_is_refused():
    windows = found(step("sensor-delay"))
    without_weak_end(windows)
    assert windows.steps == []
    assert windows.refused.law.key == "sensor-delay"


def test_a_law_that_whole_recordings_show_too_stays():
    windows = found(step("sensor-delay"), whole="sensor-delay")
    without_weak_end(windows)
    assert [s.law.key for s in windows.steps] == ["sensor-delay"]
    assert windows.refused is None


@pytest.mark.parametrize(
    "steps",
    [
        [step("load-friction")],
        [step("sensor-delay", gain=0.9 * UNEVEN_GAIN)],
        [step("sensor-delay", ratio=2.0 * KEPT_RATIO), step("load-friction")],
    ],
    ids=["another law", "little gain", "a further law"],
)
def test_whole_recordings_keep_no_other_law(steps):
    windows = found(*steps, whole="sensor-delay")
    without_weak_end(windows)
    assert windows.refused is steps[-1]
