"""Dry friction sticks exactly and agrees with closed forms and a reference with events."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearFriction, GearLoadFriction, LoadFriction, SpringCurve
from rsea_core.errors import TermError

BENCH = Rig.preset("rsea-bench")
N = 60.0
# a shaft with a spring and nothing else that resists: motor, gear, spring against a wall
OSCILLATOR = replace(
    BENCH, motor_viscous_Nms_per_rad=0.0, output_viscous_Nms_per_rad=0.0, current_limit_A=None
)
J = N**2 * 3.2e-4 + 2.0e-3
K_S = 65.8


def torque_driven(model, time, motor_torque, load="locked", step_s=None, **more):
    return simulate(
        model,
        Inputs(time_s=time, motor_torque_Nm=motor_torque, load=Load(kind=load), **more),
        step_s=step_s,
    )


def test_block_on_a_spring_loses_4_f_over_k_per_cycle_and_stops_where_it_must():
    """Linear envelope of Coulomb damping: Den Hartog, Mechanical Vibrations, 4th ed., sec. 8.2."""
    coulomb = 0.7 / N
    start, level = 0.25, 0.7
    model = ActuatorModel(OSCILLATOR, (GearFriction(coulomb_Nm=coulomb),))
    half = np.pi * np.sqrt(J / K_S)
    cycles = 2.0 * level / K_S  # of every half swing
    swings = int(np.ceil((start - level / K_S) / cycles))
    time = np.arange(2 * swings + 5) * half / 2.0
    result = torque_driven(
        model, time, np.zeros(time.size), step_s=0.01, initial_motor_angle_rad=start * N
    )

    k = np.arange(swings + 1)
    turning = (-1.0) ** k * (start - k * cycles)
    np.testing.assert_allclose(result.wheel_angle_rad[: 2 * swings + 1 : 2], turning, atol=1e-11)
    # stuck within the band where the spring cannot overcome friction, exactly
    after = slice(2 * swings + 1, None)
    assert abs(turning[-1]) < level / K_S
    assert np.all(result.wheel_velocity_rad_per_s[after] == 0.0)
    assert np.unique(result.wheel_angle_rad[after]).size == 1


def test_belt_driven_block_sticks_and_slips_by_the_closed_form():
    """Stick-slip of a load drawn through a spring at constant speed v, static above kinetic.

    The wheel moves at v, the load sticks until K v t = F_s; then x'' = w^2 (v t - x) - F_k/J.
    With a Stribeck velocity far above the speeds the level is F_s throughout: the first slip is
    x = v t' - (v/w) sin(w t'), one period 2 pi/w long, and starts anew without rest.
    """
    v, level = 0.4, 3.0
    rig = replace(BENCH, load_mass_kg=0.0, load_viscous_Nms_per_rad=0.0, load_inertia_kgm2=0.05)
    rig = replace(rig, motor_inertia_kgm2=50.0)  # a flywheel: its speed does not notice the load
    time = np.linspace(0.0, 1.0, 2001)
    model = ActuatorModel(rig, (LoadFriction(coulomb_Nm=level),))
    applied = v * (N**2 * 50.0) / 1e-3 / N
    drive = np.where(time < 1e-3 - 1e-12, applied, 0.0)
    drive += v * (1e-4 + 0.02 / N**2) * N  # against viscous friction
    result = torque_driven(model, time, drive, "free")

    breakaway = 1e-3 / 2.0 + level / (K_S * v)
    w = np.sqrt(K_S / 0.05)
    since = time - breakaway
    stuck = since < 0.0
    assert np.all(result.load_angle_rad[stuck] == 0.0)
    assert np.all(result.load_velocity_rad_per_s[stuck] == 0.0)
    first = (since > 0.0) & (since < 2.0 * np.pi / w)
    expected = v * since - v / w * np.sin(w * since)
    np.testing.assert_allclose(result.load_angle_rad[first], expected[first], atol=5e-5)


def test_breakaway_torque_is_exact_in_both_directions():
    friction = GearFriction(
        coulomb_Nm=0.03, asymmetry=0.2, stribeck_rise=0.5, stribeck_velocity_rad_per_s=3.0
    )
    model = ActuatorModel(OSCILLATOR, (friction,))
    time = np.linspace(0.0, 0.02, 21)
    for side, level in ((1.0, 0.03 * 1.2 * 1.5), (-1.0, -0.03 * 0.8 * 1.5)):
        below = torque_driven(model, time, np.full(21, level * (1.0 - 1e-12)))
        above = torque_driven(model, time, np.full(21, level * (1.0 + 1e-12)))
        assert np.all(below.wheel_angle_rad == 0.0)
        assert np.all(below.wheel_velocity_rad_per_s == 0.0)
        assert side * above.wheel_velocity_rad_per_s[1] > 0.0


def test_release_time_of_a_rising_current_is_located():
    """i = V/R (1 - exp(-R t/L)) reaches F/(N k_t) at a known time: nothing moves before it."""
    coulomb, duty = 0.2, 0.1
    model = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=coulomb),))
    R, L = 3.78, 4.56e-3
    final = duty * 48.0 / R
    release = -L / R * np.log(1.0 - coulomb / 0.3056 / final)
    time = np.linspace(0.0, 4e-3, 17)
    inputs = Inputs(time_s=time, duty=np.full(17, duty), load=Load(kind="locked"))
    result = simulate(model, inputs, step_s=1e-4)
    assert result.wheel_stuck_s[-1] == pytest.approx(release, rel=1e-12)
    np.testing.assert_allclose(  # the current goes on while the wheel sticks
        result.current_A[3], final * (1.0 - np.exp(-R * 0.75e-3 / L)), rtol=1e-12
    )


@pytest.mark.parametrize("torque", [0.5, -3.0, 40.0])
def test_self_locking_worm_holds_any_load_exactly_without_the_motor(torque):
    worm = GearLoadFriction(lead_angle_rad=np.deg2rad(3.5), friction_coefficient=0.07)
    assert worm.is_self_locking
    assert worm.backdrive_efficiency <= 0.0
    model = ActuatorModel(replace(BENCH, load_viscous_Nms_per_rad=0.5), (worm,))
    time = np.linspace(0.0, 20.0, 401)
    result = simulate(
        model,
        Inputs(
            time_s=time,
            duty=np.zeros(time.size),
            load=Load(kind="constant-torque", load_torque_Nm=torque),
        ),
    )
    assert np.all(result.wheel_angle_rad == 0.0)
    assert np.all(result.wheel_velocity_rad_per_s == 0.0)
    assert result.torque_Nm[-1] == pytest.approx(-torque, rel=1e-9)


def test_worm_below_the_lock_is_backdriven():
    worm = GearLoadFriction(lead_angle_rad=np.deg2rad(12.0), friction_coefficient=0.07)
    assert 0.0 < worm.backdrive_efficiency < worm.drive_efficiency < 1.0
    model = ActuatorModel(replace(BENCH, load_viscous_Nms_per_rad=0.5), (worm,))
    time = np.linspace(0.0, 5.0, 101)
    still = np.zeros(time.size)
    load = Load(kind="constant-torque", load_torque_Nm=5.0)
    result = simulate(model, Inputs(time_s=time, duty=still, load=load))
    # steady: eta_r tau = N^2 k_t k_e/R w + B w
    braking = (N * 0.3056) ** 2 / 3.78 + N**2 * 1e-4 + 0.02
    speed = result.wheel_velocity_rad_per_s[-1]
    passed = 5.0 - 0.5 * speed  # the load's own viscous friction
    assert speed == pytest.approx(worm.backdrive_efficiency * passed / braking, rel=1e-9)


def test_worm_breaks_away_at_tau_s_over_drive_efficiency():
    """Raising: N tau_m = tau_s / eta_f; lowering against the lock: N tau_m = -tau_s (-eta_r)."""
    worm = GearLoadFriction(lead_angle_rad=np.deg2rad(3.5), friction_coefficient=0.07)
    start = 0.05
    torque = K_S * start
    model = ActuatorModel(OSCILLATOR, (worm,))
    time = np.linspace(0.0, 0.01, 11)
    for level, sign in (
        (torque / worm.drive_efficiency, 1.0),
        (torque * worm.backdrive_efficiency, -1.0),
    ):
        for factor, moves in (
            (1.0 - sign * np.sign(level) * 1e-9, False),
            (1.0 + sign * np.sign(level) * 1e-9, True),
        ):
            applied = np.full(11, factor * level / N)
            result = torque_driven(model, time, applied, initial_motor_angle_rad=start * N)
            moved = sign * (result.wheel_angle_rad[-1] - start)
            assert (moved > 0.0) if moves else (moved == 0.0)


# ---- the bench of simulation-peers.md, B1 -------------------------------------------------
R, L, K_T, V = 3.78, 4.56e-3, 0.3056, 48.0
B = N**2 * 1e-4 + 0.02
COULOMB = 2.5  # at the wheel


def reference_bench(duty, tick, load_inertia, mgd, viscous):
    """Spring torque at each tick: scipy DOP853 with events, a stuck wheel integrated apart."""
    y, stuck, sense = np.zeros(5), True, 0.0
    torques = np.zeros(duty.size)

    def slope(t, y, u, sense):
        i, wheel, w, load, w_l = y
        tau = K_S * (wheel - load)
        a = 0.0 if sense == 0.0 else (N * K_T * i - B * w - tau - sense * COULOMB) / J
        a_l = (tau - viscous * w_l - mgd * np.sin(load)) / load_inertia
        w_now = 0.0 if sense == 0.0 else w
        return (u * V - R * i - K_T * N * w_now) / L, w_now, a, w_l, a_l

    def excess(t, y, u, sense):
        return abs(N * K_T * y[0] - K_S * (y[1] - y[3])) - COULOMB

    def crossing(t, y, u, sense):
        return sense * y[2]

    excess.terminal, excess.direction = True, 1.0
    crossing.terminal, crossing.direction = True, -1.0
    for k in range(duty.size):
        torques[k] = K_S * (y[1] - y[3])
        t = 0.0
        while k + 1 < duty.size and t < tick:
            done = solve_ivp(
                slope, (t, tick), y, method="DOP853", rtol=1e-11, atol=1e-12,
                args=(duty[k], sense), events=excess if stuck else crossing,
            )  # fmt: skip
            t, y = done.t[-1], done.y[:, -1].copy()
            if done.status != 1:
                break
            if not stuck:
                y[2] = 0.0
            applied = N * K_T * y[0] - K_S * (y[1] - y[3])
            stuck = not (stuck or abs(applied) > COULOMB)
            sense = 0.0 if stuck else float(np.sign(applied))
    return torques


def test_bench_with_coulomb_friction_agrees_with_scipy_events_over_10_s():
    """Rows of 10 ms, 7 V at 0.5 Hz, 2 kg pendulum: torque error RMS, at most 1e-5 Nm."""
    tick = 0.01
    time = np.arange(1001) * tick
    duty = np.round(0.15 * np.sin(2 * np.pi * 0.5 * time), 6)
    mgd = 2.0 * 9.80665 * 0.3
    rig = replace(BENCH, load_mass_kg=2.0, load_inertia_kgm2=0.2, current_limit_A=None)
    model = ActuatorModel(rig, (GearFriction(coulomb_Nm=COULOMB / N),))
    result = simulate(model, Inputs(time_s=time, duty=duty))
    expected = reference_bench(duty, tick, 0.2, mgd, 0.02)

    error = np.sqrt(np.mean((result.torque_Nm - expected) ** 2))
    assert result.wheel_stuck_s[-1] > 0.15
    assert np.ptp(expected) > 1.0
    assert error < 1e-8


def test_halving_the_step_with_events_keeps_a_high_order():
    # Stribeck makes the slip stiff enough to measure; events at both ends of every slip
    friction = GearFriction(
        coulomb_Nm=0.03, stribeck_rise=0.4, stribeck_velocity_rad_per_s=20.0, asymmetry=0.1
    )
    rig = replace(BENCH, terminal_inductance_H=None, current_limit_A=None)
    worm = GearLoadFriction(lead_angle_rad=0.1, friction_coefficient=0.05)
    model = ActuatorModel(rig, (friction, worm))
    time = np.array([0.0, 0.3, 0.6, 0.9])
    inputs = Inputs(time_s=time, duty=np.array([0.06, -0.05, 0.03, 0.0]))
    finest = simulate(model, inputs, step_s=2.5e-4).torque_Nm[-1]
    errors = [abs(simulate(model, inputs, step_s=h).torque_Nm[-1] - finest) for h in (8e-3, 4e-3)]
    assert errors[0] < 1e-4
    assert np.log2(errors[0] / errors[1]) > 4.0


def test_rigid_joint_with_dry_gear_or_load_sticks_and_says_what_the_joint_carries():
    rig = replace(BENCH, parts=("drive", "gear", "load"))
    time = np.linspace(0.0, 0.1, 11)
    for term, carried in (
        (GearFriction(coulomb_Nm=0.05), -2.0),
        (LoadFriction(coulomb_Nm=3.0), 0.6),
    ):
        result = simulate(
            ActuatorModel(rig, (term,)),
            Inputs(
                time_s=time,
                motor_torque_Nm=np.full(11, 0.01),
                load=Load(kind="constant-torque", load_torque_Nm=2.0),
            ),
        )
        assert np.all(result.load_angle_rad == 0.0)
        assert np.all(result.wheel_angle_rad == 0.0)
        np.testing.assert_allclose(result.torque_Nm[1:], carried, rtol=1e-12)
    both = ActuatorModel(rig, (GearFriction(coulomb_Nm=0.05), LoadFriction(coulomb_Nm=3.0)))
    with pytest.raises(TermError, match="needs a spring"):
        simulate(both, Inputs(time_s=time, motor_torque_Nm=np.zeros(11)))


def test_friction_parameters_are_described_and_checked():
    model = ActuatorModel(
        BENCH,
        (
            GearFriction(coulomb_Nm=0.04, asymmetry=0.25),
            GearLoadFriction(lead_angle_rad=0.06, friction_coefficient=0.07),
        ),
    )
    text = model.describe()
    assert "term gear-friction at gear" in text
    assert "0.05 Nm forward" in text
    assert "self-locking" in text
    assert "efficiency" in text
    with pytest.raises(TermError, match=r"coulomb_Nm = -0\.1 is outside"):
        GearFriction(coulomb_Nm=-0.1)
    with pytest.raises(TermError, match="there twice"):
        ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.1), GearFriction(coulomb_Nm=0.2)))
    assert SpringCurve.port.unit == "Nm"
