"""Spring, load and surroundings of the true machine reach every limit that can be written down."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from dftfs.proof.effects_spring import LOOP_RAD, loop_of
from dftfs.proof.machine import Physics, Series
from dftfs.proof.readings import Fault, exact_reading
from dftfs.proof.truth_laws import elastic_torque, loop_torque
from tests.cases.proof import BARE, LOSSLESS, run

K, N = BARE.spring_stiffness_Nm_per_rad, BARE.gear_ratio
WEIGHT = 9.80665 * BARE.load_mass_kg * BARE.load_distance_m


def test_one_stop_encloses_four_yields_times_the_travel_left():
    stiffness, top = 40.0, 0.4
    loop = loop_of(Physics(), np.array([[stiffness, top]]))
    assert loop["loop_width_Nm"] == pytest.approx(2 * top, rel=1e-9)
    assert loop["loop_energy_J"] == pytest.approx(4 * top * (LOOP_RAD - top / stiffness), rel=1e-4)


def test_bouc_wen_loop_of_exponent_one_has_its_closed_area():
    """x' = 1 - x from the reversal at -s on: torque 1 - 2 exp(-u / l) over a travel of 2 A."""
    top, length = 0.5, 0.02
    loop = loop_of(
        Physics(loop_torque_Nm=top, loop_yield_rad=length, loop_exponent=1.0), np.zeros((0, 2))
    )
    # on the way back from saturation the loop unloads linearly, l long, then bends in
    one_direction = 2 * LOOP_RAD * top - top * (0.5 * length + length + length)
    assert loop["loop_energy_J"] == pytest.approx(2 * one_direction, rel=2e-3)
    assert loop["loop_width_Nm"] == pytest.approx(2 * top, rel=2e-3)


def test_loops_do_not_know_how_fast_they_are_run():
    stops = np.array([[40.0, 0.2], [10.0, 0.3]])
    slow = LOOP_RAD * np.sin(np.linspace(0, 20, 20001))
    a = loop_torque(Physics(), stops, slow)
    b = loop_torque(Physics(), stops, slow[::20])
    np.testing.assert_allclose(a[::20], b, atol=0.03)
    turns = np.cumsum(np.r_[0.0, np.diff(slow)])
    np.testing.assert_allclose(loop_torque(Physics(), stops, turns), a, atol=1e-12)


@pytest.mark.parametrize(("ratio", "sign"), [(1.3, 1.0), (0.8, -1.0)])
def test_tangent_at_the_reference_deflection_has_the_ratio(ratio, sign):
    b = (math.acosh(ratio) if sign > 0 else -math.acos(ratio)) / LOOP_RAD
    physics, h = Physics(hardening_per_rad=b), 1e-6
    tangent = [
        (elastic_torque(BARE, physics, x + h) - elastic_torque(BARE, physics, x - h)) / (2 * h)
        for x in (0.0, LOOP_RAD)
    ]
    assert tangent[0] == pytest.approx(K, rel=1e-6)
    assert tangent[1] / tangent[0] == pytest.approx(ratio, rel=1e-6)


@pytest.mark.parametrize("side", [0.0, 1.0, -1.0])
def test_touching_coils_add_their_stiffness_on_their_side_only(side):
    physics = Physics(
        coils_touch_rad=0.1, coils_touch_side=side, coils_touch_stiffness_Nm_per_rad=100.0
    )
    for d in (-0.15, 0.15):
        extra = elastic_torque(BARE, physics, d) - K * d
        expected = math.copysign(5.0, d) if side == 0.0 or side * d > 0 else 0.0
        assert extra == pytest.approx(expected, abs=6e-3)


