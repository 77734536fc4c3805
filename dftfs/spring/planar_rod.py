"""Planar geometrically exact rod: bending, stretching and shear of an initially curved line.

Reissner's strains are measured from the unloaded shape: with the section's angle phi and the
line's slope x' = dx/ds,

    (axial e, shear g) = R(phi)^T x' - R(phi0)^T x0',     bending k = (phi - phi0)'

and the strain energy is the integral of (EA e^2 + GA_s g^2 + EI k^2) / 2. Three-node elements
with two-point integration do not lock and are quartic in the element's length; the tangent is the
exact second derivative of the discrete energy, so symmetric. Taken from felupe: the derivation
stands with the code.

Sources: E. Reissner, "On one-dimensional finite-strain beam theory: the plane problem", ZAMP 23
(1972) 795-804; J. C. Simo, "A finite strain beam formulation", CMAME 49 (1985) 55-70.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError, SolveError
from dftfs.spring.rod_kernel import (
    RodTables,
    band_solve,
    band_times,
    element_nodes,
    evaluate,
    newton,
    rod_tables,
    section_forces,
)

_LOAD_STEP_RAD = 0.3  # turn of the linear rod's sections that one step of a dead load may cause
_SMALLEST_STEP = 1.0 / 2**12  # of what was asked, before an unreachable load is given up
_STIFFNESSES = ("bending_stiffness_Nm2", "axial_stiffness_N", "shear_stiffness_N")


@dataclass(frozen=True, kw_only=True)
class Rod:
    """A rod of three-node elements, unloaded.

    Parameters
    ----------
    nodes_m : (n, 2) array
        Points of the line from its start to its end; n = 2 * elements + 1, every second one
        the middle of an element.
    angles_rad : (n,) array
        Direction of the line's tangent there, continuous along the rod.
    bending_stiffness_Nm2, axial_stiffness_N, shear_stiffness_N : float, (n,) or (m, 3) array
        EI, EA and the shear stiffness GA_s; at the nodes, or at the three nodes of each of the m
        elements where it jumps between them. Kept as (m, 3).

    Raises
    ------
    DesignError
        If the shapes do not fit, the line does not run along its angles, or a stiffness is not
        positive.
    """

    nodes_m: NDArray
    angles_rad: NDArray
    bending_stiffness_Nm2: ArrayLike
    axial_stiffness_N: ArrayLike
    shear_stiffness_N: ArrayLike

    def __post_init__(self) -> None:
        nodes = np.array(self.nodes_m, dtype=float)
        if nodes.ndim != 2 or nodes.shape[1] != 2 or len(nodes) < 3 or len(nodes) % 2 == 0:
            raise DesignError(
                f"rod: nodes_m has shape {nodes.shape}; (n, 2) with n odd, 3 or more, is needed"
            )
        object.__setattr__(self, "nodes_m", _frozen(nodes))
        angles = np.array(self.angles_rad, dtype=float)
        if angles.shape != (len(nodes),):
            raise DesignError(
                f"rod: angles_rad has shape {angles.shape}; {len(nodes)} nodes need ({len(nodes)},)"
            )
        object.__setattr__(self, "angles_rad", _frozen(angles))
        for name in _STIFFNESSES:
            object.__setattr__(self, name, self._by_element(name))
        if not (np.isfinite(nodes).all() and np.isfinite(angles).all()):
            raise DesignError("rod: nodes_m and angles_rad must be finite")
        self._check_line()

    def _by_element(self, name: str) -> NDArray:
        values, count = np.array(getattr(self, name), dtype=float), len(self.nodes_m)
        if values.shape not in ((), (count,), (count // 2, 3)):
            raise DesignError(
                f"rod: {name} has shape {values.shape}; {count} nodes need (), ({count},) or"
                f" ({count // 2}, 3)"
            )
        if not (np.isfinite(values).all() and np.min(values) > 0):
            raise DesignError(f"rod: {name} = {np.min(values):.4g} must be positive and finite")
        if values.ndim == 1:
            values = values[element_nodes(count)]
        return _frozen(np.broadcast_to(values, (count // 2, 3)).copy())

    def _check_line(self) -> None:
        step = np.diff(self.nodes_m, axis=0)
        angle = (self.angles_rad[1:] + self.angles_rad[:-1]) / 2
        forward = step[:, 0] * np.cos(angle) + step[:, 1] * np.sin(angle)
        along = forward > 0.5 * np.linalg.norm(step, axis=1)
        if not along.all():
            index = int(np.argmin(along))
            raise DesignError(
                f"rod: between nodes {index} and {index + 1} the line does not run along"
                " angles_rad; angles within 60 degrees of the line, or more nodes, would work"
            )

    @cached_property
    def tables(self) -> RodTables:
        """The rod without dimensions."""
        return rod_tables(
            self.nodes_m,
            self.angles_rad,
            self.bending_stiffness_Nm2,
            self.axial_stiffness_N,
            self.shear_stiffness_N,
        )

    @property
    def length_m(self) -> float:
        """Length of the unloaded line."""
        return self.tables.length_m

    @property
    def sections_m(self) -> NDArray:
        """Arc lengths of the integration points, where section forces are given, shape (n - 1,)."""
        return self.tables.sections * self.tables.length_m


@dataclass(frozen=True, kw_only=True)
class RodState:
    """A rod in equilibrium.

    nodes_m : (n, 2). rotation_rad : (n,) turn of the sections from the unloaded state.
    axial_force_N, shear_force_N, bending_moment_Nm : (n - 1,) at ``Rod.sections_m``.
    start_force_N, end_force_N (2,), start_moment_Nm, end_moment_Nm : applied from outside at
    the ends. dofs : (n, 3) the state without dimensions, to continue from.
    """

    nodes_m: NDArray
    rotation_rad: NDArray
    axial_force_N: NDArray
    shear_force_N: NDArray
    bending_moment_Nm: NDArray
    start_force_N: NDArray
    start_moment_Nm: float
    end_force_N: NDArray
    end_moment_Nm: float
    strain_energy_J: float
    dofs: NDArray

    @property
    def tip_m(self) -> NDArray:
        """The line's end, shape (2,)."""
        return self.nodes_m[-1]

    @property
    def end_torque_Nm(self) -> float:
        """Moment about the origin of all that is applied to the end."""
        return _torque(self.nodes_m[-1], self.end_force_N, self.end_moment_Nm)

    @property
    def start_torque_Nm(self) -> float:
        """Moment about the origin of all that is applied to the start."""
        return _torque(self.nodes_m[0], self.start_force_N, self.start_moment_Nm)


