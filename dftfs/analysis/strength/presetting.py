"""Presetting of a strip: what an overload beyond yield leaves in its section, and what it gains.

A rectangular strip is bent beyond its yield moment M_y and let go. Plane sections, uniaxial stress,
a line of slope E_t past yield (perfectly plastic where the material states no ultimate
strength). With k the curvature and e = E_t / E, both over their values at first yield,

    m(k) = 1/k^2 + 1.5 (1 - e) (1 - 1/k^2) + e k (1 - 1/k^3),    m = M / M_y, k > 1.

Letting go is elastic: the surface keeps the stress 1 + e (k - 1) - m (of the yield strength, of
the other sign for any m > 1), the strip keeps the curvature k - m. Loaded again the same way it is
elastic up to m; the other way its surface yields at 2 - m, because the yield surface has moved
along (kinematic hardening, which is the safe one).

Source: Hill, The Mathematical Theory of Plasticity (1950), IV.6; Wahl, Mechanical Springs (1963),
chapter 13, on presetting.
"""

from dataclasses import dataclass

from scipy.optimize import brentq

from dftfs.errors import DesignError

LARGEST_CURVATURE = 1e3  # over the one at first yield; no strip is bent so far


@dataclass(frozen=True, kw_only=True)
class Presetting:
    """A section after an overload; moments over M_y, stresses over the yield strength.

    Attributes
    ----------
    moment : float
        Of the overload; also where the section yields when loaded again the same way.
    curvature : float
        At the overload, over the one at first yield.
    set_curvature : float
        What is left of it.
    surface : float
        Stress that is left at the surface; below 0: against the overload's.
    reverse_moment : float
        Where the section yields when loaded the other way; 0 or less: at once when let go.
    """

    moment: float
    curvature: float
    set_curvature: float
    surface: float
    reverse_moment: float


def section_moment(curvature: float, slope: float = 0.0) -> float:
    """m(k) of the module's docstring, for curvature k and slope e."""
    if curvature <= 1.0:
        return curvature
    core = 1.0 / curvature**2
    return (
        core + 1.5 * (1.0 - slope) * (1.0 - core) + slope * curvature * (1.0 - 1.0 / curvature**3)
    )


def presetting(moment: float, slope: float = 0.0) -> Presetting:
    """What an overload of so many yield moments leaves behind.

    Raises
    ------
    DesignError
        If the moment is not above 0, or no curvature carries it (1.5 without hardening).
    """
    if not moment > 0.0:
        raise DesignError(f"overload = {moment:g} yield moments must be above 0, e.g. 1.2")
    if moment <= 1.0:
        return Presetting(
            moment=1.0, curvature=moment, set_curvature=0.0, surface=0.0, reverse_moment=1.0
        )
    if section_moment(LARGEST_CURVATURE, slope) < moment:
        raise DesignError(
            f"overload = {moment:.3g} yield moments is more than a strip without hardening carries"
            " (1.5): it collapses"
        )
    curvature = float(
        brentq(lambda k: section_moment(k, slope) - moment, 1.0, LARGEST_CURVATURE, xtol=1e-12)
    )
    return Presetting(
        moment=moment,
        curvature=curvature,
        set_curvature=curvature - moment,
        surface=1.0 + slope * (curvature - 1.0) - moment,
        reverse_moment=2.0 - moment,
    )
