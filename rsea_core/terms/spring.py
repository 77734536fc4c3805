"""Laws of the torsion spring at the port between wheel and load.

`SpringCurve` is a spring given by points of its torque-deflection curve, as a finite-element
solve or a bench delivers them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from rsea_core.errors import TermError
from rsea_core.terms.base import (
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    Term,
    parameter,
    require_bounds,
)
from rsea_core.terms.table import (
    ANCHOR,
    C0,
    C1,
    C2,
    C3,
    UPPER,
    SpringTable,
    read_only,
    spring_tangent_Nm_per_rad,
    sum_of_regions,
    table_tangent,
    table_torque,
)

HARDENING_AT_rad = 0.15  # where the contract compares tangents
NEVER_rad = 1e3  # a bend that no spring reaches
FAR_rad = 7.0  # largest onset of a knee: a turn and more, no knee at all
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
        require_bounds(self)
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
        """The law in one line."""
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


@dataclass(frozen=True, kw_only=True)
class SpringHardening(Term):
    """A stiffness that grows (or falls) with the square of the deflection: K d + k_3 d^3.

    k_3 = K (r - 1)/(3 0.15^2) for the ratio r of the tangents at 0.15 rad and at zero. Beyond
    0.3 rad, or where a softening spring has a quarter of its stiffness left, it goes on
    straight.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or the spring is given by a curve already.
    """

    effect: ClassVar[str] = "spring-hardening"
    law: ClassVar[str] = "cubic"
    in_spring_table: ClassVar[bool] = True
    port: ClassVar[Port] = Port.SPRING

    stiffness_ratio_at_0p15rad: float = parameter(
        unit="-",
        bounds=(0.3, 10.0),
        source="tangent there over tangent at zero; a fit",
        meaning="Tangent stiffness at 0.15 rad over that at zero deflection.",
    )

    def __post_init__(self):
        require_bounds(self)

    @property
    def extent_rad(self) -> float:
        """Deflection up to which the law is a cubic."""
        ratio = self.stiffness_ratio_at_0p15rad
        if ratio >= 1.0:
            return 2.0 * HARDENING_AT_rad
        return HARDENING_AT_rad * min(np.sqrt(0.75 / (1.0 - ratio)), 2.0)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Tangent at 0.15 rad over tangent at zero."""
        return {"stiffness_ratio_at_0p15rad": self.stiffness_ratio_at_0p15rad}

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law over a linear spring."""
        if np.any(table.regions[:, C2:] != 0.0) or np.unique(table.regions[:, C1]).size > 1:
            raise TermError("spring-hardening: the spring is given by a curve already")
        K, extent = table.regions[0, C1], self.extent_rad
        cubic = K * (self.stiffness_ratio_at_0p15rad - 1.0) / (3.0 * HARDENING_AT_rad**2)
        torque, tangent = K * extent + cubic * extent**3, K + 3.0 * cubic * extent**2
        bend = 3.0 * cubic * extent
        regions = np.array(
            [
                (-extent, -extent, -torque, tangent, 0.0, 0.0),
                (0.0, -extent, -torque, tangent, -bend, cubic),
                (extent, 0.0, 0.0, K, 0.0, cubic),
                (np.inf, extent, torque, tangent, 0.0, 0.0),
            ]
        )
        return table._replace(regions=read_only(regions))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It bends the spring's law."""
        return "needs a spring between wheel and load" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"f(d) = K_s (d + {(self.stiffness_ratio_at_0p15rad - 1) / 0.0675:.5g} d^3) up to"
            f" {self.extent_rad:.4g} rad, linear beyond"
        )


