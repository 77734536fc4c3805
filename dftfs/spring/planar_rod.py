"""Planar geometrically exact rod: bending, stretching and shear of an initially curved line.

Reissner's strains are measured from the unloaded shape: with the section's angle phi and the
line's slope x' = dx/ds,

    (axial e, shear g) = R(phi)^T x' - R(phi0)^T x0',     bending k = (phi - phi0)'

and the strain energy is the integral of (EA e^2 + 2 ES e k + EI k^2 + GA_s g^2) / 2. The
coupling ES is zero for a straight strip; a curved one's neutral axis is off its centreline.
Three-node elements with two-point integration: no locking, quartic in the element's length,
and the tangent is the exact second derivative of the discrete energy, so symmetric.

Everything is solved without dimensions (the length and EI of the rod are 1), so that one
tolerance serves all units. Taken from felupe: energy, residual and tangent stand in one kernel.

Sources: E. Reissner, "On one-dimensional finite-strain beam theory: the plane problem", ZAMP 23
(1972) 795-804; J. C. Simo, "A finite strain beam formulation", CMAME 49 (1985) 55-70.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, solve_banded

from dftfs.errors import DesignError, SolveError

_BAND = 8  # two three-node elements never couple degrees of freedom further apart than this
_POINTS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
_SHAPE = np.stack([_POINTS * (_POINTS - 1) / 2, 1 - _POINTS**2, _POINTS * (_POINTS + 1) / 2], 1)
_SLOPE = np.stack([_POINTS - 0.5, -2 * _POINTS, _POINTS + 0.5], 1)
_TOLERANCE = 1e-9  # last correction, over the rod's length or in rad; the error is its square
_MAX_ITERATIONS = 25
_LARGEST_CORRECTION = 10.0  # a correction beyond this many lengths or rad means divergence
_SMALLEST_STEP = 1.0 / 2**14  # of a requested load or twist step


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
    bending_stiffness_Nm2, axial_stiffness_N, shear_stiffness_N : float or (n,) array
        EI, EA and the shear stiffness GA_s.
    coupling_Nm : float or (n,) array
        ES, the axial force per bending strain; its square must stay below EA EI.

    Raises
    ------
    DesignError
        If the shapes do not fit, nodes coincide or turn back, or a stiffness is not positive.
    """

    nodes_m: NDArray
    angles_rad: NDArray
    bending_stiffness_Nm2: ArrayLike
    axial_stiffness_N: ArrayLike
    shear_stiffness_N: ArrayLike
    coupling_Nm: ArrayLike = 0.0

    def __post_init__(self) -> None:
        nodes = np.array(self.nodes_m, dtype=float)
        if nodes.ndim != 2 or nodes.shape[1] != 2 or len(nodes) < 3 or len(nodes) % 2 == 0:
            raise DesignError(
                f"rod: nodes_m has shape {nodes.shape}; (n, 2) with n odd, 3 or more is needed"
            )
        object.__setattr__(self, "nodes_m", _frozen(nodes))
        for name in (
            "angles_rad",
            "bending_stiffness_Nm2",
            "axial_stiffness_N",
            "shear_stiffness_N",
            "coupling_Nm",
        ):
            values = np.array(getattr(self, name), dtype=float)
            if values.ndim and values.shape != (len(nodes),):
                raise DesignError(
                    f"rod: {name} has shape {values.shape}; {len(nodes)} nodes need ({len(nodes)},)"
                )
            values = np.broadcast_to(values, len(nodes)).copy()
            if not np.isfinite(values).all():
                raise DesignError(f"rod: {name} must be finite")
            if "stiffness" in name and not np.min(values) > 0:
                raise DesignError(f"rod: {name} = {np.min(values):.4g} must be positive")
            object.__setattr__(self, name, _frozen(values))
        if not np.all(self.coupling_Nm**2 < self.axial_stiffness_N * self.bending_stiffness_Nm2):
            raise DesignError("rod: coupling_Nm must be below sqrt(EA EI) in magnitude")
        self._check_line()

    def _check_line(self) -> None:
        step = np.diff(self.nodes_m, axis=0)
        angle = (self.angles_rad[1:] + self.angles_rad[:-1]) / 2
        forward = step[:, 0] * np.cos(angle) + step[:, 1] * np.sin(angle)
        if not np.all(forward > 0.5 * np.linalg.norm(step, axis=1)):
            index = int(np.argmin(forward))
            raise DesignError(
                f"rod: between nodes {index} and {index + 1} the line does not run along"
                " angles_rad; more nodes or angles within 60 degrees of the line would do"
            )

    @cached_property
    def _tables(self) -> "_Tables":
        return _tables(self)

    @property
    def length_m(self) -> float:
        """Length of the unloaded line."""
        return self._tables.length_m

    @property
    def sections_m(self) -> NDArray:
        """Arc lengths of the integration points, where section forces are given, shape (n - 1,)."""
        return self._tables.sections * self._tables.length_m