@pytest.mark.parametrize("hertz", [0.5, 3.0])
def test_branches_give_the_complex_stiffness_of_maxwell_elements(hertz):
    rows = np.array([[6.0, 0.05], [4.0, 0.5]])
    count = round(6.0 / 1e-3)
    duty = 0.2 * np.sin(2 * np.pi * hertz * 1e-3 * np.arange(count))
    v = run(BARE, "locked", duty, series=Series(branches=rows), seconds=6.0).values
    last = slice(count - round(2.0 / 1e-3), count)  # whole periods
    wave = np.exp(-2j * np.pi * hertz * 1e-3 * np.arange(count))[last]
    ratio = (v["torque_Nm"][last] @ wave) / (v["motor_angle_rad"][last] / N @ wave)
    s = 2j * np.pi * hertz * rows[:, 1]
    assert ratio == pytest.approx(K + (rows[:, 0] * s / (1 + s)).sum(), rel=2e-3)


def test_clamp_carries_no_more_than_its_slip_torque():
    v = run(BARE, "locked", 0.08, physics=Physics(clamp_slip_Nm=5.0), seconds=3.0).values
    assert v["torque_Nm"].max() == pytest.approx(5.0, abs=0.02)
    assert v["motor_angle_rad"][-1] / N * K > 8.0  # what a clamp that holds would carry


def test_free_link_rings_at_the_frequency_of_two_masses():
    hertz, share = 12.0, 0.6
    together = share * (1 - share) * BARE.load_inertia_kgm2
    physics = Physics(
        tip_share=share, link_stiffness_Nm_per_rad=(2 * np.pi * hertz) ** 2 * together
    )
    machine = LOSSLESS._replace(spring_stiffness_Nm_per_rad=1e-9)
    v = run(machine, "free", 0.0, physics=physics, outside_Nm=1.0, seconds=2.0).values
    time = 1e-3 * np.arange(2000)
    # under a constant torque the hub runs ahead of the rigid motion and rings about it
    ringing = v["load_angle_rad"] - 0.5 * time**2 / BARE.load_inertia_kgm2
    ringing = ringing - ringing.mean()
    upward = np.flatnonzero((ringing[:-1] < 0) & (ringing[1:] >= 0))
    exact = upward - ringing[upward] / (ringing[upward + 1] - ringing[upward])
    assert 1.0 / (1e-3 * np.diff(exact).mean()) == pytest.approx(hertz, rel=1e-3)


def test_drag_ends_at_the_speed_where_it_balances_the_torque():
    physics = Physics(drag_coefficient=0.1, drag_exponent=1.8)
    machine = LOSSLESS._replace(spring_stiffness_Nm_per_rad=1e-9)
    v = run(machine, "free", 0.0, physics=physics, outside_Nm=2.0, seconds=4.0).values
    assert v["load_velocity_rad_per_s"][-1] == pytest.approx((2.0 / 0.1) ** (1 / 1.8), rel=1e-6)


def test_joint_friction_slides_at_its_level():
    physics = Physics(load_coulomb_Nm=0.5, load_bristle_damping_Nms_per_rad=0.5)
    machine = BARE._replace(spring_stiffness_Nm_per_rad=1e-9, load_viscous_Nms_per_rad=0.2)
    v = run(machine, "free", 0.0, physics=physics, outside_Nm=1.0, seconds=4.0).values
    assert v["load_velocity_rad_per_s"][-1] == pytest.approx(0.5 / 0.2, rel=1e-3)
    held = run(machine, "free", 0.0, physics=physics, outside_Nm=0.2, seconds=2.0).values
    assert np.abs(held["load_angle_rad"]).max() < 2e-3  # seven bristle lengths, and it stays


@pytest.mark.parametrize(
    ("physics", "torque_at"),
    [
        (Physics(parallel_stiffness_Nm_per_rad=1.0), lambda x: WEIGHT * math.sin(x) + x),
        (
            Physics(unbalance_Nm=0.3, unbalance_angle_rad=1.0),
            lambda x: WEIGHT * math.sin(x) + 0.3 * math.sin(x + 1.0),
        ),
    ],
    ids=["parallel spring", "unbalance"],
)
def test_link_rests_where_its_torques_balance(physics, torque_at):
    machine = BARE._replace(spring_stiffness_Nm_per_rad=1e-9, load_viscous_Nms_per_rad=0.3)
    v = run(machine, "pendulum", 0.0, physics=physics, outside_Nm=0.4, seconds=6.0).values
    assert torque_at(v["load_angle_rad"][-1]) == pytest.approx(0.4, rel=1e-4)