def solve_rod(
    rod: Rod, tip_force_N: ArrayLike = (0.0, 0.0), tip_moment_Nm: float = 0.0
) -> RodState:
    """A cantilever clamped at its start, with a dead force and a moment at its end.

    Raises
    ------
    SolveError
        If the load cannot be reached; the message says how much of it was.
    """
    tables, free = rod.tables, slice(3, None)
    load = np.zeros(tables.start.size)
    load[-3:-1] = np.asarray(tip_force_N, dtype=float) / tables.force_unit_N
    load[-1] = tip_moment_Nm / (tables.force_unit_N * tables.length_m)

    def reach(share: float, guess: NDArray) -> NDArray | None:
        return newton(tables, guess, free, share * load)

    _, _, band = evaluate(tables, tables.start)
    linear = band_solve(band[:, free], load[free])
    steps = max(1, int(np.ceil(np.max(np.abs(linear[2::3])) / _LOAD_STEP_RAD)))
    dofs, done = tables.start, 0.0
    for share in np.arange(1, steps + 1) / steps:
        dofs = _advance(reach, dofs, done, float(share), what="share of the tip load")
        done = float(share)
    return rod_state(rod, dofs)


def twist_rod(rod: Rod, deflection_rad: float, start: RodState | None = None) -> RodState:
    """Clamp the rod's start and carry its end rigidly about the origin by an angle.

    Parameters
    ----------
    start : RodState, optional
        A twisted state to continue from; the unloaded rod without it.

    Raises
    ------
    SolveError
        If the deflection cannot be reached; the message names it.
    """
    tables = rod.tables
    x, y, _ = tables.start[-1]
    dofs = tables.start if start is None else start.dofs

    def reach(angle: float, guess: NDArray) -> NDArray | None:
        cosine, sine = np.cos(angle), np.sin(angle)
        end = np.array([cosine * x - sine * y, sine * x + cosine * y, angle])
        return newton(tables, guess, slice(3, -3), np.zeros(guess.size), end=end)

    what = "a deflection in rad of"
    return rod_state(rod, _advance(reach, dofs, dofs[-1, 2], float(deflection_rad), what=what))


