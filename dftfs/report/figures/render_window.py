"""A picture of the part by VTK, run as a process of its own.

``python -m dftfs.report.figures.render_window part.npz picture.png``: where no off-screen
window can be opened, VTK may abort the process that asks, which must not be the study's.
"""

import sys
from pathlib import Path

import numpy as np
import pyvista

_CAMERA = np.array([0.35, -1.25, 1.25])  # direction to the camera: from the front, from above
_MARGIN = 1.03
_COLOUR, _EDGE = "#b9c6d3", "#1f2933"


def render(vertices_m: np.ndarray, triangles: np.ndarray, picture: Path, width: int) -> None:
    """Write a PNG of a closed triangulated surface, so many pixels wide and as high as it needs."""
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    surface = pyvista.PolyData(1e3 * vertices_m, faces)
    half = half_extents(surface.points)
    size = [width, int(np.ceil(width * half[1] / half[0]))]
    plotter = pyvista.Plotter(off_screen=True, window_size=size, lighting="three lights")
    plotter.set_background("white")
    plotter.add_mesh(
        surface, color=_COLOUR, smooth_shading=True, split_sharp_edges=True, specular=0.35
    )
    edges = surface.extract_feature_edges(feature_angle=35)
    plotter.add_mesh(edges, color=_EDGE, line_width=2)
    plotter.enable_parallel_projection()
    plotter.enable_anti_aliasing("ssaa")
    plotter.camera_position = [tuple(_CAMERA), (0, 0, 0), (0, 0, 1)]
    plotter.reset_camera()
    plotter.camera.parallel_scale = _MARGIN * half[1]
    plotter.screenshot(str(picture))
    plotter.close()


def half_extents(points: np.ndarray) -> tuple[float, float]:
    """Half the width and height that points (n, 3) take in the picture."""
    right = np.cross([0.0, 0.0, 1.0], _CAMERA)
    up = np.cross(_CAMERA, right)
    sides = [points @ (axis / np.linalg.norm(axis)) for axis in (right, up)]
    return tuple(float(np.ptp(side)) / 2 for side in sides)


if __name__ == "__main__":
    with np.load(sys.argv[1]) as part:
        render(part["vertices_m"], part["triangles"], Path(sys.argv[2]), int(part["width"]))
