"""A wrong unit is no finding where a complete model, its sensor right, predicts the reading."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify.window_findings import stands
from rsea_core.recordings.finding import Finding, Kind

UNIT = Finding(kind=Kind.UNIT, text="", file="rec1.csv", column="current_A")


def confirmed(finding, *, complete=True, error=1.0, sensor=None):
    """Whether a finding stands beside a model whose errors have so many deviations."""
    recorded = SimpleNamespace(recording=SimpleNamespace(file="rec1.csv"), channels=("current_A",))
    noise = error * np.random.default_rng(1).normal(size=(1, 1000, 1))
    track = SimpleNamespace(experiment=recorded)
    return stands(finding, [track], [noise], complete=complete, wrong_sensors={sensor})


def test_a_complete_model_that_predicts_the_column_refutes_a_wrong_unit():
    assert not confirmed(UNIT)


@pytest.mark.parametrize(
    "other", [{"complete": False}, {"error": 3.0}, {"sensor": "current_A"}], ids=str
)
def test_a_wrong_unit_stands_where_no_model_explains_the_reading(other):
    assert confirmed(UNIT, **other)


def test_a_wrong_unit_of_a_recording_that_was_not_fitted_stands():
    assert confirmed(Finding(kind=Kind.UNIT, text="", file="rec9.csv", column="current_A"))


@pytest.mark.parametrize("error", [1.0, 10.0])
def test_a_row_stands_out_only_where_the_model_misses_it(error):
    spike = Finding(kind=Kind.SPIKE, text="", file="rec1.csv", column="current_A")
    assert confirmed(spike, error=error) == (error > 5.0)
