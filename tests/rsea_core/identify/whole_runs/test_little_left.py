"""Parameters that leave little more than noise: a law that explains it, or none."""

import numpy as np
import pytest

from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain
from rsea_core.effects.load_drag import LoadDrag
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.search import begun
from rsea_core.identify.multistep.criteria import LEAST_EXCESS, SOUND
from rsea_core.identify.whole_runs.complete import with_whole_runs
from rsea_core.identify.window_formula import command_formula_of
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig


def searched(folder, recording: Recording) -> Found:
    case = axis_case(folder, recording, rig=axis_rig())
    return with_whole_runs(begun(case, None, lambda _: None), lambda _: None)[0]


def test_a_drag_that_leaves_less_than_two_deviations_is_found(tmp_path):
    drag = LoadDrag(torque_at_5_rad_per_s_Nm=4e-5)
    found = searched(tmp_path, axis_recording(drag, seed=1))
    assert 1.1 < found.left_by_parameters < SOUND
    assert found.sound
    assert found.complete
    assert [step.law.effect for step in found.steps] == [LoadDrag.effect]


def test_a_sound_machine_leaves_no_more_than_noise_costs(tmp_path):
    found = searched(tmp_path, axis_recording(seed=1))
    assert found.excess < LEAST_EXCESS
    assert not found.beyond_noise
    assert not found.steps


def test_noise_that_no_law_explains_leaves_a_sound_machine_without_a_law(tmp_path):
    recording = axis_recording(seed=1)
    rng = np.random.default_rng(5)
    slow = np.convolve(rng.standard_normal(recording.rows + 40), np.ones(41) / 41, mode="valid")
    read = recording["motor_angle_rad"] + 2.5e-3 * slow
    shaken = Recording(
        file=recording.file, load=recording.load, sample_time_s=ROW_s,
        columns={**recording.columns, "motor_angle_rad": read},
    )  # fmt: skip
    found = searched(tmp_path, shaken)
    assert found.beyond_noise
    assert not found.complete
    assert not found.steps


def test_a_gain_that_differs_by_sign_is_a_formula_of_a_command_of_two_levels(tmp_path):
    gain = DriveNonlinearGain(by_sign=-0.03)
    found = searched(tmp_path, axis_recording(gain, seed=1, two_levels=True))
    formula = command_formula_of(found, lambda _: None)
    assert formula is not None
    sign, size, square = formula.deviations
    assert formula.term.by_sign == pytest.approx(-0.03, abs=3.0 * sign)
    assert sign < 0.003
    assert min(size, square) > 0.01  # the two levels do not show them
