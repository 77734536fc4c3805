"""`dftfs friction`: the friction laws of chapter 3 and others, fitted to a case and compared."""

import argparse
from pathlib import Path

from dftfs.cli.common import add_output, emit, table
from dftfs.cli.output import prepared, write_result
from dftfs.files import refuse_existing, to_json, write_text
from rsea_core.identify.friction.compare import FrictionComparison, FrictionFit, compare_friction
from rsea_core.recordings.case import read_case


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("case", type=Path, metavar="CASE/", help="folder with a rig.toml")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Compare the laws, print the table, write it with its page."""
    if arguments.out is not None:
        folder = prepared(arguments, arguments.out)
        paths = [folder / name for name in ("friction.json", "report.html")]
        refuse_existing(paths, force=arguments.force)
    case = read_case(arguments.case)
    found = compare_friction(case)
    text, title = _text(found), f"Friction laws on {case.name}"
    if arguments.out is not None:
        write_text(paths[0], to_json(found))
        write_result(arguments, paths[1], title, text)
    emit(found, text, as_json=arguments.json)
    return 0


def _text(found: FrictionComparison) -> str:
    rows = [
        [
            fit.law,
            f"{fit.rms_held_out_Nm * 1e3:.4g}",
            f"{fit.rms_fit_Nm * 1e3:.4g}",
            f"{fit.gap_to_best_se:+.1f}",
            f"{fit.condition:.3g}",
            fit.note,
        ]
        for fit in found.fits
    ]
    header = ["law", "held out mNm", "fit mNm", "gap, s.e.", "condition", ""]
    lines = [
        f"{found.case}: {found.rows} rows in {found.blocks} blocks; held out: {found.split}",
        "rms of the unexplained motor torque, motor side; distance to the best law's mean square",
        table(header, rows),
    ]
    simplest = min(
        (f for f in found.fits if abs(f.gap_to_best_se) < 2.0), key=lambda f: len(f.parameters)
    )
    lines += ["", f"fewest parameters within 2 s.e. of the best: {simplest.law}"]
    shown = (found.best,) if simplest is found.best else (found.best, simplest)
    for fit in shown:
        lines += ["", *_parameters(fit)]
    return "\n".join(lines)


def _parameters(fit: FrictionFit) -> list[str]:
    rows = [
        [
            p.name,
            f"{p.value:.4g}",
            "not identifiable" if p.std is None else f"+- {p.std:.2g}",
            p.unit,
            "at its bound" if p.at_bound else "",
        ]
        for p in fit.parameters
    ]
    lines = [table([fit.law, "value", "std", "unit", ""], rows)]
    if fit.correlated:
        pairs = (f"{a}/{b} {value:+.3f}" for a, b, value in fit.correlated)
        lines.append(f"not separable: {', '.join(pairs)}")
    if fit.insensitive:
        lines.append(f"not distinguishable from zero: {', '.join(fit.insensitive)}")
    return lines
