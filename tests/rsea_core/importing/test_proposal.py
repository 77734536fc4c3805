"""Names and numbers decide what a column is; what they leave open is a question, never a guess."""

import shlex

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.importing.answers import answer_text, parse_answer
from rsea_core.importing.case_text import columns_text
from rsea_core.importing.proposal import answered, propose
from rsea_core.importing.streams.column_names import name_evidence
from rsea_core.importing.unit_evidence import step_of
from rsea_core.machine.rig import Rig
from tests.rsea_core.recordings.test_consistency_checks import RIG, recorded


def raw(**changes):
    """The bench's recording under a logger's names; in SI but for the changes."""
    r = recorded()
    names = {"time_s": "t", "duty": "pwm", "motor_angle_rad": "theta_m",
             "load_angle_rad": "theta_l", "current_A": "iq", "torque_Nm": "loadcell"}  # fmt: skip
    data = {label: np.array(r[name]) for name, label in names.items()}
    return {label: changes.get(label, 1.0) * values for label, values in data.items()}


@pytest.mark.parametrize(
    ("label", "factor", "target", "unit", "sign"),
    [
        ("t", 1e3, "time_s", "ms", 1),
        ("t", 1e6, "time_s", "us", 1),
        ("pwm", 100.0, "duty", "percent", 1),
        ("theta_m", 180.0 / np.pi, "motor_angle_rad", "deg", 1),
        ("theta_m", 8192 / (2.0 * np.pi), "motor_angle_rad", "count", 1),
        ("theta_l", -180.0 / np.pi, "load_angle_rad", "deg", -1),
        ("iq", -1e3, "current_A", "mA", -1),
        ("loadcell", 1e3, "torque_Nm", "mN*m", 1),
    ],
)
def test_a_changed_unit_and_sign_is_found_without_a_question(label, factor, target, unit, sign):
    data = raw(**{label: factor})
    if unit == "count":
        data[label] = np.round(data[label])
    found = propose(data, {}, RIG)
    own = found.column(target)
    assert (own.name, own.unit, own.sign) == (label, unit, sign)
    assert not [q for q in found.questions if f"column {label!r}" in q]


def test_an_angle_that_was_measured_behind_the_gear_is_found():
    found = propose(raw(theta_m=1.0 / RIG.gear_ratio), {}, RIG).column("motor_angle_rad")
    assert (found.unit, found.side) == ("rad", "load")


def carriage(**changes):
    """A motor that moves a carriage by a pinion of 50 rad/m, under a logger's names, in SI."""
    rig = Rig(
        name="axis", parts=("drive", "gear", "load"), axis="linear", gear_ratio=50.0,
        torque_constant_Nm_per_A=0.05, motor_inertia_kgm2=1e-4, load_inertia_kgm2=2.0,
        motor_encoder_counts_per_rev=4000.0,
    )  # fmt: skip
    t = np.arange(4000) * 1e-3
    x = 0.05 * np.sin(7.0 * t) + 0.02 * np.sin(19.0 * t)
    force = (2.0 + 50.0**2 * 1e-4) * np.gradient(np.gradient(x, t), t)
    current = force / (50.0 * 0.05) + 1e-3 * np.random.default_rng(1).normal(size=t.size)
    data = {"time": t, "Iq_set": current, "I": current, "enc": 50.0 * x, "x_scale": x}
    return rig, {label: changes.get(label, 1.0) * values for label, values in data.items()}


def test_a_linear_axis_is_logged_in_lengths_and_its_current_shows_signs_and_units():
    counts = 4000.0 / (2.0 * np.pi)
    rig, data = carriage(x_scale=1e6, enc=-counts, Iq_set=1e3, I=1e3)
    data |= {n: np.round(data[n]) for n in ("x_scale", "enc")}
    found = propose(data, {}, rig)
    own = {c.target: (c.name, c.unit, c.sign) for c in found.columns}
    assert own["load_angle_rad"] == ("x_scale", "um", 1)
    assert own["motor_angle_rad"] == ("enc", "count", -1)
    assert own["current_command_A"] == ("Iq_set", "mA", 1)
    assert own["current_A"] == ("I", "mA", 1)
    assert not found.questions


def test_a_scale_in_no_unit_is_asked_with_the_factor_that_fits():
    rig, data = carriage(x_scale=2e6, enc=4000.0 / (2.0 * np.pi))
    data |= {n: np.round(data[n]) for n in ("x_scale", "enc")}
    (question,) = propose(data, {}, rig).questions
    assert "In no unit" in question
    assert 'name = "x_scale", unit = "um", scale = 0.5' in question


def test_a_duty_in_per_mille_is_no_percent():
    found = propose(raw(pwm=1e3), {}, RIG)
    assert found.column("duty").unit == "permille"
    assert not found.questions


def test_counts_of_an_encoder_are_those_of_the_rig_file():
    rig, data = carriage()
    source = parse_answer("motor_angle_rad=enc:count", data, rig).source
    assert source.counts_per_rev == 4000.0
    assert parse_answer("load_angle_rad=x_scale:mm", data, rig).source.unit == "mm"
    with pytest.raises(RecordingError, match='unit "mm" is no unit of rad'):
        parse_answer("load_angle_rad=x_scale:mm", data, RIG)


