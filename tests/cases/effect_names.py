"""Where the source writes an effect's contract name as a string."""

import ast
import functools

from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import LAWS
from tests.cases.places import ROOT

# the independent oracle, which shares no code with the effects, states names of its own
ORACLE = "dftfs/proof/"


@functools.cache
def names() -> frozenset[str]:
    """Every effect's name."""
    return frozenset(LAWS) | {law.effect for law in laws_by_key().values() if law.effect in LAWS}


def _owners() -> dict[str, set[str]]:
    """The files of each effect's classes and variants."""
    found: dict[str, set[str]] = {name: set() for name in names()}
    for effect, laws in LAWS.items():
        for kind in laws.values():
            found[effect].add(kind.__module__.replace(".", "/") + ".py")
    return found


def _docstrings(tree: ast.AST) -> set[int]:
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    return {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, kinds) and node.body and isinstance(node.body[0], ast.Expr)
    }


@functools.cache
def strings() -> dict[str, int]:
    """Of each file of the packages: how many strings in it are another file's effect.

    A variant's key ("gear-friction/coulomb") counts as well.
    """
    owners, found = _owners(), {}
    for path in sorted([*ROOT.glob("dftfs/**/*.py"), *ROOT.glob("rsea_core/**/*.py")]):
        place = path.relative_to(ROOT).as_posix()
        if place.startswith(ORACLE):
            continue
        text = path.read_text(encoding="utf-8")
        if not any(name in text for name in owners):
            continue
        tree = ast.parse(text)
        documents = _docstrings(tree)
        count = sum(
            place not in owners[node.value.partition("/")[0]]
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in documents
            and node.value.partition("/")[0] in owners
        )
        if count:
            found[place] = count
    return found
