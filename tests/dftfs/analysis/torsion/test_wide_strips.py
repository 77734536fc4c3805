"""The width of a wide strip stiffens it: rod with the plate factor and 3D elements agree.

1 mm thick, R 12 to 40 mm, Ti-6Al-4V, w / t of 10, 20 and 30: Searle's w^2 / (R t) of 4 to 35 in
the middle of the arm. Plane stress is up to 10 % too soft there.
"""

import pytest

from dftfs.analysis.torsion.problem import TorsionProblem, least_layers, meshed_problem
from dftfs.design import load_design
from dftfs.fem.newton import linear_tangent
from dftfs.spring.rod import rod_curve

WIDE = {
    "inner_radius_mm": "12",
    "outer_radius_mm": "40",
    "thickness_mm": "1",
    "turns": "1.5",
    "fillet_radius_mm": "0.5",
    "tip_radius_mm": "0.1",
    "bore_radius_mm": "9",
    "hub_radius_mm": "12",
    "rim_inner_radius_mm": "40.5",
    "rim_outer_radius_mm": "43.5",
    "material": "Ti-6Al-4V",
}


@pytest.mark.parametrize(
    ("width", "layers", "stiffening"), [("10", 1, 1.021), ("20", 2, 1.076), ("30", 3, 1.096)]
)
def test_the_rod_is_within_half_a_percent_of_3d_elements(width, layers, stiffening):
    design = load_design("al1", WIDE | {"width_mm": width})
    elastic = design.width_m, design.material.youngs_modulus_Pa, design.material.poisson_ratio
    plane, wide = (
        rod_curve(design.outline, *elastic, [0.0], wide=wide).stiffness_Nm_per_rad
        for wide in (False, True)
    )
    problem = TorsionProblem(design=design, dimension=3)
    assert problem.layers == layers
    solid = problem.copies * linear_tangent(problem.static_problem())
    assert wide == pytest.approx(solid, rel=5e-3)
    assert wide / plane == pytest.approx(stiffening, abs=3e-3)


def test_a_narrow_strip_needs_one_element_and_a_choice_of_more_is_kept():
    assert least_layers(load_design("al1")) == 1
    design = load_design("al1", WIDE | {"width_mm": "30"})
    assert meshed_problem(design, dimension=3).layers == 3
    assert TorsionProblem(design=design, layers=5).layers == 5
