"""Cogging of many cycles in a turn is tried where motors have it and rows of the log show it."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.motor_cogging import MANY_CYCLES, MotorCogging
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.order_analysis import along_motion
from rsea_core.identify.law_search.screening import Projection, screen, screen_again
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.identify.whole_runs.search import WholeSearch
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.whole_runs import found_by_parameters

SLOW_RIG = replace(axis_rig(), load_inertia_kgm2=0.2, load_viscous_Nms_per_rad=0.2)


@pytest.mark.parametrize(
    ("motor", "cycles"),
    [("9 slots, 8 poles", 72), ("12 slots, 14 poles", 84), ("36 slots, 42 poles", 252),
     ("50 teeth, two phases", 200)],
)  # fmt: skip
def test_the_numbers_tried_are_those_of_motors(motor, cycles):
    assert cycles in MANY_CYCLES


def test_a_number_is_tried_only_where_two_rows_are_in_a_cycle(tmp_path):
    typical = own_magnitudes(axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig()))
    largest = []
    for rows_in_cycle in (1.9, 2.1):  # of 100 cycles in a turn
        row_s = 2.0 * np.pi / (100 * typical.speed_rad_per_s) / rows_in_cycle
        laws = MotorCogging.candidates(replace(typical, row_s=row_s))
        tried = {law.starts[0][2] for law in laws} & set(MANY_CYCLES)
        assert tried == {c for c in MANY_CYCLES if c <= max(tried)}
        largest.append(max(tried))
    assert largest == [90, 100]


def test_cogging_of_twelve_slots_and_fourteen_poles_is_found_along_the_recorded_motion(tmp_path):
    """The simulated angle errs by cycles: a screening with the engine prefers other numbers."""
    amplitude_Nm, phase_rad = 0.05, 0.7
    cogging = MotorCogging(amplitude_Nm=amplitude_Nm, cycles_per_rev=84.0, phase_rad=phase_rad)
    case = axis_case(tmp_path, axis_recording(cogging, seed=1, rig=SLOW_RIG), rig=SLOW_RIG)
    estimator, base, _ = parameters_with_timing(
        case, Hypothesis(laws=nuisances(case)), lambda text: None
    )
    own = in_sensor_noise(estimator)
    plain = own.fit(base.hypothesis, base.x, iterations=12)
    found = found_by_parameters(estimator, base)
    search = WholeSearch(own, plain, found, laws_of(found), 1.6)
    engine = [w for w in search.laws if w.effect == MotorCogging.effect and len(w.unknowns) == 3]
    screened = screen(own, plain, [replace(w, follows=False) for w in engine])
    assert screen_again(own, plain, screened)[0].law.key != "motor-cogging/84 per turn"
    first = along_motion(Projection(own, plain), search.laws)[0]
    assert first.law.key == "motor-cogging/84 per turn"
    sine, cosine, _cycles = first.start
    assert np.hypot(sine, cosine) == pytest.approx(amplitude_Nm, rel=0.1)
    assert np.arctan2(cosine, sine) == pytest.approx(phase_rad, abs=0.2)
    best = search.trials()[0]
    assert best.law is first.law
    assert best.left < 1.2
