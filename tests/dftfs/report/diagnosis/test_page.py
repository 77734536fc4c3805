"""The diagnosis report is one file that needs no other and shows all that it was given."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from dftfs.report.diagnosis.machine_picture import machine_picture
from dftfs.report.diagnosis.page import VERDICTS, DiagnosisPage
from dftfs.report.diagnosis.render import (
    key_figures,
    render_diagnosis,
    traced_parts,
    write_diagnosis_report,
)
from dftfs.report.style import VERMILION
from tests.cases.diagnosis_page import example_page

ALL = ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm")


class Balance(HTMLParser):
    """Whether every element that is opened is closed, and which identifiers there are."""

    VOID = ("meta", "link", "img", "br", "hr", "input")

    def __init__(self):
        super().__init__()
        self.open, self.identifiers = [], []

    def handle_starttag(self, tag, attrs):
        self.identifiers += [value for name, value in attrs if name == "id"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.identifiers += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def text_of(**changes):
    """The page without the figures that are slow to draw: what its words say is the same."""
    bare = {"comparisons": (), "traces": (), "strips": (), "laws": (), "ladder": ()}
    return replace(example_page(), **bare, remainder=None, state_map=None, **changes)


@pytest.fixture(scope="module")
def html():
    return render_diagnosis(example_page())


def test_page_is_whole_and_needs_no_other_file(html):
    page = Balance()
    page.feed(html)
    assert not page.open
    assert len(page.identifiers) == len(set(page.identifiers))
    assert not re.search(r'(?:src|href)="(?!#|data:)', html)
    assert "@import" not in html


def test_what_must_be_mended_is_the_headline_unless_physics_was_found():
    lost = text_of(verdict="unexplained", effects=(), doubted=True)
    assert "First correct the files</h1>" in render_diagnosis(lost)
    assert replace(example_page(), doubted=True).headline == example_page().headline


def test_a_page_that_located_nothing_has_no_empty_section_for_it(html):
    bare = text_of(separability="", signatures=())
    assert 'id="where"' in html
    assert 'href="#where"' in html
    rendered = render_diagnosis(bare)
    assert "#where" not in rendered
    assert 'id="where"' not in rendered


def test_first_screen_says_what_where_and_how_sure(html):
    head = html[: html.index("<nav")]
    assert "Missing: spring hysteresis" in head
    assert "loses 0.066 J in every loop" in head
    assert "at every reversal of the deflection" in head
    assert "rms and peak mixed" in head
    assert "8.1 → 6.2 → 0.60 %" in head
    assert "97 %" in head
    assert "90 %" in head


def test_page_has_every_part_it_was_given(html):
    for name in ("comparison-0", "comparison-1", "port-torques", "mismatch-time"):
        assert f'id="fig-{name}"' in html
    for name in ("mismatch-state", "ladder", "law-0", "remainder", "next-experiment"):
        assert f'id="fig-{name}"' in html
    assert "0.2910 ± 0.0060" in html
    assert "−4.1 %" in html
    assert "cannot be distinguished from spring-viscoelastic" in html
    assert "14.2 standard errors" in html


def test_a_verdict_without_effects_or_comparisons_still_makes_a_page(tmp_path):
    page = DiagnosisPage(
        case="quiet", rig="bench", verdict="no-mismatch", summary="Nothing is missing.",
        subsystem=None, where="", shares={}, parts=("spring",), sensors=("torque_Nm",),
        loads=("imposed",), separability="",
    )  # fmt: skip
    path = write_diagnosis_report(page, tmp_path / "report.html")
    text = path.read_text(encoding="utf-8")
    assert VERDICTS["no-mismatch"] in text
    assert 'id="ladder"' not in text
    assert key_figures(page) == ()


def test_text_from_files_cannot_become_markup():
    page = text_of(summary="<script>alert(1)</script>", next_experiment=None)
    assert "<script>" not in render_diagnosis(page)


def test_picture_marks_the_located_part_and_nothing_else():
    full = ("drive", "gear", "spring", "load")
    quiet = machine_picture(
        parts=full, sensors=ALL, loads=("pendulum",), located=None, labels={}, shares={}
    )
    assert VERMILION not in quiet.svg
    for located in (*full, "sensor:torque_Nm"):
        picture = machine_picture(
            parts=full, sensors=ALL, loads=("pendulum",), located=located, labels={}, shares={}
        )
        assert VERMILION in picture.svg
        assert f"marked: {located}" in picture.alt


def test_picture_draws_only_the_parts_that_are_there():
    bench = machine_picture(
        parts=("spring",), sensors=("torque_Nm",), loads=("imposed",), located="spring",
        labels={"spring": "<b>"}, shares={"spring": 1.0},
    )  # fmt: skip
    assert ">gear<" not in bench.svg
    assert ">drive<" not in bench.svg
    assert "<b>" not in bench.svg
    locked = machine_picture(
        parts=("drive", "gear", "spring"), sensors=ALL, loads=("locked",), located=None, labels={},
        shares={},
    )  # fmt: skip
    assert ">environment<" in locked.svg


def test_the_first_screen_says_what_to_record_next():
    page = text_of()
    head = render_diagnosis(page).partition("<nav")[0]
    assert ("Record next:" in head) == (page.next_experiment is not None)
    advised = replace(page, next_experiment=None, record_next="Take the weight off.")
    assert (
        "Record next:</strong> Take the weight off."
        in render_diagnosis(advised).partition("<nav")[0]
    )
    silent = replace(page, next_experiment=None)
    assert "Record next" not in render_diagnosis(silent).partition("<nav")[0]


def test_shares_of_noise_accuse_no_part():
    page = text_of(verdict="no-mismatch", subsystem=None, effects=())
    assert page.shares
    assert "share of the mismatch that no parameter" not in render_diagnosis(page)


def test_what_remains_names_its_signal_and_an_unclaimed_name_is_no_confidence():
    page = example_page()
    notes = {figure.label: figure.note for figure in key_figures(page)}
    worst = page.remainder.signals[int(page.remainder.after.argmax())]
    remains = next(note for label, note in notes.items() if label.startswith("Remaining error"))
    assert worst.rsplit("_", 1)[0].replace("_", " ") in remains
    doubtful = tuple(replace(e, confidence=0.4) for e in page.effects)
    labels = [figure.label for figure in key_figures(replace(page, effects=doubtful))]
    assert "Confidence" not in labels
    assert "Nearest known effect (not claimed)" in labels


@pytest.mark.parametrize(("found", "leads"), [(True, "current"), (False, "load angle")])
def test_the_channel_leads_that_laws_improved_most_and_without_laws_the_rigs_values(found, leads):
    page = example_page()
    errors = {"load_angle_rad": (3.0, 1e-3, 1e-3), "current_A": (0.71, 0.42, 0.056)}
    first = page.comparisons[0]
    compared = tuple(
        replace(first, signal=signal, nrmse_before=b, nrmse_parameters_only=p, nrmse_after=a)
        for signal, (b, p, a) in errors.items()
    )
    effects = page.effects if found else ()
    figure = key_figures(replace(page, comparisons=compared, effects=effects))[0]
    assert figure.label.startswith(f"Error of the {leads}")


def test_a_click_on_a_part_leads_to_its_missing_torque_and_its_effect(html):
    page = example_page()
    parts = traced_parts(page)
    assert parts
    for part in parts:
        assert f'href="#part-{part}"' in html
        shown = html.split(f'id="part-{part}"')[1].split("Close")[0]
        assert f'id="fig-part-{part}"' in shown
        named = [e.name for e in page.effects if e.subsystem == part]
        assert all(f"<strong>{name}</strong>" in shown for name in named)
        assert ("No effect was found here" in shown) is not bool(named)
