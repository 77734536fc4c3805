"""`dftfs deliver`: zip for workshop and customer, the tolerances of the drawing computed."""

import argparse
from datetime import date
from pathlib import Path

from dftfs.analysis.study.drawing_tolerance import drawing_tolerance
from dftfs.cad.drawing_sheet import SHEETS_MM, STANDARD_SCALE, BoltCircle, ShopData, chosen_sheet
from dftfs.cli.common import add_design, add_output, emit, progress, read_design
from dftfs.cli.mount import add_bolts, bolts
from dftfs.cli.output import prepared
from dftfs.files import refuse_existing, to_json, write_bytes
from dftfs.process import builtin_processes, find_process


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    names = ", ".join(process.name for process in builtin_processes())
    parser.add_argument("--process", default="wire-edm", metavar="NAME", help=f"one of {names}")
    parser.add_argument("--part", default="", metavar="NUMBER", help="part number")
    parser.add_argument("--revision", default="A", metavar="REV")
    parser.add_argument("--date", type=_day, default=date.today().isoformat(), metavar="YYYY-MM-DD")
    parser.add_argument(
        "--author", default="", metavar="NAME", help="in the title block and the STEP file"
    )
    parser.add_argument("--temper", default="", metavar="TEXT", help="for example T651")
    parser.add_argument(
        "--yield-percent",
        type=float,
        default=99.0,
        metavar="PERCENT",
        help="parts that must keep the stiffness (default 99)",
    )
    for where in ("rim", "hub"):
        add_bolts(parser, where, f"through holes in the {where}")
    parser.add_argument("--sheet", metavar="NAME", help=f"one of {', '.join(SHEETS_MM)}")
    known = ", ".join(f"{scale:g}" for scale in STANDARD_SCALE)
    parser.add_argument("--scale", type=float, metavar="TIMES", help=f"one of {known}")
    add_output(parser, folder=True)


def _day(text: str) -> str:
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no date, e.g. 2026-03-31") from None


def run(arguments: argparse.Namespace) -> int:
    """Solve, draw, certify, pack; exit status 1 if a stated requirement or the yield fails."""
    from dftfs.analysis.strength.fkm import surface_left_by
    from dftfs.analysis.study.delivery import (
        certificate,
        packed,
        part_files,
        solved_for_delivery,
    )
    from dftfs.report.figures.certificate import certificate_pdf

    design, say = read_design(arguments), progress()
    process = find_process(arguments.process)
    sheet = chosen_sheet(design, arguments.sheet, arguments.scale)
    given = {where: bolts(arguments, where) for where in ("rim", "hub")}
    circles = tuple(BoltCircle(where=where, **sizes) for where, sizes in given.items() if sizes)
    for circle in circles:
        circle.check(design)
    folder = prepared(arguments, arguments.out or Path("out") / f"deliver-{design.name}")
    target = folder / f"{design.name}-{arguments.revision}.zip"
    refuse_existing([target], force=arguments.force)
    result, plane, errors = solved_for_delivery(design, say)
    share, solid = arguments.yield_percent / 100, result.stiffness_Nm_per_rad
    tolerance = drawing_tolerance(design, process, share=share, solid_Nm_per_rad=solid)
    say(tolerance.line())
    found = certificate(
        design, result, process, tolerance, plane_Nm_per_rad=plane, stress_errors=errors
    )
    shop = ShopData(
        part_number=arguments.part,
        revision=arguments.revision,
        date=arguments.date,
        author=arguments.author,
        process=process.name,
        temper=arguments.temper,
        thickness_tolerance_m=tolerance.thickness_m,
        width_tolerance_m=tolerance.width_m,
        profile_m=tolerance.profile_m,
        stiffness=tolerance.line(),
        roughness_um=surface_left_by(process.name).roughness_um,
        taper_m=(process.taper_least_m, process.taper_most_m),
        bolts=circles,
    )
    files = part_files(design, result, tolerance, shop, sheet)
    part = arguments.part or design.name
    files["certificate.pdf"] = certificate_pdf(found, part=part, date=arguments.date)
    record = {
        "design": design.name,
        "tolerances": tolerance,
        "certificate": dict(found.lines),
        "checks": found.checks,
        "files": {name: len(content) for name, content in sorted(files.items())},
    }
    files["certificate.json"] = to_json(record).encode()
    write_bytes(target, packed(files))
    lines = [f"{name}: {value}" for name, value in found.lines]
    lines += [check.line() for check in found.checks]
    emit(record | {"path": target}, "\n".join([*lines, str(target)]), as_json=arguments.json)
    failed = any(check.passed is False for check in found.checks)
    return 1 if failed or not tolerance.met else 0
