"""What a shape is judged by, with derivatives: stiffness, area, stress both ways, first contact.

The width is not a variable: of one outline, stiffness, torque and mass go with it, so that it
follows from the stiffness asked. Stress is per torque, at the angle of the operating torque, and is
divided by the width like the section is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.shape.equilibrium import (
    ShapedArm,
    difference,
    neighbours,
    sensitivity,
    shaped_arm,
)
from dftfs.analysis.shape.first_contact import (
    SmoothContact,
    first_contacts,
    torque_of,
    with_gradient,
)
from dftfs.analysis.shape.space import ShapeSpace
from dftfs.errors import SolveError
from dftfs.spring.notch import notch_factor
from dftfs.spring.planar_rod import RodState, twist_rod
from dftfs.spring.rod_kernel import band_solve, band_times, element_nodes, evaluate
from dftfs.spring.section import curved_strip_stress

DIRECTIONS = ("winding", "unwinding")
_GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # the two points of an element of the rod
POINT_SHAPES = np.stack(
    [_GAUSS * (_GAUSS - 1) / 2, 1 - _GAUSS**2, _GAUSS * (_GAUSS + 1) / 2], axis=1
)
_FURTHEST = 3.0  # times the angle asked for: how far contact is looked for


@dataclass(frozen=True, kw_only=True)
class Correction:
    """Finite elements over rod model, for what the rod only estimates.

    stiffness; hub and rim: the notch stress there; arm: bending stress between the roots;
    contact: torque at first contact per direction.
    """

    stiffness: float = 1.0
    hub: float = 1.0
    rim: float = 1.0
    arm: float = 1.0
    contact: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(DIRECTIONS, 1.0))


@dataclass(frozen=True, kw_only=True)
class Responses:
    """Values at the starting width, and their derivatives; n variables, m places of stress.

    stress_per_torque : (2 m,) Pa/Nm, places along the arm winding, then unwinding; the first and
    last of each are the notches. contact_Nm : (2,), at most `_FURTHEST` times the asked one.
    Each name with ``_gradient`` has shape (n,) or (n, k).
    """

    stiffness_Nm_per_rad: float
    area_m2: float
    stress_per_torque: NDArray
    contact_Nm: NDArray
    stiffness_gradient: NDArray
    area_gradient: NDArray
    stress_gradient: NDArray
    contact_gradient: NDArray
    contacts: tuple[SmoothContact | None, ...]
    arc_m: NDArray


def responses(
    space: ShapeSpace,
    variables: NDArray,
    *,
    angle_rad: float,
    correction: Correction | None = None,
) -> Responses:
    """Judge a shape at plus and minus an angle of the rim.

    Raises
    ------
    DesignError
        If the variables make no solid, or coils touch at rest.
    SolveError
        If the rod cannot be turned that far.
    """
    fix = correction or Correction()
    here, stencil = shaped_arm(space, variables), neighbours(space, variables)
    stress, stress_rows = [], []
    for sign in (1.0, -1.0):
        state = twist_rod(here.arm.rod, sign * angle_rad)
        change = sensitivity(here, stencil, state)
        stress.append(stress_profile(here, state, fix))
        stress_rows.append(change.gradient(lambda arm, s: stress_profile(arm, s, fix)))
    contacts = tuple(
        None if found is None else with_gradient(here, stencil, found)
        for found in first_contacts(space, here, _FURTHEST * angle_rad)
    )
    far = _FURTHEST * angle_rad * _stiffness(here)
    torque, slope = _contact_rows(contacts, far, len(variables), fix)
    return Responses(
        stiffness_Nm_per_rad=fix.stiffness * _stiffness(here),
        area_m2=here.outline.area_m2,
        stress_per_torque=np.concatenate(stress),
        contact_Nm=torque,
        stiffness_gradient=fix.stiffness
        * np.array([difference([_stiffness(arm) for arm in arms]) for arms in stencil]),
        area_gradient=np.array(
            [difference([arm.outline.area_m2 for arm in arms]) for arms in stencil]
        ),
        stress_gradient=np.concatenate(stress_rows, axis=1),
        contact_gradient=slope,
        contacts=contacts,
        arc_m=here.arm.section_arc_m,
    )


def _contact_rows(
    contacts: tuple[SmoothContact | None, ...], far: float, count: int, fix: Correction
) -> tuple[NDArray, NDArray]:
    torque, rows = [], []
    for direction, found in zip(DIRECTIONS, contacts, strict=True):
        share = fix.contact[direction]
        torque.append(share * (far if found is None else abs(found.torque_Nm)))
        empty = np.zeros(count)
        rows.append(
            empty if found is None else share * np.sign(found.torque_Nm) * found.torque_gradient
        )
    return np.array(torque), np.array(rows).T


def _stiffness(shaped: ShapedArm) -> float:
    """Stiffness at rest by the energy of the linear state: round-off enters only squared."""
    tables = shaped.arm.rod.tables
    gradient, weight, angle, unloaded, stiffness = tables.kernel
    _, _, band = evaluate(tables, tables.start)
    x, y, _ = tables.start[-1]
    moved = np.zeros(tables.start.size)
    moved[-3:] = -y, x, 1.0
    moved[3:-3] = -band_solve(band[:, 3:-3], band_times(band, moved)[3:-3])
    element = moved.reshape(-1, 3)[element_nodes(len(tables.start))]
    slope = np.einsum("mgi,mic->mgc", gradient, element)
    turn = np.einsum("gi,mi->mg", POINT_SHAPES, element[..., 2])
    cosine, sine = np.cos(angle), np.sin(angle)
    along = cosine * slope[..., 0] + sine * slope[..., 1] + unloaded[..., 1] * turn
    across = cosine * slope[..., 1] - sine * slope[..., 0] - unloaded[..., 0] * turn
    strains = np.stack([along, slope[..., 2], across], axis=-1)
    unit = tables.force_unit_N * tables.length_m
    work = float(np.sum(weight[..., None] * stiffness * strains**2))
    return shaped.outline.parameters.n_arms * unit * work


def stress_profile(shaped: ShapedArm, state: RodState, fix: Correction) -> NDArray:
    """Stress over the spring's torque along the arm, Pa/Nm: hub notch, sections, rim notch.

    Of a section the larger face counts.

    Raises
    ------
    SolveError
        If the state carries no torque.
    """
    torque = abs(torque_of(shaped, state))
    if torque == 0:
        raise SolveError("a state without torque has no stress over torque")
    arm, p = shaped.arm, shaped.outline.parameters
    moment = state.bending_moment_Nm[2:-2]
    thickness = p.thickness_at(arm.section_theta)
    radius = 1 / p.centreline.curvature(arm.section_theta)
    faces = curved_strip_stress(-moment, thickness, arm.width_m, radius)
    body = fix.arm * np.maximum(np.abs(faces[0]), np.abs(faces[1]))
    roots = np.array([p.thickness_m, p.thickness_at_rim_m])
    bending = 6 * np.abs(moment[[0, -1]]) / (arm.width_m * roots**2)
    notches = notch_factor(p.fillet_radius_m / roots) * bending * np.array([fix.hub, fix.rim])
    return np.concatenate([notches[:1], body, notches[1:]]) / torque
