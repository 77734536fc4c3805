"""Whitened innovations, screening and fits on machines whose missing physics is planted."""

from dataclasses import replace

import numpy as np
import pytest
from rsea_core.identify.candidates.figures import loop

import rsea_core.machine.quantities as q
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import DriveDelay, GearFriction, LoadFriction
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.screening import screen
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

RIG = Rig(
    name="planted",
    supply_voltage_V=48.0,
    terminal_resistance_ohm=3.8,
    terminal_inductance_H=4.5e-3,
    torque_constant_Nm_per_A=0.37,
    back_emf_constant_Vs_per_rad=0.31,
    current_limit_A=6.0,
    motor_inertia_kgm2=3.2e-4,
    motor_viscous_Nms_per_rad=1e-4,
    gear_ratio=60.0,
    output_inertia_kgm2=2e-3,
    output_viscous_Nms_per_rad=0.02,
    spring_stiffness_Nm_per_rad=65.0,
    load_mass_kg=0.3,
    load_distance_m=0.3,
    load_inertia_kgm2=0.03,
    load_viscous_Nms_per_rad=0.02,
    gravity_angle_offset_rad=0.0,
    motor_encoder_counts_per_rev=8192,
    load_encoder_counts_per_rev=8192,
    torque_sensor_noise_Nm=0.02,
    current_sensor_noise_A=0.005,
)


def recording(terms, load: str, name: str, seed: int, rig: Rig = RIG) -> Recording:
    """A noisy reading of the fast engine, 4 s at 500 Hz, with a bridge of wandering gain."""
    rng = np.random.default_rng(seed)
    t = 0.002 * np.arange(2000)
    duty = 0.08 * np.sin(2 * np.pi * 0.4 * t) if load == "locked" else sum(
        0.07 * np.sin(2 * np.pi * f * t + f) for f in (0.7, 1.9, 4.1, 7.3)
    )  # fmt: skip
    duty = np.round(duty, 5)
    wander = 3e-4 * np.sin(2 * np.pi * 0.13 * t + seed)
    inputs = Inputs(time_s=t, duty=duty * (1.0 + wander), load=Load(kind=load))
    out = Replay.of(inputs).run(ActuatorModel(rig, terms))
    count = 2 * np.pi / 8192
    columns = {
        "time_s": t,
        "duty": duty,
        "motor_angle_rad": q.quantise_angle(out[:, 0] + 0.3 * count, 8192),
        "load_angle_rad": q.quantise_angle(out[:, 1] + 0.3 * count, 8192),
        "current_A": out[:, 3] + 0.005 * rng.standard_normal(t.size),
        "torque_Nm": out[:, 2] + 0.02 * rng.standard_normal(t.size),
    }
    return Recording(file=name, load=Load(kind=load), columns=columns, sample_time_s=0.002)


def planted(tmp_path, *terms, rig: Rig = RIG) -> Problem:
    made = tuple(
        recording(terms, load, f"{load}.csv", seed, rig)
        for seed, load in ((1, "locked"), (2, "pendulum"))
    )
    case = Case(name="planted", folder=tmp_path, rig=RIG, recordings=made)
    return Problem(case, step_s=1e-3)


def test_innovations_of_the_true_machine_are_noise_of_unit_power(tmp_path):
    problem = planted(tmp_path)
    plain = Hypothesis()
    _, power, found = Fitter(problem).evaluate(plain, problem.start(plain)[None])
    assert np.all(power < 1.3)
    e = found[1][0, 50:, problem.benches[1].channels.index("torque_Nm")]
    assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 0.1
    assert np.std(e) == pytest.approx(1.0, abs=0.1)


def test_wrong_parameters_are_found_and_nothing_is_left(tmp_path):
    true = replace(RIG, spring_stiffness_Nm_per_rad=60.0, motor_inertia_kgm2=3.5e-4)
    problem = planted(tmp_path, rig=true)
    plain = Hypothesis()
    fit = Fitter(problem, far=10.0).fit(plain, problem.start(plain), iterations=20)
    nominal, _ = problem.values(plain, fit.x)
    assert nominal["spring_stiffness_Nm_per_rad"] == pytest.approx(60.0, rel=0.005)
    assert nominal["motor_inertia_kgm2"] == pytest.approx(3.5e-4, rel=0.03)
    assert np.all(fit.power < 1.3)


PLANTED = {
    "gear-friction": (GearFriction(coulomb_Nm=0.02), {"gear-friction"}),
    "load-friction": (LoadFriction(coulomb_Nm=0.04), {"load-friction"}),
    # at one sample late a delay of the command and one of every sensor are the same thing
    "drive-delay": (DriveDelay(delay_s=0.006), {"drive-delay", "sensor-delay"}),
}


@pytest.mark.parametrize("effect", PLANTED)
def test_screening_puts_a_planted_effect_first(tmp_path, effect):
    term, expected = PLANTED[effect]
    problem = planted(tmp_path, term)
    fitter = Fitter(problem, far=10.0)
    plain = Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    laws = [
        law
        for law in catalogue(problem.case).values()
        if law.effect not in ("motor-cogging", "load-flexibility", "sensor-drift")
    ]
    found = screen(fitter, plain, fit.x, laws, tempering=1.0 / max(1.0, fit.power.mean()))
    assert found[0].law.effect in expected, [c.law.key for c in found[:4]]


def test_a_planted_coulomb_friction_is_fitted_to_its_value(tmp_path):
    problem = planted(tmp_path, GearFriction(coulomb_Nm=0.02))
    law = catalogue(problem.case)["gear-friction/coulomb"]
    hypothesis = Hypothesis(laws=(law,))
    fitter = Fitter(problem, far=10.0)
    fit = fitter.fit(hypothesis, problem.start(hypothesis, [(0.01,)]), iterations=10)
    _, (values,) = problem.values(hypothesis, fit.x)
    assert values["coulomb_Nm"] == pytest.approx(0.02, rel=0.03)
    assert np.all(fit.power < 1.6)


def test_the_loop_of_one_slip_is_a_parallelogram():
    """Width 2 k y and energy 4 k y (A - y) for an element that yields at y within A."""
    law = laws_by_key()["spring-hysteresis/one slip"]
    width, energy = loop(law, {"stiffness_1_Nm_per_rad": 20.0, "yield_1_rad": 0.03})
    assert width == pytest.approx(2 * 20.0 * 0.03, rel=1e-3)
    assert energy == pytest.approx(4 * 20.0 * 0.03 * (0.15 - 0.03), rel=2e-2)
