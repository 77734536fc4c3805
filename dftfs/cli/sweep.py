"""`dftfs sweep`: a design over a grid or a list of fields; cached, parallel, resumable."""

import argparse
import time
from functools import partial
from pathlib import Path

from dftfs.analysis.jobs.dask_cluster import run_on_cluster
from dftfs.analysis.jobs.store import ContentStore, code_version, content_key, user_store
from dftfs.analysis.jobs.worker_pool import run_in_processes
from dftfs.analysis.sweep.export import export_points
from dftfs.analysis.sweep.points import read_points
from dftfs.analysis.sweep.run import SweepResult, run_sweep
from dftfs.analysis.sweep.table import csv_text, has_parquet, parquet_bytes
from dftfs.analysis.torsion.batch_solve import MODELS
from dftfs.cli.common import add_design, add_output, add_work, changes, emit, progress, table
from dftfs.cli.output import prepared, write_result
from dftfs.errors import DesignError
from dftfs.files import refuse_existing, write_bytes, write_text

_FORMATS = ("step", "stl", "dxf")
_SHOWN = {
    "stiffness_Nm_per_rad": ("K Nm/rad", "{:.3f}"),
    "contact_winding_Nm": ("contact + Nm", "{:+.2f}"),
    "stiffening_winding": ("x", "{:.2f}"),
    "contact_unwinding_Nm": ("contact - Nm", "{:+.2f}"),
    "stiffening_unwinding": ("x", "{:.2f}"),
    "safety_factor_yield": ("safety", "{:.2f}"),
    "mass_kg": ("mass kg", "{:.4f}"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    parser.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="FIELD=VALUES",
        help="a,b,c or start:stop:count; several make a grid",
    )
    parser.add_argument("--list", type=Path, metavar="CSV", help="points: fields, then rows")
    parser.add_argument("--model", choices=MODELS, default="2d", help="default 2d")
    parser.add_argument("--states", type=int, default=8, help="states per direction (default 8)")
    parser.add_argument(
        "--beyond", type=float, default=1.5, help="end of curves over first contact (default 1.5)"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="solve on a Dask cluster instead")
    add_work(parser)
    parser.add_argument("--export", metavar="LIST", help="CAD files of all parts: step, stl, dxf")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Solve the points, write table and plots; exit status 3 if every point failed."""
    say, begun = progress(), time.perf_counter()
    if arguments.jobs < 1:
        raise DesignError(f"--jobs {arguments.jobs} must be 1 or more")
    formats = tuple(word.strip() for word in (arguments.export or "").split(",") if word.strip())
    if not set(formats) <= set(_FORMATS):
        raise DesignError(f"--export {arguments.export}: known are {', '.join(_FORMATS)}")
    points = read_points(arguments.vary, arguments.list)
    paths = _paths(arguments)
    store = user_store(arguments.cache)
    local = partial(run_in_processes, jobs=arguments.jobs)
    result = run_sweep(
        arguments.design,
        changes(arguments),
        points,
        model=arguments.model,
        states=arguments.states,
        beyond=arguments.beyond,
        store=store,
        runner=partial(run_on_cluster, address=arguments.cluster) if arguments.cluster else local,
        on_progress=say,
    )
    _write(result, paths, store)
    if formats:
        failed = export_points(
            result, paths["csv"].parent, formats, store=store, runner=local, on_progress=say
        )
        for point, why in failed.items():
            say(f"point {point}: no part written: {why}")
    record = {n: getattr(result, n) for n in ("rows", "failed", "shared_solves", "from_cache")}
    record |= {"wall_s": time.perf_counter() - begun, "files": paths}
    text = _text(result, paths)
    write_result(arguments, paths["html"], f"Sweep of {arguments.design}", text, [paths["png"]])
    emit(record, text, as_json=arguments.json)
    return 3 if result.failed == len(result.rows) else 0


def _paths(arguments: argparse.Namespace) -> dict[str, Path]:
    folder = arguments.out or Path("out") / f"sweep-{Path(arguments.design).stem}"
    kinds = ("csv", *(("parquet",) if has_parquet() else ()), "png", "html")
    paths = {kind: folder / f"sweep.{kind}" for kind in kinds}
    refuse_existing(list(paths.values()), force=arguments.force)
    prepared(arguments, folder)
    return paths


def _write(result: SweepResult, paths: dict[str, Path], store: ContentStore) -> None:
    """The table; plots and Parquet made from it are cached like a solve."""
    text = csv_text(result)
    write_text(paths["csv"], text)
    for kind, make in (("parquet", parquet_bytes), ("png", _picture)):
        if kind in paths:
            content = {"table": text, "kind": kind, "code": code_version(("analysis", "report"))}
            write_bytes(paths[kind], store.made(content_key(content), partial(make, result)))


def _picture(result: SweepResult) -> bytes:
    from dftfs.report.figures.sweep import sweep_figure

    return sweep_figure(result).png


def _text(result: SweepResult, paths: dict[str, Path]) -> str:
    def cell(row: dict, name: str) -> str:
        value, form = row[name], _SHOWN.get(name, ("", "{}"))[1]
        return "-" if value is None else form.format(value)

    shown = [name for name in (*result.fields, *_SHOWN) if name in result.columns]
    header = ["point", *(_SHOWN.get(name, (name, ""))[0] for name in shown), ""]
    rows = [
        [str(row["point"]), *(cell(row, name) for name in shown), row["reason"] or ""]
        for row in result.rows
    ]
    return "\n".join([table(header, rows), *(str(path) for path in paths.values())])
