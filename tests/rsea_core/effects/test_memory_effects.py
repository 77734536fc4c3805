"""Each effect with internal states agrees with DOP853 on equations and events written here."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import (
    Context,
    DriveThermal,
    GearBacklash,
    GearFriction,
    GearLoadFriction,
    LoadFlexibility,
    LoadFriction,
    SpringBoucWen,
    SpringContact,
    SpringHysteresis,
    SpringViscoelastic,
    TorqueRipple,
)
from rsea_core.effects.figure_text import FigureText

BENCH = replace(Rig.preset("rsea-bench"), current_limit_A=None)
R, L, K_T, V, N = 3.78, 4.56e-3, 0.3056, 48.0, 60.0
J_M, J_O, B_M, B_O = N**2 * 3.2e-4, 2.0e-3, N**2 * 1.0e-4, 0.02
J_L, B_L, MGD, K_S = 0.030, 0.02, 0.3 * 0.3 * 9.80665, 65.8
ROW = 0.1
DUTY = np.array([0.35, 0.35, -0.4, -0.4, 0.3, -0.2, 0.0, 0.0])
TIME = np.arange(DUTY.size + 1) * ROW


def run(*terms, rig=BENCH, step_s=None):
    inputs = Inputs(time_s=TIME, duty=np.append(DUTY, 0.0))
    result = simulate(ActuatorModel(rig, terms), inputs, step_s=step_s)
    books = result.energy
    moved = np.ptp(books.supplied_J) + np.ptp(books.stored_J())
    assert np.abs(books.imbalance_J()).max() < 1e-8 * moved
    return result


def stepped(slope, events, act, y, mode):
    """States at TIME; `events(mode)` are functions of (t, y), `act(number, y, mode)` the switch."""
    found = [np.array(y)]
    for duty in DUTY:
        t = 0.0
        while t < ROW:
            watched = []
            for index, function in events(mode):

                def event(t, y, function=function):
                    return function(y)

                event.terminal, event.direction, event.index = True, 1.0, index
                watched.append(event)
            done = solve_ivp(
                lambda t, y, duty=duty, mode=mode: slope(y, duty, mode), (t, ROW), y,
                method="DOP853", rtol=1e-11, atol=1e-12, events=watched,
            )  # fmt: skip
            t, y = done.t[-1], done.y[:, -1].copy()
            if done.status == 1:
                fired = [
                    e.index for e, hits in zip(watched, done.t_events, strict=True) if hits.size
                ]
                y, mode = act(fired[0], y, mode)
        found.append(y.copy())
    return np.array(found)


def machine(y, duty, tau, *, on_wheel=0.0, on_load=0.0, factor=1.0, heated=1.0):
    """Nominal slopes of (i, wheel, w, load, w_l) with a spring torque and extra torques."""
    i, _, w, load, w_l = y[:5]
    k = K_T * factor
    a_w = (N * k * i - (B_M + B_O) * w - tau + on_wheel) / (J_M + J_O)
    a_l = (tau - B_L * w_l - MGD * np.sin(load) + on_load) / J_L
    return [(duty * V - R * heated * i - k * N * w) / L, w, a_w, w_l, a_l]


def close(result, states, tau=None, atol=1e-9):
    np.testing.assert_allclose(result.load_angle_rad, states[:, 3], rtol=0.0, atol=atol)
    np.testing.assert_allclose(result.motor_angle_rad / N, states[:, 1], rtol=0.0, atol=atol)
    if tau is not None:
        np.testing.assert_allclose(result.torque_Nm, tau, rtol=0.0, atol=1e2 * atol)


def test_viscoelastic_spring():
    term = SpringViscoelastic(
        damping_Nms_per_rad=0.3,
        branch_stiffness_1_Nm_per_rad=20.0,
        branch_time_1_s=0.03,
        branch_stiffness_3_Nm_per_rad=12.0,
        branch_time_3_s=0.4,
    )

    def torque(y):
        return K_S * (y[1] - y[3]) + 0.3 * (y[2] - y[4]) + 20.0 * y[5] + 12.0 * y[6]

    def slope(y, duty, mode):
        rate = y[2] - y[4]
        more = [rate - y[5] / 0.03, rate - y[6] / 0.4]
        return machine(y, duty, torque(y)) + more

    states = stepped(slope, lambda mode: [], None, np.zeros(7), None)
    close(run(term), states, [torque(y) for y in states])
    figures = term.comparable(Context(spring_stiffness_Nm_per_rad=64.0))
    assert figures["stiffness_rise_fast_over_static"] == pytest.approx(1.5)
    assert figures["damping_Nms_per_rad"] == 0.3


def test_a_damper_alone_is_reported_by_its_damping_and_by_no_stiffness():
    """Its ratio of stiffnesses is that of a spring without any effect."""
    context = Context(spring_stiffness_Nm_per_rad=64.0)
    term = SpringViscoelastic(damping_Nms_per_rad=0.3)
    assert term.comparable(context) == {"damping_Nms_per_rad": 0.3}
    text = FigureText(figures=term.comparable(context), column="", linear=False)
    assert SpringViscoelastic.sentence(text) == "a viscoelastic spring, damped by 0.3 Nms/rad"


def test_maxwell_slip_hysteresis():
    """Stick and slip as an automaton: a stuck element's torque is a state of its own."""
    stiff, limit = np.array([30.0, 12.0]), np.array([0.004, 0.009])
    term = SpringHysteresis(
        stiffness_1_Nm_per_rad=30.0,
        yield_1_rad=0.004,
        stiffness_2_Nm_per_rad=12.0,
        yield_2_rad=0.009,
    )

    def torque(y):
        return K_S * (y[1] - y[3]) + stiff @ y[5:7]

    def slope(y, duty, mode):
        rate = y[2] - y[4]
        return machine(y, duty, torque(y)) + [rate if sense == 0 else 0.0 for sense in mode]

    def events(mode):
        found = []
        for i, sense in enumerate(mode):
            if sense == 0:
                found.append((i, lambda y, i=i: y[5 + i] - limit[i]))
                found.append((i, lambda y, i=i: -y[5 + i] - limit[i]))
            else:
                found.append((i, lambda y, sense=sense: -sense * (y[2] - y[4])))
        return found

    def act(i, y, mode):
        mode = list(mode)
        if mode[i] == 0:
            mode[i] = int(np.sign(y[5 + i]))
        else:  # all that slide turn at once
            mode = [0, 0]
        y[5 + i] = np.clip(y[5 + i], -limit[i], limit[i])
        return y, tuple(mode)

    states = stepped(slope, events, act, np.zeros(7), (0, 0))
    result = run(term)
    close(result, states, [torque(y) for y in states])
    assert np.abs(states[:, 5:]).max(axis=0) == pytest.approx(limit)
    assert np.diff(result.energy.spring_loss_J).min() >= 0.0


