"""The manual's map leads somewhere, and its page of commands says what the parsers say today."""

import importlib.util
import re
import tomllib

import pytest

from dftfs import __version__
from dftfs.design import built_in_names
from rsea_core.control import CONTROLLERS
from rsea_core.effects.registry import LAWS
from tests.cases.places import ROOT


@pytest.mark.parametrize("name", ["commands", "api"])
def test_the_pages_of_commands_and_api_are_what_the_program_says(name):
    place = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    made = importlib.util.module_from_spec(place)
    place.loader.exec_module(made)
    page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    assert page == made.text(), f"run `python docs/{name}.py`"


def test_the_gallery_has_every_design_effect_and_controller():
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"!\[([\w-]+)\]\(gallery/", page))
    assert {*built_in_names(), *LAWS, *CONTROLLERS} == shown
    pictures = re.findall(r"\((gallery/[\w-]+\.png)\)", page)
    assert all((ROOT / "docs" / name).exists() for name in pictures)


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
