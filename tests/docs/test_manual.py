"""The manual's map leads somewhere, and its page of commands says what the parsers say today."""

import importlib.util
import re
import tomllib

from dftfs import __version__
from tests.cases.places import ROOT


def test_the_page_of_commands_is_what_the_parsers_say():
    place = importlib.util.spec_from_file_location("commands", ROOT / "docs" / "commands.py")
    made = importlib.util.module_from_spec(place)
    place.loader.exec_module(made)
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert page == made.text(), "run `python docs/commands.py`"


def test_every_page_that_the_map_of_the_manual_names_exists():
    listed = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = re.findall(r": ([\w-]+\.md)$", listed, re.M)
    assert len(named) > 15
    assert not [name for name in named if not (ROOT / "docs" / name).exists()]


def test_one_version_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == __version__
    assert f"version: {__version__}" in (ROOT / "CITATION.cff").read_text()
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text()
