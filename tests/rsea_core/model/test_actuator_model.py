"""Models, inputs and springs describe themselves and refuse what cannot be."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from rsea_core import ActuatorModel, InputError, Inputs, Load, Rig, read_spring_curve, simulate
from rsea_core.effects import Port, SpringCurve, Term, parameter
from rsea_core.errors import RigError, RseaError, SimulationError, TermError
from rsea_core.machine import quantities as q
from rsea_core.model.spring_curve_file import SignWarning

BENCH = Rig.preset("rsea-bench")
D = np.array([-0.2, -0.1, 0.0, 0.15, 0.2])
T = np.array([-14.0, -6.0, 0.0, 10.0, 15.0])
CONTACT = {
    "contact_stiffness_Nm_per_rad": 50.0,
    "contact_angle_rad": 0.1,
    "contact_damping_Nms_per_rad": 0.5,
}


def test_description_prints_equations_values_units_and_sources():
    curve = SpringCurve(deflection_rad=D, torque_Nm=T, source="a bench of ours")
    rig = replace(BENCH, torque_constant_Nm_per_A=0.38, terminal_inductance_H=None)
    load = Load(kind="contact", **CONTACT)

    text = ActuatorModel(rig, (curve,)).describe("duty", load)

    for part in (
        "i = (supply_voltage duty - k_e N w_w) / R,  |i| <= 6.06 A",
        "J dw_w/dt = tau_drive - B w_w - tau_s",
        "- m g d sin(theta_l + offset) - [K_e (theta_l - theta_e)",
        "back_emf_constant_Vs_per_rad = 0.3056 Vs/rad",
        "J at the output = 1.154 kg m^2",
        "term spring-curve at spring: f(d) = piecewise cubic through 5 points",
        "a bench of ours",
        "in place of spring_stiffness_Nm_per_rad",
        "terminal_inductance_H: the current follows the voltage at once",
        "finding: torque_constant",
    ):
        assert part in text
    assert "L di/dt" not in text
    assert "L di/dt" in ActuatorModel(BENCH).describe()
    assert "held" not in ActuatorModel(BENCH).describe("current_command_A", Load(kind="locked"))
    rigid = replace(BENCH, parts=("drive", "gear", "load"), axis="linear")
    assert "one rigid body" in ActuatorModel(rigid).describe()
    assert "rad stands for m" in ActuatorModel(rigid).describe()
    assert "rigid" in ActuatorModel(rigid).describe("motor_torque_Nm", Load(kind="locked"))


def test_parameters_carry_unit_bounds_source_and_anchor():
    model = ActuatorModel(BENCH).with_terms(SpringCurve(deflection_rad=D, torque_Nm=T))

    found = model.parameters()

    assert found["spring_stiffness_Nm_per_rad"].unit == "Nm/rad"
    assert not found["load_mass_kg"].free
    assert found["gear_ratio"].free
    assert found["spring-curve.torque_scale"].bounds == (0.1, 10.0)
    assert found["gravity_angle_offset_rad"].bounds == (-np.inf, np.inf)


def test_term_parameters_outside_their_bounds_are_named():
    with pytest.raises(TermError, match=r"torque_scale = 0.01 is outside \[0.1, 10.0\]"):
        SpringCurve(deflection_rad=D, torque_Nm=T, torque_scale=0.01)
    with pytest.raises(TermError, match="torque_scale = nan is outside"):
        SpringCurve(deflection_rad=D, torque_Nm=T, torque_scale=float("nan"))


def test_model_refuses_foreign_terms_and_two_springs():
    @dataclass(frozen=True, kw_only=True)
    class Wish(Term):
        effect: ClassVar[str] = "wish"
        port: ClassVar[Port] = Port.SPRING
        depth_Nm: float = parameter(
            0.5, unit="Nm", bounds=(0.0, 1.0), source="none", meaning="None."
        )

        def equation(self):
            return "0"

    with pytest.raises(TermError, match="Wish is not one of the terms"):
        ActuatorModel(BENCH, (Wish(),))
    curve = SpringCurve(deflection_rad=D, torque_Nm=T)
    with pytest.raises(TermError, match="two terms replace spring_stiffness_Nm_per_rad"):
        ActuatorModel(BENCH, (curve, curve))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"deflection_rad": D[::-1]}, "deflection_rad must increase: 0.2 is followed by 0.15"),
        ({"torque_Nm": [-14, -6, 0, 10, 9]}, "torque_Nm must increase: 10 is followed by 9"),
        ({"torque_Nm": T[:-1]}, "torque_Nm has 4 values, deflection_rad 5"),
        ({"deflection_rad": [0.0]}, "at least 2 finite numbers"),
        ({"torque_Nm": [*T[:-1], np.inf]}, "at least 2 finite numbers"),
        ({"tangent_Nm_per_rad": [60, 60, 60, 60, -1]}, r"tangent_Nm_per_rad[4] = -1 must be above"),
        (
            {"tangent_Nm_per_rad": [60, 60, 900, 60, 60]},
            "do not fit the torques between deflection_rad",
        ),
        ({"torque_Nm": T + 3.0}, "torque at zero deflection is 3 Nm; at most 0.18 Nm"),
        ({"deflection_rad": D + 0.3}, "0.1..0.5 must include 0"),
        ({"contact_onset_rad": (0.1, 0.2)}, "must be below and above 0"),
    ],
)
def test_unusable_spring_curve_gets_one_line(values, message):
    with pytest.raises(TermError) as caught:
        SpringCurve(**{"deflection_rad": D, "torque_Nm": T, **values})
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_valid_range_ends_at_the_first_contact_or_the_last_point():
    curve = SpringCurve(deflection_rad=D, torque_Nm=T, contact_onset_rad=(-0.12, 0.9))
    assert curve.valid_range_rad == (-0.12, 0.2)
    assert SpringCurve(deflection_rad=D, torque_Nm=T).valid_range_rad == (-0.2, 0.2)


def test_curve_file_is_read_and_its_faults_are_located(tmp_path):
    path = tmp_path / "curve.csv"
    rows = "deflection_rad,torque_Nm\n-0.1,-6\n0,0\n0.1,7\n"
    path.write_text(f"# sign: actuator\n{rows}", encoding="utf-8")
    np.testing.assert_array_equal(read_spring_curve(path).torque_Nm, [-6.0, 0.0, 7.0])
    path.write_text(f"# sign: winding\n# contact_positive_rad: 0.08\n{rows}", encoding="utf-8")
    mirrored = read_spring_curve(path)
    np.testing.assert_array_equal(mirrored.torque_Nm, [-7.0, 0.0, 6.0])
    assert mirrored.contact_onset_rad == (-0.08, None)
    path.write_text(rows, encoding="utf-8")
    with pytest.warns(SignWarning, match="two directions differ"):
        read_spring_curve(path)
    for text, message in (
        ("deflection_rad,torque_Nm\n0,0\n0.1,x\n", "column torque_Nm, row 3: 'x' is not a number"),
        ("deflection_rad,torque_Nm\n0,0\n0.1,nan\n", "row 3: nan is not a finite number"),
        ("deflection_rad,torque_Nm\n0,0\n0.1\n", "row 3 has 1 values, the header 2"),
        (
            "deflection_deg,torque_Nm\n",
            "unknown key 'deflection_deg'; the nearest known one is 'def",
        ),
        ("deflection_rad\n0\n", "needs the column torque_Nm once"),
        ("", "is empty"),
        (f"# sign: left\n{rows}", "known are winding, actuator"),
        (f"# sign: winding\n# contact_positive_rad: -0.08\n{rows}", "must be below and above 0"),
        (
            "deflection_rad,torque_Nm\n0,0\n0.1,-7\n",
            "curve.csv: spring-curve: torque_Nm must increase",
        ),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(TermError) as caught:
            read_spring_curve(path)
        assert message in str(caught.value)
    with pytest.raises(TermError, match="cannot be read"):
        read_spring_curve(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kind": "pendelum"}, "load 'pendelum' is unknown; the nearest known one is 'pendulum'"),
        ({"kind": "contact"}, "load 'contact' needs contact_stiffness_Nm_per_rad"),
        ({"kind": "constant-torque"}, "needs load_torque_Nm"),
        ({"kind": "free", "load_torque_Nm": 1.0}, "has no use for load_torque_Nm = 1.0"),
        ({"kind": "contact", **CONTACT, "contact_stiffness_Nm_per_rad": 0.0}, "above 0"),
        ({"kind": "contact", **CONTACT, "contact_damping_Nms_per_rad": -1.0}, "not be below 0"),
        ({"kind": "constant-torque", "load_torque_Nm": float("inf")}, "must be finite"),
    ],
)
def test_unusable_load_gets_one_line(values, message):
    with pytest.raises(InputError) as caught:
        Load(**values)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"time_s": [0.0]}, "at least 2 finite numbers"),
        ({"time_s": [0.0, 0.1, 0.1]}, "time_s[2] = 0.1 does not come after"),
        ({"duty": [0.0, 1.2, 0.0]}, "duty[1] = 1.2 must lie in -1..1"),
        ({"duty": [0.0, 1.0]}, "duty has shape (2,), time_s has 3 rows"),
        ({"duty": [0.0, np.nan, 0.0]}, "duty[1] = nan must be finite"),
        ({"duty": np.zeros(3), "voltage_V": np.zeros(3)}, "one command, not duty and voltage_V"),
        ({"load": Load(kind="imposed")}, 'load_angle_rad is needed for the load "imposed"'),
        ({"load_angle_rad": np.zeros(3)}, "and only there"),
        ({"initial_load_angle_rad": np.inf}, "initial_load_angle_rad = inf must be finite"),
    ],
)
def test_unusable_inputs_get_one_line(values, message):
    with pytest.raises(InputError) as caught:
        Inputs(**{"time_s": [0.0, 0.1, 0.2], **values})
    assert message in str(caught.value)


ZERO = np.zeros(3)
SECONDS = np.array([0.0, 0.1, 0.2])


@pytest.mark.parametrize(
    ("changes", "inputs", "error", "message"),
    [
        (
            {"supply_voltage_V": None},
            {"duty": ZERO},
            RigError,
            "driven by duty needs supply_voltage",
        ),
        (
            {"terminal_resistance_ohm": None, "back_emf_constant_Vs_per_rad": None},
            {"voltage_V": ZERO},
            RigError,
            "needs terminal_resistance_ohm, back_emf_constant_Vs_per_rad in [rig]",
        ),
        ({"motor_inertia_kgm2": None}, {"duty": ZERO}, RigError, "motion needs motor_inertia_kgm2"),
        (
            {"spring_stiffness_Nm_per_rad": None},
            {"duty": ZERO},
            RigError,
            "the spring needs spring",
        ),
        (
            {"load_inertia_kgm2": None},
            {"duty": ZERO},
            RigError,
            '"pendulum" needs load_inertia_kgm2',
        ),
        ({"load_mass_kg": None}, {"duty": ZERO}, RigError, "gravity on the load"),
        (
            {"motor_inertia_kgm2": 0.0, "output_inertia_kgm2": 0.0},
            {"duty": ZERO},
            RigError,
            "the moving inertia is zero",
        ),
        ({}, {}, InputError, "has a drive: give a command (duty, voltage_V"),
        ({"parts": ("load",)}, {"duty": ZERO}, InputError, "has no drive: duty has nothing to act"),
        ({"parts": ("drive", "gear")}, {"duty": ZERO}, InputError, "has no load"),
        ({"parts": ("spring", "load")}, {}, RigError, "nothing moves without a gear"),
    ],
)
def test_machine_that_lacks_something_says_what(changes, inputs, error, message):
    with pytest.raises(error) as caught:
        simulate(ActuatorModel(replace(BENCH, **changes)), Inputs(time_s=SECONDS, **inputs))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "stated",
    [{"motor_inertia_kgm2": 2e-4}, {"output_inertia_kgm2": 5e-3}, {"load_inertia_kgm2": 5e-3}],
)
def test_one_stated_inertia_of_a_rigid_train_is_enough(stated):
    """w = tau t/J, from a held motor torque; the output's inertia is 25 times the motor's."""
    rig = Rig(name="axis", parts=("drive", "gear", "load"), gear_ratio=5.0, **stated)
    torque = np.full(SECONDS.size, 0.01)
    given = Inputs(time_s=SECONDS, motor_torque_Nm=torque, load=Load(kind="free"))
    speed = simulate(ActuatorModel(rig), given).motor_velocity_rad_per_s
    assert speed == pytest.approx(0.01 / 2e-4 * SECONDS, rel=1e-9)


def test_values_that_a_load_does_not_need_may_be_missing():
    rig = replace(BENCH, load_mass_kg=None, load_inertia_kgm2=None, current_limit_A=None)
    result = simulate(
        ActuatorModel(rig), Inputs(time_s=SECONDS, duty=ZERO + 0.2, load=Load(kind="locked"))
    )
    assert result.torque_Nm[-1] > 0.1


def test_a_stop_on_a_machine_whose_mass_is_not_stated_acts_without_gravity():
    stop = Load(kind="contact", contact_stiffness_Nm_per_rad=20.0, contact_angle_rad=0.01,
                contact_damping_Nms_per_rad=0.1)  # fmt: skip
    given = Inputs(time_s=0.01 * np.arange(60), duty=np.full(60, 0.3), load=stop)
    unstated = replace(BENCH, load_mass_kg=None, load_distance_m=None)
    angle, weightless = (
        simulate(ActuatorModel(rig), given).load_angle_rad
        for rig in (unstated, replace(BENCH, load_mass_kg=0.0))
    )
    assert np.array_equal(angle, weightless)
    assert angle.max() > 0.01
    with pytest.raises(RigError, match="needs load_distance_m"):
        simulate(ActuatorModel(replace(BENCH, load_distance_m=None)), given)


def test_step_that_is_too_long_is_refused_with_the_longest_that_does():
    inputs = Inputs(time_s=SECONDS, duty=ZERO)
    with pytest.raises(InputError) as caught:
        simulate(ActuatorModel(BENCH), inputs, step_s=0.05)
    longest = float(str(caught.value).split("at most ")[1].split(" s")[0])
    simulate(ActuatorModel(BENCH), inputs, step_s=0.99 * longest)
    with pytest.raises(InputError, match="must be above 0"):
        simulate(ActuatorModel(BENCH), inputs, step_s=0.0)
    with pytest.raises(InputError, match="leave a negligible terminal_inductance_H out"):
        simulate(ActuatorModel(replace(BENCH, terminal_inductance_H=1e-9)), inputs)


def test_states_beyond_numbers_end_the_run_with_its_time():
    rig = Rig(name="drum", parts=("load",), load_inertia_kgm2=1e-300)
    with pytest.raises(SimulationError, match="left the range of numbers at t = ") as caught:
        simulate(
            ActuatorModel(rig),
            Inputs(
                time_s=np.linspace(0.0, 1e8, 5),
                load=Load(kind="constant-torque", load_torque_Nm=1.0),
            ),
        )
    assert caught.value.exit_status == 3


def test_trajectory_has_the_columns_of_a_recording_and_is_written_whole(tmp_path):
    time = np.arange(200) * 1e-3
    result = simulate(ActuatorModel(BENCH), Inputs(time_s=time, duty=0.4 * np.sin(9.0 * time)))

    path = result.to_csv(tmp_path / "run.csv")

    text = path.read_text(encoding="utf-8").splitlines()
    header = text[0].split(",")
    for name in ("time_s", "duty", "motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm"):
        assert name in header
    read = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(read[:, header.index("torque_Nm")], result.torque_Nm)
    assert [p.name for p in tmp_path.iterdir()] == ["run.csv"]
    with pytest.raises(RseaError, match="cannot be written: No such file"):
        result.to_csv(tmp_path / "no folder" / "run.csv")
    with pytest.raises(ValueError, match="read-only"):
        result.torque_Nm[0] = 1.0


def test_row_readings_are_taken_before_the_rows_command_acts():
    time = np.arange(4) * 1e-3
    result = simulate(ActuatorModel(BENCH), Inputs(time_s=time, duty=[0.0, 0.5, 0.0, 0.0]))
    assert result.current_A[0] == result.current_A[1] == 0.0
    assert result.current_A[2] > 1.0
    np.testing.assert_array_equal(result.command, [0.0, 0.5, 0.0, 0.0])


def test_encoders_show_the_last_whole_count():
    count = q.count_angle_rad(8192)
    np.testing.assert_allclose(
        q.quantise_angle([0.0, 0.6 * count, -0.1 * count, 2.9 * count], 8192),
        [0.0, 0.0, -count, 2.0 * count],
        rtol=1e-12,
    )
    time = np.arange(300) * 1e-3
    result = simulate(ActuatorModel(BENCH), Inputs(time_s=time, duty=0.5 * np.sin(20.0 * time)))
    expected = q.quantise_angle(result.motor_angle_rad, 8192)
    np.testing.assert_allclose(result.encoder_motor_angle_rad, expected, atol=1e-15)
    with pytest.raises(InputError, match="must be positive"):
        q.count_angle_rad(0)


def test_pwm_of_the_bench_program_is_duty_about_50_percent():
    np.testing.assert_allclose(q.pwm_to_duty([0.0, 50.0, 62.5, 100.0]), [-1.0, 0.0, 0.25, 1.0])
    np.testing.assert_allclose(q.duty_to_pwm([-1.0, 0.25]), [0.0, 62.5])
    with pytest.raises(InputError, match=r"0\.\.100"):
        q.pwm_to_duty(101.0)
    with pytest.raises(InputError, match=r"-1\.\.1"):
        q.duty_to_pwm(-1.1)
    assert q.radians_to_degrees(q.degrees_to_radians(37.0)) == pytest.approx(37.0)
