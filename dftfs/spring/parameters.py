"""The numbers that define the planar outline, checked on construction."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError
from dftfs.spring.centreline import CENTRELINES, Spiral
from dftfs.spring.edges import Taper

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
    ``thickness_m`` at the hub to that at the rim (`dftfs.spring.edges.Taper`).

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
        )

    @property
    def thickness_at_rim_m(self) -> float:
        """Thickness of the strip where it meets the rim."""
        return self.thickness_m if self.rim_thickness_m is None else self.rim_thickness_m

    @cached_property
    def taper(self) -> Taper | None:
        """How the thickness changes; None where it does not."""
        if self.rim_thickness_m is None or self.rim_thickness_m == self.thickness_m:
            return None
        first, last = self.centreline.start, self.centreline.end
        start, end = (first + share * (last - first) for share in TAPERED)
        return Taper(first_m=self.thickness_m, last_m=self.thickness_at_rim_m, start=start, end=end)

    def thickness_at(self, theta: ArrayLike) -> NDArray:
        """Thickness of the strip at centreline parameters, in m."""
        if self.taper is None:
            return np.full(np.shape(theta), self.thickness_m)
        return self.taper.thickness_m(theta)

    @property
    def pitch_rad(self) -> float:
        """Angle between one arm and the next."""
        return 2 * np.pi / self.n_arms
