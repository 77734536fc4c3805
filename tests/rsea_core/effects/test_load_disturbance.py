"""An external torque with a linear rise agrees with scipy and closes the energy balance."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import LoadDisturbance
from rsea_core.errors import TermError

RIG = Rig.preset("rsea-bench")
START, END, PEAK = 0.0503, 0.4008, 1.5
TIME = 0.01 * np.arange(61)


def exact(rise):
    """Load angle (n,) under gravity, without command."""
    N, K_T = 60.0, 60.0 * 0.3056
    J, B = N**2 * 3.2e-4 + 2e-3, N**2 * 1e-4 + 0.02

    def slope(t, y, acts):
        i, wheel, w, load, v = y
        tau = 65.8 * (wheel - load)
        outside = PEAK * (min((t - START) / rise, 1.0) if rise else 1.0) if acts else 0.0
        falls = 0.3 * 9.80665 * 0.3 * np.sin(load)
        return [
            (-3.78 * i - K_T * w) / 4.56e-3,
            w,
            (K_T * i - B * w - tau) / J,
            v,
            (tau - 0.02 * v - falls + outside) / 0.03,
        ]

    y, found = np.zeros(5), {0.0: 0.0}
    edges = np.unique(np.concatenate((TIME, [START, START + rise, END])))
    for a, b in pairwise(edges):
        acts = (START <= 0.5 * (a + b) < END,)
        done = solve_ivp(slope, (a, b), y, method="DOP853", rtol=1e-10, atol=1e-12, args=acts)
        y = done.y[:, -1]
        found[b] = y[3]
    return np.array([found[t] for t in TIME])


@pytest.mark.parametrize("rise", [0.0, 0.103])
def test_an_external_torque_that_rises_agrees_with_scipy_and_closes_the_books(rise):
    term = LoadDisturbance(start_s=START, end_s=END, peak_Nm=PEAK, rise_s=rise)
    inputs = Inputs(time_s=TIME, duty=np.zeros(TIME.size), load=Load())
    found = simulate(ActuatorModel(RIG, (term,)), inputs)
    np.testing.assert_allclose(found.load_angle_rad, exact(rise), atol=1e-10)
    assert np.abs(found.energy.imbalance_J()).max() < 1e-12
    assert np.abs(found.energy.load_work_J).max() > 0.01


def test_a_rise_longer_than_the_torque_lasts_is_refused():
    with pytest.raises(TermError, match="longer than it lasts"):
        LoadDisturbance(start_s=1.0, end_s=1.5, peak_Nm=1.0, rise_s=0.6)
