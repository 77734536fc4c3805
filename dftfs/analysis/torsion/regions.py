"""The regions of a spring whose stress is reported separately: notch, slit, arm, rings, contact.

A stress concentration reaches about a fillet's radius into the part; two radii around the edges
of a fillet, and no less than a quarter of the strip, are counted to it.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.fem.contact import Touch

HUB_NOTCH, RIM_SLIT, ARM, RINGS, CONTACT = "hub notch", "rim slit", "arm body", "rings", "contact"
REGIONS = (HUB_NOTCH, RIM_SLIT, ARM, RINGS, CONTACT)
_FILLETS = {
    HUB_NOTCH: ("notch_fillet", "foot_fillet"),
    RIM_SLIT: ("slit_fillet", "tip_fillet"),
}
_RADII, _STRIPS, _CONTACT_STRIPS = 2.0, 0.25, 0.25


def region_masks(problem: TorsionProblem) -> Mapping[str, NDArray[np.bool_]]:
    """Which nodes (n,) of the solved mesh belong to notch, slit, arm and rings: each to one."""
    mesh, spiral = problem.mesh, problem.design.spiral
    planar = mesh.nodes[:, :2]
    reach = max(_RADII * spiral.fillet_radius_m, _STRIPS * spiral.thickness_m)
    masks, taken = {}, np.zeros(len(planar), dtype=bool)
    for region, names in _FILLETS.items():
        edges = np.concatenate([mesh.boundary_nodes(n) for n in names if n in mesh.boundaries])
        near = cKDTree(planar[edges]).query(planar, distance_upper_bound=reach)[0] < np.inf
        masks[region] = near & ~taken
        taken |= near
    radius = np.hypot(*planar.T)
    ring = (radius <= spiral.hub_radius_m) | (radius >= spiral.rim_inner_radius_m)
    masks[RINGS] = ring & ~taken
    masks[ARM] = ~ring & ~taken
    return masks


def contact_mask(problem: TorsionProblem, touch: Touch | None) -> NDArray[np.bool_]:
    """Nodes (n,) within a quarter of the strip of a pressed facet, of either surface."""
    mesh = problem.mesh
    near = np.zeros(len(mesh.nodes), dtype=bool)
    if touch is None or not np.any(touch.pressure_Pa > 0):
        return near
    surfaces = problem.contact
    slave, point = np.nonzero(touch.pressure_Pa > 0)
    master = touch.found[slave, point] % len(surfaces.master)
    nodes = np.union1d(surfaces.slave[slave], surfaces.master[master])
    reach = _CONTACT_STRIPS * problem.design.spiral.thickness_m
    planar = mesh.nodes[:, :2]
    return cKDTree(planar[nodes]).query(planar, distance_upper_bound=reach)[0] < np.inf


def regional_peaks_Pa(
    problem: TorsionProblem, nodal_Pa: NDArray[np.float64], touch: Touch | None
) -> dict[str, float]:
    """Largest nodal stress (von Mises or principal) per region.

    That of the contact is not counted elsewhere; 0 for the contact where nothing touches.
    """
    pressed = contact_mask(problem, touch)
    peaks = {
        region: float(np.max(nodal_Pa[mask & ~pressed], initial=0.0))
        for region, mask in region_masks(problem).items()
    }
    peaks[CONTACT] = float(np.max(nodal_Pa[pressed], initial=0.0))
    return peaks
