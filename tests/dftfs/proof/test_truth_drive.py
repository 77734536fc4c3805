"""Drive and gear of the true machine reach every limit that can be written down."""

import math

import numpy as np
import pytest

from dftfs.proof.bench import rested
from dftfs.proof.machine import AMBIENT_C, COPPER_PER_K, InternalStates, Physics, Series
from tests.cases.proof import BARE, run

K, N, KT = BARE.spring_stiffness_Nm_per_rad, BARE.gear_ratio, BARE.torque_constant_Nm_per_A
LIGHT = BARE._replace(load_inertia_kgm2=1e-3)  # settles soon
SLIDING = (BARE.output_viscous_Nms_per_rad + BARE.load_viscous_Nms_per_rad) / N  # per motor speed


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sliding_friction_is_the_coulomb_torque_of_its_direction(sign):
    plus, minus = 0.03, 0.02
    physics = Physics(gear_coulomb_plus_Nm=plus, gear_coulomb_minus_Nm=minus)
    machine = LIGHT._replace(motor_viscous_Nms_per_rad=1e-3)  # settles ten times sooner
    motion = run(machine, "free", 0.2 * sign, physics=physics, by_current=True, seconds=8.0).values
    speed = motion["motor_velocity_rad_per_s"][-1]
    viscous = (1e-3 + SLIDING / N) * speed
    friction = KT * 0.2 * sign - viscous
    assert friction == pytest.approx(plus if sign > 0 else -minus, rel=2e-3)


def test_bristle_bends_exponentially_before_it_slides():
    """Quasi-static loading: z = l (1 - exp(-x / l)) (Canudas de Wit 1995 integrated over x)."""
    length, top = 0.02, 0.05
    physics = Physics(
        gear_coulomb_plus_Nm=top,
        gear_coulomb_minus_Nm=top,
        gear_bristle_rad=length,
        gear_bristle_damping_Nms_per_rad=0.01,
    )
    soft = BARE._replace(spring_stiffness_Nm_per_rad=1e-9)
    current = 0.6 * top / KT * np.linspace(0.0, 1.0, 4000)
    motion = run(soft, "locked", current, physics=physics, by_current=True, seconds=4.0).values
    assert motion["motor_angle_rad"][-1] == pytest.approx(-length * math.log(1 - 0.6), rel=5e-3)


