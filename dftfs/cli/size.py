"""`dftfs size`: from targets and a process to the best geometry, and the limits that bind it."""

import argparse
import time
from functools import partial

from dftfs.analysis.jobs.store import user_store
from dftfs.analysis.sizing.archive import Archive
from dftfs.analysis.sizing.comparison import compare
from dftfs.analysis.sizing.fe_confirmation import Confirmed, confirm
from dftfs.analysis.sizing.pool import judge_pool
from dftfs.analysis.sizing.relaxation import Relaxation, relaxations
from dftfs.analysis.sizing.search import Sizing, size
from dftfs.analysis.sizing.task import SizingTask, built_in_tasks, load_task
from dftfs.cli.common import add_changes, add_output, add_work, changes, emit, progress
from dftfs.cli.output import default_folder, prepared, write_result
from dftfs.cli.size_text import text_of, unmet_text
from dftfs.files import refuse_existing, to_json, write_bytes, write_text

_SHOWN = 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    names = ", ".join(built_in_tasks())
    parser.add_argument(
        "task", nargs="?", default="default", metavar="TASK", help=f"TOML file or one of {names}"
    )
    add_changes(parser, "change a target, a limit or a range, e.g. turns=1.2:2.4:0.05 (repeatable)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the search (default 0)")
    parser.add_argument("--no-fe", action="store_true", help="use the rod model only")
    add_work(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Search, confirm, write; exit status 1 if nothing meets the task, which is then explained."""
    say, begun = progress(), time.perf_counter()
    task = load_task(arguments.task, changes(arguments))
    folder = arguments.out or default_folder(arguments, f"size-{task.name}")
    paths = {name: folder / name for name in ("best.toml", "size.json", "front.png", "report.html")}
    refuse_existing(list(paths.values()), force=arguments.force)
    prepared(arguments, folder)
    with judge_pool(task, arguments.jobs) as judge:
        found = size(task, seed=arguments.seed, judge=judge, on_progress=say)
        if not isinstance(found, Sizing):
            pool = partial(judge_pool, jobs=arguments.jobs)
            changes_found = relaxations(found, pool, seed=arguments.seed, on_progress=say)
            return _unmet(
                task, found, changes_found, time.perf_counter() - begun, as_json=arguments.json
            )
    others = compare(task)
    store = user_store(arguments.cache)
    checked: tuple[Confirmed, ...] = ()
    if not arguments.no_fe:
        checked = confirm(task, found.winners, most=4, store=store, on_progress=say)
    wall_s = time.perf_counter() - begun
    record = _record(task, found, others, checked, wall_s)
    accepted = [one for one in checked if one.accepted]
    _write(task, found, others, accepted, record, paths)
    text = text_of(task, found, others, checked, wall_s)
    title = f"Geometry for the task {task.name}"
    write_result(arguments, paths["report.html"], title, text, [paths["front.png"]])
    emit(record, text, as_json=arguments.json)
    return 0 if accepted or arguments.no_fe else 1


def _unmet(
    task: SizingTask,
    found: Archive,
    changes_found: tuple[Relaxation, ...],
    wall_s: float,
    *,
    as_json: bool,
) -> int:
    """Print which requirements are in the way and the nearest ones that can be met."""
    text, nearest = unmet_text(task, found, changes_found, wall_s), found.best
    record = {"task": task.name, "best": None, "nearest": nearest, "relaxations": changes_found}
    emit(record | {"wall_s": wall_s}, text, as_json=as_json)
    return 1


def _record(task, found: Sizing, others, checked, wall_s: float) -> dict:
    return {
        "task": task.name,
        "best": found.best,
        "binding": found.stops,
        "front": found.front,
        "judged": found.judged,
        "compared": others,
        "confirmed": checked,
        "search_wall_s": found.wall_s,
        "wall_s": wall_s,
    }


def _write(task: SizingTask, found: Sizing, others, accepted, record: dict, paths: dict) -> None:
    from dftfs.analysis.sizing.fe_confirmation import as_design
    from dftfs.design import design_toml
    from dftfs.report.figures.sizing import front_figure

    design = accepted[0].design if accepted else as_design(task, found.best, f"{task.name}-1")
    write_text(paths["best.toml"], design_toml(design))
    write_text(paths["size.json"], to_json(record))
    allowed = design.material.yield_strength_Pa / task.min_safety_factor_yield
    named = [(other.name, other.candidate) for other in others]
    write_bytes(paths["front.png"], front_figure(found.front, found.best, allowed, named).png)
