"""A simulation as one HTML file that needs no other: figures, metrics, the spring in motion."""

import json
from dataclasses import fields
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from dftfs.design import SpringDesign
from dftfs.files import write_bytes, write_text
from dftfs.report.figures.actuator import actuator_figure
from dftfs.report.figures.motion import motion_figure
from dftfs.report.figures.winding import winding_frames
from dftfs.report.style import as_png


def write_simulation_page(result, design: SpringDesign | None, path: Path) -> Path:
    """Write the page, whole or not at all; with a design the page animates the spring.

    Raises
    ------
    OutputError
        If the file cannot be written.
    SolveError
        If the rod model cannot follow the run's deflection.
    """
    return write_text(path, render_simulation_page(result, design))


def render_simulation_page(result, design: SpringDesign | None) -> str:
    """The page's HTML."""
    environment = Environment(
        loader=PackageLoader("dftfs.report", "template"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    source = environment.loader.get_source
    frames = None if design is None else winding_frames(design, result)
    return environment.get_template("simulation.html").render(
        result=result,
        style=source(environment, "style.css")[0],
        script=source(environment, "winding.js")[0],
        frames=None if frames is None else json.dumps(frames, separators=(",", ":")),
        design=design,
        figures=[actuator_figure(result), motion_figure(result)],
        metrics=[(f.name, getattr(result.metrics, f.name)) for f in fields(result.metrics)],
        terms=[(term.effect, term.equation()) for term in result.trajectory.model.terms],
    )


def write_simulation_pictures(result, torque: Path, motion: Path) -> None:
    """Write both figures as PNG files.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    write_bytes(torque, actuator_figure(result, as_png).png or b"")
    write_bytes(motion, motion_figure(result, as_png).png or b"")
