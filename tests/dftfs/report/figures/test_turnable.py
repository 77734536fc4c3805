"""The turnable part is the solution itself: its surface, every step, within its last digit."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.torsion.result import StepFields
from dftfs.design import load_design
from dftfs.report.figures.turnable import surface_triangles, turnable_part, wall_edges
from dftfs.spring.edges import rotate
from tests.cases.report_study import COARSE, sector_mesh, stiffness_result


@pytest.fixture(scope="module")
def result():
    design = load_design("ref")
    sector = sector_mesh(design.outline, COARSE)
    found = stiffness_result(design, sector, "3D hex20", 1.0)
    angles = found.deflection_rad
    moved = [rotate(sector.nodes, angle) - sector.nodes for angle in angles]
    stress = [abs(angle) * 1e9 * np.linspace(0.1, 1.0, len(sector.nodes)) for angle in angles]
    fields = StepFields(
        copies=2,
        nodes_m=sector.nodes,
        cells=sector.cells,
        displacement_m=np.array(moved),
        von_mises_Pa=np.array(stress),
    )
    return replace(found, fields=fields)


def area(points, triangles) -> float:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    return 0.5 * float(np.sum(x1 * y2 - x2 * y1))


def test_triangles_cover_what_the_walls_enclose(result):
    points, cells = result.fields.nodes_m, result.fields.cells
    walls = wall_edges(cells)
    (x1, y1), (x2, y2) = points[walls[:, 0]].T, points[walls[:, 1]].T
    enclosed = 0.5 * float(np.sum(x1 * y2 - x2 * y1))
    assert area(points, surface_triangles(cells)) == pytest.approx(enclosed, rel=1e-12)
    begins, ends = np.unique(walls[:, 0]), np.unique(walls[:, 1])
    assert np.array_equal(begins, ends)  # closed


def test_every_step_reads_back_within_half_of_its_last_digit(result):
    data = json.loads(turnable_part(result, 7.34e-3))

    def signed(name):
        return np.frombuffer(base64.b64decode(data[name]), dtype="<i2")

    shape = result.fields.displacement_m.shape
    moved = data["unit"] * signed("displacement").reshape(shape)
    assert np.abs(moved - 1e3 * result.fields.displacement_m).max() <= 0.501 * data["unit"]
    nodes = data["unit"] * signed("nodes").reshape(-1, 2)
    assert np.abs(nodes - 1e3 * result.fields.nodes_m).max() <= 0.501 * data["unit"]
    assert data["unit"] < 0.004
    stress = data["stressUnit"] * signed("stress").reshape(shape[:2])
    expected = 1e-6 * result.fields.von_mises_Pa
    assert np.abs(stress - expected).max() <= 0.501 * data["stressUnit"]
    assert data["torque"] == result.torque_Nm.round(4).tolist()


def test_a_result_without_fields_has_none(result):
    assert turnable_part(replace(result, fields=None), 7.34e-3) == ""
