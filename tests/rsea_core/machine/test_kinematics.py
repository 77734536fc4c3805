"""The rig's kinematics are products of elementary motions; the printed matrix is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rsea_core import InputError
from rsea_core.machine.kinematics import (
    LinkParameters,
    RigGeometry,
    link_end_pose,
    link_end_position_m,
    link_transform,
    printed_rotation,
)

RIG = RigGeometry(base_height_m=0.31, arm_length_m=0.22, link_offset_m=0.045, link_length_m=0.3)
angle = st.floats(-3.1, 3.1)
# two evaluations of five products, each entry a sum of four terms of at most one
ROUND_OFF = 2 * 5 * 4 * np.finfo(float).eps


def elementary(axis, rotation_rad=0.0, shift_m=0.0):
    """A turn about an axis and a shift along it, as scipy has the rotation."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, rotation_rad).as_matrix()
    T["xyz".index(axis), 3] = shift_m
    return T


@settings(max_examples=25, deadline=None)
@given(angle, angle, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_link_transform_is_the_product_of_its_four_motions(twist, turn, length, offset):
    """Craig 3.4: turn and shift along x_{i-1}, then turn and shift along z_i."""
    link = LinkParameters(twist_rad=twist, length_m=length, offset_m=offset)
    expected = elementary("x", twist, length) @ elementary("z", turn, offset)
    np.testing.assert_allclose(link_transform(link, turn), expected, atol=ROUND_OFF)


@settings(max_examples=25, deadline=None)
@given(angle, angle, angle)
def test_pose_is_a_product_of_elementary_motions_and_a_rotation(t1, t2, t3):
    expected = (
        elementary("z", t1, 0.31)
        @ elementary("x", np.pi / 2, 0.22)
        @ elementary("z", t2)
        @ elementary("z", t3, 0.045)
        @ elementary("x", 0.0, 0.3)
    )
    pose = link_end_pose(RIG, t1, t2, t3)
    np.testing.assert_allclose(pose, expected, atol=ROUND_OFF)
    R = pose[:3, :3]
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=ROUND_OFF)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=10 * ROUND_OFF)
    np.testing.assert_allclose(link_end_position_m(RIG, t1, t2, t3), pose[:3, 3], atol=ROUND_OFF)


def test_rotation_is_the_corrected_matrix_of_errata_d4():
    t1, t2, t3 = 0.4, -0.7, 1.9
    c1, s1, c23, s23 = np.cos(t1), np.sin(t1), np.cos(t2 + t3), np.sin(t2 + t3)
    expected = [[c1 * c23, -c1 * s23, s1], [s1 * c23, -s1 * s23, -c1], [s23, c23, 0.0]]
    np.testing.assert_allclose(link_end_pose(RIG, t1, t2, t3)[:3, :3], expected, atol=ROUND_OFF)


@settings(max_examples=25, deadline=None)
@given(angle, angle, angle)
def test_printed_matrix_is_no_rotation(t1, t2, t3):
    """Errata D4: its determinant is zero for every pose."""
    assert np.linalg.det(printed_rotation(t1, t2, t3)) == pytest.approx(0.0, abs=ROUND_OFF)


def test_printed_columns_are_the_true_ones_shifted():
    true, printed = link_end_pose(RIG, 0.4, -0.7, 1.9)[:3, :3], printed_rotation(0.4, -0.7, 1.9)
    np.testing.assert_allclose(printed[:2, 2], true[:2, 1], atol=ROUND_OFF)
    np.testing.assert_allclose(printed[:2, 1], true[:2, 0], atol=ROUND_OFF)


def test_printed_link_matrix_of_2_9_is_no_rigid_motion_of_this_rig():
    """Errata D1: with a_1 = 0.22 m taken as an angle the joint would not be upright."""
    a = 0.22
    axis = np.array([0.0, -np.sin(a), np.cos(a)])  # z of frame 2 by the printed formula
    true = link_transform(RIG.links()[1], 0.0)[:3, 2]
    assert true == pytest.approx([0.0, -1.0, 0.0], abs=ROUND_OFF)
    assert np.rad2deg(np.arccos(axis @ true)) == pytest.approx(90.0 - np.rad2deg(a), abs=1e-9)


def test_hand_calculated_pose():
    """Arm along +x, link straight out and up: reach d1, height d0 + d3, offset to -y."""
    position = link_end_position_m(RIG, 0.0, np.pi / 2, 0.0)
    np.testing.assert_allclose(position, [0.22, -0.045, 0.61], atol=ROUND_OFF)


def test_lengths_must_be_finite():
    with pytest.raises(InputError, match="rig geometry: arm_length_m = nan must be finite"):
        RigGeometry(base_height_m=0.3, arm_length_m=np.nan, link_offset_m=0.0, link_length_m=0.3)
