"""Stiffness of a spring of rolled or printed material: moduli that depend on the direction.

Every section of an arm bends with the modulus along its own tangent. The rod keeps its geometry,
its curved-bar factors and its roots, which are those of an isotropic strip: the roots' lengths were
fitted on isotropic material, so that strong anisotropy at the roots is not in it. The arms
stand at other angles to the material, so that each carries its own share.

Source: Jones, Mechanics of Composite Materials (1999), eq. 2.97 (moduli of a turned ply).
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError
from dftfs.spring.outline import SpringOutline
from dftfs.spring.planar_rod import Rod, twist_stiffness
from dftfs.spring.rod import arm_rod
from dftfs.spring.rod_kernel import element_nodes


@dataclass(frozen=True, kw_only=True)
class InPlane:
    """Moduli in the plate's plane: along direction 1 (rolling, printed lines), across, in shear.

    Raises
    ------
    DesignError
        If a modulus is not positive, or nu_12 is not one that a material can have.
    """

    along_Pa: float
    across_Pa: float
    shear_Pa: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        for field in fields(self)[:3]:
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value > 0):
                raise DesignError(f"orthotropic: {field.name} = {value} must be positive")
        if not self.poisson_ratio**2 < self.along_Pa / self.across_Pa:
            raise DesignError(
                f"orthotropic: poisson_ratio = {self.poisson_ratio} must be below"
                f" {np.sqrt(self.along_Pa / self.across_Pa):.3g} (positive strain energy)"
            )

    def modulus_Pa(self, angle_rad: ArrayLike) -> NDArray:
        """Young's modulus along a direction at an angle to direction 1."""
        c, s = np.cos(angle_rad) ** 2, np.sin(angle_rad) ** 2
        mixed = 1 / self.shear_Pa - 2 * self.poisson_ratio / self.along_Pa
        return 1 / (c**2 / self.along_Pa + s**2 / self.across_Pa + mixed * c * s)

    def shear_modulus_Pa(self, angle_rad: ArrayLike) -> NDArray:
        """Shear modulus between a direction at an angle to direction 1 and the one across it."""
        c, s = np.cos(angle_rad) ** 2, np.sin(angle_rad) ** 2
        mixed = (1 + 2 * self.poisson_ratio) / self.along_Pa + 1 / self.across_Pa
        return 1 / (4 * c * s * mixed + (c - s) ** 2 / self.shear_Pa)


def turned_rod(rod: Rod, material: InPlane, youngs_modulus_Pa: float, shear_Pa: float,
               turn_rad: float) -> Rod:  # fmt: skip
    """An isotropic rod of the given moduli with the material's own at each of its sections.

    Parameters
    ----------
    turn_rad : float
        Of the rod against direction 1, added to its own angles.
    """
    angle = (rod.angles_rad + turn_rad)[element_nodes(len(rod.nodes_m))]
    share = material.modulus_Pa(angle) / youngs_modulus_Pa
    return replace(
        rod,
        bending_stiffness_Nm2=rod.bending_stiffness_Nm2 * share,
        axial_stiffness_N=rod.axial_stiffness_N * share,
        shear_stiffness_N=rod.shear_stiffness_N * material.shear_modulus_Pa(angle) / shear_Pa,
    )


def arm_stiffnesses(
    outline: SpringOutline, width_m: float, material: InPlane, direction_rad: float = 0.0
) -> NDArray:
    """Torsional stiffness of every arm [Nm/rad] at rest; their sum is the spring's.

    Parameters
    ----------
    direction_rad : float
        Of direction 1 against the outline's x axis.

    Raises
    ------
    DesignError
        If the outline or the width cannot be used.
    """
    nu = min(abs(material.poisson_ratio), 0.45)  # of the isotropic rod, whose moduli are replaced
    arm = arm_rod(outline, width_m, material.along_Pa, nu)
    shear = material.along_Pa / (2 * (1 + nu))
    p = outline.parameters
    return np.array(
        [
            twist_stiffness(
                turned_rod(
                    arm.rod, material, material.along_Pa, shear, j * p.pitch_rad - direction_rad
                )
            )
            for j in range(p.n_arms)
        ]
    )
