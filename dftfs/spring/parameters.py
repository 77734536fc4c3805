"""The numbers that define the planar outline, checked on construction."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError
from dftfs.spring.centreline import CENTRELINES, Spiral
from dftfs.spring.edges import Taper
from dftfs.spring.spline_profile import SplineProfile, checked_values

_POSITIVE = (
    "inner_radius_m",
    "outer_radius_m",
    "turns",
    "thickness_m",
    "fillet_radius_m",
    "bore_radius_m",
    "hub_radius_m",
    "rim_inner_radius_m",
    "rim_outer_radius_m",
)
_LEAST_TURNS, _MOST_TURNS, _MOST_ARMS = 1e-3, 100, 100  # beyond, no strip is left between the gaps
PROFILE_SHARES = (0.2, 5.0)  # of the thickness at the hub: what a profile may ask for
TAPERED = (0.12, 0.90)  # of the centreline's sweep: constant thickness before and behind
_ORDER = (
    ("bore_radius_m", "hub_radius_m", "the bore would cut through the hub"),
    ("inner_radius_m", "outer_radius_m", "an arm runs outwards"),
    ("hub_radius_m", "rim_inner_radius_m", "the hub would fill the rim"),
    ("rim_inner_radius_m", "rim_outer_radius_m", "the rim would have no wall"),
)


@dataclass(frozen=True, kw_only=True)
class SpiralParameters:
    """Radii, strip thickness, fillets and number of arms of the outline, in m and rad.

    ``hub_radius_m`` is the hub's outer radius, ``rim_inner_radius_m`` the rim's inner one;
    ``tip_radius_m`` rounds the convex corner at the arm's tip (0 leaves it sharp); ``curve`` is a
    key of `dftfs.spring.centreline.CENTRELINES`. With ``rim_thickness_m`` the strip tapers from
    ``thickness_m`` at the hub to that at the rim (`dftfs.spring.edges.Taper`);
    ``thickness_profile`` are thicknesses over ``thickness_m`` at equal steps between both ends, and
    ``centreline_offset_m`` what the centreline's radius differs from ``curve`` there
    (`dftfs.spring.spline_profile`).

    Raises
    ------
    DesignError
        If a size is not positive or the radii are out of order; the message names both values.
    """

    inner_radius_m: float
    outer_radius_m: float
    turns: float
    n_arms: int
    thickness_m: float
    fillet_radius_m: float
    tip_radius_m: float
    bore_radius_m: float
    hub_radius_m: float
    rim_inner_radius_m: float
    rim_outer_radius_m: float
    start_angle_rad: float = 0.0
    curve: str = "fermat"
    rim_thickness_m: float | None = None
    thickness_profile: tuple[float, ...] = ()
    centreline_offset_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.curve not in CENTRELINES:
            raise DesignError(
                f"centreline = {self.curve!r} is unknown; known are {', '.join(CENTRELINES)}"
            )
        for name in _POSITIVE:
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise DesignError(f"{self.text(name)} must be positive")
        if not (_LEAST_TURNS <= self.turns <= _MOST_TURNS and self.n_arms <= _MOST_ARMS):
            raise DesignError(
                f"turns = {self.turns:g} and n_arms = {self.n_arms}: {_LEAST_TURNS:g} to"
                f" {_MOST_TURNS} turns and at most {_MOST_ARMS} arms"
            )
        if not abs(self.start_angle_rad) <= 2 * np.pi:
            raise DesignError(
                f"start_angle_deg = {np.degrees(self.start_angle_rad):g} must be from -360 to 360"
            )
        checked_values(self.thickness_profile, "thickness_profile", *PROFILE_SHARES)
        reach_mm = 1e3 * (self.outer_radius_m - self.inner_radius_m)
        offset_mm = tuple(1e3 * value for value in self.centreline_offset_m)
        checked_values(offset_mm, "centreline_offset_mm", -reach_mm, reach_mm)
        rim = self.rim_thickness_m
        if rim is not None and not (np.isfinite(rim) and rim > 0):
            raise DesignError(f"{self.text('rim_thickness_m')} must be positive")
        if not 0 <= self.tip_radius_m < self.thickness_at_rim_m / 2:
            raise DesignError(
                f"{self.text('tip_radius_m')} must be at least 0 and below half of"
                f" {self.text('thickness_m' if rim is None else 'rim_thickness_m')}"
            )
        if self.n_arms != int(self.n_arms) or self.n_arms < 1:
            raise DesignError(f"n_arms = {self.n_arms} must be a whole number, 1 or more")
        for small, large, why in _ORDER:
            if not getattr(self, small) < getattr(self, large):
                raise DesignError(f"{self.text(small)} must be below {self.text(large)}: {why}")

    def text(self, name: str) -> str:
        """A field with its value as a person writes it: ``thickness_mm = 7.7``."""
        value = getattr(self, name)
        return f"{name[:-2]}_mm = {value * 1e3:.6g}" if name.endswith("_m") else f"{name} = {value}"

    @cached_property
    def centreline(self) -> Spiral:
        """Centreline of arm 0."""
        return CENTRELINES[self.curve](
            inner_radius_m=self.inner_radius_m,
            outer_radius_m=self.outer_radius_m,
            turns=self.turns,
            rotation_rad=self.start_angle_rad,
            offset_m=self.centreline_offset_m,
        )

    @property
    def thickness_at_rim_m(self) -> float:
        """Thickness of the strip where it meets the rim."""
        return self.thickness_m if self.rim_thickness_m is None else self.rim_thickness_m

    @cached_property
    def taper(self) -> Taper | SplineProfile | None:
        """How the thickness changes; None where it does not."""
        same = self.rim_thickness_m is None or self.rim_thickness_m == self.thickness_m
        if same and not self.thickness_profile:
            return None
        first, last = self.centreline.start, self.centreline.end
        start, end = (first + share * (last - first) for share in TAPERED)
        ends = self.thickness_m, self.thickness_at_rim_m
        if not self.thickness_profile:
            return Taper(first_m=ends[0], last_m=ends[1], start=start, end=end)
        inner = tuple(share * self.thickness_m for share in self.thickness_profile)
        return SplineProfile(first=ends[0], inner=inner, last=ends[1], start=start, end=end)

    @property
    def thickness_range_m(self) -> tuple[float, float]:
        """Bounds of the thickness along the arm (those of a profile's coefficients)."""
        inner = [share * self.thickness_m for share in self.thickness_profile]
        every = (self.thickness_m, self.thickness_at_rim_m, *inner)
        return min(every), max(every)

    @property
    def tapered_by(self) -> str:
        """The field that makes the thickness vary, with its value."""
        if self.thickness_profile:
            return f"thickness_profile of {len(self.thickness_profile)} values"
        return self.text("rim_thickness_m")

    def thickness_at(self, theta: ArrayLike) -> NDArray:
        """Thickness of the strip at centreline parameters, in m."""
        if self.taper is None:
            return np.full(np.shape(theta), self.thickness_m)
        return self.taper.thickness_m(theta)

    @property
    def pitch_rad(self) -> float:
        """Angle between one arm and the next."""
        return 2 * np.pi / self.n_arms
