"""The four stories of the manual run as they stand, and print what their notebooks show."""

import sys

import pytest

pytest.importorskip("nbclient")
import jupytext
import nbformat

from tests.cases.places import ROOT

sys.path.insert(0, str(ROOT / "docs"))
from stories import FOLDER, STORIES, executed, texts


@pytest.mark.parametrize("name", STORIES)
def test_a_notebook_shows_its_story(name):
    shown = nbformat.read(FOLDER / f"{name}.ipynb", nbformat.NO_CONVERT)
    story = jupytext.read(FOLDER / f"{name}.py", fmt="py:percent")
    assert [c.source for c in shown.cells] == [c.source for c in story.cells]
    assert f"notebooks/{name}.ipynb" in (ROOT / "mkdocs.yml").read_text()
    assert f"notebooks/{name}.ipynb" in (ROOT / "docs" / "index.md").read_text()


@pytest.mark.needs_cad
@pytest.mark.parametrize("name", STORIES)
def test_a_story_prints_what_its_notebook_shows(name):
    shown = nbformat.read(FOLDER / f"{name}.ipynb", nbformat.NO_CONVERT)
    assert texts(executed(name)) == texts(shown)
