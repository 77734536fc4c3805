"""The spring as planar rods: one arm between its fillets, clamped at the hub, turned by the rim.

The rim turns rigidly about the fixed centre, so every arm carries the same share. Two things
separate an arm from a plain clamped beam:

- Its bending stiffness is that of a curved bar in plane stress (Golovin), a little below the
  straight strip's E w2 w1^3 / 12; Winkler's plane sections would put it above.
- Its ends are not clamped at the fillets' feet: hub and rim give. The rod is continued straight
  into both by the lengths of `root_lengths`, as the fracture mechanics of a double cantilever
  beam does at a crack's tip. See docs/root-compliance.md.

A curve of twenty states takes milliseconds. Taken from Capytaine: the result keeps what it was
computed from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError
from dftfs.spring.centreline import Spiral
from dftfs.spring.edges import rotate
from dftfs.spring.outline import SpringOutline
from dftfs.spring.planar_rod import (
    Rod,
    RodState,
    end_stiffness_N_per_m,
    twist_rod,
    twist_stiffness,
)
from dftfs.spring.rod_kernel import element_nodes
from dftfs.spring.section import (
    curved_strip_stress,
    in_plane_inertia,
    section_area,
    wide_strip_factor,
)

# Root lengths over the strip's thickness: constant, per fillet radius over thickness, and (hub
# only) per thickness over radius of curvature at the fillet's foot.
# NECK: weight and power of fillet radius over neck; length and power of the decay (`slit_neck`).
# Source: python -m benchmarks.root_compliance, explained in docs/root-compliance.md.
HUB_ROOT = (0.512, 0.807, 0.547)
SLIT_ROOT = (0.580, 0.528)
NECK = (0.765, 0.771, 1.273, 3.695)

_DEEP_CRACKS = 32 / (12 * np.pi)
_ELEMENTS_PER_TURN = 24
_FEWEST_ELEMENTS = 12
_SHEAR_FACTOR = 5.0 / 6.0  # rectangle; Reissner 1945
_SERIES_BELOW = 1e-3  # of t / (2 R): below it Golovin's closed form loses digits
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, kw_only=True)
class RootLengths:
    """How far the rod is continued into the hub and into the rim, in m.

    ``neck_m`` is the length of arm that would turn as much as the neck between the slit's end
    and the arm's tip does: it softens the rim's root without making it longer.

    Raises
    ------
    DesignError
        If a length is negative or not finite.
    """

    hub_m: float
    slit_m: float
    neck_m: float = 0.0

    def __post_init__(self) -> None:
        for name in ("hub_m", "slit_m", "neck_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise DesignError(f"root lengths: {name} = {value!r} must be 0 or more")


@dataclass(frozen=True, kw_only=True)
class ArmRod:
    """Arm 0 as a rod with its roots.

    rod : first and last element are the roots. theta : (n - 4,) centreline parameters of the
    nodes between the fillets' feet. arc_m : (n,) arc length of every node from the hub-side foot.
    """

    rod: Rod
    theta: NDArray
    arc_m: NDArray
    outline: SpringOutline
    width_m: float
    roots: RootLengths

    @cached_property
    def section_theta(self) -> NDArray:
        """Centreline parameters of the free arm's sections, shape (n - 5,)."""
        return np.interp(self.section_arc_m, self.arc_m[2:-2], self.theta)

    @property
    def section_arc_m(self) -> NDArray:
        """Arc lengths of the free arm's sections from the hub-side foot, shape (n - 5,)."""
        return self.rod.sections_m[2:-2] + self.arc_m[0]


def lateral_stiffness_N_per_m(arm: ArmRod) -> float:
    """Smallest in-plane stiffness of a rim that cannot turn, at rest, the bore clamped.

    Of three arms and more the same in every direction.
    """
    arms, own = arm.outline.parameters.n_arms, end_stiffness_N_per_m(arm.rod)
    if arms >= 3:
        return float(arms * np.trace(own) / 2)
    return float(arms * np.linalg.eigvalsh(own)[0])