@dataclass(frozen=True, kw_only=True)
class SpringContact(Term):
    """Coils that touch: past an onset the spring is stiffer, by a knee in each direction.

    Beyond the onset (r - 1) times the tangent there is added to the stiffness, on whatever law
    the spring has. With a width the tangent grows linearly over it, centred on the onset;
    without, it jumps. The simulation cuts its steps at the knees.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or a knee reaches back to zero deflection.
    """

    effect: ClassVar[str] = "spring-contact"
    law: ClassVar[str] = "knees"
    port: ClassVar[Port] = Port.SPRING
    in_spring_table: ClassVar[bool] = True

    onset_rad: float = parameter(
        unit="rad",
        bounds=(1e-3, FAR_rad),
        source="the clearance of the coils; a fit",
        meaning="Positive deflection at which coils touch.",
    )
    stiffness_ratio: float = parameter(
        unit="-",
        bounds=(1.0, 100.0),
        source="a fit",
        meaning="Tangent just past the onset over tangent just before it.",
    )
    negative_onset_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, FAR_rad),
        source="0: the same as the positive one",
        meaning="Negative deflection, without its sign, at which coils touch.",
    )
    knee_width_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, 0.5),
        source="0: a sharp knee; coils that close one after the other",
        meaning="Deflection over which the tangent grows to its new value.",
    )

    def __post_init__(self):
        require_bounds(self)
        if not 0.5 * self.knee_width_rad < min(self.onsets_rad):
            raise TermError(
                f"spring-contact: knee_width_rad = {self.knee_width_rad:g} reaches from the onset"
                f" of {min(self.onsets_rad):g} rad back to zero: at most twice the onset"
            )

    @property
    def onsets_rad(self) -> tuple[float, float]:
        """Onset in negative (without its sign) and positive direction."""
        return self.negative_onset_rad or self.onset_rad, self.onset_rad

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Where the first coils touch, and the torque of a linear spring there."""
        onset = min(self.onsets_rad)
        stiffness = context.need(self.effect, "spring_stiffness_Nm_per_rad")
        return {"onset_rad": onset, "onset_Nm": stiffness * onset}

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law with both knees in it."""
        low, high = self.onsets_rad
        for onset in (-low, high):
            tangent = float(spring_tangent_Nm_per_rad(table, onset))
            extra = (self.stiffness_ratio - 1.0) * tangent
            knee = _knee(abs(onset), extra, self.knee_width_rad)
            if onset < 0.0:
                knee = _mirrored(knee)
            table = table._replace(regions=sum_of_regions(table.regions, knee))
        return table

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Where the law bends."""
        (low, high), half = self.onsets_rad, 0.5 * self.knee_width_rad
        bends = (-low - half, -low + half, high - half, high + half)
        if half == 0.0:
            bends = (-NEVER_rad, -low, high, NEVER_rad)
        return {f"knee_{i}": at for i, at in enumerate(bends, start=1)} | {"memory": 1.0}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It stiffens the spring."""
        return "needs a spring between wheel and load" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        low, high = self.onsets_rad
        return (
            f"tangent of f times {self.stiffness_ratio:g} where d < {-low:g} rad or"
            f" d > {high:g} rad, knees {self.knee_width_rad:g} rad wide"
        )


def _knee(onset: float, extra: float, width: float) -> NDArray:
    """Regions of a law that is zero below a positive onset and has a slope beyond it."""
    start, end = onset - 0.5 * width, onset + 0.5 * width
    zero = (start, start, 0.0, 0.0, 0.0, 0.0)
    if width == 0.0:
        return np.array([zero, (np.inf, onset, 0.0, extra, 0.0, 0.0)])
    bend = (end, start, 0.0, 0.0, 0.5 * extra / width, 0.0)
    return np.array([zero, bend, (np.inf, end, 0.5 * extra * width, extra, 0.0, 0.0)])


def _mirrored(regions: NDArray) -> NDArray:
    """Regions of -f(-d)."""
    found = regions[::-1].copy()
    found[:, UPPER] = np.append(-regions[-2::-1, UPPER], np.inf)
    found[:, ANCHOR] *= -1.0
    found[:, [C0, C2]] *= -1.0
    return found


def _monotone_tangents(deflection: NDArray, torque: NDArray) -> NDArray:
    secant = np.diff(torque) / np.diff(deflection)
    if secant.size == 1:
        return read_only(np.repeat(secant, 2))
    tangent = PchipInterpolator(deflection, torque).derivative()(deflection)
    for end in (0, -1):
        if not tangent[end] > 0.01 * secant[end]:
            tangent[end] = secant[end]
    return read_only(tangent)


def _column(name: str, values: ArrayLike, size: int | None = None) -> NDArray:
    array = np.array(values, dtype=float)
    if array.ndim != 1 or array.size < 2 or not np.all(np.isfinite(array)):
        raise TermError(f"spring-curve: {name} must be at least 2 finite numbers in a row")
    if size is not None and array.size != size:
        raise TermError(f"spring-curve: {name} has {array.size} values, deflection_rad {size}")
    return read_only(array)


def _require_increasing(name: str, array: NDArray) -> None:
    if not np.all(np.diff(array) > 0.0):
        k = int(np.argmax(np.diff(array) <= 0.0))
        raise TermError(
            f"spring-curve: {name} must increase: {array[k]:.6g} is followed by {array[k + 1]:.6g}"
        )
