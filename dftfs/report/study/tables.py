"""Tables of the report as plain text, rows ready to be set."""

import math
import os
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from urllib.parse import quote

from dftfs.analysis.study.result import StudyResult
from dftfs.analysis.torsion.result import MeshSummary, StiffnessResult
from dftfs.report.figures.curve import model_curves
from dftfs.report.numbers import (
    NOTHING,
    fixed,
    human,
    kilobytes,
    percent,
    plain,
    seconds,
    signed,
    with_uncertainty,
)

_FORMATS = {
    "step": "STEP, the solid",
    "stl": "STL, its triangulated surface",
    "dxf_arcs": "DXF, profile of lines and arcs",
    "dxf_polyline": "DXF, profile as polylines",
}
_UNITS = {
    "Nm_per_rad": "Nm/rad",
    "Nm_per_s": "Nm/s",
    "rad_per_s": "rad/s",
    "Nm": "Nm",
    "A": "A",
    "s": "s",
    "deg": "°",
    "percent": "%",
    "rad": "rad",
    "Hz": "Hz",
    "V": "V",
}
_TEXTS = {"rmse": "error, root mean square", "rms": "root mean square", "from": "evaluated from"}


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of text; ``numeric`` are the columns that are set to the right."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class FileRow:
    """One exported file: name, relative address, kind, size, what its re-reading showed."""

    name: str
    address: str
    kind: str
    size: str
    checked: str


def models_table(study: StudyResult) -> Table:
    """Stiffness, first contact and time of every model."""
    reference = study.solid.stiffness_Nm_per_rad
    rows = []
    for curve in model_curves(study):
        stiffness = plain(curve.stiffness_Nm_per_rad)
        if curve.name == study.solid.model:
            stiffness = with_uncertainty(reference, study.stiffness_uncertainty_Nm_per_rad)
        difference = curve.stiffness_Nm_per_rad / reference - 1
        rows.append(
            (
                curve.name,
                stiffness,
                percent(difference) if curve.name != study.solid.model else "reference",
                _onset(curve.contact_onset.get("winding")),
                _onset(curve.contact_onset.get("unwinding")),
                seconds(curve.wall_s),
            )
        )
    return Table(
        caption="The models compared; stiffness is the tangent at rest.",
        head=("model", "K (Nm/rad)", "to 3D", "contact, winding", "contact, unwinding", "time"),
        rows=tuple(rows),
        numeric=(1, 2, 3, 4, 5),
    )


def _onset(onset) -> str:
    if onset is None:
        return NOTHING
    angle = human(onset.deflection_rad, "rad")[0]
    return f"{signed(onset.torque_Nm)} Nm at {angle.replace(' (', ' rad (')}"


def states_table(result: StiffnessResult) -> Table:
    """The computed states of a finite element model."""
    rows = [
        (
            f"{fixed(angle, 4)} ({fixed(math.degrees(angle), 2)}°)",
            fixed(torque, 3),
            f"{tangent:.2f}",
            f"{1e-6 * stress:.0f}",
            f"{max(1e3 * gap, 0.0):.3f}",
        )
        for angle, torque, tangent, stress, gap in zip(
            result.deflection_rad.tolist(),
            result.torque_Nm.tolist(),
            result.tangent_Nm_per_rad.tolist(),
            result.peak_von_mises_Pa.tolist(),
            result.min_clearance_m.tolist(),
        )
    ]
    ends = "; ".join(f"{direction}, {why}" for direction, why in result.ended_by.items())
    return Table(
        caption=f"Computed states, {result.model}. Ends of the curve: {ends}.",
        head=("deflection (rad)", "torque (Nm)", "tangent (Nm/rad)", "peak (MPa)", "gap (mm)"),
        rows=tuple(rows),
        numeric=(0, 1, 2, 3, 4),
    )


def closed_forms_table(study: StudyResult) -> Table:
    """Equations 2.1 to 2.7, as printed and corrected."""
    rows = []
    for form in study.closed_forms:
        printed, unit = human(form.as_printed, form.unit)
        corrected, _ = human(form.corrected, form.unit)
        rows.append(
            (form.equation, form.quantity, printed, corrected, unit, form.note, form.erratum)
        )
    return Table(
        caption="Equations 2.1 to 2.7 as printed and as corrected.",
        head=("eq.", "quantity", "as printed", "corrected", "unit", "difference", "errata"),
        rows=tuple(rows),
        numeric=(2, 3),
    )


def mesh_table(planar: MeshSummary, solid: MeshSummary) -> Table:
    """Size and quality of the meshes that were solved on, 2D beside 3D."""
    pair = (planar, solid)
    rows = [
        (name, *(_thousands(getattr(mesh, name)) for mesh in pair))
        for name in ("elements", "nodes", "unknowns")
    ]
    rows.append(("smallest corner sine", *(plain(mesh.min_corner_sine, 2) for mesh in pair)))
    rows.append(("part solved", *(mesh.symmetry for mesh in pair)))
    rows.append(("linear solver", *(mesh.solver for mesh in pair)))
    return Table(
        caption="The meshes used; a corner's sine is 1 at 90°, 0 when flat.",
        head=("", "2D", "3D"),
        rows=tuple(rows),
        numeric=(1, 2),
    )