@dataclass(frozen=True, kw_only=True)
class RodCurve:
    """Torque against deflection of the whole spring by the rod model, contact not considered.

    deflection_rad, torque_Nm, tangent_Nm_per_rad, strain_energy_J, peak_bending_stress_Pa :
    (k,), in the order asked. stiffness_Nm_per_rad : tangent at rest.
    bending_moment_Nm : (k, m) in one arm at ``arc_length_m`` (m,), measured from the fillet's
    foot at the hub; positive where it tightens the arm.
    centreline_m : (k, n, 2), section_rotation_rad (k, n) of arm 0 between its fillets' feet.
    peak_bending_stress_Pa : largest circumferential stress between the feet; the notch stress
    in the fillets is higher and is not in a rod.
    """

    arm: ArmRod
    deflection_rad: NDArray
    torque_Nm: NDArray
    tangent_Nm_per_rad: NDArray
    strain_energy_J: NDArray
    stiffness_Nm_per_rad: float
    arc_length_m: NDArray
    bending_moment_Nm: NDArray
    centreline_m: NDArray
    section_rotation_rad: NDArray
    peak_bending_stress_Pa: NDArray


def root_lengths(outline: SpringOutline) -> RootLengths:
    """Lengths that stand for the compliance of hub and rim at an arm's roots.

    Source
    ------
    Fitted to plane-stress finite elements, docs/root-compliance.md. The form: effective crack
    length a + chi h, J. G. Williams, "End corrections for orthotropic DCB specimens", Composites
    Science and Technology 35 (1989) 367-376, where chi = 0.64..0.68 if isotropic; deep cracks,
    H. Tada, P. Paris & G. Irwin, The Stress Analysis of Cracks Handbook.
    """
    p = outline.parameters
    fillet, rim = p.fillet_radius_m / p.thickness_m, p.thickness_at_rim_m
    curved = p.thickness_m * float(p.centreline.curvature(outline.feet.notch_theta))
    hub = HUB_ROOT[0] + HUB_ROOT[1] * fillet + HUB_ROOT[2] * curved
    fillet = p.fillet_radius_m / rim
    slit = SLIT_ROOT[0] + SLIT_ROOT[1] * fillet
    neck = float(neck_turn(slit_neck_m(outline) / rim, fillet))
    return RootLengths(
        hub_m=hub * p.thickness_m,
        slit_m=slit * rim,
        neck_m=neck * rim,
    )


def neck_turn(
    neck: ArrayLike, fillet: ArrayLike, constants: tuple[float, float, float, float] = NECK
) -> NDArray:
    """Length of arm that turns as the neck does; neck, fillet and result over the thickness.

    Deep cracks that leave a width l: 32 / (12 pi) / l^2. Rounded notches turn more, and where l
    is several thicknesses the rim's root is all there is.

    Parameters
    ----------
    neck, fillet : float or (n,) array
    constants : weight and power of fillet over neck, length and power of the decay.
    """
    weight, power, reach, decay = constants
    neck, fillet = np.asarray(neck, dtype=float), np.asarray(fillet, dtype=float)
    notches = 1 + weight * (fillet / neck) ** power
    return _DEEP_CRACKS / neck**2 * notches * np.exp(-((neck / reach) ** decay))


def slit_neck_m(outline: SpringOutline) -> float:
    """Width of the neck that joins an arm to the rim, between the slit's and the tip's fillet."""
    p = outline.parameters
    edges = {edge.name.split(":")[0]: edge for edge in outline.coil_gaps[0]}
    slit = rotate(np.array(edges["slit_fillet"].centre_m), -p.pitch_rad)
    tip = np.array(edges["tip_fillet"].centre_m)
    return float(np.linalg.norm(tip - slit)) - 2 * p.fillet_radius_m


