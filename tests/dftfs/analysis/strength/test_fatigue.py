"""Fatigue lives and factors are those of worked textbook examples.

Sources: Shigley's Mechanical Engineering Design, 9th ed., example 6-9; Dowling,
Mechanical Behavior of Materials, 4th ed., 9.7.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dftfs.analysis.strength.fatigue import (
    LoadBlock,
    damage,
    goodman_amplitude_Pa,
    sn_line,
    static_share,
    swt_amplitude_Pa,
)
from dftfs.errors import DesignError


def line():
    return sn_line(
        ultimate_Pa=400e6, fatigue_Pa=100e6, fatigue_cycles=5e8, stress_ratio=-1.0, factor=0.8
    )


def test_line_runs_through_its_two_points_and_miner_adds_up():
    found = line()
    assert found.cycles(0.9 * 400e6) == pytest.approx(1e3)
    assert found.cycles(80e6) == pytest.approx(5e8)
    assert damage([80e6, 360e6], [5e7, 100], found) == pytest.approx(0.1 + 0.1)
    assert damage([0.0], [1e9], found) == 0.0


def test_a_strong_alloy_keeps_less_than_nine_tenths_at_a_thousand_cycles():
    """Shigley, 9th ed., example 6-2: 90 kpsi, f = 0.86 by Fig. 6-18; 200 kpsi is its end, 0.77."""
    kpsi = 6.894757e6
    assert static_share(90 * kpsi) == pytest.approx(0.86, abs=0.005)
    assert static_share(200 * kpsi) == pytest.approx(0.77, abs=0.005)
    # by hand: Su 900, sF 1245, Se' 450 MPa; b = -lg(2.7667) / lg(2e6) = -0.07014
    assert static_share(900e6) == pytest.approx(1245 / 900 * 2000**-0.07014, rel=1e-4)
    assert static_share(60 * kpsi) == 0.9
    weaker = sn_line(
        ultimate_Pa=900e6, fatigue_Pa=300e6, fatigue_cycles=1e7, stress_ratio=-1.0, factor=1.0
    )
    assert weaker.amplitude_Pa(1e3) == pytest.approx(730.5e6, rel=1e-3)
    assert weaker.amplitude_Pa(1e7) == pytest.approx(300e6)


def test_mean_stress_rules_agree_fully_reversed_and_differ_in_pulsating_load():
    assert goodman_amplitude_Pa(-100e6, 100e6, 500e6) == pytest.approx(100e6)
    assert swt_amplitude_Pa(-100e6, 100e6) == pytest.approx(100e6)
    assert goodman_amplitude_Pa(0, 200e6, 500e6) == pytest.approx(125e6)
    assert swt_amplitude_Pa(0, 200e6) == pytest.approx(2**0.5 * 100e6)
    assert swt_amplitude_Pa(-200e6, 0) == 0.0


def test_strength_at_a_pulsating_ratio_is_brought_to_fully_reversed():
    found = sn_line(
        ultimate_Pa=500e6, fatigue_Pa=100e6, fatigue_cycles=5e8, stress_ratio=0.0, factor=1.0
    )
    assert found.cycles(125e6) == pytest.approx(5e8)


@given(st.floats(-200e6, 200e6), st.floats(1e6, 200e6), st.floats(1e5, 50e6))
def test_a_wider_or_higher_cycle_never_does_less(low, span, more):
    for rule in (lambda a, b: goodman_amplitude_Pa(a, b, 900e6), swt_amplitude_Pa):
        base = rule(low, low + span)
        assert rule(low, low + span + more) >= base - 1e-6
        assert rule(low + more, low + span + more) >= base - 1e-6


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ({"low_Nm": 5, "high_Nm": 1, "cycles": 1}, "low must not be above"),
        ({"low_Nm": 0, "high_Nm": 1, "cycles": 0}, "cycles = 0 must be above 0"),
    ],
)
def test_a_load_block_out_of_order_is_refused(block, message):
    with pytest.raises(DesignError, match=message):
        LoadBlock(**block)
