"""Living curves keep their data, cannot break out of the page, and leave the drawn figure."""

import base64
import json

import numpy as np
import pytest

from dftfs.report.live import Curve, Panel, library, with_live
from dftfs.report.numbers import readable
from dftfs.report.provenance import provenance
from dftfs.report.style import ReportFigure

STILL = ReportFigure(name="x", alt="a curve", caption="c", svg="<svg></svg>")


def living(values, name="a", **options):
    time = np.arange(len(values)) * 1e-3
    panel = Panel(label="torque (Nm)", curves=(Curve(name=name, values=values),), band=0.1)
    return with_live(STILL, time, (panel, panel), **options)


def test_the_data_of_a_curve_are_those_that_were_given():
    values = np.sin(np.arange(500.0))
    figure = json.loads(living(values, shaded_to=0.1).live)
    assert len(figure["data"]) == 2
    shown = np.frombuffer(base64.b64decode(figure["data"][0]["y"]["bdata"]), "<f4")
    np.testing.assert_allclose(shown, values, atol=1e-7)
    assert figure["layout"]["yaxis2"]["domain"][0] == 0.0
    assert len(figure["layout"]["shapes"]) == 3


def test_a_label_that_is_longer_than_its_panel_is_high_stands_above_it_once():
    values, label = np.arange(5.0), "actual_spring_torque (reference)"
    panel = Panel(label=label, curves=(Curve(name=label, values=values),))
    figure = json.loads(with_live(STILL, values, (panel,) * 4).live)
    heads, axes = figure["layout"]["annotations"], figure["layout"]
    assert [head["text"] for head in heads] == [label] * 4
    assert [head["y"] for head in heads] == pytest.approx(
        [axes[f"yaxis{k}"]["domain"][1] for k in ("", 2, 3, 4)]
    )
    assert not axes["yaxis"]["title"]["text"]
    assert not any(curve["showlegend"] for curve in figure["data"])


def test_a_long_curve_keeps_its_highest_and_lowest_value_in_fewer_points():
    values = np.zeros(200_000)
    values[123_456], values[77_777] = 5.0, -3.0
    shown = json.loads(living(values).live)["data"][0]["y"]["bdata"]
    shown = np.frombuffer(base64.b64decode(shown), "<f4")
    assert len(shown) < 10_000
    assert (shown.min(), shown.max()) == (-3.0, 5.0)


def test_a_name_cannot_end_the_script_that_holds_it():
    figure = living(np.arange(5.0), name="</script><script>alert(1)</script>")
    assert "<" not in figure.live
    assert json.loads(figure.live)["data"][0]["name"].startswith("</script>")


def test_the_library_is_in_the_page_only_where_a_figure_lives_and_is_below_three_megabytes():
    assert library([STILL]) == ""
    assert 1e6 < len(library([STILL, living(np.arange(5.0))])) < 3e6


def test_names_of_fields_are_read_as_text_and_unit():
    assert readable("peak_error_Nm") == ("peak error", "Nm")
    assert readable("motor_speed_peak_rad_per_s") == ("motor speed peak", "rad/s")
    assert readable("amplitude_ratio") == ("amplitude ratio", "")


def test_provenance_states_the_hash_of_every_input_and_a_fixed_date(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    (tmp_path / "rig.toml").write_text("x")
    facts = dict(provenance([tmp_path / "rig.toml", tmp_path / "none"]))
    assert facts["Made"].startswith("1970-01-01 00:00 UTC by dftfs")
    assert facts["SHA-256 of rig.toml"] == "2d711642b726b044"
