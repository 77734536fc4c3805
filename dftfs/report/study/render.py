"""One HTML file that needs no other: every figure, style and number is inside it.

After mujoco.sysid's reports: the page is a template, its sections are figures and tables that are
built before it.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from markupsafe import Markup, escape

from dftfs.analysis.meshing.coil_gap_mesh import CoilGapMesh
from dftfs.analysis.study.result import StudyResult
from dftfs.analysis.torsion.result import SIGN
from dftfs.report.figures.actuator import actuator_figure
from dftfs.report.figures.curve import torque_angle_figure
from dftfs.report.figures.friction import friction_loop_figure, friction_loop_sentence
from dftfs.report.figures.gap import contact_figure, gap_figure
from dftfs.report.figures.gap_profile import gap_profile, sector_displacement
from dftfs.report.figures.mesh import mesh_figure
from dftfs.report.figures.part import boundary_conditions, part_drawing
from dftfs.report.figures.render import part_render
from dftfs.report.figures.stress import stress_figure, stress_scale
from dftfs.report.figures.turnable import turnable_part
from dftfs.report.numbers import percent, plain, signed
from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.study import summary, tables
from dftfs.report.study.assumptions import assumptions
from dftfs.report.study.tables_structure import structure_tables
from dftfs.report.style import ReportFigure

_SYMBOLS = tuple(
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        (r"\b([A-Zr])_([a-z]{1,2})\b", r"<i>\1</i><sub>\2</sub>"),
        (r"\bw([12])\b", r"<i>w</i><sub>\1</sub>"),
        (r"\^2\b", "<sup>2</sup>"),
        (r"\bpi\b", "π"),
        (r" - ", " − "),
    )
)
_ZOOM = 0.55  # half side of the enlarged peak over the strip's thickness


def write_report(study: StudyResult, path: Path) -> Path:
    """Write the report of a study as one self-contained HTML file, whole or not at all.

    Raises
    ------
    OutputError
        If the file cannot be written.
    DesignError
        If the study's fields are not on the study's mesh.
    """
    planar = replace(study.planar, fields=None)  # no figure shows them
    return write_page(path, "study", study=replace(study, planar=planar))


def render_study_page(study: StudyResult, folder: Path) -> str:
    """The report's HTML; its files are those of ``folder``."""
    return render_report(study, folder, report_figures(study))


def render_report(study: StudyResult, folder: Path, figures: Mapping[str, ReportFigure]) -> str:
    """The report's HTML with its figures; links to the files are relative to ``folder``."""
    environment = page_environment(symbols=symbols)
    environment.filters["readable"] = summary.readable
    environment.globals["outcome"] = summary.check_text
    environment.globals["plain"] = plain
    environment.globals["loop_sentence"] = friction_loop_sentence
    return render_page(
        environment,
        "report.html",
        figures.values(),
        study=study,
        verdict=summary.verdict(study.judged),
        big_numbers=summary.big_numbers(study),
        figures=figures,
        turnable=turnable_part(study.solid, study.design.width_m),
        turnable_script=environment.loader.get_source(environment, "turnable.js")[0],
        tables=_tables(study),
        structure_tables=() if study.structure is None else structure_tables(study.structure),
        files=tables.files_table(study, folder),
        mesh_sentence=_mesh_sentence(study),
        assumptions=assumptions(study),
    )


def symbols(text: str) -> Markup:
    """Text, escaped, with the symbols of formulas set: R_i, w1, R_o^2, pi, minus."""
    found = str(escape(text))
    for pattern, replacement in _SYMBOLS:
        found = pattern.sub(replacement, found)
    return Markup(found)


def report_figures(study: StudyResult) -> Mapping[str, ReportFigure]:
    """Every figure of the report by name."""
    design = study.design
    figures = [
        part_render(study.solid_vertices_m, study.solid_triangles, design.name),
        part_drawing(design),
        boundary_conditions(design, study.lateral_stiffness_N_per_m),
        mesh_figure(study.sector, design.n_arms, design.spiral.thickness_m),
        *_stress_figures(study),
        torque_angle_figure(study),
        _gap_figure(study),
        contact_figure(study.solid.snapshots, study.solid.contact_onset, design.spiral.thickness_m),
    ]
    if study.friction_loop is not None:
        figures.append(friction_loop_figure(study.friction_loop))
    if study.actuator is not None:
        figures.append(actuator_figure(study.actuator))
    return {figure.name: figure for figure in figures if figure is not None}


def _stress_figures(study: StudyResult) -> list[ReportFigure]:
    """Both directions on one scale, from the solid model where it has fields."""
    result = study.solid if study.solid.snapshots else study.planar
    if not result.snapshots:
        return []
    scale = stress_scale(result.snapshots, study.design.material.yield_strength_Pa)
    shown = {
        direction: int(np.abs(result.deflection_rad - snapshot.deflection_rad).argmin())
        for direction, snapshot in result.snapshots.items()
    }
    return [
        stress_figure(
            result.snapshots[direction],
            direction=direction,
            model=result.model,
            scale=scale,
            zoom_m=_ZOOM * study.design.spiral.thickness_m,
            largest_Pa=float(result.peak_von_mises_Pa[shown[direction]]),
        )
        for direction in SIGN
        if direction in result.snapshots
    ]


def _gap_figure(study: StudyResult) -> ReportFigure:
    gap = CoilGapMesh(sector=study.sector, parameters=study.design.spiral)
    snapshots = study.solid.snapshots or study.planar.snapshots
    return gap_figure(
        gap_profile(gap),
        {
            direction: gap_profile(gap, sector_displacement(gap, snapshot))
            for direction, snapshot in snapshots.items()
        },
        {
            direction: f"{direction}, {signed(snapshot.torque_Nm, 3)} Nm"
            for direction, snapshot in snapshots.items()
        },
    )


def _tables(study: StudyResult) -> Mapping[str, tables.Table]:
    found = {
        "part": tables.part_table(study),
        "mesh": tables.mesh_table(study.planar.mesh, study.solid.mesh),
        "models": tables.models_table(study),
        "states": tables.states_table(study.solid),
        "closed_forms": tables.closed_forms_table(study),
        "mesh_error": tables.mesh_error_table(study),
        "provenance": tables.provenance_table(study),
    }
    if study.actuator is not None:
        found["metrics"] = tables.record_table(study.actuator.metrics, "Tracking.")
        found["limits"] = tables.record_table(study.actuator.limits, "Limits.")
    return found


def _mesh_sentence(study: StudyResult) -> str:
    error = study.mesh_error
    return (
        f"Verdict: {error.verdict}. Observed order {plain(error.observed_order, 2)}; the mesh"
        f" used is within {percent(error.relative_error).lstrip('+')} of the extrapolated"
        f" {error.extrapolated_Nm_per_rad:.3f} Nm/rad."
    )