@dataclass(frozen=True, kw_only=True)
class RodState:
    """A rod in equilibrium.

    nodes_m (n, 2); rotation_rad (n,) turn of the sections from the unloaded state;
    axial_force_N, shear_force_N, bending_moment_Nm, axial_strain, bending_strain_per_m (n - 1,)
    at ``Rod.sections_m``; start_force_N, end_force_N (2,), start_moment_Nm, end_moment_Nm what
    is applied to the ends from outside; strain_energy_J.
    """

    nodes_m: NDArray
    rotation_rad: NDArray
    axial_force_N: NDArray
    shear_force_N: NDArray
    bending_moment_Nm: NDArray
    axial_strain: NDArray
    bending_strain_per_m: NDArray
    start_force_N: NDArray
    start_moment_Nm: float
    end_force_N: NDArray
    end_moment_Nm: float
    strain_energy_J: float

    @property
    def tip_m(self) -> NDArray:
        """The line's end, shape (2,)."""
        return self.nodes_m[-1]


def solve_rod(
    rod: Rod, tip_force_N: ArrayLike = (0.0, 0.0), tip_moment_Nm: float = 0.0
) -> RodState:
    """A cantilever clamped at its start under a dead force and a moment at its end.

    The load is applied in steps that would each turn the linear rod's sections by 0.3 rad.

    Raises
    ------
    SolveError
        If a step of the load does not converge.
    """
    tables = rod._tables
    load = np.zeros(3 * len(rod.nodes_m))
    load[-3:] = [*np.asarray(tip_force_N, dtype=float), tip_moment_Nm]
    load[-3:] /= tables.force_unit_N * np.array([1.0, 1.0, tables.length_m])
    free = slice(3, None)

    def reach(part: float, guess: NDArray) -> NDArray | None:
        return _newton(tables, guess, free, part * load)

    start = tables.start
    _, _, band = _evaluate(tables, start)
    linear = _solve(band[:, free], load[free])
    steps = max(1, int(np.ceil(np.max(np.abs(linear[2::3])) / 0.3)))
    dofs, done = start, 0.0
    for part in np.arange(1, steps + 1) / steps:
        dofs = advance(reach, dofs, done, float(part), what="share of the tip load")
        done = float(part)
    return rod_state(rod, dofs)


