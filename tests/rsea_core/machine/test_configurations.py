"""FSEA, RFSEA and TFSEA agree with direct solves and their limits, and are passive."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rsea_core import ActuatorModel, Load, Rig, linearise
from rsea_core.errors import RigError
from rsea_core.machine.configurations import (
    KINDS,
    Configuration,
    compliance,
    force_sensitivity,
    load_angle_per_motor_torque,
    load_impedance,
    spring_torque_free,
    spring_torque_locked,
    transmissibility,
)
from rsea_core.numeric.transfer_function import TransferFunction

BENCH = Rig.preset("rsea-bench")
F = np.geomspace(0.03, 40.0, 23)
S = 2j * np.pi * F
J = 60.0**2 * 3.2e-4 + 2e-3
B = 60.0**2 * 1e-4 + 0.02
K = 65.8


def arranged(kind, **changes):
    c = Configuration.of_rig(kind, BENCH, spring_inertia_kgm2=0.0 if kind == "FSEA" else 4e-3)
    return replace(c, **changes)


def test_mass_matrix_is_that_of_the_specification():
    """Spec 1.2: [[J_m + a^2 J_l, a b J_l], [a b J_l, J_s + b^2 J_l]]."""
    c = arranged("TFSEA")
    a, b, jm = 1.0 / 60.0, 59.0 / 60.0, J / 3600.0
    expected = [[jm + a * a * 0.03, a * b * 0.03], [a * b * 0.03, 4e-3 + b * b * 0.03]]
    np.testing.assert_allclose(c.mass_matrix(), expected, rtol=1e-14)


def test_fsea_equals_the_linear_machine_with_locked_output():
    linear = linearise(
        ActuatorModel(BENCH), command_name="motor_torque_Nm", load=Load(kind="locked")
    )
    machine = [linear.torque_row @ np.linalg.solve(s * np.eye(5) - linear.A, linear.b) for s in S]
    found = spring_torque_locked(arranged("FSEA"))
    np.testing.assert_allclose(found.response(F), machine, rtol=1e-11)
    np.testing.assert_allclose(found.response(F), 60 * K / (J * S**2 + B * S + K), rtol=1e-11)


def test_fsea_equals_the_linear_machine_with_free_output():
    linear = linearise(ActuatorModel(BENCH), command_name="motor_torque_Nm", load=Load(kind="free"))
    states = np.array([np.linalg.solve(s * np.eye(5) - linear.A, linear.b) for s in S])
    fsea = arranged("FSEA")
    np.testing.assert_allclose(
        spring_torque_free(fsea).response(F), states @ linear.torque_row, rtol=1e-9
    )
    np.testing.assert_allclose(
        load_angle_per_motor_torque(fsea).response(F), states[:, 3], rtol=1e-9
    )


def test_fsea_impedance_is_equation_2_33_with_its_sign_set_right():
    y = J * S**2 + B * S
    np.testing.assert_allclose(
        load_impedance(arranged("FSEA")).response(F), K * y / (y + K), rtol=1e-11
    )


@pytest.mark.parametrize("kind", KINDS)
def test_gains_at_rest(kind):
    c = arranged(kind)
    assert spring_torque_locked(c).dc_gain() == pytest.approx(60.0, rel=1e-12)
    assert transmissibility(c).dc_gain() == pytest.approx(60.0, rel=1e-12)
    assert force_sensitivity(c).dc_gain() == pytest.approx(-1.0, rel=1e-12)
    assert compliance(c).dc_gain() == pytest.approx(c.spring_share**2 / K, rel=1e-12)
    assert load_impedance(c).dc_gain() == pytest.approx(0.0, abs=1e-12)
    assert compliance(c, motor_held=False).dc_gain() == np.inf


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rotor_carry", [0.0, 1.0])
def test_transfer_functions_equal_a_direct_solve_of_the_constrained_equations(kind, rotor_carry):
    """Multipliers for what is held instead of the projection that the module uses."""
    c = arranged(
        kind, rotor_carry=rotor_carry, spring_inertia_kgm2=4e-3, spring_viscous_Nms_per_rad=0.03
    )
    a, b = c.motor_share, c.spring_share
    s = S[11]
    r, e, load = np.array([1.0, rotor_carry]), np.array([0.0, 1.0]), np.array([a, b])
    inner = c.motor_inertia_kgm2 * np.outer(r, r) + 4e-3 * np.outer(e, e)
    D = s**2 * inner + s * np.diag([c.motor_viscous_Nms_per_rad, 0.03]) + np.diag([0.0, K])
    locked = np.block([[D, -load[:, None]], [load[None, :], np.zeros((1, 1))]])
    motor, spring, torque = np.linalg.solve(locked, [1.0, 0.0, 0.0])
    assert a * motor + b * spring == pytest.approx(0.0, abs=1e-12)
    f = F[11]
    assert spring_torque_locked(c).response(f) == pytest.approx(-K * spring / b, rel=1e-10)
    assert transmissibility(c).response(f) == pytest.approx(-torque, rel=1e-10)

    given_angle = np.linalg.solve(locked, [0.0, 0.0, 1.0])[2]
    assert load_impedance(c).response(f) == pytest.approx(given_angle, rel=1e-10)

    full = D + (0.03 * s**2 + 0.02 * s) * np.outer(load, load)
    free = np.linalg.solve(full, load)
    assert compliance(c, motor_held=False).response(f) == pytest.approx(load @ free, rel=1e-10)
    sensed = force_sensitivity(c, motor_held=False).response(f)
    assert sensed == pytest.approx(-K * free[1] / b, rel=1e-10)
    assert force_sensitivity(c).response(f) == pytest.approx(-K / full[1, 1], rel=1e-10)


def test_load_of_an_rfsea_receives_more_than_its_spring_senses():
    c = arranged("RFSEA")
    share = transmissibility(c).response(F) / spring_torque_locked(c).response(F)
    np.testing.assert_allclose(share, 1.0 + 4e-3 * S**2 / K, rtol=1e-9)
    same = transmissibility(arranged("FSEA")).response(F)
    np.testing.assert_allclose(same, spring_torque_locked(arranged("FSEA")).response(F), rtol=1e-11)


@pytest.mark.parametrize("kind", KINDS)
def test_stiff_spring_gives_the_rigid_machine(kind):
    stiff = arranged(kind, stiffness_Nm_per_rad=1e10)
    a = 1.0 / 60.0
    rigid = a / ((J / 3600 + a**2 * 0.03) * S**2 + (B / 3600 + a**2 * 0.02) * S)
    np.testing.assert_allclose(load_angle_per_motor_torque(stiff).response(F), rigid, rtol=1e-6)
    np.testing.assert_allclose(spring_torque_locked(stiff).response(F), 60.0, rtol=1e-4)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(KINDS),
    st.floats(1.5, 200.0),
    *(st.floats(1e-6, 1e-2), st.floats(0.0, 1e-2), st.floats(0.0, 0.1), st.floats(0.0, 0.5)),
    st.floats(1.0, 500.0),
    st.sampled_from([0.0, 1.0]),
)
def test_output_port_is_passive_for_any_values(kind, N, Jm, Bm, Js, Bs, stiffness, carry):
    """Torque over speed at the port is positive real: no motion can draw energy from it."""
    c = Configuration(
        name=kind,
        motor_share=1.0 / N,
        spring_share={"FSEA": -1.0, "RFSEA": 1.0, "TFSEA": (N - 1.0) / N}[kind],
        stiffness_Nm_per_rad=stiffness,
        motor_inertia_kgm2=Jm,
        motor_viscous_Nms_per_rad=Bm,
        spring_inertia_kgm2=Js,
        spring_viscous_Nms_per_rad=Bs,
        rotor_carry=carry,
    )
    per_speed = load_impedance(c).response(F) / S
    assert np.all(per_speed.real >= -1e-9 * np.abs(per_speed))


def test_bad_values_are_refused_in_one_line():
    with pytest.raises(RigError, match="configuration 'FSAE' is unknown; the nearest"):
        Configuration.of_rig("FSAE", BENCH)
    with pytest.raises(RigError, match=r"FSEA: spring_inertia_kgm2 = -1\.0 must not be below 0"):
        arranged("FSEA", spring_inertia_kgm2=-1.0)
    with pytest.raises(RigError, match=r"motor_share = 0\.0 must not be 0"):
        arranged("FSEA", motor_share=0.0)
    with pytest.raises(RigError, match="needs spring_stiffness_Nm_per_rad"):
        Configuration.of_rig("FSEA", replace(BENCH, spring_stiffness_Nm_per_rad=None))


def test_transfer_function_takes_out_common_integrators():
    f = TransferFunction(
        numerator=[0.0, 3.0, 6.0, 0.0],
        denominator=[2.0, 4.0, 0.0],
        input_unit="Nm",
        output_unit="rad",
    )
    assert f.numerator.tolist() == [3.0, 6.0]
    assert f.dc_gain() == 1.5
    assert f.zeros() == pytest.approx([-2.0])
    assert f.poles() == pytest.approx([-2.0])
