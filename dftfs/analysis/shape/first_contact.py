"""First contact of the coils as a smooth function of shape, with its derivatives.

At first contact a point of the gap's ceiling lies on its floor and the two deformed edges are
parallel there: three equations H for the rim's angle and the two places on the edges. They are
solved from the sampled search of `dftfs.spring.rod_contact`; the implicit function theorem gives
the derivatives of the angle.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from dftfs.analysis.shape.equilibrium import (
    STENCIL,
    STEP,
    Sensitivity,
    ShapedArm,
    Stencil,
    difference,
    sensitivity,
)
from dftfs.analysis.shape.space import ShapeSpace
from dftfs.errors import SolveError
from dftfs.spring.clearance import CEILING, FLOOR
from dftfs.spring.edges import Edge, rotate
from dftfs.spring.planar_rod import RodState, twist_rod
from dftfs.spring.rod_contact import Contact, carried_points, contact_onset, section_motion
from dftfs.spring.rod_kernel import evaluate

_TIP = ("tip_face", "tip_round")
_TANGENT_STEP = 1e-4  # of an edge's length, to either side
_BEYOND = 0.01  # of an edge's length: how far beyond its end a place may lie
_ACCURATE = 1e-9  # residual of the three equations, over the thickness


@dataclass(frozen=True, kw_only=True)
class TouchingPlace:
    """Which two edges touch, and where on them, in [0, 1]."""

    floor_edge: str
    ceiling_edge: str
    floor_at: float
    ceiling_at: float


@dataclass(frozen=True, kw_only=True)
class SmoothContact:
    """First contact in one direction: state and place, angle (rad) and torque (Nm) of the spring.

    angle_gradient, torque_gradient : (n,) derivatives in the variables; empty without them.
    """

    state: RodState
    place: TouchingPlace
    angle_rad: float
    torque_Nm: float
    angle_gradient: NDArray
    torque_gradient: NDArray


def first_contacts(
    space: ShapeSpace, shaped: ShapedArm, limit_rad: float
) -> tuple[SmoothContact | None, ...]:
    """First contact winding and unwinding, refined; None where the coils stay apart.

    Raises
    ------
    SolveError
        If the rod or the refinement does not converge.
    """
    material, width = space.start.material, space.start.width_m
    constants = material.youngs_modulus_Pa, material.poisson_ratio
    onset = contact_onset(shaped.outline, width, *constants, limit_rad=limit_rad)
    return tuple(
        None if found is None else refined(shaped, found)
        for found in (onset.winding, onset.unwinding)
    )


def refined(shaped: ShapedArm, sampled: Contact) -> SmoothContact:
    """The contact near a sampled one, to round-off.

    Raises
    ------
    SolveError
        If no pair of edges near the sampled place meets the three equations.
    """
    begin = twist_rod(shaped.arm.rod, sampled.deflection_rad)
    places = _nearest_places(shaped, begin, np.array(sampled.at_m))
    for place in places:

        def equations(unknown: NDArray, place: TouchingPlace = place) -> NDArray:
            state = twist_rod(shaped.arm.rod, unknown[0], begin)
            at = {"floor_at": unknown[1], "ceiling_at": unknown[2]}
            return touching(shaped, state, replace(place, **at))

        guess = [sampled.deflection_rad, place.floor_at, place.ceiling_at]
        found = root(equations, guess, method="hybr", options={"xtol": 1e-13})
        angle, floor_at, ceiling_at = map(float, found.x)
        inside = all(-_BEYOND <= at <= 1 + _BEYOND for at in (floor_at, ceiling_at))
        if inside and np.max(np.abs(found.fun)) < _ACCURATE:
            state = twist_rod(shaped.arm.rod, angle, begin)
            return SmoothContact(
                state=state,
                place=replace(place, floor_at=floor_at, ceiling_at=ceiling_at),
                angle_rad=angle,
                torque_Nm=torque_of(shaped, state),
                angle_gradient=np.empty(0),
                torque_gradient=np.empty(0),
            )
    raise SolveError(
        f"first contact near {sampled.deflection_rad:.4g} rad is at a corner, between"
        f" {places[0].ceiling_edge} and {places[0].floor_edge}, where it has no derivative"
    )


def with_gradient(
    shaped: ShapedArm, stencil: list[Stencil], contact: SmoothContact
) -> SmoothContact:
    """A contact with the derivatives of its angle and its torque."""
    change = sensitivity(shaped, stencil, contact.state)
    columns = [change.by_angle(lambda arm, state: touching(arm, state, contact.place))]
    for name in ("floor_at", "ceiling_at"):
        at = getattr(contact.place, name)
        places = [replace(contact.place, **{name: at + STEP * times}) for times, _ in STENCIL]
        columns.append(difference([touching(shaped, contact.state, one) for one in places]))
    by_shape = change.gradient(lambda arm, state: touching(arm, state, contact.place))
    angle = -np.linalg.solve(np.array(columns).T, by_shape.T)[0]
    torque = torque_gradient(change) + angle * torque_slope(change)
    return replace(contact, angle_gradient=angle, torque_gradient=torque)


def torque_of(shaped: ShapedArm, state: RodState) -> float:
    """Torque of the whole spring, in Nm, by virtual work of a turn that grows along the arm.

    In equilibrium it is the rim's reaction; the round-off of all sections is averaged.
    """
    tables, dofs = shaped.arm.rod.tables, state.dofs
    residual = evaluate(tables, dofs)[1].reshape(-1, 3)
    turn = (shaped.arm.arc_m - shaped.arm.arc_m[0]) / np.ptp(shaped.arm.arc_m)
    work = dofs[:, 0] * residual[:, 1] - dofs[:, 1] * residual[:, 0] + residual[:, 2]
    unit = tables.force_unit_N * tables.length_m
    return float(shaped.outline.parameters.n_arms * unit * (turn @ work))


def torque_gradient(change: Sensitivity) -> NDArray:
    """Derivatives of the torque in the variables, at a fixed angle."""
    return change.gradient(lambda arm, state: np.array(torque_of(arm, state)))


def torque_slope(change: Sensitivity) -> float:
    """Derivative of the torque over the angle."""
    return float(change.by_angle(lambda arm, state: np.array(torque_of(arm, state))))


def touching(shaped: ShapedArm, state: RodState, place: TouchingPlace) -> NDArray:
    """Distance of the two places (2) and sine of the angle between the edges; over the thickness.

    The places are continued beyond [0, 1] by nothing: an edge's own formula holds there.
    """
    floor, along_floor = _carried_place(shaped, state, place.floor_edge, place.floor_at, floor=True)
    ceiling, along = _carried_place(
        shaped, state, place.ceiling_edge, place.ceiling_at, floor=False
    )
    apart = (ceiling - floor) / shaped.outline.parameters.thickness_m
    sine = along_floor[0] * along[1] - along_floor[1] * along[0]
    return np.array([*apart, sine])


def _carried_place(
    shaped: ShapedArm, state: RodState, name: str, at: float, *, floor: bool
) -> tuple[NDArray, NDArray]:
    """Deformed point and unit tangent of an edge of coil gap 0."""
    edge = _edges(shaped)[name]
    t = at + _TANGENT_STEP * np.array([-1.0, 0.0, 1.0])
    points = carried_edge(shaped, state, edge, t, floor=floor)
    along = points[2] - points[0]
    return points[1], along / np.linalg.norm(along)


def carried_edge(
    shaped: ShapedArm, state: RodState, edge: Edge, t: NDArray, *, floor: bool
) -> NDArray:
    """Deformed points (k, 2) of an edge of coil gap 0 at its parameters (k,)."""
    arm = shaped.arm
    theta = edge.parameter(t) if hasattr(edge, "parameter") else np.full(len(t), np.nan)
    if edge.name.split(":")[0] in _TIP:
        theta = np.full(len(t), arm.outline.feet.tip_theta)
    points, motion = edge.point(t), section_motion(arm, state)
    if not floor:
        return carried_points(arm, points, theta, np.inf, motion)
    pitch = arm.outline.parameters.pitch_rad
    return rotate(carried_points(arm, rotate(points, -pitch), theta, -np.inf, motion), pitch)


def _edges(shaped: ShapedArm) -> dict[str, Edge]:
    return {edge.name.split(":")[0]: edge for edge in shaped.outline.coil_gaps[0]}


def _nearest_places(shaped: ShapedArm, state: RodState, at_m: NDArray) -> list[TouchingPlace]:
    """Places of floor and ceiling near a point, the two nearest edges of each, nearest first."""
    edges, t = _edges(shaped), np.linspace(0, 1, 801)
    near: dict[bool, list[tuple[float, str, float]]] = {True: [], False: []}
    for names, floor in ((FLOOR, True), (CEILING, False)):
        for name in names:
            if name in edges:
                points = carried_edge(shaped, state, edges[name], t, floor=floor)
                distance = np.linalg.norm(points - at_m, axis=1)
                best = int(np.argmin(distance))
                near[floor].append((float(distance[best]), name, float(t[best])))
    pairs = [
        (floor[0] + ceiling[0], floor, ceiling)
        for floor in sorted(near[True])[:2]
        for ceiling in sorted(near[False])[:3]
    ]
    return [
        TouchingPlace(floor_edge=f[1], ceiling_edge=c[1], floor_at=f[2], ceiling_at=c[2])
        for _, f, c in sorted(pairs)
    ]
