"""What no fit sees: recordings held out, the last quarter without any, an end where one moves."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.hold_out import (
    beyond_chance,
    held_out,
    lower_beyond_chance,
    part_of,
    predicts_better,
    with_pause_shown,
    with_shared_recordings,
)
from rsea_core.identify.law_search.search import add_all, begun, laws_of
from rsea_core.identify.multistep.criteria import KEPT_RATIO, WORSE
from rsea_core.machine.inputs import Load
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.whole_runs import searched_axis


def locked(seed: int):
    return replace(axis_recording(seed=seed), load=Load(kind="locked"))


def test_a_part_keeps_its_times_and_starts_in_motion():
    r = axis_recording(seed=2)
    part = part_of(r, 300, 700)
    assert part.rows == 400
    assert part.time_s[0] == r.time_s[300]
    assert not part.initial_rest
    assert part_of(r, 0, 700).initial_rest


def test_recordings_held_out_stay_so_where_others_let_the_load_move(tmp_path):
    case = axis_case(tmp_path, axis_recording(seed=1), axis_recording(seed=2, role="validation"),
                     rig=axis_rig())  # fmt: skip
    assert with_shared_recordings(case) == (case, {})


def test_the_only_moving_recording_is_shared_and_its_end_stays_held_out(tmp_path):
    moving = axis_recording(seed=2, role="validation")
    case = axis_case(tmp_path, locked(1), moving, rig=axis_rig())
    shared, files = with_shared_recordings(case)
    assert files == {moving.file: "no other recording lets the load move"}
    fitted, unseen = shared.recordings[1:]
    assert (fitted.role, unseen.role) == ("identification", "validation")
    both = np.concatenate([fitted.time_s, unseen.time_s])
    assert np.array_equal(both, moving.time_s)
    assert fitted.rows == 2 * unseen.rows


def test_the_only_recording_with_a_contact_is_shared(tmp_path):
    wall = Load(kind="contact", contact_stiffness_Nm_per_rad=9.0, contact_angle_rad=0.1,
                contact_damping_Nms_per_rad=0.0)  # fmt: skip
    meets = replace(axis_recording(seed=2, role="validation"), load=wall)
    case = axis_case(tmp_path, axis_recording(seed=1), meets, rig=axis_rig())
    shared, files = with_shared_recordings(case)
    assert files == {meets.file: "no other recording includes a contact"}
    assert [r.role for r in shared.recordings] == ["identification"] * 2 + ["validation"]
    both = replace(case, recordings=(*case.recordings, replace(meets, role="identification")))
    assert with_shared_recordings(both)[1] == {}


def test_a_recording_that_is_not_predicted_is_shared(tmp_path):
    unpredicted = axis_recording(seed=2, role="validation")
    case = axis_case(tmp_path, axis_recording(seed=1), unpredicted, rig=axis_rig())
    shared, files = with_shared_recordings(case, [unpredicted.file])
    assert list(files) == [unpredicted.file]
    assert [r.role for r in shared.recordings] == ["identification"] * 2 + ["validation"]


@pytest.mark.parametrize("fitted", [1, 2])
def test_a_recording_held_out_shows_how_long_the_motor_rested_before_it(tmp_path, fitted):
    """Each recording was made cold; of several fitted ones the pause is fitted too, and stays."""
    warm = DriveThermal(
        winding_heat_capacity_J_per_K=0.1, winding_to_case_W_per_K=5e-3,
        case_heat_capacity_J_per_K=500.0, resistance_rise_per_K=3.93e-3,
        torque_constant_fall_per_winding_K=1.1e-3,
    )  # fmt: skip
    rig = replace(axis_rig(), terminal_resistance_ohm=1.0)
    recordings = [axis_recording(warm, seed=j, rig=rig) for j in range(fitted)]
    held_out = axis_recording(warm, seed=9, role="validation", rig=rig)
    found, own, plain = searched_axis(tmp_path, *recordings, held_out)
    law = next(w for w in laws_of(found) if w.key == "drive-thermal/winding, case and magnets")
    h = Hypothesis(laws=(*plain.hypothesis.laws, law))
    values = {"winding_heat_capacity_J_per_K": 0.1, "winding_time_s": 20.0, "pause_s": 1.0,
              "case_heat_capacity_J_per_K": 500.0,
              "torque_constant_fall_per_winding_K": 1.1e-3}  # fmt: skip
    begun = own.problem.start(Hypothesis(laws=(law,)), [[values[u.name] for u in law.unknowns]])
    count = len(own.problem.nominals)  # the rig file is right
    x = np.concatenate([begun[:count], plain.x[count:], begun[count:]])
    _, shown = with_pause_shown(found, (h, x), None)
    pause_s = own.problem.values(h, shown)[1][-1]["pause_s"]
    assert pause_s >= 300.0 if fitted == 1 else pause_s == pytest.approx(1.0)


def found_with(folder, term, key: str):
    """A law that was added, of two recordings fitted and one held out."""
    fitted = (axis_recording(term, seed=seed) for seed in (3, 4))
    held = axis_recording(term, seed=5, role="validation")
    found = begun(axis_case(folder, *fitted, held, rig=axis_rig()), None, lambda text: None)
    add_all(found, [law for law in laws_of(found) if law.key == key], lambda text: None)
    return found


def times(found, factor: float, last: int):
    """The search with its last values times a factor."""
    x = found.best.x.copy()
    x[-last:] *= factor
    return replace(found, best=replace(found.best, x=x))


@pytest.fixture(scope="module")
def cogging(tmp_path_factory):
    term = MotorCogging(amplitude_Nm=0.8, cycles_per_rev=7, phase_rad=0.8)
    return found_with(tmp_path_factory.mktemp("cogging"), term, "motor-cogging/7 per turn")


@pytest.mark.parametrize(("factor", "kept"), [(1.05, True), (-1.0, False)])
def test_a_law_whose_axis_stops_at_other_detents_is_refuted_only_if_short_windows_do(
    cogging, factor, kept
):
    found = times(cogging, factor, last=2)  # both waves
    assert held_out(found).gain < WORSE
    end, unseen = beyond_chance(found)
    assert end.steps
    assert (unseen.gain > 0.0) == kept
    assert (unseen.ratio > KEPT_RATIO) == kept


@pytest.fixture(scope="module")
def friction(tmp_path_factory):
    term = LoadFriction(coulomb_Nm=0.06)
    return found_with(tmp_path_factory.mktemp("friction"), term, "load-friction/coulomb")


@pytest.mark.parametrize(("factor", "better"), [(1.0, True), (-2.0, False), (5.0, False)])
def test_a_law_predicts_better_if_errors_of_recordings_held_out_are_smaller(
    friction, factor, better
):
    assert beyond_chance(friction)[0].steps
    assert predicts_better(times(friction, factor, last=1)) is better


OLD = np.array([4.0, 5.0, 6.0, 5.0])


@pytest.mark.parametrize(
    ("new", "old", "lower"),
    [
        (0.5 * OLD, OLD, True),
        (0.92 * OLD, OLD, False),  # 0.96 of the root mean square error
        (0.5 * OLD[::-1] + [0.0, 0.0, 0.0, 8.0], OLD, False),  # one window is far worse
        (OLD * [0.1, 0.9, 1.1, 0.9], OLD, False),  # lower by chance
        (0.3 * OLD * [1, 1, 1, 1e4], OLD * [1, 1, 1, 1e4], True),  # one window holds the error
        (0.3 * OLD[:2], OLD[:2], False),
        (0.2 * OLD[:2], OLD[:2], True),
        (OLD, OLD * np.inf, True),
        (OLD * np.nan, OLD, False),
        (OLD * np.nan, OLD * np.nan, False),
    ],
)
def test_errors_of_windows_are_lower_beyond_chance(new, old, lower):
    assert lower_beyond_chance(new, old) is lower
