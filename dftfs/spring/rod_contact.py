"""First contact of the coils in each direction, by the rod model.

The facing edges of a coil gap are carried along: points of an arm's edge with the rod's section at
their centreline parameter, beyond the rod's ends with the hub (which stands) or the rim (which
turns). The gap between them is measured by projection (`dftfs.spring.clearance`); the deflection
is increased until it is gone and the zero then refined.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from dftfs.errors import DesignError
from dftfs.spring.clearance import Clearance, CoilGapSamples, measure_clearance, sample_coil_gap
from dftfs.spring.edges import rotate
from dftfs.spring.outline import SpringOutline
from dftfs.spring.planar_rod import RodState, twist_rod
from dftfs.spring.rod import ArmRod, RootLengths, arm_rod

_SPACING = 1 / 80  # of the outer radius, between samples: chords 2e-5 radii off their curve
_STEP = (
    0.4  # of the strip's thickness: how far the rim may move between two measurements of the gap
)
_TIP = ("tip_face", "tip_round")
_ANGLE_TOLERANCE_RAD = 1e-6


@dataclass(frozen=True, kw_only=True)
class Contact:
    """First contact in one direction: signed deflection and torque, place in the deformed gap 0."""

    deflection_rad: float
    torque_Nm: float
    at_m: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Onset:
    """First contact per direction; None where the coils stay apart up to ``limit_rad``."""

    winding: Contact | None
    unwinding: Contact | None
    limit_rad: float


def contact_onset(
    outline: SpringOutline,
    width_m: float,
    youngs_modulus_Pa: float,
    poisson_ratio: float,
    *,
    limit_rad: float = 1.5,
    roots: RootLengths | None = None,
    wide: bool = False,
) -> Onset:
    """Where the coils first touch, winding and unwinding.

    Parameters
    ----------
    limit_rad : float
        How far to look in each direction.
    roots, wide : optional
        As for `dftfs.spring.rod.arm_rod`.

    Raises
    ------
    DesignError
        If the limit, the width or a material constant is out of range, or coils touch at rest.
    SolveError
        If the rod has no equilibrium on the way; the message names the deflection.
    """
    if not (np.isfinite(limit_rad) and limit_rad > 0):
        raise DesignError(f"limit_rad = {limit_rad!r} must be positive")
    arm = arm_rod(outline, width_m, youngs_modulus_Pa, poisson_ratio, roots=roots, wide=wide)
    samples = sample_coil_gap(outline, _SPACING * outline.parameters.outer_radius_m)
    rest = twist_rod(arm.rod, 0.0)
    gap = state_clearance(arm, samples, rest)
    if gap.smallest_m <= 0:
        raise DesignError(
            f"the coils touch at rest, near x, y = {gap.at_m[0] * 1e3:.4g},"
            f" {gap.at_m[1] * 1e3:.4g} mm; a smaller thickness_mm would work"
        )
    return Onset(
        winding=first_contact(arm, samples, rest, limit_rad),
        unwinding=first_contact(arm, samples, rest, -limit_rad),
        limit_rad=limit_rad,
    )


def state_clearance(arm: ArmRod, samples: CoilGapSamples, state: RodState) -> Clearance:
    """Distance between the floor and the ceiling of coil gap 0 in a state of the rod."""
    floor, ceiling = deformed_coil_gap(arm, samples, state)
    return measure_clearance(floor, ceiling, deepest_m=arm.outline.parameters.thickness_m / 2)


def deformed_coil_gap(
    arm: ArmRod, samples: CoilGapSamples, state: RodState
) -> tuple[NDArray, NDArray]:
    """Sampled floor (of arm 1, and the hub) and ceiling (of arm 0, and the rim), carried along.

    Returns
    -------
    floor, ceiling : (n, 2) and (m, 2) arrays in m.
    """
    pitch = arm.outline.parameters.pitch_rad
    # the floor is of the next arm: seen from there it is arm 0, and its hub stands
    floor = rotate(samples.floor_m, -pitch)
    motion = section_motion(arm, state)
    floor = carried_points(arm, floor, samples.floor_theta, -np.inf, motion)
    # the tip belongs to the arm, as far as the neck behind it lets the arm turn on its own
    tip = np.isin(samples.ceiling_kind, _TIP)
    theta = np.where(tip, arm.outline.feet.tip_theta, samples.ceiling_theta)
    return rotate(floor, pitch), carried_points(arm, samples.ceiling_m, theta, np.inf, motion)


def section_motion(arm: ArmRod, state: RodState) -> CubicSpline:
    """Places before and after (2 each) and turn of a state's sections over their arc length."""
    motion = np.column_stack([arm.rod.nodes_m, state.nodes_m, state.rotation_rad])
    return CubicSpline(arm.arc_m, motion)


def carried_points(
    arm: ArmRod, points: NDArray, theta: NDArray, otherwise: float, motion: CubicSpline
) -> NDArray:
    """Points (n, 2) of arm 0 moved with the section at their arc length (`section_motion`).

    ``theta`` (n,): their centreline parameter, nan on no arm; ``otherwise`` is the arc length of
    those: minus infinity on the hub, which stands, infinity on the rim, which turns.
    """
    line, nodes = arm.outline.parameters.centreline, arm.arc_m
    first, last = arm.theta[0], arm.theta[-1]
    arc = np.interp(theta, arm.theta, nodes[2:-2])
    arc += np.minimum(theta - first, 0) * line.speed(first)
    arc += np.maximum(theta - last, 0) * line.speed(last)
    arc = np.where(np.isnan(theta), otherwise, arc).clip(nodes[0], nodes[-1])
    before, after, turn = np.split(motion(arc), [2, 4], axis=1)
    cosine, sine = np.cos(turn[:, 0]), np.sin(turn[:, 0])
    x, y = (points - before).T
    return after + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def first_contact(
    arm: ArmRod, samples: CoilGapSamples, rest: RodState, limit_rad: float
) -> Contact | None:
    """First contact on the way from rest to a deflection of either sign, None where there is none.

    Raises
    ------
    SolveError
        If the rod has no equilibrium on the way.
    """
    p = arm.outline.parameters
    step = np.copysign(_STEP * p.thickness_m / p.outer_radius_m, limit_rad)
    looks = np.append(np.arange(step, limit_rad, step), limit_rad)
    here, angle = rest, 0.0
    for target in looks:
        ahead = twist_rod(arm.rod, target, here)
        if state_clearance(arm, samples, ahead).smallest_m <= 0:
            break
        here, angle = ahead, float(target)
    else:
        return None

    def gap(deflection: float) -> float:
        return state_clearance(arm, samples, twist_rod(arm.rod, deflection, here)).smallest_m

    zero = float(brentq(gap, angle, float(target), xtol=_ANGLE_TOLERANCE_RAD))
    state = twist_rod(arm.rod, zero, here)
    at = state_clearance(arm, samples, state).at_m
    return Contact(
        deflection_rad=zero,
        torque_Nm=p.n_arms * state.end_torque_Nm,
        at_m=(float(at[0]), float(at[1])),
    )
