"""The JSON of the commands on one and on two threads, with another hash seed: the same bits.

    python -m benchmarks.same_result [--commands design,simulate]

Left out are times, dates and the folders that differ by intent (`UNSTABLE`); nothing else. The
commands run in folders of one length, from the same files; exit status 1 if anything differs.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from importlib import resources
from pathlib import Path

from benchmarks.faults import COMPARISON, SCENARIO

RUNS = ((1, 0), (1, 1), (2, 12345))  # threads and PYTHONHASHSEED
UNSTABLE = ("wall_s", "search_wall_s", "provenance", "paths", "files", "seconds", "date")
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
COARSE = ["--plane", "--no-mesh-error", "--states", "3"]
CASE = "set/cases/case-001"
COMMANDS: Mapping[str, list[str]] = {
    "design": ["design", "al1"],
    "materials": ["materials"],
    "schema": ["schema", "scenario"],
    "verify": ["verify", "al1", *COARSE],
    "sweep": ["sweep", "al1", "--vary", "width_mm=5,6", "--states", "3", "--jobs", "2"],
    "tolerance": ["tolerance", "al1"],
    "size": ["size"],
    "study": ["study", "al1"],
    "export": ["export", "al1"],
    "thesis": ["thesis"],
    "simulate": ["simulate", "s.toml"],
    "compare": ["compare", "c.toml"],
    "tune": ["tune", "c.toml"],
    "doctor": ["doctor", CASE],
    "friction": ["friction", CASE],
    "diagnose": ["diagnose", CASE, "--quick"],
}
PLAIN = {"schema"}  # prints JSON without the option
WRITES = {"sweep", "export", "study", "tune", "compare"}


def result(name: str, room: Path, threads: int, seed: int) -> tuple[int, object]:
    """Exit status and JSON of a command in a folder that gets its inputs."""
    environment = os.environ | dict.fromkeys(THREADS, str(threads)) | {"PYTHONHASHSEED": str(seed)}
    room.mkdir()
    (room / "c.toml").write_text(COMPARISON, encoding="utf-8")
    text = resources.files("dftfs").joinpath("examples", "torque-1hz.toml").read_text()
    (room / "s.toml").write_text(text.replace(SCENARIO, ""), encoding="utf-8")
    program = [sys.executable, "-m", "dftfs"]
    if any(CASE in word for word in COMMANDS[name]):
        make = ["prove", "make", "--seed", "7", "--cases", "1", "--levels", "plain", "--out", "set"]
        subprocess.run([*program, *make], cwd=room, check=True, capture_output=True,
                       env=environment)  # fmt: skip
    arguments = COMMANDS[name] + ([] if name in PLAIN else ["--json"])
    arguments += ["--out", "out"] if name in WRITES else []
    done = subprocess.run([*program, *arguments], cwd=room, capture_output=True, env=environment)
    shown = done.stdout.decode() or json.dumps(done.stderr.decode())
    return done.returncode, json.loads(shown.replace(str(room), "ROOM"))


def leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    """Every number, word and flag with its place, without what is not to be compared."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in UNSTABLE:
                yield from leaves(inner, f"{place}.{key}")
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from leaves(inner, f"{place}[{k}]")
    else:
        yield place, repr(value)


def main() -> int:
    """Compare every command's runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commands", default=",".join(COMMANDS))
    wrong = 0
    for name in parser.parse_args().commands.split(","):
        with tempfile.TemporaryDirectory() as top:
            runs = [result(name, Path(top) / f"r{k}", *run) for k, run in enumerate(RUNS)]
        found = [dict(leaves(shown)) | {"status": status} for status, shown in runs]
        differ = sorted({p for f in found for p in f.keys() | found[0].keys()
                         if f.get(p) != found[0].get(p)})  # fmt: skip
        wrong += bool(differ)
        first = f"; first {differ[0]}: {[f.get(differ[0]) for f in found]}" if differ else ""
        print(f"{name}: status {runs[0][0]}, {len(found[0])} values, {len(differ)} differ{first}",
              flush=True)  # fmt: skip
    print(f"commands that differ: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
