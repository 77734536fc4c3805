"""Shape functions and quadrature are exact for every polynomial that they promise."""

import numpy as np
import pytest

from dftfs.fem.elements import HEX20, QUAD8, face_table, gauss_table, shape_table


@pytest.mark.parametrize("kind", [QUAD8, HEX20], ids=lambda kind: kind.name)
class TestSerendipity:
    def test_each_function_is_one_at_its_node_and_zero_at_the_others(self, kind):
        table = shape_table(kind, kind.node_points)
        np.testing.assert_allclose(table.values, np.eye(kind.n_nodes), atol=1e-14)

    def test_quadratic_fields_and_their_gradients_are_reproduced(self, kind):
        def field(x):
            square = 2 * x[:, 0] ** 2 - x[:, 1] ** 2 + 3 * x[:, 0] * x[:, 1] + x[:, -1] - 0.4
            return square + (0.5 * x[:, -1] * x[:, 0] if kind.dim == 3 else 0)

        table = gauss_table(kind.name, 3)
        nodal = field(kind.node_points)
        np.testing.assert_allclose(table.values @ nodal, field(table.points), atol=1e-14)
        step = 1e-6
        for axis in range(kind.dim):
            shift = step * np.eye(kind.dim)[axis]
            slope = (field(table.points + shift) - field(table.points - shift)) / (2 * step)
            np.testing.assert_allclose(table.gradients[:, axis] @ nodal, slope, atol=1e-8)

    def test_three_points_integrate_degree_five_and_two_degree_three(self, kind):
        for per_direction, degree in ((3, 5), (2, 3)):
            table = gauss_table(kind.name, per_direction)
            assert len(table.weights) == per_direction**kind.dim
            powers = np.prod(table.points**degree, axis=1)
            exact = (1 / (degree + 1)) ** kind.dim
            assert table.weights @ powers == pytest.approx(exact, rel=1e-14)

    def test_midsides_lie_between_the_corners_of_their_facets(self, kind):
        half = kind.facets.shape[1] // 2 if kind.dim == 3 else 2
        for facet in kind.facets:
            corners, middles = facet[:half], facet[half:]
            for k, middle in enumerate(middles):
                ends = kind.node_points[[corners[k], corners[(k + 1) % half]]]
                np.testing.assert_allclose(kind.node_points[middle], ends.mean(axis=0))


def test_edge_functions_are_the_trace_of_the_quadrilateral():
    edge = face_table(2)
    x = np.column_stack([edge.points[:, 0], np.zeros(3)])
    trace = shape_table(QUAD8, x)
    np.testing.assert_allclose(edge.values, trace.values[:, [0, 1, 4]], atol=1e-14)
    np.testing.assert_allclose(edge.gradients[:, 0], trace.gradients[:, 0, [0, 1, 4]], atol=1e-14)
