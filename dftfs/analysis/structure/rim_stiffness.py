"""Stiffness of the rim against the hub in all six directions, from the linear solid model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.structure.linear_spring import HALVES, MOTIONS, WholeSpring
from dftfs.errors import DesignError
from dftfs.fem.linear_model import RIGID_MOTIONS, condensed

SYMMETRY = 1e-9  # of the largest entry of the same unit


@dataclass(frozen=True, kw_only=True, eq=False)
class RimStiffness:
    """Force and moment on the rim over its small motion, bore clamped, at rest.

    Parameters
    ----------
    matrix : (6, 6) array
        Order x, y, z, rx, ry, rz; about the axis in the mid-plane. N/m, N/rad, Nm/rad.

    Raises
    ------
    DesignError
        If the matrix is not symmetric and positive definite.
    """

    matrix: NDArray[np.float64]

    def __post_init__(self) -> None:
        scale = np.sqrt(np.abs(np.diag(self.matrix)))
        skew = np.abs(self.matrix - self.matrix.T) / np.outer(scale, scale)
        if self.matrix.shape != (6, 6) or not skew.max() < SYMMETRY:
            raise DesignError("rim stiffness: the matrix must be 6 x 6 and symmetric")
        if not np.linalg.eigvalsh(self.matrix / np.outer(scale, scale)).min() > 0:
            raise DesignError("rim stiffness: the matrix must be positive definite")

    @property
    def lateral_N_per_m(self) -> tuple[float, float]:
        """Softest and stiffest in-plane direction of a rim that cannot turn."""
        low, high = np.linalg.eigvalsh(self.matrix[:2, :2])
        return float(low), float(high)

    @property
    def softest_direction_rad(self) -> float:
        """Where the softest in-plane direction points, from 0 to pi."""
        _, axes = np.linalg.eigh(self.matrix[:2, :2])
        return float(np.arctan2(axes[1, 0], axes[0, 0]) % np.pi)

    @property
    def axial_N_per_m(self) -> float:
        """Along the axis, the rim not tilting."""
        return float(self.matrix[2, 2])

    @property
    def tilt_Nm_per_rad(self) -> tuple[float, float]:
        """Softest and stiffest tilt about an axis in the mid-plane."""
        low, high = np.linalg.eigvalsh(self.matrix[3:5, 3:5])
        return float(low), float(high)

    @property
    def torsion_Nm_per_rad(self) -> float:
        """About the axis, the rim held in its bearing."""
        return float(self.matrix[5, 5])

    def turned(self, angle_rad: float) -> "RimStiffness":
        """The same spring in a frame turned about the axis."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        turn = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return RimStiffness(matrix=turn @ self.matrix @ turn.T)


def rim_stiffness(spring: WholeSpring, *, solver: str = "auto") -> RimStiffness:
    """All six directions by two condensations, one a mirror class.

    Raises
    ------
    SolveError
        If a linear solve fails.
    """
    matrix = np.zeros((6, 6))
    for parity, names in MOTIONS.items():
        at = [RIGID_MOTIONS.index(name) for name in names]
        found = condensed(spring.at_rest, spring.reduction(parity, rim=names), solver=solver)
        matrix[np.ix_(at, at)] = HALVES * found
    return RimStiffness(matrix=matrix)
