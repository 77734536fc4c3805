"""The rectangular cross-section of a curved strip: area, inertia, Winkler stress.

Everything follows from the relative thickness x = t / (2 R) of a strip of thickness t whose
centreline has the radius R, and from g(x) = (1 - x / atanh x) / x^2, which tends to 1/3 for a
straight strip. Written so, no formula divides a small difference by another, and R = inf is
an ordinary argument. Taken from felupe: the derivation stands with the code.

Winkler: plane sections stay plane and the radial stress is left out, so that the
circumferential stress is hyperbolic in r and vanishes at the neutral radius
r_n = t / ln(r_o / r_i) = R (1 - g x^2). The eccentricity e = R - r_n = R g x^2 gives the
stress M (r_n - r) / (A e r). It is good for stress (0.4 % on the concave face at R / t >= 1),
not for stiffness: that of the curved bar is ``rod.curved_bar_inertia``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError

# Below this x the closed form loses more digits than the series leaves out (1e-13 either way).
_SERIES_BELOW = 0.03


def section_area(thickness_m: ArrayLike, width_m: float) -> ArrayLike:
    """Area of the strip's cross-section, in m^2.

    Raises
    ------
    DesignError
        If a size is not positive.
    """
    _require_section(thickness_m, width_m)
    return thickness_m * width_m


def in_plane_inertia(thickness_m: ArrayLike, width_m: float) -> ArrayLike:
    """Second moment w2 w1^3 / 12 for bending in the plane of the spiral, straight strip, in m^4.

    Raises
    ------
    DesignError
        If a size is not positive.
    """
    _require_section(thickness_m, width_m)
    return width_m * thickness_m**3 / 12.0


def curved_strip_stress(
    moment_Nm: ArrayLike, thickness_m: ArrayLike, width_m: float, radius_m: ArrayLike
) -> tuple[NDArray, NDArray]:
    """Circumferential bending stress on the two faces of a curved strip.

    The concave face carries more, the convex less, than the straight 6 M / (w2 w1^2).

    Parameters
    ----------
    moment_Nm : float or (n,) array
        About the centroid, positive when it straightens the strip.
    thickness_m : float or (n,) array
        Radial size of the section.
    width_m : float
        Its axial size.
    radius_m : float or (n,) array
        Centreline radius of curvature, unloaded; infinite for a straight strip.

    Returns
    -------
    concave_Pa, convex_Pa : (n,) array
        At the radius minus and plus half the thickness, tension positive.

    Raises
    ------
    DesignError
        If a size is not positive, any radius is not above ``thickness_m`` / 2, a moment is not
        finite, or the numbers of moments and radii differ.

    Source
    ------
    Budynas & Nisbett, Shigley's Mechanical Engineering Design, "Curved Beams in Bending".
    """
    _require_section(thickness_m, width_m)
    moment = np.atleast_1d(np.asarray(moment_Nm, dtype=float))
    _, x = _relative_thickness(thickness_m, radius_m)
    if not np.isfinite(moment).all():
        raise DesignError(f"moment_Nm = {moment[~np.isfinite(moment)][0]:g} must be finite")
    if moment.shape != x.shape and moment.size != 1 and x.size != 1:
        raise DesignError(f"moment_Nm has {moment.size} values and radius_m {x.size}: give as many")
    straight_Pa = 6.0 * moment / (width_m * thickness_m**2)
    concave, convex = _face_factors(x)
    return straight_Pa * concave, -straight_Pa * convex


def curvature_correction_factor(radius_over_thickness: ArrayLike) -> NDArray:
    """K_b of eq. 2.6: stress on the concave face over that of a straight strip.

    Parameters
    ----------
    radius_over_thickness : float or (n,) array
        Centreline radius over thickness. The thesis writes beta = R_i / w1, which this is only
        if R_i is measured to the middle of the strip (errata S13).

    Returns
    -------
    (n,) array
        At least 1; 1.161 at 2.39.

    Raises
    ------
    DesignError
        If any ratio is not above 1/2.

    Source
    ------
    Winkler's curved bar, see ``curved_strip_stress``; the thesis' own graph is not in its text.
    """
    _, x = _relative_thickness(1.0, radius_over_thickness)
    return _face_factors(x)[0]


def _require_section(thickness_m: ArrayLike, width_m: float) -> None:
    for name, size in (("thickness_m", thickness_m), ("width_m", width_m)):
        if not np.all(np.isfinite(size) & (np.asarray(size) > 0)):
            raise DesignError(f"{name} = {size!r} must be positive and finite")


def _relative_thickness(thickness_m: ArrayLike, radius_m: ArrayLike) -> tuple[NDArray, NDArray]:
    _require_section(thickness_m, 1.0)
    radius = np.atleast_1d(np.asarray(radius_m, dtype=float))
    fits = radius > thickness_m / 2.0
    if not fits.all():
        index = int(np.argmin(fits))
        half = float(np.broadcast_to(np.asarray(thickness_m) / 2.0, fits.shape)[index])
        raise DesignError(
            f"radius_m[{index}] = {radius[index]:.4g} must exceed thickness_m / 2 ="
            f" {half:.4g}: the strip would fold onto itself"
        )
    return radius, thickness_m / (2.0 * radius)


def _g(x: NDArray) -> NDArray:
    """(1 - x / atanh x) / x^2, by its series where the difference would cancel."""
    square = x**2
    series = 1.0 / 3.0 + square * (4.0 / 45.0 + square * (44.0 / 945.0 + square * 428.0 / 14175.0))
    curved = np.where(x < _SERIES_BELOW, 0.5, x)
    return np.where(x < _SERIES_BELOW, series, (1.0 - curved / np.arctanh(curved)) / curved**2)


def _face_factors(x: NDArray) -> tuple[NDArray, NDArray]:
    g = _g(x)
    return (1.0 - g * x) / (3.0 * g * (1.0 - x)), (1.0 + g * x) / (3.0 * g * (1.0 + x))
