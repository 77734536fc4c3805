"""Fuzzy inference agrees with brute force and scikit-fuzzy; faults of rule tables are found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rsea_core.control.fuzzy.inference import FuzzySystem
from rsea_core.control.fuzzy.rule_base_checks import FAULT, check_rule_base, surface
from rsea_core.control.fuzzy.thesis_rules import corrected_rules, printed_rules, torque_table
from rsea_core.control.laws.fuzzy_torque import FuzzyTorque
from rsea_core.errors import ControllerError

Y = np.linspace(0.0, 100.0, 40_001)


def triangle(left: float, peak: float, right: float, x, *, shoulder: bool):
    x = np.asarray(x, dtype=float)
    outside = 1.0 if shoulder else 0.0
    up = np.full(x.shape, outside) if left == peak else (x - left) / (peak - left)
    down = np.full(x.shape, outside) if peak == right else (right - x) / (right - peak)
    return np.clip(np.where(x < peak, up, np.where(x > peak, down, 1.0)), 0.0, 1.0)


def brute_force(system: FuzzySystem, x: float, y: float) -> float:
    """Centre of gravity on a fine grid, from the definition."""
    total = np.zeros_like(Y)
    for first, row in zip(system.first, system.rules, strict=True):
        for second, rule in zip(system.second, row, strict=True):
            height = min(
                float(triangle(*first, x, shoulder=True)),
                float(triangle(*second, y, shoulder=True)),
            )
            clipped = np.minimum(height, triangle(*system.output[rule], Y, shoulder=False))
            summed = system.aggregation == "sum"
            total = total + clipped if summed else np.maximum(total, clipped)
    return float((Y * total).sum() / total.sum()) if total.sum() > 0.0 else system.neutral


@pytest.mark.parametrize("aggregation", ["sum", "max"])
@pytest.mark.parametrize("name", ["printed", "corrected"])
@settings(max_examples=25, deadline=None)
@given(x=st.floats(-10.0, 10.0), y=st.floats(-7.0, 7.0))
def test_inference_equals_brute_force_within_1e_4_of_the_range(name, aggregation, x, y):
    system = torque_table(name, aggregation)
    assert float(system.evaluate(x, y)) == pytest.approx(brute_force(system, x, y), abs=0.01)


def test_max_aggregation_agrees_with_scikit_fuzzy():
    skfuzzy = pytest.importorskip("skfuzzy", reason="scikit-fuzzy is the oracle here")
    system = torque_table("corrected", "max")
    universe = np.linspace(0.0, 100.0, 10_001)
    for x, y in ((0.0, 0.0), (-0.4, 0.3), (2.7, -1.1), (5.5, 3.8), (-7.0, 0.2)):
        envelope = np.zeros_like(universe)
        for i, first in enumerate(system.first):
            for j, second in enumerate(system.second):
                degrees = (
                    float(skfuzzy.trimf(np.array([value]), corners)[0])
                    for value, corners in ((x, first), (y, second))
                )
                height = min(degrees)
                member = skfuzzy.trimf(universe, system.output[system.rules[i, j]])
                envelope = np.fmax(envelope, np.fmin(height, member))
        expected = skfuzzy.defuzz(universe, envelope, "centroid")
        assert float(system.evaluate(x, y)) == pytest.approx(expected, abs=1e-3 * 100.0)


def test_the_printed_table_pushes_by_2_67_percent_at_rest_and_is_31_percent_from_odd():
    """Specification, actuator.md 2.1 item 3."""
    printed = torque_table("printed")
    assert float(printed.evaluate(0.0, 0.0)) == pytest.approx(52.667, abs=1e-3)
    u = surface(printed, 181).answer
    assert np.abs(u + u[::-1, ::-1] - 100.0).max() == pytest.approx(31.0, abs=0.5)
    assert (u.min(), u.max()) == pytest.approx((6.667, 93.333), abs=1e-3)


def test_the_corrected_table_is_odd_unbiased_and_always_fires():
    system = torque_table("corrected")
    u = surface(system, 181).answer
    assert float(system.evaluate(0.0, 0.0)) == pytest.approx(50.0, abs=1e-12)
    assert np.abs(u + u[::-1, ::-1] - 100.0).max() < 1e-11
    assert system.fires(np.linspace(-1e3, 1e3, 2001), 0.0).min() > 0.0
    assert np.array_equal(corrected_rules() + corrected_rules()[::-1, ::-1], np.full((7, 7), 6))
    for axis in (0, 1):
        assert (np.diff(corrected_rules(), axis=axis) <= 0).all()


def test_exchanging_two_columns_and_one_level_repairs_the_printed_rules():
    swapped = printed_rules()[:, [0, 1, 2, 4, 3, 5, 6]]
    assert (np.diff(swapped, axis=1) <= 0).all()
    uneven = swapped + swapped[::-1, ::-1] != 6
    assert uneven.sum() // 2 == 7
    assert np.abs(corrected_rules() - swapped).max() == 1


def test_the_faults_of_the_printed_table_are_found():
    found = {f.check: f for f in check_rule_base(torque_table("printed")) if f.severity == FAULT}
    assert found["rules symmetric"].value == 10
    assert found["rules monotone"].value == 4
    assert found["bias"].value == pytest.approx(2.667, abs=1e-3)
    assert {"order", "coverage", "sets symmetric"} <= found.keys()


def test_no_fault_is_found_in_the_corrected_table():
    assert not [f for f in check_rule_base(torque_table("corrected")) if f.severity == FAULT]


def test_a_set_out_of_order_is_refused_by_name():
    good = torque_table("corrected")
    bad = np.array(good.first)
    bad[4] = 0.0, -1.5, 3.0
    with pytest.raises(ControllerError, match=r"set PS \[0 -1.5 3\] is out of order"):
        FuzzySystem(
            first=bad, second=good.second, output=good.output, rules=good.rules, names=good.names
        )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"table": "mine"}, "table = 'mine' must be one of"),
        ({"aggregation": "mean"}, "aggregation = 'mean'"),
        ({"error_scale_per_Nm": -1.0}, "error_scale_per_Nm = -1.0 must be finite"),
        ({"friction_smoothing_rad_per_s": 0.0}, "friction_smoothing_rad_per_s"),
    ],
)
def test_unusable_values_of_the_fuzzy_loop_are_refused(values, message):
    with pytest.raises(ControllerError, match=message):
        FuzzyTorque(**values)
