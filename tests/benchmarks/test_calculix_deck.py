"""The benchmark's CalculiX deck states the same problem, and CalculiX' output is read right."""

import numpy as np
import pytest

from benchmarks.calculix_deck import (
    load_model,
    nodal_average,
    nodal_stress_Pa,
    point_stress_Pa,
    save_model,
    torques_Nm,
    von_mises,
)
from dftfs.fem.deck import Model, deck
from dftfs.fem.elements import HEX20, gauss_table

TURN_RAD = np.array([0.1, 0.35])
DAT = """
 forces (fx,fy,fz) for set BORE and time  0.1000000E+01

         2 -3.000000E+00  4.000000E+00  0.000000E+00
         3  1.500000E+00 -2.500000E+00  7.000000E+00

 forces (fx,fy,fz) for set BORE and time  0.2000000E+01

         2 -6.000000E+00  8.000000E+00  0.000000E+00
         3  3.000000E+00 -5.000000E+00  1.400000E+01

 stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set SPRING and time  0.2000000E+01

"""
FRD = """    1C
 -4  STRESS      6    1
 -5  SXX         1    4    1    1
 -1         2 1.00000E+00-2.00000E+00 3.00000E+00-4.00000E+00 5.00000E+00-6.00000E+00
 -1         1-7.00000E+06 8.00000E+00-9.00000E+00 1.00000E-02 1.10000E+01-1.20000E+01
 -3
 -4  ERROR       1    1
 -1         1 0.00000E+00
 -3
"""


def one_element() -> Model:
    """A slanted brick, its lower face the bore and its upper one the rim."""
    shear = np.array([[0.02, 0.003, 0.0], [-0.002, 0.015, 0.001], [0.0, 0.004, 0.011]])
    return Model(
        nodes_m=HEX20.node_points @ shear + np.array([0.03, -0.01, 0.0]),
        cells=np.arange(20, dtype=np.int32)[None],
        bore=HEX20.facets[:1].astype(np.int32),
        rim=HEX20.facets[1:2].astype(np.int32),
        youngs_modulus_Pa=68e9,
        poisson_ratio=0.33,
    )


def numbers_after(text: str, keyword: str, nth: int = 0) -> list[list[float]]:
    """Data lines of the nth block whose keyword line starts so."""
    block = text.split(f"\n{keyword}")[nth + 1].split("\n*")[0].splitlines()[1:]
    return [[float(v) for v in line.split(",") if v.strip()] for line in block]


def test_deck_prescribes_a_rigid_rotation_of_the_rim_in_every_step():
    model = one_element()
    text = deck(model, TURN_RAD, tight=False)
    assert text.count("*STEP, NLGEOM") == text.count("*STATIC, DIRECT\n1., 1.") == 2
    rim = np.unique(model.rim)
    for step, angle in enumerate(TURN_RAD):
        rows = np.array(numbers_after(text, "*BOUNDARY", step + 1))
        assert rows[:, 0].astype(int).tolist() == np.repeat(rim + 1, 3).tolist()
        assert np.array_equal(rows[:, 1], rows[:, 2])
        c, s = np.cos(angle), np.sin(angle)
        turned = model.nodes_m[rim] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        moved = model.nodes_m[rim] + rows[:, 3].reshape(-1, 3)
        last_digit = 1e-12 * np.abs(rows[:, 3]).max()  # the deck has 13 of each displacement
        np.testing.assert_allclose(moved, turned, rtol=0, atol=last_digit)


def test_deck_keeps_nodes_elements_and_calculix_limits_on_its_lines():
    model = one_element()
    text = "\n" + deck(model, TURN_RAD, tight=False)
    nodes = np.array(numbers_after(text, "*NODE, NSET=ALL"))
    np.testing.assert_allclose(nodes[:, 1:], model.nodes_m, rtol=1e-12, atol=1e-18)
    (first, rest) = numbers_after(text, "*ELEMENT, TYPE=C3D20")
    assert first + rest == [1, *range(1, 21)]
    data = [line.split(",") for line in text.splitlines() if not line.startswith("*")]
    assert max(len([field for field in line if field]) for line in data) == 16
    assert max(len(field.strip()) for line in data for field in line) <= 20


