"""A reading's scale against the constants that mimic it; errors of distances between fits."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.case import Case
from rsea_core.identify.alternatives import _scatter
from rsea_core.identify.diagnose import diagnose
from rsea_core.inputs import Load
from rsea_core.model import ActuatorModel
from rsea_core.recording import Recording
from tests.verification.test_identify_smooth import RIG as OWNED
from tests.verification.test_identify_smooth import multisine, recorded

RIG = replace(OWNED, anchors=())
TIME = np.arange(1500) * 2e-3
SCALE = 1.25


def found(tmp_path, machine, scale):
    recordings = []
    for k, duty in enumerate((multisine(TIME), 0.12 * np.sin(4.4 * TIME))):
        _, columns = recorded(
            ActuatorModel(machine, ()), TIME, Load(), sensors=("current_A", "torque_Nm"), seed=k,
            duty=duty,
        )  # fmt: skip
        columns = dict(columns) | {"torque_Nm": scale * columns["torque_Nm"]}
        recordings.append(
            Recording(file=f"rec{k}.csv", role="identification", columns=columns,
                      sample_time_s=2e-3)
        )  # fmt: skip
    case = Case(name="scaled", folder=tmp_path, rig=RIG, recordings=tuple(recordings))
    return diagnose(case, quick=True).document


def test_a_torque_sensor_in_another_scale_is_named_and_no_constant_pays_for_it(tmp_path):
    document = found(tmp_path, RIG, SCALE)
    assert [e["name"] for e in document["effects"]] == ["sensor-scale"]
    effect = document["effects"][0]
    assert document["verdict"] == "missing-physics"
    assert effect["subsystem"] == document["location"]["subsystem"] == "sensor:torque_Nm"
    scale = effect["parameters"]["scale"]
    assert abs(scale["value"] - SCALE) < 2.0 * scale["std"] < 0.2
    for key in ("torque_constant_Nm_per_A", "spring_stiffness_Nm_per_rad", "load_mass_kg"):
        value = document["parameters_corrected"][key]
        assert abs(value["to"] - value["from"]) < 2.0 * value["std"] + 1e-3 * value["from"]


def test_two_wrong_constants_are_not_taken_for_the_scale_of_a_reading(tmp_path):
    machine = replace(
        RIG,
        torque_constant_Nm_per_A=1.3 * RIG.torque_constant_Nm_per_A,
        spring_stiffness_Nm_per_rad=1.6 * RIG.spring_stiffness_Nm_per_rad,
    )
    document = found(tmp_path, machine, 1.0)
    assert document["verdict"] == "parameters-only"


def test_errors_of_distances_are_those_of_repeated_recordings():
    rng = np.random.default_rng(5)
    blocks, length, trials = 400, 20, 3000
    slow = np.repeat(rng.standard_normal((trials, 2, blocks // 4)), 4, axis=2)
    own = rng.standard_normal((trials, 2, blocks)) + slow
    shared = rng.standard_normal((trials, 1, blocks))
    squares = (shared + own * np.array([1.0, 1.6])[:, None]) ** 2
    apart = np.diff(np.log(squares.mean(axis=2)), axis=1)[:, 0]
    said = [_scatter(pair, length)[0] for pair in squares]
    assert np.mean(said) == pytest.approx(np.var(apart), rel=0.12)
