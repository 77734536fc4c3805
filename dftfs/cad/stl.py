"""Binary STL in millimetres within a stated chord tolerance: written, read back and checked."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from dftfs.cad.mesh import tessellate
from dftfs.cad.verify import require
from dftfs.spring.outline import SpringOutline

STL_TOLERANCE_MM = 0.01
STL_VOLUME_RTOL = 1e-3
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER_BYTES = 80


@dataclass(frozen=True, kw_only=True)
class StlCheck:
    """What the re-read STL file is: chord tolerance asked for, triangles, relative volume error."""

    chord_tolerance_m: float
    triangles: int
    volume_error: float


def write_stl(
    outline: SpringOutline,
    width_m: float,
    path: Path,
    *,
    name: str,
    chord_tolerance_mm: float = STL_TOLERANCE_MM,
) -> StlCheck:
    """Write the solid's surface as binary STL, read the file back and check it.

    Raises
    ------
    DesignError
        If the width is not positive or the tolerance not between 1e-5 and 1 mm.
    CadError
        If the file read back is not watertight, not consistently oriented, or its volume is
        off by more than 0.1 % (a smaller chord tolerance would work).
    """
    vertices_m, triangles = tessellate(outline, width_m, chord_tolerance_mm)
    corners = 1e3 * vertices_m[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets = np.zeros(len(triangles), dtype=_FACET)
    facets["corners"] = corners
    facets["normal"] = normals / np.linalg.norm(normals, axis=1)[:, None]
    # a binary file must not begin with "solid", by which readers know the text form
    header = f"binary STL in mm, chord tolerance {chord_tolerance_mm:g} mm: {name}"
    with path.open("wb") as file:
        file.write(header.encode("ascii")[:_HEADER_BYTES].ljust(_HEADER_BYTES))
        file.write(np.uint32(len(facets)).astype("<u4").tobytes())
        file.write(facets.tobytes())
    return check_stl(
        path, volume_m3=outline.area_m2 * width_m, chord_tolerance_mm=chord_tolerance_mm
    )


def check_stl(path: Path, *, volume_m3: float, chord_tolerance_mm: float) -> StlCheck:
    """Read an STL file and check that it is a closed surface around that volume.

    Raises
    ------
    CadError
        As `write_stl`.
    """
    mesh = trimesh.load_mesh(path)
    what = f"STL file {path.name}"
    require(mesh.is_watertight, f"{what} is not watertight")
    require(mesh.is_winding_consistent, f"{what} has facets that face the wrong way")
    error = float(abs(mesh.volume / (1e9 * volume_m3) - 1))
    require(
        error <= STL_VOLUME_RTOL,
        f"{what}: its volume is off by {error:.2e} and may be by {STL_VOLUME_RTOL:.0e}; a chord"
        f" tolerance of {0.9 * chord_tolerance_mm * STL_VOLUME_RTOL / error:.2g} mm would work",
    )
    return StlCheck(
        chord_tolerance_m=1e-3 * chord_tolerance_mm,
        triangles=len(mesh.faces),
        volume_error=error,
    )
