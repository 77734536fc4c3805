"""A scenario file is read, run and handed back, or refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import (
    ActuatorModel,
    InputError,
    Load,
    PidTorque,
    Reference,
    Rig,
    Scenario,
    run_scenario,
    simulate,
    simulate_closed_loop,
    tracking_metrics,
)
from rsea_core.effects import SpringCurve
from rsea_core.errors import ControllerError, ScenarioError
from rsea_core.machine.inputs import Inputs
from rsea_core.simulation.tracking_metrics import phasor
from tests.cases.places import ROOT

EXAMPLE = ROOT / "dftfs" / "examples" / "torque-1hz.toml"
BASE = """
rig = "rsea-bench"
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 1.0
[controller]
kind = "pid-torque"
[simulation]
duration_s = 1.5
"""


def from_text(tmp_path, text):
    path = tmp_path / "scenario.toml"
    path.write_text(text, encoding="utf-8")
    return Scenario.from_toml(path)


def test_example_runs_with_the_curve_that_its_caller_gives():
    scenario = Scenario.from_toml(EXAMPLE)
    assert scenario.spring_design == "al1"
    with pytest.raises(ScenarioError, match="spring design 'al1' must be solved first"):
        run_scenario(scenario)
    d = np.linspace(-0.2, 0.2, 9)
    curve = SpringCurve(deflection_rad=d, torque_Nm=64.0 * d + 50.0 * d**3)

    result = run_scenario(scenario, curve)

    assert result.trajectory.time_s[-1] == pytest.approx(5.0)
    assert result.metrics.rmse_Nm < 0.02
    assert result.metrics.amplitude_ratio == pytest.approx(1.0, abs=0.005)
    assert abs(result.metrics.phase_deg) < 0.5
    assert result.limits.binding == "loop"
    assert "reference_torque_Nm" in result.trajectory.columns()


def test_spring_of_a_scenario_is_a_stiffness_a_file_or_the_rigs_own(tmp_path):
    plain = from_text(tmp_path, BASE)
    assert plain.name == "scenario"
    assert plain.rig == Rig.preset("rsea-bench")
    stiffer = from_text(tmp_path, BASE + "[spring]\nstiffness_Nm_per_rad = 90.0\n")
    assert stiffer.rig.spring_stiffness_Nm_per_rad == 90.0
    (tmp_path / "c.csv").write_text("deflection_rad,torque_Nm\n-0.2,-13\n0,0\n0.2,13\n")
    curved = from_text(tmp_path, BASE + '[spring]\ncurve_csv = "c.csv"\n')
    assert run_scenario(curved).trajectory.model.terms == (curved.spring,)


def test_rig_of_a_scenario_is_a_preset_a_file_or_a_table(tmp_path):
    (tmp_path / "my.toml").write_text(replace(Rig.preset("rsea-bench"), name="mine").to_toml())
    assert from_text(tmp_path, BASE.replace('"rsea-bench"', '"my.toml"')).rig.name == "mine"
    inline = BASE.replace('rig = "rsea-bench"\n', "") + '[rig]\nname = "here"\nparts = ["spring"]\n'
    assert from_text(tmp_path, inline).rig.name == "here"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[simulation]", "[simulatoin]", "unknown key 'simulatoin'; the nearest known one is 'sim"),
        ("duration_s = 1.5", "durations = 1.5", "unknown key 'durations'"),
        ("duration_s = 1.5", "", "[simulation] duration_s is missing"),
        ("duration_s = 1.5", "duration_s = 0", "duration_s = 0 must be above 0"),
        ("duration_s = 1.5", "duration_s = 1.5\njudge_from_s = 2", "below duration_s = 1.5"),
        ('rig = "rsea-bench"', "", "rig is missing"),
        ('rig = "rsea-bench"', "rig = 3", "rig = 3 must be a preset, a .toml file or a table"),
        ('rig = "rsea-bench"', 'rig = "none.toml"', "none.toml: cannot be read"),
        ('kind = "locked"', 'kind = "lockd"', "[load]: load 'lockd' is unknown"),
        ('kind = "locked"', 'king = "locked"', "[load]: unknown key 'king'"),
        ('kind = "locked"', "", "[load] has no kind (pendulum, free"),
        ('kind = "sine"', "", "[reference] has no kind"),
        (
            'kind = "sine"',
            'kind = "sinus"',
            "reference 'sinus' is unknown; the nearest known one is 's",
        ),
        ("frequency_Hz = 1.0", "frequency = 1.0", "unknown key 'frequency'; the nearest known one"),
        ("frequency_Hz = 1.0", "frequency_Hz = -1", "frequency_Hz = -1 must be above 0"),
        ("frequency_Hz = 1.0", "", "frequency_Hz is missing"),
        ("frequency_Hz = 1.0", "frequency_Hz = 1.0\nstart_s = 1", "start_s = 1 is of no use"),
        ("frequency_Hz = 1.0", "frequency_Hz = 1.0\noffset_Nm = 1e300", "within +-1e+12"),
        ('kind = "pid-torque"', "", "[controller] kind is missing"),
        (
            'kind = "pid-torque"',
            'kind = "pid"',
            "kind 'pid' is unknown; the nearest known one is 'fo-pid'",
        ),
        (
            'kind = "pid-torque"',
            'kind = "pid-torque"\nkP = 3',
            "unknown key 'kP'; the nearest known one is 'kp'",
        ),
        (
            'kind = "pid-torque"',
            'kind = "pid-torque"\nkp = -3',
            "kp = -3.0 must be finite and not neg",
        ),
        ('kind = "pid-torque"', 'kind = "pid-torque"\nkp = "3"', "kp = '3' must be a number"),
        ('kind = "pid-torque"', 'kind = "pid-torque"\nfeedforward = 1', "must be true or false"),
        ('kind = "pid-torque"', 'kind = "pid-torque"\nback_emf = "no"', "must be one of none, ref"),
        ('kind = "pid-torque"', 'kind = "pid-torque"\ndelay_samples = 2', "must be 0 or 1"),
        (
            'kind = "pid-torque"',
            'kind = "pid-torque"\nsample_time_s = 0',
            "sample_time_s = 0.0 must be",
        ),
        ("[load]", '[spring]\ndesign = "al1"\ncurve_csv = "x"\n[load]', "needs one of"),
        ("[load]", "[spring]\ndesign = 3\n[load]", "design = 3 must be a name or a file"),
        ("[load]", "[spring]\nstiffness_Nm_per_rad = -1\n[load]", "must be above 0"),
        ("[load]", "[spring]\nstiffness = 1\n[load]", "[spring]: unknown key 'stiffness'"),
    ],
)
def test_unusable_scenario_gets_one_line_with_file_and_field(tmp_path, old, new, message):
    assert old in BASE
    with pytest.raises(ScenarioError) as caught:
        from_text(tmp_path, BASE.replace(old, new, 1))
    assert message in str(caught.value)
    assert "scenario.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "reference",
    [
        Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=1.7, offset_Nm=0.4, phase_rad=0.3),
        Reference(
            kind="chirp", amplitude_Nm=2.0, frequency_Hz=0.5, end_frequency_Hz=4.0, chirp_s=1.5
        ),
    ],
    ids=lambda r: r.kind,
)
def test_rates_of_a_reference_are_its_derivatives(reference):
    t, h = np.linspace(0.05, 2.5, 83), 1e-5
    _, rate, second_rate = reference.sample(t).T
    after, before = reference.sample(t + h), reference.sample(t - h)
    np.testing.assert_allclose((after - before)[:, 0] / (2 * h), rate, atol=1e-5)
    np.testing.assert_allclose((after - before)[:, 1] / (2 * h), second_rate, atol=1e-4)


def test_chirp_ends_at_its_end_frequency():
    chirp = Reference(
        kind="chirp", amplitude_Nm=2.0, frequency_Hz=0.5, end_frequency_Hz=4.0, chirp_s=1.5
    )
    t = np.linspace(2.0, 3.0, 801)
    assert abs(phasor(t, chirp.sample(t)[:, 0], 4.0)) == pytest.approx(2.0, rel=1e-9)


def test_step_and_file_references(tmp_path):
    step = Reference(kind="step", amplitude_Nm=2.0, offset_Nm=-0.5, start_s=0.5)
    np.testing.assert_array_equal(step.sample([0.0, 0.49, 0.5, 1.0])[:, 0], [-0.5, -0.5, 1.5, 1.5])
    path = tmp_path / "r.csv"
    path.write_text("time_s,reference_torque_Nm\n0,0\n1,2\n2,2\n", encoding="utf-8")
    ramp = Reference(kind="csv", file=str(path)).sample(np.linspace(0.0, 3.0, 13))
    np.testing.assert_allclose(ramp[:, 0], [0, 0.5, 1, 1.5, 2, 2, 2, 2, 2, 2, 2, 2, 2])
    assert ramp[1, 1] == pytest.approx(2.0)
    path.write_text("time_s,reference_torque_Nm\n0,0\n0,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"r\.csv: time_s\[1\]"):
        Reference(kind="csv", file=str(path)).sample(np.zeros(3))


def test_closed_loop_refuses_what_cannot_be_controlled():
    bench, sine = Rig.preset("rsea-bench"), Reference(kind="sine", amplitude_Nm=1, frequency_Hz=1)
    model, locked = ActuatorModel(bench), Load(kind="locked")

    def run(machine=model, controller=PidTorque(), load=locked, **options):  # noqa: B008
        return simulate_closed_loop(
            machine, controller, sine, load, **{"duration_s": 1.0, **options}
        )

    with pytest.raises(ControllerError, match="the loop is unstable at 0 rad"):
        run(controller=PidTorque(kp=900.0))
    assert not np.isnan(run(controller=PidTorque(kp=900.0), refuse_unstable=False).torque_Nm).any()
    with pytest.raises(ControllerError, match="no spring between wheel and load"):
        run(machine=ActuatorModel(replace(bench, parts=("drive", "gear", "load"))))
    with pytest.raises(ControllerError, match=r"rows of 0\.00033\d* s would do"):
        run(row_s=3e-4)
    with pytest.raises(InputError, match="duration_s = 0 must be above 0"):
        run(duration_s=0)
    with pytest.raises(InputError, match='the load "imposed" needs its motion'):
        run(load=Load(kind="imposed"))


@pytest.mark.parametrize("kind", ["sine", "step"])
def test_a_reference_without_amplitude_has_neither_ratio_nor_phase_nor_overshoot(kind):
    still = Reference(kind=kind, amplitude_Nm=0.0, **{"sine": {"frequency_Hz": 1.0}}.get(kind, {}))
    model = ActuatorModel(Rig.preset("rsea-bench"))
    ran = simulate_closed_loop(model, PidTorque(), still, Load(kind="locked"), duration_s=1.0)
    found = tracking_metrics(ran, still)
    assert (found.amplitude_ratio, found.phase_deg, found.overshoot_percent) == (None, None, None)
    assert found.rmse_Nm == 0.0


def test_metrics_refuse_too_little_to_judge():
    model, sine = (
        ActuatorModel(Rig.preset("rsea-bench")),
        Reference(kind="sine", amplitude_Nm=1.0, frequency_Hz=1.0),
    )
    closed = simulate_closed_loop(model, PidTorque(), sine, Load(kind="locked"), duration_s=1.0)
    with pytest.raises(InputError, match="leaves 6 rows"):
        tracking_metrics(closed, sine, from_s=0.995)
    with pytest.raises(InputError, match="less than half a period"):
        tracking_metrics(closed, sine, from_s=0.8)
    open_loop = simulate(model, Inputs(time_s=[0.0, 0.1], duty=[0.0, 0.0]))
    with pytest.raises(InputError, match="followed no reference"):
        tracking_metrics(open_loop, sine)