@pytest.mark.parametrize(
    "known",
    [
        {}, {"sign": -1}, {"side": "load"}, {"scale": 0.5, "sign": -1},
        {"counts_per_rev": 4096.0, "side": "load"},
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["enc", "pos 1: raw", "it's"])
def test_an_answer_as_it_is_proposed_is_read_back_as_it_was_meant(name, known):
    unit = "count" if "counts_per_rev" in known else "rad"
    option, statement = shlex.split(answer_text("motor_angle_rad", name, unit, **known))
    assert option == "--column"
    source = parse_answer(statement, [name]).source
    found = (source.name, source.unit, source.sign, source.side, source.scale)
    usual = {"sign": 1, "side": None, "scale": 1.0} | known
    assert found == (name, unit, usual["sign"], usual["side"], usual["scale"])
    assert source.counts_per_rev == known.get("counts_per_rev")


def test_what_no_name_tells_is_a_question_and_an_answer_settles_it():
    data = raw()
    data["ch7"] = np.cos(data["t"])
    found = propose(data, {}, RIG)
    assert found.references == ("ch7",)
    assert any("'ch7'" in q for q in found.questions)
    short = {n: data[n] for n in ("t", "theta_m")}
    alone = propose(short, {}, None)
    assert alone.column("motor_angle_rad").asks
    settled = answered(alone, parse_answer("motor_angle_rad=theta_m:deg", short))
    assert (settled.column("motor_angle_rad").unit, settled.questions) == ("deg", ())


def test_a_goal_is_a_reference_and_a_log_without_time_says_so():
    data = raw()
    data["theta_goal"] = data["theta_m"]
    assert propose(data, {}, RIG).references == ("theta_goal",)
    del data["t"]
    assert propose(data, {}, RIG).rate_needed


@pytest.mark.parametrize(
    ("name", "quantity", "side", "unit"),
    [
        ("Motor Position [deg]", "angle", "motor", "deg"),
        ("iq_mA", "current", None, "mA"),
        ("omega_l (rpm)", "velocity", "load", "rpm"),
        ("time_ms", "time", None, "ms"),
        ("load_velocity_rad_per_s", "velocity", "load", "rad/s"),
        ("vbus", "supply", None, None),
        ("tau_s", "torque", None, None),
        ("Ucmd", "voltage", None, None),
        ("Iq_set", "current", None, None),
        ("n", "velocity", None, None),
        ("Foo", None, None, None),
    ],
)
def test_names_tell_quantity_side_and_unit(name, quantity, side, unit):
    found = name_evidence(name)
    assert (found.quantity, found.side, found.unit) == (quantity, side, unit)


def test_the_step_of_a_counting_encoder_is_found_and_noise_has_none():
    angle = np.cumsum(np.sin(np.linspace(0.0, 40.0, 5000)))
    assert step_of(0.25 * np.round(angle)) == pytest.approx(0.25)
    assert step_of(angle) is None


def test_the_written_table_names_reason_and_confidence_of_every_column():
    found = propose(raw(theta_m=180.0 / np.pi), {}, RIG)
    entries = [(c, c.name, None) for c in found.columns]
    text = columns_text(entries, references=[], rate_Hz=None)
    assert 'motor_angle_rad = { name = "theta_m", unit = "deg" }' in text
    assert text.count("# 100%") == len(found.columns)


@pytest.mark.parametrize("moves", [np.full(3000, 305.0), 305.0 + np.arange(3000) % 3])
def test_no_step_can_be_read_off_one_speed(moves):
    assert step_of(np.cumsum(moves)) is None


def test_rows_that_were_filled_between_two_halve_no_step():
    counts = np.cumsum(np.random.default_rng(4).integers(-4, 5, 5000)).astype(float)
    rows = np.arange(100, 4900, 230)
    counts[rows] = 0.5 * (counts[rows - 1] + counts[rows + 1])
    assert step_of(0.1 * counts) == pytest.approx(0.1)


def test_a_torque_that_nothing_but_its_name_shows_is_asked():
    rig, data = carriage(enc=4000.0 / (2.0 * np.pi))
    kept = {"time": data["time"], "enc": np.round(data["enc"]), "TRQ": 40.0 * data["I"]}
    questions = propose(kept, {}, rig).questions
    assert any("column 'TRQ': torque_Nm" in q for q in questions)


def test_the_sign_of_a_current_that_alone_drives_is_seen_in_the_motion():
    rig, data = carriage(enc=4000.0 / (2.0 * np.pi), I=-1.0)
    kept = {"time": data["time"], "enc": np.round(data["enc"]), "I": data["I"]}
    found = propose(kept, {}, rig)
    signs = {c.target: c.sign for c in found.columns}
    assert signs["current_A"] * signs["motor_angle_rad"] == -1


def test_turns_per_minute_are_offered_for_a_speed_that_is_named_or_counted_so():
    rig, data = carriage()
    data = {"time": data["time"], "N": np.round(900.0 * np.sin(data["time"])), "I": data["I"]}
    assert any("in rpm" in q for q in propose(data, {}, rig).questions)
