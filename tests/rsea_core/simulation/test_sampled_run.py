"""Claim: simulations choose their engine, and the exact one is the event-driven one to 1e-9.

Over machines and events, every signal by exact exponentials and by order 8 with located events
differs by at most 1e-9 of its span, times by 1e-9 of the run's. (Order 8 takes shorter steps here
than by itself, which alone is good to 4e-9 of the current's span.)
"""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, Reference, Rig, simulate, simulate_closed_loop
from rsea_core.control import PidTorque
from rsea_core.effects import (
    DriveDeadZone,
    DriveDelay,
    GearBacklash,
    GearFriction,
    GearLoadFriction,
    LoadDisturbance,
    LoadFlexibility,
    LoadFriction,
    LoadUnbalance,
    RoundedDeadZone,
    SensorDelay,
    SensorOffset,
    SpringContact,
    SpringHardening,
    SpringHysteresis,
    SpringParallel,
    SpringViscoelastic,
)
from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.errors import SimulationError
from rsea_core.simulation.simulate import run_sampled

TIMES = ("time_s", "current_limited_s", "contact_s", "wheel_stuck_s", "load_stuck_s")
STEP_s = 1e-4
# of signals that are zero (the deflection of a rigid machine): one rounding of 1 rad in each row
ROUNDING = 1000 * np.finfo(float).eps
BENCH = Rig.preset("rsea-bench")
HEAVY = replace(BENCH, load_mass_kg=2.0, load_inertia_kgm2=0.2)
LIMITED = replace(BENCH, current_limit_A=2.0)
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=30.0,
    contact_angle_rad=0.02,
    contact_damping_Nms_per_rad=0.3,
)
COULOMB = GearFriction(coulomb_Nm=0.04, asymmetry=0.2)
PRESLIDING = GearFriction(coulomb_Nm=0.04, asymmetry=0.3, presliding_rad=0.3)
WORM = GearLoadFriction(lead_angle_rad=0.08, friction_coefficient=0.05)
RAMP = LoadDisturbance(start_s=0.2005, end_s=0.5503, peak_Nm=1.5, rise_s=0.1)
SLIPS = SpringHysteresis(
    stiffness_1_Nm_per_rad=30.0, yield_1_rad=0.004, stiffness_2_Nm_per_rad=20.0, yield_2_rad=0.012
)
CREEP = SpringViscoelastic(
    damping_Nms_per_rad=0.05, branch_stiffness_1_Nm_per_rad=20.0, branch_time_1_s=0.03
)
COILS = SpringContact(onset_rad=0.02, stiffness_ratio=6.0, negative_onset_rad=0.015)
LINK = LoadFlexibility(
    link_stiffness_Nm_per_rad=150.0, outer_fraction=0.4, link_damping_Nms_per_rad=0.05
)
CASES = {
    "smooth": (BENCH, (), Load()),
    "locked": (BENCH, (COULOMB,), Load(kind="locked")),
    "no gravity": (BENCH, (COULOMB, LoadFriction(coulomb_Nm=0.05)), Load(kind="free")),
    "heavy pendulum": (HEAVY, (COULOMB,), Load()),
    "stick-slip": (BENCH, (COULOMB, LoadFriction(coulomb_Nm=0.05)), Load()),
    "worm": (BENCH, (COULOMB, WORM, SpringParallel(stiffness_Nm_per_rad=2.0)), Load()),
    "contact": (BENCH, (COULOMB,), CONTACT),
    "current limit": (LIMITED, (COULOMB,), CONTACT),
    "no inductance": (replace(LIMITED, terminal_inductance_H=None), (COULOMB,), Load()),
    "pulse": (BENCH, (LoadDisturbance(start_s=0.2005, end_s=0.5503, peak_Nm=1.5),), Load()),
    "ramp": (BENCH, (RAMP, COULOMB), Load()),
    "delay": (BENCH, (DriveDelay(delay_s=0.0023), COULOMB), Load()),
    "dead zone": (BENCH, (DriveDeadZone(width_duty=0.05), COULOMB), Load()),
    "rounded dead zone": (BENCH, (RoundedDeadZone(width_duty=0.05), COULOMB), Load()),
    "coils touch": (BENCH, (COILS, COULOMB), Load()),
    "unbalance": (BENCH, (LoadUnbalance(torque_amplitude_Nm=0.8, angle_rad=0.7),), Load()),
    "backlash": (BENCH, (GearBacklash(width_rad=0.004),), Load()),
    "backlash rebounds": (BENCH, (GearBacklash(width_rad=0.004, rebound=0.5), COULOMB), Load()),
    "presliding": (BENCH, (PRESLIDING,), Load()),
    "both presliding": (
        BENCH, (PRESLIDING, LoadFriction(coulomb_Nm=0.05, presliding_rad=0.005)), CONTACT,
    ),
    "slips": (BENCH, (SLIPS,), Load()),
    "slips and backlash": (BENCH, (SLIPS, GearBacklash(width_rad=0.004), COULOMB), Load()),
    "creep": (BENCH, (CREEP, COULOMB), Load()),
    "link": (BENCH, (LINK, COULOMB), Load()),
    "sensors": (
        BENCH,
        (COULOMB, SensorOffset(column="motor_angle_rad", offset=0.01),
         SensorDelay(column="load_angle_rad", delay_s=0.0004)),
        Load(),
    ),
}  # fmt: skip


