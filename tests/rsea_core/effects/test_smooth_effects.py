"""Each smooth effect agrees with DOP853 on equations written here and closes its energy balance."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline

import rsea_core.effects.layout as e
from rsea_core import ActuatorModel, Inputs, Load, Rig, linearise, simulate, simulate_stepping
from rsea_core.effects import (
    LAWS,
    ContactNonlinear,
    DriveDeadTime,
    DriveDeadZone,
    DriveDelay,
    DriveSaturation,
    GearFriction,
    GearTransmissionError,
    LoadDisturbance,
    LoadDrag,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    OffsetDeadZone,
    PowerDrag,
    RoundedDeadZone,
    SensorNoise,
    SensorTable,
    SpringCurve,
    SpringHardening,
    SpringParallel,
    ThresholdDeadZone,
)
from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain
from rsea_core.effects.spring_parallel import StiffeningParallel
from rsea_core.engines.event_driven.energy_balance import stored_J
from rsea_core.errors import TermError

BENCH = replace(Rig.preset("rsea-bench"), current_limit_A=None)
R, L, K_T, V, N = 3.78, 4.56e-3, 0.3056, 48.0, 60.0
J, B = N**2 * 3.2e-4 + 2.0e-3, N**2 * 1.0e-4 + 0.02
J_L, B_L, MGD, K_S = 0.030, 0.02, 0.3 * 0.3 * 9.80665, 65.8
DUTY = 0.35
TIME = np.linspace(0.0, 0.8, 9)
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=30.0,
    contact_angle_rad=0.2,
    contact_damping_Nms_per_rad=0.0,
)


def reference(
    *,
    duty=DUTY,
    source=0.0,
    on_wheel=lambda wheel: 0.0,
    on_load=lambda t, angle, speed: 0.0,
    spring=lambda d: K_S * d,
    error=lambda wheel: (0.0, 0.0),
    breaks=(),
):
    """Spring torque at TIME; integrated apart between breaks, where the law jumps."""

    def slope(t, y):
        i, wheel, w, load, w_l = y
        e, de = error(wheel)
        tau = spring(wheel + e - load)
        a_w = (N * K_T * i - B * w - tau * (1.0 + de) + on_wheel(wheel)) / J
        a_l = (tau - B_L * w_l - MGD * np.sin(load) + on_load(t, load, w_l)) / J_L
        return (duty * (V - source * duty * i) - R * i - K_T * N * w) / L, w, a_w, w_l, a_l

    y, found, edges = np.zeros(5), [], [0.0, *breaks, TIME[-1]]
    for start, end in itertools.pairwise(edges):
        inside = TIME[(start <= TIME) & ((end > TIME) | (end == TIME[-1]))]
        times = np.append(inside, end)
        # the law just inside the piece: its own side of the jump
        done = solve_ivp(
            lambda t, y, lo=start, hi=end: slope(min(max(t, lo + 1e-13), hi - 1e-13), y),
            (start, end),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            t_eval=np.unique(times),
        )
        y = done.y[:, -1]
        kept = np.isin(done.t, inside)
        found += [spring(state[1] + error(state[1])[0] - state[3]) for state in done.y[:, kept].T]
    return np.array(found)


def within(depth, speed, law):
    return -law(depth, speed) if depth > 0.0 else 0.0


def stiffening(d):
    """40 d^3 up to 0.15 rad, its tangent there beyond."""
    inside = np.clip(d, -0.15, 0.15)
    return 40.0 * (inside**3 + 3.0 * 0.15**2 * (d - inside))


A_COG, CYCLES = 0.03, 12.0
PLACES_Nm = 0.5 * np.cos(1.7 * np.arange(32))
PLACES = BSpline(  # a coefficient stands over its node; zeros so that it ends as it begins
    -0.3 + 0.05 * np.arange(-5, 37), np.pad(PLACES_Nm, 3), 3, extrapolate=False
)
CASES = {
    "load-drag": (
        LoadDrag(torque_at_5_rad_per_s_Nm=2.0),
        {"on_load": lambda t, a, s: -2.0 / 25.0 * s * abs(s)},
    ),
    "load-drag, power": (
        PowerDrag(torque_at_5_rad_per_s_Nm=2.0, exponent=2.7),
        {"on_load": lambda t, a, s: -2.0 * np.sign(s) * abs(s / 5.0) ** 2.7},
    ),
    "load-unbalance": (
        LoadUnbalance(torque_amplitude_Nm=0.4, angle_rad=0.6),
        {"on_load": lambda t, a, s: -0.4 * np.sin(a + 0.6)},
    ),
    "load-position-torque": (
        LoadPositionTorque(first_rad=-0.3, last_rad=1.25, node_Nm=PLACES_Nm),
        {"on_load": lambda t, a, s: float(np.nan_to_num(PLACES(a)))},
    ),
    "load-disturbance": (
        LoadDisturbance(start_s=0.1234567, end_s=0.3456789, peak_Nm=1.5),
        {
            "on_load": lambda t, a, s: 1.5 if 0.1234567 <= t < 0.3456789 else 0.0,
            "breaks": (0.1234567, 0.3456789),
        },
    ),
    "spring-parallel": (
        SpringParallel(stiffness_Nm_per_rad=7.0, rest_angle_rad=0.1),
        {"on_load": lambda t, a, s: -7.0 * (a - 0.1)},
    ),
    "spring-parallel, cubic": (
        StiffeningParallel(
            stiffness_Nm_per_rad=3.0, rest_angle_rad=0.1, cubic_Nm_per_rad3=40.0, up_to_rad=0.15
        ),
        {"on_load": lambda t, a, s: -3.0 * (a - 0.1) - stiffening(a - 0.1)},
    ),
    "drive-dead-zone": (DriveDeadZone(width_duty=0.04), {"duty": DUTY - 0.04}),
    "drive-saturation": (DriveSaturation(source_resistance_ohm=1.5), {"source": 1.5}),
    "motor-cogging": (
        MotorCogging(amplitude_Nm=A_COG, cycles_per_rev=CYCLES, phase_rad=0.4),
        {"on_wheel": lambda wheel: -N * A_COG * np.sin(CYCLES * N * wheel + 0.4)},
    ),
    "gear-transmission-error": (
        GearTransmissionError(
            wheel_amplitude_rad=0.01,
            wheel_phase_rad=0.3,
            wheel_cycles_per_rev=3.0,
            offset_rad=2e-3,
            worm_amplitude_rad=5e-4,
            worm_phase_rad=-0.5,
        ),
        {
            "error": lambda wheel: (
                2e-3
                + 0.01 * (np.sin(3.0 * wheel + 0.3) - np.sin(0.3))
                + 5e-4 * (np.sin(N * wheel - 0.5) - np.sin(-0.5)),
                0.03 * np.cos(3.0 * wheel + 0.3) + N * 5e-4 * np.cos(N * wheel - 0.5),
            )
        },
    ),
    "spring-hardening": (
        SpringHardening(stiffness_ratio_at_0p15rad=3.0),
        {"spring": lambda d: K_S * (d + 2.0 / 0.0675 * d**3)},
    ),
}


@pytest.mark.parametrize("effect", CASES)
def test_term_agrees_with_dop853_and_its_energy_closes(effect):
    term, law = CASES[effect]
    step = 2e-4 if effect != "load-drag" else 1e-4  # w|w| bends at every reversal
    inputs = Inputs(time_s=TIME, duty=np.full(TIME.size, DUTY))
    plain = simulate(ActuatorModel(BENCH), inputs, step_s=step)
    result = simulate(ActuatorModel(BENCH, (term,)), inputs, step_s=step)

    assert np.abs(result.torque_Nm - plain.torque_Nm).max() > 1e-3  # the term took part
    np.testing.assert_allclose(result.torque_Nm, reference(**law), atol=2e-9)
    books = result.energy
    assert np.abs(books.imbalance_J()).max() <= 1e-9 * books.supplied_J.max()


@pytest.mark.parametrize(("exponent", "loss"), [(1.5, 0.0), (2.0, 0.8), (1.0, 0.3)])
def test_nonlinear_contact_agrees_with_dop853(exponent, loss):
    def on_load(t, angle, speed):
        depth = angle - 0.2
        if depth <= 0.0:
            return 0.0
        return -30.0 * 0.05 * (depth / 0.05) ** exponent * max(1.0 + loss * speed, 0.0)

    term = ContactNonlinear(exponent=exponent, loss_factor_s_per_rad=loss)
    inputs = Inputs(time_s=TIME, duty=np.full(TIME.size, DUTY), load=CONTACT)
    result = simulate(ActuatorModel(BENCH, (term,)), inputs, step_s=1e-4)
    assert result.load_angle_rad.max() > 0.21
    # a depth to the power 1.5 has no second derivative at first touch
    np.testing.assert_allclose(result.torque_Nm, reference(on_load=on_load), atol=1e-7)
    books = result.energy
    assert np.abs(books.imbalance_J()).max() <= 1e-7 * books.supplied_J.max()
    assert np.diff(books.contact_loss_J).min() >= 0.0


def test_dead_zone_swallows_small_duties_of_both_signs():
    model = ActuatorModel(BENCH, (DriveDeadZone(width_duty=0.05),))
    for sign in (1.0, -1.0):
        duty = sign * np.full(TIME.size, 0.049)
        result = simulate(model, Inputs(time_s=TIME, duty=duty))
        assert np.all(result.current_A == 0.0)
        assert np.all(result.command == duty)  # what the drive was told
        driven = simulate(model, Inputs(time_s=TIME, duty=3.0 * duty, load=Load(kind="locked")))
        assert sign * driven.current_A[1] > 0.0


def test_an_offset_after_a_dead_zone_acts_where_the_zone_leaves_nothing():
    width, after = 0.1, 0.03
    asked = 0.2 * np.sin(9.0 * TIME)
    acting = np.sign(asked) * np.maximum(np.abs(asked) - width, 0.0) + after
    zone = OffsetDeadZone(width_duty=width, offset_after=after)
    found, plain = (
        simulate(ActuatorModel(BENCH, terms), Inputs(time_s=TIME, duty=duty))
        for terms, duty in (((zone,), asked), ((), acting))
    )
    np.testing.assert_allclose(found.load_angle_rad, plain.load_angle_rad, rtol=0.0, atol=1e-12)


def test_a_threshold_leaves_out_small_commands_and_takes_large_ones_whole():
    drive = ThresholdDeadZone(width_duty=0.1)
    for asked, acting in ((0.07, 0.0), (0.14, 0.14)):
        sign = np.sign(np.sin(40.0 * TIME))
        found, plain = (
            simulate(ActuatorModel(BENCH, terms), Inputs(time_s=TIME, duty=duty))
            for terms, duty in (((drive,), asked * sign), ((), acting * sign))
        )
        np.testing.assert_allclose(
            found.load_angle_rad, plain.load_angle_rad, rtol=0.0,
            atol=5e-3 * max(np.ptp(plain.load_angle_rad), np.ptp(found.load_angle_rad)) + 1e-4,
        )  # fmt: skip


@pytest.mark.parametrize("width", [0.01, 0.05, 0.3])
def test_a_rounded_dead_zone_is_the_duty_less_its_width_times_tanh(width):
    asked = 0.2 * np.sin(9.0 * TIME)
    acting = asked - width * np.tanh(asked / width)
    found, plain = (
        simulate(ActuatorModel(BENCH, terms), Inputs(time_s=TIME, duty=duty))
        for terms, duty in (((RoundedDeadZone(width_duty=width),), asked), ((), acting))
    )
    np.testing.assert_allclose(found.load_angle_rad, plain.load_angle_rad, rtol=0.0, atol=1e-12)


def test_a_nonlinear_gain_is_the_duty_with_its_terms_of_second_and_third_order():
    asked = 0.2 * np.sin(9.0 * TIME)
    acting = asked + 0.05 * np.abs(asked) - 0.3 * asked * np.abs(asked) + 0.7 * asked**3
    term = DriveNonlinearGain(by_sign=0.05, by_size=-0.3, by_square=0.7)
    found, plain = (
        simulate(ActuatorModel(BENCH, terms), Inputs(time_s=TIME, duty=duty))
        for terms, duty in (((term,), asked), ((), acting))
    )
    np.testing.assert_allclose(found.load_angle_rad, plain.load_angle_rad, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("delay", [0.02, 0.0273, 0.0041])
def test_delayed_command_gives_the_motion_of_the_undelayed_one_later(delay):
    """Against the same machine whose rows are moved: whole rows, fractions, less than a row."""
    rows = np.arange(81) * 0.01
    duty = np.round(0.4 * np.sin(9.0 * rows + 0.5), 3)
    result = simulate(
        ActuatorModel(BENCH, (DriveDelay(delay_s=delay),)),
        Inputs(time_s=rows, duty=duty),
        step_s=2.5e-4,
    )
    moved = np.concatenate(([0.0], rows + delay))
    # rows of the delayed run lie within the moved ones: compare where they meet
    fine = np.unique(np.concatenate((moved, rows)))
    fine = fine[np.append(True, np.diff(fine) > 1e-9)]
    held = np.searchsorted(moved, fine + 1e-9, side="right") - 1
    dense = simulate(
        ActuatorModel(BENCH),
        Inputs(time_s=fine, duty=np.concatenate(([0.0], duty))[held]),
        step_s=2.5e-4,
    )
    at = np.searchsorted(fine, rows - 1e-9)
    np.testing.assert_allclose(result.torque_Nm, dense.torque_Nm[at], atol=1e-11)
    np.testing.assert_allclose(result.current_A, dense.current_A[at], atol=1e-11)
    assert np.ptp(result.torque_Nm) > 1.0
    books = result.energy
    assert np.abs(books.imbalance_J()).max() <= 1e-9 * books.supplied_J.max()


def test_delay_longer_than_the_run_commands_nothing():
    inputs = Inputs(time_s=TIME, duty=np.full(TIME.size, DUTY))
    result = simulate(ActuatorModel(BENCH, (DriveDelay(delay_s=0.9),)), inputs)
    assert np.all(result.current_A == 0.0)
    assert np.all(result.command == DUTY)


def test_supply_sag_and_lower_limit_bound_the_stalled_current():
    stalled = replace(Rig.preset("rsea-bench"), motor_inertia_kgm2=1e6)
    term = DriveSaturation(source_resistance_ohm=1.2)
    inputs = Inputs(time_s=TIME, duty=np.full(TIME.size, 0.4), load=Load(kind="locked"))
    result = simulate(ActuatorModel(stalled, (term,)), inputs)
    # duty U / (R + duty^2 R_s)
    assert result.current_A[1] == pytest.approx(0.4 * V / (R + 0.16 * 1.2), rel=1e-6)
    limited = simulate(ActuatorModel(stalled, (DriveSaturation(current_limit_A=2.5),)), inputs)
    assert limited.current_A[1] == 2.5


@pytest.mark.parametrize(
    ("supply", "driving", "braking"),
    [
        ({}, 0.16, 0.16),
        ({"returned_share": 0.0}, 0.16, 0.0),
        ({"ripple_share": 1.0}, 0.4, 0.4),
        ({"ripple_share": 0.5, "returned_share": 0.25}, 0.28, 0.07),
    ],
)
def test_supply_sag_follows_the_current_in_each_direction(supply, driving, braking):
    """Without inductance i = (duty U - k_e w) / (R + share R_s) at every instant, in both engines.

    Driving, a bridge draws duty i evenly behind a capacitor (share duty^2) and all of i for |duty|
    of the time without one; of a motor that turns faster than its duty asks for it gives back.
    """
    rig = replace(BENCH, terminal_inductance_H=None)
    model = ActuatorModel(rig, (DriveSaturation(source_resistance_ohm=1.2, **supply),))
    time = np.arange(401) * 1e-3
    for sign in (1.0, -1.0):
        duty = sign * np.where(time < 0.1995, 0.9, 0.4)
        inputs = Inputs(time_s=time, duty=duty, load=Load(kind="locked"))
        for engine in (simulate, simulate_stepping):
            result = engine(model, inputs)
            emf = rig.back_emf_constant_Vs_per_rad * result.motor_velocity_rad_per_s
            volts = 0.4 * sign * V - emf
            late = time > 0.2015
            drives, brakes = late & (sign * volts > 0.5), late & (sign * volts < -0.5)
            assert min(drives.sum(), brakes.sum()) > 3
            for rows, share in ((drives, driving), (brakes, braking)):
                expected = volts[rows] / (R + share * 1.2)
                np.testing.assert_allclose(result.current_A[rows], expected, rtol=1e-9)


def test_softening_spring_stays_monotone_and_meets_its_ratio():
    for ratio in (0.3, 0.8, 1.0, 4.0):
        model = ActuatorModel(BENCH, (SpringHardening(stiffness_ratio_at_0p15rad=ratio),))
        table = model.spring_table(Load())
        d = np.linspace(-0.5, 0.5, 1001)
        torque = np.array([_torque(table, value) for value in d])
        assert np.all(np.diff(torque) > 0.0)
        np.testing.assert_allclose(torque, -torque[::-1], atol=1e-12)
        at = (_torque(table, 0.15 + 1e-6) - _torque(table, 0.15 - 1e-6)) / 2e-6
        assert at / K_S == pytest.approx(ratio, rel=1e-4)


def _torque(table, deflection):
    row = np.searchsorted(table.regions[:-1, 0], deflection, side="right")
    _, anchor, c0, c1, c2, c3 = table.regions[row]
    s = deflection - anchor
    return c0 + s * (c1 + s * (c2 + s * c3))


def test_a_gear_that_errs_leaves_the_spring_slack_where_the_angles_are_zero():
    error = GearTransmissionError(
        wheel_amplitude_rad=0.01, wheel_phase_rad=1.0,
        worm_second_amplitude_rad=1e-3, worm_second_phase_rad=-2.0,
    )  # fmt: skip
    still = Inputs(time_s=TIME, duty=np.zeros(TIME.size))
    result = simulate(ActuatorModel(BENCH, (error,)), still)
    assert np.abs(result.torque_Nm).max() < 1e-12


def test_term_that_a_machine_cannot_have_is_refused_in_one_line():
    rigid = replace(BENCH, parts=("drive", "gear", "load"))
    duty = Inputs(time_s=TIME, duty=np.zeros(TIME.size))
    held = Inputs(time_s=TIME, duty=np.zeros(TIME.size), load=Load(kind="locked"))
    current = Inputs(time_s=TIME, current_command_A=np.zeros(TIME.size))
    curve = SpringCurve(deflection_rad=[-0.2, 0.0, 0.3], torque_Nm=[-13.0, 0.0, 25.0])
    error = GearTransmissionError(wheel_amplitude_rad=0.01)
    hardening = SpringHardening(stiffness_ratio_at_0p15rad=2.0)
    for rig, terms, inputs, message in (
        (rigid, (error,), held, "needs a spring where the load is held"),
        (replace(BENCH, parts=("load",)), (error,), Inputs(time_s=TIME), 'has no "gear"'),
        (rigid, (hardening,), duty, 'has no "spring"'),
        (BENCH, (DriveDeadTime(width_duty=0.1),), current, "needs a drive by duty"),
        (BENCH, (curve, hardening), duty, "given by a curve"),
    ):
        with pytest.raises(TermError, match=message):
            simulate(ActuatorModel(rig, terms), inputs)
    with pytest.raises(TermError, match="end_s"):
        LoadDisturbance(start_s=1.0, end_s=1.0, peak_Nm=1.0)


def test_every_term_says_its_unit_bounds_source_and_law():
    for kind in (law for laws in LAWS.values() for law in laws.values()):
        if kind is SpringCurve:
            continue
        needed = {
            name: np.mean(f.metadata["bounds"])
            for name, f in kind.__dataclass_fields__.items()
            if "bounds" in f.metadata and f.default is f.default_factory
        }
        if kind is LoadDisturbance:
            needed |= {"start_s": 0.0, "end_s": 1.0}
        if "column" in kind.__dataclass_fields__:
            needed["column"] = "load_angle_rad"
        if kind is SensorNoise:
            needed["seed"] = 3.0
        if kind is LoadPositionTorque:
            needed |= {"last_rad": 1.0, "node_Nm": np.zeros(e.N_POSITIONS)}
        if kind is SensorTable:
            needed |= {"over": "value", "first": 0.0, "last": 1.0, "errors": np.zeros(3)}
        term = kind(**needed)
        for info in term.parameters().values():
            assert info.unit
            assert info.source
            assert info.meaning.endswith(".")
            assert info.bounds[0] <= info.value <= info.bounds[1]
        text = ActuatorModel(BENCH, (term,)).describe()
        assert f"term {kind.effect} at " in text
        assert term.equation() in text
        assert kind.__doc__


def test_linear_model_names_the_effects_that_it_leaves_out():
    rig = Rig.preset("rsea-bench")
    terms = (GearFriction(coulomb_Nm=0.02), SpringHardening(stiffness_ratio_at_0p15rad=1.2))
    linear = linearise(ActuatorModel(rig, terms), load=Load(kind="locked"))
    assert linear.left_out == ("gear-friction",)


def test_a_position_torque_stores_what_it_takes():
    numbers = CASES["load-position-torque"][0].numbers(None)
    fx = np.zeros(e.N_EFFECTS)
    for name, value in numbers.items():
        fx[e.EFFECTS.index(name)] = value
    angle = np.linspace(-0.6, 1.5, 8001)
    stored = stored_J(fx, 0.0, angle)
    torque = np.array([e.load_torque_by_angle(fx, a, 0.0, 0.0) for a in angle])
    middle = 0.5 * (angle[1:] + angle[:-1])
    slope = -np.diff(stored) / np.diff(angle)
    assert slope == pytest.approx(np.interp(middle, angle, torque), abs=2e-5)
    steepest = np.abs(np.diff(torque) / np.diff(angle)).max()
    # an angle is rounded about ten times on its way to a share of an interval
    rounding = 10 * np.finfo(float).eps * (np.abs(torque).max() + steepest * np.abs(angle).max())
    assert torque == pytest.approx(np.nan_to_num(PLACES(angle)), abs=rounding)
    assert 0.5 * e.position_stiffness(fx) < steepest <= e.position_stiffness(fx)
