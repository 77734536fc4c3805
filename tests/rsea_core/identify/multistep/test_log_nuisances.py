"""What belongs to a log is free in every hypothesis: the gear ratio's rounding, an offset."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.identify.multistep.log_nuisances import FILTER, RATIO, half_digit, nuisances
from rsea_core.terms.known import KnownTerm
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


@pytest.mark.parametrize(
    ("ratio", "expected"),
    [
        (42.57, 0.005 / 42.57),
        (1474.0, 0.5 / 1474.0),  # of a whole number the fourth digit
        (60.0, 0.005 / 60.0),
        (100.5, 0.05 / 100.5),
        (7.5, 0.0005 / 7.5),  # may be exact: four digits are taken for stated
        (2e-5, 5e-4 / 2.0),
        (1.0, 0.0),
        (61.72715379, 0.0),  # nine digits: no angle shows the tenth
    ],
)
def test_half_a_digit_is_that_of_the_last_one_stated(ratio, expected):
    assert half_digit(ratio) == pytest.approx(expected, rel=1e-12)


def test_the_rounding_is_free_only_where_both_angles_are_read(tmp_path):
    one = axis_recording(seed=1)
    both = replace(one, columns=one.columns | {"load_angle_rad": one.columns["motor_angle_rad"]})
    rig = replace(axis_rig(), gear_ratio=42.57)
    free = [{law.effect for law in nuisances(axis_case(tmp_path, r, rig=rig))} for r in (one, both)]
    assert [RATIO in effects for effects in free] == [False, True]


def test_an_amplifier_has_an_offset_where_its_command_is_zero(tmp_path):
    moved = axis_recording(seed=1)
    still = replace(moved, columns=moved.columns | {"current_command_A": 0.0 * moved.time_s})
    offset = nuisances(axis_case(tmp_path, still, rig=axis_rig()))[0]
    assert offset.effect == DriveOffset.effect
    assert offset.unknowns[0].high == pytest.approx(0.2 * axis_rig().current_limit_A)
    unstated = replace(axis_rig(), current_limit_A=None)
    laws = nuisances(axis_case(tmp_path, still, rig=unstated))
    assert DriveOffset.effect not in {law.effect for law in laws}


def test_an_offset_may_exceed_commands_that_are_small_for_the_drive(tmp_path):
    moved = axis_recording(seed=1)
    small = 1e-4 * moved.columns["current_command_A"]
    quiet = replace(moved, columns=moved.columns | {"current_command_A": small})
    highs = [nuisances(axis_case(tmp_path, r, rig=axis_rig()))[0].unknowns[0].high
             for r in (moved, quiet)]  # fmt: skip
    largest = float(abs(moved.columns["current_command_A"]).max())
    assert highs == pytest.approx([largest, 0.2 * axis_rig().current_limit_A])


def test_a_delay_that_the_rig_file_states_is_the_delays_centre_and_spread(tmp_path):
    delay = KnownTerm(term=DriveDelay(delay_s=0.015), stated=("delay_s",), tolerance=0.2)
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    free, stated = nuisances(case), nuisances(replace(case, known=(delay,)))
    assert [law.effect for law in free] == [law.effect for law in stated]
    (late,) = (law for law in stated if law.kind is DriveDelay)
    assert late.starts == ((0.015,),)
    assert (late.unknowns[0].log, late.unknowns[0].prior) == (True, 0.2)


def test_laws_that_the_rig_file_states_come_first(tmp_path):
    friction = KnownTerm(term=LoadFriction(coulomb_Nm=0.1), stated=("coulomb_Nm",))
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    first, *others = nuisances(replace(case, known=(friction,)))
    assert (first.effect, first.known) == ("load-friction", True)
    assert [w.key for w in others] == [w.key for w in nuisances(case)]


def test_a_logged_velocity_passes_two_filters_that_are_exact_for_a_ramp(tmp_path):
    """A ramp behind 1/(1 + s T) is t - T (1 - exp(-t/T)), and late by the sum of both times."""
    one = axis_recording(seed=1)
    speed = np.gradient(one["motor_angle_rad"], one.sample_time_s)
    columns = {k: v for k, v in one.columns.items() if k != "motor_angle_rad"}
    logged = replace(one, columns=columns | {"motor_velocity_rad_per_s": speed})
    laws = nuisances(axis_case(tmp_path, logged, rig=axis_rig()))
    (law,) = [law for law in laws if law.effect == FILTER]
    row = one.sample_time_s
    first, second, time_s = 1.7 * row, 0.6 * row, row * np.arange(40)
    where = RunConditions(index=0, file="", kind="free", ratio=1.0, session_s=0.0,
                          case_rise_K=0.0, time_s=time_s)  # fmt: skip

    def read(**values: float):
        trial = TrialMachine(plant=np.zeros(1), fx=np.zeros(1), stiffness=0.0)
        law.write(values, trial, where)
        ((_, change),) = trial.reads
        return change(time_s.copy())

    alone = time_s - first * (1.0 - np.exp(-time_s / first))
    assert np.allclose(read(time_s=first, second_time_s=0.0), alone, rtol=0.0, atol=1e-12)
    far = slice(30, None)  # where both exponentials are gone: the delay is the sum of the times
    both = read(time_s=first, second_time_s=second)[far]
    assert np.allclose(both, time_s[far] - first - second, rtol=0.0, atol=1e-6 * time_s[-1])
