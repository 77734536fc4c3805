"""Error bars of a mesh series hold the limit, and a series without a limit is called so."""

import numpy as np
import pytest

from dftfs.analysis.strength.mesh_series import RATIO, estimate, mesh_series
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import load_design
from dftfs.fem.constraints import clamped
from dftfs.fem.loads import proportional, traction_forces
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.fem.recover import recover_stress
from tests.cases.fem import mapped_mesh


def series(limit: float, coefficient: float, order: float) -> list[float]:
    return [limit + coefficient * RATIO ** (-order * k) for k in range(3)]


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_limit_and_order_of_a_clean_series_are_found(order):
    found = estimate("K", "Nm/rad", series(65.0, 0.02, order), converged=1e-3)
    assert found.extrapolated == pytest.approx(65.0, rel=1e-9)
    assert found.observed_order == pytest.approx(order, rel=1e-6)
    assert found.verdict == "converged"
    assert abs(found.value / 65 - 1) < found.relative_error


def test_a_coarse_series_is_converging_and_a_restless_one_is_not():
    assert estimate("s", "MPa", series(240, 20, 1.0), converged=0.02).verdict == "converging"
    assert estimate("s", "MPa", [240, 220, 236], converged=0.02).verdict == "not converging"
    # an order that is not observed is no proof, however small the differences
    flat = estimate("s", "MPa", [240, 239.9, 240.1], converged=0.02)
    assert flat.verdict == "converging"
    assert flat.relative_error == pytest.approx(3.0 * 0.2 / 240, rel=1e-2)
    assert estimate("K", "", [65, 65.0001, 65.0], converged=1e-3).verdict == "converged"


def test_a_rising_series_widens_its_bar():
    """Al1's notch as issue 20 found it: 325.5 MPa, 1.1 % more on a finer mesh and still rising."""
    rising = estimate("s", "MPa", [325.5, 327.3, 329.0], converged=0.02)
    assert rising.verdict != "converged"
    assert rising.relative_error > 0.026  # CalculiX finds 1.2 to 2.6 % more


def test_across_the_width_the_error_is_added_and_moves_the_limit():
    flat = estimate("s", "MPa", series(250, -1, 2.0), converged=0.02)
    solid = estimate("s", "MPa", series(250, -1, 2.0), converged=0.02, solid=(240.0, 243.0))
    assert solid.value == 240.0
    across = 4 / 3 * (243 - 240 * (250 - 1 / RATIO**2) / 249)  # beyond the plane's own change
    assert solid.extrapolated == pytest.approx(240 * 250 / 249 + across, rel=1e-9)
    assert solid.relative_error > flat.relative_error + 1.2 * across / 245


def test_stress_at_a_sharp_reentrant_corner_is_called_singular():
    """An L of plane stress: the corner's stress grows as h^-0.456 (Williams), without limit."""
    peaks = []
    for k in (4, 6, 9):
        mesh = mapped_mesh(
            2 * k, 2 * k, lambda s, t: (0.1 * s, 0.1 * t), keep=lambda s, t: (s < 0.5) | (t < 0.5)
        )
        force = traction_forces(mesh, "high1", np.array([0.0, 1e6]), thickness_m=0.01)
        problem = StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=70e9,
            poisson_ratio=0.3,
            thickness_m=0.01,
            supports=(clamped(mesh.boundary_nodes("high2")),),
            dead_load_N=proportional(force),
        )
        stress = recover_stress(problem, solve_path(problem, [1.0]).states[-1].displacement_m)
        corner = np.linalg.norm(mesh.nodes - 0.05, axis=1).argmin()
        peaks.append(stress.von_mises_Pa[corner] / 1e6)
    found = estimate("corner", "MPa", peaks, converged=0.02)
    assert found.verdict == "singular"
    assert found.observed_order == pytest.approx(-0.456, abs=0.1)
    assert "no value to quote" in found.line()


@pytest.fixture(scope="module")
def ref_series():
    problem = TorsionProblem(design=load_design("ref"), dimension=3)
    return {s.quantity: s for s in mesh_series(problem, 14.97, contact=False)}


def test_ref_notch_stress_bar_holds_the_prototypes_237_mpa_and_the_finer_meshes_245(ref_series):
    """Default mesh 241; layers and in-plane refinement lead to 245 (prototype 237 +- 4)."""
    notch = ref_series["stress, hub notch, at +14.97 Nm"]
    bar = notch.relative_error * notch.value
    assert notch.value == pytest.approx(241, abs=1)
    assert notch.extrapolated == pytest.approx(245.2, abs=1.0)
    assert bar < 10
    assert notch.value - bar < 237 < notch.value + bar
    assert abs(notch.extrapolated - notch.value) < bar


def test_ref_stiffness_and_torque_are_converged_on_the_default_mesh(ref_series):
    for quantity, found in ref_series.items():
        if not quantity.startswith("stress"):
            assert found.verdict == "converged", found.line()
    assert ref_series["stiffness"].extrapolated == pytest.approx(65.432, abs=0.01)
