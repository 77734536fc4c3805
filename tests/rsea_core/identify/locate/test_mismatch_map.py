"""A planted effect has the largest share of the mismatch at its own port."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import (
    ContactNonlinear,
    DriveDeadZone,
    GearFriction,
    LoadDisturbance,
    LoadFriction,
    SpringHardening,
)
from rsea_core.identify.locate.mismatch_map import locate
from rsea_core.identify.smoothing.smoother import port_torques
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.recording import Recording
from tests.cases.bench_recordings import RIG, multisine, recorded

TIME = np.arange(1500) * 2e-3
SENSORS = ("current_A", "torque_Nm")
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=60.0,
    contact_angle_rad=0.05,
    contact_damping_Nms_per_rad=0.1,
)
PLANTED = [
    ("drive", Load(), DriveDeadZone(width_duty=0.02)),
    ("gear", Load(), GearFriction(coulomb_Nm=0.02)),
    ("spring", Load(kind="locked"), SpringHardening(stiffness_ratio_at_0p15rad=1.4)),
    ("load", Load(), LoadFriction(coulomb_Nm=0.03)),
    ("environment", CONTACT, ContactNonlinear(exponent=1.6)),
]


def bench(load, *terms, seed=3, sensors=SENSORS):
    """A slow and a lively recording of a machine whose values are not quite the rig's."""
    true = replace(
        RIG, spring_stiffness_Nm_per_rad=68.0, terminal_resistance_ohm=3.95,
        motor_viscous_Nms_per_rad=1.3e-4,
    )  # fmt: skip
    found = []
    size = 0.5 if load.kind == "locked" else 1.0
    for k, duty in enumerate((size * multisine(TIME), 0.12 * np.sin(2 * np.pi * 0.7 * TIME))):
        _, columns = recorded(
            ActuatorModel(true, terms), TIME, load, sensors=sensors, seed=seed + k, duty=duty
        )
        found.append(Recording(file=f"rec{k}.csv", load=load, columns=columns, sample_time_s=2e-3))
    return found


@functools.cache
def located(load, *terms, sensors=SENSORS):
    """What `locate` makes of the bench."""
    recordings = bench(load, *terms, sensors=sensors)
    return locate(RIG, recordings, [port_torques(RIG, r) for r in recordings])


@pytest.mark.parametrize(("subsystem", "load", "term"), PLANTED, ids=[p[0] for p in PLANTED])
def test_a_planted_effect_has_the_largest_share_where_it_was_planted(subsystem, load, term):
    found = located(load, term)
    assert found.subsystem == subsystem, found.shares
    assert found.shares[subsystem] > 0.5
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert all(0.0 <= se < 0.5 for se in found.shares_se.values())


def test_wrong_values_alone_leave_less_than_missing_physics():
    assert located(Load()).level < 0.1 * located(*PLANTED[1][1:]).level


def test_a_disturbance_is_located_in_time():
    pulse = LoadDisturbance(peak_Nm=0.3, start_s=1.5, end_s=2.0)
    found = located(Load(), pulse)
    for level in found.by_recording:
        inside = (TIME > 1.45) & (TIME < 2.2)
        assert np.sum(level[inside] ** 2) > 0.6 * np.sum(level**2)


def test_without_a_torque_sensor_drive_and_gear_are_named_together():
    found = located(Load(), GearFriction(coulomb_Nm=0.02), sensors=())
    assert found.subsystem == "drive or gear"
    assert found.port_shares()["G"] == found.shares["drive or gear"]


def test_a_contact_that_is_not_linear_is_found_at_its_angles():
    found = located(*PLANTED[4][1:])
    concentrated = next(c for c in found.concentrations if c.quantity == "the load's angle")
    assert concentrated.low > 0.01
    assert "the load's angle" in found.where()
