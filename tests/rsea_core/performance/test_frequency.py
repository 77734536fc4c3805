"""Natural frequencies, Bode data and impedances agree with closed forms and python-control."""

import importlib
import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, InputError, Inputs, Load, Rig, linearise
from rsea_core import simulate as run
from rsea_core.effects import SpringCurve
from rsea_core.errors import RigError
from rsea_core.machine.configurations import Configuration, load_impedance
from rsea_core.performance.frequency import OUTPUTS, bode, natural_frequencies, output_impedance
from rsea_core.simulation.tracking_metrics import phasor

BENCH = Rig.preset("rsea-bench")
MODEL = ActuatorModel(BENCH)
LOCKED = Load(kind="locked")
F = np.geomspace(0.05, 30.0, 17)
S = 2j * np.pi * F
J, B, K = 60.0**2 * 3.2e-4 + 2e-3, 60.0**2 * 1e-4 + 0.02, 65.8


@pytest.mark.parametrize(
    ("motor_inertia", "locked_Hz", "printed_Hz"), [(1.7e-5, 5.1, 313.0), (3.2e-4, 1.20, 72.0)]
)
def test_locked_frequency_takes_the_inertia_at_the_output(motor_inertia, locked_Hz, printed_Hz):
    """Errata D9: 5.1 and 1.20 Hz, where the thesis' 2.32 gives 313 and 72 Hz."""
    rig = replace(BENCH, motor_inertia_kgm2=motor_inertia)
    found = natural_frequencies(ActuatorModel(rig))
    assert found.locked_Hz == pytest.approx(locked_Hz, rel=0.01)
    assert np.sqrt(K / motor_inertia) / (2.0 * np.pi) == pytest.approx(printed_Hz, rel=0.01)
    expected = np.sqrt(K / (3600 * motor_inertia + 2e-3)) / (2.0 * np.pi)
    assert found.locked_Hz == pytest.approx(expected, rel=1e-12)


def test_free_frequencies_equal_the_eigenvalues_of_the_undamped_machine():
    rig = replace(
        BENCH,
        motor_viscous_Nms_per_rad=0.0,
        output_viscous_Nms_per_rad=0.0,
        load_viscous_Nms_per_rad=0.0,
    )
    poles = linearise(
        ActuatorModel(rig), command_name="motor_torque_Nm", load=Load(kind="free")
    ).poles()
    found = natural_frequencies(MODEL)
    assert found.free_Hz == pytest.approx(np.abs(poles).max() / (2 * np.pi), rel=1e-9)
    assert found.motor_held_Hz == pytest.approx(np.sqrt(K / 0.03) / (2 * np.pi), rel=1e-12)
    assert found.locked_Hz < found.motor_held_Hz < found.free_Hz


def test_natural_frequency_follows_the_tangent_of_a_stiffening_spring():
    d = np.linspace(-0.3, 0.3, 13)
    curve = SpringCurve(
        deflection_rad=d, torque_Nm=60.0 * d + 90.0 * d**3, tangent_Nm_per_rad=60.0 + 270.0 * d**2
    )
    found = natural_frequencies(MODEL.with_terms(curve), deflection_rad=0.2)
    assert found.stiffness_Nm_per_rad == pytest.approx(60.0 + 270.0 * 0.04, rel=1e-12)
    assert found.locked_Hz == pytest.approx(np.sqrt(70.8 / J) / (2 * np.pi), rel=1e-12)


def test_bode_of_the_voltage_driven_joint_is_its_third_order_transfer_function():
    R, L, kt, V = 3.78, 4.56e-3, 0.3056, 48.0
    expected = 60 * kt * V * K / ((L * S + R) * (J * S**2 + B * S + K) + 3600 * kt**2 * S)
    found = bode(MODEL, F, command_name="duty", load=LOCKED)
    np.testing.assert_allclose(found.response, expected, rtol=1e-11)
    np.testing.assert_allclose(found.magnitude_dB, 20 * np.log10(np.abs(expected)), atol=1e-9)
    assert np.all(np.diff(found.phase_deg) < 0.0)
    high = bode(MODEL, np.geomspace(0.05, 3000.0, 60), command_name="duty", load=LOCKED)
    assert -270.0 < high.phase_deg[-1] < -260.0  # three poles, unwrapped


def test_voltage_driven_locked_torque_has_the_bandwidth_of_stiffness_over_back_emf():
    """Spec 1.2: a first-order lag of 0.74 rad/s."""
    found = bode(MODEL, np.geomspace(1e-3, 1.0, 300), command_name="duty", load=LOCKED)
    assert 2 * np.pi * found.bandwidth_Hz() == pytest.approx(0.74, rel=0.02)


