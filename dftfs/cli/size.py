"""`dftfs size`: from targets and a process to the best geometry, and the limits that bind it."""

import argparse
import time

from dftfs.analysis.jobs.store import user_store
from dftfs.analysis.sizing.comparison import Comparison, compare
from dftfs.analysis.sizing.fe_confirmation import Confirmed, confirm
from dftfs.analysis.sizing.pool import judge_pool
from dftfs.analysis.sizing.search import Sizing, size
from dftfs.analysis.sizing.task import SizingTask, built_in_tasks, load_task
from dftfs.cli.common import add_output, add_work, changes, emit, progress, table
from dftfs.cli.output import default_folder
from dftfs.files import prepare_folder, refuse_existing, to_json, write_bytes, write_text

_SHOWN = 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    names = ", ".join(built_in_tasks())
    parser.add_argument(
        "task", nargs="?", default="default", metavar="TASK", help=f"TOML file or one of {names}"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="FIELD=VALUE",
        help="change a target, a limit or a range, e.g. turns=1.2:2.4:0.05 (repeatable)",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the search (default 0)")
    parser.add_argument("--no-fe", action="store_true", help="use the rod model only")
    add_work(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Search, confirm, write; exit status 1 if no winner is confirmed by finite elements."""
    say, begun = progress(), time.perf_counter()
    task = load_task(arguments.task, changes(arguments))
    folder = arguments.out or default_folder(arguments, f"size-{task.name}")
    paths = {name: folder / name for name in ("best.toml", "size.json", "front.png")}
    refuse_existing(list(paths.values()), force=arguments.force)
    prepare_folder(folder)
    with judge_pool(task, arguments.jobs) as judge:
        found = size(task, seed=arguments.seed, judge=judge, on_progress=say)
    others = compare(task)
    store = user_store(arguments.cache)
    checked: tuple[Confirmed, ...] = ()
    if not arguments.no_fe:
        checked = confirm(task, found.winners, most=4, store=store, on_progress=say)
    wall_s = time.perf_counter() - begun
    record = _record(task, found, others, checked, wall_s)
    accepted = [one for one in checked if one.accepted]
    _write(task, found, others, accepted, record, paths)
    emit(record, _text(task, found, others, checked, wall_s), as_json=arguments.json)
    return 0 if accepted or arguments.no_fe else 1


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
    allowed = task.material.yield_strength_Pa / task.min_safety_factor_yield
    named = [(other.name, other.candidate) for other in others]
    write_bytes(paths["front.png"], front_figure(found.front, found.best, allowed, named).png)


def _text(task, found: Sizing, others: tuple[Comparison, ...], checked, wall_s: float) -> str:
    best = found.best
    lines = [
        f"{task.name}: {best.mass_kg * 1e3:.1f} g, K = {best.stiffness_Nm_per_rad:.2f} Nm/rad,"
        f" {best.stress_Pa / 1e6:.0f} MPa at {task.operating_torque_Nm:g} Nm (rod model;"
        f" {found.judged} candidates in {found.wall_s:.1f} s)",
        "  "
        + ", ".join(f"{name} {value:g}" for name, value in best.values_mm)
        + f", width_mm {best.width_mm:g}",
        "binding limits: "
        + ("; ".join(f"{stop.limit} ({stop.step})" for stop in found.stops) or "none found"),
    ]
    rows = [
        [limit.name, f"{limit.found:.4g}", f"{limit.asked:.4g}", limit.unit]
        for limit in best.limits
    ]
    lines.append(table(["limit", "found", "required", ""], rows))
    for other in others:
        lines += other.lines()
    for one in checked:
        contact = ", ".join(f"{w} {t:.1f}" for w, t in one.contact_Nm.items() if t is not None)
        lines.append(
            f"{one.design.name} by 2D elements: width {one.design.width_m * 1e3:g} mm, K ="
            f" {one.stiffness_2d_Nm_per_rad:.3f} Nm/rad, first contact {contact} Nm,"
            f" {one.stress_Pa / 1e6:.0f} MPa"
        )
        lines += ["  " + check.line() for check in one.checks]
        if one.stiffness_3d_Nm_per_rad is not None:
            off = one.stiffness_3d_Nm_per_rad / task.stiffness_Nm_per_rad - 1
            lines.append(
                f"  3D elements: K = {one.stiffness_3d_Nm_per_rad:.3f} Nm/rad, {off * 100:+.2f} %"
                " of the target"
            )
    return "\n".join([*lines, f"{wall_s:.1f} s in all"])
