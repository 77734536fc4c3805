"""Published recordings of springs: their diagnosis, as a page with figures.

    python benchmarks/real_springs.py FOLDER [--out docs]

FOLDER holds the recordings as cases (`rig.toml` and CSV, one folder a set); they are not part of
this repository. Every set that is there is diagnosed as `dftfs diagnose` does it: identification
recordings alone are fitted and chosen from, the validation recordings are predicted once. Writes
real-recordings-springs.md and one picture a set. Errors are root mean squares of the torque over
its standard deviation in that recording.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dftfs.files import prepare_folder, write_text
from rsea_core.identify.spring_bench.diagnose import SpringConclusion, diagnose_bench
from rsea_core.identify.spring_bench.loops import BenchRows
from rsea_core.identify.spring_bench.regression import zero_of
from rsea_core.recordings.case import Case, read_case
from rsea_core.recordings.finding import Kind

TREGEAR = "Tregear, Aktas and Rodriguez y Baena 2026, arXiv 2605.24127"
CHEN = "Chen, laminate torsion springs (year not stated)"
SETS = {
    "tregear-spring-loops-1": TREGEAR,
    "tregear-spring-loops-2": TREGEAR,
    "tregear-spring-loops-3": TREGEAR,
    "tregear-spring-loops-4": TREGEAR,
    "tregear-spring-steps": TREGEAR,
    "laminate-springs": CHEN,
}
PICTURED = 3  # loops of a set
PAGE = "real-recordings-springs.md"
HEAD = """# Published recordings of springs

Made by `python benchmarks/real_springs.py FOLDER`; none of the recordings is in this repository.
Only the identification recordings were used for fitting and for the choice of a model; each
validation recording was predicted once. Errors are root mean squares of the torque error over
the standard deviation of the torque in that recording, in percent. *Before*: the stiffness that
the rig file of the set states (that of the publication), or else one straight line fitted to all
identification recordings. *One scale*: the best common factor on it. *Own line*: the straight
line fitted to that recording alone, the lowest error that any linear spring can reach. *After*:
the diagnosis. Where a recording starts unloaded its deflection is counted from there, and every
curve starts from the torque of the first rows.
"""


@dataclass(frozen=True, kw_only=True)
class Row:
    """Errors of one recording."""

    file: str
    role: str
    before: float
    one_scale: float
    own_line: float
    after: float


def own_line(r: BenchRows) -> float:
    """Error of the best straight line through a recording, over the torque's deviation."""
    x, y = r.deflection_rad - r.deflection_rad.mean(), r.torque_Nm - r.torque_Nm.mean()
    left = y - x * float(x @ y) / float(x @ x)
    return float(np.sqrt(left @ left / (y @ y)))


def rows_of(conclusion: SpringConclusion) -> list[Row]:
    """The table of a set."""
    lines = {r.file: own_line(r) for r in conclusion.rows}
    return [
        Row(
            file=row["file"], role=row["role"], before=row["nrmse_before"],
            one_scale=row["nrmse_parameters_only"], own_line=lines[row["file"]],
            after=row["nrmse_after"],
        )
        for row in conclusion.fit_table()
    ]  # fmt: skip


def whole(rows: Sequence[Row], role: str, column: str) -> str:
    """Root mean square of a column over the recordings of a role, in percent."""
    values = [getattr(row, column) for row in rows if row.role == role]
    return f"{100.0 * np.sqrt(np.mean(np.square(values))):.3g}" if values else "-"


def section(name: str, conclusion: SpringConclusion, rows: Sequence[Row]) -> list[str]:
    """What is said of one set."""
    document = conclusion.document()
    own = document["spring"]
    notes = [n for n in document["findings"] if "sample times vary" not in n]
    lines = ["", f"## {name}", "", f"{SETS[name]}. Verdict: `{document['verdict']}`.", ""]
    lines += [document["summary"], ""]
    if own.get("flank_Nm_per_rad") is not None:
        lines += [
            f"Measured on the elastic flanks: {own['flank_Nm_per_rad']:.4g} ± "
            f"{own['flank_std']:.2g} Nm/rad; widest loop {own['largest_loop_width_Nm']:.3g} Nm.",
            "",
        ]  # fmt: skip
    for effect in document["effects"]:
        figures = ", ".join(
            f"{key} {f['value']:.3g} ± {f['std']:.2g}" for key, f in effect["parameters"].items()
        )
        lines.append(f"- `{effect['name']}`, confidence {effect['confidence']:.2f}: {figures}")
    lines += [f"- {note}" for note in notes]
    lines += ["", "| recording | role | before | one scale | own line | after |"]
    lines.append("| --- | --- | ---: | ---: | ---: | ---: |")
    lines += [
        f"| {row.file} | {row.role} | {100 * row.before:.3g} | {100 * row.one_scale:.3g} |"
        f" {100 * row.own_line:.3g} | {100 * row.after:.3g} |"
        for row in rows
    ]
    return [*lines, "", f"![Torque against deflection of {name}](real-springs-{name}.png)"]


