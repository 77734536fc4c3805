"""A ranking holds only loops that settle, and an interrupted run resumes only its own inputs."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import FuzzyTorque, HybridImpedance, PidTorque
from rsea_core.control.stability.oscillation import oscillation, unrest
from rsea_core.control.tuning.bootstrap import paired, pareto
from rsea_core.control.tuning.checkpoint import Checkpoint
from rsea_core.control.tuning.comparison import ComparedController, Comparison, compare
from rsea_core.control.tuning.robustness import agreeing_engine
from rsea_core.control.tuning.search_record import Search
from rsea_core.control.tuning.standing import standing
from rsea_core.control.tuning.tune import Task, TaskCost, tune
from rsea_core.effects import GearFriction, GearLoadFriction, SpringCurve
from rsea_core.errors import InputError
from rsea_core.model.perturbed import perturbed_models, usual_tolerances
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


T = np.arange(0.0, 2.0005, 1e-3)


@pytest.mark.parametrize(
    "signal",
    [
        *(1.0 + np.sin(2.0 * np.pi * f * T) for f in (1.0, 2.0, 3.0)),
        np.exp(3.0 * T),
        T,
        1.0 + 1e-3 * np.exp(2.0 * T),  # still small, and growing
    ],
    ids=["1 Hz", "2 Hz", "3 Hz", "runaway", "ramp", "growth"],
)
def test_what_swings_slowly_runs_away_or_drifts_is_not_at_rest(signal):
    assert unrest(T, signal, smallest=0.01, still=0.02 * 5.0) is not None


def test_what_has_settled_is_at_rest_and_what_still_settles_is_no_swing():
    settled = 1.0 - np.exp(-5.0 * T) * np.cos(30.0 * T) + 0.005 * np.sin(400.0 * T)
    assert unrest(T, settled, smallest=0.01, still=0.02) is None
    assert unrest(T, 1.0 - np.exp(-T), smallest=0.01, still=0.02).is_dying
    for moves_on in (T, np.sin(2.0 * np.pi * 3.0 * T), np.exp(3.0 * T)):
        assert not unrest(T, moves_on, smallest=0.01, still=0.02).is_dying


def test_an_angle_loop_that_swings_slowly_has_no_rank():
    """Without damping the heavy pendulum swings on by +-2 rad at 1.9 Hz."""
    task = Task(
        model=ActuatorModel(replace(RIG, load_inertia_kgm2=0.5)),
        loads=(Load(kind="pendulum"),),
        reference=AngleReference(kind="ramp", amplitude_rad=0.2, rise_s=0.5),
        duration_s=3.0,
    )
    law = HybridImpedance(selection=1.0, kv=0.0, force_per_torque_per_m=1.0)
    found = standing(task, law)
    assert any("pole radius" in reason for reason in found.reasons)
    assert any("oscillation" in r or "not at rest" in r for r in found.reasons)
    costs = TaskCost(task, replace(law, kv=0.25), ("kv",))(np.array([[0.0]]))
    assert np.isinf(costs[0])


def test_a_loop_without_a_command_has_no_rank():
    nothing = PidTorque(kp=0.0, ki=0.0, kd=0.0, feedforward=False, back_emf="none")
    assert any("command is 0" in reason for reason in standing(TASK, nothing).reasons)


def test_a_fuzzy_table_is_judged_from_a_few_counts_up_to_the_amplitude_and_at_rest():
    found = standing(TASK, FuzzyTorque())
    sizes = [m.amplitude for m in found.by_amplitude]
    count = 65.8 * 2.0 * np.pi / 8192.0 / 60.0
    assert sizes[0] == pytest.approx(max(3.0 * count, 0.003), rel=0.01)
    assert sizes[-3:] == pytest.approx([0.3, 1.5, 3.0])
    assert len(sizes) == 8
    assert found.margins is not None


def test_a_fuzzy_table_too_steep_at_rest_has_no_rank_and_is_not_searched():
    """Stable at the amplitudes of the task, unstable at rest, where its gain is largest."""
    steep = FuzzyTorque(error_scale_per_Nm=3.0, rate_scale_s_per_Nm=0.0, ki=0.0)
    task = replace(TASK, least_modulus_margin=0.5)
    found = standing(task, steep)
    assert any("at rest" in r or "pole radius" in r for r in found.reasons)
    assert np.isinf(TaskCost(task, steep, ("ki",))(np.array([[0.0]])))


def test_each_seed_delivers_a_point_that_may_be_ranked():
    bounds = {"kp": (5.0, 2000.0), "kd": (0.0, 40.0)}
    found = tune(TASK, PidTorque(), bounds, seeds=(0, 1), population=8, generations=6)
    assert len(found.by_seed) == 2
    assert all(standing(TASK, law).is_ranked for law in found.by_seed)
    assert found.controller in found.by_seed


def test_a_late_step_is_judged_from_the_step_on():
    def stepped(start, from_s):
        reference = Reference(kind="step", amplitude_Nm=3.0, start_s=start)
        return replace(TASK, reference=reference, from_s=from_s, duration_s=1.0 + start)

    steps = [stepped(*times) for times in ((0.0, 0.0), (0.0, 0.1), (0.5, 0.0), (0.5, 0.7))]
    law = ComparedController(name="PID", controller=PidTorque(kp=20.0), bounds={})
    rows = [
        compare(Comparison(name="steps", task=task, controllers=(law,), perturbed=0))[0].as_row()
        for task in steps
    ]
    for row in rows[1:]:
        assert row["overshoot_percent"] == pytest.approx(rows[0]["overshoot_percent"], abs=0.2)
        assert row["settling_s"] == pytest.approx(rows[0]["settling_s"], abs=0.003)


def test_the_friction_that_a_compensator_knows_differs_from_machine_to_machine():
    worm = GearLoadFriction(lead_angle_rad=0.07, friction_coefficient=0.075)
    model = ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.01), worm))
    moved = usual_tolerances(model)
    assert moved["gear-friction.coulomb_Nm"] == moved["gear-load-friction.friction_coefficient"]
    assert "gear-friction.viscous_Nms_per_rad" not in moved  # it has none
    machines = perturbed_models(model, 5, 0)
    assert len({m.terms[0].coulomb_Nm for m in machines}) == 5
    assert len({m.terms[1].friction_coefficient for m in machines}) == 5
    law = ComparedController(name="PID", controller=PidTorque(), bounds={})
    task = replace(TASK, model=model)
    assert Comparison(name="one", task=task, controllers=(law,)).moved == moved


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
