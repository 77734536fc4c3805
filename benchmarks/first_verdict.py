"""From three strange logs to a verdict, as a new user types it, with the seconds of each command.

    python -m benchmarks.first_verdict CASES [--case case-a03] [--full]

CASES is a folder of practice cases. The first three recordings of a case are written as CSV with
semicolons and decimal commas, milliseconds, degrees, percent and milliamperes, under other names.
What a person does besides (reading docs/import.md, filling in the rig file) is not counted.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.foreign_dialects import DEG
from rsea_core.recordings.case import read_case
from rsea_core.recordings.recording import Recording

COLUMNS = {
    "Zeit [ms]": ("time_s", 1e3), "PWM [%]": ("duty", 100.0),
    "enc_motor": ("motor_angle_rad", DEG), "enc_out": ("load_angle_rad", -DEG),
    "iq_mA": ("current_A", 1e3), "loadcell": ("torque_Nm", 1.0),
}  # fmt: skip


def write_log(path: Path, r: Recording) -> None:
    """A recording as a logger of another laboratory writes it."""
    table = {name: k * np.asarray(r[own]) for name, (own, k) in COLUMNS.items() if own in r}
    rows = zip(*(v.tolist() for v in table.values()), strict=True)
    lines = [";".join(f"{x:.9g}".replace(".", ",") for x in row) for row in rows]
    path.write_text("\n".join([";".join(table), *lines]) + "\n", encoding="utf-8")


def timed(folder: Path, *arguments: str) -> float:
    """Run a command in a folder, print it with its seconds and the end of what it says."""
    begun = time.perf_counter()
    command = [sys.executable, "-m", "dftfs", *arguments, "--quiet"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    seconds = time.perf_counter() - begun
    printed = (done.stdout + done.stderr).strip().splitlines()
    print(f"{seconds:6.1f} s  dftfs {' '.join(arguments)}: status {done.returncode}", flush=True)
    for line in printed[-3:]:
        print(f"          {line[:140]}")
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--case", default="case-a03")
    parser.add_argument("--full", action="store_true", help="diagnose without --quick as well")
    arguments = parser.parse_args()
    case = read_case(arguments.cases / arguments.case)
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        for k, r in enumerate(case.recordings[:3]):
            write_log(folder / f"log{k + 1}.csv", r)
        (folder / "own.toml").write_text(case.rig.to_toml(), encoding="utf-8")  # as filled in
        commands = [
            "import log1.csv --out first --yes",
            "import log1.csv log2.csv --rig own.toml --out mine --yes",
            "import log3.csv --out mine --role validation",
            "doctor mine --out look",
            "diagnose mine --quick --out quick",
            *(["diagnose mine --out found"] if arguments.full else []),
        ]
        total = sum(timed(folder, *command.split()) for command in commands)
        found = "found" if arguments.full else "quick"
        verdict = json.loads((folder / found / "diagnosis.json").read_text(encoding="utf-8"))
        effects = [f"{e['name']} {e['confidence']:.2f}" for e in verdict["effects"]]
        print(
            f"{total:6.1f} s in all; verdict {verdict['verdict']}: {', '.join(effects) or 'none'}"
        )


if __name__ == "__main__":
    main()
