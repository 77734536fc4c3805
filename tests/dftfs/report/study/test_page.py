"""The study's page is one file with every section, true to the checks and safe with any text."""

import io
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.image import imread

from dftfs.analysis.torsion.result import StepFields
from dftfs.files import OutputError
from dftfs.report.page_data import draw_again
from dftfs.report.study import render as html
from dftfs.report.study.render import render_report, report_figures, symbols, write_report
from dftfs.report.study.summary import big_numbers, readable, verdict
from dftfs.report.study.tables import files_table, label_and_unit, models_table, record_table
from tests.cases.report_study import CHECKS, small_study

pytestmark = pytest.mark.needs_cad  # a study holds what its exported files measured

SECTIONS = (
    "summary",
    "part",
    "boundary-conditions",
    "stress",
    "curve",
    "gap",
    "closed-forms",
    "actuator",
    "mesh-error",
    "assumptions",
    "provenance",
)
LABELS = {  # text that each line plot must carry: quantities with their units
    "torque-angle": ("torque (Nm)", "deflection (rad)", "deflection (degrees)", "to 3D (%)"),
    "gap": ("gap to the facing edge (mm)", "from the hub (mm)", "(degrees)"),
    "actuator": ("torque (Nm)", "error (Nm)", "duty (1 = full)", "current (A)", "time (s)"),
    "drawing": ("$R_b$ 10.68", "$R_{ri}$ 78.92", "$w_1$ 7.7", "$w_2$ 7.34", "173.24"),
    "boundary": ("bore clamped", "+φ winding", "−φ unwinding"),
    "contact": ("winding, +24.2 Nm", "unwinding, −13.3 Nm"),
}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return small_study(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def figures(study):
    return report_figures(study)


@pytest.fixture(scope="module")
def page(study, figures, tmp_path_factory):
    return render_report(study, tmp_path_factory.mktemp("page"), figures)


class Collector(HTMLParser):
    """Identifiers, addresses and text of a page; open elements must be closed in order."""

    VOID = ("meta", "img", "br", "link")

    def __init__(self):
        super().__init__()
        self.identifiers, self.addresses, self.tags, self.text = [], [], [], []
        self.open = []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.tags.append(tag)
        self.identifiers += [values["id"]] if "id" in values else []
        self.addresses += [values[key] for key in ("href", "src") if key in values]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def parsed(page):
    collector = Collector()
    collector.feed(page)
    assert collector.open == []
    return collector


def test_page_needs_no_other_file(page, parsed):
    assert "http" not in page
    assert not {"script", "link", "iframe", "object"} & set(parsed.tags)
    assert "@import" not in page
    local = [a for a in parsed.addresses if not a.startswith(("data:image/png;base64,", "#"))]
    assert sorted(local)[0].endswith("gone.stl")
    assert [a.rsplit("/", 1)[-1] for a in sorted(local)] == ["gone.stl", "the%20part.step"]
    assert all(found.startswith("#") for found in re.findall(r"url\(([^)]*)\)", page))


def test_page_has_every_section_and_no_identifier_twice(parsed):
    assert set(SECTIONS) <= set(parsed.identifiers)
    assert len(parsed.identifiers) == len(set(parsed.identifiers))
    inner = {a[1:] for a in parsed.addresses if a.startswith("#")}
    assert inner <= set(parsed.identifiers)


def test_page_is_of_a_size_to_be_mailed(page):
    assert 2e5 < len(page.encode()) < 6e6


def test_first_screen_says_the_verdict_and_four_numbers(page, study):
    first = page[: page.index("<nav")]
    assert verdict(study.checks).sentence.split("<")[0] in first
    assert "66.090 ± 0.030" in first
    assert "+24.2 / −13.3" in first
    assert "286" in first
    assert first.count("<dt>") == 4
    for word in ("passed", "failed", "open"):
        assert f'<span class="outcome {word}">{word}</span>' in first


def test_names_and_notes_are_escaped(page, parsed):
    assert "a&lt;b&gt;&amp;c" in page
    assert "a<b>" not in page
    assert "<script>" not in page
    assert "&lt;script&gt;none" in page
    assert "π n (<i>R</i><sub>o</sub> + <i>R</i><sub>i</sub>) &lt; 3" in page


def test_every_figure_is_drawn_with_alternative_text(figures, page):
    expected = {"render", "mesh", "stress-winding", "stress-unwinding", *LABELS}
    assert set(figures) == expected
    for figure in figures.values():
        assert (figure.svg is None) != (figure.png is None), figure.name
        assert len(figure.alt) > 30, figure.name
        assert len(figure.caption) > 20, figure.name
        if figure.png is not None:
            image = imread(io.BytesIO(figure.png))
            assert image.shape[0] > 400, figure.name
            assert image[..., :3].std() > 0.02, figure.name


@pytest.mark.parametrize("name", sorted(LABELS))
def test_line_plots_are_labelled_with_units(figures, name):
    markup = figures[name].svg
    root = ET.fromstring(markup)
    assert root.tag == "svg"
    assert len(root.findall(".//path")) > 20
    for label in LABELS[name]:
        assert label in markup, label


@pytest.mark.parametrize("direction", ["winding", "unwinding"])
def test_stress_figures_say_torque_angle_and_peak(figures, study, direction):
    alt_text = figures[f"stress-{direction}"].alt
    peak = study.solid.snapshots[direction].von_mises_Pa.max() / 1e6
    assert f"{peak:.0f} MPa" in alt_text
    assert re.search(r"[+−][\d.]+ Nm and [+−][\d.]+ rad \([+−][\d.]+°\)", alt_text)


def test_verdict_of_a_failure_names_what_failed_with_value_and_limit():
    found = verdict(CHECKS[:2])
    assert found.status == "not met"
    assert found.sentence == (
        "Does not meet its requirements: coils touch at 13.6 Nm unwinding,"
        " at least 15.2 Nm required."
    )


def test_verdict_of_several_failures_joins_them():
    stiff = replace(CHECKS[0], passed=False, value=90.123)
    sentence = verdict((stiff, CHECKS[1])).sentence
    assert "stiffness is 90.1 Nm/rad, 65 Nm/rad ± 5 % required; coils touch" in sentence


def test_verdict_of_a_pass_counts_the_requirements():
    passed = replace(CHECKS[1], passed=True)
    assert verdict((CHECKS[0], passed)).sentence == "Meets all 2 requirements."
    assert verdict((CHECKS[0],)).sentence == "Meets its one requirement."
    assert verdict((CHECKS[0],)).status == "met"


def test_what_cannot_be_judged_stays_open():
    found = verdict((CHECKS[0], CHECKS[2]))
    assert found.status == "open"
    assert found.sentence.startswith("Meets 1 of 2 requirements; the rest is open.")
    assert "safety factor to yield (the material has no strengths" in found.sentence
    assert verdict(()).status == "open"


def test_safety_is_open_without_a_strength_and_never_a_number(study):
    soft = replace(study.design.material, yield_strength_Pa=None, no_strengths="none is printed")
    bare = replace(study, design=replace(study.design, material=soft))
    number = big_numbers(bare)[2]
    assert (number.value, number.note) == ("open", "none is printed")


def test_safety_says_where_it_was_extrapolated(study):
    check = replace(CHECKS[2], value=0.9, passed=False, note="306 MPa against 276 MPa")
    number = big_numbers(replace(study, checks=(check,)))[2]
    assert number.label == "Safety factor to yield at ±15.2 Nm"
    assert number.value == "0.900"
    assert number.note == "306 MPa against 276 MPa; unwinding extrapolated from first contact"


def test_direction_without_contact_is_a_dash_with_its_reach(study):
    solid = replace(study.solid, contact_onset={**study.solid.contact_onset, "winding": None})
    number = big_numbers(replace(study, solid=solid))[1]
    assert number.value == "– / −13.3"
    assert "winding: none up to +24.2 Nm" in number.note
    assert models_table(replace(study, solid=solid)).rows[-1][3] == "–"


def test_study_without_actuator_or_fields_says_so(study, figures, tmp_path, monkeypatch):
    monkeypatch.setattr(html, "part_render", lambda *args: figures["render"])
    bare = replace(
        study,
        actuator=None,
        solid=replace(study.solid, snapshots={}),
        planar=replace(study.planar, snapshots={}),
    )
    drawn = report_figures(bare)
    assert set(figures) - set(drawn) == {
        "actuator",
        "stress-winding",
        "stress-unwinding",
        "contact",
    }
    page = render_report(bare, tmp_path, drawn)
    assert "No actuator was simulated." in page
    assert "The study has no stress field." in page


def test_files_are_listed_with_size_link_and_check(study):
    folder = next(iter(study.export.files.values())).parent
    step, stl = files_table(study, folder)
    assert (step.address, step.size) == ("the%20part.step", "2.3\u00a0kB")
    assert step.checked == "24 faces, one closed solid, relative volume error 1.6 × 10⁻⁹"
    assert stl.size == "not found"


def test_report_is_written_whole_or_refused_in_one_line(study, figures, tmp_path, monkeypatch):
    monkeypatch.setattr(html, "report_figures", lambda study: figures)
    path = write_report(study, tmp_path / "report.html")
    assert path.read_text(encoding="utf-8") == render_report(study, tmp_path, figures)
    assert sorted(tmp_path.iterdir()) == [path, tmp_path / "report.page.npz"]
    assert draw_again(tmp_path / "report.page.npz", tmp_path)[1] == path.read_text(encoding="utf-8")
    with pytest.raises(OutputError, match="cannot be written"):
        write_report(study, tmp_path / "missing" / "report.html")


def test_records_become_labels_and_units(study):
    assert label_and_unit("torque_rate_needed_Nm_per_s") == ("torque rate needed", "Nm/s")
    assert label_and_unit("current_rms_A") == ("current root mean square", "A")
    rows = {row[0]: row[1:] for row in record_table(study.actuator.limits, "").rows}
    assert rows["share of time: command limited"] == ("25.00", "%")
    assert "torque rate available" not in rows  # not known: left out, not zero
    assert "binding" not in rows


def test_signs_and_symbols_are_set_for_print():
    assert readable("65 Nm/rad +- 5 %") == "65 Nm/rad ± 5 %"
    assert readable("-49.2 % of plane-stress") == "−49.2 % of plane-stress"
    assert symbols("K_b & n_arms") == "<i>K</i><sub>b</sub> &amp; n_arms"


def test_a_study_with_fields_has_a_part_to_turn_and_one_without_a_picture(study, figures, tmp_path):
    solid = study.solid
    sector, stress = study.sector, np.array([[a * a] * len(study.sector.nodes) for a in (1, 2)])
    fields = StepFields(
        copies=2,
        nodes_m=sector.nodes,
        cells=sector.cells,
        displacement_m=np.zeros((len(solid.deflection_rad), len(sector.nodes), 2)),
        von_mises_Pa=np.resize(1e8 * stress, (len(solid.deflection_rad), len(sector.nodes))),
    )
    with_fields = replace(study, solid=replace(solid, fields=fields))
    living = render_report(with_fields, tmp_path, figures)
    still = render_report(study, tmp_path, figures)
    assert 'id="turnable"' in living
    assert 'id="fig-render"' not in living
    assert 'id="turnable"' not in still
    assert 'id="fig-render"' in still
