"""The part to be turned by hand, with deflection and stress through the load steps.

What the page's script draws (`template/turnable.js`): the mid-plane of one sector, its turned
copies, extruded over the strip's width. Sizes are those of the solution, deflections to scale.
"""

import base64
import json

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.torsion.result import StiffnessResult

MOST_STEPS = 31
_COARSEST = 32767  # of 16 bits with sign


def turnable_part(result: StiffnessResult, width_m: float) -> str:
    """The data of the page's script as JSON; empty where the result kept no fields of its steps.

    Nodes and displacements are 16-bit numbers of the step ``unit`` (mm), stresses 16-bit numbers
    of ``stressUnit`` (MPa): below 2 micrometres and 0.1 MPa for any spring of 100 mm and 2 GPa.
    """
    fields = result.fields
    if fields is None:
        return ""
    rows = np.unique(np.linspace(0, len(result.deflection_rad) - 1, MOST_STEPS).astype(int))
    nodes, moved = 1e3 * fields.nodes_m, 1e3 * fields.displacement_m[rows]
    stress = 1e-6 * fields.von_mises_Pa[rows]
    unit = max(float(np.abs(nodes).max()), float(np.abs(moved).max())) / _COARSEST
    stress_unit = max(float(stress.max()), 1e-9) / _COARSEST
    found = {
        "copies": fields.copies,
        "width": 1e3 * width_m,
        "unit": unit,
        "stressUnit": stress_unit,
        "nodes": _packed(nodes / unit),
        "displacement": _packed(moved / unit),
        "stress": _packed(stress / stress_unit),
        "triangles": _packed(surface_triangles(fields.cells)),
        "walls": _packed(wall_edges(fields.cells)),
        "deflection": np.degrees(result.deflection_rad[rows]).round(3).tolist(),
        "torque": result.torque_Nm[rows].round(4).tolist(),
        "touch": {
            direction: round(float(np.degrees(onset.deflection_rad)), 3)
            for direction, onset in result.contact_onset.items()
            if onset is not None
        },
    }
    return json.dumps(found, separators=(",", ":")).replace("<", "\\u003c")


def surface_triangles(cells: NDArray) -> NDArray:
    """Six triangles of each eight-node quadrilateral, (6 m, 3), in its sense of rotation."""
    a, b, c, d, e, f, g, h = np.asarray(cells).T
    parts = ((a, e, h), (b, f, e), (c, g, f), (d, h, g), (e, f, h), (f, g, h))
    return np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3)


def wall_edges(cells: NDArray) -> NDArray:
    """Half edges that only one element has, (k, 2): the outline, and the sides of the sector."""
    a, b, c, d, e, f, g, h = np.asarray(cells).T
    halves = ((a, e), (e, b), (b, f), (f, c), (c, g), (g, d), (d, h), (h, a))
    edges = np.concatenate([np.stack(half, axis=1) for half in halves])
    _, first, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return edges[first[count == 1]]


def _packed(values: NDArray) -> str:
    """Whole numbers of 16 bits, little-endian, as base64."""
    whole = np.round(values).astype("<i4")
    return base64.b64encode(whole.astype("<u2").tobytes()).decode("ascii")
