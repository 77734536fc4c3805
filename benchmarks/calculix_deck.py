"""The spring's torsion as a CalculiX deck, and what CalculiX prints read back.

Everything in SI, as the deck is too. Formats and definitions: CalculiX CrunchiX User's Manual,
version 2.20 (``*NODE PRINT``, ``*EL PRINT``, the frd file). Used by `benchmarks/calculix.py`.
"""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

POINTS = 27  # integration points of a C3D20
TIGHT_RESIDUAL = 1e-8  # over the average force; CalculiX's default is 0.005


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
    """

    nodes_m: NDArray[np.float64]
    cells: NDArray[np.int32]
    bore: NDArray[np.int32]
    rim: NDArray[np.int32]
    youngs_modulus_Pa: float
    poisson_ratio: float

    @property
    def unknowns(self) -> int:
        """Displacements that are neither clamped nor prescribed."""
        held = np.union1d(self.bore, self.rim)
        return 3 * (len(self.nodes_m) - len(held))


def save_model(path: Path, model: Model) -> None:
    """Write a model as npz."""
    np.savez(path, **{field.name: getattr(model, field.name) for field in fields(model)})


def load_model(path: Path) -> Model:
    """Read what `save_model` wrote."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    return Model(**{name: a if a.ndim else float(a) for name, a in arrays.items()})


def deck(model: Model, deflections_rad: NDArray[np.float64], *, tight: bool) -> str:
    """One static step a deflection, each in one increment, rim positions prescribed.

    Reactions of the bore are printed in every step, stresses in the last. ``tight`` lowers the
    limit of the residual (``*CONTROLS``), all else stays CalculiX's default.
    """
    last = len(deflections_rad) - 1
    lines = [
        "*NODE, NSET=ALL",
        *(f"{i}, {_joined(x)}" for i, x in enumerate(model.nodes_m, 1)),
        "*ELEMENT, TYPE=C3D20, ELSET=SPRING",
        *(f"{i}, {_element(c)}" for i, c in enumerate((model.cells + 1).tolist(), 1)),
        "*NSET, NSET=BORE",
        *(f"{node + 1}," for node in np.unique(model.bore)),
        "*MATERIAL, NAME=ELASTIC",
        "*ELASTIC",
        f"{model.youngs_modulus_Pa!r}, {model.poisson_ratio!r}",
        "*SOLID SECTION, ELSET=SPRING, MATERIAL=ELASTIC",
        "*BOUNDARY",
        "BORE, 1, 3",
    ]
    for k, deflection in enumerate(deflections_rad):
        lines += ["*STEP, NLGEOM"]
        if tight:
            lines += ["*CONTROLS, PARAMETERS=FIELD", f"{TIGHT_RESIDUAL}"]
        lines += ["*STATIC, DIRECT", "1., 1.", "*BOUNDARY", *_turned_rim(model, deflection)]
        lines += ["*NODE PRINT, NSET=BORE", "RF"]
        if k == last:
            lines += ["*EL PRINT, ELSET=SPRING", "S", "*EL FILE", "S"]
        lines += ["*END STEP"]
    return "\n".join(lines) + "\n"


def torques_Nm(dat: str, model: Model, steps: int) -> NDArray[np.float64]:
    """Torque on the spring, one a step: the moment about z that the clamped bore holds against.

    Not from the rim, whose many large reactions balance: of its moment the seven printed digits
    leave 1e-6 Nm uncertain, of the bore's 5e-8 Nm.

    Raises
    ------
    ValueError
        If the file does not hold the reactions of every step.
    """
    found = [rows for title, rows in _blocks(dat) if title.startswith("forces")]
    if len(found) != steps:
        raise ValueError(f"CalculiX printed {len(found)} of {steps} steps")
    result = []
    for rows in found:
        x, y, _ = model.nodes_m[rows[:, 0].astype(int) - 1].T
        result.append(-float(np.sum(x * rows[:, 2] - y * rows[:, 1])))
    return np.array(result)


def point_stress_Pa(dat: str) -> NDArray[np.float64]:
    """Cauchy stress (m, 27, 6) at the integration points: xx, yy, zz, xy, xz, yz."""
    rows = next(rows for title, rows in _blocks(dat) if title.startswith("stresses"))
    return rows[:, 2:].reshape(-1, POINTS, 6)


def nodal_stress_Pa(frd: str) -> NDArray[np.float64]:
    """Cauchy stress (n, 6) at the nodes: xx, yy, zz, xy, yz, zx."""
    block = frd[frd.index("\n -4  STRESS") :]
    rows = block[: block.index("\n -3")].splitlines()
    values = {
        int(row[3:13]): [float(row[at : at + 12]) for at in range(13, 85, 12)]
        for row in rows
        if row.startswith(" -1")
    }
    return np.array([values[node] for node in sorted(values)])


def nodal_average(
    point_values: NDArray[np.float64], fit: NDArray[np.float64], cells: NDArray[np.int32]
) -> NDArray[np.float64]:
    """CalculiX's nodal stress: each element's fit at its nodes, components averaged over them.

    Parameters
    ----------
    point_values : (m, 27, 6) array
    fit : (20, 27) array
        Pseudo-inverse of the shape functions at the points: the matrix ``a27`` of CalculiX'
        ``extrapolate.f``, there rounded to five decimals.
    """
    local = np.einsum("aq,eqc->eac", fit, point_values, optimize=True)
    total = np.zeros((cells.max() + 1, point_values.shape[-1]))
    np.add.at(total, cells, local)
    return total / np.bincount(cells.ravel())[:, None]


def von_mises(stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Von Mises stress of (..., 6) components, the three normal ones first."""
    normal, shear = stress[..., :3], stress[..., 3:]
    apart = normal - np.roll(normal, 1, axis=-1)
    return np.sqrt((apart**2).sum(axis=-1) / 2 + 3 * (shear**2).sum(axis=-1))


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


def _blocks(dat: str) -> list[tuple[str, NDArray[np.float64]]]:
    """Titles of a dat file, each with the rows of numbers below it."""
    found: list[tuple[str, list[str]]] = []
    for line in dat.splitlines():
        text = line.strip()
        if text and text[0].isalpha():
            found.append((text, []))
        elif text:
            found[-1][1].append(text)
    return [
        (title, np.array(" ".join(rows).split(), dtype=float).reshape(len(rows), -1))
        for title, rows in found
        if rows
    ]