def curved_bar_inertia(
    thickness_m: ArrayLike, width_m: float, curvature_per_m: ArrayLike
) -> NDArray:
    """Second moment I that makes d(rotation)/ds = M / (E I) exact for a curved bar, in m^4.

    With x = t / (2 R) it is 3 (x^2 - (1 - x^2)^2 atanh(x)^2) / (4 x^4) of the straight
    strip's, or 1 - 2 x^2 / 15 + ...: plane stress, radial stress included.

    Parameters
    ----------
    thickness_m : float or array of the curvature's shape
    curvature_per_m : float or (n,) array
        1 / R of the unloaded centreline; the sign is ignored.

    Raises
    ------
    DesignError
        If a size is not positive, or the bar folds onto itself.

    Source
    ------
    Timoshenko & Goodier, Theory of Elasticity, "Pure bending of curved bars" (Golovin 1881):
    dphi/dtheta = 8 M (b^2 - a^2) / (E N), N = (b^2 - a^2)^2 - 4 a^2 b^2 ln(b/a)^2.
    """
    straight = in_plane_inertia(thickness_m, width_m)
    x = np.abs(np.atleast_1d(np.asarray(curvature_per_m, dtype=float))) * thickness_m / 2
    if not np.all(x < 1):
        thickest = 1e3 * float(np.max(thickness_m))
        raise DesignError(
            f"thickness_mm = {thickest:.4g}: the strip folds onto itself where its radius of"
            f" curvature is {thickest / 2 / np.max(x):.4g} mm"
        )
    bent = np.where(x < _SERIES_BELOW, 0.5, x)
    inner = (1 - bent**2) * np.arctanh(bent)
    closed = 3 * (bent - inner) * (bent + inner) / (4 * bent**4)
    return straight * np.where(x < _SERIES_BELOW, 1 - 2 * x**2 / 15, closed)


def arm_rod(
    outline: SpringOutline,
    width_m: float,
    youngs_modulus_Pa: float,
    poisson_ratio: float,
    *,
    roots: RootLengths | None = None,
    elements_per_turn: int = _ELEMENTS_PER_TURN,
    wide: bool = False,
) -> ArmRod:
    """Arm 0 between the notch fillet's and the slit fillet's foot as a rod.

    Parameters
    ----------
    roots : RootLengths, optional
        `root_lengths` of the outline without it; zero lengths clamp the arm at the feet.
    wide : bool
        With `wide_strip_factor`, as in 3D; without it all is proportional to the width.

    Raises
    ------
    DesignError
        If the width or a material constant is out of range.
    """
    _check_material(youngs_modulus_Pa, poisson_ratio)
    p, feet = outline.parameters, outline.feet
    roots = roots if roots is not None else root_lengths(outline)
    sweep = feet.slit_theta - feet.notch_theta
    elements = max(_FEWEST_ELEMENTS, int(np.ceil(elements_per_turn * sweep / (2 * np.pi))))
    theta = np.linspace(feet.notch_theta, feet.slit_theta, 2 * elements + 1)
    line = p.centreline
    point, tangent = line.point(theta), line.tangent(theta)
    angle = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    arc = _arc_length(line, theta)
    # a clamped arm keeps its two root elements, of next to no length: one layout of nodes for all
    hub, slit = (max(length, 1e-6 * arc[-1]) for length in (roots.hub_m, roots.slit_m))
    before, after = -hub * np.array([1.0, 0.5]), slit * np.array([0.5, 1.0])
    ends = point[0] + before[:, None] * tangent[0], point[-1] + after[:, None] * tangent[-1]
    curvature = np.pad(line.curvature(theta), 2, mode="edge")[element_nodes(len(theta) + 4)]
    thickness = np.pad(p.thickness_at(theta), 2, mode="edge")[element_nodes(len(theta) + 4)]
    inertia = curved_bar_inertia(thickness, width_m, curvature)
    if wide:
        inertia = inertia * wide_strip_factor(width_m, thickness, curvature, poisson_ratio)
    inertia[-1] *= slit / (slit + roots.neck_m)
    area = section_area(thickness, width_m)
    rod = Rod(
        nodes_m=np.concatenate([ends[0], point, ends[1]]),
        angles_rad=np.pad(angle, 2, mode="edge"),
        bending_stiffness_Nm2=youngs_modulus_Pa * inertia,
        axial_stiffness_N=youngs_modulus_Pa * area,
        shear_stiffness_N=_SHEAR_FACTOR * youngs_modulus_Pa / (2 * (1 + poisson_ratio)) * area,
    )
    return ArmRod(
        rod=rod,
        theta=theta,
        arc_m=np.concatenate([before, arc, arc[-1] + after]),
        outline=outline,
        width_m=width_m,
        roots=roots,
    )


