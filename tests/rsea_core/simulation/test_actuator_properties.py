"""Energy, monotony, mirror symmetry and free choice of units hold for any values."""

import tomllib
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import SpringCurve
from rsea_core.machine import quantities as q
from rsea_core.machine.rig import QUANTITIES
from rsea_core.machine.spring_table import (
    spring_energy_J,
    spring_tangent_Nm_per_rad,
    spring_torque_Nm,
    table_deflection,
    table_tangent,
    table_torque,
)

FEW = settings(max_examples=25, deadline=None)
BENCH = Rig.preset("rsea-bench")


@st.composite
def spring_points(draw):
    """Uneven monotone points through zero, with tangents that keep the cubic monotone."""
    below, above = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    n = below + above
    steps = np.array(draw(st.lists(st.floats(4e-3, 0.06), min_size=n, max_size=n)))
    tangents = np.array(draw(st.lists(st.floats(15.0, 400.0), min_size=n, max_size=n)))
    shares = np.array(draw(st.lists(st.floats(0.1, 2.9), min_size=n + 1, max_size=n + 1)))
    d = np.concatenate(([0.0], np.cumsum(steps)))
    t = np.concatenate(([0.0], np.cumsum(steps * tangents)))
    d, t = d - d[below], t - t[below]
    # within three times both neighbouring secants: the box of Fritsch & Carlson
    neighbours = np.minimum(np.append(tangents, np.inf), np.append(np.inf, tangents))
    return d, t, shares * neighbours


@FEW
@given(spring_points(), st.floats(0.3, 3.0))
def test_spring_torque_is_the_derivative_of_its_energy(points, scale):
    d, t, k = points
    table = SpringCurve(
        deflection_rad=d, torque_Nm=t, tangent_Nm_per_rad=k, torque_scale=scale
    ).table()
    at = np.linspace(d[0] - 0.03, d[-1] + 0.03, 41)
    h = 1e-6
    # a central difference must not reach across a point, where the curvature jumps
    apart = np.min(np.abs(at[:, None] - d), axis=1) > 3 * h

    slope = (spring_energy_J(table, at + h) - spring_energy_J(table, at - h)) / (2.0 * h)
    stiffness = (spring_torque_Nm(table, at + h) - spring_torque_Nm(table, at - h)) / (2.0 * h)

    largest = scale * np.abs(t).max()
    np.testing.assert_allclose(
        slope[apart], spring_torque_Nm(table, at)[apart], atol=2e-7 * largest
    )
    np.testing.assert_allclose(
        stiffness[apart], spring_tangent_Nm_per_rad(table, at)[apart], rtol=1e-4, atol=1e-2
    )
    assert spring_energy_J(table, 0.0) == 0.0
    assert np.all(spring_energy_J(table, at) >= -1e-12 * largest)


@FEW
@given(spring_points())
def test_spring_reproduces_points_and_tangents_and_is_monotone(points):
    d, t, k = points
    curve = SpringCurve(deflection_rad=d, torque_Nm=t, tangent_Nm_per_rad=k)
    table = curve.table()

    np.testing.assert_allclose(spring_torque_Nm(table, d), t, atol=1e-12 * np.abs(t).max())
    np.testing.assert_allclose(spring_tangent_Nm_per_rad(table, d), k, rtol=1e-9)
    before = np.nextafter(d, -np.inf)  # from the left as well: the slope is continuous
    np.testing.assert_allclose(spring_tangent_Nm_per_rad(table, before), k, rtol=1e-6)
    at = np.linspace(d[0] - 0.05, d[-1] + 0.05, 500)
    assert np.all(np.diff(spring_torque_Nm(table, at)) > 0.0)
    beyond = spring_torque_Nm(table, d[-1] + 0.04) - t[-1]
    assert beyond == pytest.approx(0.04 * k[-1], rel=1e-9)


@FEW
@given(spring_points())
def test_compiled_spring_agrees_with_arrays_and_inverts(points):
    d, t, k = points
    table = SpringCurve(deflection_rad=d, torque_Nm=t, tangent_Nm_per_rad=k).table()
    for at in np.linspace(d[0] - 0.02, d[-1] + 0.02, 23):
        torque = table_torque(table.regions, at)
        assert torque == spring_torque_Nm(table, at)
        assert table_tangent(table.regions, at) == spring_tangent_Nm_per_rad(table, at)
        back = table_deflection(table.regions, torque)
        assert table_torque(table.regions, back) == pytest.approx(torque, rel=1e-11, abs=1e-11)


@FEW
@given(spring_points())
def test_spring_without_tangents_is_monotone_through_its_points(points):
    d, t, _ = points
    table = SpringCurve(deflection_rad=d, torque_Nm=t).table()
    np.testing.assert_allclose(spring_torque_Nm(table, d), t, atol=1e-12 * np.abs(t).max())
    at = np.linspace(d[0], d[-1], 300)
    assert np.all(np.diff(spring_torque_Nm(table, at)) > 0.0)


@FEW
@given(st.floats(0.5, 200.0), st.floats(-50.0, 50.0), st.floats(-9.0, 9.0))
def test_power_and_kinetic_energy_are_the_same_on_both_sides_of_the_gear(ratio, speed, torque):
    at_output = q.motion_to_output(speed, ratio) * q.torque_to_output(torque, ratio)
    assert at_output == pytest.approx(speed * torque, rel=1e-12, abs=1e-12)
    reflected = q.impedance_to_output(3.2e-4, ratio) * q.motion_to_output(speed, ratio) ** 2
    assert reflected == pytest.approx(3.2e-4 * speed**2, rel=1e-12, abs=1e-15)
    for there, back in (
        (q.motion_to_output, q.motion_to_motor),
        (q.torque_to_output, q.torque_to_motor),
        (q.impedance_to_output, q.impedance_to_motor),
    ):
        assert back(there(speed, ratio), ratio) == pytest.approx(speed, rel=1e-12, abs=1e-12)


