"""Springs yield and keep a set where the thesis found it, and every strength line has a source.

Source: thesis Figure 2.20 (permanent lines near the inner ring of the titanium spring);
spec/spring.md, "first yield".
"""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.strength.fatigue import LoadBlock
from dftfs.analysis.strength.fatigue_lives import fatigue_lives
from dftfs.analysis.strength.strength_checks import strength_checks
from dftfs.analysis.strength.yield_and_set import first_yield, permanent_set
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.regions import CONTACT, REGIONS, region_masks, regional_peaks_Pa
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import load_design
from dftfs.fem.newton import solve_path
from dftfs.fem.recover import recover_stress


@pytest.fixture(scope="module")
def problem():
    return TorsionProblem(design=load_design("al1"), dimension=2)


@pytest.fixture(scope="module")
def curve(problem):
    return solve_torsion(problem, states_per_direction=3, beyond=1.2, states_beyond=1)


def test_every_node_is_in_one_region(problem):
    masks = region_masks(problem)
    assert np.sum(list(masks.values()), axis=0).tolist() == [1] * len(problem.mesh.nodes)
    assert set(masks) | {CONTACT} == set(REGIONS)


def test_al1_notch_reaches_340_mpa_at_15_nm_and_yields_first(curve):
    assert curve.stress_at_torque_Pa(15.0, "hub notch") == pytest.approx(340e6, rel=0.03)
    strength = load_design("al1").material.yield_strength_Pa
    for direction in ("winding", "unwinding"):
        found = first_yield(curve, strength, direction)
        assert found.region == "hub notch"
        assert curve.stress_at_torque_Pa(found.torque_Nm, "hub notch") == pytest.approx(
            strength, rel=1e-3
        )
    assert curve.regional_peak_Pa[CONTACT][-1] > 0 == curve.regional_peak_Pa[CONTACT][1:-2].min()


def test_titanium_overloaded_keeps_a_set_with_its_strain_by_the_inner_ring():
    problem = TorsionProblem(design=load_design("ti"), dimension=2)
    small, large = (permanent_set(problem, angle) for angle in (0.05, 0.3))
    # equilibrium is found to 1e-9 of the torque, at the end and on the way back
    assert small.set_rad == pytest.approx(0.0, abs=10 * 1e-9 * 0.05)
    assert small.strain == 0.0
    assert 1e-4 < large.set_rad < 0.02
    assert large.region == "hub notch"
    assert np.hypot(*large.at_m) == pytest.approx(19.2e-3, abs=1e-3)
    assert 0 < large.yielded < 0.1


def test_every_strength_line_has_value_limit_verdict_and_source(curve):
    design = load_design("al1")
    spectrum = [LoadBlock(low_Nm=-10, high_Nm=10, cycles=1e5)]
    checks = strength_checks(design, curve, spectrum=spectrum)
    assert len(checks) == 8 + 6
    assert all(check.source and check.limit and check.value is not None for check in checks)
    arm = {c.name: c for c in checks}["fatigue damage, arm body, Goodman"]
    notch = {c.name: c for c in checks}["fatigue damage, hub notch, Goodman"]
    assert 0 < arm.value < notch.value


def test_in_3d_the_principal_stress_of_the_notch_is_a_tenth_above_von_mises():
    """Al1 at 15 Nm: 366 against 330 MPa; the width holds the notch's contraction."""
    problem = TorsionProblem(design=load_design("al1"), dimension=3)
    static = problem.static_problem()
    state = solve_path(static, [1e-3]).states[-1]
    stress = recover_stress(static, state.displacement_m)
    mises, principal = (
        regional_peaks_Pa(problem, values, None)["hub notch"]
        for values in (stress.von_mises_Pa, stress.principal_Pa)
    )
    assert principal / mises == pytest.approx(366 / 330, abs=0.02)


def test_swt_takes_the_principal_stress_and_goodman_von_mises(curve):
    design, spectrum = load_design("al1"), [LoadBlock(low_Nm=-10, high_Nm=10, cycles=1e5)]
    larger = {region: 1.1 * values for region, values in curve.regional_principal_Pa.items()}
    lives, worse = (
        fatigue_lives(design, result, spectrum, "machined")
        for result in (curve, replace(curve, regional_principal_Pa=larger))
    )
    for before, after in zip(lives, worse, strict=True):
        assert after.goodman_damage == before.goodman_damage
        assert after.swt_damage > 1.5 * before.swt_damage
