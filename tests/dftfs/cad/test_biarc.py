"""Arc splines stay within their tolerance of curves whose distance is known in closed form."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dftfs.cad.biarc import fit_biarcs
from dftfs.cad.bulge_loop import ArcPieces, BulgeLoop
from dftfs.cad.profile import arc_loop, chord_loop, deviation
from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Segment


@dataclass(frozen=True, kw_only=True)
class ArchimedeanSpiral:
    """r = inner + growth * angle, angle from 0 to sweep, all in m and rad."""

    inner_m: float
    growth_m: float
    sweep_rad: float

    def point(self, t):
        angle = self.sweep_rad * np.asarray(t, dtype=float)
        radius = self.inner_m + self.growth_m * angle
        return radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def tangent(self, t):
        angle = self.sweep_rad * np.asarray(t, dtype=float)
        radius = self.inner_m + self.growth_m * angle
        radial = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        around = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        vector = self.growth_m * radial + radius[..., None] * around
        return vector / np.linalg.norm(vector, axis=-1, keepdims=True)

    @property
    def length_m(self):
        t = np.linspace(0, 1, 20001)
        return float(np.sum(np.hypot(*np.diff(self.point(t), axis=0).T)))

    def distance(self, points):
        """First-order distance of nearby points: radial gap times the cosine of the pitch."""
        angle = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
        radius = self.inner_m + self.growth_m * angle
        return (np.hypot(*points.T) - radius) / np.hypot(1, self.growth_m / radius)

    def curvature_slope(self, t):
        """d kappa / ds by central differences of the closed-form curvature."""
        step = 1e-6
        low, high = (self._curvature(t + d) for d in (-step, step))
        speed = self.sweep_rad * np.hypot(
            self.inner_m + self.growth_m * self.sweep_rad * t, self.growth_m
        )
        return (high - low) / (2 * step) / speed

    def _curvature(self, t):
        radius, b = self.inner_m + self.growth_m * self.sweep_rad * t, self.growth_m
        return (radius**2 + 2 * b**2) / (radius**2 + b**2) ** 1.5


SPIRAL = ArchimedeanSpiral(inner_m=0.018, growth_m=0.0047, sweep_rad=11.3)


def pieces_of(edge, tolerance_m):
    vertices, bulges = fit_biarcs(edge, tolerance_m)
    ends = np.vstack([vertices[1:], edge.point(np.array([1.0]))])
    return ArcPieces.from_bulges(vertices, ends, bulges)


def test_a_circular_arc_is_reproduced_exactly():
    edge = Arc(name="a", centre_m=(0.013, -0.04), radius_m=0.031, start_rad=2.9, end_rad=-1.7)

    pieces = pieces_of(edge, 2e-6)

    np.testing.assert_allclose(pieces.curvature_per_m, -1 / 0.031, rtol=1e-9)
    assert np.sum(pieces.length_m) == pytest.approx(edge.length_m, rel=1e-12)
    assert len(pieces.length_m) <= 6


def test_arcs_stay_within_tolerance_of_an_archimedean_spiral():
    tolerance_m = 2e-6
    pieces = pieces_of(SPIRAL, tolerance_m)
    along = np.linspace(0, 1, 200)

    points = pieces.at(np.arange(len(pieces.length_m))[:, None], along).reshape(-1, 2)
    error = np.abs(SPIRAL.distance(points)).max()

    # the fitter samples a biarc 33 times and so sees its largest distance to 0.2 %
    assert 0.95 * tolerance_m < error <= 1.002 * tolerance_m


def test_arcs_join_with_the_same_tangent_and_end_on_the_curve():
    pieces = pieces_of(SPIRAL, 5e-6)
    turn = pieces.curvature_per_m * pieces.length_m
    heading = np.arctan2(pieces.tangent[:, 1], pieces.tangent[:, 0])

    kink = np.exp(1j * (heading + turn))[:-1] - np.exp(1j * heading)[1:]
    last = SPIRAL.tangent(np.array(1.0))

    assert np.abs(kink).max() < 1e-9
    assert abs(np.exp(1j * (heading + turn))[-1] - complex(*last)) < 1e-9
    np.testing.assert_array_equal(pieces.end_m[-1], SPIRAL.point(np.array(1.0)))


@pytest.mark.parametrize("tolerance_m", [1e-9, 1e-6])
def test_number_of_biarcs_follows_the_cube_root_law(tolerance_m):
    """A biarc of length h strays |dkappa/ds| h^3 / 324 (Meek & Walton 1995)."""
    t = (np.arange(4000) + 0.5) / 4000
    speed = SPIRAL.sweep_rad * np.hypot(
        SPIRAL.inner_m + SPIRAL.growth_m * SPIRAL.sweep_rad * t, SPIRAL.growth_m
    )
    per_m = (np.abs(SPIRAL.curvature_slope(t)) / (324 * tolerance_m)) ** (1 / 3)
    expected = float(np.mean(per_m * speed))

    biarcs = len(pieces_of(SPIRAL, tolerance_m).length_m) / 2

    assert expected - 0.02 * expected <= biarcs <= expected + 1 + 0.02 * expected


def test_fit_refuses_a_tolerance_that_is_not_positive():
    with pytest.raises(DesignError, match="tolerance_m = 0"):
        fit_biarcs(SPIRAL, 0.0)


def test_bulge_loop_measures_a_half_disc_with_a_notch():
    """Half disc of radius R less a half disc of radius r on its diameter: closed forms."""
    big, small = 0.07, 0.02
    loop = BulgeLoop(
        name="d",
        vertices_m=np.array([[-big, 0], [-small, 0], [small, 0], [big, 0]]),
        bulges=np.array([0.0, -1.0, 0.0, 1.0]),
    )

    assert loop.area_m2 == pytest.approx(np.pi / 2 * (big**2 - small**2), rel=1e-14)
    assert loop.length_m == pytest.approx(np.pi * (big + small) + 2 * (big - small), rel=1e-14)
    points = np.array([[0.001, 0.05], [0.001, 0.081], [-0.045, -0.003], [-0.071, -0.001]])
    expected = [
        big - np.hypot(0.001, 0.05),
        np.hypot(0.001, 0.081) - big,
        0.003,
        np.hypot(0.001, 0.001),
    ]
    np.testing.assert_allclose(loop.distance(points), expected, rtol=1e-12)


@settings(deadline=None, max_examples=20)
@given(st.floats(-0.9, 0.9), st.floats(-4, 4), st.floats(0.001, 0.1))
def test_area_of_a_bulge_agrees_with_its_own_points(bulge, heading, span):
    chord = span * np.array([np.cos(heading), np.sin(heading)])
    start = np.array([0.03, -0.02])
    pieces = ArcPieces.from_bulges(start[None], (start + chord)[None], np.array([bulge]))
    loop = BulgeLoop(name="b", vertices_m=[start, start + chord], bulges=[bulge, 0.0])

    x, y = (pieces.at(np.zeros(20001, dtype=int), np.linspace(0, 1, 20001)) - start).T
    polygon = 0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])

    np.testing.assert_allclose([x[-1], y[-1]], chord, atol=1e-15)
    assert loop.area_m2 == pytest.approx(polygon, rel=1e-7, abs=1e-14 * span)


def test_area_of_a_nearly_straight_bulge_is_continuous_across_the_series():
    def area(bulge):
        return BulgeLoop(name="b", vertices_m=[[0, 0], [0.05, 0.01]], bulges=[bulge, 0]).area_m2

    below, above = area(4.9999e-4), area(5.0001e-4)

    assert above / below - 1 == pytest.approx(5.0001 / 4.9999 - 1, rel=1e-3)


@pytest.mark.parametrize(
    ("vertices", "bulges"),
    [([[0, 0], [1, 0]], [0.0]), ([[0, 0], [0, 0], [1, 1]], [0, 0, 0]), ([[0, 0]], [0.0])],
)
def test_bulge_loop_refuses_what_is_no_loop(vertices, bulges):
    with pytest.raises(DesignError, match="loop b"):
        BulgeLoop(name="b", vertices_m=vertices, bulges=bulges)


# a slice of a ring: two arcs about the origin, two radial segments
SLICE = (
    Arc(name="o", centre_m=(0.0, 0.0), radius_m=0.05, start_rad=0.2, end_rad=2.6),
    Segment(
        name="l",
        start_m=(0.05 * np.cos(2.6), 0.05 * np.sin(2.6)),
        end_m=(0.02 * np.cos(2.6), 0.02 * np.sin(2.6)),
    ),
    Arc(name="i", centre_m=(0.0, 0.0), radius_m=0.02, start_rad=2.6, end_rad=0.2),
    Segment(
        name="r",
        start_m=(0.02 * np.cos(0.2), 0.02 * np.sin(0.2)),
        end_m=(0.05 * np.cos(0.2), 0.05 * np.sin(0.2)),
    ),
)


def test_arcs_and_segments_are_taken_over_exactly():
    loop = arc_loop("slice", SLICE, 2e-6)

    assert deviation(loop, SLICE) < 1e-15
    assert loop.area_m2 == pytest.approx(0.5 * 2.4 * (0.05**2 - 0.02**2), rel=1e-13)
    assert np.abs(loop.bulges).max() < 1


def test_chords_use_the_tolerance_and_lose_the_area_of_their_segments():
    """A chord of sagitta s cuts off 2/3 s per length: the outer arc loses, the inner gains."""
    tolerance_m = 3e-6
    loop = chord_loop("slice", SLICE, tolerance_m)
    error = deviation(loop, SLICE)

    assert 0.9 * tolerance_m < error <= tolerance_m
    lost = sum(edge.area_m2 for edge in SLICE) - loop.area_m2
    assert lost == pytest.approx(2 / 3 * tolerance_m * 2.4 * (0.05 - 0.02), rel=0.1)
    assert not loop.bulges.any()


def test_deviation_sees_a_displaced_vertex_and_a_missing_piece():
    loop = arc_loop("slice", SLICE, 2e-6)
    moved = np.array(loop.vertices_m)
    moved[0] *= 1 + 1e-4
    cut = BulgeLoop(
        name="cut",
        vertices_m=np.delete(loop.vertices_m, 1, axis=0),
        bulges=np.delete(loop.bulges, 1),
    )

    assert deviation(
        BulgeLoop(name="m", vertices_m=moved, bulges=loop.bulges), SLICE
    ) == pytest.approx(5e-6, rel=1e-3)
    assert deviation(cut, SLICE) > 1e-3


@pytest.mark.parametrize("tolerance_m", [0.0, -1e-6, 1e-9, 2e-3, np.nan])
def test_loops_refuse_a_tolerance_out_of_range(tolerance_m):
    with pytest.raises(DesignError, match=r"must be from 0\.01 to 1000"):
        arc_loop("slice", SLICE, tolerance_m)
    with pytest.raises(DesignError, match="tolerance_um"):
        chord_loop("slice", SLICE, tolerance_m)