def test_stribeck_friction_breaks_away_at_its_static_level():
    physics = Physics(
        gear_coulomb_plus_Nm=0.03,
        gear_coulomb_minus_Nm=0.03,
        gear_static_ratio=1.5,
        gear_bristle_damping_Nms_per_rad=0.05,
    )
    soft = BARE._replace(spring_stiffness_Nm_per_rad=1e-9)
    current = 0.06 / KT * np.linspace(0.0, 1.0, 6000)
    motion = run(soft, "locked", current, physics=physics, by_current=True, seconds=6.0).values
    moving = np.argmax(motion["motor_angle_rad"] > 0.05)
    assert KT * current[moving] == pytest.approx(0.045, rel=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_driven_worm_needs_the_torque_of_the_friction_cone(sign):
    lead, friction = 0.12, 0.05
    physics = Physics(worm_lead_rad=lead, worm_friction_rad=friction)
    machine = LIGHT._replace(output_viscous_Nms_per_rad=2.0)
    motion = run(machine, "free", 0.3 * sign, physics=physics, by_current=True, seconds=8.0).values
    speed = motion["motor_velocity_rad_per_s"][-1]
    passed = (2.0 + BARE.load_viscous_Nms_per_rad) * speed / N
    put_in = KT * 0.3 * sign - BARE.motor_viscous_Nms_per_rad * speed
    efficiency = passed / N / put_in
    assert efficiency == pytest.approx(math.tan(lead) / math.tan(lead + friction), rel=1e-3)


def test_the_backdriven_worm_passes_the_other_side_of_the_friction_bound():
    lead, friction = 0.12, 0.05
    physics = Physics(worm_lead_rad=lead, worm_friction_rad=friction)
    machine = LIGHT._replace(motor_viscous_Nms_per_rad=2e-3)
    motion = run(
        machine, "free", 0.0, physics=physics, by_current=True, outside_Nm=2.0, seconds=8.0
    ).values
    speed = motion["motor_velocity_rad_per_s"][-1]
    into_wheel = 2.0 - SLIDING * speed
    efficiency = 2e-3 * speed * N / into_wheel
    assert efficiency == pytest.approx(math.tan(lead - friction) / math.tan(lead), rel=1e-3)


def test_a_worm_steeper_in_friction_than_in_lead_locks_itself():
    damped = BARE._replace(load_viscous_Nms_per_rad=0.5)

    def last_second(friction: float) -> float:
        physics = Physics(worm_lead_rad=0.1, worm_friction_rad=friction)
        motion = run(
            damped, "free", 0.0, physics=physics, by_current=True, outside_Nm=3.0, seconds=3.0
        )
        return float(np.ptp(motion.values["motor_angle_rad"][2000:]))

    assert last_second(0.12) < 1e-6
    assert last_second(0.09) > 1.0


@pytest.mark.parametrize("width", [0.003, 0.012])
def test_lost_motion_at_reversal_is_the_backlash(width):
    physics = Physics(
        backlash_rad=width, teeth_stiffness_Nm_per_rad=3e4, teeth_damping_Nms_per_rad=4.0
    )
    time = 1e-3 * np.arange(8000)
    current = 0.2 * np.sin(2 * np.pi * 0.25 * time)
    damped = BARE._replace(motor_viscous_Nms_per_rad=0.02, output_viscous_Nms_per_rad=1.0)
    v = run(damped, "locked", current, physics=physics, by_current=True, seconds=8.0).values
    lost = v["motor_angle_rad"] / N - v["torque_Nm"] / K
    pressed = np.abs(v["torque_Nm"]) > 1.0
    travel = lost[pressed].max() - lost[pressed].min()
    flexed = 2 * np.abs(v["torque_Nm"]).max() / 3e4
    assert travel == pytest.approx(width + flexed, abs=1.5e-4)


def test_rigid_teeth_are_the_limit_of_stiff_ones():
    physics = Physics(teeth_stiffness_Nm_per_rad=1e6, teeth_damping_Nms_per_rad=40.0)
    duty = 0.05 * np.sin(2 * np.pi * 0.5 * 1e-3 * np.arange(2000))
    a = run(BARE, "locked", duty, seconds=2.0).values
    b = run(BARE, "locked", duty, physics=physics, seconds=2.0, step_s=5e-6).values
    np.testing.assert_allclose(b["torque_Nm"], a["torque_Nm"], atol=2e-3)


def test_gear_error_turns_the_wheel_by_its_series():
    series = Series(gear_error=np.array([[1e-3, 1.0, 0.4], [4e-3, 1 / 60, 1.0]]))
    v = run(BARE, "locked", 0.05, series=series).values
    angle = v["motor_angle_rad"]
    error = sum(a * (np.sin(n * angle + p) - np.sin(p)) for a, n, p in series.gear_error)
    np.testing.assert_allclose(v["torque_Nm"], K * (angle / N + error), atol=1e-9)


def test_cogging_holds_the_motor_up_to_its_amplitude():
    series = Series(cogging=np.array([[0.04, 12.0, 0.0]]))
    soft = BARE._replace(spring_stiffness_Nm_per_rad=1e-9, motor_viscous_Nms_per_rad=5e-3)
    for share, moves in ((0.97, False), (1.03, True)):
        current = share * 0.04 / KT * np.clip(np.arange(3000) / 2000, 0.0, 1.0)
        v = run(soft, "locked", current, series=series, by_current=True, seconds=3.0).values
        assert (v["motor_angle_rad"][-1] > math.pi / 12) == moves


def test_detent_takes_its_share_of_the_transmitted_torque():
    physics = Physics(detent_share=0.5, detent_cycles=100.0)
    damped = BARE._replace(motor_viscous_Nms_per_rad=0.01)
    v = run(damped, "locked", 0.1, physics=physics, by_current=True, seconds=6.0).values
    angle, torque = v["motor_angle_rad"][-1], v["torque_Nm"][-1]
    held = torque / N * (1.0 + 0.5 * math.sin(100.0 * angle / N))
    assert held == pytest.approx(KT * 0.1, rel=1e-4)


def test_command_inside_the_dead_zone_does_nothing_and_outside_it_loses_the_width():
    physics = Physics(dead_zone_duty=0.01)
    still = run(BARE, "pendulum", 0.008, physics=physics).values
    full = run(BARE, "pendulum", 0.2, physics=physics).values
    less = run(BARE, "pendulum", 0.19).values
    assert np.abs(still["motor_angle_rad"]).max() < 0.02 * less["motor_angle_rad"][-1]
    np.testing.assert_allclose(
        full["motor_angle_rad"], less["motor_angle_rad"], atol=2e-3 * less["motor_angle_rad"][-1]
    )


def test_supply_sag_stalls_at_the_current_of_both_resistances():
    physics = Physics(source_resistance_ohm=2.0)
    stiff = BARE._replace(spring_stiffness_Nm_per_rad=10 * K)  # settles ten times sooner
    v = run(stiff, "locked", 0.2, physics=physics, seconds=4.0).values
    expected = 0.2 * 48.0 / (BARE.terminal_resistance_ohm + 0.2**2 * 2.0)
    assert v["current_A"][-1] == pytest.approx(expected, rel=1e-6)


def test_current_stops_at_its_limit():
    v = run(BARE._replace(current_limit_A=1.5), "locked", 0.3, seconds=6.0).values
    assert v["current_A"].max() == 1.5


def test_delay_shifts_the_response_and_nothing_else():
    duty = np.where(np.arange(1000) > 100, 0.1, 0.0)
    on_time = run(BARE, "pendulum", duty).values["motor_angle_rad"]
    late = run(BARE, "pendulum", duty, physics=Physics(delay_s=7e-3)).values["motor_angle_rad"]
    np.testing.assert_allclose(late[7:], on_time[:-7], atol=1e-9)
    half = run(BARE, "pendulum", duty, physics=Physics(delay_s=0.5e-3)).values["motor_angle_rad"]
    assert on_time[500] > half[500] > on_time[499]


def test_winding_warms_to_the_temperature_of_its_own_rising_resistance():
    inner, outer, current = 1.0, 2.0, 2.0
    physics = Physics(
        winding_capacity_J_per_K=0.1,
        winding_to_case_K_per_W=inner,
        case_capacity_J_per_K=0.2,
        case_to_air_K_per_W=outer,
    )
    v = run(BARE, "locked", current, physics=physics, by_current=True, seconds=12.0).values
    cold = current**2 * BARE.terminal_resistance_ohm
    rise = cold * (inner + outer) / (1.0 - COPPER_PER_K * cold * (inner + outer))
    assert v["winding_C"][-1] - AMBIENT_C == pytest.approx(rise, rel=1e-3)
    share = outer / (inner + outer)
    assert v["temperature_C"][-1] - AMBIENT_C == pytest.approx(share * rise, rel=1e-3)


def test_a_rest_cools_both_bodies_towards_the_air():
    physics = Physics(
        winding_capacity_J_per_K=10.0,
        winding_to_case_K_per_W=1.0,
        case_capacity_J_per_K=1e9,
        case_to_air_K_per_W=1e-3,
    )
    left = rested(InternalStates(winding_C=AMBIENT_C + 40.0, case_C=AMBIENT_C), physics, 10.0)
    assert left.winding_C - AMBIENT_C == pytest.approx(40.0 * math.exp(-1.0), rel=1e-6)
    assert left.case_C == pytest.approx(AMBIENT_C, abs=1e-6)
