"""A ranking holds only loops that settle, and an interrupted run resumes only its own inputs."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import FuzzyTorque, HybridImpedance, PidTorque
from rsea_core.control.stability.oscillation import oscillation
from rsea_core.control.tuning.bootstrap import paired, pareto
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import ComparedController, Comparison
from rsea_core.control.tuning.robustness import agreeing_engine, perturbed_models
from rsea_core.control.tuning.search_record import Search
from rsea_core.control.tuning.standing import standing
from rsea_core.control.tuning.tune import Task, tune
from rsea_core.effects import GearFriction, SpringCurve
from rsea_core.errors import InputError
from rsea_core.simulation.reference import AngleReference

RIG = Rig.preset("rsea-bench")
TASK = Task(
    model=ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.01),)),
    loads=(Load(kind="locked"),),
    reference=Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=1.0),
    duration_s=1.0,
)


@pytest.mark.parametrize(("rate", "expected"), [(0.8, "growing"), (0.0, "sustained"), (-3.0, None)])
def test_an_oscillation_is_called_growing_sustained_or_none(rate, expected):
    t = np.arange(0.0, 4.0, 1e-3)
    found = oscillation(t, np.exp(rate * t) * np.sin(2.0 * np.pi * 5.0 * t), smallest=1e-3)
    assert (None if found is None else str(found).split()[0]) == expected
    if found is not None:
        assert found.frequency_Hz == pytest.approx(5.0, rel=0.02)


def test_an_unstable_loop_a_swinging_one_and_a_settled_one_are_distinguished():
    assert standing(TASK, PidTorque()).is_ranked
    unstable = standing(TASK, PidTorque(kp=900.0, ki=500.0, kd=20.0))
    assert any("pole radius" in reason for reason in unstable.reasons)
    power = replace(
        TASK, model=ActuatorModel(RIG), loads=(Load(kind="free"),),
        reference=AngleReference(kind="step", amplitude_rad=0.35),
    )  # fmt: skip
    swings = standing(power, HybridImpedance(selection=1.0, beta=0.75, gamma=0.8))
    assert any("oscillation" in reason for reason in swings.reasons)


def test_a_fuzzy_table_is_judged_at_three_amplitudes():
    found = standing(TASK, FuzzyTorque())
    assert [m.amplitude for m in found.by_amplitude] == pytest.approx([0.3, 1.5, 3.0])


def test_tuning_gives_a_loop_that_simulate_does_not_refuse():
    bounds = {"kp": (5.0, 2000.0), "kd": (0.0, 40.0)}
    found = tune(TASK, PidTorque(), bounds, seeds=(0,), population=8, generations=6)
    assert found.standing.is_ranked
    assert found.standing.margins.is_stable
    assert found.precise_cost == pytest.approx(found.fast_cost, rel=0.05)


def test_the_engine_of_the_search_agrees_with_located_events_or_that_one_runs_everything():
    curve = np.linspace(-0.3, 0.3, 13)
    spring = SpringCurve(deflection_rad=curve, torque_Nm=65.0 * curve + 200.0 * curve**3)
    task = replace(TASK, model=ActuatorModel(RIG, (spring, GearFriction(coulomb_Nm=0.02))))
    found = agreeing_engine(task, PidTorque())
    assert abs(found.error_percent) <= 5.0 or found.is_precise


def search_of(name, seed):
    point = np.array([30.0])
    found = {"best": point, "cost": 1.0, "history": np.ones(2), "evaluations": 8}
    leaders = {"leaders": point[None], "leader_costs": np.ones(1)}
    return Search(method=name, seed=seed, low=point - 1, high=point + 1, **found, **leaders)


def test_a_resumed_run_takes_no_search_of_other_inputs(tmp_path):
    law = ComparedController(name="PID", controller=PidTorque(), bounds={"kp": (5.0, 50.0)})
    first = Comparison(name="one", task=TASK, controllers=(law,))
    log = Checkpoint.open(tmp_path / "log", first)
    log.add("PID", search_of("cma-es", 0))
    assert list(Checkpoint.open(tmp_path / "log", first).done()) == [("PID", 0)]
    curve = np.linspace(-0.3, 0.3, 13)
    for torque in (65.0 * curve, 65.0 * curve + 1e-9 * curve**3):
        spring = SpringCurve(deflection_rad=curve, torque_Nm=torque)
        task = replace(TASK, model=ActuatorModel(RIG, (spring,)))
        other = Checkpoint.open(tmp_path / "log", replace(first, task=task))
        assert other.done() == {}
        other.add("PID", search_of("cma-es", 0))
    path = tmp_path / "reference.csv"
    for value in (1.0, 2.0):
        path.write_text(f"time_s,reference_torque_Nm\n0,0\n1,{value}\n", encoding="utf-8")
        task = replace(TASK, reference=Reference(kind="csv", file=str(path)))
        other = Checkpoint.open(tmp_path / "log", replace(first, task=task))
        assert other.done() == {}
        other.add("PID", search_of("cma-es", 0))


def test_the_bootstrap_is_sure_of_a_difference_and_undecided_without_one():
    rng = np.random.default_rng(0)
    machines = rng.uniform(1.0, 2.0, 20)
    a, b = np.tile(machines, (3, 1)), np.tile(machines + 0.01, (3, 1))
    sure = paired(("a", a), ("b", b))
    assert sure.probability == 1.0
    assert sure.difference == pytest.approx((0.01, 0.01))
    noise = rng.standard_normal((2, 1, 200))
    assert 0.05 < paired(("a", noise[0] + 9.0), ("b", noise[1] + 9.0)).probability < 0.95


def test_the_pareto_front_leaves_out_what_another_point_beats():
    points = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 3.0], [1.0, 3.0]])
    assert pareto(points).tolist() == [True, True, False, True]


def test_tolerances_move_every_stated_quantity_and_no_other():
    moved = perturbed_models(
        TASK.model, 5, 0, {"spring_stiffness_Nm_per_rad": 0.1, "gear-friction.coulomb_Nm": 0.2}
    )
    assert len({m.rig.spring_stiffness_Nm_per_rad for m in moved}) == 5
    assert len({m.terms[0].coulomb_Nm for m in moved}) == 5
    assert {m.rig.motor_inertia_kgm2 for m in moved} == {RIG.motor_inertia_kgm2}
    with pytest.raises(InputError, match=r"tolerance of 'gear-play\.x'"):
        perturbed_models(TASK.model, 1, 0, {"gear-play.x": 0.1})
