"""Sizes of the packages' source, and the exceptions to their limits."""

import ast
import functools
import tomllib
from collections.abc import Iterator

from tests.cases.places import ROOT

MODULES = sorted([*ROOT.glob("dftfs/**/*.py"), *ROOT.glob("rsea_core/**/*.py")])
EXCEPTIONS = ROOT / "tests" / "exceptions.toml"
LIMITS = {"module_lines": 400, "class_lines": 250, "function_lines": 60, "positional_arguments": 8}
KERNEL_LINES = 120  # of a compiled function that the list of kernels gives a reason for
COMPILERS = ("njit", "jit", "vectorize", "guvectorize", "cfunc", "hook")

Function = ast.FunctionDef | ast.AsyncFunctionDef


def statements(node: ast.AST) -> Iterator[ast.stmt]:
    """The statements directly below a node: a class, a function, a loop, a case of a match."""
    for name in ("body", "orelse", "finalbody"):
        inside = getattr(node, name, [])
        yield from inside if isinstance(inside, list) else []
    for part in (*getattr(node, "handlers", ()), *getattr(node, "cases", ())):
        yield from part.body


def every_statement(node: ast.AST) -> Iterator[ast.stmt]:
    """The statements at any depth below a node."""
    for child in statements(node):
        yield child
        yield from every_statement(child)


def definitions(node: ast.AST, within: str) -> Iterator[tuple[str, ast.AST]]:
    """Every class and function below a node with its qualified name."""
    for child in statements(node):
        if isinstance(child, ast.ClassDef | Function):
            name = f"{within}.{child.name}" if within else child.name
            yield name, child
            yield from definitions(child, name)
        else:
            yield from definitions(child, within)


def lines_of(node: ast.AST) -> int:
    return node.end_lineno - node.lineno + 1


def is_compiled(function: Function) -> bool:
    """Whether a decorator compiles the function."""
    named = (n for d in function.decorator_list for n in ast.walk(d))
    names = {getattr(n, "id", None) or getattr(n, "attr", None) for n in named}
    return not names.isdisjoint(COMPILERS)


@functools.cache
def measured() -> tuple[dict[str, dict[str, int]], set[str]]:
    """Every size by rule and `path::name`, and the compiled functions among them."""
    sizes: dict[str, dict[str, int]] = {rule: {} for rule in LIMITS}
    compiled = set()
    for path in MODULES:
        text, place = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        sizes["module_lines"][place] = len(text.splitlines())
        for name, node in definitions(ast.parse(text), ""):
            key = f"{place}::{name}"
            if isinstance(node, ast.ClassDef):
                sizes["class_lines"][key] = lines_of(node)
                continue
            sizes["function_lines"][key] = lines_of(node)
            arguments = node.args.posonlyargs + node.args.args
            sizes["positional_arguments"][key] = len(arguments)
            if is_compiled(node):
                compiled.add(key)
    return sizes, compiled


def exceptions() -> dict[str, dict]:
    """The reasons of long kernels."""
    return tomllib.loads(EXCEPTIONS.read_text(encoding="utf-8"))


def offenders() -> dict[str, dict[str, int]]:
    """What exceeds a limit; a compiled function with a reason has the limit of kernels."""
    sizes, compiled = measured()
    reasons = exceptions()["kernels"].keys() & compiled
    found = {
        rule: {key: size for key, size in sizes[rule].items() if size > limit}
        for rule, limit in LIMITS.items()
    }
    long = found["function_lines"]
    for key in reasons & long.keys():
        if long[key] <= KERNEL_LINES:
            del long[key]
    return found
