"""What makes and judges the cases of the proof shares no code with `rsea_core`."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cases.places import ROOT

PROOF = ROOT / "dftfs" / "proof"
MAKERS = ("making", "writing", "labels", "cases", "truth", "truth_kernel", "machine", "running")


def imports_of(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def reached(module: str) -> set[str]:
    """Every module of this repository that a module imports, however far away."""
    seen, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        if name in seen or not name.startswith(("dftfs", "rsea_core")):
            continue
        seen.add(name)
        path = ROOT / Path(*name.split("."))
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        waiting += sorted(imports_of(path)) if path.exists() else []
    return seen


@pytest.mark.parametrize("name", MAKERS)
def test_case_makers_reach_no_module_of_the_core(name):
    modules = reached(f"dftfs.proof.{name}")
    assert f"dftfs.proof.{name}" in modules
    assert not {m for m in modules if m.startswith("rsea_core")}


def test_no_module_of_the_proof_imports_the_core():
    offenders = {
        path.name: names
        for path in PROOF.rglob("*.py")
        if (names := {n for n in imports_of(path) if n.startswith("rsea_core")})
    }
    assert not offenders


def test_a_process_that_makes_cases_never_loads_the_core():
    code = "import sys, dftfs.proof.making; print([m for m in sys.modules if 'rsea_core' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "[]", done.stderr