def sine(load, *, amplitude=0.6, duration_s=0.8, row_s=1e-3, **more):
    time = np.arange(round(duration_s / row_s) + 1) * row_s
    return Inputs(time_s=time, duty=amplitude * np.sin(2 * np.pi * 2.0 * time), load=load, **more)


def require_equal(exact, precise):
    """Every signal within 1e-9 of its span, times within 1e-9 of the run's."""
    assert (exact.engine, exact.engine_reason) == ("piecewise-linear", None)
    assert precise.engine == "event-driven"
    mine, others = exact.columns(), precise.columns()
    assert list(mine) == list(others)
    for name, values in others.items():
        if name.endswith("_J"):  # see `test_energies_...`
            continue
        span = np.ptp(precise.time_s) if name in TIMES else np.ptp(values)
        apart = np.abs(mine[name] - values).max()
        assert apart <= 1e-9 * span + ROUNDING, f"{name}: {apart:.2g} of {span:.3g}"


def run_both(model, inputs):
    return simulate(model, inputs), simulate(model, inputs, step_s=STEP_s)


@pytest.mark.parametrize("case", CASES)
def test_engines_agree_over_machines_and_events(case):
    rig, terms, load = CASES[case]
    require_equal(*run_both(ActuatorModel(rig, terms), sine(load)))


@pytest.mark.parametrize("case", list(CASES)[::4])
def test_a_run_is_the_same_to_the_bit_whatever_the_model_ran_before(case):
    rig, terms, load = CASES[case]
    model, inputs = ActuatorModel(rig, terms), sine(load)
    for amplitude, row_s in ((0.9, 1e-3), (0.3, 2e-3), (0.5, 1e-3)):
        simulate(model, sine(load, amplitude=amplitude, row_s=row_s))
    again, first = simulate(model, inputs), simulate(ActuatorModel(rig, terms), inputs)
    others = again.columns()
    for name, values in first.columns().items():
        assert np.array_equal(values, others[name]), name


def test_a_pickled_model_holds_nothing_but_itself():
    model = ActuatorModel(BENCH, (COULOMB,))
    found = simulate(model, sine(CONTACT))
    assert model.kept
    read = pickle.loads(pickle.dumps(model))
    assert read == model
    assert not read.kept
    assert np.array_equal(simulate(read, sine(CONTACT)).torque_Nm, found.torque_Nm)


def test_arrays_that_the_caller_changes_afterwards_change_no_result():
    time, reference = np.arange(201) * 1e-3, np.zeros((201, 3))
    reference[:, 0] = 0.5 * np.sin(20.0 * time)
    found = run_sampled(
        ActuatorModel(BENCH), command_name="duty", load=Load(), time_s=time, controller=playback(),
        parameters=np.zeros(1), state=np.zeros(1), reference=reference, reference_name="duty",
    )  # fmt: skip
    before = {name: values.copy() for name, values in found.columns().items()}
    time += 1.0
    reference[:] = 0.0
    for name, values in found.columns().items():
        assert np.array_equal(values, before[name]), name


@pytest.mark.parametrize("row_s", [1e-4, 5e-3])
def test_engines_agree_for_short_and_long_rows(row_s):
    model = ActuatorModel(LIMITED, (COULOMB, LoadFriction(coulomb_Nm=0.05)))
    require_equal(*run_both(model, sine(CONTACT, row_s=row_s)))


@pytest.mark.parametrize("command", ["voltage_V", "current_command_A", "motor_torque_Nm"])
def test_engines_agree_for_every_drive(command):
    time = np.arange(601) * 1e-3
    size = {"voltage_V": 30.0, "current_command_A": 7.0, "motor_torque_Nm": 0.6}[command]
    inputs = Inputs(time_s=time, **{command: size * np.sin(9.0 * time)}, load=CONTACT)
    require_equal(*run_both(ActuatorModel(BENCH, (COULOMB,)), inputs))


