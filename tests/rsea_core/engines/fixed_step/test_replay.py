"""Replays, windows and batches are the same to the bit on any number of threads."""

from dataclasses import replace

import numba
import numpy as np
import pytest

from rsea_core import (
    ActuatorModel,
    InputError,
    Inputs,
    Load,
    PidTorque,
    Reference,
    Rig,
    simulate_closed_loop,
    tracking_metrics,
)
from rsea_core.effects import DriveDelay, GearFriction, LoadFlexibility, LoadFriction
from rsea_core.engines.fixed_step.layout import STATE_NAMES
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.errors import SimulationError
from rsea_core.numeric.threads import share_out, share_out_all
from rsea_core.simulation.batch import METRICS, run_batch
from tests.cases.fixed_step import BENCH, DUTY, TIME, numbers_with

MODEL = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.04), LoadFriction(coulomb_Nm=0.05)))
WITH_STATES = {
    "slip_stiffness_1": 20.0,
    "slip_yield_1": 3e-3,
    "bouc_wen_stiffness": 10.0,
    "bouc_wen_yield": 5e-3,
    "bouc_wen_exponent": 1.5,
    "bouc_wen_shape": 0.6,
    "branch_stiffness_1": 15.0,
    "branch_time_1": 0.05,
    "gear_coulomb_forward": 2.0,
    "gear_coulomb_backward": 2.0,
    "gear_presliding": 5e-4,
    "internal_states": 1.0,
}


@pytest.fixture
def threads():
    before = numba.get_num_threads()
    yield numba.set_num_threads
    numba.set_num_threads(before)


def test_many_models_are_the_same_to_the_bit_on_any_number_of_threads(threads):
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    bare = replay.numbers(MODEL)
    many = [bare.with_plant(resistance=3.5 + 0.1 * j) for j in range(7)]
    found = []
    for count in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        threads(count)
        found.append(replay.run_many(many))
    assert np.array_equal(*found)
    assert np.array_equal(found[0][3], replay.run(many[3]))
    assert not np.array_equal(found[0][3], found[0][4])


def test_windows_from_recorded_states_repeat_the_run_to_the_bit():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    for numbers in (
        numbers_with(replay, **WITH_STATES),
        replay.numbers(ActuatorModel(BENCH, (DriveDelay(delay_s=2.4e-3),))),
    ):
        rows, states = replay.run(numbers, with_states=True)
        windows = [(0, 700), (700, 1400), (1234, 3000)]
        starts = states[[first for first, _ in windows]]
        found = replay.run_windows([numbers, numbers], windows, starts)
        for (first, last), window in zip(windows, found, strict=True):
            assert np.array_equal(window[1], rows[first : last + 1])


def test_windows_side_by_side_as_one_array_are_those_one_by_one():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    numbers = [numbers_with(replay, **WITH_STATES), replay.numbers(MODEL)]
    windows = np.array([(0, 699), (700, 1233), (1234, TIME.size - 1)])
    starts = np.repeat(replay.start_states(numbers)[:, None], 3, axis=1)
    starts[:, :, 2] += 0.1 * np.arange(6).reshape(2, 3)
    apart = replay.run_windows(numbers, windows, starts)
    together = replay.run_cover(numbers, windows, starts)
    assert together.shape == (2, TIME.size, 7)
    assert np.array_equal(together, np.concatenate(apart, axis=1))
    for gap in (windows[1:], windows[:-1], windows[[0, 2]]):
        with pytest.raises(InputError, match="each once"):
            replay.run_cover(numbers, gap, starts[:, : len(gap)])


def test_states_warmed_for_many_models_at_some_rows_are_those_of_each_alone():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    numbers = [numbers_with(replay, **WITH_STATES), replay.numbers(MODEL)]
    _, states = replay.run(numbers[0], with_states=True)
    path, kept = states[:, :5], np.array([0, 17, 1500])
    found = replay.warm_at(numbers, path, kept)
    for own, bare in zip(found, numbers, strict=True):
        alone = replay.warm(
            bare, current_A=path[:, 0], wheel_angle_rad=path[:, 1], load_angle_rad=path[:, 3],
            wheel_velocity_rad_per_s=path[:, 2], load_velocity_rad_per_s=path[:, 4],
        )  # fmt: skip
        assert np.array_equal(own, alone[kept])
    assert not np.array_equal(found[0], found[1])


