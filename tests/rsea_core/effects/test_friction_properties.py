"""Dry friction and every passive effect make no energy anywhere in their parameters' box."""

from dataclasses import replace

import numpy as np
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import TERMS, GearFriction, GearLoadFriction, LoadFriction
from rsea_core.errors import InputError
from tests.cases.boxes import bench_box

FEW = settings(max_examples=20, deadline=None)
BENCH = Rig.preset("rsea-bench")


@st.composite
def terms_within_bounds(draw):
    """Gear, worm and load friction, each parameter anywhere between its bounds.

    What is dry holds rigidly: presliding is a law of its own (test_core_memory_terms).
    """

    def within(kind):
        values = {}
        for name, info in BOUNDS[kind].items():
            box = bench_box(name, info.bounds)
            values[name] = 0.0 if name == "presliding_rad" else draw(st.floats(*box))
        if "viscous_skew_Nms_per_rad" in values:  # a skew above the damping would be an engine
            values["viscous_skew_Nms_per_rad"] = draw(
                st.floats(-values["viscous_Nms_per_rad"], values["viscous_Nms_per_rad"])
            )
        return kind(**values)

    worm = GearLoadFriction(
        lead_angle_rad=draw(st.floats(0.01, 0.8)), friction_coefficient=draw(st.floats(0.0, 0.5))
    )
    return within(GearFriction), worm, within(LoadFriction)


BOUNDS = {
    GearFriction: GearFriction(coulomb_Nm=0.1).parameters(),
    LoadFriction: LoadFriction(coulomb_Nm=0.1).parameters(),
}


def require_closed_books(terms, start, scale, share):
    rig = replace(BENCH, current_limit_A=None, load_mass_kg=2.0, load_inertia_kgm2=0.2)
    time = np.arange(61) * 5e-3
    duty = 0.3 * scale / 3.0 * np.sin(2 * np.pi * 4.0 * time)
    result = simulate(
        ActuatorModel(rig, terms),
        Inputs(
            time_s=time,
            duty=duty,
            load=Load(kind="pendulum"),
            initial_motor_angle_rad=start,
            initial_load_angle_rad=0.2 * start,
        ),
    )
    books = result.energy
    moved = np.abs(books.supplied_J).max() + np.ptp(books.stored_J()) + 1e-3
    assert np.abs(books.imbalance_J()).max() <= share * moved
    return books, moved


@FEW
@given(terms_within_bounds(), st.floats(-8.0, 8.0), st.floats(0.3, 3.0))
def test_dry_friction_never_gives_energy_and_the_books_close(terms, start, scale):
    books, moved = require_closed_books(terms, start, scale, 1e-9)
    for lost in (books.gear_friction_J, books.load_friction_J):
        assert np.diff(lost).min() >= -1e-12 * moved


@FEW
@given(terms_within_bounds(), st.floats(-3.0, 3.0))
def test_what_sticks_over_a_row_keeps_its_angle_to_the_bit(terms, start):
    time = np.arange(101) * 5e-3
    result = simulate(
        ActuatorModel(BENCH, terms),
        Inputs(time_s=time, duty=0.1 * np.sin(9.0 * time), initial_motor_angle_rad=start),
    )
    for stuck, angle, speed in (
        (result.wheel_stuck_s, result.wheel_angle_rad, result.wheel_velocity_rad_per_s),
        (result.load_stuck_s, result.load_angle_rad, result.load_velocity_rad_per_s),
    ):
        whole = np.isclose(np.diff(stuck), np.diff(time), rtol=1e-9)
        assert np.all(np.diff(angle)[whole] == 0.0)
        assert np.all(speed[1:][whole] == 0.0)


PASSIVE = (
    "gear-friction",
    "gear-load-friction",
    "gear-transmission-error",
    "motor-cogging",
    "load-friction",
    "load-drag",
    "load-unbalance",
    "spring-parallel",
    "spring-hardening",
)


def within_box(data, name):
    boxes = {
        f: bench_box(f, info.metadata["bounds"])
        for f, info in TERMS[name].__dataclass_fields__.items()
        if "bounds" in info.metadata
    }
    values = {f: data.draw(st.floats(*box)) for f, box in boxes.items()}
    if "viscous_skew_Nms_per_rad" in values:  # a skew above the damping would be an engine
        most = values["viscous_Nms_per_rad"]
        values["viscous_skew_Nms_per_rad"] = min(
            max(values["viscous_skew_Nms_per_rad"], -most), most
        )
    if "bristle_rad" in values:  # friction is a stop's or on bristles
        values[data.draw(st.sampled_from(("bristle_rad", "presliding_rad")))] = 0.0
    return TERMS[name](**values)


def require_passive(terms, load, motor, load_angle):
    time = np.arange(31) * 5e-3
    result = simulate(
        ActuatorModel(BENCH, terms),
        Inputs(
            time_s=time,
            duty=np.zeros(time.size),
            load=load,
            initial_motor_angle_rad=motor,
            initial_load_angle_rad=load_angle,
        ),
    )
    stored = result.energy.stored_J()
    assert np.diff(stored).max() <= 1e-7 * max(stored[0], 1e-3)
    assert np.diff(result.energy.lost_J()).min() >= -1e-9 * max(stored[0], 1e-3)


def require_passive_where_it_runs(terms, load, motor, load_angle):
    """As `require_passive`; a spring of a corner of its box may be stiffer than any step."""
    try:
        require_passive(terms, load, motor, load_angle)
    except InputError as refused:
        if "the fastest mode" not in str(refused):
            raise
        reject()


@FEW
@given(st.data(), st.floats(-6.0, 6.0), st.floats(-0.2, 0.4))
def test_no_passive_term_creates_energy_anywhere_in_its_box(data, motor, load_angle):
    names = data.draw(st.lists(st.sampled_from(PASSIVE), unique=True, min_size=1, max_size=4))
    terms = [within_box(data, name) for name in names]
    require_passive_where_it_runs(terms, Load(kind="pendulum"), motor, load_angle)


@FEW
@given(st.data(), st.floats(-3.0, 3.0), st.floats(-0.1, 0.35))
def test_nonlinear_contact_creates_no_energy_anywhere_in_its_box(data, motor, load_angle):
    contact = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=20.0,
        contact_angle_rad=0.1,
        contact_damping_Nms_per_rad=0.0,
    )
    terms = [within_box(data, "contact-nonlinear")]
    require_passive_where_it_runs(terms, contact, motor, load_angle)