def test_stresses_are_asked_for_once_and_the_tight_deck_differs_in_the_residual_only():
    loose, tight = (deck(one_element(), TURN_RAD, tight=t) for t in (False, True))
    assert loose.count("*EL PRINT") == loose.count("*EL FILE") == 1
    assert loose.count("*NODE PRINT, NSET=BORE") == 2
    assert "*CONTROLS" not in loose
    assert tight.replace("*CONTROLS, PARAMETERS=FIELD\n1e-08\n", "") == loose


def test_torque_is_the_moment_against_the_reactions_of_the_bore():
    model = one_element()
    forces = np.array([[-3.0, 4.0, 0.0], [1.5, -2.5, 7.0]])
    held = np.cross(model.nodes_m[[1, 2]], forces).sum(axis=0)[2]
    assert held != 0
    assert torques_Nm(DAT, model, 2) == pytest.approx([-held, -2 * held], rel=1e-12)


def test_a_dat_file_that_ends_early_is_refused():
    with pytest.raises(ValueError, match="printed 2 of 3 steps"):
        torques_Nm(DAT, one_element(), 3)


def test_point_stresses_are_read_in_order():
    values = np.round(np.random.default_rng(3).normal(size=(2, 27, 6)) * 1e6, 0)
    rows = [
        f"{e + 1:10d} {q + 1:3d}" + "".join(f" {v:13.6E}" for v in values[e, q])
        for e in range(2)
        for q in range(27)
    ]
    np.testing.assert_allclose(point_stress_Pa(DAT + "\n".join(rows)), values, rtol=1e-6)


def test_nodal_stresses_are_read_by_columns_and_sorted_by_node():
    expected = [[-7e6, 8, -9, 0.01, 11, -12], [1, -2, 3, -4, 5, -6]]
    assert nodal_stress_Pa(FRD).tolist() == expected


def test_nodal_average_reproduces_a_quadratic_field_and_halves_a_jump():
    table = gauss_table("hex20", 3)
    fit = np.linalg.pinv(table.values)
    # CalculiX' a27, first corner: nearest point, next along an axis, centre, farthest
    corner = np.lexsort(table.points.round(9).T)
    assert fit[0, corner][[0, 1, 13, 26]] == pytest.approx(
        [2.37499, -0.31246, -0.29630, 0.11575], abs=6e-6
    )
    weights = np.array([1.0, -2.0, 0.5, 3.0, 0.7, -1.1])

    def field(points):
        x, y, z = points.T
        return (2 + x - 3 * y + x * z - 0.4 * z**2)[:, None] * weights

    upper = np.array([4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, *range(24, 32)])
    cells = np.stack([np.arange(20), upper])
    points = np.stack([field(table.points), field(table.points) + 8.0])
    found = nodal_average(points, fit, cells)
    own = field(HEX20.node_points)
    alone = [0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19]
    np.testing.assert_allclose(found[alone], own[alone], atol=1e-12)
    shared = [(4, 0), (5, 1), (12, 8)]
    for lower_local, upper_local in shared:
        mean = (own[lower_local] + own[upper_local] + 8.0) / 2
        np.testing.assert_allclose(found[lower_local], mean, atol=1e-12)


def test_von_mises_of_tension_shear_and_pressure():
    states = np.array([[5.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 2.0, 0], [3.0, 3.0, 3.0, 0, 0, 0]])
    assert von_mises(states) == pytest.approx([5.0, 2 * np.sqrt(3), 0.0])
    general = np.array([4.0, -1.0, 2.5, 0.3, -0.7, 1.9])
    tensor = np.array([[4.0, 0.3, -0.7], [0.3, -1.0, 1.9], [-0.7, 1.9, 2.5]])
    a, b, c = np.linalg.eigvalsh(tensor)
    expected = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)
    assert von_mises(general) == pytest.approx(expected)


def test_a_model_comes_back_from_its_file(tmp_path):
    model = one_element()
    save_model(tmp_path / "model.npz", model)
    back = load_model(tmp_path / "model.npz")
    assert back.youngs_modulus_Pa == 68e9
    assert back.unknowns == model.unknowns == 3 * (20 - 16)
    for name in ("nodes_m", "cells", "bore", "rim"):
        assert np.array_equal(getattr(back, name), getattr(model, name))