def _thousands(count: int) -> str:
    return f"{count:,}".replace(",", "\u202f")


def mesh_error_table(study: StudyResult) -> Table:
    """Stiffness over the mesh series and its distance to the extrapolated value."""
    error = study.mesh_error
    limit = error.extrapolated_Nm_per_rad
    rows = [
        (f"{plain(size, 3)}", f"{value:.4f}", percent(value / limit - 1))
        for size, value in zip(error.sizes, error.stiffness_Nm_per_rad)
    ]
    rows.append(("0 (extrapolated)", f"{limit:.4f}", NOTHING))
    return Table(
        caption="Stiffness on a series of meshes.",
        head=("element size, relative", "K (Nm/rad)", "to extrapolated"),
        rows=tuple(rows),
        numeric=(1, 2),
    )


def files_table(study: StudyResult, folder: Path) -> tuple[FileRow, ...]:
    """The exported files with addresses relative to the report's folder."""
    rows = []
    for key, path in study.export.files.items():
        size = kilobytes(path.stat().st_size) if path.exists() else "not found"
        rows.append(
            FileRow(
                name=path.name,
                address=quote(Path(os.path.relpath(path, folder)).as_posix()),
                kind=_FORMATS.get(key, key),
                size=size,
                checked=_checked(getattr(study.export, key, None)),
            )
        )
    return tuple(rows)


def _checked(check) -> str:
    """What the re-reading of a file showed; the three kinds of check by what they hold."""
    if check is None:
        return NOTHING
    if hasattr(check, "deviation_m"):
        return (
            f"{check.loops} loops, {check.arcs + check.lines} pieces, within"
            f" {plain(1e6 * check.deviation_m, 2)} µm of the exact outline"
        )
    if hasattr(check, "triangles"):
        return (
            f"{check.triangles} triangles, chord tolerance"
            f" {plain(1e6 * check.chord_tolerance_m, 2)} µm, relative volume error"
            f" {plain(abs(check.volume_error), 2)}"
        )
    return (
        f"{check.faces} faces, one closed solid, relative volume error"
        f" {plain(abs(check.volume_error), 2)}"
    )


def record_table(record: object, caption: str, skip: tuple[str, ...] = ()) -> Table:
    """A dataclass of named numbers as a table: words, value, unit; None is left out."""
    values = asdict(record) if is_dataclass(record) else dict(record)
    rows = []
    for name, value in values.items():
        if name in skip or value is None or isinstance(value, str):
            continue
        label, unit = label_and_unit(name.replace("largest_by", "largest_amplitude_by"))
        if name.startswith("share_"):
            label, unit, value = label.replace("share ", "share of time: "), "%", 100 * value
        rows.append((label, plain(float(value)), unit))
    return Table(caption=caption, head=("", "value", "unit"), rows=tuple(rows), numeric=(1,))


def label_and_unit(name: str) -> tuple[str, str]:
    """A field's name as words and its unit: ``rmse_Nm`` is an error in Nm."""
    for suffix in sorted(_UNITS, key=len, reverse=True):
        if name.endswith("_" + suffix):
            stem = name[: -len(suffix) - 1]
            break
    else:
        stem, suffix = name, ""
    label = " ".join(_TEXTS.get(word, word) for word in stem.split("_"))
    return label, _UNITS.get(suffix, "")


def provenance_table(study: StudyResult) -> Table:
    """Design hash, command, time, solver and versions."""
    found = study.provenance
    rows = [
        ("command", found.command),
        ("made (UTC)", found.made_utc),
        ("design hash", found.design_hash),
        ("material", f"{study.design.material.name}: {study.design.material.description}"),
        ("linear solver", found.solver),
        ("time", ", ".join(f"{name} {seconds(t)}" for name, t in found.wall_s.items())),
        ("versions", ", ".join(f"{name} {version}" for name, version in found.versions.items())),
    ]
    return Table(caption="Provenance.", head=("", ""), rows=tuple(rows))


def part_table(study: StudyResult) -> Table:
    """Material and size of the part."""
    design, export = study.design, study.export
    material = design.material
    box = " × ".join(f"{1e3 * side:.5g}" for side in export.bounding_box_m)
    strength = material.yield_strength_Pa
    rows = (
        ("volume", plain(1e6 * export.volume_m3), "cm³"),
        ("mass", plain(1e3 * export.mass_kg), "g"),
        ("bounding box", box, "mm"),
        ("Young's modulus", plain(1e-9 * material.youngs_modulus_Pa, 3), "GPa"),
        ("Poisson's ratio", plain(material.poisson_ratio, 2), ""),
        ("density", plain(material.density_kg_per_m3), "kg/m³"),
        ("yield strength", "open" if strength is None else plain(1e-6 * strength, 3), "MPa"),
    )
    return Table(
        caption=f"The part in {material.name}.",
        head=("", "value", "unit"),
        rows=rows,
        numeric=(1,),
    )
