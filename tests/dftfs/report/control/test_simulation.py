"""The page and the pictures of a simulation hold the run and need no other file."""

import json
import re

import numpy as np
import pytest

from dftfs.design import load_design
from dftfs.report.control import simulation
from dftfs.report.control.simulation import (
    equations,
    render_simulation_page,
    write_simulation_page,
    write_simulation_pictures,
)
from dftfs.report.figures.actuator import actuator_figure
from dftfs.report.figures.winding import SHAPES, winding_frames
from dftfs.report.page_data import draw_again
from rsea_core.performance.compensation_trace import compensation_trace
from rsea_core.scenarios.scenario import Scenario, run_scenario


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    tables = {
        "name": "page",
        "rig": "rsea-bench",
        "spring": {"stiffness_Nm_per_rad": 65.8},
        "load": {"kind": "locked"},
        "terms": [{"effect": "gear-friction", "coulomb_Nm": 0.02}],
        "reference": {"kind": "sine", "amplitude_Nm": 3.0, "frequency_Hz": 2.0},
        "controller": {"kind": "pid-torque"},
        "simulation": {"duration_s": 1.0},
    }
    folder = tmp_path_factory.mktemp("page")
    return run_scenario(Scenario.from_tables(tables, where="page.toml", folder=folder))


def test_frames_follow_the_run_and_the_arms_keep_hub_and_rim(result):
    design = load_design("al1")
    frames = winding_frames(design, result)
    run = result.trajectory
    assert frames["time"][-1] == pytest.approx(run.time_s[-1])
    assert len(frames["shapes"]) == SHAPES
    assert np.interp(0.5, frames["time"], frames["torque"]) == pytest.approx(
        np.interp(0.5, run.time_s, run.torque_Nm), abs=0.05
    )
    # the end at the hub stays, the end at the rim turns by the deflection on its circle
    starts = np.array([shape[0] for shape in frames["shapes"]])
    np.testing.assert_allclose(starts - starts[0], 0.0, atol=2e-3)
    ends = np.array([shape[-1] for shape in frames["shapes"]])
    np.testing.assert_allclose(np.hypot(*ends.T), np.hypot(*ends[0]), atol=2e-3)
    turned = np.unwrap(np.arctan2(ends[:, 1], ends[:, 0]))
    np.testing.assert_allclose(turned - turned[0], np.subtract(frames["grid"], frames["grid"][0]),
                               atol=1e-4)  # fmt: skip
    # the bent arm joins its roots without a break
    for shape in frames["shapes"]:
        steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
        assert steps.max() < 12.0


def test_the_page_is_drawn_again_from_its_data(result, tmp_path):
    page = write_simulation_page(result, load_design("al1"), tmp_path / "run.html")
    again = draw_again(tmp_path / "run.page.npz", tmp_path)
    assert again == ("run.html", page.read_text(encoding="utf-8"))


def test_the_page_needs_no_other_file_and_holds_the_run(result):
    scenario = result.scenario
    trace = compensation_trace(scenario.controller, result.trajectory, scenario.reference)
    page = render_simulation_page(result, load_design("al1"), terms=equations(result), trace=trace)
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    film = json.loads(re.search(r"const film = (\{.*?\});\n", page)[1])
    assert film["arms"] == 2
    assert page.count("<svg") == 3
    assert "What the command asks beside the reference itself" in page
    assert "gear-friction" in page
    assert "<script>" not in render_simulation_page(result, None)


def test_pictures_are_written_whole(result, tmp_path):
    write_simulation_pictures(result, tmp_path / "a.png", tmp_path / "b.png")
    for name in ("a.png", "b.png"):
        assert (tmp_path / name).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_live_panels_of_an_angle_loop_compare_angles(tmp_path, monkeypatch):
    tables = {
        "name": "angle",
        "rig": "rsea-bench",
        "load": {"kind": "free"},
        "reference": {"kind": "ramp", "amplitude_rad": 0.17, "rise_s": 0.5},
        "controller": {"kind": "impedance", "selection": 1.0, "kp": 0.1, "kv": 0.01},
        "simulation": {"duration_s": 1.0},
    }
    run = run_scenario(Scenario.from_tables(tables, where="angle.toml", folder=tmp_path))
    found = []
    monkeypatch.setattr(simulation, "with_live", lambda _, time, all_, **more: found.extend(all_))
    simulation.with_live_panels(actuator_figure(run), run)
    panels = {panel.label: panel.curves for panel in found}
    error = run.trajectory.reference - run.trajectory.load_angle_rad
    np.testing.assert_array_equal(panels["error (rad)"][0].values, error)
    assert {"angle (rad)", "torque (Nm)"} <= set(panels)
