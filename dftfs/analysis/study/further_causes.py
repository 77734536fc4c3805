"""Causes of scatter that act beside the four of `tolerance`: fillets, inclination, arm to arm.

| cause | what it does |
| --- | --- |
| fillet | the radius at both roots of every arm, through the rod model at three radii |
| inclination | of the cut: with a strip's size right at half the width, its thickness varies by
  w tan(a) either way over the width w. The mean of its cube, and so the stiffness, gains
  1 + (w tan(a) / t)^2; the gap is narrowest at one face, by w tan(a) |
| arms | each arm is thicker or thinner by itself: the stiffness is the mean of the arms', first
  contact comes in the gap whose two neighbours narrow it most |

What the gap alone does to the torque at first contact is the difference of the sensitivities of
contact torque and stiffness to the thickness: the torque at contact is the stiffness times an angle
which the gap decides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Sensitivities:
    """Logarithms of the k responses about the nominal shape; the first one is the stiffness.

    Attributes
    ----------
    thickness, thickness_2 : (k,) arrays
        First and second coefficient of the strip's change of thickness [1/m, 1/m2].
    fillet, fillet_2 : (k,) arrays
        The same of the fillet radius.
    """

    thickness: NDArray
    thickness_2: NDArray
    fillet: NDArray
    fillet_2: NDArray

    @property
    def gap(self) -> NDArray:
        """(k,) slope by a gap that a thicker strip narrows, the stiffness kept [1/m]."""
        return self.thickness - self.thickness[0]


@dataclass(frozen=True, kw_only=True)
class Further:
    """What one cause does: sensitivity (k,), relative size, and logarithms (samples, k)."""

    sensitivity: NDArray
    size: float
    logarithms: NDArray


def further_causes(
    sensitivities: Sensitivities,
    sigma: dict[str, float],
    *,
    thickness_m: float,
    fillet_m: float,
    width_m: float,
    n_arms: int,
    rng: np.random.Generator,
    samples: int,
) -> dict[str, Further]:
    """Contributions of the causes whose standard deviation is above zero.

    Parameters
    ----------
    sigma : mapping
        Standard deviations "fillet_m", "inclination_rad", "arm_m".
    """
    found = {}
    if sigma["fillet_m"] > 0:
        moved = sigma["fillet_m"] * rng.standard_normal(samples)[:, None]
        found["fillet"] = Further(
            sensitivity=sensitivities.fillet * fillet_m,
            size=sigma["fillet_m"] / fillet_m,
            logarithms=sensitivities.fillet * moved + sensitivities.fillet_2 * moved**2,
        )
    if sigma["inclination_rad"] > 0:
        wedge = width_m * np.tan(np.abs(sigma["inclination_rad"] * rng.standard_normal(samples)))
        found["inclination"] = Further(
            sensitivity=sensitivities.gap * thickness_m,
            size=width_m * float(np.tan(sigma["inclination_rad"])) / thickness_m,
            logarithms=np.log1p((wedge / thickness_m) ** 2)[:, None]
            + np.outer(wedge, sensitivities.gap),
        )
    if sigma["arm_m"] > 0:
        own = sigma["arm_m"] * rng.standard_normal((samples, n_arms))
        arms = np.exp(sensitivities.thickness[0] * own + sensitivities.thickness_2[0] * own**2)
        between = 0.5 * (own + np.roll(own, 1, axis=1))
        touching = (between[:, :, None] * sensitivities.gap).min(axis=1)
        found["arms"] = Further(
            sensitivity=sensitivities.thickness * thickness_m,
            size=sigma["arm_m"] / thickness_m,
            logarithms=np.log(arms.mean(axis=1))[:, None] + touching,
        )
    return found
