"""Tests use what is public: no test reaches for a private name of the packages."""

import ast

import pytest

from tests.cases.places import ROOT

PACKAGES = ("rsea_core", "dftfs", "benchmarks")
# part of the public face of the standard library in spite of their underscore
PUBLIC = {"_replace", "_asdict", "_fields", "_make", "_exit", "_repr_html_"}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in PUBLIC


def private_names(text: str) -> list[str]:
    """Private names of the packages that a test's source imports, reads or replaces."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in PACKAGES:
            named = [*node.module.split("."), *(alias.name for alias in node.names)]
        elif isinstance(node, ast.Import):
            named = [part for alias in node.names for part in alias.name.split(".")]
        elif isinstance(node, ast.Attribute):
            own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
            named = [] if own else [node.attr]
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "setattr":
            texts = [a.value for a in node.args if isinstance(a, ast.Constant)]
            named = [part for t in texts if isinstance(t, str) for part in t.split(".")]
        else:
            continue
        found += [name for name in named if is_private(name)]
    return found


def test_no_test_uses_a_private_name():
    found = {
        path.relative_to(ROOT).as_posix(): private_names(path.read_text(encoding="utf-8"))
        for path in (ROOT / "tests").rglob("*.py")
    }
    assert not {path: names for path, names in found.items() if names}


@pytest.mark.parametrize(
    "source",
    [
        "from rsea_core.machine.rig import _table",
        "import dftfs.fem._inner",
        "import dftfs\ndftfs.fem._inner()",
        "monkeypatch.setattr('dftfs.fem.contact._LIMIT', 1)",
        "monkeypatch.setattr(contact, '_LIMIT', 1)",
    ],
)
def test_every_use_of_a_private_name_is_seen(source: str):
    assert private_names(source)


def test_what_is_public_passes():
    assert not private_names("from rsea_core import Rig\nnumbers._replace(fx=1)\nself._own = 2")
