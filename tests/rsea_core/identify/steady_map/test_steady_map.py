"""Laws and efficiencies behind a map of steady speeds are recovered."""

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.identify.steady_map.diagnose import choose, diagnose_map, efficiencies
from rsea_core.identify.steady_map.points import (
    MapLaw,
    compare_laws,
    fit_law,
    is_one_speed,
    is_steady_map,
    steady_points,
)
from tests.cases.recorded import WORM, map_case

DRIVE, BACK = 0.5, 0.3  # efficiencies of the gear
LEVEL, VISCOUS = 4e-4, 6e-6


def worm(speed, load):
    """Coulomb, viscous and what the load causes."""
    s = np.sign(speed)
    loss = 1.0 / DRIVE - 1.0 if s * load > 0.0 else 1.0 - BACK
    return s * (LEVEL + loss * abs(load)) + VISCOUS * speed


def test_several_loads_give_both_efficiencies(tmp_path):
    case = map_case(tmp_path, worm, loads=(0.0, 0.03, 0.08))
    assert is_steady_map(case)
    points = steady_points(case)
    fits = compare_laws(points)
    chosen = choose(fits, int(np.sum(~points.held_out)))
    assert chosen.law == MapLaw(levels="load", stribeck="none", drag="v")
    found = efficiencies(points, chosen)
    assert found.drive == pytest.approx(DRIVE, abs=0.02)
    assert found.back == pytest.approx(BACK, abs=0.02)
    assert chosen.values["level"] == pytest.approx(LEVEL, rel=0.02)
    assert chosen.values["viscous"] == pytest.approx(VISCOUS, rel=0.05)


def test_one_load_gives_the_efficiencies_of_the_whole_drive_and_says_what_is_open(tmp_path):
    weight = 0.05
    found = diagnose_map(map_case(tmp_path, worm, loads=(weight,)))
    assert found.document["verdict"] == "missing-physics"
    entry = next(e for e in found.document["effects"] if e["name"] == "gear-load-friction")
    assert entry["class"] == ["gear-load-friction", "gear-friction"]
    assert entry["confidence"] < 0.8
    values = {k: v["value"] for k, v in entry["parameters"].items()}
    load = weight / WORM["gear_ratio"]
    lift, lower = (1.0 / DRIVE - 1.0) * load + LEVEL, (1.0 - BACK) * load + LEVEL
    assert values["drive_efficiency"] == pytest.approx(1.0 / (1.0 + lift / load), abs=0.01)
    assert values["backdrive_efficiency"] == pytest.approx(1.0 - lower / load, abs=0.03)
    most = 1.0 / (1.0 + (lift - lower) / load)
    assert values["drive_efficiency_at_most"] == pytest.approx(most, abs=0.02)
    assert found.document["next_experiment"]["predicted_separation"] > 3.0
    assert any("one load level" in line for line in found.document["findings"])
    held = [r for r in found.document["fit"]["recordings"] if r["role"] == "validation"]
    assert all(r["rmse_after"] < 0.1 * r["rmse_parameters_only"] for r in held)


def test_a_machine_with_viscous_friction_alone_is_parameters_only(tmp_path):
    found = diagnose_map(map_case(tmp_path, lambda w, load: VISCOUS * 5 * w))
    assert found.document["verdict"] == "parameters-only"
    assert found.document["effects"] == []
    moved = found.document["parameters_corrected"]["motor_viscous_Nms_per_rad"]
    assert moved["to"] == pytest.approx(5 * VISCOUS, rel=0.02)


@pytest.mark.parametrize("stribeck", ["none", "one"])
def test_leave_one_out_is_what_leaving_out_gives(tmp_path, stribeck):
    case = map_case(tmp_path, lambda w, load: worm(w, load) + 2e-4 * np.sign(w) * np.exp(-abs(w)))
    p = steady_points(case)
    law = MapLaw(levels="two", stribeck=stribeck, drag="v")
    fit = fit_law(p, law)
    used = np.flatnonzero(~p.held_out)
    size = np.abs(p.speed_rad_per_s[used])
    grid = [(1.0, 1.0)]
    if stribeck != "none":
        grid = [
            (v, shape) for v in np.geomspace(size.min(), size.max(), 40) for shape in (1.0, 2.0)
        ]
    errors = []
    for j in used[(size > size.min()) & (size < size.max())]:
        rest = used[used != j]
        best = None
        for stribeck_speed, shape in grid:
            X = law.columns(p, stribeck_speed, shape)
            y, weight = p.torque_Nm - p.load_Nm, 1.0 / p.error_Nm
            scale = np.linalg.norm(X[rest] * weight[rest, None], axis=0)
            A = X[rest] * weight[rest, None] / scale
            value = np.linalg.lstsq(A, y[rest] * weight[rest], rcond=None)[0] / scale
            total = np.sum(((y - X @ value)[rest] * weight[rest]) ** 2)
            if best is None or total < best[0]:
                best = (total, ((y - X @ value) * weight)[j])
        errors.append(best[1])
    assert fit.score == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-5)


def test_friction_without_a_load_differs_by_direction_and_names_no_efficiency(tmp_path):
    def friction(w, load):
        return np.sign(w) * LEVEL * (1.2 if w > 0 else 0.8) + VISCOUS * w

    found = diagnose_map(map_case(tmp_path, friction, loads=(0.0,)))
    assert [e["name"] for e in found.document["effects"]] == ["gear-friction"]
    assert found.document["next_experiment"] is None
    law, values = found.model.laws[0]
    assert law.key == "gear-friction/asymmetric"
    assert values["asymmetry"] == pytest.approx(0.2, abs=0.02)


def test_an_encoder_that_steps_is_one_speed_and_a_ramp_is_not():
    rng = np.random.default_rng(1)
    stepping = np.where(rng.random(400) < 0.1, 1.0, 0.0)
    assert is_one_speed(stepping)
    assert not is_one_speed(np.linspace(-3.0, 3.0, 400))


def test_a_map_with_too_few_speeds_is_refused_in_one_line(tmp_path):
    case = map_case(tmp_path, worm, speeds=np.array([1.0, 2.0, 3.0]))
    with pytest.raises(RecordingError, match="2 steady speeds to fit are fewer than 6"):
        steady_points(case)
