"""What the documents name exists, and the sections of the method that modules cite exist."""

import re

import pytest

from tests.cases.places import ROOT

DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
MODULES = sorted([*ROOT.glob("rsea_core/**/*.py"), *ROOT.glob("dftfs/**/*.py")])
OTHERS = sorted([*ROOT.glob("tests/**/*.py"), *ROOT.glob("benchmarks/**/*.py"), *DOCUMENTS])
HEADING = re.compile(r"^#+ (\d+(?:\.\d+)?) ", re.M)
NUMBERS = r"(\d+(?:\.\d+)?(?:(?:,| and| to) \d+(?:\.\d+)?)*)"
PAGE = r"(?<![\w-])(diagnosis(?:-search|-measured)?\.md)(?:#[\w-]*\))?"
CITED = re.compile(rf"{PAGE}`?,?(?: sections?)? {NUMBERS}")
# page of the method: its sections
METHOD = {
    "diagnosis.md": {str(number) for number in range(1, 13)},
    "diagnosis-search.md": {f"10.{number}" for number in range(1, 8)},
    "diagnosis-measured.md": {"10.8"},
}


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


def sections_of(page: str) -> list[str]:
    """Numbers of the sections of a page of the method, in their order."""
    return HEADING.findall((ROOT / "docs" / page).read_text(encoding="utf-8"))


def cited_by(paths) -> set[tuple[str, str, str]]:
    """File, page and number of every section of the method that files cite."""
    return {
        (path.name, page, number)
        for path in paths
        for page, group in CITED.findall(path.read_text(encoding="utf-8"))
        for number in re.findall(r"\d+(?:\.\d+)?", group)
    }


@pytest.mark.parametrize("page", METHOD)
def test_a_page_of_the_method_has_its_own_sections(page):
    found = sections_of(page)
    assert len(found) == len(set(found))
    own = {number for number in found if number in METHOD[page]}
    assert own == METHOD[page]
    parts = {number.split(".")[0] for number in set(found) - own}
    assert parts <= METHOD[page] - {"10"}, "a part of a section is on the page of another one"


def test_sections_of_the_method_that_modules_cite_exist():
    cited = cited_by(MODULES)
    assert len(cited) >= 9
    assert {page for _, page, _ in cited} >= {"diagnosis.md", "diagnosis-search.md"}
    assert not [entry for entry in cited if entry[2] not in sections_of(entry[1])]


def test_sections_of_the_method_that_other_files_cite_exist():
    cited = cited_by(OTHERS)
    assert ("worked_diagnosis.py", "diagnosis.md", "9") in cited
    assert not [entry for entry in cited if entry[2] not in sections_of(entry[1])]
