"""A spring by its measured or computed torque-deflection curve."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.effects.base import Port, Term, parameter
from rsea_core.errors import TermError
from rsea_core.machine.spring_table import (
    ANCHOR,
    C0,
    C1,
    C2,
    C3,
    UPPER,
    SpringTable,
    read_only,
    table_tangent,
    table_torque,
)

NEVER_rad = 1e3  # a bend that no spring reaches


LARGEST = 1e9  # of a point's deflection (rad), torque (Nm) or tangent (Nm/rad)
SMALLEST_STEP = 1e-12  # between points (rad, Nm): secants and their squares stay finite
ZERO_TORQUE_SHARE = 0.01  # torque at zero deflection, of the largest: more is an offset


@dataclass(frozen=True, kw_only=True, eq=False)
class SpringCurve(Term):
    """A spring by the points of its curve: tau = scale * H(d), H through every point.

    H is the piecewise cubic that has the given torques and tangents at the given deflections
    (Hermite), so its slope is continuous, and its integral, the stored energy, is exact. Beyond
    the points it goes on straight with the last tangent. Past the first contact of coils the
    law may still be a curve fit, but it is no longer what the points vouch for: deflections
    outside `valid_range_rad` are reported by every simulation.

    Attributes
    ----------
    deflection_rad, torque_Nm, tangent_Nm_per_rad : (n,) arrays
        Strictly increasing deflections and torques; tangents above zero. Without tangents
        those of the monotone piecewise cubic of Fritsch and Carlson are taken (at an end where
        they vanish, the last secant).
    contact_onset_rad : (float or None, float or None)
        Deflection of the first contact in negative and positive direction, None where none is
        known within the points.
    source : str
    torque_scale : float
        Factor on the whole curve: 1 as given, moved where a recording shows another stiffness.

    Raises
    ------
    TermError
        If the points are not a monotone curve near zero, or the cubic between two of them
        would not be monotone.

    Source
    ------
    Fritsch & Carlson, Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980).
    """

    effect: ClassVar[str] = "spring-curve"
    law: ClassVar[str] = "curve"
    in_spring_table: ClassVar[bool] = True
    port: ClassVar[Port] = Port.SPRING
    replaces: ClassVar[str] = "spring_stiffness_Nm_per_rad"

    deflection_rad: ArrayLike
    torque_Nm: ArrayLike
    tangent_Nm_per_rad: ArrayLike | None = None
    contact_onset_rad: tuple[float | None, float | None] = (None, None)
    source: str = "points of a torque-deflection curve"
    torque_scale: float = parameter(
        1.0,
        unit="-",
        bounds=(0.1, 10.0),
        source="1: the curve as it was computed or measured",
        meaning="Factor on every torque of the curve.",
    )

    def __post_init__(self):
        super().__post_init__()
        deflection = _column("deflection_rad", self.deflection_rad)
        torque = _column("torque_Nm", self.torque_Nm, deflection.size)
        _require_increasing("deflection_rad", deflection)
        _require_increasing("torque_Nm", torque)
        if self.tangent_Nm_per_rad is None:
            tangent = _monotone_tangents(deflection, torque)
        else:
            tangent = _column("tangent_Nm_per_rad", self.tangent_Nm_per_rad, deflection.size)
        if not np.all(tangent > 0.0):
            k = int(np.argmin(tangent))
            raise TermError(
                f"spring-curve: tangent_Nm_per_rad[{k}] = {tangent[k]:.4g} must be above 0"
            )
        for name, array in (
            ("deflection_rad", deflection),
            ("torque_Nm", torque),
            ("tangent_Nm_per_rad", tangent),
        ):
            object.__setattr__(self, name, array)
        low, high = self.contact_onset_rad
        if (low is not None and not low < 0.0) or (high is not None and not high > 0.0):
            raise TermError(
                f"spring-curve: contact_onset_rad = {self.contact_onset_rad} must be below and"
                " above 0 (None where no contact is known)"
            )
        self._require_through_zero()
        self._require_monotone_between_points()

    @property
    def valid_range_rad(self) -> tuple[float, float]:
        """Deflections that the points vouch for: up to the first contact or the last point."""
        low, high = self.contact_onset_rad
        first, last = float(self.deflection_rad[0]), float(self.deflection_rad[-1])
        return (
            first if low is None else max(first, low),
            last if high is None else min(last, high),
        )

    def table(self) -> SpringTable:
        """The curve in the form that compiled code reads."""
        d, t, k = self.deflection_rad, self.torque_Nm, self.tangent_Nm_per_rad
        h = np.diff(d)
        slope = np.diff(t) / h
        regions = np.zeros((d.size + 1, 6))
        regions[:-1, UPPER], regions[-1, UPPER] = d, np.inf
        regions[0, ANCHOR], regions[1:, ANCHOR] = d[0], d
        regions[0, C0], regions[1:, C0] = t[0], t
        regions[0, C1], regions[1:, C1] = k[0], k
        regions[1:-1, C2] = (3.0 * slope - 2.0 * k[:-1] - k[1:]) / h
        regions[1:-1, C3] = (k[:-1] + k[1:] - 2.0 * slope) / h**2
        regions[:, C0:] *= self.torque_scale
        low, high = self.valid_range_rad
        return SpringTable(regions=read_only(regions), valid_low_rad=low, valid_high_rad=high)

    def equation(self) -> str:
        low, high = self.valid_range_rad
        return (
            f"f(d) = piecewise cubic through {self.deflection_rad.size} points,"
            f" f'(0) = {table_tangent(self.table().regions, 0.0):.5g} Nm/rad, valid"
            f" {low:.4g}..{high:.4g} rad, linear beyond ({self.source})"
        )

    def _require_through_zero(self) -> None:
        d, largest = self.deflection_rad, np.abs(self.torque_Nm).max()
        if d[0] > 0.0 or d[-1] < 0.0:
            raise TermError(
                f"spring-curve: deflection_rad {d[0]:.4g}..{d[-1]:.4g} must include 0, the"
                " unloaded spring"
            )
        at_zero = table_torque(self.table().regions, 0.0) / self.torque_scale
        if abs(at_zero) > ZERO_TORQUE_SHARE * largest:
            raise TermError(
                f"spring-curve: torque at zero deflection is {at_zero:.4g} Nm; at most"
                f" {ZERO_TORQUE_SHARE * largest:.4g} Nm ({ZERO_TORQUE_SHARE:.0%} of the largest)"
                " can be the unloaded spring: is one column offset?"
            )

    def _require_monotone_between_points(self) -> None:
        h = np.diff(self.deflection_rad)
        c1, c2, c3 = self.table().regions[1:-1, C1:].T
        with np.errstate(divide="ignore", invalid="ignore"):
            lowest_at = np.where(c3 > 0.0, -c2 / (3.0 * c3), 0.0)
        s = np.clip(lowest_at, 0.0, h)
        lowest = c1 + s * (2.0 * c2 + 3.0 * s * c3)
        if np.any(lowest <= 0.0):
            k = int(np.argmin(lowest))
            raise TermError(
                "spring-curve: the tangents do not fit the torques between deflection_rad"
                f" {self.deflection_rad[k]:.5g} and {self.deflection_rad[k + 1]:.5g}: the cubic"
                " there is not monotone; give more points between them"
            )


def _monotone_tangents(deflection: NDArray, torque: NDArray) -> NDArray:
    secant = np.diff(torque) / np.diff(deflection)
    if secant.size == 1:
        return read_only(np.repeat(secant, 2))
    from scipy.interpolate import PchipInterpolator  # takes a third of a second to import

    tangent = PchipInterpolator(deflection, torque).derivative()(deflection)
    for end in (0, -1):
        if not tangent[end] > 0.01 * secant[end]:
            tangent[end] = secant[end]
    return read_only(tangent)


def _column(name: str, values: ArrayLike, size: int | None = None) -> NDArray:
    array = np.array(values, dtype=float)
    if array.ndim != 1 or array.size < 2 or not np.all(np.isfinite(array)):
        raise TermError(f"spring-curve: {name} must be at least 2 finite numbers in a row")
    if np.abs(array).max() > LARGEST:
        k = int(np.abs(array).argmax())
        raise TermError(f"spring-curve: {name} {array[k]:.6g} must be within ±{LARGEST:g}")
    if size is not None and array.size != size:
        raise TermError(f"spring-curve: {name} has {array.size} values, deflection_rad {size}")
    return read_only(array)


def _require_increasing(name: str, array: NDArray) -> None:
    if not np.all(np.diff(array) > SMALLEST_STEP):
        k = int(np.argmax(np.diff(array) <= SMALLEST_STEP))
        raise TermError(
            f"spring-curve: {name} must increase: {array[k]:.6g} is followed by {array[k + 1]:.6g}"
            f" (the least step is {SMALLEST_STEP:g})"
        )
