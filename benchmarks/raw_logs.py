"""Logs as their owners wrote them, imported by commands alone, against hand-made cases.

    python -m benchmarks.raw_logs DATA [--only muir-sea] [--full | --readings]

DATA is the folder that holds `real-2` (it is not part of this repository). Each set is imported by
the commands printed, as a new user types them, without a file edited; then the imported and the
hand-made case are diagnosed by the same call (`--quick`; `--full` without; `--readings`: neither).
Prints whether the import ran, the largest difference of any reading over its span where both have
the same rows, both verdicts, both lists of effects, and the largest relative difference of a
comparable parameter.
"""

import argparse
import contextlib
import io
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.servo_cases import arm_cases, leg_cases
from dftfs.cli.main import main as run_command
from rsea_core.identify.diagnose import diagnose
from rsea_core.recordings.case import Case, read_case

# what a new user has to know of the log that the log itself does not say, as options
COMMANDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "muir-sea": (
        ("DoubleLoopReference.mat", "--rig", "RIG", "--column",
         'current_command_A={name="motor_torque", unit="A", scale=2.920560747663551}'),
        ("InnerLoop.mat", "--load", "locked"),
        ("DoubleLoopDisturbance.mat", "--role", "validation"),
    ),
    "pendulum-ringdown": (
        ("test1pend1.csv", "--rig", "RIG", "--yes", "--column", "reference=3",
         "--part", "0.8537:35.2502", "--part", "35.2568:69.6577:validation"),
    ),
    "ankle-in-air": (
        ("Data_TrackSine_Slow.txt", "--rig", "RIG", "--load", "free", "--yes",
         "--column", "load_angle_rad=65:rad", "--column",
         """current_command_A={formula='"73" - "74"*"65" - "75"*rate("65", 0.1)'}"""),
        ("Data_TrackSine_Fast.txt", "--load", "free", "--role", "validation", "--part", "1.6:30"),
    ),
    "so101-servo-arm": (
        ("step_response", "--rig", "RIG", "--joint", "Elbow", "--column", "reference=velocities"),
        ("friction_gravity",),
        ("single_joint_elbow",),
    ),
    "go2-legs": (
        ("traj_0.pt", "--rig", "RIG", "--joint", "2", "--load", "pendulum", "--part", "0:END",
         "--column", "load_angle_rad=dof_pos:rad",
         "--column", "position_command_rad=des_dof_pos:rad"),
    ),
}  # fmt: skip


CLAIM = 0.5  # below it an effect is listed, not claimed (docs/recordings.md)


def hand_made(data: Path, name: str, work: Path) -> tuple[Path, dict[str, object]]:
    """The hand-made case of a set, and what its commands need."""
    if name == "so101-servo-arm":
        folder = next(f for joint, f, _ in arm_cases(data / "real-2", work) if joint == "elbow")
    elif name == "go2-legs":
        folder = next(f for joint, f, _ in leg_cases(data / "real-2", work) if joint == "FL_calf")
    else:
        folder = data / "real-2" / name
    return folder, {"RIG": folder / "rig.toml"}


def imported(raw: Path, name: str, out: Path, known: dict[str, object]) -> str:
    """Run the commands of a set; "" or the line that refused."""
    for command in COMMANDS[name]:
        first, *options = command
        for word, value in known.items():
            options = [option.replace(word, str(value)) for option in options]
        given = ["import", str(raw / first), "--out", str(out), *options]
        print(f"  dftfs {shlex.join(given)}")
        messages = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(messages):
            status = run_command(given)
        if status:
            return messages.getvalue().strip().splitlines()[-1]
    return ""


def difference(own: Case, hand: Case) -> str:
    """The largest difference of a reading over its span; recordings of other rows are named."""
    worst, other = 0.0, []
    for a, b in zip(own.recordings, hand.recordings, strict=True):
        if a.rows != b.rows:
            other.append(f"{b.file}: {a.rows} rows, by hand {b.rows}")
            continue
        for column in set(b.columns) - {"time_s"}:
            span = max(float(np.ptp(b[column])), 1e-9)
            worst = max(worst, float(np.abs(a[column] - b[column]).max()) / span)
    columns = [
        sorted(set(a.columns) ^ set(b.columns)) for a, b in zip(own.recordings, hand.recordings)
    ]
    return f"{worst:.1e} of span; columns that differ: {columns[0] or 'none'}; {'; '.join(other)}"


def parameters_of(document: dict) -> Iterator[tuple[str, float]]:
    """Every value that a diagnosis found."""
    for effect in document["effects"]:
        for key, value in effect["parameters"].items():
            yield f"{effect['name']}.{key}", value["value"]
    for key, value in document["parameters_corrected"].items():
        yield key, value["to"]


def compared(own: Case, hand: Case, *, quick: bool) -> str:
    """Both diagnoses side by side."""
    found = [diagnose(case, quick=quick).document for case in (own, hand)]
    verdicts = [d["verdict"] for d in found]
    effects = [[e["name"] for e in d["effects"] if e["confidence"] >= CLAIM] for d in found]
    values = [dict(parameters_of(d)) for d in found]
    worst, of = max(
        (
            (abs(values[0][k] - v) / max(abs(v), 1e-12), k)
            for k, v in values[1].items()
            if isinstance(v, float) and isinstance(values[0].get(k), float)
        ),
        default=(0.0, "none"),
    )
    same = verdicts[0] == verdicts[1] and effects[0] == effects[1]
    return (
        f"diagnosis {'equal' if same else 'DIFFERENT'}: {verdicts[0]} {effects[0]}, by hand"
        f" {verdicts[1]} {effects[1]}; largest difference of a value {100 * worst:.2g} % ({of})"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", choices=COMMANDS)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--readings", action="store_true", help="no diagnosis")
    arguments = parser.parse_args()
    for name in [arguments.only] if arguments.only else COMMANDS:
        print(name, flush=True)
        with tempfile.TemporaryDirectory() as work:
            hand, known = hand_made(arguments.data, name, Path(work) / "hand")
            if name == "go2-legs":
                known["END"] = read_case(hand).recordings[0].time_s[-1]
            out = Path(work) / name
            problem = imported(arguments.data / "real-2" / name / "raw", name, out, known)
            if problem:
                print(f"  import refused: {problem}", flush=True)
                continue
            own, by_hand = read_case(out), read_case(hand)
            print(f"  imported; readings differ by {difference(own, by_hand)}", flush=True)
            if arguments.readings:
                continue
            print(f"  {compared(own, by_hand, quick=not arguments.full)}", flush=True)


if __name__ == "__main__":
    main()
