"""The proof's report: the same figures and tables as Markdown with images, and as one HTML page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dftfs.files import OutputError, prepare_folder, write_text
from dftfs.proof.report_figures import (
    METHODS,
    confusion_figure,
    detection_figure,
    held_out_figure,
    reliability_figure,
)
from dftfs.proof.scoring import Score
from dftfs.proof.summary import TWO_SIDED_95, Rate, Summary
from dftfs.report.page import page_environment, render_page
from dftfs.report.provenance import provenance
from dftfs.report.style import ReportFigure

GOALS = (
    ("top1", "first effect right", "at least", 14 / 15),
    ("precision", "precision of claims", "at least", 0.9),
    ("recall", "recall", "at least", 0.9),
    ("location", "place right", "at least", 0.95),
    ("false_alarm", "false alarms on nulls", "at most", 0.02),
    ("gain_beyond", "gain beyond re-estimated parameters", "at least", 0.85),
)
COVERAGE = (0.90, 0.98)
CALIBRATION_ERROR = 0.05


@dataclass(frozen=True, kw_only=True)
class Table:
    """A heading, a sentence, and rows under column names."""

    title: str
    lead: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]


def shown(value: float | Rate | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, Rate):
        return f"{value.share:.3f} ({value.low:.2f}-{value.high:.2f}, n = {value.count})"
    return f"{value:.3f}"


def plain(value: float | Rate | None) -> float | None:
    return value.share if isinstance(value, Rate) else value


def met(value: float | Rate | None, kind: str, goal: float) -> str:
    number = plain(value)
    if number is None:
        return "not measured"
    return "yes" if (number >= goal if kind == "at least" else number <= goal) else "no"


def goals_table(s: Summary) -> Table:
    rows = [
        (text, shown(getattr(s, name)), f"{kind} {goal:.2f}", met(getattr(s, name), kind, goal))
        for name, text, kind, goal in GOALS
    ]
    error = s.calibration.expected_error if s.calibration else None
    rows.append(
        (
            "expected calibration error",
            shown(error),
            f"at most {CALIBRATION_ERROR}",
            met(error, "at most", CALIBRATION_ERROR),
        )
    )
    for name, text in (
        ("coverage_effects", "95 % intervals of the effects' parameters hold"),
        ("coverage_constants", "95 % intervals of the rig's constants hold"),
    ):
        value = plain(getattr(s, name))
        inside = "not measured"
        if value is not None:
            inside = "yes" if COVERAGE[0] <= value <= COVERAGE[1] else "no"
        rows.append((text, shown(getattr(s, name)), "0.90-0.98", inside))
    return Table(
        title="Against the goals",
        lead="Shares with Wilson's 95 % interval.",
        columns=("what", "found", "goal", "reached"),
        rows=rows,
    )


def more_table(s: Summary) -> Table:
    wall = s.wall_s
    return Table(
        title="Further figures",
        lead="",
        columns=("what", "found"),
        rows=[
            ("verdict", shown(s.verdict)),
            ("first effect or its stated class right", shown(s.class_top1)),
            ("hidden test: share of the reachable improvement", shown(s.gain)),
            ("rivals of confounded cases named as alternatives", shown(s.rivals_named)),
            ("Brier score", shown(s.calibration.brier if s.calibration else None)),
            (
                "median error of comparable parameters over the effect's size",
                shown(s.parameter_error),
            ),
            ("comparable parameters within 20 %", shown(s.within_20_percent)),
            ("insufficient-data verdicts that bring an experiment", shown(s.experiments)),
            (
                "seconds a case, median and worst",
                f"{wall['median']:.0f}, {wall['worst']:.0f}" if wall else "-",
            ),
            ("cases without a diagnosis", ", ".join(s.without_diagnosis) or "none"),
        ],
    )


def level_table(s: Summary) -> Table:
    return Table(
        title="By level",
        lead="",
        columns=("level", "verdict", "place", "first effect"),
        rows=[
            (level, *(shown(row[k]) for k in ("verdict_credit", "location", "top1")))
            for level, row in s.by_level.items()
        ],
    )


def effect_table(s: Summary) -> Table:
    return Table(
        title="By effect",
        lead="Found, missed, and claimed where it was not.",
        columns=("effect", "found", "missed", "claimed where absent"),
        rows=[
            (name, str(c["hits"]), str(c["missed"]), str(c["false"]))
            for name, c in s.by_effect.items()
        ],
    )


def interval_table(scores: Sequence[Score]) -> Table:
    """Comparable parameters whose 95 % interval misses the truth, by effect."""
    missed = [
        (*p.name.split("."), s.case, f"{p.true:.4g}", f"{p.reported:.4g}", f"{p.deviations:+.1f}")
        for s in scores
        for p in s.parameters
        if p.deviations is not None and abs(p.deviations) >= TWO_SIDED_95
    ]
    return Table(
        title="Intervals that miss",
        lead="Of the effects' parameters; how many of its stated deviations the figure is off by.",
        columns=("effect", "parameter", "case", "true", "found", "deviations"),
        rows=sorted(missed),
    )


def case_table(scores: Sequence[Score]) -> Table:
    def text(value: float | None) -> str:
        return "" if value is None else f"{value:.2f}"

    rows = []
    for s in sorted(scores, key=lambda s: s.case):
        size = ", ".join(f"{v:.0f}" for v in s.strength.values())
        claimed = " + ".join(s.claimed) or "-"
        rows.append(
            (
                s.case,
                s.level,
                " + ".join(s.truth) or "-",
                size,
                s.verdict or "none",
                claimed,
                text(s.verdict_credit),
                text(s.location),
                text(s.top1),
                text(s.gain_beyond),
            )
        )
    columns = ("case", "level", "truth", "strength", "verdict", "claimed")
    return Table(
        title="Every case",
        lead="Strength: trace that no constants mimic, over the noise floor.",
        columns=(*columns, "verdict", "place", "first", "gain"),
        rows=rows,
    )


def baseline_table(errors: dict[str, list[float]], wins: dict[str, Rate | None]) -> Table | None:
    if not errors:
        return None
    rows = []
    for name, (text, _) in METHODS.items():
        if errors.get(name):
            values = sorted(errors[name])
            middle = values[len(values) // 2]
            rows.append((text, f"{middle:.2f}", str(len(values)), shown(wins.get(name))))
    return Table(
        title="Black boxes on the same recordings",
        lead="Free-run error of the hidden test over what the exact truth scores, on the channels"
        " that the missing effect changes by more than half of the floor.",
        columns=("method", "median", "channels", "beaten or matched by the diagnosis"),
        rows=rows,
    )


def markdown(title: str, lead: list[str], tables: list[Table], figures: list[str]) -> str:
    """The first table, the figures, the other tables."""
    lines = [f"# {title}", "", *lead, ""]
    for index, table in enumerate(tables):
        lines += [f"## {table.title}", *([table.lead] if table.lead else []), ""]
        lines += ["| " + " | ".join(table.columns) + " |", "|" + " --- |" * len(table.columns)]
        lines += ["| " + " | ".join(row) + " |" for row in table.rows]
        lines.append("")
        for name in figures if index == 0 else ():
            lines += [f"![{name}](proof-{name}.png)", ""]
    return "\n".join(lines)


def html(title: str, lead: list[str], tables: list[Table], figures: list[ReportFigure]) -> str:
    """The same as one page that needs no other file."""
    shown = [
        {"title": t.title, "caption": t.lead, "head": t.columns, "rows": t.rows, "numeric": ()}
        for t in tables
    ]
    return render_page(
        page_environment(),
        "plain.html",
        figures,
        title=title,
        kicker="Diagnosis · concealed effects",
        lead=[line.replace("`", "") for line in lead if line],
        tables=shown,
        first_figures=figures,
        notes=None,
        figures=(),
        facts=provenance(()),
    )


def write_reports(
    folder: Path,
    summary: Summary,
    scores: Sequence[Score],
    errors: dict[str, list[float]],
    wins: dict[str, Rate | None],
    lead: list[str],
) -> list[Path]:
    """Write `proof.md`, its images and `proof.html` into a folder; returns their paths.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    prepare_folder(folder)
    figures = [confusion_figure(summary), detection_figure(summary), reliability_figure(summary)]
    if errors:
        figures.append(held_out_figure(errors))
    tables = [goals_table(summary), level_table(summary), effect_table(summary)]
    boxes = baseline_table(errors, wins)
    tables += [boxes] if boxes else []
    tables += [more_table(summary), interval_table(scores), case_table(scores)]
    title = f"The proof: {summary.cases} cases with concealed effects"
    paths = []
    for figure in figures:
        path = folder / f"proof-{figure.name}.png"
        try:
            path.write_bytes(figure.png or b"")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror}") from None
        paths.append(path)
    names = [f.name for f in figures]
    paths.append(write_text(folder / "proof.md", markdown(title, lead, tables, names)))
    paths.append(write_text(folder / "proof.html", html(title, lead, tables, figures)))
    return paths