@pytest.mark.parametrize(
    ("limit", "n", "s"), [(0.015, 1.5, 0.3), (0.03, 1.0, -1.1 / 1.9)], ids=["yields", "stiffens"]
)
def test_bouc_wen_hysteresis(limit, n, s):
    k = 25.0
    term = SpringBoucWen(stiffness_Nm_per_rad=k, yield_rad=limit, exponent=n, shape=s)

    def torque(y):
        return K_S * (y[1] - y[3]) + k * y[5]

    def slope(y, duty, mode):
        rate = y[2] - y[4]
        share = abs(y[5] / limit) ** n * (s + (1.0 - abs(s)) * np.sign(rate * y[5]))
        return [*machine(y, duty, torque(y)), rate * (1.0 - share)]

    def events(mode):
        return [
            (0, lambda y: mode[0] * (y[2] - y[4])),
            (1, lambda y: mode[1] * y[5]),
        ]

    def act(i, y, mode):
        return y, tuple(-m if j == i else m for j, m in enumerate(mode))

    states = stepped(slope, events, act, np.zeros(6), (-1, -1))
    close(run(term), states, [torque(y) for y in states])


def test_thermal_drive_warms_by_its_current_and_weakens():
    term = DriveThermal(
        winding_heat_capacity_J_per_K=8.0,
        winding_to_case_W_per_K=4.0,
        case_heat_capacity_J_per_K=20.0,
        case_to_ambient_W_per_K=1.0,
        torque_constant_fall_per_K=0.002,
        torque_constant_fall_per_winding_K=0.001,
        start_winding_rise_K=20.0,
        start_case_rise_K=10.0,
    )

    def slope(y, duty, mode):
        heated = 1.0 + 3.93e-3 * y[5]
        passed = 4.0 * (y[5] - y[6])
        main = machine(
            y, duty, K_S * (y[1] - y[3]), factor=1 - 2e-3 * y[6] - 1e-3 * y[5], heated=heated
        )
        return [*main, (R * heated * y[0] ** 2 - passed) / 8.0, (passed - y[6]) / 20.0]

    states = stepped(slope, lambda mode: [], None, np.array([0, 0, 0, 0, 0, 20.0, 10.0]), None)
    result = run(term)
    close(result, states)
    np.testing.assert_allclose(result.winding_temperature_C, 25.0 + states[:, 5], atol=1e-7)
    np.testing.assert_allclose(result.case_temperature_C, 25.0 + states[:, 6], atol=1e-7)
    peak = float(result.winding_temperature_C.max())
    figures = term.comparable(Context(peak_winding_rise_K=peak - 25.0))
    assert figures["resistance_rise_fraction"] == pytest.approx(3.93e-3 * (peak - 25.0))


