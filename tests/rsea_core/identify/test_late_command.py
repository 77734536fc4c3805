"""A delay of the command is known to half a row where readings do not tell how commands move."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify import window_fit
from rsea_core.identify.diagnose import diagnose
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

LATE_ROWS = 2.3


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    recording = axis_recording(seed=1, delay_rows=LATE_ROWS)
    return axis_case(tmp_path_factory.mktemp("late"), recording, rig=axis_rig())


def delay_of(case) -> dict:
    (effect,) = diagnose(case).document["effects"]
    assert effect["name"] == "drive-delay"
    return effect["parameters"]["delay_s"]


def test_a_held_command_that_a_linear_one_does_not_imitate_has_a_delay_of_small_deviation(case):
    delay = delay_of(case)
    assert delay["value"] == pytest.approx(LATE_ROWS * ROW_s, rel=0.005)
    assert delay["std"] < 0.01 * ROW_s


def test_a_delay_is_stated_to_half_a_row_if_a_linear_command_is_as_likely(case, monkeypatch):
    as_likely = SimpleNamespace(cost=-np.inf)
    monkeypatch.setattr(window_fit, "with_best_delay", lambda own, h, x: as_likely)
    delay = delay_of(case)
    assert delay["value"] == pytest.approx(LATE_ROWS * ROW_s, rel=0.005)
    assert delay["std"] == pytest.approx(0.5 * ROW_s, rel=0.01)
