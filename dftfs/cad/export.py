"""The part's files: all of them checked and in place, or none.

Everything is written and verified in a hidden folder beside its destination and then moved, so a
failure leaves no half-written file behind and never damages an older one.
"""

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from dftfs.cad.dxf import PROFILE_TOLERANCE_M, DxfCheck, DxfVariant, write_dxf
from dftfs.cad.solid import build_solid
from dftfs.cad.step import StepCheck, StepLabels, write_step
from dftfs.cad.step_tolerances import StepTolerances
from dftfs.cad.stl import STL_TOLERANCE_MM, StlCheck, write_stl
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.spring.outline import SpringOutline
from dftfs.staging import reason, staging_folder, sweep_stale

PartFormat = Literal["step", "stl", "dxf"]
_FILES = {  # key of ExportResult.files: (format, what follows the name)
    "step": ("step", ".step"),
    "stl": ("stl", ".stl"),
    "dxf_arcs": ("dxf", ".dxf"),
    "dxf_polyline": ("dxf", "-polyline.dxf"),
}
_LONGEST_NAME = 100
_LEAST_FREE_BYTES = 1_000_000  # the CAD kernel fails without a reason where the disk is full
_NAME = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_ .+-]*[A-Za-z0-9_+-])?")


@dataclass(frozen=True, kw_only=True)
class ExportResult:
    """The files written and what was measured on each after reading it back.

    ``files`` is keyed ``step``, ``stl``, ``dxf_arcs``, ``dxf_polyline``; the check of a format
    that was not asked for is None. Volume and mass are the exact outline's.
    """

    name: str
    files: Mapping[str, Path]
    volume_m3: float
    mass_kg: float
    bounding_box_m: tuple[float, float, float]
    step: StepCheck | None
    stl: StlCheck | None
    dxf_arcs: DxfCheck | None
    dxf_polyline: DxfCheck | None


def export_part(
    outline: SpringOutline,
    width_m: float,
    name: str,
    out_dir: Path,
    *,
    density_kg_per_m3: float,
    material: str,
    author: str = "",
    tolerances: StepTolerances | None = None,
    formats: Sequence[PartFormat] = ("step", "stl", "dxf"),
    stl_chord_tolerance_mm: float = STL_TOLERANCE_MM,
    dxf_tolerance_um: float = 1e6 * PROFILE_TOLERANCE_M,
    overwrite: bool = False,
) -> ExportResult:
    """Write STEP, STL and DXF (arcs and polyline) of the part into a folder, made if missing.

    Parameters
    ----------
    name, material, author, tolerances
        Stem of the files and STEP product; what the STEP file states beside the density.
    overwrite : bool
        Whether files of the same names may be replaced.

    Raises
    ------
    DesignError
        If a name, format, text or number is out of range, a file is there and ``overwrite`` is
        false, or the folder cannot be written.
    CadError
        If a file read back is not the part.
    """
    _check_request(name, formats)
    stated = {"material": material, "author": author, "tolerances": tolerances}
    labels = StepLabels(density_kg_per_m3=density_kg_per_m3, **stated)
    targets = {
        key: Path(out_dir) / f"{name}{suffix}"
        for key, (kind, suffix) in _FILES.items()
        if kind in formats
    }
    with _staged(targets, overwrite) as staged:
        checks = _write_files(
            outline,
            width_m,
            name,
            staged,
            labels=labels,
            stl_chord_tolerance_mm=stl_chord_tolerance_mm,
            dxf_tolerance_um=dxf_tolerance_um,
        )
    volume_m3 = float(outline.area_m2 * width_m)
    across = 2 * outline.parameters.rim_outer_radius_m
    return ExportResult(
        name=name,
        files=targets,
        volume_m3=volume_m3,
        mass_kg=volume_m3 * density_kg_per_m3,
        bounding_box_m=(across, across, width_m),
        **{key: checks.get(key) for key in _FILES},
    )


def export_design(design: SpringDesign, out_dir: Path, **options) -> ExportResult:
    """`export_part` of a design by its own name, width and material, with the other options.

    Raises
    ------
    DesignError, CadError
        As `export_part`.
    """
    stated = {
        "density_kg_per_m3": design.material.density_kg_per_m3,
        "material": design.material.name,
    }
    return export_part(design.outline, design.width_m, design.name, out_dir, **stated, **options)


def _write_files(
    outline: SpringOutline,
    width_m: float,
    name: str,
    paths: Mapping[str, Path],
    *,
    labels: StepLabels,
    stl_chord_tolerance_mm: float,
    dxf_tolerance_um: float,
) -> dict[str, StepCheck | StlCheck | DxfCheck]:
    solid = build_solid(outline, width_m)
    checks: dict[str, StepCheck | StlCheck | DxfCheck] = {}
    if "step" in paths:
        checks["step"] = write_step(
            solid, paths["step"], outline=outline, width_m=width_m, name=name, labels=labels
        )
    if "stl" in paths:
        checks["stl"] = write_stl(
            outline, width_m, paths["stl"], name=name, chord_tolerance_mm=stl_chord_tolerance_mm
        )
    for variant in get_args(DxfVariant):
        key = f"dxf_{variant}"
        if key in paths:
            checks[key] = write_dxf(
                outline,
                paths[key],
                variant=variant,
                name=name,
                width_m=width_m,
                tolerance_m=1e-6 * dxf_tolerance_um,
            )
    return checks


def _check_request(name: str, formats: Sequence[str]) -> None:
    if not _NAME.fullmatch(name) or len(name) > _LONGEST_NAME:
        raise DesignError(
            f"name = {name[: 2 * _LONGEST_NAME]!r} cannot name files: up to {_LONGEST_NAME}"
            " letters A-Z a-z, digits, blanks and _ . + - (first a letter, digit or _; last no"
            " dot or blank), without a path"
        )
    unknown = sorted(set(formats) - set(get_args(PartFormat)))
    if unknown or not formats:
        raise DesignError(f"formats = {list(formats)} must be from {list(get_args(PartFormat))}")


def _check_targets(targets: Mapping[str, Path], overwrite: bool) -> None:
    for path in targets.values():
        if path.is_dir():
            raise DesignError(f"{path} is a folder: another name or folder would work")
        if path.exists() and not overwrite:
            raise DesignError(f"{path} exists and is not overwritten: overwrite (--force) would")


@contextmanager
def _staged(targets: Mapping[str, Path], overwrite: bool) -> Iterator[Mapping[str, Path]]:
    """Paths to write to in a hidden folder beside the targets; moved there on success only."""
    folder = next(iter(targets.values())).parent
    made = not folder.exists()
    try:
        _check_targets(targets, overwrite)
        folder.mkdir(parents=True, exist_ok=True)
        sweep_stale(folder)
        with staging_folder(folder) as unfinished:
            staged = {key: unfinished / path.name for key, path in targets.items()}
            yield staged
            for key, path in staged.items():
                path.replace(targets[key])
    except OSError as error:
        raise DesignError(f"a file in {folder} cannot be written: {reason(error)}") from error
    except DesignError as error:
        if folder.is_dir() and shutil.disk_usage(folder).free < _LEAST_FREE_BYTES:
            raise DesignError(f"a file in {folder} cannot be written: the disk is full") from error
        raise
    finally:
        if made and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
