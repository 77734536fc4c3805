"""Planted machines of other kinds than the bench: named, or found sound, in any unit.

What belongs to the experiment - offset, delay, a command that moves between rows, a clock - is
found as such and is no effect.
"""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain
from rsea_core.effects.registry import GearFriction, LoadFriction, LoadUnbalance
from rsea_core.identify import window_verdict
from rsea_core.identify.diagnose import diagnose, is_bench
from rsea_core.identify.experiment.experiment_file import decisive_experiment
from rsea_core.identify.window_diagnosis import diagnose_windows
from tests.cases.one_axis import Units, axis_case, axis_recording, axis_rig, pendulum_case
from tests.cases.planted import RIG, recording


def claims(found) -> list[str]:
    return [e["name"] for e in found.document["effects"] if e["confidence"] >= 0.5]


def axis(folder, *terms, units=Units(), off=1.0, **log):  # noqa: B008
    made = [axis_recording(*terms, seed=s, units=units, **log) for s in (1, 2)]
    return axis_case(folder, *made, rig=axis_rig(units, off=off))


def test_a_sound_axis_with_offset_delay_and_wrong_inertia_has_no_effect(tmp_path):
    found = diagnose_windows(axis(tmp_path, offset_A=0.08, delay_rows=1.3, off=1.15))
    assert found.document["verdict"] in ("parameters-only", "no-mismatch")
    assert not found.document["effects"]
    nuisance = {law.effect: values for law, values in found.model.laws}
    assert nuisance["drive-offset"]["offset"] == pytest.approx(0.08, abs=0.01)
    assert nuisance["drive-delay"]["delay_s"] == pytest.approx(0.013, abs=0.002)
    # torque constant and inertia are seen as their quotient
    value = {k: v["to"] for k, v in found.document["parameters_corrected"].items()}
    inertia = value["load_inertia_kgm2"] + value["motor_inertia_kgm2"]
    assert inertia / value["torque_constant_Nm_per_A"] == pytest.approx(0.044, rel=0.01)


def test_a_command_that_moves_between_rows_is_reported(tmp_path):
    found = diagnose_windows(axis(tmp_path, linear=True))
    assert found.model.command_between_rows == "linear"
    assert not found.document["effects"]


@pytest.mark.parametrize(
    "units",
    [Units(), Units(torque=1e-6), Units(torque=1e5), Units(time=1e-2)],
    ids=["bench units", "micro", "large", "fast"],
)
def test_dry_friction_of_an_axis_is_named_in_any_unit(tmp_path, units):
    """An axis without restoring force: what a free run cannot hold."""
    level = 0.06 * units.torque
    found = diagnose_windows(axis(tmp_path, GearFriction(coulomb_Nm=level), units=units))
    assert found.document["verdict"] == "missing-physics"
    assert claims(found)[0] in ("gear-friction", "load-friction")
    assert {"gear-friction", "load-friction"} <= set(found.document["effects"][0]["class"])
    value = found.document["effects"][0]["parameters"]["coulomb_Nm"]["value"]
    assert value == pytest.approx(level, rel=0.1)


def test_a_drive_that_gives_less_in_one_direction_is_a_formula_of_the_drive(tmp_path):
    """No effect of the contract has it: the verdict says so, with its place and its size."""
    found = diagnose_windows(axis(tmp_path, DriveNonlinearGain(by_sign=0.03)), quick=True)
    assert found.document["verdict"] == "unexplained"
    assert found.document["location"]["subsystem"] == "drive"
    assert not claims(found)
    by_sign, by_size, by_square = found.document["remainder"]["formula"]["terms"]
    assert by_sign["coefficient"] == pytest.approx(0.03, rel=0.1)
    largest = 3.6  # A
    curved = by_size["coefficient"] * largest + by_square["coefficient"] * largest**2
    assert abs(curved) < 0.02
    assert "drive-nonlinear-gain" in {law.effect for law, _ in found.model.laws}


