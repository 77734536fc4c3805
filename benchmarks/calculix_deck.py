"""Models of `dftfs.fem.deck` in files, and what CalculiX prints read back.

Formats and definitions: CalculiX CrunchiX User's Manual, version 2.20 (``*NODE PRINT``,
``*EL PRINT``, the frd file).
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.deck import Model

_STORED = ("nodes_m", "cells", "bore", "rim", "youngs_modulus_Pa", "poisson_ratio")
POINTS = 27  # integration points of a C3D20


def save_model(path: Path, model: Model) -> None:
    """Write a model as npz."""
    np.savez(path, **{name: getattr(model, name) for name in _STORED})


def load_model(path: Path) -> Model:
    """Read what `save_model` wrote."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    return Model(**{name: a if a.ndim else float(a) for name, a in arrays.items()})


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