def solve_twist(
    rod: Rod, deflections_rad: ArrayLike, start: tuple[float, NDArray] | None = None
) -> list[NDArray]:
    """Clamp the start, carry the end rigidly about the origin, in the order given.

    Parameters
    ----------
    deflections_rad : (k,) array
        Angles of the end about the origin; each is reached from the one before.
    start : (angle, (n, 3) array), optional
        A state reached earlier to go on from; the unloaded rod at 0 without it.

    Returns
    -------
    list of (n, 3) arrays
        Degrees of freedom (position over length, rotation) of each state, for `rod_state`.

    Raises
    ------
    SolveError
        If a deflection cannot be reached; the message names it.
    """
    tables = rod._tables
    free = slice(3, -3)
    place = tables.start[-1]

    def reach(angle: float, guess: NDArray) -> NDArray | None:
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y = place[:2]
        end = np.array([cosine * x - sine * y, sine * x + cosine * y, angle])
        return _newton(tables, guess, free, np.zeros(guess.size), end=end)

    done, dofs = start if start is not None else (0.0, tables.start)
    states = []
    for angle in np.atleast_1d(np.asarray(deflections_rad, dtype=float)):
        dofs = advance(reach, dofs, done, float(angle), what="a deflection in rad of")
        done = float(angle)
        states.append(dofs)
    return states


def twist_stiffness(rod: Rod, dofs: NDArray) -> float:
    """Tangent of the end's torque about the origin against its angle, in Nm/rad."""
    tables = rod._tables
    _, residual, band = _evaluate(tables, dofs)
    x, y = dofs[-1, :2]
    carried = np.array([-y, x, 1.0])
    coupling = _times_end(band, carried)
    moved = np.concatenate([np.zeros(3), -_solve(band[:, 3:-3], coupling[3:-3]), carried])
    reaction = coupling + _times(band, np.concatenate([moved[:-3], np.zeros(3)]))
    turning = x * residual[-3] + y * residual[-2]  # the end force's arm changes with the angle
    return float(carried @ reaction[-3:] - turning) * tables.force_unit_N * tables.length_m


def rod_state(rod: Rod, dofs: NDArray) -> RodState:
    """What a state's degrees of freedom mean, with units."""
    tables = rod._tables
    length, force = tables.length_m, tables.force_unit_N
    energy, residual, _ = _evaluate(tables, dofs)
    strain, stress = _section_forces(*tables.kernel, dofs)
    return RodState(
        nodes_m=_frozen(dofs[:, :2] * length),
        rotation_rad=_frozen(dofs[:, 2].copy()),
        axial_force_N=_frozen(stress[:, 0] * force),
        shear_force_N=_frozen(stress[:, 1] * force),
        bending_moment_Nm=_frozen(stress[:, 2] * force * length),
        axial_strain=_frozen(strain[:, 0].copy()),
        bending_strain_per_m=_frozen(strain[:, 2] / length),
        start_force_N=_frozen(residual[:2] * force),
        start_moment_Nm=float(residual[2] * force * length),
        end_force_N=_frozen(residual[-3:-1] * force),
        end_moment_Nm=float(residual[-1] * force * length),
        strain_energy_J=float(energy * force * length),
    )


def advance(
    reach: Callable[[float, NDArray], NDArray | None],
    dofs: NDArray,
    start: float,
    target: float,
    *,
    what: str,
) -> NDArray:
    """Follow a solution from one load to another, with smaller steps where Newton needs them.

    Raises
    ------
    SolveError
        If the steps become too small; the message says ``what`` was asked and where it ended.
    """
    done, share = 0.0, 1.0
    while done < 1.0:
        share = min(share, 1.0 - done)
        trial = reach(start + (done + share) * (target - start), dofs)
        if trial is None:
            share /= 2
            if share < _SMALLEST_STEP:
                reached = start + done * (target - start)
                raise SolveError(
                    f"rod: {what} {target:.6g} was not reached, Newton's iteration stops at"
                    f" {reached:.6g}; a smaller one, or more elements, would do"
                )
            continue
        dofs, done, share = trial, done + share, 2 * share
    return dofs


@dataclass(frozen=True, kw_only=True)
class _Tables:
    """The rod without dimensions, as the kernels want it."""

    length_m: float
    force_unit_N: float
    start: NDArray
    sections: NDArray
    kernel: tuple[NDArray, ...]


