"""Cases of position-goal servos, of the arm `so101-servo-arm` and the legs `go2-legs`, diagnosed.

    python -m benchmarks.servo_cases REAL2 --out out/servo [--set so101,go2] [--only elbow]

REAL2 holds the folders `so101-servo-arm` and `go2-legs` (they are not part of this repository). One
case is written for each joint, in the form of docs/recordings.md, diagnosed by `dftfs diagnose`'s
own call without any setting for the set, and predicted: of so101 two motions that were not fitted
(free run over the whole motion, root mean square error of the position), of go2 the last 8 s.
"""

import argparse
import ast
import csv
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.recordings.case import read_case, read_test

ARM_JOINTS = {"rotation": 0, "pitch": 1, "elbow": 2, "wrist_pitch": 3}  # columns of the raw lists
FITTED = ("step_response", "friction_gravity", "single_joint_elbow")
HELD_OUT = ("hold_under_gravity", "backlash_detection")
BY_HAND = {  # rms error [mrad] on HELD_OUT, best of three hand-fitted models (README of the set)
    "rotation": (1.8, 5.8), "pitch": (26.3, 6.9), "elbow": (18.0, 7.8), "wrist_pitch": (20.6, 3.0),
}  # fmt: skip
LEGS = tuple(
    f"{leg}_{joint}" for joint in ("hip", "thigh", "calf") for leg in ("FL", "FR", "RL", "RR")
)
LAST_s = 8.0
# the arm's inertia and mass are nowhere stated: a kilogram at 0.1 m, wide; only ratios are seen
ARM_RIG = """[rig]
name = "so101 {joint}"
parts = ["drive", "gear", "load"]
servo = "angle"
gear_ratio = 345.0
output_inertia_kgm2 = 0.008
load_inertia_kgm2 = 0.002
load_mass_kg = {mass}
load_distance_m = 0.1
load_encoder_counts_per_rev = 4096

[tolerances]
output_inertia_kgm2 = 0.5
load_inertia_kgm2 = 0.5
load_mass_kg = 1.0
gravity_angle_offset_rad = 1.0
"""
# gains are the logger's settings, 0.01 kg m2 is the rotor's of the robot's own model
LEG_RIG = """[rig]
name = "go2 {joint}"
parts = ["drive", "load"]
servo = "angle"
servo_proportional_Nm_per_rad = 20.0
servo_derivative_Nms_per_rad = 1.5
load_inertia_kgm2 = 0.03
load_mass_kg = 1.0
load_distance_m = 0.1

[tolerances]
servo_proportional_Nm_per_rad = 0.01
servo_derivative_Nms_per_rad = 0.01
load_inertia_kgm2 = 0.7
load_mass_kg = 1.0
gravity_angle_offset_rad = 1.0
"""
RECORDING = """
[[recording]]
file = "{file}.csv"
load = "{load}"
role = "{role}"
initial_rest = {rest}
"""


