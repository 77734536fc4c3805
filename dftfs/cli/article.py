"""`dftfs article`: the stiffness that a first article's measured dimensions give."""

import argparse
from pathlib import Path

from dftfs.analysis.study.measuring_sheet import FirstArticle, first_article
from dftfs.cli.common import add_design, add_output, emit, read_design


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    parser.add_argument(
        "sheet",
        type=Path,
        metavar="SHEET.csv",
        help="measuring sheet of `dftfs deliver`, filled in",
    )
    parser.add_argument(
        "--gauge-mm", type=float, default=0.003, metavar="MM", help="+- 2 sigma (default 0.003)"
    )
    add_output(parser, folder=False)


def run(arguments: argparse.Namespace) -> int:
    """Predict, print; exit status 1 if a stated requirement or a limit of the sheet is missed."""
    design = read_design(arguments)
    found = first_article(design, arguments.sheet, gauge_mm=arguments.gauge_mm)
    emit(found, _text(design.name, found), as_json=arguments.json)
    value = found.measured_Nm_per_rad or found.predicted_Nm_per_rad
    kept = found.required is None or found.required[0] <= value <= found.required[1]
    return 0 if kept and not found.outside else 1


def _text(name: str, found: FirstArticle) -> str:
    change = found.predicted_Nm_per_rad / found.nominal_Nm_per_rad - 1
    arms = ", ".join(f"{value:.3f}" for value in found.arms_mm)
    how = "rod model"
    if found.over_rod is not None:
        how += f", times {found.over_rod:.4g} to the sheet's 3D elements"
    lines = [
        f"{name}: K = {found.predicted_Nm_per_rad:.2f} Nm/rad +- {100 * found.uncertainty:.1f} %"
        f" by these dimensions ({how}; {100 * change:+.2f} % of nominal)",
        f"arms {arms} mm, width {found.width_mm:.3f} mm, fillets {found.fillet_mm:.3f} mm;"
        f" {found.not_measured} rows are not measured and count as nominal",
    ]
    if found.required is not None:
        low, high = found.required
        value = found.measured_Nm_per_rad or found.predicted_Nm_per_rad
        verdict = "inside" if low <= value <= high else "OUTSIDE"
        lines.append(f"required {low:.2f} to {high:.2f} Nm/rad: {verdict}")
    if found.measured_Nm_per_rad is not None and found.modulus_Pa is not None:
        off = found.measured_Nm_per_rad / found.predicted_Nm_per_rad - 1
        doubt = "explained" if abs(off) <= found.uncertainty else "NOT explained"
        lines.append(
            f"bench: {found.measured_Nm_per_rad:.2f} Nm/rad, {100 * off:+.2f} % of what the"
            f" dimensions give: {doubt} by modulus and gauge (E {found.modulus_Pa / 1e9:.1f} GPa)"
        )
    return "\n".join([*lines, *(f"beyond its limits: {line}" for line in found.outside)])
