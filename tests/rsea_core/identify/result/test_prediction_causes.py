"""Currents within a step, counts, heat and bent starts do not spoil predictions of hidden tests."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rsea_core.engines.fixed_step.winding as w
from rsea_core.effects.drive_thermal import CASE_J_per_K, CASE_TO_AIR_W_per_K, cooled, rested
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.peak_temperature import peak_rise_K, recordings_with_test
from rsea_core.identify.fitting.problem import Hypothesis, predict_readings
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.selection.final_refinement import worsens_free_runs
from rsea_core.identify.smoothing.whitening import whitener
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, read_test
from rsea_core.recordings.recording import Recording
from tests.cases.planted import planted

RIG = Rig.preset("rsea-bench")
CURRENT = CHANNELS.index("current_A")
TIME_s = np.arange(1500) / 1000.0


@pytest.mark.parametrize("x", [1e-4, 0.05, 0.8, 6.0])
def test_a_current_under_an_evenly_changing_speed_is_exact(x):
    start, settled, gained = 0.7, 2.0, 0.4  # ends of the back-EMF's current, over one step
    decay, lag, deflection, last_gain = w.winding_gains(x)

    def slope(t, y):
        return [x * (settled - gained * (t - 0.5) - y[0]), y[0]]

    after, mean = solve_ivp(slope, (0.0, 1.0), [start, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]
    final = settled
    assert final + (start - final) * decay - last_gain * gained == pytest.approx(after, abs=1e-9)
    assert final + (start - final) * lag + deflection * gained == pytest.approx(mean, abs=1e-9)


@pytest.mark.parametrize(("start", "edge"), [(0.0, 1.5), (1.0, 1.5), (1.5, 1.5), (0.5, -0.5)])
def test_the_mean_of_a_current_up_to_its_limit_is_exact(start, edge):
    final, x, t = 3.0 * np.sign(edge), 0.8, np.linspace(0.0, 1.0, 200001)
    moved = final + (start - final) * np.exp(-x * t)
    held = np.minimum(moved, edge) if edge > 0.0 else np.maximum(moved, edge)
    assert w.mean_to_edge(start, final, edge, x) == pytest.approx(np.mean(held), abs=1e-5)


@pytest.mark.parametrize("limit", [6.0, 1.5])
def test_a_step_as_long_as_the_winding_s_time_constant_reads_the_current_of_a_short_one(limit):
    duty = 0.2 * np.sin(2.0 * np.pi * 8.0 * TIME_s**2)  # up to 24 Hz
    rig = replace(RIG, current_limit_A=limit)
    inputs = Inputs(time_s=TIME_s, duty=duty, load=Load(kind="pendulum"))
    long, short = (
        Replay.of(inputs, step_s=step).run(ActuatorModel(rig))[:, CURRENT] for step in (1e-3, 2e-5)
    )
    assert np.ptp(short) > 2.0
    assert np.sqrt(np.mean((long - short) ** 2)) < 1.5e-3  # a sensor's noise is 5e-3


def test_a_constant_of_a_counting_encoder_is_no_mismatch():
    plant = ActuatorModel(RIG).plant("duty", Load(kind="pendulum"))
    count = 2.0 * np.pi / RIG.load_encoder_counts_per_rev
    n = 4000
    found = whitener(
        plant, RIG.spring_stiffness_Nm_per_rad, channels=("motor_angle_rad", "load_angle_rad"),
        floors={"motor_angle_rad": 2.2e-4, "load_angle_rad": count / np.sqrt(12.0)}, row_s=1e-3,
        rows=n, in_contact=np.zeros(n, bool), motion=5.0, drive=np.ones(n),
    )  # fmt: skip
    residual = np.zeros((2, n, 2))
    residual[0, :, 1] = 0.5 * count  # where it began between two counts
    residual[1, :, 1] = 0.5 * count * np.sin(2.0 * np.pi * np.arange(n) / 2000.0)
    constant, moving = np.sum(found(residual) ** 2, axis=(1, 2))
    assert constant < 4.0  # half a count, uniform: 1.7 deviations, once
    assert moving > 100.0 * constant


def test_a_resting_motor_cools_as_its_two_bodies():
    left, capacity, across = (20.0, 4.0), 10.0, 0.6
    times = np.array([0.0, 5.0, 60.0, 900.0])

    def slope(_t, y):
        flow = across * (y[0] - y[1])
        return [-flow / capacity, (flow - CASE_TO_AIR_W_per_K * y[1]) / CASE_J_per_K]

    exact = solve_ivp(slope, (0.0, 900.0), left, t_eval=times, rtol=1e-10, atol=1e-10).y
    found = cooled(left, capacity, across, CASE_J_per_K, times)
    assert np.array(found) == pytest.approx(exact, abs=1e-6)
    after_pause = rested(left, 4.0, capacity, across, CASE_J_per_K, 5.0)
    assert after_pause == pytest.approx(tuple(exact[:, 1]), abs=1e-6)
    winding, case = rested(left, 1.0, capacity, across, CASE_J_per_K, 5.0)  # a case long at rest
    assert case == pytest.approx(1.5, abs=0.1)
    assert winding - case < 0.1


def test_a_test_after_the_session_begins_with_the_winding_s_heat(tmp_path):
    duty = 0.5 * np.sin(2.0 * np.pi * 3.0 * TIME_s)
    np.savetxt(tmp_path / "input.csv", np.column_stack([TIME_s, duty]), delimiter=",",
               header="time_s,duty", comments="")  # fmt: skip
    (tmp_path / "test.toml").write_text(
        '[[recording]]\nfile = "input.csv"\nload = "locked"\ninitial_temperature_C = 26.0\n'
    )
    (test,) = read_test(tmp_path, RIG)
    law = laws_by_key()["drive-thermal/winding and case"]
    values = {"winding_heat_capacity_J_per_K": 10.0, "winding_time_s": 20.0, "pause_s": 5.0}
    cold = FoundModel(rig=RIG, contact={}, laws=((law, values),), ambient_C=22.0)
    warm = replace(cold, initial_rises_K=(24.0, 4.0))
    path = tmp_path / "model.toml"
    path.write_text(warm.to_toml())
    read = FoundModel.from_toml(path)
    assert read.initial_rises_K == warm.initial_rises_K
    winding, case = rested((24.0, 4.0), 4.0, 10.0, 0.5, CASE_J_per_K, 5.0)
    # what the heat of the winding does, a resistance of its own would do
    share = 1.0 + 0.00393 * (winding - case) / (1.0 + 0.00393 * 4.0)
    stiff = replace(RIG, terminal_resistance_ohm=RIG.terminal_resistance_ohm * share)
    torque = {
        name: model.predict(test)["torque_Nm"]
        for name, model in (("cold", cold), ("warm", read), ("stiff", replace(cold, rig=stiff)))
    }
    apart = np.ptp(torque["cold"] - torque["warm"])
    assert apart > 0.01 * np.ptp(torque["cold"])
    assert np.ptp(torque["stiff"] - torque["warm"]) < 0.2 * apart


def test_the_winding_s_peak_counts_the_test_and_a_broken_test_is_left_out(tmp_path):
    """A locked motor on a constant duty, eight times longer than any recording: u^2 / R heats."""
    problem = planted(tmp_path)
    law = catalogue(problem.case)["drive-thermal/winding and case"]
    hypothesis = Hypothesis(laws=(law,))
    x = problem.start(hypothesis)

    def peak() -> float:
        return peak_rise_K(problem, hypothesis, x, recordings_with_test(problem, 25.0))

    alone = peak()
    folder = tmp_path / "test"
    folder.mkdir()
    (folder / "test.toml").write_text('[[recording]]\nfile = "gone.csv"\nload = "locked"\n')
    assert peak() == alone
    time_s = np.arange(0.0, 8.0 * np.ptp(problem.prepared[0].recording.time_s), 0.001)
    np.savetxt(folder / "input.csv", np.column_stack([time_s, 0.4 + 0.0 * time_s]), delimiter=",",
               header="time_s,duty", comments="")  # fmt: skip
    (folder / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "locked"\n')
    nominal, (values,) = problem.values(hypothesis, x)
    tau, capacity = values["winding_time_s"], values["winding_heat_capacity_J_per_K"]
    heat = (0.4 * nominal["supply_voltage_V"]) ** 2 / nominal["terminal_resistance_ohm"]
    asked = (
        heat * tau / capacity * (1.0 - np.exp(-time_s[-1] / tau))
    )  # a case that stays cold, copper too
    assert alone < 0.3 * asked
    assert peak() == pytest.approx(asked, rel=0.25)


@pytest.mark.parametrize("worse", [False, True])
def test_effects_mislead_where_their_free_runs_are_worse(monkeypatch, worse):
    errors = {"plain": np.array([0.1, 0.2]), "law": np.array([0.3, 0.1] if worse else [0.05, 0.2])}
    monkeypatch.setattr(
        "rsea_core.identify.selection.final_refinement.free_run_errors",
        lambda problem, h, x, recordings, *, without: errors[h.key],
    )
    plain = SimpleNamespace(hypothesis=SimpleNamespace(key="plain", laws=()), x=None)
    law = SimpleNamespace(key="law", laws=("one",))
    fit = SimpleNamespace(hypothesis=law, x=None, msni=np.array([0.9, 3.0]))
    search = SimpleNamespace(parameters=plain, problem=SimpleNamespace(fitted=()))
    assert worsens_free_runs(search, fit) is worse
    quiet = SimpleNamespace(hypothesis=law, x=None, msni=np.array([0.9, 1.3]))
    assert not worsens_free_runs(search, quiet), (
        "within what a bridge leaves, smaller errors are chance"
    )
    assert not worsens_free_runs(search, plain)


@pytest.mark.parametrize("name", ["one slip", "bouc-wen"])
def test_a_spring_that_begins_deflected_remembers_as_much_as_its_law_states(name):
    law = laws_by_key()[f"spring-hysteresis/{name}"]
    replay = Replay(time_s=TIME_s, command_name="duty", command=0.0 * TIME_s,
                    load=Load(kind="pendulum"), initial_angles_rad=(0.0, 0.15))  # fmt: skip
    base = replay.numbers(ActuatorModel(RIG))
    where = RunConditions(index=0, file="r.csv", kind="pendulum", ratio=RIG.gear_ratio,
                          session_s=0.0, case_rise_K=0.0, time_s=TIME_s)  # fmt: skip
    values = {"stiffness_1_Nm_per_rad": 10.0, "stiffness_Nm_per_rad": 10.0, "yield_1_rad": 0.02,
              "yield_rad": 0.02, "exponent": 1.5}  # fmt: skip
    torque = []
    for relaxed in (0.0, 0.5, 1.0):
        trial = TrialMachine(plant=base.plant.copy(), fx=np.zeros(N_EFFECTS), stiffness=60.0)
        law.write(values | {"start_relaxed": relaxed}, trial, where)
        torque.append(float(predict_readings(replay, [trial], ("torque_Nm",), where)[0, 0, 0]))
    assert torque[2] == pytest.approx(-60.0 * 0.15)
    assert torque[0] == pytest.approx(-60.0 * 0.15 - 10.0 * 0.02, rel=1e-3)
    assert torque[1] == pytest.approx(0.5 * (torque[0] + torque[2]), rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.15])
def test_only_recordings_that_begin_deflected_ask_how_the_spring_was_brought_there(angle):
    load = Load(kind="pendulum")
    replay = Replay(time_s=TIME_s, command_name="duty", command=0.2 * np.sin(9.0 * TIME_s),
                    load=load, initial_angles_rad=(0.0, angle))  # fmt: skip
    rows = replay.run(ActuatorModel(RIG))
    names = ("motor_angle_rad", "load_angle_rad", "torque_Nm")
    columns = {"time_s": TIME_s, "duty": 0.2 * np.sin(9.0 * TIME_s)}
    columns |= {name: rows[:, CHANNELS.index(name)] for name in names}
    made = Recording(file="r.csv", load=load, columns=columns, sample_time_s=1e-3)
    laws = catalogue(Case(name="made", folder=Path(), rig=RIG, recordings=(made,)))
    unknowns = {parameter.name for parameter in laws["spring-hysteresis/two slips"].unknowns}
    assert ("start_relaxed" in unknowns) == (angle > 0.0)
