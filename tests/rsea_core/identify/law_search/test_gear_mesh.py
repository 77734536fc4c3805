"""Backlash in a train without a spring: the gear's mesh stands for the spring that it lacks."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.investigate import investigate
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.gear_mesh import (
    as_effect,
    encoders_disagree,
    first_laws,
    shows_lost_motion,
    with_gear_mesh,
)
from rsea_core.identify.multistep.criteria import SEARCH_STEPS
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters, with_fine_steps
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.whole_runs.complete import confirmed_by_whole_runs
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.recordings.case import Case, read_case

ROW_s, ROWS, FINER = 2e-3, 1500, 200
RATIO, MOTOR, LOAD, DAMPING = 50.0, 4e-3, 3e-3, 8e-3  # both inertias at the output, kgm2, Nms/rad
WIDTH = 0.04  # rad at the output
CONSTANT, OHM, VOLTS = 0.02, 2.5, 12.0
RIG = f"""[rig]
name = "train"
parts = ["drive", "gear", "load"]
supply_voltage_V = {VOLTS}
terminal_resistance_ohm = {OHM}
torque_constant_Nm_per_A = {CONSTANT}
back_emf_constant_Vs_per_rad = {CONSTANT}
motor_inertia_kgm2 = {MOTOR / RATIO**2}
motor_viscous_Nms_per_rad = {DAMPING / RATIO**2}
gear_ratio = {RATIO}
load_inertia_kgm2 = {LOAD}
load_viscous_Nms_per_rad = 1e-4
motor_encoder_counts_per_rev = 2048
load_encoder_counts_per_rev = 4096

