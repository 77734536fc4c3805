"""Extrusion, rotation and boundaries keep their promises, and an unusable mesh is refused."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.errors import MeshError
from dftfs.fem.mesh import (
    TaggedMesh,
    extruded,
    jacobian_determinants,
    matched_cut_nodes,
    replicated,
)
from tests.cases.fem import ring_part, slotted_sector, straight_bar

GAUSS = np.array([5, 8, 5]) / 18


def measure(mesh):
    weights = np.einsum("i,j->ij", GAUSS, GAUSS).ravel()
    weights = weights if mesh.dim == 2 else np.einsum("i,j->ij", weights, GAUSS).ravel()
    return float((jacobian_determinants(mesh) @ weights).sum())


def facet_normals(mesh, name):
    """Outward normals, from the corners of every facet."""
    corners = mesh.nodes[mesh.facets(name)]
    if mesh.dim == 2:
        along = corners[:, 1] - corners[:, 0]
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    else:
        normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return normal / np.linalg.norm(normal, axis=1)[:, None]


@pytest.fixture
def bar():
    return straight_bar(0.3, 0.1, 3, 2)


def test_boundaries_point_outwards_in_plane_and_space(bar):
    solid = extruded(bar, np.array([0.0, 0.02, 0.05]))
    for name, normal in {
        "low1": (-1, 0, 0), "high1": (1, 0, 0), "low2": (0, -1, 0), "high2": (0, 1, 0),
    }.items():  # fmt: skip
        np.testing.assert_allclose(facet_normals(bar, name), [normal[:2]] * len(bar.facets(name)))
        np.testing.assert_allclose(facet_normals(solid, name), [normal] * len(solid.facets(name)))
    np.testing.assert_allclose(facet_normals(solid, "bottom"), [(0, 0, -1)] * len(bar.cells))
    np.testing.assert_allclose(facet_normals(solid, "top"), [(0, 0, 1)] * len(bar.cells))


def test_a_facet_given_in_any_order_is_stored_as_its_cell_turns_it(bar):
    rows = bar.boundaries["high2"][:, [1, 0, 2]]
    turned = replace(bar, boundaries={"high2": rows})
    np.testing.assert_array_equal(turned.boundaries["high2"], bar.boundaries["high2"])


def test_midside_nodes_of_an_extrusion_lie_midway(bar):
    solid = extruded(bar, np.array([0.0, 0.02, 0.05]))
    corners, middles = solid.cells[:, :8], solid.cells[:, 8:]
    edges = [
        (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
        (0, 4), (1, 5), (2, 6), (3, 7),
    ]  # fmt: skip
    for k, (i, j) in enumerate(edges):
        midway = (solid.nodes[corners[:, i]] + solid.nodes[corners[:, j]]) / 2
        np.testing.assert_allclose(solid.nodes[middles[:, k]], midway, atol=1e-15)


def test_extrusion_and_replication_keep_the_measure():
    sector = slotted_sector(3)
    solid = extruded(sector, np.array([0.0, 0.004, 0.010]))
    assert measure(solid) == pytest.approx(0.010 * measure(sector), rel=1e-12)
    ring = replicated(sector, 3, cut_low="low2", cut_high="high2")
    assert measure(ring) == pytest.approx(3 * measure(sector), rel=1e-12)
    whole = replicated(solid, 3, cut_low="low2", cut_high="high2")
    assert measure(whole) == pytest.approx(3 * measure(solid), rel=1e-12)
    twice = extruded(ring, np.array([0.0, 0.004, 0.010]))
    assert len(whole.nodes) == len(twice.nodes)
    assert set(whole.boundaries) == {"low1", "high1", "bottom", "top"}


def test_quarter_ring_becomes_a_ring_of_the_exact_area():
    inner, outer = 0.03, 0.05
    ring = replicated(ring_part(inner, outer, np.pi / 2, 8, 2), 4, cut_low="low2", cut_high="high2")
    assert measure(ring) == pytest.approx(np.pi * (outer**2 - inner**2), rel=1e-5)
    assert len(ring.facets("high1")) == 32


def test_cut_partners_are_each_other_turned():
    sector = slotted_sector(3)
    low, high = matched_cut_nodes(sector, 3, cut_low="low2", cut_high="high2")
    a, b = sector.nodes[low], sector.nodes[high]
    turn = np.arctan2(b[:, 1], b[:, 0]) - np.arctan2(a[:, 1], a[:, 0])
    np.testing.assert_allclose(np.mod(turn, 2 * np.pi), 2 * np.pi / 3, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*a.T), np.hypot(*b.T), rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"boundaries": {"rim": np.empty((0, 3), int)}}, "'rim' selects no facet"),
        ({"boundaries": {"rim": np.array([[0, 1, 2, 3]])}}, "'rim': a facet needs 3"),
        ({"cells": np.zeros((2, 20), int)}, "cells have 20 nodes; 2D needs 8"),
        ({"cells": np.full((1, 8), 99)}, "node 99; the mesh has nodes 0.."),
    ],
)
def test_unusable_input_is_refused_in_one_line(bar, change, message):
    with pytest.raises(MeshError, match=message) as caught:
        replace(bar, **change)
    assert "\n" not in str(caught.value)


def test_unused_nodes_are_counted(bar):
    with pytest.raises(MeshError, match="2 nodes belong to no cell, the first is"):
        replace(bar, nodes=np.concatenate([bar.nodes, [[9.0, 9.0], [8.0, 8.0]]]))


def test_a_node_that_is_not_finite_is_named(bar):
    nodes = bar.nodes.copy()
    nodes[4, 1] = np.nan
    with pytest.raises(MeshError, match="node 4 is not finite"):
        replace(bar, nodes=nodes)


def test_a_folded_cell_is_named(bar):
    nodes = bar.nodes.copy()
    nodes[bar.cells[2, 0]] = nodes[bar.cells[2, 2]] + 0.01
    with pytest.raises(MeshError, match=r"cells are folded; the first is cell \d+ at"):
        replace(bar, nodes=nodes)


def test_a_mirrored_mesh_is_refused(bar):
    with pytest.raises(MeshError, match="6 of 6 cells are folded"):
        replace(bar, nodes=bar.nodes * [1, -1])


def test_a_facet_inside_the_mesh_is_refused(bar):
    for row, reason in (
        (bar.cells[0][[0, 2, 5]], "is no cell's facet"),
        (bar.cells[0][[2, 3, 6]], "lies between two cells"),
    ):
        with pytest.raises(MeshError, match=f"'inner': facet 0 .* {reason}"):
            replace(bar, boundaries={"inner": row[None]})


def test_an_unknown_boundary_names_the_known_ones(bar):
    with pytest.raises(MeshError, match=r"no boundary 'bore'; this mesh has \['high1'"):
        bar.boundary_nodes("bore")


def test_arrays_of_a_mesh_are_read_only(bar):
    for array in (bar.nodes, bar.cells, bar.boundaries["low1"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        bar.boundaries["new"] = bar.boundaries["low1"]


def test_levels_that_do_not_increase_are_refused(bar):
    with pytest.raises(MeshError, match=r"two increasing heights, got \[0.0, 0.1, 0.1\]"):
        extruded(bar, np.array([0.0, 0.1, 0.1]))
    with pytest.raises(MeshError, match="needs a planar mesh"):
        extruded(extruded(bar, np.array([0.0, 1.0])), np.array([0.0, 1.0]))
    with pytest.raises(MeshError, match=r"'top'.* is reserved"):
        extruded(replace(bar, boundaries={"top": bar.boundaries["low1"]}), np.array([0.0, 1.0]))


def test_cuts_that_do_not_match_are_refused():
    sector = slotted_sector(3)
    with pytest.raises(MeshError, match=r"turned by 2 pi/4 is not 'high2'.* worst gap"):
        replicated(sector, 4, cut_low="low2", cut_high="high2")
    with pytest.raises(MeshError, match="at least 2 sectors"):
        replicated(sector, 1, cut_low="low2", cut_high="high2")
    with pytest.raises(MeshError, match="share a node"):
        replicated(sector, 3, cut_low="low2", cut_high="low2")


def test_a_mesh_without_boundaries_is_allowed(bar):
    assert not TaggedMesh(nodes=bar.nodes, cells=bar.cells, boundaries={}).boundaries
