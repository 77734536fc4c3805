"""The fixed-step engine agrees with the event-driven one to a tenth of an encoder count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import (
    ContactNonlinear,
    DriveDeadTime,
    DriveDeadZone,
    DriveDelay,
    DriveSaturation,
    DriveThermal,
    GearBacklash,
    GearFriction,
    GearLoadFriction,
    GearTransmissionError,
    LoadDisturbance,
    LoadDrag,
    LoadFlexibility,
    LoadFriction,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    OffsetDeadZone,
    PowerDrag,
    RoundedDeadZone,
    SpringBoucWen,
    SpringHardening,
    SpringHysteresis,
    SpringParallel,
    SpringViscoelastic,
    StiffeningParallel,
    ThresholdDeadZone,
    TorqueRipple,
)
from rsea_core.engines.fixed_step.replay import STATE_NAMES, Replay
from rsea_core.simulation.simulate_fast import simulate_stepping
from tests.cases.fixed_step import BENCH, DUTY, TIME, numbers_with

N = 60.0
TENTH_OF_COUNT_rad = 0.1 * 2.0 * np.pi / 8192
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=300.0,
    contact_angle_rad=0.05,
    contact_damping_Nms_per_rad=0.5,
)
GEAR = GearFriction(coulomb_Nm=0.04, asymmetry=0.1, stribeck_rise=0.3)
TERMS = {
    "nominal": (),
    "gear-friction": (GEAR,),
    "gear-load-friction": (GearLoadFriction(lead_angle_rad=0.06, friction_coefficient=0.07),),
    "motor-cogging, three waves": (
        MotorCogging(
            amplitude_Nm=0.0,
            cycles_per_rev=12.0,
            amplitude_2_Nm=0.008,
            cycles_2_per_rev=8.0,
            phase_2_rad=0.4,
            amplitude_3_Nm=0.003,
            cycles_3_per_rev=24.0,
        ),
    ),
    "gear-transmission-error, twice a turn": (
        GearTransmissionError(
            wheel_second_amplitude_rad=1e-3,
            wheel_second_phase_rad=0.3,
            worm_second_amplitude_rad=2e-4,
            worm_second_phase_rad=1.1,
            worm_third_amplitude_rad=5e-5,
            worm_third_phase_rad=0.7,
        ),
    ),
    "gear-transmission-error": (
        GearTransmissionError(wheel_amplitude_rad=2e-3, worm_amplitude_rad=3e-4),
    ),
    "motor-cogging": (MotorCogging(amplitude_Nm=0.01, cycles_per_rev=12.0),),
    "drive-dead-zone": (DriveDeadZone(width_duty=0.03),),
    "drive-dead-zone, threshold": (ThresholdDeadZone(width_duty=0.05),),
    "drive-dead-zone, rounded": (RoundedDeadZone(width_duty=0.03),),
    "drive-dead-zone, offset": (OffsetDeadZone(width_duty=0.03, offset_after=0.02),),
    "drive-dead-zone, dead time": (DriveDeadTime(width_duty=0.03, crossover_A=0.1),),
    "drive-saturation, one way": (DriveSaturation(source_resistance_ohm=2.0, returned_share=0.0),),
    "drive-saturation, no capacitor": (
        DriveSaturation(source_resistance_ohm=2.0, returned_share=0.5, ripple_share=1.0),
    ),
    "drive-saturation": (DriveSaturation(source_resistance_ohm=0.5, current_limit_A=0.8),),
    "drive-delay": (DriveDelay(delay_s=2.3e-3),),
    "spring-hardening": (SpringHardening(stiffness_ratio_at_0p15rad=2.0),),
    "spring-parallel": (SpringParallel(stiffness_Nm_per_rad=2.0),),
    "spring-parallel, cubic": (
        StiffeningParallel(stiffness_Nm_per_rad=1.0, cubic_Nm_per_rad3=20.0, up_to_rad=0.3),
    ),
    "load-friction": (LoadFriction(coulomb_Nm=0.08, stribeck_rise=0.4),),
    "load-drag": (LoadDrag(torque_at_5_rad_per_s_Nm=1.0),),
    "load-drag, power": (PowerDrag(torque_at_5_rad_per_s_Nm=1.0, exponent=1.6),),
    "load-unbalance": (LoadUnbalance(torque_amplitude_Nm=0.2, angle_rad=1.0),),
    "load-position-torque": (
        LoadPositionTorque(
            first_rad=-0.4, last_rad=0.4, node_Nm=0.15 * np.cos(0.85 * np.arange(32))
        ),
    ),
    "load-disturbance": (LoadDisturbance(start_s=1.00037, end_s=1.5004, peak_Nm=0.5),),
    "load-disturbance, ramp": (
        LoadDisturbance(start_s=1.00037, end_s=1.5004, peak_Nm=0.5, rise_s=0.2003),
    ),
    "gear-friction, presliding": (GearFriction(coulomb_Nm=0.04, presliding_rad=0.03),),
    "gear-friction, Stribeck shape": (
        GearFriction(coulomb_Nm=0.03, stribeck_rise=0.5, stribeck_shape=1.3),
    ),
    "gear-friction, arctangent": (
        GearFriction(
            coulomb_Nm=0.0,
            viscous_Nms_per_rad=1e-4,
            arctan_Nm=0.02,
            arctan_velocity_rad_per_s=1.0,
            offset_Nm=0.003,
        ),
    ),
    "gear-backlash": (GearBacklash(width_rad=4e-3),),
    "motor-ripple": (TorqueRipple(ripple_fraction=0.05, cycles_per_rev=6.0),),
    "drive-thermal": (
        DriveThermal(
            winding_heat_capacity_J_per_K=5.0,
            winding_to_case_W_per_K=0.5,
            case_heat_capacity_J_per_K=20.0,
            case_to_ambient_W_per_K=0.3,
            torque_constant_fall_per_K=1e-3,
            torque_constant_fall_per_winding_K=5e-4,
            start_winding_rise_K=10.0,
        ),
    ),
    "spring-hysteresis": (SpringHysteresis(stiffness_1_Nm_per_rad=20.0, yield_1_rad=3e-3),),
    "spring-hysteresis, Bouc-Wen": (
        SpringBoucWen(stiffness_Nm_per_rad=20.0, yield_rad=5e-3, exponent=1.5, shape=0.4),
    ),
    "spring-viscoelastic": (
        SpringViscoelastic(
            damping_Nms_per_rad=0.05, branch_stiffness_1_Nm_per_rad=15.0, branch_time_1_s=0.05
        ),
    ),
    "load-friction, presliding": (LoadFriction(coulomb_Nm=0.08, presliding_rad=2e-3),),
    "load-friction, bearing load": (LoadFriction(coulomb_Nm=0.05, normal_lever_m=0.02),),
    "load-flexibility": (
        LoadFlexibility(
            link_stiffness_Nm_per_rad=60.0, outer_fraction=0.4, link_damping_Nms_per_rad=0.01
        ),
    ),
    "contact-nonlinear": (ContactNonlinear(exponent=1.5, loss_factor_s_per_rad=0.2),),
}
# one law of each effect
TERMS["all together"] = tuple({t.effect: t for terms in TERMS.values() for t in terms}.values())


@pytest.mark.parametrize("name", TERMS)
def test_each_effect_agrees_with_the_event_driven_engine_to_a_tenth_of_a_count(name):
    contact = name in ("contact-nonlinear", "all together")
    inputs = Inputs(time_s=TIME, duty=DUTY, load=CONTACT if contact else Load())
    model = ActuatorModel(BENCH, TERMS[name])
    precise, fast = simulate(model, inputs), simulate_stepping(model, inputs)
    assert np.ptp(precise.load_angle_rad) > 0.05
    wheel = np.abs(fast.wheel_angle_rad - precise.wheel_angle_rad).max()
    load = np.abs(fast.load_angle_rad - precise.load_angle_rad).max()
    assert max(wheel, load) < TENTH_OF_COUNT_rad
    assert np.abs(fast.current_A - precise.current_A).mean() < 5e-3
    assert fast.columns().keys() <= precise.columns().keys()
    np.testing.assert_allclose(fast.wheel_stuck_s[-1], precise.wheel_stuck_s[-1], atol=0.03)


@pytest.mark.parametrize("load", ["locked", "free", "constant-torque", "imposed"])
@pytest.mark.parametrize("drive", ["voltage_V", "current_command_A", "motor_torque_Nm"])
def test_every_drive_and_load_agrees_with_the_event_driven_engine(drive, load):
    scale = {"voltage_V": 48.0, "current_command_A": 8.0, "motor_torque_Nm": 1.0}[drive]
    more = {"load_torque_Nm": -0.8} if load == "constant-torque" else {}
    inputs = Inputs(
        time_s=TIME,
        **{drive: 0.5 * scale * DUTY},
        load=Load(kind=load, **more),
        load_angle_rad=0.05 * np.sin(9.0 * TIME) if load == "imposed" else None,
        initial_motor_angle_rad=0.6,
    )
    rig = replace(BENCH, terminal_inductance_H=None if drive == "voltage_V" else 4.56e-3)
    model = ActuatorModel(rig, (GEAR,))
    precise, fast = simulate(model, inputs), simulate_stepping(model, inputs)
    wheel = np.abs(fast.wheel_angle_rad - precise.wheel_angle_rad).max()
    assert wheel < TENTH_OF_COUNT_rad * max(1.0, np.ptp(precise.load_angle_rad))
    # a tenth of a count of both angles at the spring
    assert np.abs(fast.torque_Nm - precise.torque_Nm).max() < 2.0 * 65.8 * TENTH_OF_COUNT_rad


@pytest.mark.parametrize("parts", [("drive", "gear", "load"), ("drive", "gear"), ("load",)])
def test_partial_machines_agree_with_the_event_driven_engine(parts):
    rig = replace(BENCH, parts=parts)
    load = Load(kind="pendulum" if "load" in parts else "free")
    more = {"duty": DUTY} if "drive" in parts else {"initial_load_angle_rad": 0.5}
    terms = (GEAR,) if "gear" in parts else (LoadFriction(coulomb_Nm=0.02),)
    inputs = Inputs(time_s=TIME, load=load, **more)
    model = ActuatorModel(rig, terms)
    precise, fast = simulate(model, inputs), simulate_stepping(model, inputs)
    assert np.abs(fast.load_angle_rad - precise.load_angle_rad).max() < TENTH_OF_COUNT_rad
    assert np.abs(fast.wheel_angle_rad - precise.wheel_angle_rad).max() < TENTH_OF_COUNT_rad


def test_halving_the_step_quarters_the_error_with_stick_and_slip():
    model = ActuatorModel(BENCH, (GEAR, LoadFriction(coulomb_Nm=0.08)))
    inputs = Inputs(time_s=TIME, duty=DUTY)
    exact = simulate_stepping(model, inputs, step_s=1e-3 / 64).load_angle_rad
    found = [
        np.abs(simulate_stepping(model, inputs, step_s=h).load_angle_rad - exact).max()
        for h in (1e-3, 2.5e-4)
    ]
    assert found[0] / found[1] > 2.0**3.4


def test_a_joint_held_by_friction_does_not_creep():
    time = np.arange(0.0, 100.0, 1e-2)
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.2), LoadFriction(coulomb_Nm=0.5)))
    duty = 0.03 + 0.01 * np.sin(300.0 * time)
    rows = Replay.of(Inputs(time_s=time, duty=duty)).run(model)
    assert np.ptp(rows[:, 3]) > 0.1  # the current goes on
    assert np.all(rows[:, [0, 1, 5, 6]] == 0.0)


def test_self_locking_worm_holds_a_weight_exactly():
    worm = GearLoadFriction(lead_angle_rad=0.05, friction_coefficient=0.08)
    load = Load(kind="constant-torque", load_torque_Nm=3.0)
    rig = replace(BENCH, load_viscous_Nms_per_rad=0.5)
    inputs = Inputs(time_s=np.arange(0.0, 20.0, 5e-3), duty=np.zeros(4000), load=load)
    rows = Replay.of(inputs).run(ActuatorModel(rig, (worm,)))
    assert np.all(rows[:, 0] == 0.0)
    assert rows[-1, 2] == pytest.approx(-3.0, rel=1e-6)


def bench_of(deflection, time, **fx):
    rig = Rig(name="spring", parts=("spring",), spring_stiffness_Nm_per_rad=65.8)
    replay = Replay(time_s=time, spring_deflection_rad=deflection)
    return replay.run(numbers_with(replay, rig, **fx))[:, 2]


def test_slip_loop_has_masings_area_and_does_not_depend_on_the_rate():
    """Each element dissipates 4 k y (A - y) a cycle (Iwan 1966)."""
    slip = {"slip_stiffness_1": 20.0, "slip_yield_1": 0.01, "slip_stiffness_2": 9.0}
    slip |= {"slip_yield_2": 0.04, "internal_states": 1.0}
    time = np.arange(0.0, 3.0, 1e-3)
    deflection = 0.15 * np.sin(2.0 * np.pi * time)
    torque = bench_of(deflection, time, **slip)
    cycle = slice(1000, 2001)
    area = np.trapezoid(torque[cycle], deflection[cycle])
    expected = sum(4.0 * k * y * (0.15 - y) for k, y in ((20.0, 0.01), (9.0, 0.04)))
    assert area == pytest.approx(expected, rel=2e-4)
    slow = bench_of(deflection, 13.0 * time, **slip)
    np.testing.assert_allclose(slow, torque, atol=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 1.7])
def test_bouc_wen_follows_its_differential_equation(exponent):
    k, y, shape = 20.0, 0.02, 0.6

    def rate(t, z):
        d = 0.15 * 6.0 * np.cos(6.0 * t)
        return d * (1.0 - abs(z / y) ** exponent * (shape + (1.0 - shape) * np.sign(d * z)))

    time = np.arange(0.0, 2.0, 1e-3)
    exact = solve_ivp(rate, (0.0, 2.0), [0.0], t_eval=time, rtol=1e-10, atol=1e-13, max_step=1e-3)
    deflection = 0.15 * np.sin(6.0 * time)
    fx = {"bouc_wen_stiffness": k, "bouc_wen_yield": y, "bouc_wen_exponent": exponent}
    torque = bench_of(deflection, time, **fx, bouc_wen_shape=shape, internal_states=1.0)
    np.testing.assert_allclose(torque - 65.8 * deflection, k * exact.y[0], atol=4e-4)


def test_maxwell_branch_under_a_ramp_has_its_closed_form():
    time = np.arange(0.0, 1.0, 2e-3)
    fx = {"branch_stiffness_1": 15.0, "branch_time_1": 0.05, "internal_states": 1.0}
    torque = bench_of(0.4 * time, time, **fx, spring_damping=0.3)
    branch = 15.0 * 0.4 * 0.05 * (1.0 - np.exp(-time / 0.05))
    np.testing.assert_allclose(torque, 65.8 * 0.4 * time + branch + 0.3 * 0.4, rtol=1e-9)


def test_flexible_link_with_relaxing_spring_agrees_with_the_matrix_exponential():
    """A linear machine: motor torque steps, seven mechanical states and a branch, by expm."""
    inner, outer, k, c = 0.018, 0.012, 60.0, 0.01
    K, k_b, T, d = 65.8, 15.0, 0.05, 0.05
    J, B = N**2 * 3.2e-4 + 2.0e-3, N**2 * 1e-4 + 0.02
    spring = np.array([K, d, -K, -d, 0.0, 0.0, k_b])  # wheel, speed, load, speed, tip, speed, q
    A = np.zeros((8, 8))
    A[0, 1] = A[2, 3] = A[4, 5] = 1.0
    A[1, :7], A[3, :7] = -spring / J, spring / inner
    A[1, 1] -= B / J
    link = np.array([0.0, 0.0, k, c, -k, -c, 0.0])
    A[3, :7] -= link / inner
    A[3, 3] -= 0.02 / inner
    A[5, :7] = link / outer
    A[6, [1, 3, 6]] = 1.0, -1.0, -1.0 / T
    A[1, 7] = N / J
    step, torque = expm(1e-3 * A), 0.05 * np.sign(np.sin(9.0 * TIME + 0.1))
    x, exact = np.zeros(8), np.zeros((TIME.size, 8))
    for row, value in enumerate(torque):
        exact[row] = x
        x = step @ np.append(x[:7], value)
    replay = Replay.of(Inputs(time_s=TIME, motor_torque_Nm=torque, load=Load(kind="free")))
    numbers = numbers_with(
        replay, link_stiffness=k, link_inertia=outer, link_damping=c, spring_damping=d,
        branch_stiffness_1=k_b, branch_time_1=T, internal_states=1.0,
    ).with_plant(load_inertia=inner)  # fmt: skip
    rows, states = replay.run(numbers, with_states=True)
    assert np.abs(rows[:, 1] - exact[:, 2]).max() < TENTH_OF_COUNT_rad
    assert np.abs(rows[:, 2] - exact[:, :7] @ spring).max() < 5e-3
    tip = states[:, STATE_NAMES.index("link_angle_rad")]
    assert np.abs(tip - exact[:, 4]).max() < TENTH_OF_COUNT_rad


def test_heating_at_constant_current_agrees_with_the_matrix_exponential():
    time = np.arange(0.0, 60.0, 1e-2)
    heat = {"winding_heat_capacity": 5.0, "winding_to_case": 0.5, "case_heat_capacity": 50.0}
    heat |= {"case_to_ambient": 0.3, "start_winding_rise": 3.0, "start_case_rise": 2.0}
    replay = Replay.of(
        Inputs(time_s=time, current_command_A=np.full(time.size, 3.0), load=Load(kind="locked"))
    )
    rows, states = replay.run(numbers_with(replay, **heat, internal_states=1.0), with_states=True)
    A = np.array([[-0.5 / 5.0, 0.5 / 5.0], [0.5 / 50.0, -0.8 / 50.0]])
    rest = np.linalg.solve(A, -np.array([3.78 * 9.0 / 5.0, 0.0]))
    exact = rest + expm(60.0 * A * (1.0 - 1.0 / 6000.0)) @ (np.array([3.0, 2.0]) - rest)
    np.testing.assert_allclose(states[-1, 9:11], exact, rtol=1e-6)
    assert rows[-1, 4] == states[-1, 10]


def test_presliding_is_a_spring_of_level_over_displacement_and_yields_at_the_level():
    level, width = 2.4, 5e-4
    fx = {"gear_presliding": width, "gear_coulomb_forward": level, "gear_coulomb_backward": level}
    rig = replace(BENCH, parts=("drive", "gear"))
    time = np.arange(0.0, 40.0, 2e-3)
    motor_torque = 0.6 * level / N * np.clip(time / 10.0, 0.0, 1.0)
    replay = Replay.of(Inputs(time_s=time, motor_torque_Nm=motor_torque, load=Load(kind="free")))
    rows = replay.run(numbers_with(replay, rig, internal_states=1.0, **fx))
    assert rows[-1, 0] / N == pytest.approx(0.6 * width, rel=1e-3)
    replay = Replay.of(
        Inputs(time_s=time, motor_torque_Nm=3.0 * motor_torque, load=Load(kind="free"))
    )
    rows = replay.run(numbers_with(replay, rig, internal_states=1.0, **fx))
    steady = 0.8 * level / (N**2 * 1e-4 + 0.02)
    assert rows[-1, 5] / N == pytest.approx(steady, rel=1e-3)


def test_backlash_shows_its_whole_width_at_slow_reversal_and_keeps_momentum():
    width = 4e-3
    time = np.arange(0.0, 40.0, 2e-3)
    duty = 0.05 * np.sin(2.0 * np.pi * time / 20.0)
    replay = Replay.of(Inputs(time_s=time, duty=duty, load=Load(kind="locked")))
    fx = {"backlash_width": width, "backlash_wheel_inertia": 2e-3, "backlash_wheel_damping": 0.02}
    rows = replay.run(numbers_with(replay, internal_states=1.0, **fx))
    lost = rows[:, 0] / N - rows[:, 2] / 65.8
    pressed = np.abs(rows[:, 2]) > 0.3
    np.testing.assert_allclose(lost[pressed], 0.5 * width * np.sign(rows[pressed, 2]), atol=2e-6)
    assert np.abs(lost).max() < 0.5 * width + 2e-6


@settings(max_examples=30, deadline=None)
@given(
    numbers=st.fixed_dictionaries(
        {
            "gear_coulomb_forward": st.floats(0.0, 4.0),
            "gear_drive_loss": st.floats(0.0, 1.5),
            "gear_presliding": st.sampled_from([0.0, 3e-4]),
            "load_coulomb": st.floats(0.0, 0.5),
            "load_drag": st.floats(0.0, 0.1),
            "slip_stiffness_1": st.floats(0.0, 40.0),
            "branch_stiffness_1": st.floats(0.0, 40.0),
            "bouc_wen_stiffness": st.floats(0.0, 30.0),
            "spring_damping": st.floats(0.0, 0.2),
            "gear_atan_level": st.floats(0.0, 2.0),
            "backlash_width": st.sampled_from([0.0, 5e-3]),
            "wheel_error": st.floats(0.0, 5e-3),
        }
    ),
    speed=st.floats(-3.0, 3.0),
    deflection=st.floats(-0.1, 0.1),
)
def test_an_undriven_machine_never_gains_energy(numbers, speed, deflection):
    time = np.arange(0.0, 1.0, 1e-3)
    replay = Replay.of(Inputs(time_s=time, duty=np.zeros(time.size), load=Load(kind="locked")))
    fixed = {"wheel_dry": 1.0, "load_dry": 1.0, "slip_yield_1": 0.01, "branch_time_1": 0.05}
    fixed |= {"bouc_wen_yield": 0.01, "bouc_wen_exponent": 1.5, "bouc_wen_shape": 0.6}
    fixed |= {"gear_atan_velocity": 0.02, "backlash_wheel_inertia": 2e-3, "internal_states": 1.0}
    fixed["gear_coulomb_backward"] = numbers["gear_coulomb_forward"]
    fixed["gear_backdrive_loss"] = numbers["gear_drive_loss"]
    bare = numbers_with(replay, **fixed, **numbers)
    start = replay.start_state(bare)
    start[[1, 5]], start[[2, 6]] = deflection, speed
    rows = replay.run(bare, start=start)
    J, most = N**2 * 3.2e-4 + 2.0e-3, 65.8 + 40.0 + 40.0 + 30.0
    first = 0.5 * J * speed**2 + 0.5 * most * (abs(deflection) + 1e-2) ** 2
    kinetic = 0.5 * J * (rows[:, 5] / N) ** 2
    assert kinetic.max() <= 1.01 * first + 1e-6


def test_linear_axis_reads_metres_as_radians():
    rig = replace(BENCH, axis="linear")
    inputs = Inputs(time_s=TIME, duty=DUTY)
    same = simulate_stepping(ActuatorModel(BENCH), inputs)
    linear = simulate_stepping(ActuatorModel(rig), inputs)
    assert np.array_equal(same.load_angle_rad, linear.load_angle_rad)
