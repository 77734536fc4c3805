"""What the documents name exists, and the sections of the method that modules cite exist."""

import re

import pytest

from tests.cases.places import ROOT

DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
MODULES = sorted([*ROOT.glob("rsea_core/**/*.py"), *ROOT.glob("dftfs/**/*.py")])
HEADING = re.compile(r"^#+ (\d+(?:\.\d+)?) ", re.M)
CITED = re.compile(r"diagnosis\.md`? (\d+(?:\.\d+)?(?:(?:,| and) \d+(?:\.\d+)?)*)")
METHOD = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")


def anchors(text: str) -> set[str]:
    """The names by which GitHub links to the headings of a page."""
    found = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in found}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_paths_that_a_document_names_exist(document):
    text = document.read_text(encoding="utf-8")
    named = re.findall(r"\b(?:rsea_core|dftfs|tests|benchmarks|docs)/[\w./*-]*[\w*]", text)
    lost = {name for name in named if not list(ROOT.glob(name))}
    assert not lost


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_of_a_document_lead_somewhere(document):
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        page = document.parent / name if name else document
        assert page.exists(), target
        assert not anchor or anchor in anchors(page.read_text(encoding="utf-8")), target


def test_sections_of_the_method_that_modules_cite_exist():
    sections = set(HEADING.findall(METHOD))
    cited = {
        (path.name, number)
        for path in MODULES
        for group in CITED.findall(path.read_text(encoding="utf-8"))
        for number in re.findall(r"\d+(?:\.\d+)?", group)
    }
    assert len(cited) >= 9
    assert not {(name, number) for name, number in cited if number not in sections}
