"""A locked load whose angle follows the spring's torque is found; one that holds is left alone."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.clamped_loads import with_yielding_clamps
from rsea_core.machine.inputs import Load
from tests.cases.planted import RIG, recording


def clamped(clamp_Nm_per_rad, *, counts=4096):
    """A locked recording whose load turns against a clamp of so much."""
    from rsea_core.recordings.case import Case

    made = recording((), "locked", "held.csv", 1)
    rig = replace(RIG, load_encoder_counts_per_rev=counts)
    deflection = made["motor_angle_rad"] / rig.gear_ratio - made["load_angle_rad"]
    torque = rig.spring_stiffness_Nm_per_rad * deflection
    step = 2.0 * np.pi / counts
    moved = np.round(torque / clamp_Nm_per_rad / step) * step
    columns = dict(made.columns) | {
        "load_angle_rad": made["load_angle_rad"] + moved,
        "motor_angle_rad": made["motor_angle_rad"] + rig.gear_ratio * moved,
    }
    made = replace(made, columns=columns, logged=None, load=Load(kind="locked"))
    return Case(name="clamp", folder=None, rig=rig, recordings=(made,)), torque


def test_a_clamp_that_yields_is_found_with_its_stiffness_and_its_motion_is_imposed():
    stiffness = 10.0 * RIG.spring_stiffness_Nm_per_rad
    case, torque = clamped(stiffness)
    found, clamps = with_yielding_clamps(case)
    assert found.recordings[0].load.kind == "imposed"
    assert clamps[0].stiffness_Nm_per_rad == pytest.approx(stiffness, rel=0.05)
    assert clamps[0].travel_rad == pytest.approx(np.ptp(torque) / stiffness, rel=0.1)
    assert "held.csv" in clamps[0].sentence()


def test_a_clamp_that_holds_stays_locked():
    found, clamps = with_yielding_clamps(clamped(1e6)[0])
    assert found.recordings[0].load.kind == "locked"
    assert not clamps


def test_a_load_angle_that_drifts_without_torque_is_no_clamp_that_yields():
    case, _ = clamped(1e6)
    made = case.recordings[0]
    drift = np.linspace(0.0, 0.05, made.rows) ** 2
    moved = replace(made, columns=dict(made.columns) | {"load_angle_rad": drift})
    found, clamps = with_yielding_clamps(replace(case, recordings=(moved,)))
    assert not clamps
    assert found.recordings[0].load.kind == "locked"
