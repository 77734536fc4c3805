"""A whole set of cases: what it is made of, made case by case, sealed at the end."""

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from dftfs.analysis.jobs.worker_pool import follow_parent
from dftfs.errors import DftfsError
from dftfs.files import prepare_folder, to_json, write_text
from dftfs.proof.cases import Recipe, make_case, poor_recipe
from dftfs.proof.labels import LABELS, seal
from dftfs.proof.recipes import CONFOUNDED, DOUBLES, EFFECTS, LEVELS, OUTSIDE, SHARES
from dftfs.proof.writing import write_case

PARTS = "label-parts"  # one file a case, so that an interrupted run can continue; merged at the end


class MakeError(DftfsError):
    """A set of cases that cannot be made as asked."""


def counts(
    cases: int, levels: tuple[str, ...] = LEVELS, shares: Mapping[str, float] = SHARES
) -> dict[str, int]:
    """How many cases of each level: the shares, the rest on the largest remainders."""
    total = sum(shares[level] for level in levels)
    wanted = {level: cases * shares[level] / total for level in levels}
    out = {level: int(w) for level, w in wanted.items()}
    rest = sorted(levels, key=lambda level: out[level] - wanted[level])
    for level in rest[: cases - sum(out.values())]:
        out[level] += 1
    return out


def dealt(rng: np.random.Generator, items: list, n: int) -> list:
    """Items in random order, each once before any comes again."""
    out: list = []
    while len(out) < n:
        out += [items[k] for k in rng.permutation(len(items))]
    return out[:n]


def composition(
    cases: int, seed: int, levels: tuple[str, ...] = LEVELS, only: tuple[str, ...] = ()
) -> list[Recipe]:
    """The recipes of a set, shuffled. Every effect comes up before any comes up again."""
    rng = np.random.default_rng([seed, 0])
    names = list(only or EFFECTS)
    size = counts(cases, levels)

    single = dealt(rng, names, size.get("plain", 0) + size.get("concealed", 0))
    out = [Recipe(level="plain", effects=(n,)) for n in single[: size.get("plain", 0)]]
    out += [Recipe(level="concealed", effects=(n,)) for n in single[size.get("plain", 0) :]]
    pairs = dealt(
        rng, [p for p in CONFOUNDED if not only or p[0] in only], size.get("confounded", 0)
    )
    out += [Recipe(level="confounded", effects=(t,), rivals=(r,)) for t, r in pairs]
    out += [
        Recipe(level="double", effects=pair)
        for pair in dealt(rng, list(DOUBLES), size.get("double", 0))
    ]
    out += [Recipe(level="null")] * size.get("null", 0)
    out += [
        Recipe(level="outside", effects=(n,))
        for n in dealt(rng, list(OUTSIDE), size.get("outside", 0))
    ]
    first = int(rng.integers(100))
    out += [poor_recipe(first + k) for k in range(size.get("poor", 0))]
    return [out[k] for k in rng.permutation(len(out))]


def _one(recipe: Recipe, seed: tuple[int, ...], name: str, folder: Path, part: Path) -> str:
    write_text(part, to_json(write_case(make_case(recipe, seed), name, folder)))
    return name


def make(
    cases: int,
    seed: int,
    folder: Path,
    *,
    levels: tuple[str, ...] = LEVELS,
    only: tuple[str, ...] = (),
    jobs: int = 1,
    report: Callable[[str], None] = lambda line: None,
) -> str:
    """Write ``cases`` cases and their sealed labels; returns the seal.

    An interrupted run is continued. The cases do not depend on ``jobs``, the number of processes.

    Raises
    ------
    MakeError
        If the folder holds a sealed set already, a name is not an effect, or a number too small.
    """
    unknown = [n for n in only if n not in EFFECTS]
    if unknown:
        raise MakeError(f"--only {unknown[0]}: not an effect; one of {', '.join(EFFECTS)}")
    for option, value, least in (("cases", cases, 1), ("seed", seed, 0), ("jobs", jobs, 1)):
        if value < least:
            raise MakeError(f"--{option} {value}: at least {least}")
    prepare_folder(folder)
    if (folder / LABELS).exists():
        raise MakeError(
            f"{folder / LABELS} exists: a sealed set is never changed; choose another --out"
        )
    prepare_folder(folder / PARTS)
    order = {"cases": cases, "seed": seed, "levels": list(levels), "only": list(only)}
    plan = folder / PARTS / "order.json"
    if plan.exists() and json.loads(plan.read_text(encoding="utf-8")) != order:
        raise MakeError(f"{folder} holds a part of another set; choose another --out")
    write_text(plan, to_json(order))
    recipes = composition(cases, seed, levels, only)
    width = max(3, len(str(cases)))
    names = [f"case-{k:0{width}d}" for k in range(1, cases + 1)]
    parts = {name: folder / PARTS / f"{name}.json" for name in names}
    open_ones = [k for k, name in enumerate(names) if not parts[name].exists()]
    context = get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=follow_parent) as pool:
        work = [
            pool.submit(_one, recipes[k], (seed, k + 1), names[k], folder, parts[names[k]])
            for k in open_ones
        ]
        for done, future in enumerate(work, start=1):
            report(f"{future.result()} made, {cases - len(open_ones) + done} of {cases}")
    labels = {n: json.loads(parts[n].read_text(encoding="utf-8")) for n in names}
    write_text(folder / LABELS, to_json(labels))
    value = seal(folder)
    for path in (folder / PARTS).iterdir():
        path.unlink()
    (folder / PARTS).rmdir()
    return value
