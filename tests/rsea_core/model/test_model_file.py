"""`model.toml` is read back exactly, and sensors and friction sets are those of their sources."""

from dataclasses import fields, replace

import numpy as np
import pytest

import rsea_core.effects.friction_presets as thesis
from rsea_core import ActuatorModel, Inputs, Load, Rig, read_model, readings, simulate, write_model
from rsea_core.effects import (
    LAWS,
    FormulaTorque,
    GearBacklash,
    GearEfficiency,
    GearFriction,
    LoadDisturbance,
    LoadPositionTorque,
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    SensorTable,
    SpringCurve,
    SpringHysteresis,
)
from rsea_core.errors import TermError

BENCH = Rig.preset("rsea-bench")


def somewhere(kind):
    """A term with awkward numbers in every parameter."""
    if kind is SpringCurve:
        return SpringCurve(
            deflection_rad=[-0.2, 0.0, 0.3],
            torque_Nm=[-13.0 / 3.0, 0.0, 19.7],
            contact_onset_rad=(None, 0.1 + 0.2),
            source='a "bench"',
        )
    values = {}
    for f in fields(kind):
        if "bounds" in f.metadata:
            low, high = f.metadata["bounds"]
            values[f.name] = low + (high - low) / 3.0
    if kind is LoadDisturbance:
        values["end_s"] = values["start_s"] + 1.0 / 3.0
        values["rise_s"] = 0.1
    if kind is LoadPositionTorque:
        values["last_rad"] = values["first_rad"] + 0.7
        values["node_Nm"] = np.arange(32) / 3.0
    if kind is SensorNoise:
        values["seed"] = 7.0
    if "column" in kind.__dataclass_fields__:
        values["column"] = "torque_Nm"
    if kind is SensorTable:
        values |= {"over": "value", "last": values["first"] + 0.7, "errors": np.arange(9) / 3.0}
    if issubclass(kind, FormulaTorque):  # functions by number
        values |= {name: 1.0 for name in values if "function" in name}
    if {"presliding_rad", "bristle_rad"} <= values.keys():  # laws of one thing
        values["presliding_rad"] = 0.0
    if "knee_width_rad" in values:
        values["knee_width_rad"] = 0.1
    return kind(**values)