def test_a_torque_constant_that_falls_with_the_current_is_a_formula_and_no_current_limit(tmp_path):
    """A current limit is the nearest name; the gain by the command's square says more."""
    found = diagnose_windows(axis(tmp_path, DriveNonlinearGain(by_square=-0.02)), quick=True)
    assert found.document["verdict"] == "unexplained"
    assert found.document["location"]["subsystem"] == "drive"
    assert not claims(found)
    assert [t["function"] for t in found.document["remainder"]["formula"]["terms"]][-1] == "u^3"


def test_what_the_data_cannot_decide_gets_an_experiment_that_would(tmp_path, monkeypatch):
    monkeypatch.setattr(window_verdict, "explains_only_negligible_torque", lambda found: False)
    found = diagnose_windows(axis(tmp_path, GearFriction(coulomb_Nm=5e-5)), quick=True).conclusion
    found.verdict = "insufficient-data"  # at this size it is, or nearly so
    wanted = decisive_experiment(found)
    assert wanted.rivals[1] == "parameters only"
    assert wanted.load.kind == "free"
    assert set(wanted.best.sensors) <= {"motor_angle_rad", "current_A"}
    assert np.max(np.abs(wanted.columns["current_command_A"])) > 0.0


def test_one_recording_of_a_bare_pendulum_shows_its_dry_friction(tmp_path):
    found = diagnose_windows(pendulum_case(tmp_path, LoadFriction(coulomb_Nm=3e-3), seed=1))
    first = found.document["effects"][0]
    assert first["name"] == "load-friction"
    assert first["class"] == ["load-friction"]  # it has no gear
    assert first["confidence"] >= 0.5
    assert first["parameters"]["coulomb_Nm"]["value"] == pytest.approx(3e-3, rel=0.15)


def test_the_model_found_predicts_with_its_offset_and_delay(tmp_path):
    from rsea_core.identify.result.corrected_model import FoundModel

    found = diagnose_windows(axis(tmp_path, GearFriction(coulomb_Nm=0.06), offset_A=0.08))
    path = tmp_path / "model.toml"
    path.write_text(found.model.to_toml(), encoding="utf-8")
    again = FoundModel.from_toml(path)
    assert {law.effect for law, _ in again.laws} >= {"drive-offset"}
    assert again.to_toml() == found.model.to_toml()


def test_the_bench_keeps_free_runs_and_others_do_not(tmp_path):
    bench = axis_case(tmp_path, recording((), "pendulum", "p.csv", 1), rig=RIG)
    assert is_bench(bench)
    assert not is_bench(axis(tmp_path))


def test_a_machine_that_is_no_bench_is_diagnosed_by_windows(tmp_path):
    found = diagnose(axis(tmp_path, GearFriction(coulomb_Nm=0.06)), quick=True)
    assert claims(found)[0] in ("gear-friction", "load-friction")
    assert np.all(np.isfinite([r["rmse_after"] for r in found.document["fit"]["recordings"]]))


def test_an_eccentric_mass_is_found_on_a_load_that_should_feel_no_gravity(tmp_path):
    mass = LoadUnbalance(torque_amplitude_Nm=0.05, angle_rad=0.8)
    found = diagnose_windows(axis(tmp_path, mass), quick=True)
    assert claims(found) == ["load-unbalance"]
    figures = {k: v["value"] for k, v in found.document["effects"][0]["parameters"].items()}
    assert figures["torque_amplitude_Nm"] == pytest.approx(0.05, rel=0.05)
    assert figures["angle_rad"] == pytest.approx(0.8, abs=0.05)


def test_a_load_sensor_of_wrong_scale_is_named_where_the_motor_turns_one_body_with_it(tmp_path):
    """The start of a rigid body is the motor sensor's: the other may read anything."""
    made = []
    for seed in (1, 2):
        r = axis_recording(seed=seed)
        read = 1.3 * r.columns["motor_angle_rad"]
        made.append(replace(r, columns={**r.columns, "load_angle_rad": read}))
    found = diagnose_windows(axis_case(tmp_path, *made, rig=axis_rig()))
    first = found.document["effects"][0]
    assert first["name"] == "sensor-scale"
    assert first["confidence"] >= 0.5
    assert first["parameters"]["scale"]["value"] == pytest.approx(1.3, rel=1e-3)
