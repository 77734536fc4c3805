"""The next experiment can be run on the bench and brings what it promises."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import DriveDeadZone, GearFriction, SpringHardening
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.errors import InputError
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.experiment.input_shapes import ROW_s, shapes
from rsea_core.identify.experiment.next_experiment import CLEAR, BenchLimits, Rival, next_experiment
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import read_case
from rsea_core.simulation.simulate import simulate

RIG = Rig.preset("rsea-bench")
ENCODERS = ("motor_angle_rad", "load_angle_rad")
LIMITS = BenchLimits(current_A=4.0, torque_Nm=12.0, load_angle_rad=1.0, seconds=30.0)
INPUTS = ("multisine", "steps")


def asked(*models, names=("first", "second"), sensors=ENCODERS, inputs=INPUTS):
    rivals = tuple(Rival.of(n, m) for n, m in zip(names, models, strict=True))
    return next_experiment(
        RIG, rivals, sensors=sensors, command="duty", limits=LIMITS, inputs=inputs
    )


@pytest.fixture(scope="module")
def found():
    hardening = ActuatorModel(RIG, (SpringHardening(stiffness_ratio_at_0p15rad=1.3),))
    return asked(hardening, ActuatorModel(RIG), names=("hardening", "a linear spring"))


def test_it_says_what_to_do_and_that_it_will_decide(found):
    assert found.decides
    assert {"hardening", "a linear spring"} == set(found.rivals)
    assert f"{found.best.seconds:.0f} s" in found.sentence
    assert found.signal in found.sentence


def test_the_menu_is_ranked_and_no_sensor_is_asked_for_without_need(found):
    rates = [t.rate for t in found.menu]
    assert rates == sorted(rates, reverse=True)
    own = [t for t in found.menu if set(t.sensors) <= set(ENCODERS) and t.separation > CLEAR]
    assert own
    assert set(found.best.sensors) <= set(ENCODERS)


def test_the_input_keeps_to_the_limits_of_the_bench(found):
    command = found.columns["duty"]
    assert np.abs(command).max() == pytest.approx(found.best.amplitude)
    run = simulate(
        ActuatorModel(RIG), Inputs(time_s=found.columns["time_s"], duty=command, load=found.load)
    )
    assert np.abs(run.torque_Nm).max() <= 1.01 * LIMITS.torque_Nm
    assert np.abs(run.current_A).max() <= 1.01 * LIMITS.current_A


def test_the_files_that_it_writes_are_a_case_once_recorded(found, tmp_path):
    run = simulate(
        ActuatorModel(RIG),
        Inputs(time_s=found.columns["time_s"], duty=found.columns["duty"], load=found.load),
    )
    recorded = {**found.columns, "motor_angle_rad": run.motor_angle_rad}
    write_columns(tmp_path / "next.csv", recorded)
    text = RIG.to_toml() + "\n" + found.recording_toml("next.csv")
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    case = read_case(tmp_path)
    assert case.recordings[0].load == found.load
    assert np.array_equal(case.recordings[0]["duty"], found.columns["duty"])


def test_models_that_differ_in_values_only_are_not_worth_an_experiment(found):
    other = replace(RIG, spring_stiffness_Nm_per_rad=67.0, terminal_resistance_ohm=3.9)
    values = asked(ActuatorModel(RIG), ActuatorModel(other), inputs=("steps",))
    assert values.best.separation < 0.1 * found.best.separation


def test_a_model_and_itself_are_never_separated():
    same = asked(ActuatorModel(RIG), ActuatorModel(RIG), inputs=("steps",))
    assert same.best.separation == 0.0
    assert not same.decides


def test_a_current_sensor_helps_where_a_dead_zone_looks_like_friction():
    found = asked(
        ActuatorModel(RIG, (DriveDeadZone(width_duty=0.004),)),
        ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.015),)),
        inputs=("steps",),
    )

    def best(*sensors):
        return max(t.separation for t in found.menu if t.load == "locked" and t.sensors == sensors)

    assert best("motor_angle_rad", "current_A") > best("motor_angle_rad")


def test_the_promise_is_what_a_refit_of_the_stiffness_finds(found):
    """Of a clamped spring only the stiffness can answer: the rest is what was promised."""
    locked = next(t for t in found.menu if t.sensors == ("motor_angle_rad",) and t.shape == "steps")
    duty = locked.amplitude * shapes()["steps"].value
    time = np.arange(duty.size) * ROW_s
    replay = Replay.of(Inputs(time_s=time, duty=duty, load=Load(kind="locked")))
    linear = replay.numbers(ActuatorModel(RIG))
    hard = replay.run(ActuatorModel(RIG, (SpringHardening(stiffness_ratio_at_0p15rad=1.3),)))
    floor = 8.0 * 2.0 * np.pi / 8192
    left = np.inf
    for share in np.linspace(0.9, 1.4, 51):
        spring = linear.spring.copy()
        spring[:, 2:] *= share
        error = replay.run(linear._replace(spring=spring))[:, 0] - hard[:, 0]
        left = min(left, float(np.sqrt(np.sum(error**2) * ROW_s / 0.05)) / floor)
    # other parameters answer too, so less is left than of the stiffness alone
    assert 0.2 * left < locked.separation < 1.1 * left


def test_a_machine_without_a_drive_is_refused():
    link = Rig.from_tables(
        {"rig": {"name": "link", "parts": ["load"], "load_inertia_kgm2": 0.03}}, where="test"
    )
    rivals = (Rival.of("a", ActuatorModel(link)), Rival.of("b", ActuatorModel(link)))
    with pytest.raises(InputError, match="drives no experiment"):
        next_experiment(link, rivals, sensors=("load_angle_rad",), command="duty", limits=LIMITS)
    with pytest.raises(InputError, match="must be above 0"):
        BenchLimits(current_A=0.0)