[[recording]]
file = "a.csv"
load = "free"
"""


def simulated(width: float, dead_zone: float = 0.0) -> np.ndarray:
    """Duty and true angles of motor and load (n, 3): two bodies, teeth with a damper, by hand."""
    time = np.arange(ROWS) * ROW_s
    duty = 0.3 * np.sin(2 * np.pi * 0.7 * time) + 0.2 * np.sin(2 * np.pi * 1.9 * time + 1.0)
    stiff = LOAD * (2 * np.pi * 60.0) ** 2
    drag, h = 0.2 * math.sqrt(stiff * LOAD), ROW_s / FINER
    motor = load = motor_speed = load_speed = 0.0
    out = np.zeros((ROWS, 3))
    for row, u in enumerate(duty):
        out[row] = u, motor * RATIO, load
        for _ in range(FINER):
            twist, rate = motor - load, motor_speed - load_speed
            beyond = max(abs(twist) - 0.5 * width, 0.0)
            teeth = math.copysign(max(stiff * beyond, 0.0), twist) + (
                drag * rate if beyond else 0.0
            )
            acting = math.copysign(max(abs(u) - dead_zone, 0.0), u)
            current = (acting * VOLTS - CONSTANT * RATIO * motor_speed) / OHM
            motor_speed += h * (CONSTANT * RATIO * current - DAMPING * motor_speed - teeth) / MOTOR
            load_speed += h * (teeth - 1e-4 * load_speed) / LOAD
            motor, load = motor + h * motor_speed, load + h * load_speed
    return out


def recorded(folder, width: float, dead_zone: float = 0.0) -> Case:
    """The case of a train, read by counts."""
    duty, motor, load = simulated(width, dead_zone).T
    steps = 2 * np.pi / np.array([2048, 4096])
    read = np.round(np.stack([motor, load], axis=1) / steps + 0.3) * steps
    table = np.column_stack([np.arange(ROWS) * ROW_s, duty, read])
    names = "time_s,duty,motor_angle_rad,load_angle_rad"
    np.savetxt(folder / "a.csv", table, delimiter=",", header=names, comments="")
    (folder / "rig.toml").write_text(RIG)
    return read_case(folder)


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    """The train with backlash, and without."""
    return {width: recorded(tmp_path_factory.mktemp("train"), width) for width in (WIDTH, 0.0)}


def silent(_text):
    pass


def parameters_alone(case, more=()) -> Found:
    h = Hypothesis(laws=(*nuisances(case), *more))
    own, base, horizon = parameters(MultistepProblem(case), h, silent)
    own, base = with_fine_steps(own, base, silent, per_cycle=SEARCH_STEPS)  # as the search of laws
    return Found(problem=own.problem, base_estimator=own, base=base, estimator=own, best=base,
                 horizon=horizon)  # fmt: skip


def test_encoders_of_a_rigid_train_disagree_with_backlash_alone(cases):
    assert encoders_disagree(parameters_alone(cases[WIDTH]))
    assert not encoders_disagree(parameters_alone(cases[0.0]))


@pytest.mark.parametrize("amplitude", [0.0, 0.01])
def test_the_readings_of_a_rigid_train_show_lost_motion_and_not_a_transmission_error(
    cases, amplitude
):
    for width, case in cases.items():
        (recording,) = case.recordings
        wheel = recording["motor_angle_rad"] / RATIO
        moved = recording["load_angle_rad"] + amplitude * np.sin(2.0 * wheel + 0.4)
        columns = dict(recording.columns) | {"load_angle_rad": moved}
        assert shows_lost_motion(
            replace(case, recordings=(replace(recording, columns=columns),))
        ) == (width > 0.0)


def test_the_mesh_with_both_inertias_has_a_mode_of_four_rows(cases):
    elastic, (damper,) = with_gear_mesh(cases[WIDTH])
    stiffness = elastic.rig.spring_stiffness_Nm_per_rad
    mode_Hz = math.sqrt(stiffness * (1 / MOTOR + 1 / LOAD)) / (2 * math.pi)
    assert mode_Hz == pytest.approx(1.0 / (4 * ROW_s))
    assert damper.nuisance
    assert elastic.rig.has("spring")
    assert not cases[WIDTH].rig.has("spring")


def test_a_model_with_a_mesh_is_read_again(cases, tmp_path):
    elastic, (damper,) = with_gear_mesh(cases[WIDTH])
    values = {"damping_Nms_per_rad": 0.1}
    model = FoundModel(rig=elastic.rig, contact={}, laws=((as_effect(damper), values),),
                       ambient_C=25.0)  # fmt: skip
    path = tmp_path / "model.toml"
    path.write_text(model.to_toml(), encoding="utf-8")
    ((law, read),) = FoundModel.from_toml(path).laws
    assert (law.effect, law.law, read) == ("spring-viscoelastic", "damper", values)


def test_laws_of_the_rigid_train_are_compared_with_a_search_through_the_mesh(cases):
    elastic, mesh = with_gear_mesh(cases[WIDTH])
    rigid, meshed = parameters_alone(cases[WIDTH]), parameters_alone(elastic, mesh)
    assert rigid.best.x.size != meshed.best.x.size
    nearly = replace(rigid, estimator=in_sensor_noise(rigid.base_estimator, rigid.base))
    found = replace(meshed, left_by_parameters=30.0)
    assert confirmed_by_whole_runs(found, nearly, silent) is nearly


def test_no_mesh_joins_a_body_without_inertia(cases):
    case = cases[WIDTH]
    rig = SimpleNamespace(**{name: getattr(case.rig, name) for name in ("gear_ratio", "has")})
    rig.motor_inertia_kgm2, rig.output_inertia_kgm2, rig.load_inertia_kgm2 = 1e-6, 0.0, None
    assert with_gear_mesh(SimpleNamespace(rig=rig)) is None


def test_backlash_before_the_mesh_predicts_what_no_rigid_train_does(cases):
    elastic, damper = with_gear_mesh(cases[WIDTH])
    rigid, whole = parameters_alone(cases[WIDTH]), parameters_alone(elastic, damper)
    law = next(
        law for law in first_laws(list(catalogue(elastic, relative=True).values()))
        if law.law == "play"
    )  # fmt: skip
    assert law.effect == GearBacklash.effect
    h = Hypothesis(laws=(*whole.base.hypothesis.laws, law))
    start = np.append(whole.base.x, 0.8 * WIDTH / law.unknowns[0].scale)
    fit = whole.estimator.fit(h, start)
    width = fit.x[-1] * law.unknowns[0].scale
    # the mesh's damper acts in the gap too, whatever the engine's step: 4 to 7 % low
    assert width == pytest.approx(WIDTH, rel=0.1)

    def error(estimator, hypothesis, x):
        return np.sqrt(np.mean(estimator.residuals([(hypothesis, x)])[0][0][:, 1] ** 2))

    before = error(rigid.estimator, rigid.base.hypothesis, rigid.base.x)
    assert fit.cost < whole.base.cost - 500.0  # units of log-likelihood, beside the elastic mesh
    # a rigid train errs by that wherever the load stands in its play (uniform distribution)
    assert error(whole.estimator, h, fit.x) < WIDTH / math.sqrt(12.0) < before


def test_backlash_is_found_with_a_dead_zone_that_explains_nearly_all(tmp_path):
    """The dead zone moves both angles by far more than the play between them."""
    found = investigate(recorded(tmp_path, WIDTH, dead_zone=0.06))
    assert {step.law.effect for step in found.steps} == {"drive-dead-zone", "gear-backlash"}
    values = found.problem.values(found.best.hypothesis, found.best.x)[1]
    (zone,) = [v["width_duty"] for v in values if "width_duty" in v]
    (width,) = [v["width_rad"] for v in values if "width_rad" in v]
    assert zone == pytest.approx(0.06, rel=0.03)
    assert width == pytest.approx(WIDTH, rel=0.15)  # the mesh's damper acts in the gap too


def test_the_error_of_a_rigid_train_is_taken_at_the_motors_angle_as_read(cases):
    problem = MultistepProblem(cases[0.0])
    (experiment,) = problem.fitted
    law = catalogue(cases[0.0], relative=True)["gear-transmission-error/worm"]
    h, amplitude = Hypothesis(laws=(law,)), 2e-4
    x = problem.start(h, [(amplitude, 0.0, 0.0)])
    x[0] += 3.0  # a machine that moves otherwise than the one recorded
    motor, load = problem.predict(experiment, h, x[None])[0].T
    read = experiment.measured[:, 0]
    assert np.max(np.abs(motor - read)) > 1.0  # a turn of the wave is 6.3 rad
    np.testing.assert_allclose(load - motor / RATIO, amplitude * np.sin(read), atol=1e-9)
