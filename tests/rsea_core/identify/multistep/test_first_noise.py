"""What a track presumes before any fit, and what its windows start from."""

from dataclasses import replace

import numpy as np
import pytest

import rsea_core.engines.event_driven.states as k
from rsea_core.identify.fitting.problem import Hypothesis, machine_of
from rsea_core.identify.multistep.error_filter import GRAVITY_LEVELS
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import smooth
from rsea_core.identify.multistep.noise_estimate import estimated_noise
from rsea_core.identify.multistep.tracks import WIDEST, initial_track
from rsea_core.identify.window_fit import FoundFit, strained_value
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

ROW_s, ROWS = 0.02, 600
RESISTANCE_ohm, CONSTANT, SENSOR_A = 2.0, 0.05, 1e-3


def servo_case(folder, *, drift_A_per_s: float = 0.0, inductance_H: float | None = None):
    """A wheel on a voltage drive, whose winding follows volts and speed at once, and its log."""
    rig = Rig(
        name="servo", parts=("drive", "gear", "load"), gear_ratio=1.0, supply_voltage_V=24.0,
        terminal_resistance_ohm=RESISTANCE_ohm, torque_constant_Nm_per_A=CONSTANT,
        back_emf_constant_Vs_per_rad=CONSTANT, terminal_inductance_H=inductance_H,
        motor_inertia_kgm2=1e-4, load_inertia_kgm2=4e-4, load_encoder_counts_per_rev=65536,
        current_limit_A=20.0, current_sensor_noise_A=SENSOR_A,
    )  # fmt: skip
    time = ROW_s * np.arange(ROWS)
    rate = 2.0 * np.pi * 0.2
    angle = 2.0 * np.sin(rate * time)
    speed, acceleration = 2.0 * rate * np.cos(rate * time), -2.0 * rate**2 * np.sin(rate * time)
    current = 5e-4 * acceleration / CONSTANT
    columns = {
        "time_s": time,
        "voltage_V": RESISTANCE_ohm * current + CONSTANT * speed,
        "load_angle_rad": angle,
        "current_A": current + drift_A_per_s * time,
    }
    recording = Recording(
        file="servo.csv", load=Load(kind="free"), columns=columns, sample_time_s=ROW_s,
        initial_rest=False,
    )  # fmt: skip
    return axis_case(folder, recording, rig=rig)


def first_current_noise_A(case) -> float:
    track = initial_track(MultistepProblem(case).fitted[0])
    return track.noise.readings[track.experiment.channels.index("current_A")]


def test_a_current_that_drifts_is_not_taken_at_its_sensors_noise(tmp_path):
    """The median of a ramp's magnitude is half its end; 1.48 makes it a normal deviation."""
    drift = 0.05
    expected = 1.48 * 0.5 * drift * ROW_s * (ROWS - 1)
    found = first_current_noise_A(servo_case(tmp_path, drift_A_per_s=drift))
    assert found == pytest.approx(expected, rel=0.02)


def test_a_current_that_volts_and_speed_explain_keeps_its_sensors_noise(tmp_path):
    assert first_current_noise_A(servo_case(tmp_path)) == pytest.approx(SENSOR_A, rel=1e-6)


def test_a_winding_with_inductance_has_an_unknown_voltage_for_a_drift(tmp_path):
    case = servo_case(tmp_path, drift_A_per_s=0.05, inductance_H=1e-3)
    assert first_current_noise_A(case) == pytest.approx(SENSOR_A, rel=1e-6)


@pytest.mark.parametrize(("inductance_H", "strained"), [(1e-4, False), (2e-2, True)])
def test_an_inductance_is_strained_only_where_rows_can_show_its_change(
    tmp_path, inductance_H, strained
):
    """Six tolerances of 0.1 mH in 2 ohm are 40 us at most, of 20 mH a third of a row and more."""
    problem = MultistepProblem(servo_case(tmp_path, inductance_H=inductance_H))
    keys = [p.key for p in problem.nominals]
    h = Hypothesis()
    x = problem.start(h)
    x[keys.index("terminal_inductance_H")] = 6.0
    found = strained_value(problem, FoundFit(hypothesis=h, x=x, msni=np.ones(1)))
    assert (found.key if found else None) == ("terminal_inductance_H" if strained else None)


def test_a_command_that_errs_within_its_row_moves_the_speed_by_its_impulse(tmp_path):
    """A torque that errs by dT over a row h changes the speed of an inertia J by dT h / J."""
    problem = MultistepProblem(axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig()))
    track = initial_track(problem.fitted[0])
    errors, plant = track.errors, machine_of(track.experiment.base)
    inertia = plant.inertia + plant.load_inertia
    speed = errors.states.index(k.WW)
    row = track.experiment.recording.sample_time_s
    level = errors.mode // (2 * GRAVITY_LEVELS)
    assert np.unique(level).size > 1
    for mode in np.unique(errors.mode):
        same = level == mode // (2 * GRAVITY_LEVELS)
        change = np.sqrt(np.mean(track.experiment.command_change[same] ** 2))
        expected = plant.torque_per_ampere * change * row / inertia
        found = np.sqrt(errors.unit[4, mode, speed, speed])
        assert found == pytest.approx(expected, rel=0.02)


def command_share(folder, *, linear: bool) -> float:
    """The estimated share of a command's change by which its mean over a row errs."""
    recording = axis_recording(seed=5, linear=linear)
    problem = MultistepProblem(axis_case(folder, recording, rig=axis_rig()))
    plain = Hypothesis()
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    residual = [r[0] for r in estimator.residuals([(plain, problem.start(plain))])]
    return estimated_noise(estimator.tracks, residual)[0].noise.inputs[4]


def test_a_command_that_moves_within_its_rows_is_seen_to_err_there(tmp_path):
    """A command that moves linearly and is taken as held errs by half of its change."""
    assert command_share(tmp_path, linear=True) > 5.0 * command_share(tmp_path, linear=False)


def test_an_angle_that_no_reading_shows_stays_as_uncertain_as_the_motion_is_large(tmp_path):
    plain = axis_recording(seed=2)
    angle = plain["motor_angle_rad"]
    columns = {name: plain[name] for name in ("time_s", "current_command_A")}
    columns["motor_velocity_rad_per_s"] = np.gradient(angle, plain.time_s)
    rig = replace(axis_rig(), motor_encoder_counts_per_rev=None)
    problem = MultistepProblem(axis_case(tmp_path, replace(plain, columns=columns), rig=rig))
    h = Hypothesis()
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    for _ in range(12):
        smooth(estimator, h, problem.start(h))
    track = estimator.tracks[0]
    assert track.motion_std[:, k.TW].max() <= WIDEST * track.scale.angle_rad * (1.0 + 1e-12)
    assert np.isfinite(estimator.costs([(h, problem.start(h))])[0])