def _tables(rod: Rod) -> _Tables:
    element = np.arange(0, len(rod.nodes_m) - 1, 2)[:, None] + np.arange(3)
    slope = np.einsum("gi,mik->mgk", _SLOPE, rod.nodes_m[element])
    jacobian = np.linalg.norm(slope, axis=2)
    length = float(np.sum(jacobian))
    bending = float(np.mean(rod.bending_stiffness_Nm2))
    force = bending / length**2
    weight = jacobian / length
    gradient = _SLOPE[None] / weight[..., None]
    angle = (rod.angles_rad[element] @ _SHAPE.T).reshape(weight.shape)
    direction = slope / jacobian[..., None]
    cosine, sine = np.cos(angle), np.sin(angle)
    unloaded = np.stack(
        [
            cosine * direction[..., 0] + sine * direction[..., 1],
            -sine * direction[..., 0] + cosine * direction[..., 1],
        ],
        axis=-1,
    )
    stiffness = np.stack(
        [
            rod.axial_stiffness_N[element] @ _SHAPE.T / force,
            rod.coupling_Nm[element] @ _SHAPE.T / (force * length),
            rod.bending_stiffness_Nm2[element] @ _SHAPE.T / bending,
            rod.shear_stiffness_N[element] @ _SHAPE.T / force,
        ],
        axis=-1,
    )
    ends = np.concatenate([[0.0], np.cumsum(weight.sum(axis=1))])
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    start = np.column_stack([rod.nodes_m / length, np.zeros(len(rod.nodes_m))])
    kernel = (gradient, weight, angle, unloaded, stiffness)
    return _Tables(
        length_m=length,
        force_unit_N=force,
        start=_frozen(start),
        sections=_frozen((middle[:, None] + half[:, None] * _POINTS).ravel()),
        kernel=tuple(np.ascontiguousarray(table) for table in kernel),
    )


def _newton(
    tables: _Tables, dofs: NDArray, free: slice, load: NDArray, end: NDArray | None = None
) -> NDArray | None:
    """Equilibrium from a guess, or None. ``end`` moves the last node in the first correction."""
    dofs = dofs.copy()
    shift = np.zeros(3) if end is None else end - dofs[-1]
    for _ in range(_MAX_ITERATIONS):
        _, residual, band = _evaluate(tables, dofs)
        rhs = load - residual
        if shift.any():
            rhs -= _times_end(band, shift)
        step = _solve(band[:, free], rhs[free])
        size = np.max(np.abs(step))
        if not size < _LARGEST_CORRECTION:
            return None
        flat = dofs.reshape(-1)
        flat[free] += step
        flat[-3:] += shift
        if size < _TOLERANCE and np.max(np.abs(shift)) < _TOLERANCE:
            return dofs
        shift = np.zeros(3)
    return None


def _solve(band: NDArray, rhs: NDArray) -> NDArray:
    try:
        return solve_banded((_BAND, _BAND), band, rhs, check_finite=False)
    except LinAlgError:
        return np.full(rhs.shape, np.nan)


def _times_end(band: NDArray, end: NDArray) -> NDArray:
    """Product of the tangent's last three columns with three values."""
    size = band.shape[1]
    out = np.zeros(size)
    for k in range(3):
        column = size - 3 + k
        rows = np.arange(max(0, column - _BAND), size)
        out[rows] += band[_BAND + rows - column, column] * end[k]
    return out


def _times(band: NDArray, vector: NDArray) -> NDArray:
    out = np.zeros(vector.size)
    for offset in range(-_BAND, _BAND + 1):
        rows = np.arange(max(0, offset), min(vector.size, vector.size + offset))
        out[rows] += band[_BAND + offset, rows - offset] * vector[rows - offset]
    return out


def _frozen(array: NDArray) -> NDArray:
    array.setflags(write=False)
    return array


def _evaluate(tables: _Tables, dofs: NDArray) -> tuple[float, NDArray, NDArray]:
    return _assemble(*tables.kernel, dofs)


