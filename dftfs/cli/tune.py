"""`dftfs tune`: tune a controller on a task, over several seeds."""

import argparse
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress, table
from dftfs.cli.compare import built_in, read_asked
from dftfs.cli.output import output_folder, write_result
from dftfs.errors import DftfsError
from dftfs.files import file_stem, refuse_existing, to_json, write_text
from rsea_core.control.c_header import LAWS, c_header, c_name
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import Comparison
from rsea_core.control.tuning.optimisers import METHODS
from rsea_core.control.tuning.tune import Tuned, tune
from rsea_core.scenarios.comparison_file import controller_to_toml


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "comparison",
        metavar="COMPARISON.toml",
        help=f"task, budget and controllers with bounds: a file, or one of {', '.join(built_in())}",
    )
    parser.add_argument("--controller", metavar="NAME", help="controller to tune (default: all)")
    parser.add_argument("--method", choices=METHODS, help="optimiser, instead of the file's")
    for name in ("seeds", "population", "generations"):
        parser.add_argument(f"--{name}", type=int, metavar="N", help=f"overrides the file's {name}")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Tune, print the statistics over seeds, write each usable controller as TOML and C header."""
    say, log = progress(), None
    comparison, paths = _asked(arguments, say), {}
    list(map(say, comparison.notes))
    folder = output_folder(arguments, f"tune-{comparison.name}")
    if folder is not None:
        paths = _paths(comparison, folder)
        files = [p for own in paths.values() for p in own.values()]
        refuse_existing([*files, page := folder / "tuning.html"], force=arguments.force)
        log = Checkpoint.open(folder / f"{file_stem(comparison.name)}.searches.jsonl", comparison)
        if not arguments.resume:
            log.clear()
    done = {} if log is None else log.done()
    rows, record, written, refused = [], {}, [], []
    for compared in comparison.controllers:

        def found(search, name=compared.name) -> None:
            say(f"{name}, seed {search.seed}: cost {search.cost:.5g}")
            if log is not None:
                log.add(name, search)

        tuned = tune(
            comparison.task,
            compared.controller,
            compared.bounds,
            method=comparison.method,
            seeds=comparison.seeds,
            population=comparison.population,
            generations=comparison.generations,
            done={seed: s for (name, seed), s in done.items() if name == compared.name},
            on_search=found,
        )
        starts = tuned.starts
        own, ends = tuned.standing, [str(bound) for bound in tuned.at_bounds]
        record[compared.name] = {
            "best": {name: getattr(tuned.controller, name) for name in compared.bounds},
            "costs": starts.costs.tolist(),
            "evaluations": starts.evaluations,
            "failed_share": starts.failed_share,
            "at_bounds": ends,
            "precise_cost": tuned.precise_cost,
            "not_usable_because": list(own.reasons),
        }
        figures = (f"{x:.5g}" for x in (starts.best.cost, tuned.precise_cost, starts.median))
        rows.append([compared.name, *figures, f"{starts.failed_share:.0%}", "; ".join(ends) or "-"])
        if not own.is_ranked:
            refused.append(f"{compared.name}: nothing written: {own.reasons[0]}")
        elif paths:
            written += _write(comparison, tuned, paths[compared.name])
    head = "controller,best cost,events located,median over seeds,beyond twice best,at its bound"
    text = "\n".join([table(head.split(","), rows), *refused, *map(str, written)])
    if folder is not None:
        write_result(arguments, page, f"Tuning of {comparison.name}", text)
    emit(record, text, as_json=arguments.json)
    return 1 if refused else 0


def _asked(arguments: argparse.Namespace, say) -> Comparison:
    comparison = read_asked(name := arguments.comparison, say)
    controllers = tuple(e for e in comparison.controllers if e.bounds)
    if arguments.controller is not None:
        controllers = tuple(e for e in controllers if e.name == arguments.controller)
    if not controllers:
        known = ", ".join(repr(e.name) for e in comparison.controllers if e.bounds) or "none"
        raise DftfsError(f"{name}: no controller to tune; with bounds there are {known}")
    changes = {k: getattr(arguments, k) for k in ("method", "population", "generations")}
    changes = {key: value for key, value in changes.items() if value is not None}
    if arguments.seeds is not None:
        if not 1 <= arguments.seeds <= 1000:
            raise DftfsError(f"--seeds {arguments.seeds} must be from 1 to 1000")
        changes["seeds"] = tuple(range(arguments.seeds))
    return replace(comparison, controllers=controllers, **changes)


def _paths(comparison: Comparison, folder: Path) -> dict[str, dict[str, Path]]:
    """The files of each controller by what they hold; no two share one."""
    found: dict[str, dict[str, Path]] = {}
    stems: list[str] = []
    for compared in comparison.controllers:
        stems.append(file_stem(compared.name, stems))
        ends = ["toml", "json", *(["h"] if compared.controller.kind in LAWS else [])]
        found[compared.name] = {end: folder / f"{stems[-1]}.{end}" for end in ends}
    return found


def _write(comparison: Comparison, tuned: Tuned, paths: dict[str, Path]) -> list[Path]:
    texts = {"toml": controller_to_toml(tuned.controller), "json": to_json(tuned)}
    if "h" in paths:
        task = comparison.task
        model = task.known_model or task.model
        prefix = c_name(paths["h"].stem)
        texts["h"] = c_header(tuned.controller, model, task.loads[0], prefix=prefix)
    return [write_text(paths[end], text) for end, text in texts.items()]
