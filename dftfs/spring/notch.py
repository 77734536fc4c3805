"""The stress in the notches at an arm's roots, from the rod model's moment there.

A rod ends at the fillets' feet; the stress in the fillets is the strip's own bending stress times
a factor of fillet radius over thickness alone. Source: `python -m benchmarks.notch_factor`, a fit
to plane-stress finite elements of 24 random designs (fillet 0.05 to 0.52 of the thickness, both
roots, both directions); 12 others: -3.4 to +2.9 % off the elements' peak, the fitted ones -4.2 to
+6.3 %. Hub and rim lie on one line; the notch's angle and curvature add nothing to it.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.rod import RodCurve

NOTCH = (0.248, 0.752)  # weight and power of thickness over fillet radius


def notch_factor(fillet_over_thickness: ArrayLike) -> NDArray:
    """Peak von Mises stress in a root's fillet over 6 M / (w2 t^2) at the fillet's foot."""
    weight, power = NOTCH
    return 1 + weight * np.asarray(fillet_over_thickness, dtype=float) ** -power


def peak_stress(curve: RodCurve) -> NDArray:
    """Largest stress of each state of a rod curve, notches included, in Pa, shape (k,).

    The larger of the bending stress between the fillets' feet and the notch stress at hub and rim.
    """
    notch = root_stress(
        curve.arm.outline.parameters, curve.arm.width_m, curve.bending_moment_Nm[:, [0, -1]]
    )
    return np.maximum(curve.peak_bending_stress_Pa, notch)


def root_stress(p: SpiralParameters, width_m: float, moments_Nm: NDArray) -> NDArray:
    """Larger notch stress (Pa) of both roots, from moments (..., 2) at the hub and the rim."""
    thickness = np.array([p.thickness_m, p.thickness_at_rim_m])
    straight = 6 * np.abs(moments_Nm) / (width_m * thickness**2)
    return np.max(notch_factor(p.fillet_radius_m / thickness) * straight, axis=-1)
