"""A whole set of wide cases: its composition, made case by case, sealed at the end."""

import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from dftfs.files import prepare_folder, to_json, write_text
from dftfs.proof.labels import LABELS, MANIFEST, SEAL, digest
from dftfs.proof.making import PARTS, MakeError, counts, dealt
from dftfs.proof.wide.case import LEVELS, Recipe, TooWeakError, make_case
from dftfs.proof.wide.effects import EFFECTS
from dftfs.proof.wide.effects_outside import OUTSIDE
from dftfs.proof.wide.machines import KINDS
from dftfs.proof.wide.writing import CASES, HIDDEN, write_case

SHARES = {"plain": 0.30, "concealed": 0.20, "double": 0.10, "null": 0.30, "outside": 0.10}
DRAWS = 8  # recipes tried for one case before the machine is left to chance


def composition(count: int, seed: int, levels: tuple[str, ...] = LEVELS) -> list[Recipe]:
    """The recipes of a set, shuffled: machines, effects and levels in equal turns."""
    rng = np.random.default_rng([seed, 0])
    effects = dealt(rng, list(EFFECTS), count)
    others, nulls = dealt(rng, list(OUTSIDE), count), dealt(rng, list(KINDS), count)
    out = []
    for level, size in counts(count, levels, SHARES).items():
        for _ in range(size):
            effect = None if level == "null" else (others if level == "outside" else effects).pop()
            machine = nulls.pop() if level == "null" else None
            out.append(Recipe(level=level, effect=effect, machine=machine))
    return [out[k] for k in rng.permutation(len(out))]


def one_case(recipe: Recipe, seed: tuple[int, ...], name: str, folder: Path, sealed: Path) -> str:
    """Make and write one case; its label's part appears last, so that a run can be resumed.

    Raises
    ------
    MakeError
        If no draw leaves a trace.
    """
    for turn in range(DRAWS):
        try:
            case = make_case(recipe, (*seed, turn))
            break
        except TooWeakError:
            continue
    else:
        raise MakeError(f"{name}: no machine shows {recipe.effect} in {DRAWS} x 40 draws")
    answer = write_case(case, name, folder, sealed)
    write_text(sealed / PARTS / f"{name}.json", to_json(answer))
    return f"{name}: {case.drawn.name}"


def seal(folder: Path) -> str:
    """Write SHA-256 of labels and hidden files as `sha256sum -c` reads them; returns its own."""
    lines = [
        f"{digest(path)}  {path.relative_to(folder).as_posix()}"
        for path in sorted([folder / LABELS, *(folder / HIDDEN).rglob("*")])
        if path.is_file()
    ]
    return digest(write_text(folder / SEAL, "\n".join([*lines, ""])))


def begun(
    count: int, seed: int, folder: Path, sealed: Path | None, more: dict
) -> tuple[Path, dict]:
    """The folder of the answers and the order of a set, new or begun with the same order.

    Raises
    ------
    MakeError
        If a number is too small, or the folder holds a sealed or another set.
    """
    for option, value, least in (("count", count, 1), ("seed", seed, 0)):
        if value < least:
            raise MakeError(f"--{option} {value}: at least {least}")
    sealed = sealed or folder.with_name(folder.name + "_sealed")
    for place in (folder, sealed, sealed / PARTS):
        prepare_folder(place)
    if (sealed / LABELS).exists():
        raise MakeError(f"{sealed / LABELS} exists: a sealed set is never changed; choose another")
    order = {"machines": "wide", "count": count, "seed": seed, **more}
    plan = sealed / PARTS / "order.json"
    if plan.exists() and json.loads(plan.read_text(encoding="utf-8")) != order:
        raise MakeError(f"{sealed} holds a part of another set; choose another --out")
    write_text(plan, to_json(order))
    return sealed, order


def make_wide(
    count: int,
    seed: int,
    folder: Path,
    *,
    sealed: Path | None = None,
    levels: tuple[str, ...] = LEVELS,
    truth: str | None = None,
    jobs: int = 1,
    report: Callable[[str], None] = lambda line: None,
) -> str:
    """Write ``count`` cases into ``folder`` and their answers into ``sealed``; returns the seal.

    An interrupted run is continued; the cases do not depend on ``jobs``.

    Parameters
    ----------
    sealed : Path, optional
        Folder of hidden tests, labels and SHA256SUMS; default the folder's name and "_sealed".
    truth : str, optional
        Command of an outsider's generator, run once a case with ``{seed}``, ``{case}`` and
        ``{hidden}`` filled in: it writes the case folder, the hidden files and ``label.json``
        into ``{hidden}``.

    Raises
    ------
    MakeError
        If the folder holds another or a sealed set, a number is too small or a generator fails.
    """
    sealed, order = begun(count, seed, folder, sealed, {"levels": list(levels), "truth": truth})
    if jobs < 1:
        raise MakeError(f"--jobs {jobs}: at least 1")
    width = max(3, len(str(count)))
    names = [f"case-{k:0{width}d}" for k in range(1, count + 1)]
    parts = {n: sealed / PARTS / f"{n}.json" for n in names}
    todo = [k for k, n in enumerate(names) if not parts[n].exists()]
    recipes = composition(count, seed, levels)
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        work = []
        for k in todo:
            given = (seed, k + 1)
            if truth is None:
                work.append(pool.submit(one_case, recipes[k], given, names[k], folder, sealed))
            else:
                number = int(np.random.default_rng(given).integers(2**31))
                work.append(pool.submit(foreign_case, truth, number, names[k], folder, sealed))
        for done, future in enumerate(work, start=1):
            report(f"{future.result()} made, {count - len(todo) + done} of {count}")
    labels = {n: json.loads(parts[n].read_text(encoding="utf-8")) for n in names}
    write_text(sealed / LABELS, to_json(labels))
    value = seal(sealed)
    manifest = order | {"sealed": os.path.relpath(sealed, folder), "seal": value}
    write_text(folder / MANIFEST, to_json(manifest))
    shutil.rmtree(sealed / PARTS)
    return value


def foreign_case(command: str, seed: int, name: str, folder: Path, sealed: Path) -> str:
    """A case by an outsider's generator, put in place when it is complete.

    Raises
    ------
    MakeError
        If the command fails or leaves no rig.toml or label.json.
    """
    with tempfile.TemporaryDirectory(prefix="truth-") as room:
        case, hidden = Path(room) / "case", Path(room) / "hidden"
        case.mkdir(), hidden.mkdir()
        places = {"seed": seed, "case": case, "hidden": hidden, "python": sys.executable}
        try:
            arguments = [w.format(**places) for w in shlex.split(command)]
            done = subprocess.run(arguments, capture_output=True, text=True)
        except (KeyError, IndexError, ValueError) as error:
            raise MakeError(f"--truth {command!r}: {error}; known: {', '.join(places)}") from None
        except OSError as error:
            raise MakeError(f"--truth {command!r}: cannot be started: {error.strerror}") from None
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise MakeError(f"--truth, seed {seed}: status {done.returncode}: {last}")
        for path in (case / "rig.toml", hidden / "label.json"):
            if not path.is_file():
                raise MakeError(f"--truth, seed {seed}: wrote no {path.parent.name}/{path.name}")
        answer = json.loads((hidden / "label.json").read_text(encoding="utf-8"))
        (hidden / "label.json").unlink()
        for source, target in ((case, folder / CASES / name), (hidden, sealed / HIDDEN / name)):
            shutil.copytree(source, target, dirs_exist_ok=True)
    write_text(sealed / PARTS / f"{name}.json", to_json(answer))
    return name
