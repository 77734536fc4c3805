"""The exact propagator agrees with the event-driven engine, and what sticks does not move."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import cfunc

import rsea_core.engines.event_driven.states as k
from rsea_core import ActuatorModel, InputError, Inputs, Load, Rig, simulate
from rsea_core.effects import (
    GearFriction,
    GearLoadFriction,
    LoadDisturbance,
    LoadFriction,
    SpringHardening,
    SpringParallel,
)
from rsea_core.engines.piecewise_linear.batch import propagate_batch
from rsea_core.engines.piecewise_linear.propagate import (
    LinearMachine,
    can_propagate,
    obstacle,
    propagate,
)
from rsea_core.errors import SimulationError
from rsea_core.simulation.simulate import run_sampled

BENCH = Rig.preset("rsea-bench")
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=30.0,
    contact_angle_rad=0.02,
    contact_damping_Nms_per_rad=0.3,
)
WORM = GearLoadFriction(lead_angle_rad=0.08, friction_coefficient=0.05)


def sine(load, *, amplitude=0.6, duration_s=1.0, **more):
    time = np.arange(round(duration_s * 1000) + 1) * 1e-3
    return Inputs(time_s=time, duty=amplitude * np.sin(2 * np.pi * 2.0 * time), load=load, **more)


def largest_differences(model, inputs):
    exact, quick = simulate(model, inputs), propagate(model, inputs)
    names = ("motor_angle_rad", "load_angle_rad", "torque_Nm", "current_A", "wheel_stuck_s")
    names += ("current_limited_s", "contact_s", "load_stuck_s", "encoder_motor_angle_rad")
    return {n: np.abs(getattr(exact, n) - getattr(quick, n)).max() for n in names}


@pytest.mark.parametrize("load", [Load(), Load(kind="locked"), Load(kind="free"), CONTACT])
@pytest.mark.parametrize(
    "terms",
    [
        (),
        (GearFriction(coulomb_Nm=0.04, asymmetry=0.2), LoadFriction(coulomb_Nm=0.05)),
        (GearFriction(coulomb_Nm=0.02), WORM, SpringParallel(stiffness_Nm_per_rad=2.0)),
        (LoadDisturbance(start_s=0.2005, end_s=0.5503, peak_Nm=1.5),),
    ],
    ids=["smooth", "coulomb", "worm", "disturbance"],
)
def test_agrees_with_the_order_8_integrator_within_5e_6_nm(load, terms):
    found = largest_differences(ActuatorModel(BENCH, terms), sine(load))
    assert found["torque_Nm"] < 5e-6
    angle = 5e-6 / BENCH.spring_stiffness_Nm_per_rad  # what the torque's error is at the spring
    assert found["load_angle_rad"] < angle
    assert found["motor_angle_rad"] < BENCH.gear_ratio * angle
    for name in ("wheel_stuck_s", "load_stuck_s", "current_limited_s", "contact_s"):
        assert found[name] < 1e-5, name


def test_current_limit_and_large_swing_of_the_pendulum():
    rig = replace(BENCH, load_mass_kg=2.0, load_inertia_kgm2=0.2, current_limit_A=1.0)
    model = ActuatorModel(rig, (GearFriction(coulomb_Nm=0.03),))
    inputs = sine(Load(), amplitude=1.0, initial_load_angle_rad=2.0, initial_motor_angle_rad=120.0)
    assert propagate(model, inputs).current_limited_s[-1] > 0.1
    assert largest_differences(model, inputs)["torque_Nm"] < 5e-6


@pytest.mark.parametrize("command", ["voltage_V", "current_command_A", "motor_torque_Nm"])
def test_every_drive(command):
    time = np.arange(801) * 1e-3
    size = {"voltage_V": 30.0, "current_command_A": 7.0, "motor_torque_Nm": 0.6}[command]
    inputs = Inputs(time_s=time, **{command: size * np.sin(9.0 * time)}, load=CONTACT)
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.03),))
    assert largest_differences(model, inputs)["torque_Nm"] < 5e-6


def test_imposed_motion_a_rigid_machine_and_a_drive_without_inductance():
    time = np.arange(801) * 1e-3
    imposed = Inputs(
        time_s=time,
        duty=0.2 * np.sin(5.0 * time),
        load=Load(kind="imposed"),
        load_angle_rad=0.1 * np.sin(7.0 * time),
    )
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.03), WORM))
    assert largest_differences(model, imposed)["torque_Nm"] < 1e-9
    rigid = replace(BENCH, parts=("drive", "gear", "load"), spring_stiffness_Nm_per_rad=None)
    stiff = ActuatorModel(rigid, (GearFriction(coulomb_Nm=0.03),))
    assert largest_differences(stiff, sine(Load()))["load_angle_rad"] < 1e-8
    slow = ActuatorModel(replace(BENCH, terminal_inductance_H=None), (WORM,))
    assert largest_differences(slow, sine(Load()))["torque_Nm"] < 5e-6


@settings(max_examples=25, deadline=None)
@given(
    coulomb=st.floats(0.0, 0.1),
    asymmetry=st.floats(-0.9, 0.9),
    friction=st.floats(0.0, 0.15),
    lead=st.floats(0.05, 0.3),
    joint=st.floats(0.0, 1.0),
    stiffness=st.floats(1.0, 3000.0),
    damping=st.floats(0.0, 5.0),
    limit=st.floats(0.5, 6.0),
)
def test_agrees_over_the_bounds_box(
    coulomb, asymmetry, friction, lead, joint, stiffness, damping, limit
):
    load = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=stiffness,
        contact_angle_rad=0.015,
        contact_damping_Nms_per_rad=damping,
    )
    terms = (
        GearFriction(coulomb_Nm=coulomb, asymmetry=asymmetry),
        GearLoadFriction(lead_angle_rad=lead, friction_coefficient=friction),
        LoadFriction(coulomb_Nm=joint),
    )
    model = ActuatorModel(replace(BENCH, current_limit_A=limit), terms)
    # a tenth of an encoder count; gravity's series at 1 ms leaves 5e-6 Nm on the bench, 2e-4 seen
    assert largest_differences(model, sine(load, duration_s=0.3))["torque_Nm"] < 5e-3


def test_a_stuck_wheel_does_not_move_at_all_and_a_self_locking_worm_holds_for_ever():
    locking = GearLoadFriction(lead_angle_rad=0.05, friction_coefficient=0.1)
    rig = replace(BENCH, load_mass_kg=2.0, load_inertia_kgm2=0.2)
    time = np.arange(60_001) * 1e-3
    still = Inputs(
        time_s=time,
        duty=np.zeros(time.size),
        load=Load(),
        initial_load_angle_rad=1.0,
        initial_motor_angle_rad=60.0,
    )
    result = propagate(ActuatorModel(rig, (locking,)), still)
    assert np.unique(result.wheel_angle_rad).size == 1
    assert not result.wheel_velocity_rad_per_s.any()
    added_up = time.size * np.finfo(float).eps  # one rounding a row
    assert result.wheel_stuck_s[-1] == pytest.approx(60.0, rel=added_up)


def test_halving_the_row_shows_the_stated_order_of_gravity():
    """Rows are the steps: gravity's series leaves an error of order 3."""
    rig = replace(BENCH, load_mass_kg=2.0, load_inertia_kgm2=0.2)
    model = ActuatorModel(rig)

    def end(row_s):
        time = np.arange(round(2.0 / row_s) + 1) * row_s
        inputs = Inputs(time_s=time, duty=0.0 * time, load=Load(), initial_load_angle_rad=2.5)
        return propagate(model, inputs).load_angle_rad[-1]

    errors = [abs(end(h) - end(5e-4)) for h in (0.016, 0.008, 0.004)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 2.7)


