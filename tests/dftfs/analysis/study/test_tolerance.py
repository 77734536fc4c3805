"""Sensitivities are those of the rod model, and the Monte Carlo scatters as the budget says."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.study import tolerance
from dftfs.analysis.study.drawing_tolerance import drawing_tolerance, stiffness_fit
from dftfs.analysis.study.further_causes import Sensitivities, further_causes
from dftfs.analysis.study.tolerance import Tolerances, shifted, tolerance_study
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.process import find_process
from dftfs.report.figures.tolerance import tolerance_figure
from dftfs.spring.outline import build_outline
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod

TOLERANCES = Tolerances(thickness_m=4e-5, kerf_m=2e-5, width_m=1e-4, modulus=0.02)


@pytest.fixture(scope="module")
def result():
    return tolerance_study(load_design("ref"), TOLERANCES, samples=50_000, seed=1)


def causes(result, response):
    spread = next(s for s in result.spreads if s.response == response)
    return {cause.cause: cause for cause in spread.causes}, spread


def test_stiffness_goes_with_the_thickness_to_the_power_of_3_2(result):
    found, _ = causes(result, "stiffness_Nm_per_rad")
    assert found["thickness"].sensitivity == pytest.approx(3.2, abs=0.1)
    assert found["width"].sensitivity == found["modulus"].sensitivity == 1


def test_sensitivities_are_those_of_the_rod_model_itself(result):
    design, step = load_design("ref"), 1e-6
    found, _ = causes(result, "stiffness_Nm_per_rad")

    def stiffness(thickness, kerf):
        outline = build_outline(shifted(design.spiral, thickness, kerf))
        return np.log(twist_stiffness(arm_rod(outline, 1e-2, 7e10, 0.33).rod))

    t = design.spiral.thickness_m
    by_thickness = (stiffness(step, 0) - stiffness(-step, 0)) / (2 * step) * t
    by_kerf = (stiffness(0, step) - stiffness(0, -step)) / (2 * step) * t / 2
    assert found["thickness"].sensitivity == pytest.approx(by_thickness, abs=0.01)
    assert found["kerf"].sensitivity == pytest.approx(by_kerf, abs=0.01)


def test_the_drawn_parts_scatter_as_the_budget_says(result):
    for spread in result.spreads:
        budget = np.sqrt(sum(cause.spread**2 for cause in spread.causes))
        assert spread.standard_deviation / spread.nominal == pytest.approx(budget, rel=0.02)
        assert sum(cause.share for cause in spread.causes) == pytest.approx(1)
        shares = [cause.share for cause in spread.causes]
        assert shares == sorted(shares, reverse=True)
        halved = np.sqrt(budget**2 - 0.75 * spread.causes[0].spread ** 2)
        assert spread.causes[0].halved == pytest.approx(halved)
    assert result.fit_error < 1e-3


def test_a_thicker_strip_and_a_wider_kerf_touch_earlier_by_less_torque_than_they_stiffen(result):
    found, _ = causes(result, "contact_unwinding_Nm")
    stiff, _ = causes(result, "stiffness_Nm_per_rad")
    for cause in ("thickness", "kerf"):
        assert found[cause].sensitivity < stiff[cause].sensitivity - 1


def test_without_tolerances_every_part_is_the_nominal_one(result):
    none = Tolerances(thickness_m=0, kerf_m=0, width_m=0, modulus=0)
    exact = tolerance_study(load_design("ref"), none, samples=1000)
    for spread, other in zip(exact.spreads, result.spreads):
        assert spread.standard_deviation == pytest.approx(0, abs=1e-12)
        # the two fits reach differently far: their middles agree within the fit's error
        assert spread.nominal == pytest.approx(other.nominal, rel=2e-3)


def test_kerf_moves_every_edge_out_of_the_part_or_into_it():
    p = load_design("al1").spiral
    q = shifted(p, 0.0, 1e-5)
    area, more = build_outline(p).area_m2, build_outline(q).area_m2
    edges = sum(e.length_m for loop in build_outline(p).coil_gaps for e in loop)
    edges += build_outline(p).rim_outer.length_m + build_outline(p).bore.length_m
    assert (more - area) / (1e-5 * edges) == pytest.approx(1, abs=0.05)


def test_what_cannot_be_studied_is_refused():
    with pytest.raises(DesignError, match="0 or more"):
        replace(TOLERANCES, width_m=-1e-4)
    with pytest.raises(DesignError, match="1000 or more"):
        tolerance_study(load_design("ref"), TOLERANCES, samples=10)
    with pytest.raises(DesignError):
        tolerance_study(load_design("al1"), replace(TOLERANCES, kerf_m=5e-3), samples=1000)


def further(n_arms=2, **sigma):
    none = {"fillet_m": 0.0, "inclination_rad": 0.0, "arm_m": 0.0}
    sensitivities = (
        Sensitivities(  # of a strip of 4 mm: stiffness to the power 3, contact earlier when thicker
            thickness=np.array([3.0, -1.0]) / 4e-3,
            thickness_2=np.zeros(2),
            fillet=np.array([0.1, 0.05]) / 1e-3,
            fillet_2=np.zeros(2),
        )
    )
    return further_causes(
        sensitivities, none | sigma, thickness_m=4e-3, fillet_m=1e-3, width_m=10e-3, n_arms=n_arms,
        rng=np.random.default_rng(0), samples=40_000,
    )  # fmt: skip


def test_an_inclined_cut_stiffens_by_the_mean_of_the_cube_and_narrows_the_gap():
    angle, across = 0.02, np.linspace(-1, 1, 20_001)
    (inclination,) = further(inclination_rad=angle).values()
    drawn = np.abs(angle * np.random.default_rng(0).standard_normal(40_000))
    thickness = 4e-3 + 10e-3 * np.tan(drawn[:3, None]) * across / 2 * 2
    cube = np.trapezoid((thickness / 4e-3) ** 3, across, axis=1) / 2
    np.testing.assert_allclose(np.exp(inclination.logarithms[:3, 0]), cube, rtol=1e-6)
    # contact: the stiffness' gain and an angle that the gap shortens by 4 per relative thickness
    wedge = 10e-3 * np.tan(drawn[:3])
    np.testing.assert_allclose(inclination.logarithms[:3, 1], np.log(cube) - 4.0 * wedge / 4e-3)


def test_arms_of_their_own_average_in_the_stiffness_and_the_narrowest_gap_touches_first():
    sigma = 2e-5
    one, four = (further(n_arms=n, arm_m=sigma)["arms"].logarithms for n in (1, 4))
    assert one[:, 0].std() == pytest.approx(3.0 * sigma / 4e-3, rel=0.02)
    assert four[:, 0].std() == pytest.approx(one[:, 0].std() / 2.0, rel=0.02)
    assert abs(one[:, 1].mean()) < 1e-4
    # means of neighbours: half their sum and the larger of two independent half-normals, each of
    # half a deviation
    largest = 0.5 * 2.0 / np.sqrt(np.pi)
    assert four[:, 1].mean() == pytest.approx(-4.0 * largest * sigma / 4e-3, rel=0.02)


def test_the_fillet_scatters_by_its_slope():
    (fillet,) = further(fillet_m=1e-4).values()
    np.testing.assert_allclose(fillet.logarithms.std(axis=0), [0.01, 0.005], rtol=0.02)
    assert not further()


def test_tolerances_of_a_process_are_its_edges():
    laser = Tolerances.of_process(find_process("laser"), 10e-3)
    assert laser.thickness_m == pytest.approx(0.5e-3)
    # an edge's variance once: half of it common to all cuts, half its own
    own = laser.thickness_m / np.sqrt(2)
    assert np.hypot(laser.kerf_m, own) == pytest.approx(0.5e-3)


def test_coils_that_touch_one_direction_only_leave_the_other_responses(monkeypatch):
    found = tolerance.contact_onset  # no further than 0.25 rad: ref touches unwinding only
    monkeypatch.setattr(tolerance, "contact_onset", lambda *a, **k: found(*a, limit_rad=0.25, **k))
    result = tolerance_study(load_design("ref"), TOLERANCES, samples=1000)
    assert result.untouched == ("contact_winding_Nm",)
    names = {spread.response for spread in result.spreads}
    assert "stiffness_Nm_per_rad" in names
    assert not names & set(result.untouched)
    assert tolerance_figure(result).png


def test_drawing_tolerances_keep_the_stiffness_in_99_of_100_parts_by_the_rod_model():
    design = load_design("ref", {"stiffness_Nm_per_rad": "65.4"})
    found = drawing_tolerance(design, find_process("wire-edm"))
    assert found.met
    assert found.profile_m == found.thickness_m
    fit, t = stiffness_fit(design), design.spiral.thickness_m
    rng = np.random.default_rng(7)
    for share in rng.uniform(-1, 1, 4):  # the fit stands for the rod inside the zone
        change = share * found.thickness_m
        outline = build_outline(shifted(design.spiral, 0.0, change / 2))
        material = design.material
        elastic = design.width_m, material.youngs_modulus_Pa, material.poisson_ratio
        rod = 2 * twist_stiffness(arm_rod(outline, *elastic, wide=True).rod)
        assert np.exp(np.polyval(fit, change / t)) == pytest.approx(rod, rel=2e-4)
    parts = np.exp(np.polyval(fit, rng.uniform(-1, 1, 2000) * found.thickness_m / t))
    parts *= 1 + 0.01 * rng.standard_normal(2000)
    parts *= 1 + rng.uniform(-1, 1, 2000) * found.width_m / design.width_m
    assert np.mean(np.abs(parts / 65.4 - 1) <= 0.05) >= 0.985  # 99 % and what 2000 parts scatter
    assert "in 9" in found.line()
    off = drawing_tolerance(
        load_design("ref", {"stiffness_Nm_per_rad": "72"}), find_process("wire-edm")
    )
    assert not off.met


def test_the_command_prints_and_writes_the_spreads(tmp_path, capsys):
    arguments = ["tolerance", "ref", "--kerf-mm", "0.02", "--json", "--out", str(tmp_path)]
    more = ["--fillet-mm", "0.2", "--inclination-deg", "1", "--arm-mm", "0.02"]
    assert main([*arguments, "--samples", "2000", *more]) == 0
    record = json.loads(capsys.readouterr().out)
    (named,) = {tuple(sorted(c["cause"] for c in s["causes"])) for s in record["spreads"]}
    assert named == ("arms", "fillet", "inclination", "kerf", "modulus", "thickness", "width")
    assert record["tolerances"]["kerf_m"] == pytest.approx(2e-5)
    assert {s["response"] for s in record["spreads"]} >= {"stiffness_Nm_per_rad"}
    assert (tmp_path / "tolerance-ref.png").stat().st_size > 10_000
    assert main([*arguments, "--process", "wires"]) == 2
    negative = ["-1" if word == "0.02" else word for word in arguments]
    assert main([*negative, "--force"]) == 2
    assert main(["tolerance", "ref", "--inclination-deg", "20", "--json"]) == 2
