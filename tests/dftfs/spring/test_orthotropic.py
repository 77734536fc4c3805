"""Springs of material with a direction agree with the flexibilities of their arms, integrated."""

import numpy as np
import pytest
from scipy.integrate import quad

from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.spring.orthotropic import InPlane, arm_stiffnesses, turned_rod
from dftfs.spring.outline import build_outline
from dftfs.spring.planar_rod import Rod, twist_stiffness
from dftfs.spring.rod import arm_rod

PRINTED = InPlane(along_Pa=3.0e9, across_Pa=2.2e9, shear_Pa=0.9e9, poisson_ratio=0.36)
RADIUS, EI, EA, GA = 0.05, 20.0, 1e6, 3e5  # an arc of a quarter turn, about the centre


def quarter():
    angle = np.linspace(0.0, np.pi / 2, 41)
    nodes = RADIUS * np.column_stack((np.cos(angle), np.sin(angle)))
    return Rod(
        nodes_m=nodes, angles_rad=angle + np.pi / 2, bending_stiffness_Nm2=EI,
        axial_stiffness_N=EA, shear_stiffness_N=GA,
    )  # fmt: skip


def by_flexibility(turn, modulus, shear_modulus):
    """Torque about the centre that turns the end of the arc with its radius by one radian."""
    end = RADIUS * np.array([0.0, 1.0])

    def internal(a):  # bending moment, axial and shear force of unit end loads Fx, Fy, M
        x, y = RADIUS * np.cos(a), RADIUS * np.sin(a)
        moment = np.array([-(end[1] - y), end[0] - x, 1.0])
        axial = np.array([-np.sin(a), np.cos(a), 0.0])
        across = np.array([-np.cos(a), -np.sin(a), 0.0])
        return moment, axial, across

    def entry(i, j):
        def density(a):
            parts, direction = internal(a), a + np.pi / 2 + turn
            share = PRINTED.modulus_Pa(direction) / modulus
            shear = PRINTED.shear_modulus_Pa(direction) / shear_modulus
            stiff = (EI * share, EA * share, GA * shear)
            return RADIUS * sum(p[i] * p[j] / k for p, k in zip(parts, stiff, strict=True))

        return quad(density, 0.0, np.pi / 2, epsrel=1e-11)[0]

    flexibility = np.array([[entry(i, j) for j in range(3)] for i in range(3)])
    turned = np.array([-end[1], end[0], 1.0])
    return turned @ np.linalg.solve(flexibility, turned)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_an_arc_is_as_stiff_as_its_flexibilities_integrated_say(turn):
    modulus, shear = 3.0e9, 1.1e9
    rod = turned_rod(quarter(), PRINTED, modulus, shear, turn)
    assert twist_stiffness(rod) == pytest.approx(by_flexibility(turn, modulus, shear), rel=1e-5)


def test_moduli_of_a_turned_ply():
    assert PRINTED.modulus_Pa(0.0) == pytest.approx(3.0e9)
    assert PRINTED.modulus_Pa(np.pi / 2) == pytest.approx(2.2e9)
    at_45 = 4.0 / (1 / 3.0e9 + 1 / 2.2e9 + 1 / 0.9e9 - 2 * 0.36 / 3.0e9)
    assert PRINTED.modulus_Pa(np.pi / 4) == pytest.approx(at_45)
    assert PRINTED.shear_modulus_Pa(0.0) == pytest.approx(0.9e9)
    same = InPlane(along_Pa=7e10, across_Pa=7e10, shear_Pa=7e10 / 2.66, poisson_ratio=0.33)
    turns = np.linspace(0.0, 3.0, 7)
    np.testing.assert_allclose(same.modulus_Pa(turns), 7e10)
    np.testing.assert_allclose(same.shear_modulus_Pa(turns), 7e10 / 2.66)


def test_without_a_direction_the_spring_is_the_isotropic_one_and_with_one_arms_differ_alike():
    design = load_design("al1")
    outline = build_outline(design.spiral)
    same = InPlane(along_Pa=7e10, across_Pa=7e10, shear_Pa=7e10 / 2.66, poisson_ratio=0.33)
    plain = twist_stiffness(arm_rod(outline, 1e-2, 7e10, 0.33).rod)
    np.testing.assert_allclose(arm_stiffnesses(outline, 1e-2, same, 0.4), plain, rtol=1e-9)
    found = arm_stiffnesses(outline, 1e-2, PRINTED, 0.4)
    half = arm_stiffnesses(outline, 1e-2, PRINTED, 0.4 + np.pi)  # a material has no sense
    np.testing.assert_allclose(found, half, rtol=1e-9)
    assert found.min() > plain * 2.2 / 70 * 0.8
    assert found.max() < plain * 3.0 / 70


def test_moduli_that_no_material_has_are_refused():
    with pytest.raises(DesignError, match="must be positive"):
        InPlane(along_Pa=0.0, across_Pa=1e9, shear_Pa=1e9, poisson_ratio=0.3)
    with pytest.raises(DesignError, match="strain energy"):
        InPlane(along_Pa=1e9, across_Pa=2e9, shear_Pa=1e9, poisson_ratio=0.8)
