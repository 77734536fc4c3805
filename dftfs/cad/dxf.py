"""DXF of the profile for laser, water jet and wire EDM: closed loops in mm, and nothing else.

Two variants: ``arcs`` (circles, and polylines of arcs and lines) and ``polyline`` (straight chords
only). No splines, which cutting software reads differently, and no text, which it would cut; the
part's name, width and tolerance stand in the header.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import ezdxf
import numpy as np
from ezdxf import units
from ezdxf.document import Drawing
from ezdxf.entities import Circle, DXFEntity, LWPolyline

from dftfs.cad.bulge_loop import BulgeLoop
from dftfs.cad.profile import arc_loop, chord_loop, deviation, outline_loops
from dftfs.cad.verify import require
from dftfs.errors import DesignError
from dftfs.spring.outline import SpringOutline

DxfVariant = Literal["arcs", "polyline"]
PROFILE_TOLERANCE_M = 2e-6
_LAYERS = {"OUTER": 7, "BORE": 5, "VOIDS": 1}  # name: colour number
_METRIC = 1


@dataclass(frozen=True, kw_only=True)
class DxfCheck:
    """What the re-read DXF file is: its loops, pieces, and distance from the exact outline.

    ``deviation_m`` is the larger of the two one-sided distances, over all loops;
    ``area_error_m2`` is the section's, signed, and cannot exceed ``area_bound_m2``, the
    length of all loops times the tolerance.
    """

    variant: DxfVariant
    tolerance_m: float
    deviation_m: float
    loops: int
    arcs: int
    lines: int
    area_error_m2: float
    area_bound_m2: float


def write_dxf(
    outline: SpringOutline,
    path: Path,
    *,
    variant: DxfVariant,
    name: str,
    width_m: float,
    tolerance_m: float = PROFILE_TOLERANCE_M,
) -> DxfCheck:
    """Write the profile, read the file back and check it.

    Raises
    ------
    DesignError
        If the variant is unknown, or the tolerance is not between 0.01 um and 1 mm.
    CadError
        As `check_dxf`.
    """
    if variant not in get_args(DxfVariant):
        raise DesignError(f"DXF variant = {variant!r} must be one of {get_args(DxfVariant)}")
    document = ezdxf.new("R2004")  # the oldest version with units, bulges and properties
    document.units = units.MM
    document.header["$MEASUREMENT"] = _METRIC
    document.header.custom_vars.append("part", name)
    document.header.custom_vars.append("width_mm", f"{1e3 * width_m:.9g}")
    document.header.custom_vars.append("tolerance_um", f"{1e6 * tolerance_m:.9g}")
    for layer, colour in _LAYERS.items():
        document.layers.add(layer, color=colour)
    space = document.modelspace()
    for loop_name, edges in outline_loops(outline):
        attributes = {"layer": _layer(loop_name)}
        if variant == "arcs" and len(edges) == 1:
            x, y = edges[0].centre_m
            space.add_circle((1e3 * x, 1e3 * y), 1e3 * edges[0].radius_m, dxfattribs=attributes)
            continue
        make = arc_loop if variant == "arcs" else chord_loop
        loop = make(loop_name, edges, tolerance_m)
        points = np.column_stack([1e3 * loop.vertices_m, loop.bulges])
        space.add_lwpolyline(points, format="xyb", close=True, dxfattribs=attributes)
    document.saveas(path)
    return check_dxf(path, outline=outline, variant=variant, tolerance_m=tolerance_m)


def check_dxf(
    path: Path, *, outline: SpringOutline, variant: DxfVariant, tolerance_m: float
) -> DxfCheck:
    """Read a DXF file and measure it against the exact outline.

    Raises
    ------
    CadError
        If it is not in mm, holds anything but the closed loops of the outline on their layers,
        strays from the exact edges by more than the tolerance, or encloses another area than
        the tolerance allows.
    """
    what = f"DXF file {path.name}"
    document = ezdxf.readfile(path)
    require(
        document.header["$INSUNITS"] == units.MM and document.header["$MEASUREMENT"] == _METRIC,
        f"{what} is not in mm",
    )
    found = _read_loops(document, what)
    exact = outline_loops(outline)
    layers = [_layer(name) for name, _ in exact]
    require([layer for layer, _ in found] == layers, f"{what} must hold loops on layers {layers}")
    loops = [loop for _, loop in found]
    error = max(deviation(loop, edges) for loop, (_, edges) in zip(loops, exact, strict=True))
    require(
        error <= tolerance_m,
        f"{what} strays {1e6 * error:.3g} um from the outline, at most {1e6 * tolerance_m:.3g}",
    )
    areas = np.abs([loop.area_m2 for loop in loops])
    area_error = float(areas[0] - np.sum(areas[1:]) - outline.area_m2)
    bound = tolerance_m * sum(loop.length_m for loop in loops)
    require(
        abs(area_error) <= bound,
        f"{what} encloses {1e6 * area_error:.3g} mm2 too much, at most {1e6 * bound:.3g}",
    )
    curved = sum(int(np.count_nonzero(loop.bulges)) for loop in loops)
    return DxfCheck(
        variant=variant,
        tolerance_m=tolerance_m,
        deviation_m=error,
        loops=len(loops),
        arcs=curved,
        lines=sum(len(loop.bulges) for loop in loops) - curved,
        area_error_m2=area_error,
        area_bound_m2=bound,
    )


def _layer(loop_name: str) -> str:
    return {"outer": "OUTER", "bore": "BORE"}.get(loop_name, "VOIDS")


def _read_loops(document: Drawing, what: str) -> list[tuple[str, BulgeLoop]]:
    return [(entity.dxf.layer, _read_loop(entity, what)) for entity in document.modelspace()]


def _read_loop(entity: DXFEntity, what: str) -> BulgeLoop:
    if isinstance(entity, Circle):
        centre = np.array([entity.dxf.center.x, entity.dxf.center.y])
        return BulgeLoop.circle(entity.dxf.layer, 1e-3 * centre, 1e-3 * entity.dxf.radius)
    require(isinstance(entity, LWPolyline), f"{what} holds a {entity.dxftype()}")
    require(entity.closed, f"{what} holds an open polyline on layer {entity.dxf.layer}")
    points = np.array(entity.get_points("xyb"))
    return BulgeLoop(name=entity.dxf.layer, vertices_m=1e-3 * points[:, :2], bulges=points[:, 2])
