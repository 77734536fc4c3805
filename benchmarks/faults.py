"""Kills and signals at random moments over the commands that run long: nothing torn, lost or left.

    python -m benchmarks.faults --faults 200 [--commands tune,prove] [--seed 1]

For each fault: is every file whole, is an earlier complete result still there, is no process left
and no traceback printed? Afterwards each command runs again: it succeeds and leaves
no unfinished file.
"""

import argparse
import csv
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
PATIENCE_s = 120
ENDS = {".html": b"</html>", ".step": b"END-ISO-10303-21;", ".dxf": b"EOF"}
COMPARISON = """
name = "c"
rig = "rsea-bench"
load = {kind = "locked"}
reference = {kind = "sine", amplitude_Nm = 1.0, frequency_Hz = 2.0}
task = {duration_s = 1.0, from_s = 0.1}
budget = {seeds = 4, population = 8, generations = 12}
[[controller]]
name = "PID"
kind = "pid-torque"
tune = {kp = [5.0, 150.0], ki = [0.0, 500.0]}
"""
SCENARIO = '[spring]\ndesign = "al1"'


def commands(room: Path) -> Mapping[str, list[str]]:
    """The arguments of each command, run inside a folder that gets their inputs."""
    (room / "c.toml").write_text(COMPARISON, encoding="utf-8")
    text = resources.files("dftfs").joinpath("examples", "torque-1hz.toml").read_text()
    (room / "s.toml").write_text(text.replace(SCENARIO, ""), encoding="utf-8")
    sweep = ["--vary", "width_mm=5,6,7,8", "--states", "3", "--jobs", "2", "--cache", "cache"]
    make = ["prove", "make", "--seed", "7", "--cases", "2", "--levels", "plain", "--out", "set"]
    if not (room / "set").exists():
        subprocess.run([sys.executable, "-m", "dftfs", *make], cwd=room, check=True,
                       capture_output=True)  # fmt: skip
    return {
        "export": ["export", "al1", "--out", "out", "--force"],
        "simulate": ["simulate", "s.toml", "--out", "out", "--force"],
        "tune": ["tune", "c.toml", "--out", "out", "--force", "--resume"],
        "sweep": ["sweep", "al1", *sweep, "--out", "out", "--force"],
        "prove": ["prove", "run", "set", "--jobs", "2", "--diagnose", _slow_diagnosis()],
    }


def _slow_diagnosis() -> str:
    """A diagnosis of two seconds that writes what a real one writes: the run is what is tested."""
    code = "import time,pathlib;time.sleep(2);"
    code += "[pathlib.Path('{out}',n).write_text('{{}}') for n in ('diagnosis.json',)]"
    return f'{{python}} -c "{code}"'


def torn(path: Path) -> bool:
    """Whether a file is not complete by its kind."""
    content = path.read_bytes()
    try:
        if path.suffix == ".json":
            json.loads(content)
        elif path.suffix == ".toml":
            tomllib.loads(content.decode())
        elif path.suffix == ".csv":
            rows = list(csv.reader(content.decode().splitlines()))
            return not content.endswith(b"\n") or len({len(row) for row in rows}) != 1
        elif path.suffix == ".png":
            return b"IEND" not in content[-16:]
        elif path.suffix == ".stl":
            return len(content) != 84 + 50 * int.from_bytes(content[80:84], "little")
    except ValueError:
        return True
    return path.suffix in ENDS and not content.rstrip().endswith(ENDS[path.suffix])


def results(room: Path) -> list[Path]:
    """Every visible file that a command has written."""
    found = [*room.glob("out/**/*"), *room.glob("set/runs/**/*")]
    dot_file = re.compile(r"/\.")
    return [p for p in found if p.is_file() and not dot_file.search(str(p.relative_to(room) / ""))]


def _processes_in(room: Path) -> list[int]:
    """Processes that work inside a folder."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if Path(os.readlink(place / "cwd")).is_relative_to(room):
                found.append(int(place.name))
        except OSError:
            continue
    return found


def _last_place(shown: bytes) -> str:
    """File and line of the last frame of a traceback, and its error."""
    lines = shown.decode(errors="replace").splitlines()
    places = [line.strip() for line in lines if line.lstrip().startswith("File ")]
    return f"{places[-1] if places else '?'}: {lines[-1]}"


def strike(arguments: list[str], room: Path, number: int, after_s: float) -> Counter:
    """Start a command, send it a signal after a time, and count what is wrong then."""
    command = [sys.executable, "-m", "dftfs", *arguments]
    before = {path: path.stat().st_size for path in results(room)}
    process = subprocess.Popen(command, cwd=room, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        _, shown = process.communicate(timeout=after_s)
        return Counter(finished=1)
    except subprocess.TimeoutExpired:
        process.send_signal(number)
    found = Counter(tried=1)
    try:
        _, shown = process.communicate(timeout=PATIENCE_s)
    except subprocess.TimeoutExpired:
        process.kill()
        _, shown = process.communicate()
        found["did not end"] += 1
    if b"Traceback" in shown:
        found[f"traceback ({_last_place(shown)} after {signal.Signals(number).name})"] += 1
    # -number: the signal came before the interpreter had started the program
    if process.returncode not in (128 + number, -number, 130, 0, 1):
        last_line = shown.decode(errors="replace").strip().rpartition("\n")[2]
        found[f"status {process.returncode} after {signal.Signals(number).name} ({last_line})"] += 1
    deadline = time.monotonic() + 10
    while _processes_in(room) and time.monotonic() < deadline:
        time.sleep(0.1)
    found["processes left"] += bool(_processes_in(room))
    found["torn"] += sum(torn(path) for path in results(room))
    found["lost"] += sum(not path.exists() for path in before if "case-" not in str(path))
    return found


def main() -> int:
    """Strike each command in turn; exit status 1 if anything is torn, lost or left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=200, help="in all (default 200)")
    parser.add_argument("--commands", default="export,simulate,tune,sweep,prove")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    names, rng, wrong = asked.commands.split(","), random.Random(asked.seed), 0
    with tempfile.TemporaryDirectory() as top:
        for name in names:
            room = Path(top) / name
            room.mkdir()
            arguments, total = commands(room)[name], Counter()
            begun = time.monotonic()
            command = [sys.executable, "-m", "dftfs", *arguments]
            first = subprocess.run(command, cwd=room, capture_output=True)
            took = time.monotonic() - begun
            while total["tried"] < asked.faults / len(names) and total["finished"] < asked.faults:
                for place in (*room.glob("out/*.jsonl"), *room.glob("cache/**/*.json")):
                    place.unlink()
                for outcome in room.glob("set/runs/*/case-*/outcome.json"):
                    outcome.unlink()
                number = SIGNALS[total["tried"] % len(SIGNALS)]
                total += strike(arguments, room, number, rng.uniform(0.05, 0.95) * took)
            again = subprocess.run(command, cwd=room, capture_output=True)
            total["run again failed"] += again.returncode != first.returncode
            unfinished = [p for p in room.rglob(".*.part") if "case" not in p.name]
            total["unfinished files"] += len(unfinished)
            tried, finished = total.pop("tried"), total.pop("finished", 0)
            wrong += sum(total.values())
            faults = ", ".join(f"{k} {v}" for k, v in sorted(total.items()) if v) or "all zero"
            line = f"{name}: {took:.1f} s, status {first.returncode}; {tried} tried"
            print(f"{line} ({finished} ended before); {faults}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
