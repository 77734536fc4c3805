"""The report of a run over a wide set: goals, classes of machines, every case."""

from pathlib import Path

from dftfs.files import prepare_folder, to_json, write_bytes, write_text
from dftfs.proof.report import (
    Table,
    case_table,
    effect_table,
    html,
    interval_table,
    level_table,
    markdown,
    met,
    shown,
)
from dftfs.proof.report_figures import confusion_figure, detection_figure, reliability_figure
from dftfs.proof.wide.scores import Bound, WideJudgement

GOALS = (
    ("top1", "first effect right", "at least", 0.85),
    ("precision", "precision of claims", "at least", 0.95),
    ("recall", "recall", "at least", 0.85),
    ("location", "place right", "at least", 0.92),
)
NULLS, COVERAGE, CALIBRATION = 0.02, (0.90, 0.98), 0.05


def bounded(value: Bound | None) -> str:
    if value is None:
        return "-"
    return (
        f"{value.share:.3f} ({value.events} of {value.count}; 95 % bounds {value.low:.3f},"
        f" {value.high:.3f})"
    )


def goals(found: WideJudgement) -> Table:
    """The table that issue 17 asks for."""
    f, s = found.figures, found.figures.summary
    claims = f.null_claims
    rows = [
        (text, shown(getattr(s, name)), f"{kind} {goal:.2f}", met(getattr(s, name), kind, goal))
        for name, text, kind, goal in GOALS
    ]
    rows += [
        ("sound machines with a claim", bounded(claims), f"at most {NULLS}",
         met(claims.share if claims else None, "at most", NULLS)),
        ("sound machines called sick or unexplained", bounded(f.null_alarms), "", ""),
        ("false-discovery rate of claims", bounded(f.false_discoveries), "at most 0.05",
         met(f.false_discoveries.share if f.false_discoveries else None, "at most", 0.05)),
        ("claims not better than parameters only, own validation recordings",
         f"{len(f.empty_claims)} (no validation: {f.without_validation})", "0",
         "no" if f.empty_claims else "yes"),
        ("claims not better than the proof's refit, hidden test", f"{len(f.unseen_claims)}", "0",
         "no" if f.unseen_claims else "yes"),
    ]  # fmt: skip
    for name, text in (("coverage_effects", "effects' parameters"),
                       ("coverage_constants", "rig's constants")):  # fmt: skip
        value = getattr(s, name)
        inside = value and COVERAGE[0] <= value.share <= COVERAGE[1]
        rows.append((f"95 % intervals of the {text} hold", shown(value), "0.90-0.98",
                     "not measured" if value is None else "yes" if inside else "no"))  # fmt: skip
    error = s.calibration.expected_error if s.calibration else None
    rows.append(("expected calibration error", shown(error), f"at most {CALIBRATION}",
                 met(error, "at most", CALIBRATION)))  # fmt: skip
    rows.append(("F1", shown(f.f1), "", ""))
    if s.wall_s:
        rows.append(("seconds a case, median and worst",
                     f"{s.wall_s['median']:.1f}, {s.wall_s['worst']:.1f}", "60", ""))  # fmt: skip
    return Table(
        title="Against the goals",
        lead="Shares with Wilson's 95 % interval, where bounds are named with Clopper and"
        " Pearson's. Finished cases only: "
        + ", ".join(f"{n} {state}" for state, n in sorted(f.states.items())) + ".",
        columns=("what", "found", "goal", "reached"), rows=rows,
    )  # fmt: skip


def machine_table(found: WideJudgement) -> Table:
    return Table(
        title="By class of machine", lead="", columns=("class", "verdict", "place", "first effect"),
        rows=[(kind, *(shown(row[k]) for k in ("verdict_credit", "location", "top1")))
              for kind, row in found.figures.by_machine.items()],
    )  # fmt: skip


def summary_lines(found: WideJudgement) -> list[str]:
    """What the command prints."""
    return [f"labels: SHA-256 {found.seal}, as sealed", *map("  ".join, goals(found).rows)]


def write_wide_report(folder: Path, found: WideJudgement) -> list[Path]:
    """Write `proof.md`, its images, `proof.html` and `proof.json`; returns their paths.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    prepare_folder(folder)
    s = found.figures.summary
    figures = []
    if s.confusion:
        figures.append(confusion_figure(s))
    if s.detection:
        figures.append(detection_figure(s))
    if s.calibration:
        figures.append(reliability_figure(s))
    tables = [goals(found), machine_table(found), level_table(s), effect_table(s),
              interval_table(found.scores), case_table(found.scores)]  # fmt: skip
    lead = [f"Labels sealed before the first diagnosis, SHA-256 `{found.seal}`.", "",
            f"Diagnosis: `{found.commands[0]}`"]  # fmt: skip
    title = f"The wide proof: {found.figures.cases} machines of many kinds"
    names = [f.name for f in figures]
    return [
        *(write_bytes(folder / f"proof-{f.name}.png", f.png or b"") for f in figures),
        write_text(folder / "proof.md", markdown(title, lead, tables, names)),
        write_text(folder / "proof.html", html(title, lead, tables, figures)),
        write_text(folder / "proof.json", to_json(found.figures)),
    ]