LOADS = st.sampled_from(
    [
        Load(),
        Load(kind="free"),
        Load(kind="locked"),
        Load(
            kind="contact",
            contact_stiffness_Nm_per_rad=60.0,
            contact_angle_rad=0.03,
            contact_damping_Nms_per_rad=0.2,
        ),
    ]
)
TIME = np.arange(401) * 1e-3


@settings(max_examples=12, deadline=None)
@given(LOADS, st.floats(0.1, 30.0), st.floats(0.2, 0.95), st.floats(0.5, 9.0))
def test_scaling_the_unit_of_torque_multiplies_torques_and_leaves_angles(load, c, amplitude, w):
    """Torque and energy in units 1/c: mechanics times c, k_t, k_e, V and I times sqrt(c)."""
    root = np.sqrt(c)
    scaled_rig = replace(
        BENCH,
        **{
            key: getattr(BENCH, key) * c
            for key in (
                "motor_inertia_kgm2", "motor_viscous_Nms_per_rad", "output_inertia_kgm2",
                "output_viscous_Nms_per_rad", "spring_stiffness_Nm_per_rad", "load_mass_kg",
                "load_inertia_kgm2", "load_viscous_Nms_per_rad",
            )
        },
        **{
            key: getattr(BENCH, key) * root
            for key in (
                "supply_voltage_V", "torque_constant_Nm_per_A", "back_emf_constant_Vs_per_rad",
                "current_limit_A",
            )
        },
    )  # fmt: skip
    scaled_load = replace(
        load,
        **{
            f.name: getattr(load, f.name) * c
            for f in fields(load)
            if f.name in ("contact_stiffness_Nm_per_rad", "contact_damping_Nms_per_rad")
            and getattr(load, f.name) is not None
        },
    )
    duty = amplitude * np.sign(np.sin(w * TIME + 0.1))

    plain = simulate(ActuatorModel(BENCH), Inputs(time_s=TIME, duty=duty, load=load))
    scaled = simulate(ActuatorModel(scaled_rig), Inputs(time_s=TIME, duty=duty, load=scaled_load))

    for name, factor in (
        ("load_angle_rad", 1.0),
        ("motor_angle_rad", 1.0),
        ("torque_Nm", c),
        ("current_A", root),
    ):
        expected = factor * getattr(plain, name)
        np.testing.assert_allclose(
            getattr(scaled, name),
            expected,
            rtol=1e-7,
            atol=1e-9 * max(np.abs(expected).max(), 1e-9),
        )
    np.testing.assert_allclose(
        scaled.energy.supplied_J, c * plain.energy.supplied_J, rtol=1e-7, atol=1e-12 * c
    )


@settings(max_examples=12, deadline=None)
@given(LOADS, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.0, 3.0))
@example(Load(kind="pendulum"), 0.0, 5.960464477539063e-08, 0.0)
def test_an_unpowered_joint_only_loses_energy(load, motor_rad, load_rad, viscous):
    """From any deflection, with the winding shorted: what is stored never grows."""
    rig = replace(BENCH, output_viscous_Nms_per_rad=viscous, load_viscous_Nms_per_rad=viscous / 9)
    result = simulate(
        ActuatorModel(rig),
        Inputs(
            time_s=TIME,
            duty=np.zeros(TIME.size),
            load=load,
            initial_motor_angle_rad=60.0 * motor_rad,
            initial_load_angle_rad=load_rad,
        ),
    )
    stored = result.energy.stored_J()
    assert np.diff(stored).max() <= 1e-9 * max(stored[0], 1e-9)
    assert np.abs(result.energy.imbalance_J()).max() <= 1e-8 * max(stored[0], 1e-9)


@settings(max_examples=12, deadline=None)
@given(LOADS, st.floats(0.1, 1.0), st.floats(1.0, 12.0))
def test_mirrored_inputs_give_mirrored_motion(load, amplitude, w):
    if load.kind == "contact":
        return  # one-sided by its nature
    duty = amplitude * np.sin(w * TIME)
    model = ActuatorModel(BENCH)
    there = simulate(model, Inputs(time_s=TIME, duty=duty, load=load))
    back = simulate(model, Inputs(time_s=TIME, duty=-duty, load=load))
    assert np.array_equal(there.torque_Nm, -back.torque_Nm)
    assert np.array_equal(there.energy.supplied_J, back.energy.supplied_J)


@FEW
@given(st.data())
def test_rig_survives_writing_and_reading(data):
    changed = {
        key: data.draw(st.none() | st.floats(1e-9, 1e6), label=key)
        for key in data.draw(st.sets(st.sampled_from(sorted(QUANTITIES)), max_size=6))
        if not key.endswith("counts_per_rev")
        and key not in ("gear_ratio", "torque_constant_Nm_per_A")
    }
    rig = replace(BENCH, name='odd "name" \\ with\ttab', anchors=("gear_ratio",), **changed)

    assert Rig.from_tables(tomllib.loads(rig.to_toml()), where="test") == rig
