"""Errors of predictions follow the machine of the fit, and no common angle hides a deflection."""

import numpy as np
import pytest
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters, smooth, with_noise
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.tracks import initial_track
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case

ROW_s, ROWS, PARTS = 0.02, 900, 20
RESISTANCE_ohm, CONSTANT, STIFFNESS_Nm_per_rad = 2.6, 0.0975, 0.16
MOTOR_kgm2, LOAD_kgm2, DAMPING_Nms = 1.8e-4, 2.8e-3, 5e-4
NOISE_rad_per_s = 0.2


def coupled_drives(*, off: float = 1.0, load: float = LOAD_kgm2) -> Rig:
    """Two wheels on a soft spring (a resonance of 4.9 Hz, 12 % damped), with speeds logged."""
    return Rig(
        name="coupled drives", parts=("drive", "gear", "spring", "load"), gear_ratio=1.0,
        terminal_resistance_ohm=RESISTANCE_ohm, torque_constant_Nm_per_A=CONSTANT,
        back_emf_constant_Vs_per_rad=CONSTANT, motor_inertia_kgm2=MOTOR_kgm2,
        motor_viscous_Nms_per_rad=DAMPING_Nms, load_viscous_Nms_per_rad=DAMPING_Nms,
        spring_stiffness_Nm_per_rad=STIFFNESS_Nm_per_rad * off, load_inertia_kgm2=load,
        current_limit_A=50.0,
    )  # fmt: skip


def recorded(delay_rows: float) -> tuple[Recording, np.ndarray]:
    """Speeds under a random binary voltage that acts late, by exponentials; states (n, 4)."""
    rates = np.zeros((5, 5))  # wheel angle and speed, load angle and speed, voltage
    rates[0, 1] = rates[2, 3] = 1.0
    emf = CONSTANT**2 / RESISTANCE_ohm
    rates[1, :4] = [-STIFFNESS_Nm_per_rad, -DAMPING_Nms - emf, STIFFNESS_Nm_per_rad, 0.0]
    rates[1, 4] = CONSTANT / RESISTANCE_ohm
    rates[1] /= MOTOR_kgm2
    rates[3, :4] = [STIFFNESS_Nm_per_rad, 0.0, -STIFFNESS_Nm_per_rad, -DAMPING_Nms]
    rates[3] /= LOAD_kgm2
    part = expm(rates * ROW_s / PARTS)
    rng = np.random.default_rng(11)
    volts = np.repeat(rng.choice([-4.0, 4.0], ROWS // 6 + 1), 6)[:ROWS]
    late = np.concatenate([np.zeros(round(delay_rows * PARTS)), np.repeat(volts, PARTS)])
    states, x = np.zeros((ROWS, 4)), np.zeros(5)
    for row in range(ROWS):
        states[row] = x[:4]
        for p in range(PARTS):
            x[4] = late[row * PARTS + p]
            x = part @ x
    columns = {
        "time_s": ROW_s * np.arange(ROWS),
        "voltage_V": volts,
        "motor_velocity_rad_per_s": states[:, 1] + NOISE_rad_per_s * rng.standard_normal(ROWS),
        "load_velocity_rad_per_s": states[:, 3] + NOISE_rad_per_s * rng.standard_normal(ROWS),
    }
    recording = Recording(
        file="coupled.csv", load=Load(kind="free"), columns=columns, sample_time_s=ROW_s,
        initial_rest=True,
    )  # fmt: skip
    return recording, states


def test_a_late_command_is_found_on_a_lightly_damped_machine_whose_file_errs(tmp_path):
    """Errors about the file's machine are dependent, and the delay is not found with them."""
    recording, _ = recorded(delay_rows=3.5)
    case = axis_case(tmp_path, recording, rig=coupled_drives(off=0.93, load=1.07 * LOAD_kgm2))
    problem, h = MultistepProblem(case), Hypothesis(laws=nuisances(case))
    estimator, fit, horizon = parameters(problem, h, lambda _: None)
    nominal, laws = problem.values(h, fit.x)
    delay = next(v["delay_s"] for v in laws if "delay_s" in v)
    assert horizon is None
    assert delay == pytest.approx(3.5 * ROW_s, rel=0.02)
    # speeds under a voltage show torques in proportion to a free torque constant
    found = nominal["spring_stiffness_Nm_per_rad"] / nominal["load_inertia_kgm2"]
    assert found == pytest.approx(STIFFNESS_Nm_per_rad / LOAD_kgm2, rel=0.01)
    assert estimator.tempering > 0.7


def test_a_deflection_that_only_speeds_show_is_smoothed_again_and_again_to_itself(tmp_path):
    """No unknown torque is left: each round of smoothing must keep the motion of the round before.

    An absolute angle of large variance leaves the deflection to round-off.
    """
    recording, states = recorded(delay_rows=0.0)
    problem = MultistepProblem(axis_case(tmp_path, recording, rig=coupled_drives()))
    h = Hypothesis()
    x = problem.start(h)
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    for _ in range(6):
        smooth(estimator, h, x)
        estimator = with_noise(estimator, h, x)
    motion = estimator.tracks[0].motion
    deflection, true = (m[:, a] - m[:, b] for m, (a, b) in
                        ((motion, (k.TW, k.TL)), (states, (0, 2))))  # fmt: skip
    assert np.std(deflection - true) < 0.02 * np.std(true)


def test_the_errors_are_those_of_the_machine_fitted(tmp_path):
    recording, _ = recorded(delay_rows=0.0)
    problem = MultistepProblem(axis_case(tmp_path, recording, rig=coupled_drives(off=0.8)))
    h = Hypothesis()
    x = problem.start(h)
    at = problem.names(h).index("spring_stiffness_Nm_per_rad")
    x[at] += 1.0
    fitted = problem.values(h, x)[0]["spring_stiffness_Nm_per_rad"]
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    assert estimator.tracks[0].stiffness == pytest.approx(0.8 * STIFFNESS_Nm_per_rad)
    assert with_noise(estimator, h, x).tracks[0].stiffness == pytest.approx(fitted)