@pytest.mark.parametrize("kind", [law for laws in LAWS.values() for law in laws.values()])
def test_a_model_comes_back_exactly_from_its_file(kind, tmp_path):
    rig = replace(BENCH, spring_stiffness_Nm_per_rad=200.0 / 3.0, anchors=("load_mass_kg",))
    model = ActuatorModel(rig, (somewhere(kind),))
    back = read_model(write_model(model, tmp_path / "model.toml"))
    assert back.rig == rig
    (term,) = back.terms
    assert type(term) is kind
    for f in fields(kind):
        np.testing.assert_array_equal(getattr(term, f.name), getattr(model.terms[0], f.name))
    assert list(tmp_path.iterdir()) == [tmp_path / "model.toml"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('effect = "gear-fricton"', "unknown effect 'gear-fricton'; .*'gear-friction'"),
        ('effect = "spring-hysteresis"\nlaw = "bouc"', "unknown law 'bouc'; .*'bouc-wen'"),
        ('effect = "gear-backlash"\nwidth = 0.1', "unknown key 'width'; .*'width_rad'"),
        ('effect = "gear-backlash"', "lacks width_rad"),
        ('effect = "gear-backlash"\nwidth_rad = -0.01', r"width_rad = -0\.01 is outside"),
        ('effect = "gear-backlash"\nwidth_rad = "wide"', "must be a number"),
    ],
)
def test_a_wrong_model_file_is_one_clear_line(text, message, tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(BENCH.to_toml() + "\n[[term]]\n" + text + "\n", encoding="utf-8")
    with pytest.raises(TermError, match=message) as caught:
        read_model(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_impossible_values_are_refused():
    with pytest.raises(TermError, match=r"drive_efficiency = 1\.2 is outside"):
        GearEfficiency(drive_efficiency=1.2, backdrive_efficiency=0.5)
    with pytest.raises(TermError, match=r"yield_1_rad = 0\.0 is outside"):
        SpringHysteresis(stiffness_1_Nm_per_rad=10.0, yield_1_rad=0.0)
    with pytest.raises(TermError, match="column 'torque' is not one of"):
        SensorOffset(column="torque", offset=0.1)
    rig = replace(BENCH, output_inertia_kgm2=0.0)
    with pytest.raises(TermError, match="output_inertia_kgm2 = 0 must be above 0"):
        ActuatorModel(rig, (GearBacklash(width_rad=0.01),)).effects("duty", Load())


def test_readings_are_scaled_shifted_late_drifting_and_noisy():
    time = np.arange(101) * 5e-3
    plain = replace(BENCH, motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None)
    inputs = Inputs(time_s=time, duty=np.full(101, 0.2))
    truth = simulate(ActuatorModel(plain), inputs)
    model = ActuatorModel(
        plain,
        (
            SensorScale(column="load_angle_rad", scale=1.1),
            SensorOffset(column="load_angle_rad", offset=0.02),
            SensorDrift(column="load_angle_rad", rate_per_s=0.1),
            SensorDelay(column="load_angle_rad", delay_s=7e-3),
            SensorNoise(column="torque_Nm", standard_deviation=0.05, seed=4),
        ),
    )
    result = simulate(model, inputs)
    np.testing.assert_array_equal(result.load_angle_rad, truth.load_angle_rad)
    seen = readings(result)
    fine = np.arange(501) * 1e-3
    finer = simulate(ActuatorModel(plain), Inputs(time_s=fine, duty=np.full(501, 0.2)))
    late = finer.load_angle_rad[np.maximum(np.arange(101) * 5 - 7, 0)]
    expected = 1.1 * late + 0.02 + 0.1 * time
    np.testing.assert_allclose(seen["load_angle_rad"], expected, atol=2e-6)
    np.testing.assert_array_equal(seen["load_angle_rad"], result.encoder_load_angle_rad)
    np.testing.assert_array_equal(seen["motor_angle_rad"], truth.motor_angle_rad)
    noise = seen["torque_Nm"] - truth.torque_Nm
    assert noise.std() == pytest.approx(0.05, rel=0.3)
    np.testing.assert_array_equal(
        noise, readings(simulate(model, inputs))["torque_Nm"] - truth.torque_Nm
    )


@pytest.mark.parametrize(("unit", "friction"), [("deg/s", 2.2548), ("rad/s", 0.05449)])
def test_nlfm_in_both_readings_of_table_3_1(unit, friction):
    """At 1.2 rad/s, by eq. 3.7 with the printed numbers: 2 Nm by degrees, under 0.1 by radians."""
    speed = 1.2 * (180.0 / np.pi if unit == "deg/s" else 1.0)
    printed = 1.3710e-2 + 6.1431e-4 + 2.91e-2 * speed + 0.31413 * np.arctan(1.3905e-2 * speed)
    assert printed == pytest.approx(friction, rel=0.02)
    (term,) = thesis.nlfm(gear_ratio=60.0, speed_unit=unit)
    motor = 1.2 * 60.0
    mine = term.offset_Nm + term.coulomb_Nm + term.viscous_Nms_per_rad * motor
    mine += term.arctan_Nm * np.arctan(motor / term.arctan_velocity_rad_per_s)
    assert 60.0 * mine == pytest.approx(printed, rel=1e-12)
    # steady on the machine: the drive holds the speed against friction and the rig's own
    rig = replace(BENCH, motor_viscous_Nms_per_rad=0.0, output_viscous_Nms_per_rad=0.0)
    rig = replace(rig, parts=("drive", "gear"))
    time = np.linspace(0.0, 60.0 if unit == "deg/s" else 600.0, 3)
    motor_torque = np.full(3, printed / 60.0)
    still = simulate(
        ActuatorModel(rig, (term,)),
        Inputs(time_s=time, motor_torque_Nm=motor_torque, load=Load(kind="free")),
    )
    assert still.wheel_velocity_rad_per_s[-1] == pytest.approx(1.2, rel=1e-6)


def test_other_thesis_sets():
    (viscous,) = thesis.ncfm(gear_ratio=60.0, viscous_Nms_per_rad=0.36)
    assert viscous.viscous_Nms_per_rad == pytest.approx(1e-4)
    _, normal = thesis.lfm(gear_ratio=60.0, viscous_Nms_per_rad=0.3, normal_lever_m=0.002)
    assert normal.normal_lever_m == 0.002
    (curve,) = thesis.stribeck(
        gear_ratio=60.0, coulomb_Nm=0.6, static_Nm=0.9, velocity_rad_per_s=0.1, shape=1.5
    )
    assert isinstance(curve, GearFriction)
    assert curve.coulomb_Nm == pytest.approx(0.01)
    assert curve.stribeck_rise == pytest.approx(0.5)
    assert curve.stribeck_velocity_rad_per_s == pytest.approx(6.0)
    assert curve.stribeck_shape == 1.5
    with pytest.raises(TermError, match="static_Nm"):
        thesis.stribeck(gear_ratio=60.0, coulomb_Nm=1.0, static_Nm=0.5, velocity_rad_per_s=0.1)
    with pytest.raises(TermError, match="speed_unit"):
        thesis.nlfm(gear_ratio=60.0, speed_unit="rpm")
