"""How far apart two correct evaluations may lie by rounding alone.

Another processor, library or order of summation changes the last digits. What becomes of them
follows from the method: the rounding of the largest terms that cancel, over what is left of them.
"""

import numpy as np

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.fem.linear_model import rigid_motions, tangent_matrix
from dftfs.fem.mesh import TaggedMesh
from dftfs.material import Material
from dftfs.spring.planar_rod import Rod, twist_stiffness

EPS = float(np.finfo(float).eps)


def of_quadratic_form(matrix, vectors) -> np.ndarray:
    """Rounding of v'Kv for every column v: eps |v|'|K||v|.

    The bound of Higham, Accuracy and Stability of Numerical Algorithms (2002), 3.1, without its
    factor of the number of terms, for the roundings of many elements have either sign. A stable
    factorisation errs by as much in the elastic energy of what it solves.
    """
    vectors = np.abs(vectors)
    return EPS * np.einsum("ik,ik->k", vectors, abs(matrix) @ vectors)


def of_stiffness(
    mesh: TaggedMesh, material: Material, motions: tuple[str, ...], stiffness, width_m: float = 1.0
) -> float:
    """Relative rounding of a body's stiffness against rigid motions of its rim.

    No point moves further than the rim does, so that the rim's motion of the whole body bounds
    the terms. What is left of them is small: a spring is soft, and its elements are stiff.
    """
    matrix = tangent_matrix(
        mesh,
        youngs_modulus_Pa=material.youngs_modulus_Pa,
        poisson_ratio=material.poisson_ratio,
        thickness_m=width_m,
    )
    whole = rigid_motions(mesh, np.arange(len(mesh.nodes)), motions).toarray()
    return float(np.max(of_quadratic_form(matrix, whole) / stiffness))


def of_planar_torsion(problem: TorsionProblem, stiffness_Nm_per_rad: float) -> float:
    """Relative rounding of the torsional stiffness of a spring in plane stress."""
    per_sector = stiffness_Nm_per_rad / problem.copies
    design = problem.design
    return of_stiffness(problem.mesh, design.material, ("rz",), per_sector, design.width_m)


def of_rod_torque_Nm(rod: Rod) -> float:
    """Rounding of the torque of one arm: that of its nodes, as a stretch of one element, by EA.

    The weights by which a three-node element forms its stretch add up to 4.
    """
    elements = len(rod.nodes_m) // 2
    radius_m = np.hypot(*rod.nodes_m.T).max()
    return 4 * EPS * float(np.max(rod.axial_stiffness_N)) * elements * radius_m


def of_rod_stiffness(rod: Rod) -> float:
    """Relative rounding of an arm's stiffness: elements that are stiff along it, turned rigidly."""
    elements, length_m = len(rod.nodes_m) // 2, np.hypot(*np.diff(rod.nodes_m, axis=0).T).sum()
    stiff_Nm = of_rod_torque_Nm(rod) * 4 * elements * np.hypot(*rod.nodes_m.T).max() / length_m
    return float(stiff_Nm / twist_stiffness(rod))