def test_engines_agree_for_a_given_motion_and_a_rigid_machine():
    time = np.arange(801) * 1e-3
    imposed = Inputs(
        time_s=time,
        duty=0.2 * np.sin(5.0 * time),
        load=Load(kind="imposed"),
        load_angle_rad=0.1 * np.sin(7.0 * time),
    )
    require_equal(*run_both(ActuatorModel(BENCH, (COULOMB, WORM)), imposed))
    rigid = replace(BENCH, parts=("drive", "gear", "load"), spring_stiffness_Nm_per_rad=None)
    require_equal(*run_both(ActuatorModel(rigid), imposed))
    require_equal(*run_both(ActuatorModel(rigid, (COULOMB,)), sine(Load())))


@pytest.mark.parametrize(
    "terms",
    [
        (COULOMB, WORM, LoadFriction(coulomb_Nm=0.05)),
        (COULOMB, DriveDelay(delay_s=0.0004), GearBacklash(width_rad=0.002)),
        (COULOMB, SensorDelay(column="load_angle_rad", delay_s=0.0014)),
    ],
    ids=["stick-slip worm", "late and slack", "late sensor"],
)
def test_engines_agree_in_a_closed_loop(terms):
    controller = PidTorque(kp=10.0, ki=20.0, sample_time_s=2e-3)
    ran = [
        simulate_closed_loop(
            ActuatorModel(LIMITED, terms),
            controller,
            Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=1.5),
            CONTACT,
            duration_s=1.0,
            row_s=1e-3,
            step_s=step_s,
            refuse_unstable=False,
        )
        for step_s in (None, STEP_s)
    ]
    assert np.unique(ran[0].command).size > 100
    require_equal(*ran)


# the current meets its limit within a row and leaves it again: from a step of the command, late,
# and within a step of the finest length, at whose ends it is below
TOUCHES = (
    {"lead": 0.25, "stiffness": 1.0, "limit": 1.0},
    {"coulomb": 0.08474675351405384, "friction": 0.046875, "lead": 0.25, "stiffness": 1.0,
     "limit": 1.09375},
    {"coulomb": 0.068359375, "asymmetry": 0.3125, "lead": 0.25, "stiffness": 104.0,
     "damping": 1.0, "limit": 0.5},
)  # fmt: skip
BOX = {"coulomb": (0.0, 0.1), "asymmetry": (-0.9, 0.9), "friction": (0.0, 0.15),
       "lead": (0.05, 0.3), "joint": (0.0, 1.0), "stiffness": (1.0, 3000.0),
       "damping": (0.0, 5.0), "limit": (0.5, 6.0)}  # fmt: skip


def contact_run(coulomb=0.0, asymmetry=0.0, friction=0.0, lead=0.1, joint=0.0, stiffness=1.0,
                damping=0.0, limit=6.0):  # fmt: skip
    """A bench with three frictions and a limited current, driven against a contact."""
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
    return ActuatorModel(replace(BENCH, current_limit_A=limit), terms), sine(load, duration_s=0.3)


@pytest.mark.parametrize("case", TOUCHES)
def test_engines_agree_where_the_current_touches_its_limit_within_a_row(case):
    require_equal(*run_both(*contact_run(**case)))


# seeded draws, the same whatever else is loaded. The event-driven engine does not see a limit that
# acts for less than its own step; the exact one does (`test_a_short_touch_...`)
@pytest.mark.parametrize("seed", range(25))
def test_engines_agree_over_the_bounds_box(seed):
    rng = np.random.default_rng(seed)
    drawn = {name: float(rng.uniform(low, high)) for name, (low, high) in BOX.items()}
    require_equal(*run_both(*contact_run(**drawn)))


def test_a_short_touch_of_the_current_limit_is_the_same_in_rows_a_hundred_times_finer():
    model, inputs = contact_run(
        asymmetry=-0.4617855187248456, friction=0.121132467607317, lead=0.055053094714139036,
        joint=0.24042623996084733, stiffness=762.5, limit=1.1602866768773725,
    )  # fmt: skip
    finer = 100
    time = np.linspace(inputs.time_s[0], inputs.time_s[-1], (inputs.time_s.size - 1) * finer + 1)
    duty = np.repeat(inputs.duty, finer)[: time.size]
    coarse = simulate(model, inputs)
    fine = simulate(model, replace(inputs, time_s=time, duty=duty))
    assert coarse.engine == fine.engine == "piecewise-linear"
    for name in ("current_A", "motor_angle_rad", "load_angle_rad", "torque_Nm"):
        mine, others = coarse.columns()[name], fine.columns()[name][::finer]
        assert np.abs(mine - others).max() <= 1e-9 * np.ptp(others), name


