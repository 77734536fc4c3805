"""`dftfs tolerance`: the spread of stiffness and first contact, and which tolerance to tighten."""

import argparse
import math
from dataclasses import replace
from pathlib import Path

from dftfs.analysis.study.tolerance import (
    ToleranceResult,
    Tolerances,
    require_samples,
    tolerance_study,
)
from dftfs.cli.common import add_design, add_output, emit, progress, read_design, silent, table
from dftfs.cli.output import output_folder, write_result
from dftfs.files import refuse_existing, to_json, write_bytes, write_text
from dftfs.process import builtin_processes, find_process

_OWN = {"fillet": "radius at the roots of the arms", "arm": "thickness of each arm by itself"}
_MM = {name: f"{name}_m" for name in ("thickness", "kerf", "width", *_OWN)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    names = ", ".join(process.name for process in builtin_processes())
    parser.add_argument("--process", default="wire-edm", metavar="NAME", help=f"one of {names}")
    for name in _MM:
        text = f"tolerance of the {_OWN.get(name, name)}, +- 2 sigma, "
        text += "beside the others (default 0)" if name in _OWN else "instead of the process's"
        parser.add_argument(f"--{name}-mm", type=float, metavar="MM", help=text)
    for option, unit, text in (
        ("--inclination-deg", "DEG", "inclination of the cut, +- 2 sigma (default 0)"),
        ("--modulus-percent", "PERCENT", "+- 2 sigma (default 2)"),
    ):
        parser.add_argument(option, type=float, metavar=unit, help=text)
    parser.add_argument(
        "--samples", type=int, default=100_000, help="Monte Carlo samples (default 100000)"
    )
    parser.add_argument("--seed", type=int, default=0)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Print the spreads and their causes; write the record and the plot where a folder is given."""
    design = read_design(arguments)
    tolerances = _tolerances(arguments, design.width_m)
    require_samples(arguments.samples)  # before a folder is made
    paths = {}
    folder = output_folder(arguments, f"tolerance-{design.name}")
    if folder is not None:
        ends = ("json", "png", "html")
        paths = {kind: folder / f"tolerance-{design.name}.{kind}" for kind in ends}
        refuse_existing(list(paths.values()), force=arguments.force)
    result = tolerance_study(
        design,
        tolerances,
        samples=arguments.samples,
        seed=arguments.seed,
        on_progress=progress() if arguments.verbose else silent,
    )
    record = {
        "design": design.name,
        "tolerances": result.tolerances,
        "spreads": result.spreads,
        "fit_error": result.fit_error,
        "samples": arguments.samples,
        "seed": arguments.seed,
    }
    text = _text(design.name, result)
    if paths:
        _write(result, record, paths)
        title = f"Tolerances of {design.name}"
        write_result(arguments, paths["html"], title, text, [paths["png"]])
    emit(record, text, as_json=arguments.json)
    return 0


def _tolerances(arguments: argparse.Namespace, width_m: float) -> Tolerances:
    found = Tolerances.of_process(find_process(arguments.process), width_m)
    asked = {field: getattr(arguments, f"{name}_mm") for name, field in _MM.items()}
    found = replace(found, **{k: v * 1e-3 for k, v in asked.items() if v is not None})
    if arguments.modulus_percent is not None:
        found = replace(found, modulus=arguments.modulus_percent / 100)
    if arguments.inclination_deg is not None:
        found = replace(found, inclination_rad=math.radians(arguments.inclination_deg))
    return found


def _write(result: ToleranceResult, record: dict, paths: dict[str, Path]) -> None:
    from dftfs.report.figures.tolerance import tolerance_figure

    write_text(paths["json"], to_json(record))
    write_bytes(paths["png"], tolerance_figure(result).png)


def _text(name: str, result: ToleranceResult) -> str:
    t, lines = result.tolerances, []
    lines.append(
        f"{name}: thickness +-{t.thickness_m * 1e3:g} mm, kerf +-{t.kerf_m * 1e3:g} mm,"
        f" width +-{t.width_m * 1e3:g} mm, modulus +-{t.modulus * 100:g} %,"
        f" fillet +-{t.fillet_m * 1e3:g} mm, inclination +-{math.degrees(t.inclination_rad):g} deg,"
        f" each arm +-{t.arm_m * 1e3:g} mm (2 sigma)"
    )
    for spread in result.spreads:
        kept = "" if spread.kept is None else f"; {spread.kept * 100:.1f} % keep the requirement"
        lines.append(
            f"{spread.response}: {spread.nominal:.3f} nominal, 95 % in {spread.low:.3f} to"
            f" {spread.high:.3f}{kept}; largest cause: {spread.causes[0].cause}"
        )
        rows = [
            [c.cause, f"{c.sensitivity:+.2f}", f"{c.spread * 100:.2f} %", f"{c.share * 100:.0f} %",
             f"{c.halved * 100:.2f} %"]
            for c in spread.causes
        ]  # fmt: skip
        header = ["cause", "relative slope", "1 sigma alone", "of variance", "1 sigma if halved"]
        lines.append(table(header, rows))
    lines += [f"{name}: the coils do not touch" for name in result.untouched]
    spread = result.spreads[0]
    if spread.kept is not None and not spread.kept > 0.5:
        lines.append(
            "most parts miss the stiffness because the nominal does: correct it before tightening"
        )
    lines.append(f"rod model; the fit through it is within {result.fit_error * 100:.3f} %")
    return "\n".join(lines)
