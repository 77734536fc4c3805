"""`dftfs compare`: controllers side by side on one plant, tuned with one budget, in one report."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress, table
from dftfs.cli.output import output_folder
from dftfs.errors import DftfsError
from dftfs.files import refuse_existing, to_json, write_text
from dftfs.report.control.comparison import write_comparison
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import Comparison, Verdict, compare, tuned_values
from rsea_core.control.tuning.comparison import table as rows_of
from rsea_core.scenarios.comparison_file import read_comparison

COLUMNS = {
    "rmse": "rmse",
    "command_rms": "command_rms",
    "command_change": "command_change",
    "gain_margin_dB": "gain_margin_dB",
    "phase_margin_deg": "phase_margin_deg",
    "noisy_rmse": "noisy_rmse",
    "monte_carlo_rmse_mean": "random_mean",
    "monte_carlo_rmse_std": "random_std",
    "monte_carlo_rmse_worst": "random_worst",
    "wrong_compensator_percent": "wrong_comp_%",
    "seeds_failed_share": "seeds_failed",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "comparison", metavar="COMPARISON.toml", help=f"a file, or one of {', '.join(built_in())}"
    )
    parser.add_argument("--seeds", type=int, metavar="N", help="number of tuning seeds")
    parser.add_argument(
        "--resume", action="store_true", help="continue the searches of an interrupted run"
    )
    add_output(parser, folder=True)


def built_in() -> Mapping[str, Path]:
    """The comparisons that come with the program."""
    folder = Path(__file__).parents[1] / "examples"
    return {path.stem: path for path in sorted(folder.glob("compare-*.toml"))}


def run(arguments: argparse.Namespace) -> int:
    """Tune, judge, print the table; write report, table and tuned controllers into a folder."""
    name = arguments.comparison
    comparison = read_comparison(built_in().get(name, Path(name)))
    if arguments.seeds is not None:
        if not 1 <= arguments.seeds <= 1000:
            raise DftfsError(f"--seeds {arguments.seeds} must be from 1 to 1000")
        comparison = replace(comparison, seeds=tuple(range(arguments.seeds)))
    say, log, files = progress(), None, {}
    for note in comparison.notes:
        say(note)
    folder = output_folder(arguments, f"compare-{comparison.name}")
    if folder is not None:
        files = {end: folder / f"{comparison.name}.{end}" for end in ("html", "json")}
        refuse_existing(list(files.values()), force=arguments.force)
        log = Checkpoint.open(folder / f"{comparison.name}.searches.jsonl", comparison)
        if not arguments.resume:
            log.clear()

    def found(who: str, search) -> None:
        say(f"{who}, seed {search.seed}: cost {search.cost:.5g}")
        if log is not None:
            log.add(who, search)

    verdicts = compare(comparison, done=None if log is None else log.done(), on_search=found)
    record = {
        "name": comparison.name,
        "rows": rows_of(verdicts),
        "controllers": {v.name: tuned_values(v) for v in verdicts},
    }
    if files:
        write_comparison(comparison, verdicts, files["html"])
        write_text(files["json"], to_json(record))
    record["files"] = {end: str(path) for end, path in files.items()}
    emit(record, _text(comparison, verdicts, files), as_json=arguments.json)
    return 0


def _text(comparison: Comparison, verdicts: list[Verdict], files: Mapping[str, Path]) -> str:
    rows = [
        [v.name, *(_short(v.as_row()[column]) for column in COLUMNS)]
        for v in sorted(verdicts, key=lambda v: v.following.rmse)
    ]
    lines = [f"{comparison.name}: RMSE from {comparison.task.from_s:g} s on"]
    lines.append(table(["controller", *COLUMNS.values()], rows))
    disturbed = [
        [v.name, d.name, _short(d.rmse), _short(d.peak_deviation), _short(d.recovery_s)]
        for v in verdicts
        for d in v.robustness.disturbed
    ]
    if disturbed:
        lines.append(table(["controller", "disturbance", "rmse", "peak", "recovery_s"], disturbed))
    elif comparison.disturbances:
        lines.append("disturbances left out: the output is locked, no external torque moves it")
    return "\n".join([*lines, *(str(path) for path in files.values())])


def _short(value: object) -> str:
    if value is None or value != value:  # not a number: nothing to say
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
