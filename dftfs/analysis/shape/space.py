"""The free numbers of a shape optimisation, and the outline that they stand for.

Every variable is a length over the starting thickness (a fillet over a tenth of it), or the turns
over the starting ones, so that all are of order one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.process import Process
from dftfs.spring.parameters import SpiralParameters

KINDS = ("thickness", "rim_thickness", "fillet", "turns", "profile", "offset")
UNIFORM = ("thickness", "fillet", "turns")
_PROFILE_VALUES, _OFFSET_VALUES = 7, 6
_THICKNESS = (0.6, 1.6)  # of the starting thickness, at hub, rim and between
_TURNS = (0.7, 1.3)  # of the starting turns
_OFFSET = 1.2  # starting thicknesses, either direction
_LARGEST_FILLET = 0.45  # of the starting thickness: within the range of the fitted notch factor
_FILLET_UNIT = 0.1  # of the starting thickness
_ROUNDED_M = 1e-6  # a millionth of a metre is what a drawing states


@dataclass(frozen=True, kw_only=True)
class ShapeSpace:
    """Which numbers of a design may change, between which limits.

    Hub, rim, bore, number of arms, material and both ends of the centreline stay. ``kinds`` are of
    `KINDS`; `UNIFORM` keeps an arm of constant thickness on the starting kind of spiral.

    Raises
    ------
    DesignError
        If the design already has a profile of another length, or a kind is unknown.
    """

    start: SpringDesign
    process: Process
    kinds: tuple[str, ...] = KINDS

    def __post_init__(self) -> None:
        for kind in self.kinds:
            if kind not in KINDS:
                raise DesignError(f"shape variable {kind!r} is unknown; known: {', '.join(KINDS)}")
        p = self.start.spiral
        if p.thickness_profile or p.centreline_offset_m:
            raise DesignError(
                f"{self.start.name}: the search begins at a design without thickness_profile and"
                " centreline_offset_mm; remove both"
            )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name for each variable, the kind first."""
        counts = {"profile": _PROFILE_VALUES, "offset": _OFFSET_VALUES}
        return tuple(
            f"{kind}:{number}" if kind in counts else kind
            for kind in self.kinds
            for number in range(1, counts.get(kind, 1) + 1)
        )

    @property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lower and upper limits of the variables."""
        unit, width = self.start.spiral.thickness_m, self.start.width_m
        wall = max(_THICKNESS[0], self.process.smallest_wall_m(width) / unit)
        radius = self.process.smallest_inside_radius_m(width) / unit
        limits = {
            "turns": _TURNS,
            "offset": (-_OFFSET, _OFFSET),
            "fillet": (radius / _FILLET_UNIT, max(_LARGEST_FILLET, radius) / _FILLET_UNIT),
        }
        pairs = [limits.get(name.partition(":")[0], (wall, _THICKNESS[1])) for name in self.names]
        return np.array([low for low, _ in pairs]), np.array([high for _, high in pairs])

    @property
    def origin(self) -> NDArray:
        """Variables of the starting design, moved into the limits."""
        p = self.start.spiral
        values = {"fillet": p.fillet_radius_m / p.thickness_m / _FILLET_UNIT, "offset": 0.0}
        values["rim_thickness"] = p.thickness_at_rim_m / p.thickness_m
        own = [values.get(name.partition(":")[0], 1.0) for name in self.names]
        return np.clip(own, *self.bounds)

    def spiral(self, variables: NDArray) -> SpiralParameters:
        """The outline's parameters.

        Raises
        ------
        DesignError
            If they are out of order.
        """
        given = self._by_kind(variables)
        p, unit = self.start.spiral, self.start.spiral.thickness_m
        thickness = given["thickness"][0] * unit if "thickness" in given else unit
        changed: dict[str, object] = {"thickness_m": thickness}
        if "rim_thickness" in given:
            changed["rim_thickness_m"] = given["rim_thickness"][0] * unit
        if "fillet" in given:
            changed["fillet_radius_m"] = given["fillet"][0] * unit * _FILLET_UNIT
        if "turns" in given:
            changed["turns"] = given["turns"][0] * p.turns
        if "profile" in given:
            changed["thickness_profile"] = tuple(given["profile"] * unit / thickness)
        if "offset" in given:
            changed["centreline_offset_m"] = tuple(given["offset"] * unit)
        changed["outer_radius_m"] = p.rim_inner_radius_m - (
            changed.get("rim_thickness_m", thickness) / 2
        )
        return replace(p, **changed)

    def design(self, variables: NDArray, width_m: float, name: str) -> SpringDesign:
        """The design, its numbers rounded to what a drawing states.

        Raises
        ------
        DesignError
            If the outline is no solid.
        """
        p = self.spiral(variables)
        rounded = {
            name: _rounded(getattr(p, name))
            for name in ("thickness_m", "rim_thickness_m", "fillet_radius_m", "outer_radius_m")
            if getattr(p, name) is not None
        }
        rounded["turns"] = float(round(p.turns, 5))
        rounded["thickness_profile"] = tuple(float(round(v, 4)) for v in p.thickness_profile)
        rounded["centreline_offset_m"] = tuple(_rounded(v) for v in p.centreline_offset_m)
        return replace(
            self.start, name=name, spiral=replace(p, **rounded), width_m=_rounded(width_m)
        )

    def _by_kind(self, variables: NDArray) -> Mapping[str, NDArray]:
        kinds = np.array([name.partition(":")[0] for name in self.names])
        return {kind: np.asarray(variables)[kinds == kind] for kind in self.kinds}


def _rounded(length_m: float) -> float:
    return float(round(length_m / _ROUNDED_M) * _ROUNDED_M)