@numba.njit(cache=True)
def _strains(gradient, angle, unloaded, shape, a):
    """Axial, shear and bending strain, and the section-frame components of the slope."""
    slope_x = slope_y = turn = bend = 0.0
    for i in range(3):
        slope_x += gradient[i] * a[i, 0]
        slope_y += gradient[i] * a[i, 1]
        turn += shape[i] * a[i, 2]
        bend += gradient[i] * a[i, 2]
    cosine, sine = np.cos(angle + turn), np.sin(angle + turn)
    along = cosine * slope_x + sine * slope_y
    across = -sine * slope_x + cosine * slope_y
    return along - unloaded[0], across - unloaded[1], bend, along, across, cosine, sine


@numba.njit(cache=True)
def _section_forces(gradient, weight, angle, unloaded, stiffness, dofs):
    count = weight.shape[0]
    strain, stress = np.empty((2 * count, 3)), np.empty((2 * count, 3))
    for m in range(count):
        for g in range(2):
            e, s, k, _, _, _, _ = _strains(
                gradient[m, g], angle[m, g], unloaded[m, g], _SHAPE[g], dofs[2 * m : 2 * m + 3]
            )
            ea, es, ei, ga = stiffness[m, g]
            row = 2 * m + g
            strain[row] = np.array([e, s, k])
            stress[row] = np.array([ea * e + es * k, ga * s, es * e + ei * k])
    return strain, stress


@numba.njit(cache=True)
def _assemble(gradient, weight, angle, unloaded, stiffness, dofs):
    """Energy, its gradient, and its second derivative in LAPACK's band storage."""
    size = dofs.size
    residual, band, energy = np.zeros(size), np.zeros((2 * _BAND + 1, size)), 0.0
    b = np.zeros((3, 9))
    for m in range(weight.shape[0]):
        for g in range(2):
            a = dofs[2 * m : 2 * m + 3]
            e, s, k, along, across, cosine, sine = _strains(
                gradient[m, g], angle[m, g], unloaded[m, g], _SHAPE[g], a
            )
            ea, es, ei, ga = stiffness[m, g]
            w = weight[m, g]
            normal, shear, moment = ea * e + es * k, ga * s, es * e + ei * k
            energy += w * (normal * e + shear * s + moment * k) / 2
            for i in range(3):
                d, n = gradient[m, g, i], _SHAPE[g, i]
                b[0, 3 * i], b[0, 3 * i + 1], b[0, 3 * i + 2] = cosine * d, sine * d, across * n
                b[1, 3 * i], b[1, 3 * i + 1], b[1, 3 * i + 2] = -sine * d, cosine * d, -along * n
                b[2, 3 * i + 2] = d
            # second derivatives of the two line strains: slope-rotation and rotation-rotation
            force_x = -normal * sine - shear * cosine
            force_y = normal * cosine - shear * sine
            turning = -normal * along - shear * across
            for p in range(9):
                i, c = p // 3, p % 3
                residual[6 * m + p] += w * (normal * b[0, p] + shear * b[1, p] + moment * b[2, p])
                for q in range(9):
                    j, f = q // 3, q % 3
                    value = (
                        b[0, p] * (ea * b[0, q] + es * b[2, q])
                        + b[1, p] * ga * b[1, q]
                        + b[2, p] * (es * b[0, q] + ei * b[2, q])
                    )
                    if c == 2 and f == 2:
                        value += turning * _SHAPE[g, i] * _SHAPE[g, j]
                    elif f == 2:
                        part = force_x if c == 0 else force_y
                        value += part * gradient[m, g, i] * _SHAPE[g, j]
                    elif c == 2:
                        part = force_x if f == 0 else force_y
                        value += part * gradient[m, g, j] * _SHAPE[g, i]
                    band[_BAND + p - q, 6 * m + q] += w * value
    return energy, residual, band