def test_flexible_link():
    term = LoadFlexibility(
        link_stiffness_Nm_per_rad=150.0, outer_fraction=0.4, link_damping_Nms_per_rad=0.05
    )
    inner, outer = 0.6 * J_L, 0.4 * J_L

    def slope(y, duty, mode):
        link = 150.0 * (y[3] - y[5]) + 0.05 * (y[4] - y[6])
        found = machine(y, duty, K_S * (y[1] - y[3]), on_load=-link)
        found[4] *= J_L / inner
        return [*found, y[6], link / outer]

    states = stepped(slope, lambda mode: [], None, np.zeros(7), None)
    result = run(term)
    close(result, states)
    np.testing.assert_allclose(result.link_angle_rad, states[:, 5], atol=1e-9)
    figures = term.comparable(Context(load_inertia_kgm2=J_L))
    alone = np.sqrt(150.0 * (1.0 / inner + 1.0 / outer)) / (2.0 * np.pi)
    assert figures["free_link_frequency_Hz"] == pytest.approx(alone)


def test_torque_ripple_acts_on_both_constants():
    term = TorqueRipple(ripple_fraction=0.1, cycles_per_rev=6.0, phase_rad=0.3)

    def slope(y, duty, mode):
        factor = 1.0 + 0.1 * np.sin(6.0 * N * y[1] + 0.3)
        return machine(y, duty, K_S * (y[1] - y[3]), factor=factor)

    close(run(term), stepped(slope, lambda mode: [], None, np.zeros(5), None))


@pytest.mark.parametrize("width", [0.0, 0.006])
def test_contact_of_coils_in_both_directions(width):
    term = SpringContact(
        onset_rad=0.009, stiffness_ratio=6.0, negative_onset_rad=0.007, knee_width_rad=width
    )

    def torque(y):
        d = y[1] - y[3]
        tau = K_S * d
        for beyond, side in ((d - 0.009, 1.0), (-d - 0.007, -1.0)):
            if width == 0.0:
                tau += side * 5.0 * K_S * max(beyond, 0.0)
            else:
                into = min(max(beyond + width / 2, 0.0), width)
                tau += side * 5.0 * K_S * (into**2 / (2 * width) + max(beyond - width / 2, 0.0))
        return tau

    bends = sorted(x for e in (-0.007, 0.009) for x in {e - width / 2, e + width / 2})

    def events(mode):  # the number of bends passed
        found = []
        if mode < len(bends):
            found.append((1, lambda y: y[1] - y[3] - bends[mode]))
        if mode > 0:
            found.append((-1, lambda y: bends[mode - 1] - y[1] + y[3]))
        return found

    states = stepped(
        lambda y, duty, mode: machine(y, duty, torque(y)),
        events,
        lambda sense, y, mode: (y, mode + sense),
        np.zeros(5),
        len(bends) // 2,
    )
    close(run(term), states, [torque(y) for y in states], atol=2e-9)
    deflection = states[:, 1] - states[:, 3]
    assert deflection.max() > 0.009
    assert deflection.min() < -0.007


def test_presliding_of_gear_and_load():
    """Both elastic-plastic, the gear with direction and Stribeck, as automata of their own."""
    terms = (
        GearFriction(
            coulomb_Nm=0.03,
            asymmetry=0.2,
            stribeck_rise=0.5,
            stribeck_velocity_rad_per_s=10.0,
            presliding_rad=0.3,
        ),
        LoadFriction(coulomb_Nm=0.4, presliding_rad=0.02),
    )
    limit = np.array([0.3 / N, 0.02])

    def level(sense, w):
        return N * 0.03 * (1.0 + 0.2 * sense) * (1.0 + 0.5 * np.exp(-((w * N / 10.0) ** 2)))

    def slope(y, duty, mode):
        gear, load = mode
        f_g = gear * level(gear, y[2]) if gear else level(np.sign(y[5]), 0.0) * y[5] / limit[0]
        f_l = 0.4 * load if load else 0.4 * y[6] / limit[1]
        rates = [0.0 if gear else y[2], 0.0 if load else y[4]]
        return machine(y, duty, K_S * (y[1] - y[3]), on_wheel=-f_g, on_load=-f_l) + rates

    def events(mode):
        found = []
        for i, sense in enumerate(mode):
            if sense == 0:
                found.append((i, lambda y, i=i: abs(y[5 + i]) - limit[i]))
            else:
                found.append((i, lambda y, i=i, sense=sense: -sense * y[2 + 2 * i]))
        return found

    def act(i, y, mode):
        mode = list(mode)
        mode[i] = int(np.sign(y[5 + i])) if mode[i] == 0 else 0
        y[5 + i] = np.clip(y[5 + i], -limit[i], limit[i])
        return y, tuple(mode)

    states = stepped(slope, events, act, np.zeros(7), (0, 0))
    # scipy integrates over the kink at zero stretch without knowing of it
    close(run(*terms), states, atol=1e-7)