def test_what_the_exact_engine_cannot_run_the_other_does_and_says_why():
    hard = simulate(
        ActuatorModel(BENCH, (SpringHardening(stiffness_ratio_at_0p15rad=1.5),)), sine(Load())
    )
    assert (hard.engine, hard.engine_reason) == (
        "event-driven", "its spring is no chain of straight lines",
    )  # fmt: skip
    falling = ActuatorModel(BENCH, (GearFriction(coulomb_Nm=0.02, stribeck_rise=0.5),))
    assert "gear_stribeck_rise" in simulate(falling, sine(Load())).engine_reason
    time = np.array([0.0, 1e-3, 3e-3, 4e-3])
    uneven = Inputs(time_s=time, duty=np.zeros(4), load=Load())
    assert simulate(ActuatorModel(BENCH), uneven).engine_reason == "its rows are not evenly spaced"
    given = simulate(ActuatorModel(BENCH), sine(Load()), step_s=2e-4)
    assert (given.engine, given.engine_reason) == ("event-driven", "a step length was given")
    with pytest.raises(SimulationError, match="gear_stribeck_rise"):
        simulate(falling, sine(Load()), engine="piecewise-linear")


def test_energies_are_made_when_asked_for_and_close_the_books():
    exact = simulate(ActuatorModel(LIMITED, (COULOMB, RAMP)), sine(CONTACT))
    assert "energy" not in vars(exact)
    assert exact.energy is exact.energy
    same = simulate(exact.model, sine(CONTACT), engine="event-driven").energy
    for name in vars(same):
        assert np.array_equal(getattr(exact.energy, name), getattr(same, name)), name
    assert np.abs(exact.energy.imbalance_J()).max() < 1e-9 * np.ptp(exact.energy.supplied_J)
    wheel = 0.5 * (HEAVY.gear_ratio**2 * 3.2e-4 + 2.0e-3) * exact.wheel_velocity_rad_per_s**2
    load = 0.5 * BENCH.load_inertia_kgm2 * exact.load_velocity_rad_per_s**2
    np.testing.assert_allclose(exact.energy.kinetic_J, wheel + load, rtol=1e-7, atol=1e-9)


def test_a_stuck_wheel_does_not_move_at_all_and_a_self_locking_worm_holds_for_ever():
    locking = GearLoadFriction(lead_angle_rad=0.05, friction_coefficient=0.1)
    time = np.arange(60_001) * 1e-3
    still = Inputs(
        time_s=time, duty=np.zeros(time.size), load=Load(), initial_load_angle_rad=1.0,
        initial_motor_angle_rad=60.0,
    )  # fmt: skip
    result = simulate(ActuatorModel(HEAVY, (locking,)), still)
    assert result.engine == "piecewise-linear"
    assert np.unique(result.wheel_angle_rad).size == 1
    assert not result.wheel_velocity_rad_per_s.any()
    assert result.wheel_stuck_s[-1] == pytest.approx(60.0, rel=1e-12)


def test_large_swing_of_the_pendulum_at_the_current_limit():
    rig = replace(HEAVY, current_limit_A=1.0)
    start = {"initial_load_angle_rad": 2.0, "initial_motor_angle_rad": 120.0}
    exact, precise = run_both(ActuatorModel(rig, (COULOMB,)), sine(Load(), amplitude=1.0, **start))
    assert exact.current_limited_s[-1] > 0.1
    require_equal(exact, precise)


def test_a_run_is_a_pandas_table_an_xarray_data_set_and_a_figure():
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    time = np.arange(200) * 1e-3
    model = ActuatorModel(Rig.preset("rsea-bench"))
    run = simulate(model, Inputs(time_s=time, duty=0.1 * np.sin(6.28 * time)))
    table, data = run.to_pandas(), run.to_xarray()
    assert isinstance(table, pandas.DataFrame)
    assert isinstance(data, xarray.Dataset)
    np.testing.assert_array_equal(table["torque_Nm"].to_numpy(), run.torque_Nm)
    np.testing.assert_array_equal(data["torque_Nm"].to_numpy(), run.torque_Nm)
    assert data["torque_Nm"].attrs["units"] == "Nm"
    assert table.index.name == "time_s"
    assert len(run.plot().axes) == 4
    shown = run._repr_html_()
    assert shown.startswith("<table><caption>Trajectory")
