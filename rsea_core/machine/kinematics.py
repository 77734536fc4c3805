"""Kinematics of the rig: the arm in the horizontal plane and the pendulum link at its end.

Link frames after Craig's modified Denavit-Hartenberg convention; all angles in rad, lengths in
m. Theta_1 is the arm's angle, theta_2 the wheel's (theta_1 / N in the thesis' Table 2.8),
theta_3 the link's against the wheel. The thesis' printed matrices are wrong in two places
(errata D1, D4); what is here is the product of the link transformations.

Source: Craig, Introduction to Robotics (2005), equation 3.6; Table 2.8 of the thesis.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.numeric.arrays import read_only


@dataclass(frozen=True, kw_only=True)
class LinkParameters:
    """One row of a modified Denavit-Hartenberg table.

    Attributes
    ----------
    twist_rad, length_m : float
        alpha_{i-1} and a_{i-1}: from axis i-1 to axis i.
    offset_m : float
        d_i along axis i.
    """

    twist_rad: float = 0.0
    length_m: float = 0.0
    offset_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class RigGeometry:
    """Lengths d_0 .. d_3 of the thesis' Table 2.8.

    Attributes
    ----------
    base_height_m : float
        d_0, of the arm's plane.
    arm_length_m : float
        d_1, from the vertical axis to the joint.
    link_offset_m : float
        d_2, of the link along the joint's axis.
    link_length_m : float
        d_3, from the joint's axis to the link's end (L_2 in equation 2.12: errata D3).

    Raises
    ------
    InputError
        If a length is not finite.
    """

    base_height_m: float
    arm_length_m: float
    link_offset_m: float
    link_length_m: float

    def __post_init__(self):
        for name, value in vars(self).items():
            if not np.isfinite(value):
                raise InputError(f"rig geometry: {name} = {value} must be finite")

    def links(self) -> tuple[LinkParameters, ...]:
        """The four rows of Table 2.8; the last joint does not turn."""
        return (
            LinkParameters(offset_m=self.base_height_m),
            LinkParameters(twist_rad=np.pi / 2.0, length_m=self.arm_length_m),
            LinkParameters(offset_m=self.link_offset_m),
            LinkParameters(length_m=self.link_length_m),
        )


def link_transform(link: LinkParameters, angle_rad: float) -> NDArray:
    """Pose of frame i in frame i-1, (4, 4) homogeneous matrix.

    Source
    ------
    Craig (2005), equation 3.6. The thesis' 2.9 takes cosine and sine of the length a_{i-1}
    where the twist alpha_{i-1} belongs (errata D1).
    """
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    ca, sa = np.cos(link.twist_rad), np.sin(link.twist_rad)
    return read_only(
        np.array(
            [
                [c, -s, 0.0, link.length_m],
                [s * ca, c * ca, -sa, -sa * link.offset_m],
                [s * sa, c * sa, ca, ca * link.offset_m],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
    )


def link_end_pose(
    geometry: RigGeometry, arm_rad: float, wheel_rad: float, link_rad: float
) -> NDArray:
    """Pose of the link's end in the ground frame, (4, 4): the product of the four transforms."""
    pose = np.eye(4)
    for link, angle in zip(geometry.links(), (arm_rad, wheel_rad, link_rad, 0.0)):
        pose = pose @ link_transform(link, angle)
    return read_only(pose)


def link_end_position_m(
    geometry: RigGeometry, arm_rad: float, wheel_rad: float, link_rad: float
) -> NDArray:
    """Position (x, y, z) of the link's end, (3,), in closed form.

    Source
    ------
    Equation 2.14 of the thesis, which is right.
    """
    c1, s1 = np.cos(arm_rad), np.sin(arm_rad)
    c23, s23 = np.cos(wheel_rad + link_rad), np.sin(wheel_rad + link_rad)
    reach = geometry.arm_length_m + geometry.link_length_m * c23
    return read_only(
        np.array(
            [
                reach * c1 + geometry.link_offset_m * s1,
                reach * s1 - geometry.link_offset_m * c1,
                geometry.base_height_m + geometry.link_length_m * s23,
            ]
        )
    )


def printed_rotation(arm_rad: float, wheel_rad: float, link_rad: float) -> NDArray:
    """The 3 x 3 block that the thesis prints in 2.13: no rotation, its determinant is 0.

    Its columns are those of the true one shifted: the first column stands a second time, with
    its sign changed, as the third (errata D4). Kept to show that, not for use.
    """
    c1, s1 = np.cos(arm_rad), np.sin(arm_rad)
    c23, s23 = np.cos(wheel_rad + link_rad), np.sin(wheel_rad + link_rad)
    return read_only(
        np.array(
            [[c1 * s23, c1 * c23, -c1 * s23], [s1 * s23, s1 * c23, -s1 * s23], [-c23, s23, c23]]
        )
    )