def twist_stiffness(rod: Rod, state: RodState | None = None) -> float:
    """Tangent of the end's torque about the origin over its angle, in Nm/rad.

    At a twisted state, or of the unloaded rod.
    """
    tables = rod.tables
    dofs = tables.start if state is None else state.dofs
    _, residual, band = evaluate(tables, dofs)
    x, y, _ = dofs[-1]
    moved = np.zeros(dofs.size)
    moved[-3:] = carried = np.array([-y, x, 1.0])
    moved[3:-3] = -band_solve(band[:, 3:-3], band_times(band, moved)[3:-3])
    reaction = band_times(band, moved)[-3:]
    turned_arm = x * residual[-3] + y * residual[-2]  # of the end force, as its place turns
    return float(carried @ reaction - turned_arm) * tables.force_unit_N * tables.length_m


def end_stiffness_N_per_m(rod: Rod) -> NDArray:
    """Force (2, 2) on the end over its small in-plane motion, start and end kept from turning."""
    tables = rod.tables
    _, _, band = evaluate(tables, tables.start)
    columns = []
    for axis in range(2):
        moved = np.zeros(tables.start.size)
        moved[-3 + axis] = 1.0
        moved[3:-3] = -band_solve(band[:, 3:-3], band_times(band, moved)[3:-3])
        columns.append(band_times(band, moved)[-3:-1])
    matrix = np.stack(columns, axis=1) * tables.force_unit_N / tables.length_m
    return (matrix + matrix.T) / 2


def rod_state(rod: Rod, dofs: NDArray) -> RodState:
    """What a state's degrees of freedom mean, with units."""
    tables = rod.tables
    length, force = tables.length_m, tables.force_unit_N
    energy, residual, _ = evaluate(tables, dofs)
    stress = section_forces(tables, dofs)
    return RodState(
        nodes_m=_frozen(dofs[:, :2] * length),
        rotation_rad=_frozen(dofs[:, 2].copy()),
        axial_force_N=_frozen(stress[:, 0] * force),
        shear_force_N=_frozen(stress[:, 1] * force),
        bending_moment_Nm=_frozen(stress[:, 2] * force * length),
        start_force_N=_frozen(residual[:2] * force),
        start_moment_Nm=float(residual[2] * force * length),
        end_force_N=_frozen(residual[-3:-1] * force),
        end_moment_Nm=float(residual[-1] * force * length),
        strain_energy_J=float(energy * force * length),
        dofs=_frozen(dofs),
    )


def _advance(
    reach: Callable[[float, NDArray], NDArray | None],
    dofs: NDArray,
    start: float,
    target: float,
    *,
    what: str,
) -> NDArray:
    """Follow a solution from one load to another, in smaller steps where Newton needs them."""
    done, share = 0.0, 1.0
    while done < 1.0:
        share = min(share, 1.0 - done)
        trial = reach(start + (done + share) * (target - start), dofs)
        if trial is not None:
            dofs, done, share = trial, done + share, 2 * share
            continue
        share /= 2
        if share < _SMALLEST_STEP:
            raise SolveError(
                f"rod: {what} {target:.6g} cannot be reached: no equilibrium was found beyond"
                f" {start + done * (target - start):.6g}"
            )
    return dofs


def _torque(point_m: NDArray, force_N: NDArray, moment_Nm: float) -> float:
    return float(point_m[0] * force_N[1] - point_m[1] * force_N[0] + moment_Nm)


def _frozen(array: NDArray) -> NDArray:
    array.setflags(write=False)
    return array
