"""`dftfs tune`: tune a controller on a task, over several seeds."""

import argparse
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress, table
from dftfs.cli.compare import built_in
from dftfs.cli.output import file_stems, output_folder
from dftfs.errors import DftfsError
from dftfs.files import refuse_existing, to_json, write_text
from rsea_core.control.c_header import LAWS, c_header
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import ComparedController, Comparison
from rsea_core.control.tuning.optimisers import METHODS
from rsea_core.control.tuning.tune import Tuned, tune
from rsea_core.scenarios.comparison_file import controller_to_toml, read_comparison


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "comparison",
        metavar="COMPARISON.toml",
        help=f"task, budget and controllers with bounds: a file, or one of {', '.join(built_in())}",
    )
    parser.add_argument(
        "--controller", metavar="NAME", help="the controller to tune (default: all)"
    )
    parser.add_argument("--method", choices=METHODS, help="optimiser, instead of the file's")
    parser.add_argument(
        "--seeds", type=int, metavar="N", help="number of seeds (default: the file's)"
    )
    parser.add_argument("--population", type=int, metavar="N", help="candidates per generation")
    parser.add_argument(
        "--generations", type=int, metavar="N", help="generations per seed (default: the file's)"
    )
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Tune, print the statistics over seeds, write each controller as TOML and C header."""
    comparison = _asked(arguments)
    say, log = progress(), None
    for note in comparison.notes:
        say(note)
    folder = output_folder(arguments, f"tune-{comparison.name}")
    if folder is not None:
        refuse_existing(_targets(comparison, folder), force=arguments.force)
        log = Checkpoint.open(folder / f"{comparison.name}.searches.jsonl", comparison)
        if not arguments.resume:
            log.clear()
    done = {} if log is None else log.done()
    rows, record, written = [], {}, []
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
        record[compared.name] = {
            "best": dict(zip(compared.bounds, starts.best.best.tolist(), strict=True)),
            "costs": starts.costs.tolist(),
            "failed_share": starts.failed_share,
        }
        share = f"{starts.failed_share:.0%}"
        rows.append([compared.name, f"{starts.best.cost:.5g}", f"{starts.median:.5g}", share])
        if folder is not None:
            written += _write(comparison, compared, tuned, folder)
    text = table(["controller", "best cost", "median over seeds", "beyond twice the best"], rows)
    emit(record, "\n".join([text, *map(str, written)]), as_json=arguments.json)
    return 0


def _asked(arguments: argparse.Namespace) -> Comparison:
    name = arguments.comparison
    comparison = read_comparison(built_in().get(name, Path(name)))
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


def _targets(comparison: Comparison, folder: Path) -> list[Path]:
    """Every file that will be written."""
    stems, found = file_stems([c.name for c in comparison.controllers]), []
    for compared in comparison.controllers:
        ends = (".toml", ".json", *([".h"] if compared.controller.kind in LAWS else []))
        found += [folder / f"{stems[compared.name]}{end}" for end in ends]
    return found


def _write(
    comparison: Comparison, compared: ComparedController, tuned: Tuned, folder: Path
) -> list[Path]:
    stem = file_stems([c.name for c in comparison.controllers])[compared.name]
    texts = {folder / f"{stem}.toml": controller_to_toml(tuned.controller)}
    if tuned.controller.kind in LAWS:
        task = comparison.task
        model = task.known_model or task.model
        texts[folder / f"{stem}.h"] = c_header(tuned.controller, model, task.loads[0])
    texts[folder / f"{stem}.json"] = to_json(tuned)
    return [write_text(path, text) for path, text in texts.items()]
