"""A simulation as one HTML file that needs no other: figures, metrics, the spring in motion."""

import json
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

from dftfs.design import SpringDesign
from dftfs.files import write_bytes
from dftfs.report.figures.actuator import actuator_figure
from dftfs.report.figures.motion import motion_figure
from dftfs.report.figures.winding import winding_frames
from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.numbers import readable
from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.provenance import provenance
from dftfs.report.style import BLUE, GREEN, ORANGE, VERMILION, ReportFigure, as_png


def write_simulation_page(
    result, design: SpringDesign | None, path: Path, inputs: Sequence[Path] = ()
) -> Path:
    """Write the page, whole or not at all; with a design the page animates the spring.

    ``inputs`` are the files whose hashes the page states.

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
    )


def render_simulation_page(
    result,
    design: SpringDesign | None,
    facts: Sequence[tuple[str, str]] = (),
    terms: Sequence[tuple[str, str]] = (),
) -> str:
    """The page's HTML; ``facts`` say where it comes from, ``terms`` are `equations`."""
    environment = page_environment()
    frames = None if design is None else winding_frames(design, result)
    figures = [_live(actuator_figure(result), result), motion_figure(result)]
    return render_page(
        environment,
        "simulation.html",
        figures,
        "simulation.css",
        result=result,
        facts=facts,
        script=environment.loader.get_source(environment, "winding.js")[0],
        frames=None if frames is None else json.dumps(frames, separators=(",", ":")),
        design=design,
        figures=figures,
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


def _live(figure: ReportFigure, result) -> ReportFigure:
    run = result.trajectory
    torque = [Curve(name="spring torque", values=run.torque_Nm, colour=BLUE)]
    panels = []
    if run.reference is not None:
        wanted = Curve(name="reference", values=run.reference, colour=ORANGE, width=3.0)
        torque.insert(0, wanted)
        error = Curve(name="error", values=run.reference - run.torque_Nm)
        panels.append(Panel(label="error (Nm)", curves=(error,)))
    command = Curve(name=run.command_name.replace("_", " "), values=run.command, colour=GREEN)
    panels.append(Panel(label="command", curves=(command,)))
    current = Curve(name="current", values=run.current_A, colour=VERMILION)
    panels.append(Panel(label="current (A)", curves=(current,)))
    first = Panel(label="torque (Nm)", curves=tuple(torque), height=1.7)
    start = result.metrics.from_s
    return with_live(figure, run.time_s, (first, *panels), shaded_to=start if start > 0 else None)


def write_simulation_pictures(result, torque: Path, motion: Path) -> None:
    """Write both figures as PNG files.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    write_bytes(torque, actuator_figure(result, as_png).png or b"")
    write_bytes(motion, motion_figure(result, as_png).png or b"")