def rod_curve(
    outline: SpringOutline,
    width_m: float,
    youngs_modulus_Pa: float,
    poisson_ratio: float,
    deflections_rad: ArrayLike,
    *,
    roots: RootLengths | None = None,
    wide: bool = False,
) -> RodCurve:
    """Torque of the whole spring at the given deflections of the rim, large rotations included.

    Parameters
    ----------
    deflections_rad : (k,) array
        Positive winds the arms onto the hub, negative unwinds them; any order.
    roots, wide : optional
        As for `arm_rod`.

    Raises
    ------
    DesignError
        If the width, a material constant or a deflection is out of range.
    SolveError
        If a deflection cannot be reached; the message names it.
    """
    arm = arm_rod(outline, width_m, youngs_modulus_Pa, poisson_ratio, roots=roots, wide=wide)
    deflections = np.atleast_1d(np.asarray(deflections_rad, dtype=float))
    if deflections.ndim != 1 or not np.isfinite(deflections).all():
        raise DesignError("deflections_rad must be finite numbers, one after the other")
    states = twist_arm(arm, deflections)
    count = outline.parameters.n_arms
    return RodCurve(
        arm=arm,
        deflection_rad=deflections.copy(),
        torque_Nm=np.array([count * state.end_torque_Nm for state in states]),
        tangent_Nm_per_rad=np.array([count * twist_stiffness(arm.rod, s) for s in states]),
        strain_energy_J=np.array([count * state.strain_energy_J for state in states]),
        stiffness_Nm_per_rad=count * twist_stiffness(arm.rod),
        arc_length_m=arm.section_arc_m,
        bending_moment_Nm=np.array([state.bending_moment_Nm[2:-2] for state in states]),
        centreline_m=np.array([state.nodes_m[2:-2] for state in states]),
        section_rotation_rad=np.array([state.rotation_rad[2:-2] for state in states]),
        peak_bending_stress_Pa=np.array([_peak_stress(arm, state) for state in states]),
    )


def twist_arm(arm: ArmRod, deflections_rad: Sequence[float] | NDArray) -> list[RodState]:
    """States of the arm at the given deflections, each reached from rest through the smaller ones.

    Raises
    ------
    SolveError
        If a deflection cannot be reached; the message names it.
    """
    deflections = np.asarray(deflections_rad, dtype=float)
    states: dict[int, RodState] = {}
    for side in (deflections >= 0, deflections < 0):
        state = None
        for index in sorted(np.flatnonzero(side), key=lambda i: abs(deflections[i])):
            state = twist_rod(arm.rod, deflections[index], state)
            states[index] = state
    return [states[index] for index in range(len(deflections))]


def wide_over_plane(
    outline: SpringOutline, width_m: float, youngs_modulus_Pa: float, poisson_ratio: float
) -> float:
    """Stiffness at rest of an arm whose width resists to curl, over that in plane stress."""
    elastic = (width_m, youngs_modulus_Pa, poisson_ratio)
    plane, wide = (arm_rod(outline, *elastic, wide=wide) for wide in (False, True))
    return twist_stiffness(wide.rod) / twist_stiffness(plane.rod)


def _peak_stress(arm: ArmRod, state: RodState) -> float:
    p = arm.outline.parameters
    radius = 1 / p.centreline.curvature(arm.section_theta)
    straightening = -state.bending_moment_Nm[2:-2]
    thickness = p.thickness_at(arm.section_theta)
    faces = curved_strip_stress(straightening, thickness, arm.width_m, radius)
    axial = state.axial_force_N[2:-2] / section_area(thickness, arm.width_m)
    return float(max(np.max(np.abs(face + axial)) for face in faces))


def _arc_length(line: Spiral, theta: NDArray) -> NDArray:
    """Arc lengths at increasing parameters from the first, shape of ``theta``."""
    half = np.diff(theta) / 2
    inside = theta[:-1, None] + half[:, None] * (1 + _GAUSS_NODES)
    return np.concatenate([[0.0], np.cumsum(half * (line.speed(inside) @ _GAUSS_WEIGHTS))])


def _check_material(youngs_modulus_Pa: float, poisson_ratio: float) -> None:
    if not (np.isfinite(youngs_modulus_Pa) and youngs_modulus_Pa > 0):
        raise DesignError(f"youngs_modulus_Pa = {youngs_modulus_Pa!r} must be positive")
    if not -1 < poisson_ratio < 0.5:
        raise DesignError(f"poisson_ratio = {poisson_ratio!r} must be between -1 and 0.5")
