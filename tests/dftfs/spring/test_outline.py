"""The outline is a closed smooth loop of exact edges, or is refused with what would do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from dftfs.errors import DesignError
from dftfs.spring.clearance import measure_clearance, sample_coil_gap
from dftfs.spring.outline import build_outline, coil_gap
from tests.cases.spring import FIT, ONE_ARM, REF, THREE_ARMS

CASES = {"fit": FIT, "ref": REF, "three arms": THREE_ARMS, "one arm": ONE_ARM}


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.mark.parametrize("parameters", CASES.values(), ids=CASES.keys())
def test_every_coil_gap_is_a_closed_loop_smooth_but_at_no_corner(parameters):
    outline = build_outline(parameters)
    assert len(outline.coil_gaps) == parameters.n_arms
    for loop in outline.coil_gaps:
        for edge, following in zip(loop, [*loop[1:], loop[0]]):
            np.testing.assert_allclose(edge.point(1.0), following.point(0.0), atol=1e-14)
            assert abs(cross(edge.tangent(1.0), following.tangent(0.0))) < 1e-9, edge.name


def test_a_sharp_tip_is_the_only_corner():
    outline = build_outline(replace(FIT, tip_radius_m=0.0))
    loop = outline.coil_gaps[0]
    kinks = [
        edge.name
        for edge, following in zip(loop, [*loop[1:], loop[0]])
        if abs(cross(edge.tangent(1.0), following.tangent(0.0))) > 1e-9
    ]
    assert kinks == ["tip_face:0"]


@pytest.mark.parametrize("parameters", CASES.values(), ids=CASES.keys())
def test_area_is_the_shoelace_area_of_a_fine_polygon(parameters):
    outline = build_outline(parameters)
    area = np.pi * (parameters.rim_outer_radius_m**2 - parameters.bore_radius_m**2)
    for loop in outline.coil_gaps:
        points = np.concatenate([edge.point(np.linspace(0, 1, 4001)[:-1]) for edge in loop])
        x, y = points.T
        area += 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert outline.area_m2 == pytest.approx(area, rel=1e-6)


def test_fillets_have_their_radius_and_touch_hub_and_rim():
    outline = build_outline(FIT)
    for name, ring in (("notch_fillet:0", 18.38e-3), ("slit_fillet:0", 78.92e-3)):
        edge = outline.edge(name)
        assert edge.radius_m == pytest.approx(0.5e-3, rel=1e-12)
        ends = [np.hypot(*edge.point(t)) for t in (0.0, 1.0)]
        assert min(abs(end - ring) for end in ends) < 1e-14


def test_half_a_millimetre_of_slit_fillet_moves_the_arms_end_by_some_30_mm():
    """spec/spring.md: in the narrow wedge the fillet sets where the arm ends."""
    line = FIT.centreline
    ends = [
        build_outline(replace(FIT, fillet_radius_m=r)).feet.slit_theta for r in (0.5e-3, 1.0e-3)
    ]
    assert line.length(ends[1], ends[0]) == pytest.approx(0.030, abs=0.006)


def test_the_slit_closes_where_arm_and_rim_are_two_fillet_radii_apart():
    outline = build_outline(FIT)
    radius = float(FIT.centreline.radius(outline.feet.slit_theta))
    assert radius + FIT.thickness_m / 2 + 2 * FIT.fillet_radius_m == pytest.approx(
        FIT.rim_inner_radius_m, abs=5e-6
    )


def test_arms_are_the_same_edge_turned_by_one_pitch():
    outline = build_outline(THREE_ARMS)
    points = outline.edge("arm_inner:0").point(np.linspace(0, 1, 9))
    turned = outline.edge("arm_inner:2").point(np.linspace(0, 1, 9))
    angle = 2 * THREE_ARMS.pitch_rad
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(points @ turn.T, turned, atol=1e-15)


def test_clearance_by_projection_equals_the_normal_gap_of_the_coils():
    outline = build_outline(FIT)
    samples = sample_coil_gap(outline, 0.3e-3)
    clearance = measure_clearance(samples.floor_m, samples.ceiling_m, deepest_m=FIT.thickness_m / 2)
    ceiling = outline.edge("arm_inner:0").point(np.linspace(0, 1, 60001))
    arm = (samples.floor_kind == "arm_outer") & (samples.floor_theta < 9.5)
    nearest = cKDTree(ceiling).query(samples.floor_m[arm])[0]
    np.testing.assert_allclose(clearance.floor_gap_m[arm], nearest, atol=2e-6)
    theta = np.array([FIT.centreline.end - 1e-6])
    assert coil_gap(FIT, theta)[0] == pytest.approx(clearance.floor_gap_m[arm].min(), abs=0.15e-3)


def test_gap_between_offset_samples_is_the_perpendicular_not_the_nearest_sample():
    upwards = np.stack([np.linspace(10, 0, 11), np.zeros(11)], axis=1)
    downwards = np.stack([np.linspace(-0.5, 10.5, 12), np.full(12, 0.1)], axis=1)
    assert cKDTree(upwards).query(downwards)[0].min() > 0.5
    found = measure_clearance(upwards, downwards, deepest_m=1.0).smallest_m
    assert found == pytest.approx(0.1, rel=1e-12)


def test_overlapping_edges_have_a_negative_gap_and_backs_do_not_count():
    upwards = np.stack([np.linspace(10, 0, 11), np.zeros(11)], axis=1)
    downwards = np.stack([np.linspace(-0.5, 10.5, 12), np.full(12, -0.1)], axis=1)
    found = measure_clearance(upwards, downwards, deepest_m=1.0).smallest_m
    assert found == pytest.approx(-0.1, rel=1e-12)
    assert measure_clearance(upwards, downwards, deepest_m=0.05).smallest_m == np.inf
    assert measure_clearance(upwards, downwards[::-1], deepest_m=1.0).smallest_m == np.inf


REFUSALS = [
    ({"thickness_m": -1e-3}, r"thickness_mm = -1 must be positive"),
    ({"n_arms": 0}, r"n_arms = 0 must be a whole number"),
    ({"bore_radius_m": 0.02}, r"bore_radius_mm = 20 must be below hub_radius_mm = 18.38"),
    ({"turns": 4.0}, r"arms overlap by .* thickness_mm below [\d.]+ or turns below [\d.]+ would"),
    ({"rim_inner_radius_m": 0.085}, r"slit .* does not close .* rim_inner_radius_mm below [\d.]+"),
    ({"fillet_radius_m": 8e-3}, r"fillet_radius_mm = 8 does not fit at the arm's tip.* at most"),
    ({"fillet_radius_m": 6e-3}, r"fillet_radius_mm = 6 does not fit: at the rim"),
    ({"hub_radius_m": 3e-3, "bore_radius_m": 1e-3}, r"hub_radius_mm = 3.*above [\d.]+ would work"),
    ({"tip_radius_m": 4e-3}, r"tip_radius_mm = 4 .* half of thickness_mm = 7.7"),
    ({"thickness_m": 30e-3}, r"thickness_mm = 30: the strip folds .* thickness_mm below [\d.]+"),
]


@pytest.mark.parametrize(("change", "message"), REFUSALS, ids=[str(c) for c, _ in REFUSALS])
def test_impossible_combinations_are_refused_with_the_number_that_would_do(change, message):
    with pytest.raises(DesignError, match=message) as refusal:
        build_outline(replace(FIT, **change))
    assert "\n" not in str(refusal.value)


def test_the_number_that_would_do_does():
    with pytest.raises(DesignError) as refusal:
        build_outline(replace(FIT, turns=4.0))
    numbers = str(refusal.value).split("below ")
    thickness, turns = float(numbers[1].split()[0]), float(numbers[2].split()[0])
    rim = FIT.outer_radius_m + thickness * 1e-3 / 2
    build_outline(replace(FIT, turns=4.0, thickness_m=0.98e-3 * thickness, rim_inner_radius_m=rim))
    build_outline(replace(FIT, turns=0.98 * turns))


def test_the_fillet_that_would_do_does():
    with pytest.raises(DesignError, match=r"fillet_radius_mm = 6 does not fit") as refusal:
        build_outline(replace(FIT, fillet_radius_m=6e-3))
    largest = float(str(refusal.value).split("fillet_radius_mm below ")[1].split()[0]) * 1e-3
    build_outline(replace(FIT, fillet_radius_m=0.999 * largest))
    with pytest.raises(DesignError):
        build_outline(replace(FIT, fillet_radius_m=1.001 * largest))


@given(
    turns=st.floats(0.8, 2.2),
    thickness=st.floats(3e-3, 8e-3),
    fillet=st.floats(0.3e-3, 1.5e-3),
    n_arms=st.integers(1, 4),
)
@settings(max_examples=40, deadline=None)
def test_whatever_is_accepted_has_no_overlap_and_less_area_than_its_disc(
    turns, thickness, fillet, n_arms
):
    p = replace(
        FIT,
        turns=turns,
        thickness_m=thickness,
        fillet_radius_m=fillet,
        n_arms=n_arms,
        rim_inner_radius_m=FIT.outer_radius_m + thickness / 2,
    )
    try:
        outline = build_outline(p)
    except DesignError:
        return
    samples = sample_coil_gap(outline, 1e-3)
    gap = measure_clearance(samples.floor_m, samples.ceiling_m, deepest_m=thickness / 2)
    assert gap.smallest_m > 0
    rings = np.pi * (p.rim_outer_radius_m**2 - p.rim_inner_radius_m**2)
    rings += np.pi * (p.hub_radius_m**2 - p.bore_radius_m**2)
    assert rings < outline.area_m2 < np.pi * p.rim_outer_radius_m**2
