"""The part in three dimensions: by VTK where it can open an off-screen window, else drawn."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from numpy.typing import NDArray

import dftfs
from dftfs.report.style import FIGURE_WIDTH_IN, INK, ReportFigure, as_png, house_style, new_figure

_PIXELS = 1240
_PATIENCE_s = 60
_LIGHT = np.array([0.35, -0.45, 0.82])
_TILT_RAD, _TURN_RAD = 0.79, 0.27  # as the camera of render_window stands
_FLAT = 0.999


def part_render(vertices_m: NDArray, triangles: NDArray, name: str) -> ReportFigure:
    """Picture of the part from its triangulated surface, (n, 3) in m and (m, 3)."""
    vertices, triangles = np.asarray(vertices_m), np.asarray(triangles)
    size = np.ptp(vertices, axis=0) * 1e3
    alt = f"The spring {name}, {size[0]:.1f} mm across and {size[2]:.2f} mm wide."
    picture = _by_vtk(vertices, triangles)
    if picture is not None:
        return ReportFigure(name="render", alt=alt, caption=alt, png=picture)
    return shaded_drawing(vertices, triangles, alt)


def _by_vtk(vertices: NDArray, triangles: NDArray) -> bytes | None:
    """The picture by VTK in a process of its own; None where that fails or is blank."""
    root = str(Path(dftfs.__file__).parents[1])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    with tempfile.TemporaryDirectory(prefix="dftfs-") as folder:
        part, picture = Path(folder) / "part.npz", Path(folder) / "part.png"
        np.savez(part, vertices_m=vertices, triangles=triangles, width=_PIXELS)
        command = [
            sys.executable,
            "-m",
            "dftfs.report.figures.render_window",
            str(part),
            str(picture),
        ]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                timeout=_PATIENCE_s,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode != 0 or not picture.exists():
            return None
        seen = imread(picture)
        return picture.read_bytes() if np.ptp(seen[..., :3]) > 0.2 else None


def shaded_drawing(vertices: NDArray, triangles: NDArray, alt: str) -> ReportFigure:
    """A shaded view of a flat part by the painter's algorithm.

    Walls that face the viewer from far to near, then the upper face: exact for a prism.
    """
    view = _view()
    seen = 1e3 * (vertices - vertices.mean(axis=0)) @ view.T
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    facing = normal @ view[2] > 0
    upper = normal[:, 2] > _FLAT
    depth = seen[triangles][:, :, 2].mean(axis=1)
    walls = np.flatnonzero(facing & ~upper)
    order = np.concatenate([walls[np.argsort(depth[walls])], np.flatnonzero(facing & upper)])
    light = 0.42 + 0.58 * np.clip(normal[order] @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    colours = np.clip(light[:, None] * np.array(to_rgb("#d3dde7"))[None], 0, 1)
    with house_style():
        across, high = np.ptp(seen, axis=0)[:2]
        figure = new_figure(FIGURE_WIDTH_IN * high / across)
        axes = figure.add_subplot()
        axes.add_collection(
            PolyCollection(
                seen[triangles[order]][:, :, :2], facecolors=colours, edgecolors=colours, lw=0.3
            )
        )
        _rims(axes, seen, triangles, upper)
        axes.autoscale_view()
        axes.set_aspect("equal")
        axes.axis("off")
        return as_png(
            figure,
            name="render",
            alt=alt,
            caption=f"{alt[:-1]}, drawn by matplotlib: VTK could not open an off-screen window.",
        )


def _view() -> NDArray:
    """Rows: right, up and towards the viewer, in the part's axes."""
    c, s = np.cos(_TURN_RAD), np.sin(_TURN_RAD)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    c, s = np.cos(_TILT_RAD), np.sin(_TILT_RAD)
    return np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ turn


def _rims(axes, seen: NDArray, triangles: NDArray, upper: NDArray) -> None:
    """The upper face's border."""
    edges = np.sort(
        np.concatenate([triangles[upper][:, [i, (i + 1) % 3]] for i in range(3)]), axis=1
    )
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    border = unique[counts == 1]
    axes.add_collection(
        PolyCollection(
            seen[border][:, :, :2], closed=False, facecolors="none", edgecolors=INK, lw=0.6
        )
    )
