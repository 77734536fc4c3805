"""docs/effects.md says what the registry of effects says today."""

import importlib.util
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_of_effects_is_fresh():
    spec = importlib.util.spec_from_file_location("effects_page", DOCS / "effects.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    page = (DOCS / "effects.md").read_text(encoding="utf-8")
    assert page == made.text(), "run `python docs/effects.py`"