def test_every_piece_of_shared_work_is_done_once_on_any_number_of_threads(threads):
    for count in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        threads(count)
        for pieces in (1, 2, 3, 17):
            done = np.zeros(pieces, int)

            def run(begin: int, end: int, done=done) -> None:
                done[begin:end] += 1

            share_out(run, pieces)
            assert np.array_equal(done, np.ones(pieces, int))
            share_out_all([(run, pieces), (run, 1)])
            assert np.array_equal(done, np.where(np.arange(pieces) == 0, 3, 2))


def test_states_warmed_along_a_run_are_those_of_the_run():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    numbers = numbers_with(replay, **WITH_STATES)
    _, states = replay.run(numbers, with_states=True)
    warm = replay.warm(
        numbers,
        current_A=states[:, 0],
        wheel_angle_rad=states[:, 1],
        wheel_velocity_rad_per_s=states[:, 2],
        load_angle_rad=states[:, 3],
        load_velocity_rad_per_s=states[:, 4],
    )
    scale = np.ptp(states, axis=0) + 1e-12
    assert np.ptp(warm[:, 13]) > 0.0
    assert np.abs((warm - states) / scale).max() < 2e-2


def test_a_flexible_link_warmed_along_a_run_swings_as_in_the_run():
    """Midpoint steps of a fifth of a radian err by a thousandth of the swing per cycle."""
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    link = LoadFlexibility(
        link_stiffness_Nm_per_rad=40.0, outer_fraction=0.5, link_damping_Nms_per_rad=0.05
    )
    numbers = replay.numbers(ActuatorModel(BENCH, (link,)))
    _, states = replay.run(numbers, with_states=True)
    names = ("current_A", "wheel_angle_rad", "wheel_velocity_rad_per_s", "load_angle_rad",
             "load_velocity_rad_per_s")  # fmt: skip
    warm = replay.warm(numbers, **{n: states[:, j] for j, n in enumerate(names)})
    link_at = STATE_NAMES.index("link_angle_rad")
    swing = states[:, link_at] - states[:, 3]
    assert np.ptp(swing) > 1e-4
    assert np.abs(warm[:, link_at] - states[:, link_at]).max() < 0.03 * np.ptp(swing)


def test_an_open_bridge_carries_no_current_and_a_measured_supply_replaces_the_rigs():
    inputs = Inputs(time_s=TIME, duty=np.full(TIME.size, 0.2))
    enabled = (TIME < 1.0).astype(float)
    rows = Replay.of(inputs, drive_enabled=enabled).run(MODEL)
    assert np.all(rows[TIME > 1.0015, 3] == 0.0)
    assert rows[900, 3] > 0.05
    constant = Replay.of(inputs, supply_V=np.full(TIME.size, 40.0)).run(MODEL)
    other = ActuatorModel(replace(BENCH, supply_voltage_V=40.0), MODEL.terms)
    assert np.array_equal(constant, Replay.of(inputs).run(other))


def test_numbers_out_of_range_stop_the_run_or_are_marked():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY), step_s=1e-3)
    good = replay.numbers(MODEL)
    bad = good.with_plant(load_inertia=1e-9)
    with pytest.raises(SimulationError, match=r"model 0: .* at t = "):
        replay.run(bad)
    with pytest.raises(SimulationError, match="model 1"):
        replay.run_many([good, bad])
    rows = replay.run_many([good, bad], failures="nan")
    assert np.all(np.isfinite(rows[0]))
    assert np.all(np.isnan(rows[1, -1]))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"command_name": "duti", "command": DUTY}, "duti"),
        ({"command_name": "duty", "command": DUTY[:5]}, "duty has shape"),
        ({"command_name": "duty", "command": DUTY, "step_s": 0.0}, "step_s"),
        ({"command_name": "duty"}, "together"),
        ({"command_name": "duty", "command": DUTY, "supply_V": DUTY[:4]}, "supply_V has shape"),
        ({"spring_deflection_rad": DUTY * np.nan}, "must be finite"),
        ({"spring_deflection_rad": DUTY, "command_name": "duty", "command": DUTY}, "alone"),
    ],
)
def test_unusable_columns_are_refused_in_one_line(columns, message):
    with pytest.raises(InputError, match=message) as refusal:
        Replay(time_s=TIME, **columns)
    assert "\n" not in str(refusal.value)


