"""Several parts in one folder: CAD files, drawings, and a manifest of what was measured on them."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

from dftfs import __version__
from dftfs.cad.drawing import write_drawing
from dftfs.cad.export import ExportResult, export_design
from dftfs.design import SpringDesign
from dftfs.files import prepare_folder, refuse_existing, to_json, write_text

MANIFEST = "manifest.json"
_SCHEMA = "dftfs-parts-1"


def write_parts(
    designs: Sequence[tuple[SpringDesign, str]],
    folder: Path,
    *,
    overwrite: bool,
    author: str = "",
    on_progress: Callable[[str], None] = lambda message: None,
) -> dict:
    """Write STEP, STL, DXF and drawing of each design, then the manifest.

    Parameters
    ----------
    designs : sequence of (design, hash of its content)

    Returns
    -------
    dict
        What the manifest holds: per part its design, volume, mass, box, what the drawing's
        dimensions measure, and of every file its size and digest.

    Raises
    ------
    DesignError, CadError, OutputError
        As `export_part`; where one part fails no manifest is written.
    """
    manifest = prepare_folder(folder) / MANIFEST
    refuse_existing([manifest], force=overwrite)
    parts = {}
    for design, digest in designs:
        on_progress(f"{design.name}: STEP, STL, DXF, drawing")
        made = export_design(design, folder, author=author, overwrite=overwrite)
        drawing = write_drawing(design, folder, design_hash=digest)
        files = {**made.files, "drawing_dxf": drawing.dxf, "drawing_svg": drawing.svg}
        parts[design.name] = _entry(design, digest, made, files, drawing.measured_mm)
    record = {"schema": _SCHEMA, "made_by": f"dftfs {__version__}", "parts": parts}
    write_text(manifest, to_json(record))
    return record


def _entry(
    design: SpringDesign,
    digest: str,
    made: ExportResult,
    files: dict[str, Path],
    measured_mm: dict[str, float],
) -> dict:
    return {
        "design_hash": digest,
        "material": design.material.name,
        "width_m": design.width_m,
        "n_arms": design.n_arms,
        "turns": design.spiral.turns,
        "volume_m3": made.volume_m3,
        "mass_kg": made.mass_kg,
        "bounding_box_m": made.bounding_box_m,
        "drawing_mm": {name: round(value, 6) for name, value in measured_mm.items()},
        "files": {
            kind: {
                "name": path.name,
                "bytes": path.stat().st_size,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
            for kind, path in files.items()
        },
    }
