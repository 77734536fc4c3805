"""A simulation as one HTML file that needs no other: figures, metrics, the spring in motion."""

import json
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

from dftfs.design import SpringDesign
from dftfs.files import write_bytes
from dftfs.report.control.compensation import compensation_figure
from dftfs.report.control.loops import margins_table, study_figures
from dftfs.report.figures.actuator import actuator_figure, followed
from dftfs.report.figures.motion import motion_figure
from dftfs.report.figures.winding import winding_frames
from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.numbers import readable
from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.provenance import provenance
from dftfs.report.style import BLUE, GREEN, ORANGE, VERMILION, ReportFigure, as_png


def write_simulation_page(
    result,
    design: SpringDesign | None,
    path: Path,
    inputs: Sequence[Path] = (),
    study=None,
    trace=None,
) -> Path:
    """Write the page, whole or not at all; with a design the page animates the spring.

    ``inputs`` are the files whose hashes the page states, ``study`` and ``trace`` as of
    `render_simulation_page`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    SolveError
        If the rod model cannot follow the run's deflection.
    """
    run = result.trajectory
    result = replace(result, trajectory=replace(run, ledger=run.energy))  # made now, for the data
    return write_page(
        path,
        "simulation",
        result=result,
        design=design,
        facts=provenance(inputs),
        terms=equations(result),
        study=study,
        trace=trace,
    )


def render_simulation_page(
    result,
    design: SpringDesign | None,
    facts: Sequence[tuple[str, str]] = (),
    terms: Sequence[tuple[str, str]] = (),
    study=None,
    trace=None,
) -> str:
    """The page's HTML; ``facts`` say where it comes from, ``terms`` are `equations`.

    ``study`` is the `loop_study` of the scenario's controller, ``trace`` its `compensation_trace`;
    None without one.
    """
    environment = page_environment()
    frames = None if design is None else winding_frames(design, result)
    figures = [with_live_panels(actuator_figure(result), result), motion_figure(result)]
    studies = [] if study is None else [study]
    loops = list(study_figures(studies, lambda _: {"color": BLUE, "linestyle": "-"}).values())
    loops += [] if trace is None else [compensation_figure(trace, result.metrics.from_s)]
    return render_page(
        environment,
        "simulation.html",
        [*figures, *loops],
        "simulation.css",
        result=result,
        facts=facts,
        script=environment.loader.get_source(environment, "winding.js")[0],
        frames=None if frames is None else json.dumps(frames, separators=(",", ":")),
        design=design,
        figures=figures,
        loops=loops,
        margins_table=margins_table(studies),
        metrics=[
            (label, getattr(result.metrics, f.name), unit)
            for f in fields(result.metrics)
            for label, unit in (readable(f.name),)
        ],
        terms=terms,
    )


def equations(result) -> list[tuple[str, str]]:
    """Effect and equation of every term of the simulated machine."""
    return [(term.effect, term.equation()) for term in result.trajectory.model.terms]


def with_live_panels(figure: ReportFigure, result) -> ReportFigure:
    """The figure of a run to zoom into: what is followed, its error, command and current."""
    run = result.trajectory
    signal, what, unit = followed(run)
    first, panels = [Curve(name=what, values=signal, colour=BLUE)], []
    if run.reference is not None:
        first.insert(0, Curve(name="reference", values=run.reference, colour=ORANGE, width=3.0))
        error = Curve(name="error", values=run.reference - signal)
        panels.append(Panel(label=f"error ({unit})", curves=(error,)))
    if unit != "Nm":
        torque = Curve(name="spring torque", values=run.torque_Nm, colour=BLUE)
        panels.append(Panel(label="torque (Nm)", curves=(torque,)))
    command = Curve(name=run.command_name.replace("_", " "), values=run.command, colour=GREEN)
    panels.append(Panel(label="command", curves=(command,)))
    current = Curve(name="current", values=run.current_A, colour=VERMILION)
    panels.append(Panel(label="current (A)", curves=(current,)))
    top = Panel(label=f"{what.split()[-1]} ({unit})", curves=tuple(first), height=1.7)
    start = result.metrics.from_s
    return with_live(figure, run.time_s, (top, *panels), shaded_to=start if start > 0 else None)


def write_simulation_pictures(result, torque: Path, motion: Path) -> None:
    """Write both figures as PNG files.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    write_bytes(torque, actuator_figure(result, as_png).png or b"")
    write_bytes(motion, motion_figure(result, as_png).png or b"")
