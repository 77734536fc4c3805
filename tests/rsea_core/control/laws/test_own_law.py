"""A law of one's own runs, is tuned and judged as a built-in one, compiled or in Python."""

import timeit

import numpy as np
import pytest

import rsea_core
from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import PidTorque, loop_margins, simulate_closed_loop
from rsea_core.control.laws.own_law import load_controller
from rsea_core.control.tuning.tune import Task, costs_of
from rsea_core.errors import ControllerError, ScenarioError
from rsea_core.scenarios.scenario import controller_from_table

MODEL = ActuatorModel(Rig.preset("rsea-bench"))
LOCKED = Load(kind="locked")
SINE = Reference(kind="sine", amplitude_Nm=4.0, frequency_Hz=1.3)


@rsea_core.controller(sample_time_s=1e-3)
class OwnPid:
    """The built-in PI torque loop, written once more."""

    kp: float = 60.0
    ki: float = 10.0
    state = {"integral": 0.0, "acted": 0.0, "last_load": 0.0, "speed": 0.0}  # noqa: RUF012

    def design(self, machine):
        return {
            "stiffness": machine.stiffness_Nm_per_rad,
            "inertia": machine.inertia_kgm2,
            "damping": machine.damping_Nms_per_rad,
            "scale": machine.command_per_Nm,
            "emf": machine.command_per_rad_per_s,
            "limit": machine.command_limit,
            "T": machine.sample_time_s,
            "keep": 0.02 / (0.02 + machine.sample_time_s),
        }

    def step(self, y):
        error = y.reference - y.torque_Nm
        if self.acted == 0.0:
            self.acted = 1.0
            self.last_load = y.load_angle_rad
        moved = (y.load_angle_rad - self.last_load) / self.T
        self.speed = self.keep * self.speed + (1.0 - self.keep) * moved
        self.last_load = y.load_angle_rad
        wanted = y.reference_rate / self.stiffness + self.speed
        torque = y.reference + self.inertia * y.reference_acceleration / self.stiffness
        torque += self.damping * wanted + self.kp * error
        base = self.scale * torque + self.emf * wanted
        rate = self.ki * self.T * error
        integral = self.integral + rate
        asked = base + self.scale * integral
        if abs(asked) > self.limit and asked * rate > 0.0:
            integral = self.integral
            asked = base + self.scale * integral
        self.integral = integral
        return asked


@rsea_core.controller(sample_time_s=1e-3)
class InterpretedPid(OwnPid.law):
    """The same by a helper method, which is not compiled."""

    kp: float = 60.0
    ki: float = 10.0

    def whole(self, y):
        return type(y).__name__

    def step(self, y):
        assert self.whole(y)
        return self.rest(y)

    rest = OwnPid.law.step


@rsea_core.controller(sample_time_s=1e-3)
def proportional(y, gain=0.02):
    return gain * (y.reference - y.torque_Nm)


@pytest.mark.parametrize("load", [LOCKED, Load()], ids=["locked", "pendulum"])
@pytest.mark.parametrize("law", [OwnPid(), InterpretedPid()], ids=["compiled", "in Python"])
def test_an_own_pid_equals_the_built_in_one_to_1e_12(law, load):
    built_in, own = (
        simulate_closed_loop(MODEL, c, SINE, load, duration_s=1.0, refuse_unstable=False)
        for c in (PidTorque(), law)
    )
    assert np.abs(built_in.torque_Nm).max() > 1.0
    np.testing.assert_allclose(own.torque_Nm, built_in.torque_Nm, rtol=0.0, atol=1e-12)
    ours, theirs = (loop_margins(MODEL, c, load) for c in (law, PidTorque()))
    assert ours.phase_margin_deg == pytest.approx(theirs.phase_margin_deg, abs=1e-6)


def test_a_compiled_own_law_takes_at_most_half_as_long_again_as_the_built_in():
    def seconds(law):
        run = lambda: simulate_closed_loop(MODEL, law, SINE, LOCKED, duration_s=3.0)  # noqa: E731
        run()
        return min(timeit.repeat(run, number=5, repeat=9))

    assert seconds(OwnPid()) < 1.5 * seconds(PidTorque())


def test_a_plain_function_is_a_law_and_its_numbers_can_be_tuned():
    task = Task(model=MODEL, loads=(LOCKED,), reference=SINE, duration_s=1.0)
    costs = costs_of(task, [proportional(), proportional(gain=0.2)])
    assert costs[1] < costs[0]


def test_toml_reaches_a_law_in_a_file_of_the_scenarios_folder(tmp_path):
    (tmp_path / "my_laws.py").write_text(
        "import rsea_core\n"
        "@rsea_core.controller(sample_time_s=2e-3, follows='angle')\n"
        "class Mine:\n"
        "    kp: float = 1.0\n"
        "    def step(self, y):\n"
        "        return self.kp * (y.reference - y.load_angle_rad)\n",
        encoding="utf-8",
    )
    found = controller_from_table({"kind": "my_laws:Mine", "kp": 3}, tmp_path)
    assert (found.kp, found.sample_time_s, found.kind) == (3.0, 2e-3, "my_laws:Mine")
    assert found.reference_name == "reference_angle_rad"
    with pytest.raises(ScenarioError, match="kq"):
        controller_from_table({"kind": "my_laws:Mine", "kq": 3}, tmp_path)
    with pytest.raises(ControllerError, match=r"has no @rsea_core\.controller 'Yours'"):
        load_controller("my_laws:Yours", tmp_path)
    with pytest.raises(ControllerError, match="no_such_module cannot be loaded"):
        load_controller("no_such_module:Mine", tmp_path)


def broken(kind):
    return rsea_core.controller(sample_time_s=1e-3)(kind)


class NoStep:
    kp: float = 1.0


class Word:
    kp: str = "high"

    def step(self, y):
        return 0.0


class Unknown:
    def step(self, y):
        return y.torque


class Writes:
    kp: float = 1.0

    def step(self, y):
        self.kp = 2.0
        return self.kp


class Fails:
    def helper(self):
        return {}["nothing"]

    def step(self, y):
        return self.helper()


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (NoStep, "NoStep has no step"),
        (Word, "kp = 'high' must be a number"),
        (Unknown, "y.torque is unknown; y has reference"),
        (Writes, "self.kp is a parameter and is assigned to"),
        (Fails, "Fails: KeyError: 'nothing'"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused_in_one_line(kind, message):
    with pytest.raises(ControllerError, match=message) as refused:
        simulate_closed_loop(
            MODEL, broken(kind)(), SINE, LOCKED, duration_s=0.1, refuse_unstable=False
        )
    assert "\n" not in str(refused.value)