def test_what_is_not_linear_is_refused_by_name():
    curved = ActuatorModel(BENCH, (SpringHardening(stiffness_ratio_at_0p15rad=1.5),))
    assert not can_propagate(curved, Load())
    with pytest.raises(SimulationError, match="straight lines"):
        propagate(curved, sine(Load()))
    stribeck = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.02, stribeck_rise=0.5),))
    assert "gear_stribeck_rise" in obstacle(stribeck, Load())
    assert can_propagate(ActuatorModel(BENCH, (WORM,)), Load())
    uneven = Inputs(time_s=[0.0, 1e-3, 3e-3, 4e-3], duty=np.zeros(4), load=Load())
    with pytest.raises(InputError, match="evenly spaced"):
        propagate(ActuatorModel(BENCH), uneven)


@cfunc(k.CONTROLLER)
def proportional_integral(parameters, state, signals, command):
    error = signals[k.REFERENCE] - signals[k.TRUE_TORQUE]
    state[0] += parameters[1] * error
    command[k.COMMAND] = min(max(parameters[0] * error + state[0], -1.0), 1.0)
    command[k.UNSATURATED] = command[k.COMMAND]


def loop_inputs(rows):
    time = np.arange(rows) * 1e-3
    reference = np.zeros((rows, 3))
    reference[:, 0] = 2.0 * np.sin(np.pi * time)
    return {"time_s": time, "reference": reference, "state": np.zeros(1), "command_limit": 1.0}


def test_batch_is_the_same_to_the_bit_on_one_and_two_threads_and_equals_single_runs():
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.04),))
    machine = LinearMachine.of(model, "duty", Load())
    gains = np.column_stack((np.linspace(0.05, 0.3, 20), np.full(20, 1e-3)))
    given = loop_inputs(1001) | {"controller": proportional_integral, "parameters": gains}
    one, two = (propagate_batch(machine, **given, threads=n, keep_torque=True) for n in (1, 2))
    assert np.array_equal(one.torque_Nm, two.torque_Nm)
    assert np.array_equal(one.rmse_Nm, two.rmse_Nm)
    alone = run_sampled(model, command_name="duty", load=Load(), **given | {"parameters": gains[7]})
    assert np.abs(one.torque_Nm[7] - alone.torque_Nm).max() < 5e-6
    error = given["reference"][:, 0] - one.torque_Nm[7]
    assert one.rmse_Nm[7] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)


def test_batch_needs_a_machine_for_every_run():
    machine = LinearMachine.of(ActuatorModel(BENCH), "duty", Load())
    given = loop_inputs(11) | {"controller": proportional_integral, "parameters": np.ones((3, 2))}
    with pytest.raises(InputError, match="2 machines for 3 rows"):
        propagate_batch([machine, machine], **given)