def test_link_pressed_against_a_power_law_sinks_to_its_depth():
    machine = BARE._replace(
        spring_stiffness_Nm_per_rad=1e-9, load_mass_kg=0.0, contact_angle_rad=0.02
    )
    physics = Physics(
        contact_exponent=1.5, contact_power_stiffness=400.0, contact_power_damping=200.0
    )
    v = run(machine, "contact", 0.0, physics=physics, outside_Nm=2.0, seconds=6.0).values
    assert v["load_angle_rad"][-1] - 0.02 == pytest.approx((2.0 / 400.0) ** (1 / 1.5), rel=5e-3)


def test_soft_mount_rings_with_its_own_inertia_and_the_spring():
    """Motor held by a huge inertia, output clamped: one swing on mount and spring in parallel."""
    hertz, inertia = 12.0, 0.2
    stiffness = inertia * (2 * np.pi * hertz) ** 2
    physics = Physics(
        mount_inertia_kgm2=inertia,
        mount_stiffness_Nm_per_rad=stiffness,
        teeth_stiffness_Nm_per_rad=3e4,
        teeth_damping_Nms_per_rad=4.0,
    )
    held = LOSSLESS._replace(motor_inertia_kgm2=1e3)
    v = run(
        held, "locked", 0.0, physics=physics, by_current=True, motor_angle_rad=3.0, seconds=2.0
    ).values
    torque = v["torque_Nm"] - v["torque_Nm"].mean()
    upward = np.flatnonzero((torque[:-1] < 0) & (torque[1:] >= 0))
    exact = upward - torque[upward] / (torque[upward + 1] - torque[upward])
    moving = inertia + BARE.output_inertia_kgm2
    expected = math.sqrt((stiffness + K) / moving) / (2 * math.pi)
    assert 1.0 / (1e-3 * np.diff(exact).mean()) == pytest.approx(expected, rel=5e-3)


def test_a_magnet_near_the_link_has_the_energy_of_its_well():
    """Released inside its reach without friction, the load swings about the magnet."""
    magnet, place, reach = 0.4, 0.1, 0.2
    physics = Physics(magnet_Nm=magnet, magnet_angle_rad=place, magnet_reach_rad=reach)

    def torque(angle: float) -> float:
        away = (angle - place) / reach
        return -magnet * away * np.exp(0.5 * (1.0 - away**2))

    strongest = max(abs(torque(a)) for a in np.linspace(place - 1.0, place + 1.0, 4001))
    assert strongest == pytest.approx(magnet, rel=1e-5)
    machine = LOSSLESS._replace(spring_stiffness_Nm_per_rad=1e-6, load_mass_kg=0.0)
    v = run(machine, "free", 0.0, physics=physics, seconds=2.0).values
    angle, speed = v["load_angle_rad"], v["load_velocity_rad_per_s"]
    fastest = int(np.argmax(np.abs(speed)))
    work = quad(torque, 0.0, angle[fastest])[0]
    kinetic = 0.5 * machine.load_inertia_kgm2 * speed[fastest] ** 2
    assert kinetic == pytest.approx(work, rel=1e-3)
    assert angle[fastest] == pytest.approx(place, abs=2e-3)


def test_counts_are_lost_at_speed_only_and_an_amplifier_fades_at_large_readings():
    time = 1e-3 * np.arange(4001)
    angle = np.where(time < 2.0, 10.0 * time, 20.0 + 2.0 * (time - 2.0))
    lost = exact_reading(angle, time, Fault(lost_share=0.1, lost_above_per_s=5.0))
    assert lost[2000] == pytest.approx(18.0, abs=0.02)
    np.testing.assert_allclose(np.diff(lost[2010:]), np.diff(angle[2010:]), atol=1e-12)
    faded = exact_reading(np.array([0.01, 3.0, -3.0]), time[:3], Fault(fade=3.0))
    np.testing.assert_allclose(faded, [0.01, 2.25, -2.25], rtol=1e-5)
