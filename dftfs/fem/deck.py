"""A body whose boundary is turned about the z axis, as a deck of CalculiX or Abaqus.

Everything in SI, as the deck is too. The keywords are those that both programs read; only the
requests for fields differ. Formats: CalculiX CrunchiX User's Manual, version 2.20; Abaqus Keywords
Reference Guide (``*OUTPUT``). Node order of C3D20 and the numbers of its faces are the mesh's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.elements import HEX20

TIGHT_RESIDUAL = 1e-8  # over the average force; CalculiX's default is 0.005
DIALECTS = ("calculix", "abaqus")


@dataclass(frozen=True, kw_only=True)
class Model:
    """A hex20 mesh with a clamped bore and a turned rim, and its material.

    Parameters
    ----------
    nodes_m : (n, 3) array
    cells : (m, 20) int array
        Node numbers from 0 in the order of C3D20.
    bore, rim : (k, 8) int array
        Facets, as `dftfs.fem.mesh.TaggedMesh` stores them.
    mirror : (k, 8) int array or None
        Facets of a plane of constant z that stays plane: half of the width is solved.
    surfaces : mapping of name to (k, 8) int array
        Further facets that get a name, for contact or output.
    """

    nodes_m: NDArray[np.float64]
    cells: NDArray[np.int32]
    bore: NDArray[np.int32]
    rim: NDArray[np.int32]
    youngs_modulus_Pa: float
    poisson_ratio: float
    mirror: NDArray[np.int32] | None = None
    surfaces: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)

    @property
    def unknowns(self) -> int:
        """Displacements that are neither clamped nor prescribed."""
        held = np.union1d(self.bore, self.rim)
        return 3 * (len(self.nodes_m) - len(held))


def deck(
    model: Model,
    deflections_rad: NDArray[np.float64],
    *,
    tight: bool,
    dialect: str = "calculix",
    direct: bool = True,
    every_step: bool = False,
    heading: str = "",
) -> str:
    """One static step a deflection, rim positions prescribed.

    Reactions of the bore are printed in every step, stresses in the last; with ``every_step``
    displacements and stresses of every step are filed instead. ``tight`` lowers the limit of the
    residual (``*CONTROLS``), all else stays the program's default. ``direct`` takes each step in
    one increment, else the program may cut it.

    Raises
    ------
    SolveError
        If the dialect is unknown.
    """
    if dialect not in DIALECTS:
        raise SolveError(f"dialect {dialect!r} is unknown; known are {', '.join(DIALECTS)}")
    last = len(deflections_rad) - 1
    lines = ["*HEADING", heading] if heading else []
    lines += [
        "*NODE, NSET=ALL",
        *(f"{i}, {_joined(x)}" for i, x in enumerate(model.nodes_m, 1)),
        "*ELEMENT, TYPE=C3D20, ELSET=SPRING",
        *(f"{i}, {_element(c)}" for i, c in enumerate((model.cells + 1).tolist(), 1)),
        *node_set("BORE", model.bore),
        *_sets(model),
        "*MATERIAL, NAME=ELASTIC",
        "*ELASTIC",
        f"{model.youngs_modulus_Pa!r}, {model.poisson_ratio!r}",
        "*SOLID SECTION, ELSET=SPRING, MATERIAL=ELASTIC",
        "*BOUNDARY",
        "BORE, 1, 3",
    ]
    if model.mirror is not None:
        lines += ["MIRROR, 3, 3"]
    for k, deflection in enumerate(deflections_rad):
        lines += ["*STEP, NLGEOM"]
        if tight:
            lines += ["*CONTROLS, PARAMETERS=FIELD", f"{TIGHT_RESIDUAL}"]
        lines += ["*STATIC, DIRECT" if direct else "*STATIC", "1., 1."]
        lines += ["*BOUNDARY", *_turned_rim(model, deflection), "*NODE PRINT, NSET=BORE", "RF"]
        if every_step:
            lines += _fields(dialect)
        elif k == last:
            lines += ["*EL PRINT, ELSET=SPRING", "S", "*EL FILE", "S"]
        lines += ["*END STEP"]
    return "\n".join(lines) + "\n"


def node_set(name: str, facets: NDArray[np.int32]) -> list[str]:
    """A named set of the facets' nodes."""
    return [f"*NSET, NSET={name}", *(f"{node + 1}," for node in np.unique(facets))]


def element_faces(cells: NDArray[np.int32], facets: NDArray[np.int32]) -> list[str]:
    """Element and face number of each facet: S1 to S6 in the order of HEX20.facets."""
    wanted = {tuple(sorted(row[:4].tolist())) for row in facets}
    corners = np.sort(cells[:, HEX20.facets[:, :4]], axis=2)
    return [
        f"{element + 1}, S{face + 1}"
        for element, faces in enumerate(corners.tolist())
        for face, nodes in enumerate(faces)
        if tuple(nodes) in wanted
    ]


def _sets(model: Model) -> list[str]:
    """What a user selects by: the rim, the mirror without the held nodes, the named surfaces."""
    if model.mirror is None and not model.surfaces:
        return []
    lines = node_set("RIM", model.rim)
    if model.mirror is not None:
        free = np.setdiff1d(model.mirror, np.union1d(model.bore, model.rim))
        lines += node_set("MIRROR", free)
    for name, facets in model.surfaces.items():
        lines += [f"*SURFACE, NAME={name}", *element_faces(model.cells, facets)]
    return lines


def _fields(dialect: str) -> list[str]:
    if dialect == "calculix":
        return ["*NODE FILE", "U", "*EL FILE", "S"]
    return ["*OUTPUT, FIELD", "*NODE OUTPUT", "U, RF", "*ELEMENT OUTPUT", "S"]


def _joined(values: NDArray[np.float64]) -> str:
    return ", ".join(f"{v:.12e}" for v in values)  # CalculiX reads 20 characters a number


def _element(nodes: list[int]) -> str:
    first, rest = nodes[:15], nodes[15:]  # with the element's number 16 entries, as many as fit
    return ", ".join(map(str, first)) + ",\n" + ", ".join(map(str, rest))


def _turned_rim(model: Model, angle_rad: float) -> list[str]:
    rim = np.unique(model.rim)
    x, y, _ = model.nodes_m[rim].T
    s, versine = np.sin(angle_rad), 2 * np.sin(angle_rad / 2) ** 2  # 1 - cos, not cancelled
    displacement_m = np.stack([-versine * x - s * y, s * x - versine * y, 0 * x], axis=1)
    return [
        f"{node + 1}, {axis}, {axis}, {value:.12e}"
        for node, values in zip(rim, displacement_m)
        for axis, value in enumerate(values, 1)
    ]
