"""Claim: a thickness profile and an offset of the centreline keep the outline exact and smooth."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.design import design_toml, load_design
from dftfs.errors import DesignError
from dftfs.spring.outline import build_outline
from dftfs.spring.spline_profile import SplineProfile

AL1 = load_design("al1").spiral
SHAPED = replace(
    AL1, thickness_profile=(1.0, 0.9, 0.8, 0.9, 1.0), centreline_offset_m=(5e-4, -3e-4, 4e-4)
)


def test_profile_has_no_slope_and_no_curvature_at_its_ends():
    profile = SplineProfile(first=2.0, inner=(3.0, 1.0), last=2.5, start=1.0, end=5.0)
    np.testing.assert_allclose(profile.value([0.0, 1.0, 5.0, 9.0]), [2.0, 2.0, 2.5, 2.5])
    for rate in (profile.slope, profile.second):
        np.testing.assert_allclose(rate([1.0, 5.0]), 0.0, atol=1e-12)


def test_curvature_of_an_offset_centreline_is_that_of_its_points():
    line, step = SHAPED.centreline, 1e-4
    theta = np.linspace(line.start + 0.1, line.end - 0.1, 40)
    turned = np.arctan2(*(line.tangent(theta + step)[:, ::-1]).T)
    before = np.arctan2(*(line.tangent(theta - step)[:, ::-1]).T)
    rate = np.unwrap(np.stack([before, turned]), axis=0)
    np.testing.assert_allclose(
        (rate[1] - rate[0]) / (2 * step * line.speed(theta)), line.curvature(theta), rtol=1e-5
    )


def test_equal_shares_give_the_plain_outline():
    even = build_outline(replace(AL1, thickness_profile=(1.0, 1.0, 1.0)))
    assert even.area_m2 == pytest.approx(build_outline(AL1).area_m2, rel=1e-12)


def test_a_design_file_keeps_the_profile(tmp_path):
    design = replace(load_design("al1"), spiral=SHAPED)
    path = tmp_path / "shaped.toml"
    path.write_text(design_toml(design))
    assert load_design(str(path)).spiral == SHAPED


@pytest.mark.parametrize(
    ("field", "message"),
    [("thickness_profile", "must be a list"), ("centreline_offset_mm", "must be a list")],
)
def test_a_single_number_is_refused(field, message):
    with pytest.raises(DesignError, match=message):
        load_design("al1", {field: "0.9"})


def test_a_share_out_of_range_is_refused():
    with pytest.raises(DesignError, match="value 2 = 9 must be"):
        replace(AL1, thickness_profile=(1.0, 9.0))