def test_windows_and_starts_outside_are_refused():
    replay = Replay.of(Inputs(time_s=TIME, duty=DUTY))
    start = replay.start_state(MODEL)
    with pytest.raises(InputError, match="windows must be"):
        replay.run_windows([MODEL], [(0, TIME.size)], start[None])
    with pytest.raises(InputError, match="start states"):
        replay.run(MODEL, start=start[:5])


REFERENCE = Reference(kind="step", amplitude_Nm=0.3, start_s=0.1)
LOCKED = Load(kind="locked")
SMOOTH = ActuatorModel(replace(BENCH, motor_encoder_counts_per_rev=None))
STEP_TIME = np.arange(1001) * 1e-3


def batch(gains, models=SMOOTH, **more):
    compiled = [PidTorque(kp=kp, ki=2.0 * kp).compile(SMOOTH, LOCKED) for kp in gains]
    return run_batch(
        models,
        compiled[0].function,
        np.array([each.parameters for each in compiled]),
        compiled[0].state,
        **{
            "time_s": STEP_TIME,
            "reference": REFERENCE.sample(STEP_TIME),
            "command_name": compiled[0].command_name,
            "load": LOCKED,
            "command_limit": compiled[0].command_limit,
        }
        | more,
    )


def test_a_batch_run_is_the_precise_closed_loop():
    controller = PidTorque(kp=4.0, ki=8.0)
    precise = simulate_closed_loop(SMOOTH, controller, REFERENCE, LOCKED, duration_s=1.0)
    result = batch([4.0], with_rows=True, delay_samples=controller.delay_samples)
    assert result.rows.shape == (1, 1001, 8)
    assert np.ptp(precise.torque_Nm) > 0.2
    assert np.abs(result.rows[0, :, 2] - precise.torque_Nm).max() < 5e-3
    judged = tracking_metrics(precise, REFERENCE)
    assert result.metric("rmse")[0] == pytest.approx(judged.rmse_Nm, rel=2e-3)
    assert result.metric("current_peak_A")[0] == pytest.approx(judged.current_peak_A, rel=1e-2)
    assert result.metric("command_peak")[0] == pytest.approx(judged.command_peak, rel=1e-2)


def test_batches_are_the_same_to_the_bit_on_any_number_of_threads_noise_included(threads):
    gains = np.linspace(1.0, 8.0, 11)
    noise = (1e-3, 1e-4, 5e-3)
    found = []
    for count in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        threads(count)
        found.append(batch(gains, noise=noise, seed=7).metrics)
    assert np.array_equal(*found, equal_nan=True)
    alone = batch(gains[3:4], noise=noise, seed=10).metrics[0]
    assert np.array_equal(alone, found[0][3], equal_nan=True)
    assert found[0].shape == (11, len(METRICS))
    assert np.unique(found[0][:, 0]).size == 11


def test_a_loop_that_leaves_the_numbers_is_named_and_bad_requests_are_refused():
    numbers = Replay.of(Inputs(time_s=TIME, duty=DUTY, load=LOCKED)).numbers(SMOOTH)
    wild = numbers.with_plant(damping=-2e3)
    with pytest.raises(SimulationError, match="run 0"):
        batch([4.0, 5.0], wild)
    assert batch([4.0, 5.0], wild, failures="nan").failed.all()
    with pytest.raises(InputError, match="metric 'rms'"):
        batch([4.0]).metric("rms")
    with pytest.raises(InputError, match="follow"):
        batch([4.0], follow="torque")
    with pytest.raises(InputError, match="2 models for 1"):
        batch([4.0], [SMOOTH, SMOOTH])
    with pytest.raises(InputError, match="reference of shape"):
        batch([4.0], reference=np.zeros((3, 3)))


def test_rig_without_a_drive_runs_as_a_free_pendulum():
    rig = Rig(
        name="p", parts=("load",), load_inertia_kgm2=0.03, load_mass_kg=0.3, load_distance_m=0.3
    )
    replay = Replay(time_s=TIME, initial_angles_rad=(0.0, 0.01))
    rows = replay.run(ActuatorModel(rig))
    w = np.sqrt(0.3 * 9.80665 * 0.3 / 0.03)
    np.testing.assert_allclose(rows[:, 1], 0.01 * np.cos(w * TIME), atol=1e-6)