def test_friction_of_a_bearing_follows_the_link_it_carries():
    """Sliding only: a fast turn of the free pendulum, |N| = hypot(m d w^2 + m g cos, m g sin)."""
    term = LoadFriction(coulomb_Nm=0.0, normal_lever_m=0.01)
    rig = replace(BENCH, parts=("load",))
    time = np.linspace(0.0, 0.4, 5)

    def slope(t, y):
        along = 0.3 * 0.3 * y[1] ** 2 + 0.3 * 9.80665 * np.cos(y[0])
        friction = 0.01 * np.hypot(along, 0.3 * 9.80665 * np.sin(y[0]))
        return y[1], (-MGD * np.sin(y[0]) - B_L * y[1] + friction) / J_L

    done = solve_ivp(slope, (0, 0.4), [2.5, 0.0], "DOP853", time, rtol=1e-12, atol=1e-13)
    inputs = Inputs(time_s=time, initial_load_angle_rad=2.5)
    result = simulate(ActuatorModel(rig, (term,)), inputs)
    assert done.y[1].max() <= 0.0
    np.testing.assert_allclose(result.load_angle_rad, done.y[0], atol=1e-9)


def backlash_reference(width, rig_j_o):
    """Two bodies, three modes (flank +1, -1, free), impacts that keep momentum."""

    def parts(y, duty):
        i, _, w, load, _, wheel, v = y
        tau = K_S * (wheel - load)
        drive = N * K_T * i - B_M * w
        return tau, drive, -tau - B_O * v

    def slope(y, duty, mode):
        i, _, w, load, w_l, _, v = y
        tau, drive, back = parts(y, duty)
        a = b = (drive + back) / (J_M + rig_j_o)
        if mode == 0:
            a, b = drive / J_M, back / rig_j_o
        a_l = (tau - B_L * w_l - MGD * np.sin(load)) / J_L
        return (duty * V - R * i - K_T * N * w) / L, w, a, w_l, a_l, v, b

    def needed(y):  # what the wheel needs of the motor side to go with it
        _, drive, back = parts(y, 0.0)
        return rig_j_o * (drive + back) / (J_M + rig_j_o) - back

    def events(mode):
        if mode:
            return [(0, lambda y: -mode * needed(y))]
        return [
            (1, lambda y: y[1] - y[5] - width / 2),
            (-1, lambda y: y[5] - y[1] - width / 2),
        ]

    def act(index, y, mode):
        if index == 0:
            return y, 0
        y[2] = y[6] = (J_M * y[2] + rig_j_o * y[6]) / (J_M + rig_j_o)
        y[5] = y[1] - index * width / 2
        return y, (index if index * needed(y) >= 0.0 else 0)

    start = np.zeros(7)
    return stepped(slope, events, act, start, 0)


def test_backlash_with_a_free_wheel_side():
    width, inertia = 0.02, 0.05
    rig = replace(BENCH, output_inertia_kgm2=inertia)
    result = run(GearBacklash(width_rad=width), rig=rig)
    states = backlash_reference(width, inertia)
    close(result, states, atol=1e-7)
    np.testing.assert_allclose(result.wheel_angle_rad, states[:, 5], atol=1e-7)
    gap = result.motor_angle_rad / N - result.wheel_angle_rad
    assert np.abs(gap).max() <= width / 2 * (1.0 + 1e-9)
    assert result.energy.impact_loss_J[-1] > 0.0
    assert np.diff(result.energy.impact_loss_J).min() >= 0.0


def test_self_locking_worm_with_backlash_does_not_creep_under_a_rocking_load():
    worm = GearLoadFriction(lead_angle_rad=np.deg2rad(3.5), friction_coefficient=0.07)
    time = np.linspace(0.0, 4.0, 201)
    result = simulate(
        ActuatorModel(BENCH, (worm, GearBacklash(width_rad=0.02))),
        Inputs(time_s=time, duty=np.zeros(201), initial_load_angle_rad=0.0, load=Load(kind="free")),
    )
    assert np.all(result.motor_angle_rad == 0.0)
    rocking = simulate(
        ActuatorModel(BENCH, (worm, GearBacklash(width_rad=0.02))),
        Inputs(time_s=time, duty=np.zeros(201), initial_load_angle_rad=0.4),
    )
    assert np.all(rocking.motor_angle_rad == 0.0)
    assert rocking.energy.impact_loss_J[-1] > 0.0
    assert np.ptp(rocking.wheel_angle_rad) == pytest.approx(0.02, rel=0.1)
