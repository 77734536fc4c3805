"""Every physics table of a scenario file is read, and every wrong entry is named."""

from pathlib import Path

import pytest

from rsea_core import Scenario
from rsea_core.effects import DriveDelay, GearFriction, LoadDisturbance
from rsea_core.effects.registry import ContactNonlinear
from rsea_core.errors import ScenarioError, TermError


def scenario(**more):
    tables = {
        "rig": "rsea-bench",
        "spring": {"stiffness_Nm_per_rad": 65.8},
        "load": {"kind": "pendulum"},
        "reference": {"kind": "sine", "amplitude_Nm": 0.2, "frequency_Hz": 1.0},
        "controller": {"kind": "pid-torque"},
        "simulation": {"duration_s": 0.05},
    }
    return Scenario.from_tables(tables | more, where="here.toml", folder=Path())


def test_terms_disturbance_environment_and_sensors_are_read():
    found = scenario(
        terms=[
            {"effect": "gear-friction", "coulomb_Nm": 0.02},
            {"effect": "drive-delay", "delay_s": 0.002},
        ],
        disturbance={"start_s": 0.01, "end_s": 0.02, "peak_Nm": 0.5},
        environment={"exponent": 1.5},
        load={
            "kind": "contact",
            "contact_stiffness_Nm_per_rad": 30.0,
            "contact_angle_rad": 0.1,
            "contact_damping_Nms_per_rad": 0.0,
        },
        sensors={"motor_encoder_counts_per_rev": 0, "load_encoder_counts_per_rev": 4096},
    )
    by_type = {type(term): term for term in found.terms}
    assert by_type[GearFriction].coulomb_Nm == 0.02
    assert by_type[DriveDelay].delay_s == 0.002
    assert by_type[LoadDisturbance].peak_Nm == 0.5
    assert by_type[ContactNonlinear].exponent == 1.5
    assert found.rig.motor_encoder_counts_per_rev is None
    assert found.rig.load_encoder_counts_per_rev == 4096


def test_sensors_that_misread_are_terms_like_any_other():
    found = scenario(
        terms=[
            {"effect": "sensor-offset", "column": "load_angle_rad", "offset": 0.1},
            {"effect": "sensor-table", "column": "torque_Nm", "over": "value", "first": -1.0,
             "last": 1.0, "errors": [0.2, 0.0, 0.3]},
        ],
    )  # fmt: skip
    offset, table = found.terms
    assert (offset.column, offset.offset) == ("load_angle_rad", 0.1)
    assert (table.column, list(table.errors)) == ("torque_Nm", [0.2, 0.0, 0.3])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"terms": [{"effect": "gear-fricton"}]}, "nearest known one is 'gear-friction'"),
        (
            {"terms": [{"effect": "gear-friction", "coulomb": 1.0}]},
            "unknown key 'coulomb'; the nearest known one is 'coulomb_Nm'",
        ),
        ({"terms": [{"effect": "drive-delay"}]}, "needs delay_s"),
        ({"terms": [{"coulomb_Nm": 1.0}]}, "effect is missing"),
        ({"terms": [{"effect": "sensor-offset", "offset": 0.1}]}, "sensor-offset needs column"),
        ({"terms": "friction"}, "must be tables"),
        ({"disturbance": {"start_s": 1.0}}, "load-disturbance needs end_s, peak_Nm"),
        ({"sensors": {"encoder": 1}}, "unknown key 'encoder'"),
        ({"distrubance": {}}, "the nearest known one is 'disturbance'"),
        ({"terms": [{"effect": "drive-delay", "delay_s": "late"}]}, "delay_s"),
    ],
)
def test_a_wrong_entry_is_named_in_one_line(more, message):
    with pytest.raises((ScenarioError, TermError), match=message) as refused:
        scenario(**more)
    assert "\n" not in str(refused.value)


def test_a_value_out_of_bounds_is_refused():
    with pytest.raises(ScenarioError, match="coulomb_Nm"):
        scenario(terms=[{"effect": "gear-friction", "coulomb_Nm": -1.0}])
