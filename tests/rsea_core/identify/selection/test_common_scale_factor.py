"""A sensor's wrong scale is told from the constants that could imitate it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.registry import MotorCogging
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.rig_parameters import TOLERANCES
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.fitting.jacobian import moved_along, torque_factor
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.alternatives import variance_of_difference
from rsea_core.identify.selection import common_scale_factor
from rsea_core.identify.selection.criteria import SCALE_LOG_ODDS, Search, SharedFactor
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.bench_recordings import WITHOUT_ANCHORS, multisine, recorded
from tests.cases.planted import RIG, fit_at, planted

TIME = np.arange(1500) * 2e-3
SCALE = 1.25
WEIGHING = (
    "torque_constant_Nm_per_A", "motor_inertia_kgm2", "motor_viscous_Nms_per_rad",
    "output_inertia_kgm2", "output_viscous_Nms_per_rad", "spring_stiffness_Nm_per_rad",
    "load_mass_kg", "load_inertia_kgm2", "load_viscous_Nms_per_rad",
)  # fmt: skip


def found(tmp_path, machine, scale, column="torque_Nm"):
    recordings = []
    for k, duty in enumerate((multisine(TIME), 0.12 * np.sin(4.4 * TIME))):
        _, columns = recorded(
            ActuatorModel(machine, ()), TIME, Load(), sensors=("current_A", "torque_Nm"), seed=k,
            duty=duty,
        )  # fmt: skip
        columns = dict(columns) | {column: scale * columns[column]}
        recordings.append(
            Recording(file=f"rec{k}.csv", role="identification", columns=columns,
                      sample_time_s=2e-3)
        )  # fmt: skip
    case = Case(name="scaled", folder=tmp_path, rig=WITHOUT_ANCHORS, recordings=tuple(recordings))
    return diagnose(case, quick=True).document


def test_a_scale_error_of_the_torque_sensor_is_named_and_no_constant_pays_for_it(tmp_path):
    document = found(tmp_path, WITHOUT_ANCHORS, SCALE)
    assert [e["name"] for e in document["effects"]] == ["sensor-scale"]
    effect = document["effects"][0]
    assert document["verdict"] == "missing-physics"
    assert effect["subsystem"] == document["location"]["subsystem"] == "sensor:torque_Nm"
    scale = effect["parameters"]["scale"]
    assert abs(scale["value"] - SCALE) < 2.0 * scale["std"] < 0.2
    for key in ("torque_constant_Nm_per_A", "spring_stiffness_Nm_per_rad", "load_mass_kg"):
        value = document["parameters_corrected"][key]
        assert abs(value["to"] - value["from"]) < 2.0 * value["std"] + 1e-3 * value["from"]


@pytest.mark.parametrize(("column", "scale"), [("current_A", 0.88), ("torque_Nm", 1.07)])
def test_a_scale_that_tolerances_forgive_is_named_for_the_factor_that_constants_share(
    tmp_path, column, scale
):
    document = found(tmp_path, WITHOUT_ANCHORS, scale, column)
    assert document["verdict"] == "missing-physics"
    (effect,) = document["effects"]
    assert (effect["name"], effect["subsystem"]) == ("sensor-scale", f"sensor:{column}")
    assert effect["parameters"]["scale"]["value"] == pytest.approx(scale, abs=0.01)
    assert "share a common factor" in document["summary"]
    assert any("leaves the same readings" in finding for finding in document["findings"])
    value = document["parameters_corrected"]["torque_constant_Nm_per_A"]
    assert value["to"] == pytest.approx(value["from"], rel=0.01)


OWN = {
    "terminal_resistance_ohm": 0.02, "terminal_inductance_H": -0.01,
    "torque_constant_Nm_per_A": 0.01, "back_emf_constant_Vs_per_rad": -0.01,
    "motor_inertia_kgm2": 0.02, "spring_stiffness_Nm_per_rad": -0.02, "load_mass_kg": 0.003,
    "load_inertia_kgm2": -0.005, "load_viscous_Nms_per_rad": 0.05,
}  # fmt: skip
CURRENT = ("terminal_resistance_ohm", "terminal_inductance_H", "torque_constant_Nm_per_A")


def odds(cause, line):
    constants = [SimpleNamespace(key=key, tolerance=TOLERANCES[key]) for key in OWN]
    moves = [(OWN[c.key] + cause.get(c.key, 0.0)) / c.tolerance for c in constants]
    along = [float(c.key in line) / c.tolerance for c in constants]
    problem = SimpleNamespace(nominals=constants)
    return common_scale_factor.scale_odds(
        problem, np.array(moves), np.full(len(OWN), 0.05), np.array(along)
    )


def test_another_winding_is_no_scale_of_the_current_and_another_load_none_of_the_torque():
    log_odds, _, factor = odds(dict.fromkeys(CURRENT, 0.12), CURRENT)
    assert log_odds > SCALE_LOG_ODDS
    assert factor == pytest.approx(0.12, abs=0.02)
    winding = dict.fromkeys(CURRENT[:2], 0.2) | {CURRENT[2]: 0.1, list(OWN)[3]: 0.1}
    assert odds(winding, CURRENT)[0] < 0.0
    torques = [key for key in OWN if key in WEIGHING]
    assert odds(dict.fromkeys(torques, 0.1), torques)[0] > SCALE_LOG_ODDS
    assert odds({"load_mass_kg": 0.1, "load_inertia_kgm2": 0.1}, torques)[0] < 0.0


def test_what_cannot_be_distinguished_from_a_scale_is_reported_and_not_named():
    fit = SimpleNamespace(hypothesis=Hypothesis())
    some = SharedFactor(column="current_A", log_odds=4.0, alone=4.0, factor=-0.1, constants=CURRENT)

    def reported(shared):
        return common_scale_factor.scale_sentence(SimpleNamespace(shared=shared), fit)

    assert "current_A in a scale of 0.905" in reported(some)
    assert "50 times less likely, not enough" in reported(some)
    assert reported(replace(some, log_odds=1.0, alone=1.0)) is None
    assert reported(replace(some, log_odds=-5.0)) is None


def test_two_wrong_constants_are_not_taken_for_the_scale_of_a_reading(tmp_path):
    machine = replace(
        WITHOUT_ANCHORS,
        torque_constant_Nm_per_A=1.3 * WITHOUT_ANCHORS.torque_constant_Nm_per_A,
        spring_stiffness_Nm_per_rad=1.6 * WITHOUT_ANCHORS.spring_stiffness_Nm_per_rad,
    )
    document = found(tmp_path, machine, 1.0)
    assert document["verdict"] == "parameters-only"


def test_a_torque_sensors_scale_is_found_where_differences_say_nothing(tmp_path, monkeypatch):
    factor, key = 1.2, "sensor-scale/factor@torque_Nm"
    heavier = {name: factor * getattr(RIG, name) for name in WEIGHING}
    wave = MotorCogging(amplitude_Nm=0.02 * factor, cycles_per_rev=7.0)
    problem = planted(tmp_path, wave, rig=replace(RIG, **heavier))
    fitter, laws = Fitter(problem, far=10.0), catalogue(problem.case)
    both = Hypothesis(laws=(laws["motor-cogging/7 per turn"], laws[key]))
    x = problem.start(both, ((0.02, 0.0, 7.0), (1.0,)))
    at_one = fit_at(problem, fitter, ("motor-cogging/7 per turn", key), x)
    away = moved_along(problem, at_one, torque_factor(fitter, at_one), np.log(factor) / 0.01)
    base = fit_at(problem, fitter, ("motor-cogging/7 per turn",), away[:-1])
    assert np.all(base.msni < 1.3), "constants alone explain the scale error"
    thrown = SimpleNamespace(law=laws[key], shift=np.full(base.x.size, 3.0), size=1.0)
    monkeypatch.setattr(common_scale_factor, "screen", lambda *_, **__: [thrown])
    search = Search(problem=problem, fitter=fitter, nominal_msni=base.msni, parameters=base)
    fit = common_scale_factor.reading_scale(search, base, laws, lambda _: None)
    nominal, (_, scale) = problem.values(fit.hypothesis, fit.x)
    assert scale["scale"] == pytest.approx(factor, rel=0.02)
    for name in ("torque_constant_Nm_per_A", "spring_stiffness_Nm_per_rad", "load_mass_kg"):
        assert nominal[name] == pytest.approx(getattr(RIG, name), rel=0.02)


def test_a_run_begins_at_the_true_angle_where_the_encoders_scale_is_wrong(tmp_path):
    scale, t = 0.9, 0.002 * np.arange(1500)
    inputs = Inputs(time_s=t, duty=0.0 * t, load=Load(kind="pendulum"), initial_load_angle_rad=0.15)
    out = Replay.of(inputs).run(ActuatorModel(RIG, ()))
    rng = np.random.default_rng(1)
    count = 2 * np.pi / 8192
    read = {"time_s": t, "duty": inputs.duty}
    for name, factor, grid, noise in (
        ("motor_angle_rad", 1.0, count, 0.0), ("load_angle_rad", scale, count, 0.0),
        ("current_A", 1.0, 1e-3, 0.005), ("torque_Nm", 1.0, 1e-3, 0.02),
    ):  # fmt: skip
        clean = factor * out[:, CHANNELS.index(name)] + noise * rng.standard_normal(t.size)
        read[name] = grid * np.round(clean / grid)
    made = Recording(file="let-go.csv", role="identification", columns=read,
                     sample_time_s=2e-3, load=Load(kind="pendulum"))  # fmt: skip
    case = Case(name="let go", folder=tmp_path, rig=RIG, recordings=(made,))
    problem = Problem(case, step_s=1e-3)
    fitter, key = Fitter(problem, far=10.0), "sensor-scale/factor@load_angle_rad"
    law = Hypothesis(laws=(catalogue(case)[key],))
    assert np.all(fit_at(problem, fitter, (key,)).msni > 50.0)
    assert np.all(fit_at(problem, fitter, (key,), problem.start(law, ((scale,),))).msni < 1.3)


def test_errors_of_distances_are_those_of_repeated_recordings():
    rng = np.random.default_rng(5)
    blocks, length, trials = 400, 20, 3000
    slow = np.repeat(rng.standard_normal((trials, 2, blocks // 4)), 4, axis=2)
    own = rng.standard_normal((trials, 2, blocks)) + slow
    shared = rng.standard_normal((trials, 1, blocks))
    squares = (shared + own * np.array([1.0, 1.6])[:, None]) ** 2
    apart = np.diff(np.log(squares.mean(axis=2)), axis=1)[:, 0]
    reported = [variance_of_difference(pair, length)[0] for pair in squares]
    assert np.mean(reported) == pytest.approx(np.var(apart), rel=0.12)
