"""Effects with internal states are passive; hysteresis is rate-independent and symmetric."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import (
    DriveDeadTime,
    DriveThermal,
    GearBacklash,
    GearFriction,
    LoadFlexibility,
    LoadFriction,
    SpringBoucWen,
    SpringHysteresis,
    SpringViscoelastic,
)
from rsea_core.engines.fixed_step.replay import Replay

FEW = settings(max_examples=15, deadline=None)
BENCH = Rig.preset("rsea-bench")
TIME = np.arange(121) * 2.5e-3
HYSTERESIS = st.one_of(
    st.builds(
        SpringHysteresis,
        stiffness_1_Nm_per_rad=st.floats(0.1, 200.0),
        yield_1_rad=st.floats(1e-4, 0.1),
        stiffness_2_Nm_per_rad=st.floats(0.0, 50.0),
        yield_2_rad=st.floats(1e-3, 0.2),
    ),
    st.builds(
        SpringBoucWen,
        stiffness_Nm_per_rad=st.floats(0.1, 200.0),
        yield_rad=st.floats(1e-3, 0.1),
        exponent=st.floats(1.0, 6.0),
        shape=st.floats(0.0, 0.5),
    ),
)
GEAR = st.builds(
    GearFriction,
    coulomb_Nm=st.floats(1e-3, 0.2),
    asymmetry=st.floats(-0.9, 0.9),
    stribeck_rise=st.floats(0.0, 3.0),
    presliding_rad=st.floats(0.02, 0.5),
)
LOAD = st.builds(
    LoadFriction,
    coulomb_Nm=st.floats(0.0, 1.0),
    stribeck_rise=st.floats(0.0, 3.0),
    presliding_rad=st.floats(1e-3, 0.05),
    normal_lever_m=st.floats(0.0, 0.1),
)
WITHOUT_A_SIDE = st.one_of(
    HYSTERESIS,
    LOAD,
    GEAR.map(lambda term: GearFriction(coulomb_Nm=term.coulomb_Nm, presliding_rad=0.05)),
    st.builds(SpringViscoelastic, damping_Nms_per_rad=st.floats(0.0, 1.0),
              branch_stiffness_1_Nm_per_rad=st.floats(0.0, 50.0),
              branch_time_1_s=st.floats(0.02, 10.0)),
    st.builds(
        GearBacklash, width_rad=st.floats(1e-4, 0.02), rebound=st.sampled_from([0.0, 0.3, 0.9])
    ),
    st.builds(LoadFlexibility, link_stiffness_Nm_per_rad=st.floats(20.0, 200.0),
              outer_fraction=st.floats(0.1, 0.8)),
    st.builds(DriveDeadTime, width_duty=st.floats(0.0, 0.05), crossover_A=st.floats(0.05, 1.0)),
    st.builds(DriveThermal, winding_heat_capacity_J_per_K=st.floats(1.0, 100.0),
              winding_to_case_W_per_K=st.floats(0.1, 5.0),
              case_heat_capacity_J_per_K=st.floats(10.0, 500.0),
              case_to_ambient_W_per_K=st.floats(0.1, 5.0)),
)  # fmt: skip


def swing(*terms, sign=1.0, start=0.0):
    duty = sign * np.round(0.15 * np.sin(16.0 * TIME) + 0.1 * np.sin(47.0 * TIME), 3)
    inputs = Inputs(time_s=TIME, duty=duty, initial_motor_angle_rad=sign * start)
    return ActuatorModel(BENCH, terms), inputs


@FEW
@given(GEAR, LOAD, st.floats(-3.0, 3.0))
def test_presliding_closes_its_books_anywhere_in_its_box(gear, load, start):
    books = simulate(*swing(gear, load, start=start)).energy
    moved = np.abs(books.supplied_J).max() + np.ptp(books.stored_J()) + 1e-3
    assert np.abs(books.imbalance_J()).max() <= 1e-9 * moved
    assert np.diff(books.gear_friction_J).min() >= -1e-12 * moved
    assert np.diff(books.load_friction_J).min() >= -1e-12 * moved


@FEW
@given(WITHOUT_A_SIDE, st.floats(-3.0, 3.0))
def test_what_remembers_creates_no_energy_anywhere_in_its_box(term, start):
    still = Inputs(
        time_s=TIME, duty=0.0 * TIME, load=Load(), initial_motor_angle_rad=start,
        initial_load_angle_rad=0.1,
    )  # fmt: skip
    books = simulate(ActuatorModel(BENCH, (term,)), still).energy
    stored = books.stored_J()
    assert np.diff(stored).max() <= 1e-7 * max(stored[0], 1e-3)
    assert np.diff(books.lost_J()).min() >= -1e-9 * max(stored[0], 1e-3)


@FEW
@example(
    SpringBoucWen(stiffness_Nm_per_rad=1.0, yield_rad=0.001, exponent=2.0, shape=0.0), 1.0, 0.1875
)
@given(HYSTERESIS, st.floats(1e-3, 100.0), st.floats(0.005, 0.2))
def test_hysteresis_depends_on_the_sign_of_the_speed_not_on_its_size(term, slower, amplitude):
    deflection = amplitude * np.sin(np.linspace(0.0, 12.0, 400)) * np.linspace(1.0, 0.3, 400)
    row = 1e-3 * np.arange(400)
    model = ActuatorModel(BENCH, (term,))
    torques = [
        Replay(time_s=time, spring_deflection_rad=deflection, step_s=time[1]).run(model)[:, 2]
        for time in (row, slower * row)
    ]
    np.testing.assert_allclose(torques[0], torques[1], atol=1e-9 * np.abs(torques[0]).max())


@FEW
@given(WITHOUT_A_SIDE, st.floats(-3.0, 3.0))
def test_mirrored_inputs_give_mirrored_motion_with_every_law_without_a_side(term, start):
    there, back = (swing(term, sign=sign, start=start) for sign in (1.0, -1.0))
    fast = [Replay.of(inputs).run(model) for model, inputs in (there, back)]
    moving = [0, 1, 2, 3, 5, 6]
    np.testing.assert_allclose(fast[0][:, moving], -fast[1][:, moving], atol=1e-9)
    precise = [simulate(model, inputs) for model, inputs in (there, back)]
    np.testing.assert_allclose(precise[0].motor_angle_rad, -precise[1].motor_angle_rad, atol=1e-8)
