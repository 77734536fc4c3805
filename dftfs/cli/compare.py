"""`dftfs compare`: controllers side by side on one plant, tuned with one budget, in one report."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress
from dftfs.cli.compare_text import comparison_text
from dftfs.cli.output import output_folder
from dftfs.cli.spring_of_file import design_solver
from dftfs.errors import DftfsError
from dftfs.files import file_stem, refuse_existing, to_json, write_text
from dftfs.report.control.comparison import write_comparison
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import (
    Comparison,
    Verdict,
    compare,
    order_probabilities,
    pareto_front,
    tuned_values,
)
from rsea_core.control.tuning.comparison import table as rows_of
from rsea_core.errors import RseaError
from rsea_core.performance.loop_study import LoopStudy, loop_study
from rsea_core.scenarios.comparison_file import read_comparison
from rsea_core.simulation.reference import largest_amplitude


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


def read_asked(name: str, say) -> Comparison:
    """The comparison of a file or of this program, with its spring design solved."""
    path = built_in().get(name, Path(name))
    return read_comparison(path, design_solver(path.parent, say))


def run(arguments: argparse.Namespace) -> int:
    """Tune, judge, print the table; write report, table and tuned controllers into a folder."""
    say, log, files = progress(), None, {}
    comparison = read_asked(arguments.comparison, say)
    if arguments.seeds is not None:
        if not 1 <= arguments.seeds <= 1000:
            raise DftfsError(f"--seeds {arguments.seeds} must be from 1 to 1000")
        comparison = replace(comparison, seeds=tuple(range(arguments.seeds)))
    for note in comparison.notes:
        say(note)
    folder = output_folder(arguments, f"compare-{comparison.name}")
    stem = file_stem(comparison.name)
    if folder is not None:
        files = {end: folder / f"{stem}.{end}" for end in ("html", "json")}
        refuse_existing(list(files.values()), force=arguments.force)
        log = Checkpoint.open(folder / f"{stem}.searches.jsonl", comparison)
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
        "pareto_front": pareto_front(verdicts),
        "order": order_probabilities(verdicts),
        "controllers": {v.name: tuned_values(v) for v in verdicts},
        "moved": comparison.moved,
    }
    if files:
        source = built_in().get(arguments.comparison, Path(arguments.comparison))
        order = order_probabilities(verdicts)
        studies, front = _studies(comparison, verdicts, say), record["pareto_front"]
        write_comparison(comparison, verdicts, files["html"], order, [source], studies, front)
        write_text(files["json"], to_json(record))
    record["files"] = {end: str(path) for end, path in files.items()}
    emit(record, comparison_text(comparison, verdicts, files), as_json=arguments.json)
    return 0


def _studies(comparison: Comparison, verdicts: list[Verdict], say) -> list[LoopStudy]:
    """What the page shows of each loop beside the task."""
    task, found = comparison.task, []
    size = largest_amplitude(task.reference)
    for v in verdicts:
        try:
            found.append(
                loop_study(v.name, task.model, v.controller, task.loads[0], size, task.known_model)
            )
        except RseaError as problem:
            say(f"{v.name}: no figures of its loop: {problem}")
    return found