def _lists(path: Path, column: str) -> tuple[NDArray, NDArray]:
    """Times [s] and the lists (n, 6) of one column of a raw log."""
    with open(path, encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    time_s = np.array([float(row["timestamp"]) for row in rows]) * 1e-6
    return time_s, np.array([ast.literal_eval(row[column]) for row in rows])


def _write(path: Path, columns: dict[str, NDArray]) -> None:
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")


def _write_case(folder: Path, rig: str, parts: list[tuple[str, str, dict]]) -> Path:
    """A case folder with its recordings; those of the role "test" go to `test/`."""
    load = "pendulum" if "load_mass_kg" in rig else "free"
    (folder / "test").mkdir(parents=True, exist_ok=True)
    text, test = rig, ""
    for name, role, columns in parts:
        if role != "test":
            _write(folder / f"{name}.csv", columns)
            text += RECORDING.format(file=name, role=role, load=load, rest="false")
            continue
        inputs = {k: v for k, v in columns.items() if k != "load_angle_rad"}
        _write(folder / "test" / f"{name}.csv", inputs)
        start, ratio = float(columns["load_angle_rad"][0]), 345.0 if "345" in rig else 1.0
        test += f'[[recording]]\nfile = "{name}.csv"\nload = "{load}"\n'
        test += (
            f"initial_load_angle_rad = {start!r}\ninitial_motor_angle_rad = {ratio * start!r}\n\n"
        )
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    (folder / "test" / "test.toml").write_text(test, encoding="utf-8")
    return folder


def arm_cases(source: Path, out: Path) -> Iterator[tuple[str, Path, dict]]:
    """A case for each joint of the arm, and the angles that its tests have to predict."""
    for joint, at in ARM_JOINTS.items():
        parts = []
        for motion in (*FITTED, *HELD_OUT):
            raw = source / "so101-servo-arm" / "raw" / motion
            times, goals = _lists(raw / "control.csv", "positions")
            _, read = _lists(raw / "state_motor.csv", "positions")
            rows = min(len(goals), len(read))
            columns = {
                "time_s": times[:rows] - times[0],
                "position_command_rad": goals[:rows, at],
                "load_angle_rad": read[:rows, at],
            }
            if motion in FITTED and np.std(goals[:rows, at]) < 2e-3:
                continue  # this joint stands: nothing to fit
            parts.append((motion, "identification" if motion in FITTED else "test", columns))
        rig = ARM_RIG.format(joint=joint, mass=0.0 if joint == "rotation" else 1.0)
        if joint == "rotation":
            rig = rig.replace("load_mass_kg = 0.0\nload_distance_m = 0.1\n", "")
            rig = rig.replace("load_mass_kg = 1.0\ngravity_angle_offset_rad = 1.0\n", "")
        truth = {n: c["load_angle_rad"] for n, role, c in parts if role == "test"}
        yield joint, _write_case(out / f"so101-{joint}", rig, parts), truth


def leg_cases(source: Path, out: Path) -> Iterator[tuple[str, Path, dict]]:
    """A case for each joint of the legs: all but the last 8 s are fitted."""
    path = source / "go2-legs" / "legs.csv"
    names = path.open(encoding="utf-8").readline().strip().split(",")
    table = dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))
    time_s = table["time_s"]
    late = time_s >= time_s[-1] - LAST_s
    for joint in LEGS:
        parts = []
        for name, role, rows in (("first", "identification", ~late), ("last", "test", late)):
            t = time_s[rows]
            parts.append((name, role, {
                "time_s": t - t[0], "position_command_rad": table[f"{joint}_goal_rad"][rows],
                "load_angle_rad": table[f"{joint}_position_rad"][rows],
            }))  # fmt: skip
        truth = {"last": parts[1][2]["load_angle_rad"]}
        yield joint, _write_case(out / f"go2-{joint}", LEG_RIG.format(joint=joint), parts), truth


def run(name: str, folder: Path, truth: dict, *, quick: bool, say) -> dict:
    """Diagnose one case and predict its tests; what came out."""
    begun = time.perf_counter()
    found = diagnose(read_case(folder), quick=quick, say=say)
    seconds = time.perf_counter() - begun
    path = folder / "model.toml"
    path.write_text(found.model.to_toml(), encoding="utf-8")
    (folder / "diagnosis.json").write_text(json.dumps(found.document), encoding="utf-8")
    model, errors = FoundModel.from_toml(path), {}
    for test in read_test(folder / "test", model.rig):
        angle = model.predict(test)["load_angle_rad"]
        motion = Path(test.file).stem
        errors[motion] = 1e3 * float(np.sqrt(np.mean((angle - truth[motion]) ** 2)))
        goal = np.asarray(test.inputs.position_command_rad)
        errors[f"{motion}, goal"] = 1e3 * float(np.sqrt(np.mean((goal - truth[motion]) ** 2)))
    effects = [
        (e["name"], e["confidence"], {k: v["value"] for k, v in e["parameters"].items()})
        for e in found.document["effects"]
    ]
    return {"case": name, "verdict": found.document["verdict"], "effects": effects,
            "rms_mrad": errors, "seconds": seconds, "findings": found.document["findings"],
            "rig": {k: getattr(model.rig, k) for k in (
                "servo_proportional_Nm_per_rad", "servo_derivative_Nms_per_rad",
                "load_inertia_kgm2", "load_viscous_Nms_per_rad", "load_mass_kg",
                "gravity_angle_offset_rad")}}  # fmt: skip


def main() -> int:
    """Make the cases, diagnose and print them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/servo"))
    parser.add_argument("--set", default="so101,go2")
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    given = parser.parse_args()
    wanted = set(filter(None, given.only.split(",")))
    made = {"so101": arm_cases, "go2": leg_cases}
    for kind in given.set.split(","):
        for name, folder, truth in made[kind](given.source, given.out):
            if wanted and name not in wanted:
                continue
            say = print if given.verbose else (lambda _: None)
            result = run(name, folder, truth, quick=given.quick, say=say)
            if name in BY_HAND:
                result["by_hand_mrad"] = dict(zip(HELD_OUT, BY_HAND[name], strict=True))
            print(json.dumps(result), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
