"""What no fit sees: recordings held out, the last quarter without any, an end where one moves."""

from dataclasses import replace

import numpy as np

from rsea_core.identify.law_search.hold_out import part_of, with_shared_recordings
from rsea_core.machine.inputs import Load
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


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
