"""The parts of a sweep's points as STEP, STL and DXF, made once and found again by content."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from dftfs.analysis.jobs.store import ContentStore, content_key
from dftfs.analysis.sweep.run import SweepResult
from dftfs.design import SpringDesign
from dftfs.errors import DftfsError
from dftfs.spring.parameters import SpiralParameters

Runner = Callable[[Callable, Mapping[str, object]], Iterator[tuple[str, dict]]]


def export_points(
    result: SweepResult,
    folder: Path,
    formats: Sequence[str],
    *,
    store: ContentStore,
    runner: Runner,
    on_progress: Callable[[str], None] = lambda message: None,
) -> dict[int, str]:
    """Write the parts of all points that have a design, as ``<design>-<point>``.

    A part whose files are there with the content that was written is left alone.

    Returns
    -------
    dict
        Per point whose part could not be made, why.
    """
    points: dict[str, int] = {}
    tasks: dict[str, dict] = {}
    for row, design in zip(result.rows, result.designs):
        if design is None:
            continue
        task = _task(design, f"{design.name}-{row['point']:04d}", folder, formats)
        key = content_key({**task, "folder": str(folder.resolve())})
        points[key] = int(row["point"])
        kept = store.get(key)
        if kept is None or any(_digest(Path(name)) != d for name, d in kept["files"].items()):
            tasks[key] = task
    on_progress(f"CAD: {len(points)} parts, {len(points) - len(tasks)} there, {len(tasks)} to do")
    failed = {}
    for key, solved in runner(export_task, tasks) if tasks else ():
        if "files" in solved:
            store.put(key, solved)
        else:
            failed[points[key]] = solved.get("failure") or solved["crash"]
        on_progress(f"CAD: point {points[key]}: {failed.get(points[key], 'written')}")
    return failed


def _task(design: SpringDesign, name: str, folder: Path, formats: Sequence[str]) -> dict:
    return {
        "spiral": asdict(design.spiral),
        "width_m": design.width_m,
        "density_kg_per_m3": design.material.density_kg_per_m3,
        "material": design.material.name,
        "name": name,
        "folder": str(folder),
        "formats": list(formats),
    }


def export_task(task: Mapping) -> dict:
    """Write one part; the digest of every file, or why there is none."""
    from dftfs.cad.export import export_part
    from dftfs.spring.outline import build_outline

    try:
        made = export_part(
            build_outline(SpiralParameters(**task["spiral"])),
            task["width_m"],
            task["name"],
            Path(task["folder"]),
            density_kg_per_m3=task["density_kg_per_m3"],
            material=task["material"],
            formats=tuple(task["formats"]),
            overwrite=True,
        )
    except DftfsError as error:
        return {"failure": " ".join(str(error).split())}
    return {"files": {str(path): _digest(path) for path in made.files.values()}}


def _digest(path: Path) -> str | None:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