def test_bandwidth_of_a_first_order_lag_is_its_corner():
    """A motor without spring driven by voltage: speed over voltage is a lag."""
    rig = replace(BENCH, parts=("drive", "gear"), terminal_inductance_H=0.0)
    damping = 3600 * 0.3056**2 / 3.78 + B
    found = bode(
        ActuatorModel(rig),
        np.geomspace(0.01, 1000.0, 400),
        command_name="voltage_V",
        load=Load(kind="free"),
        output="wheel_velocity_rad_per_s",
    )
    assert found.bandwidth_Hz() == pytest.approx(damping / J / (2 * np.pi), rel=1e-3)
    flat = bode(MODEL, [1e-4, 2e-4], command_name="motor_torque_Nm", load=LOCKED)
    assert flat.bandwidth_Hz() is None


def test_impedance_with_a_free_motor_is_that_of_the_fsea():
    y = J * S**2 + B * S
    found = output_impedance(MODEL, F)
    np.testing.assert_allclose(found, K * y / (y + K), rtol=1e-11)
    fsea = load_impedance(Configuration.of_rig("FSEA", BENCH))
    np.testing.assert_allclose(found, fsea.response(F), rtol=1e-11)


def test_impedance_with_a_shorted_winding_has_the_back_emf_damping():
    y = J * S**2 + B * S + 3600 * 0.3056**2 * S / (4.56e-3 * S + 3.78)
    np.testing.assert_allclose(
        output_impedance(MODEL, F, command_name="duty"), K * y / (y + K), rtol=1e-11
    )


def test_impedance_agrees_with_the_simulated_machine_moved_by_hand():
    """An imposed sine at the load: torque phasor over angle phasor, once settled."""
    f, t = 2.3, np.arange(12001) * 5e-4
    angle = 0.05 * np.sin(2 * np.pi * f * t) * np.minimum(t, 1.0) ** 2
    result = run(
        MODEL,
        Inputs(time_s=t, duty=np.zeros(t.size), load=Load(kind="imposed"), load_angle_rad=angle),
    )
    late = t > 3.0
    measured = -phasor(t[late], result.torque_Nm[late], f) / phasor(t[late], angle[late], f)
    assert output_impedance(MODEL, f, command_name="duty")[0] == pytest.approx(measured, rel=1e-4)


def test_unusable_questions_are_refused_in_one_line():
    with pytest.raises(InputError, match="frequency_Hz must be numbers above 0"):
        bode(MODEL, [0.0, 1.0], load=LOCKED)
    with pytest.raises(InputError, match="output 'torque' must be one of torque_Nm"):
        bode(MODEL, [1.0], load=LOCKED, output="torque")
    with pytest.raises(RigError, match="natural frequencies need a gear and a spring"):
        natural_frequencies(ActuatorModel(replace(BENCH, parts=("drive", "gear", "load"))))


needs_control = pytest.mark.skipif(
    importlib.util.find_spec("control") is None,
    reason='python-control is not installed (pip install "dftfs[interop]")',
)


@needs_control
def test_python_control_object_has_the_same_response_and_step():
    import control

    from rsea_core.interop.python_control import to_control

    linear = linearise(MODEL, command_name="duty", load=Load(kind="free"))
    system = to_control(linear, outputs=("torque_Nm", "load_angle_rad"), command_name="duty")
    assert system.nstates == 5
    assert system.input_labels == ["duty"]
    response = system(S[9])
    for i, output in enumerate(("torque_Nm", "load_angle_rad")):
        ours = bode(MODEL, F[9], command_name="duty", load=Load(kind="free"), output=output)
        assert response[i, 0] == pytest.approx(ours.response[0], rel=1e-9)

    locked = to_control(linearise(MODEL, command_name="duty", load=LOCKED))
    assert locked.state_labels == ["current_A", "wheel_angle_rad", "wheel_velocity_rad_per_s"]
    held = to_control(linearise(MODEL, command_name="duty", load=LOCKED), outputs=OUTPUTS)
    assert held(S[9])[OUTPUTS.index("load_angle_rad"), 0] == 0.0
    t = np.arange(1501) * 1e-3
    step = control.step_response(locked, t)
    simulated = run(MODEL, Inputs(time_s=t, duty=np.full(t.size, 0.2), load=LOCKED))
    np.testing.assert_allclose(0.2 * step.outputs, simulated.torque_Nm, atol=1e-8)


@needs_control
def test_python_control_transfer_function_is_the_same_quotient():
    from rsea_core.interop.python_control import transfer_function_to_control
    from rsea_core.machine.configurations import spring_torque_locked

    ours = spring_torque_locked(Configuration.of_rig("TFSEA", BENCH, spring_inertia_kgm2=4e-3))
    theirs = transfer_function_to_control(ours)
    np.testing.assert_allclose(theirs(S), ours.response(F), rtol=1e-12)


def test_without_python_control_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    monkeypatch.delitem(sys.modules, "rsea_core.interop.python_control", raising=False)
    with pytest.raises(ModuleNotFoundError, match=r'not installed: pip install "dftfs\[interop\]"'):
        importlib.import_module("rsea_core.interop.python_control")
