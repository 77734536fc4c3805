"""Beyond its first contact `al1` has the knees, tangents and torques of CalculiX.

Source: spec/spring.md, "Figures to reach" (FIT): CalculiX 2.20 with a surface-to-surface penalty.
"""

import numpy as np
import pytest

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.fem.newton import solve_path

CALCULIX = {-0.196: 13.013, -0.224: 15.532, -0.252: 18.183, -0.280: 20.839}


@pytest.fixture(scope="module")
def problem():
    return TorsionProblem(design=load_design("al1"), dimension=2)


@pytest.fixture(scope="module")
def curve(problem):
    return solve_torsion(
        problem,
        states_per_direction=4,
        beyond=1.5,
        states_beyond=3,
        extra_deflections_rad=tuple(CALCULIX),
    )


def test_al1_knees_are_at_13_6_nm_unwinding_and_24_3_nm_winding(curve):
    knee, late = curve.contact_onset["unwinding"], curve.contact_onset["winding"]
    assert knee.torque_Nm == pytest.approx(-13.6, abs=0.3)
    assert late.torque_Nm == pytest.approx(24.3, abs=0.5)
    assert knee.stiffening == pytest.approx(1.45, abs=0.05)
    assert knee.tangent_before_Nm_per_rad == pytest.approx(66.5, abs=0.5)
    assert 1.05 < late.stiffening < 1.2


@pytest.mark.parametrize("deflection", CALCULIX)
def test_al1_torque_past_the_knee_is_calculix_within_half_a_percent(curve, deflection):
    assert curve.torque_at_Nm(deflection) == pytest.approx(-CALCULIX[deflection], rel=5e-3)


def test_coils_stay_out_of_each_other(curve):
    """Measured on the deformed edges: penetration of micrometres where 2.5 mm would be free."""
    assert curve.min_clearance_m.min() > -20e-6
    past = np.abs(curve.deflection_rad) > [
        1.02 * abs(curve.contact_onset["unwinding" if d < 0 else "winding"].deflection_rad)
        for d in curve.deflection_rad
    ]
    assert np.all(np.abs(curve.min_clearance_m[past]) < 20e-6)
    assert curve.contact_onset["unwinding"].penetration_m < 20e-6


def test_work_of_the_torque_is_stored_across_the_knee(curve):
    """Hermite integral of the torque in contact against the energy of body and penalty."""
    d, t, k = curve.deflection_rad, curve.torque_Nm, curve.tangent_Nm_per_rad
    h = np.diff(d)
    work = np.cumsum(h / 2 * (t[1:] + t[:-1]) + h**2 / 12 * (k[:-1] - k[1:]))
    stored = curve.strain_energy_J[1:] - curve.strain_energy_J[0]
    assert work[-1] == pytest.approx(stored[-1], abs=2e-4 * curve.strain_energy_J.max())


@pytest.mark.parametrize("end", [-0.3, 0.45])
def test_any_step_size_ends_at_the_same_torque(problem, end):
    """No cycling: one step, a few and many from rest to far past the knee."""
    static = problem.static_problem(contact=True)
    torques = [
        solve_path(static, np.linspace(0, end, steps + 1)[1:]).states[-1].drive_force
        for steps in (1, 2, 7, 30)
    ]
    assert torques == pytest.approx([torques[-1]] * 4, rel=1e-7)


def test_a_curve_that_ends_below_its_contact_is_refused(problem):
    with pytest.raises(DesignError, match=r"beyond = 0.5 must be 1 to 3"):
        solve_torsion(problem, beyond=0.5)
