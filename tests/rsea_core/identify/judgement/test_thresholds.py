"""The table of thresholds is complete, true and as the document has it."""

import ast
from pathlib import Path

import pytest

import rsea_core
from rsea_core.identify.judgement.thresholds import JUDGEMENT, SELECTION, THRESHOLDS, as_markdown

ROOT = Path(rsea_core.__file__).parents[1]
EFFORT = {"FAR", "BLOCK_s", "LAWS_TRIED", "CLOSE", "FULL", "QUICK"}  # how much is tried, not what


def constants(module: str) -> set[str]:
    """Names that a module of the identification assigns at its top level."""
    path = ROOT / "rsea_core" / "identify" / f"{module.replace('.', '/')}.py"
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign):
            found |= {n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name)}
    return found


@pytest.mark.parametrize("module", [SELECTION, JUDGEMENT])
def test_every_threshold_of_the_criteria_is_in_the_table(module):
    listed = {t.name for t in THRESHOLDS if t.module == module}
    assert constants(module) - EFFORT == listed


def test_the_document_is_fresh():
    path = ROOT / "docs" / "thresholds-of-diagnosis.md"
    assert path.read_text(encoding="utf-8") == as_markdown()


def test_guards_that_are_files_exist():
    named = {w.strip() for t in THRESHOLDS for w in t.guards.split(";") if ".py" in w}
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
