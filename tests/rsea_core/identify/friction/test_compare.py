"""Comparing friction laws finds the one that was simulated and names what data leave open."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearFriction, GearLoadFriction
from rsea_core.errors import RecordingError
from rsea_core.identify.friction.compare import compare_friction
from rsea_core.recordings.case import Case, read_case
from rsea_core.recordings.recording import Recording
from tests.cases.places import SHARED_DATA

REAL = SHARED_DATA / "real"
BENCH = replace(Rig.preset("rsea-bench"), load_mass_kg=1.0, load_inertia_kgm2=0.12)


def steady_map(friction, *, noise_Nm, gear_ratio=60.0, fastest=60.0):
    """Recordings at constant speeds with a known friction torque, every third held out."""
    rng, recordings = np.random.default_rng(5), []
    rig = Rig(
        name="map",
        parts=("drive", "gear"),
        torque_constant_Nm_per_A=0.3,
        motor_inertia_kgm2=1e-4,
        gear_ratio=gear_ratio,
    )
    speeds = np.concatenate((-np.geomspace(1.0, fastest, 18), np.geomspace(1.0, fastest, 18)))
    for number, speed in enumerate(speeds):
        torque = friction(speed) + noise_Nm * rng.standard_normal(60)
        columns = {
            "time_s": np.arange(60) * 0.01,
            "motor_torque_Nm": torque,
            "motor_velocity_rad_per_s": np.full(60, speed),
        }
        recordings.append(
            Recording(
                file=f"{number}.csv",
                role="validation" if number % 3 == 0 else "identification",
                load=Load(kind="free"),
                quasi_static=True,
                columns=columns,
                sample_time_s=0.01,
            )
        )
    return Case(name="map", folder=Path(), rig=rig, recordings=tuple(recordings))


def parameters(fit):
    return {p.name: p for p in fit.parameters}


def test_a_stribeck_law_is_found_with_its_parameters_within_their_uncertainty():
    def truth(w):
        return 0.002 * w + np.sign(w) * (0.05 + 0.03 * np.exp(-((abs(w) / 8.0) ** 1.5)))

    found = compare_friction(steady_map(truth, noise_Nm=1e-4))
    assert found.best.law == "stribeck"
    values = parameters(found.best)
    for name, true in (("f_v", 0.002), ("f_c", 0.05), ("f_s", 0.03), ("w_s", 8.0)):
        assert abs(values[name].value - true) < 5.0 * values[name].std + 1e-6 * abs(true), name
        assert values[name].std < 0.05 * abs(true)
    assert found.best.rms_held_out_Nm < 1.3e-4
    assert next(f for f in found.fits if f.law == "ncfm").rms_held_out_Nm > 0.02


def test_the_printed_f_b_in_s_per_rad_leaves_only_the_sum_of_two_terms():
    """Errata: f_b w stays below 0.04, the atan never bends, f_v and f_a f_b are one number."""

    def truth(w):
        return 0.02 * np.sign(w) + 0.004 * w

    found = compare_friction(steady_map(truth, noise_Nm=1e-4))
    radians = next(f for f in found.fits if f.law == "nlfm-rad")
    pairs = {(a, b): c for a, b, c in radians.correlated}
    assert pairs[("f_v", "f_a")] < -0.999999
    assert {"f_v", "f_a"} <= set(radians.insensitive)
    lfm = parameters(next(f for f in found.fits if f.law == "lfm"))
    assert lfm["f_c"].value == pytest.approx(0.02, abs=5 * lfm["f_c"].std)


def test_both_readings_of_the_thesis_table_are_recovered_where_they_are_true():
    def truth(w):  # f_b in s/deg at the output
        deflection = np.arctan(np.rad2deg(1.3905e-2) / 60.0 * w)
        return 0.01 + 0.001 * w + 0.1 * deflection

    found = compare_friction(steady_map(truth, noise_Nm=1e-5, fastest=300.0))
    values = parameters(next(f for f in found.fits if f.law == "nlfm-deg"))
    assert values["f_a"].value == pytest.approx(0.1, abs=5 * values["f_a"].std)
    assert values["f_a"].std < 0.01
    assert values["f_v"].value == pytest.approx(0.001, rel=0.02)


def bench_recording(model, number, role):
    time = np.arange(8001) * 1e-3
    rng = np.random.default_rng(number)
    tones = (0.4 + 0.1 * number, 1.1, 2.3)
    duty = sum(0.22 * np.sin(2 * np.pi * f * time + number + f) for f in tones)
    run = simulate(model, Inputs(time_s=time, duty=duty, load=Load(kind="locked")))
    columns = {
        "time_s": time,
        "duty": duty,
        "motor_angle_rad": run.encoder_motor_angle_rad,
        "current_A": run.current_A + 0.005 * rng.standard_normal(time.size),
        "torque_Nm": run.torque_Nm + 0.02 * rng.standard_normal(time.size),
    }
    return Recording(
        file=f"{number}.csv",
        role=role,
        load=Load(kind="locked"),
        columns=columns,
        sample_time_s=1e-3,
    )


def test_a_worm_is_found_on_simulated_recordings_of_the_bench():
    worm = GearLoadFriction(lead_angle_rad=0.12, friction_coefficient=0.05)
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.01), worm))
    roles = ("identification", "identification", "validation")
    recordings = tuple(bench_recording(model, n, role) for n, role in enumerate(roles))
    found = compare_friction(Case(name="bench", folder=Path(), rig=BENCH, recordings=recordings))
    law = next(f for f in found.fits if f.law == "worm")
    assert found.best.law.startswith("worm")
    values = parameters(law)
    assert values["mu_drive"].value == pytest.approx(1.0 / worm.drive_efficiency - 1.0, rel=0.05)
    assert values["mu_back"].value == pytest.approx(1.0 - worm.backdrive_efficiency, rel=0.05)
    assert values["f_c"].value == pytest.approx(0.01, abs=3 * values["f_c"].std)
    assert values["f_v"].value == pytest.approx(1.06e-4, abs=3 * values["f_v"].std)
    assert law.rms_held_out_Nm < 0.3 * next(f for f in found.fits if f.law == "lfm").rms_held_out_Nm


def test_a_case_without_a_motor_torque_is_refused():
    case = steady_map(lambda w: w, noise_Nm=0.0)
    bare = tuple(
        replace(r, columns={n: c for n, c in r.columns.items() if n != "motor_torque_Nm"})
        for r in case.recordings
    )
    with pytest.raises(RecordingError, match="friction needs a motor torque"):
        compare_friction(replace(case, recordings=bare))


@pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings lie in ../shared only")
def test_real_worm_drive_beats_the_published_map_and_names_what_one_load_cannot_tell():
    found = compare_friction(read_case(REAL / "worm-drive"))
    fits = {fit.law: fit for fit in found.fits}
    assert fits["ncfm"].rms_held_out_Nm == pytest.approx(0.98e-3, rel=0.05)  # published
    assert fits["lfm"].rms_held_out_Nm < 0.16e-3
    assert parameters(fits["worm"])["mu_drive"].std is None  # one weight: f_c and mu are one
    assert fits["worm"].condition == np.inf


@pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings lie in ../shared only")
def test_real_servo_has_friction_that_grows_with_load():
    found = compare_friction(read_case(REAL / "bam-xl330"))
    fits = {fit.law: fit for fit in found.fits}
    assert found.best.law.startswith("worm")
    assert fits["worm"].rms_held_out_Nm < 0.85 * fits["stribeck"].rms_held_out_Nm
    assert fits["stribeck"].gap_to_best_se > 2.0
