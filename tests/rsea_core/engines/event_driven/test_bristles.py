"""Bristles: the event-driven engine solves their equation, the fixed-step one converges to it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.bristles as bristles
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k
from rsea_core import (
    ActuatorModel,
    GearBacklash,
    GearEfficiency,
    GearFriction,
    Inputs,
    Load,
    LoadFriction,
    Rig,
    simulate,
)
from rsea_core.errors import TermError
from rsea_core.simulation.simulate_fast import simulate_stepping

BENCH = Rig.preset("rsea-bench")
RIGID = replace(BENCH, parts=tuple(part for part in BENCH.parts if part != "spring"))
TIME_s = np.arange(301) * 1e-3
DUTY = np.round(
    0.22 * np.sin(14.4 * TIME_s) + 0.12 * np.sin(32.0 * TIME_s) + 0.06 * np.sin(53.0 * TIME_s), 2
)
INPUTS = Inputs(time_s=TIME_s, duty=DUTY, load=Load(kind="pendulum"))
THREAD = GearEfficiency(drive_efficiency=0.8, backdrive_efficiency=0.7, bristle_rad=0.02)
LEANING = GearFriction(
    coulomb_Nm=0.04, asymmetry=0.2, stribeck_rise=0.4, stribeck_velocity_rad_per_s=5.0,
    bristle_rad=0.02, bristle_damping_Nms_per_rad=0.005,
)  # fmt: skip
FADING = GearEfficiency(
    drive_efficiency=0.6, backdrive_efficiency=0.3, bristle_rad=0.02, stribeck_rise=0.4,
    stribeck_velocity_rad_per_s=10.0,
)  # fmt: skip
TERMS = {
    "gear": (GearFriction(coulomb_Nm=0.04, bristle_rad=0.03),),
    "gear, damped, direction-dependent": (LEANING,),
    "load": (
        LoadFriction(
            coulomb_Nm=0.15, stribeck_rise=0.3, stribeck_velocity_rad_per_s=0.1, bristle_rad=1e-3,
            bristle_damping_Nms_per_rad=0.6,
        ),
    ),
    "thread": (THREAD,),
    "thread that locks": (replace(THREAD, drive_efficiency=0.5, backdrive_efficiency=-0.2),),
    "thread, fading, beside Coulomb": (FADING, GearFriction(coulomb_Nm=0.02, asymmetry=0.1)),
}  # fmt: skip
IDS = list(TERMS)


def states_of(run):
    names = ("current_A", "wheel_angle_rad", "wheel_velocity_rad_per_s", "load_angle_rad",
             "load_velocity_rad_per_s")  # fmt: skip
    return np.stack([getattr(run, name) for name in names], axis=1)


def apart(found, exact) -> float:
    """The largest distance of two runs, of the span of each state."""
    found, exact = states_of(found), exact if isinstance(exact, np.ndarray) else states_of(exact)
    return float(np.max(np.abs(found - exact) / np.ptp(exact, axis=0)))


class Machine:
    """The bench on bristles, written down once more: Canudas de Wit et al. 1995."""

    def __init__(self, terms):
        self.of = {type(term): term for term in terms}

    def bristle(self, deflection, speed, level, width, rise, fall, damping):
        """Torque and rate of bristles that carry `level` at speed."""
        steady = width * (1.0 + rise * fall) / (1.0 + rise)
        share = 1.0 - np.sign(speed) * deflection / steady
        held = (1.0 + rise) * level * deflection / width
        return held + damping * speed * max(share, 0.0), speed * share

    def on_gear(self, deflection, speed, torque):
        n = BENCH.gear_ratio
        friction, thread = self.of.get(GearFriction), self.of.get(GearEfficiency)
        level, rise, fall, damping, width = 0.0, 0.0, 0.0, 0.0, 0.0
        if friction is not None:
            level = n * friction.coulomb_Nm * (1.0 + np.sign(deflection) * friction.asymmetry)
            rise, width = friction.stribeck_rise, friction.bristle_rad / n
            damping = n**2 * friction.bristle_damping_Nms_per_rad
            fall = np.exp(-((n * speed / friction.stribeck_velocity_rad_per_s) ** 2))
        if thread is not None:
            driven = deflection * torque > 0.0
            loss = (
                1.0 / thread.drive_efficiency - 1.0 if driven else 1 - thread.backdrive_efficiency
            )
            level, rise = level + loss * abs(torque), thread.stribeck_rise
            width = thread.bristle_rad / n
            fall = np.exp(-abs(n * speed / thread.stribeck_velocity_rad_per_s))
        if width == 0.0:
            return 0.0, 0.0
        return self.bristle(deflection, speed, level, width, rise, fall, damping)

    def on_load(self, deflection, speed):
        joint = self.of.get(LoadFriction)
        if joint is None:
            return 0.0, 0.0
        fall = np.exp(-((speed / joint.stribeck_velocity_rad_per_s) ** 2))
        return self.bristle(
            deflection, speed, joint.coulomb_Nm, joint.bristle_rad, joint.stribeck_rise, fall,
            joint.bristle_damping_Nms_per_rad,
        )  # fmt: skip

    def rates(self, t, y, duty):
        r, n = BENCH, BENCH.gear_ratio
        current, wheel, speed, load, load_speed, gear_bristle, load_bristle = y
        torque = r.spring_stiffness_Nm_per_rad * (wheel - load)
        gear, gear_rate = self.on_gear(gear_bristle, speed, torque)
        joint, joint_rate = self.on_load(load_bristle, load_speed)
        volts = r.supply_voltage_V * duty - r.terminal_resistance_ohm * current
        volts -= r.back_emf_constant_Vs_per_rad * n * speed
        driving = n * r.torque_constant_Nm_per_A * current - torque - gear
        driving -= (n**2 * r.motor_viscous_Nms_per_rad + r.output_viscous_Nms_per_rad) * speed
        weight = r.load_mass_kg * 9.80665 * r.load_distance_m
        resting = torque - weight * np.sin(load) - r.load_viscous_Nms_per_rad * load_speed - joint
        inertia = n**2 * r.motor_inertia_kgm2 + r.output_inertia_kgm2
        return np.array([
            volts / r.terminal_inductance_H, speed, driving / inertia, load_speed,
            resting / r.load_inertia_kgm2, gear_rate, joint_rate,
        ])  # fmt: skip

    def run(self, inputs) -> np.ndarray:
        """By DOP853, begun anew where a speed, a deflection or a torque changes its sign."""
        kinks = (lambda t, y, u: y[2], lambda t, y, u: y[4], lambda t, y, u: y[1] - y[3])
        if GearFriction in self.of or GearEfficiency in self.of:
            kinks += (lambda t, y, u: y[5],)
        for kink in kinks:
            kink.terminal = True
        y, rows, time = np.zeros(7), [np.zeros(7)], inputs.time_s
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15, "events": kinks}
        for row in range(time.size - 1):
            now, duty = time[row], inputs.duty[row]
            while now < time[row + 1] and np.any(self.rates(now, y, duty)):
                piece = solve_ivp(self.rates, (now, time[row + 1]), y, args=(duty,), **options)
                y, end = piece.y[:, -1], piece.t[-1]
                if end <= now:  # it begins on a kink: one short step off it
                    end = min(now + 1e-9, time[row + 1])
                    y = y + (end - now) * self.rates(now, y, duty)
                now = end
            rows.append(y)
        return np.array(rows)[:, :5]


@pytest.mark.parametrize("name", IDS)
def test_the_event_driven_engine_moves_as_scipy_integrates(name):
    model = ActuatorModel(BENCH, TERMS[name])
    exact = Machine(TERMS[name]).run(INPUTS)
    # the step is that of a current that is good to 1e-10 by itself; bristles choose theirs
    assert apart(simulate(model, INPUTS, step_s=2e-4), exact) < 1e-9
    plain = simulate(ActuatorModel(BENCH), INPUTS, step_s=2e-4)
    assert apart(plain, exact) > 1e-3, "the bristles are felt"


@pytest.mark.parametrize("name", IDS)
def test_the_fixed_step_engine_converges_to_it_with_the_square_of_its_step(name):
    model = ActuatorModel(BENCH, TERMS[name])
    exact = states_of(simulate(model, INPUTS, step_s=2e-4))
    errors = [apart(simulate_stepping(model, INPUTS, step_s=h), exact) for h in (2e-4, 1e-4, 5e-5)]
    assert errors[2] < 1e-5
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 1.8)


FLANKS = (THREAD, GearBacklash(width_rad=2e-3))
LOSSLESS = (replace(THREAD, backdrive_efficiency=1.0),)  # lets its bristles go when it is driven


@pytest.mark.parametrize(
    ("rig", "terms", "near"),
    [(BENCH, FLANKS, 1e-3), (BENCH, LOSSLESS, 1e-5), (RIGID, (LEANING,), 1e-5),
     # two sweeps of the fixed-step engine for the torque that friction and motion share
     (RIGID, (THREAD,), 1e-4)],
    ids=["play", "a direction without loss", "rigid", "rigid thread"],
)  # fmt: skip
def test_both_engines_let_bristles_go_and_carry_alike(rig, terms, near):
    model = ActuatorModel(rig, terms)
    exact = simulate(model, INPUTS, step_s=2e-4)
    assert apart(simulate_stepping(model, INPUTS, step_s=5e-5), exact) < near


BOX = settings(max_examples=15, deadline=None)
GEAR = st.builds(
    GearFriction,
    coulomb_Nm=st.floats(1e-3, 1.0),
    asymmetry=st.floats(-0.9, 0.9),
    stribeck_rise=st.floats(0.0, 3.0),
    stribeck_velocity_rad_per_s=st.floats(0.05, 100.0),
    bristle_rad=st.floats(1e-2, 0.5),
    bristle_damping_Nms_per_rad=st.floats(0.0, 10.0),
)
LOAD = st.builds(
    LoadFriction,
    coulomb_Nm=st.floats(1e-2, 50.0),
    stribeck_rise=st.floats(0.0, 3.0),
    stribeck_velocity_rad_per_s=st.floats(5e-3, 10.0),
    bristle_rad=st.floats(2e-4, 0.05),
    bristle_damping_Nms_per_rad=st.floats(0.0, 500.0),
    normal_lever_m=st.floats(0.0, 0.1),
)
WORM = st.builds(
    GearEfficiency,
    drive_efficiency=st.floats(0.05, 1.0),
    backdrive_efficiency=st.floats(-3.0, 1.0),
    bristle_rad=st.floats(1e-2, 0.5),
    stribeck_rise=st.floats(0.0, 3.0),
    stribeck_velocity_rad_per_s=st.floats(0.05, 100.0),
)


@settings(max_examples=120, deadline=None)
@given(
    st.one_of(GEAR, LOAD, WORM), st.floats(-1.0, 1.0), st.floats(-5.0, 5.0), st.floats(-20.0, 20.0)
)
def test_bristles_lose_energy_in_every_state_of_their_box(term, deflection, speed, torque):
    """What goes in, less the growth of sigma_0 z^2 / 2 at a constant torque, is never negative."""
    model = ActuatorModel(BENCH, (term,))
    fx = model.effects("duty", Load())
    y, derivatives = np.zeros(k.N_Y), np.zeros((1, k.N_DERIVATIVES))
    bristles.start(y)
    gear = not isinstance(term, LoadFriction)
    y[k.WW], y[k.WL] = speed, speed
    y[k.GEAR_BRISTLE_DEFLECTION], y[k.LOAD_BRISTLE_DEFLECTION] = (
        deflection * fx[e.GEAR_PRESLIDING],
        deflection * fx[e.LOAD_PRESLIDING],
    )
    sign = 1 if torque > 0.0 else -1
    mode = k.Mode(0, False, 0.0, 0.0, 0, 0, sign, False, 0.0)
    bristles.set_signs(fx, mode, y)
    assert y[k.DIRECTION + (m.GEAR_STOP if gear else m.LOAD_STOP)] * speed >= -bristles.SLACK
    bristles.rates(fx, mode, y, derivatives, 0)
    lost = derivatives[0, k.POWER + (k.GEAR_FRICTION if gear else k.LOAD_FRICTION)]
    scale = 1.0 + abs(lost)
    if bristles.carry_the_load(fx):
        carried = bristles.thread_loss(fx, y, sign) * torque
        stiffness = (
            carried / y[k.GEAR_BRISTLE_DEFLECTION] if y[k.GEAR_BRISTLE_DEFLECTION] != 0.0 else 0.0
        )
        assert stiffness >= 0.0
        lost += (
            carried * speed
            - stiffness * y[k.GEAR_BRISTLE_DEFLECTION] * derivatives[0, k.GEAR_BRISTLE_DEFLECTION]
        )
        scale += abs(carried * speed)
    assert lost >= -1e-12 * scale


FALLING = LoadFriction(
    coulomb_Nm=26.0, stribeck_rise=2.0, stribeck_velocity_rad_per_s=2.0, bristle_rad=2**-8
)
STEP_ERROR = 1e-8  # steps of half the fastest mode's time; FALLING has 1.2e-9, half the step 2e-12


@BOX
@example(LEANING, LoadFriction(coulomb_Nm=0.3, bristle_rad=1e-3), 1.0)
@example(GearFriction(coulomb_Nm=1.0, bristle_rad=0.5), FALLING, 0.0)
@given(GEAR, LOAD, st.floats(-1.0, 1.0))
def test_machines_on_bristles_close_their_books_and_create_nothing(gear, load, start):
    still = Inputs(
        time_s=TIME_s[:121], duty=np.zeros(121), load=Load(kind="pendulum"),
        initial_motor_angle_rad=start * BENCH.gear_ratio * 0.1, initial_load_angle_rad=0.1,
    )  # fmt: skip
    books = simulate(ActuatorModel(BENCH, (gear, load)), still).energy
    stored = books.stored_J()
    scale = max(stored[0], 1e-3)
    assert np.abs(books.imbalance_J()).max() <= STEP_ERROR * scale
    assert np.diff(books.gear_friction_J).min() >= -1e-12 * scale
    assert np.diff(books.load_friction_J).min() >= -1e-12 * scale
    assert np.diff(stored).max() <= STEP_ERROR * scale


@BOX
@given(WORM)
def test_a_machine_with_a_threads_bristles_closes_its_books(worm):
    inputs = replace(INPUTS, time_s=TIME_s[:121], duty=DUTY[:121])
    books = simulate(ActuatorModel(BENCH, (worm,)), inputs).energy
    moved = np.abs(books.supplied_J).max() + np.ptp(books.stored_J()) + 1e-3
    assert np.abs(books.imbalance_J()).max() <= 1e-9 * moved


def test_bristles_that_come_to_rest_ring_out_without_ado():
    time = np.arange(3001) * 1e-3
    inputs = Inputs(time_s=time, duty=np.where(time < 0.3, 0.2, 0.0), load=Load(kind="pendulum"))
    terms = (
        LoadFriction(coulomb_Nm=0.3, bristle_rad=1e-3, bristle_damping_Nms_per_rad=1.0),
        GearFriction(coulomb_Nm=0.03, bristle_rad=0.01, asymmetry=0.2),
    )
    run = simulate(ActuatorModel(BENCH, terms), inputs)
    assert abs(run.load_velocity_rad_per_s[-1]) < 1e-5
    assert abs(run.load_angle_rad[-1]) > 0.01, "held away from where it would hang"


def test_a_stop_and_bristles_are_laws_of_one_thing():
    for kind in (GearFriction, LoadFriction):
        with pytest.raises(TermError, match="keep one"):
            kind(coulomb_Nm=0.1, presliding_rad=1e-3, bristle_rad=1e-3)
    with pytest.raises(TermError, match="needs bristle_rad"):
        GearEfficiency(drive_efficiency=0.8, backdrive_efficiency=0.7, stribeck_rise=0.1)
