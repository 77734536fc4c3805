"""Laws that both angles and the torque refute, whatever moves the machine.

The torque reads 0.5 Nm too large, and the rig file's stiffness is 10 % off.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from rsea_core.identify.candidates.angle_relation import angle_relation
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, read_case
from rsea_core.recordings.recording import Recording
from tests.cases.places import SHARED_DATA

RATIO, STIFFNESS, COUNTS, NOISE_Nm = 50.0, 200.0, 8192, 0.01
TIME = 0.002 * np.arange(4000)
LOAD = 0.6 * np.sin(2.0 * TIME) + 0.2 * np.sin(7.3 * TIME)
TORQUE = 4.0 * np.sin(5.1 * TIME) + 1.5 * np.sin(13.0 * TIME + 1.0)


def case(
    *, spring: bool = True, deflection=TORQUE / STIFFNESS, error=0.0, size: float = 1.0,
    torque: bool = True,
) -> Case:  # fmt: skip
    """Readings of a motion; `error` is what the wheel turns further, `size` a factor of all."""
    rng = np.random.default_rng(3)
    parts = ("drive", "gear", "spring", "load") if spring else ("drive", "gear", "load")
    held = {"spring_stiffness_Nm_per_rad": 0.9 * STIFFNESS} if spring else {}
    rig = Rig(
        name="joint", parts=parts, torque_constant_Nm_per_A=0.1, motor_inertia_kgm2=1e-5,
        gear_ratio=RATIO, load_inertia_kgm2=0.02, current_limit_A=10.0,
        motor_encoder_counts_per_rev=COUNTS, load_encoder_counts_per_rev=COUNTS * 16,
        torque_sensor_noise_Nm=NOISE_Nm, **held,
    )  # fmt: skip
    wheel = size * (LOAD + (deflection if spring else 0.0)) + error

    def counted(angle, counts):
        count = 2.0 * np.pi / counts
        return count * np.round(angle / count + rng.uniform(-0.5, 0.5, TIME.size))

    columns = {
        "time_s": TIME, "current_command_A": np.zeros(TIME.size),
        "motor_angle_rad": counted(RATIO * wheel, COUNTS),
        "load_angle_rad": counted(size * LOAD, 16 * COUNTS),
    }  # fmt: skip
    if torque:
        columns["torque_Nm"] = 0.5 + size * TORQUE + NOISE_Nm * rng.standard_normal(TIME.size)
    r = Recording(file="a.csv", load=Load(kind="free"), columns=columns, sample_time_s=0.002)
    return Case(name="joint", folder=Path(), rig=rig, recordings=(r,))


def refuted(c: Case) -> set[tuple[str, str | None]]:
    relation = angle_relation(c)
    assert relation is not None
    laws = catalogue(c, relative=True).values()
    return {(law.effect, law.sensor) for law in laws if relation.refutes(law)}


def test_a_linear_spring_refutes_laws_of_spring_and_train_and_no_others():
    """A stiffness 10 % off and an offset of the torque are part of the relation."""
    found = refuted(case())
    assert {
        ("spring-hysteresis", None), ("spring-hardening", None), ("spring-viscoelastic", None),
        ("gear-backlash", None), ("gear-transmission-error", None),
        ("sensor-scale", "load_angle_rad"), ("sensor-scale", "motor_angle_rad"),
        ("sensor-delay", "torque_Nm"), ("sensor-drift", "motor_angle_rad"),
    } <= found  # fmt: skip
    assert not found & {
        ("sensor-offset", "torque_Nm"), ("sensor-scale", "torque_Nm"), ("gear-friction", None),
        ("sensor-offset", "load_angle_rad"), ("spring-parallel", None), ("load-friction", None),
        ("sensor-scale", "current_A"), ("motor-cogging", None),
    }  # fmt: skip


def test_two_encoders_of_a_rigid_train_refute_all_but_an_error_of_the_ratio():
    found = refuted(case(spring=False, torque=False))
    assert {("gear-transmission-error", None), ("sensor-delay", "load_angle_rad")} <= found
    assert ("sensor-scale", "load_angle_rad") not in found
    assert ("spring-hysteresis", None) not in found


LOST_MOTION = 0.002 * np.sign(np.sin(5.1 * TIME))
STIFFENING = TORQUE / STIFFNESS * (1.0 - 0.005 * TORQUE**2)


@pytest.mark.parametrize(
    "made",
    [
        {"error": 3e-4 * np.sin(4.0 * LOAD)},
        {"error": LOST_MOTION},
        {"deflection": STIFFENING},
        {"deflection": TORQUE / STIFFNESS + 2e-5 * np.gradient(TORQUE, TIME)},
        {"error": 2e-4 * TIME},
        {"spring": False, "torque": False, "error": 3e-4 * np.sin(LOAD)},
    ],
    ids=["transmission error", "backlash", "hardening", "damper", "drift", "rigid, wheel error"],
)
def test_a_law_that_acts_leaves_more_than_white_noise(made):
    assert angle_relation(case(**made)) is None


def test_laws_of_a_spring_that_hardly_deflects_are_not_refuted():
    relation = angle_relation(case(size=0.1))
    assert relation is not None
    assert not relation.spring_is_linear
    effects = {effect for effect, _ in refuted(case(size=0.1))}
    assert "gear-transmission-error" in effects
    assert "spring-hysteresis" not in effects


def test_laws_of_a_spring_whose_torque_is_not_read_are_not_refuted():
    assert angle_relation(case(torque=False)) is None


@pytest.mark.parametrize("name", ["practice", "practice-wide", "practice-wide/more"])
def test_no_practice_case_has_a_law_that_its_readings_refute(name):
    folder = SHARED_DATA / name
    if not (folder / "labels.json").exists():
        pytest.skip("the practice cases are not part of this repository")
    satisfied = 0
    for case_name, label in json.loads((folder / "labels.json").read_text()).items():
        c = read_case(folder / "cases" / case_name)
        if angle_relation(c) is not None:
            satisfied += 1
            assert not {effect for effect, _ in refuted(c)} & set(label["effects"]), case_name
    assert satisfied >= 5