def each_alone(case: Case) -> list[str]:
    """Every recording diagnosed by itself, where a set is not of one spring."""
    about = "Each recording diagnosed separately, with cross-validation over its quarters:"
    lines = ["", about, ""]
    head = (
        "| recording | stiffness (Nm/rad) | model found | own line | error of held-out quarters |"
    )
    lines += [head, "| --- | ---: | --- | ---: | ---: |"]
    for r in case.recordings:
        alone = replace(case, recordings=(replace(r, role="identification"),))
        found = diagnose_bench(alone).found
        best, K = found.best, found.bench.stiffness
        lines.append(
            f"| {r.file} | {best.scale * K:.3g} ± {best.scale_std * K:.2g} | {best.name} |"
            f" {100 * own_line(found.bench.rows[0]):.3g} | {100 * best.error:.3g} |"
        )
    return lines


def draw(name: str, conclusion: SpringConclusion, path: Path) -> None:
    """Loops of a set: recorded, before, after."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    fitted = sorted(conclusion.found.bench.rows, key=lambda r: -np.ptp(r.torque_Nm))
    held = sorted(conclusion.found.held, key=lambda r: -np.ptp(r.torque_Nm))
    shown = [*held[:2], *fitted][:PICTURED]
    figure, axes = plt.subplots(1, len(shown), figsize=(4.2 * len(shown), 3.6), squeeze=False)
    known = "stated stiffness" if conclusion.found.known else "one straight line"
    for axis, r in zip(axes[0], shown, strict=True):
        deflection, runs = r.deflection_rad - zero_of(r), conclusion.simulated(r)
        axis.plot(deflection, r.torque_Nm, color="#555555", lw=2.6, alpha=0.45, label="recorded")
        axis.plot(deflection, runs["before"], color="#c0392b", lw=1.0, ls="--", label=known)
        axis.plot(deflection, runs["after"], color="#1f618d", lw=1.0, label="diagnosed")
        low, high = r.torque_Nm.min(), r.torque_Nm.max()
        axis.set_ylim(low - 0.25 * (high - low), high + 0.25 * (high - low))
        role = "held out" if r.role == "validation" else "fitted"
        axis.set_title(f"{r.file}\n{role}", fontsize=8)
        axis.set_xlabel("deflection (rad)")
        axis.locator_params(axis="x", nbins=5)
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("torque (Nm)")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> int:
    """Diagnose every set that is there; write the page and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of cases")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="default docs")
    arguments = parser.parse_args()
    there = [name for name in SETS if (arguments.folder / name / "rig.toml").is_file()]
    if not there:
        print(f"{arguments.folder} holds none of {', '.join(SETS)}", file=sys.stderr)
        return 2
    out = prepare_folder(arguments.out)
    table = ["", "| set | verdict | effects | before | one scale | own line | after |"]
    table += ["| --- | --- | --- | ---: | ---: | ---: | ---: |"]
    parts: list[str] = []
    for name in there:
        conclusion = diagnose_bench(read_case(arguments.folder / name))
        rows = rows_of(conclusion)
        document = conclusion.document()
        effects = ", ".join(f"`{e['name']}`" for e in document["effects"]) or "-"
        errors = " | ".join(
            whole(rows, "validation", c) for c in ("before", "one_scale", "own_line", "after")
        )
        table.append(f"| {name} | `{document['verdict']}` | {effects} | {errors} |")
        print(f"{name}: {document['verdict']}; held out {errors.replace('|', '->')} %", flush=True)
        parts += section(name, conclusion, rows)
        if any(f.kind is Kind.SEVERAL_SPRINGS for f in conclusion.found.findings):
            parts += each_alone(conclusion.case)
        draw(name, conclusion, out / f"real-springs-{name}.png")
    lead = ["", "Held-out recordings, root mean square over them, in percent:"]
    print(write_text(out / PAGE, "\n".join([HEAD.strip(), *lead, *table, *parts, ""])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
