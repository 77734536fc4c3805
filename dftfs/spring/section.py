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
# Of the parameter p of `wide_strip_factor`: its series below, its limit above (F is 1 to 1e-13).
_NARROW, _WIDE = 0.1, 30.0


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


def wide_strip_factor(
    width_m: float, thickness_m: ArrayLike, curvature_per_m: ArrayLike, poisson_ratio: float
) -> NDArray:
    """Bending stiffness of a curved strip over E I, because its width resists to curl.

    Across its width a bent strip curls the other way (anticlastic bending) with nu times the
    change of curvature. Where the strip is curved, the radial displacement u(y) of that curl
    stretches its fibres by u / R: over a width far above sqrt(R t) the curl is confined to the
    edges and the stiffness tends to E I / (1 - nu^2), that of a plate. With D = E t^3 / 12 / (1 -
    nu^2) and the change of curvature k

        D u_yyyy + E t u / R^2 = 0,   u_yy = -nu k and u_yyy = 0 at y = +- w / 2
        M = D (w k + 2 nu u_y(w / 2)) = D w k (1 - 2 nu^2 F / p)
        p = (3 (1 - nu^2))^(1/4) w / sqrt(R t),   F = (cosh p - cos p) / (sinh p + sin p)

    so that the factor is (1 - 2 nu^2 F / p) / (1 - nu^2), 1 + nu^2 p^4 / 180 / (1 - nu^2) where p
    is small. Stiffness only: the stress that a moment makes is left at the strip's.

    Parameters
    ----------
    curvature_per_m : float or (n,) array
        1 / R of the unloaded centreline; the sign is ignored.

    Source
    ------
    H. Lamb, "On the flexure of a flat elastic spring", Phil. Mag. 31 (1891) 182; G. F. C. Searle,
    Experimental Elasticity (1908): the parameter w^2 / (R t); D. G. Ashwell, "The anticlastic
    curvature of rectangular beams and plates", J. R. Aeronaut. Soc. 54 (1950) 708. They bend a flat
    plate to R; here R is that of the unloaded strip and k a small change, which makes the same
    equation.
    """
    _require_section(thickness_m, width_m)
    nu = poisson_ratio
    bend = np.abs(np.atleast_1d(np.asarray(curvature_per_m, dtype=float)))
    p = (3 * (1 - nu**2)) ** 0.25 * width_m * np.sqrt(bend / thickness_m)
    inside = np.clip(p, _NARROW, _WIDE)
    share = (np.cosh(inside) - np.cos(inside)) / (np.sinh(inside) + np.sin(inside))
    share = np.where(p > _WIDE, 1.0, share) / np.maximum(p, _NARROW)
    closed = (1 - 2 * nu**2 * share) / (1 - nu**2)
    return np.where(p < _NARROW, 1 + nu**2 * p**4 / 180 / (1 - nu**2), closed)


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
