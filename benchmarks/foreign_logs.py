"""Practice recordings in the dialects of other laboratories' loggers, imported by the command.

    python -m benchmarks.foreign_logs CASES [--recordings 5] [--seed 1]

CASES is a folder of practice cases. Every dialect of `benchmarks.foreign_dialects` is written for
some recordings and imported by `dftfs import`: `right` if all readings come back (up to the common
sign of the machine, to a count or 1e-6), `asked` if a question is put first, `refused` if a line
says why not, `wrong` otherwise. Prints a table and every log that is not right.
"""

import argparse
import contextlib
import io
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.foreign_dialects import DIALECTS, SERVO_RIG, ForeignLog
from dftfs.cli.main import main as run_command
from rsea_core.recordings.case import read_case
from rsea_core.recordings.recording import Recording

COUNTS = 1.6e-3  # half a count of 4096, with the digits of the log; of SI readings 1e-6


def imported(log: ForeignLog, rig: Path, out: Path) -> tuple[str, str]:
    """Verdict and what says why: one line, or all questions."""
    given = ["import", *map(str, log.paths), "--rig", str(rig), "--out", str(out), *log.options]
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        status = run_command(given)
    lines = errors.getvalue().strip().splitlines() or [""]
    if status:
        return (
            ("asked", " | ".join(lines))
            if "answer each with --column" in lines[-1]
            else ("refused", lines[-1])
        )
    recordings = read_case(out).recordings
    if len(recordings) != log.recordings:
        return "wrong", f"{len(recordings)} recordings instead of {log.recordings}"
    return compared(recordings[0], log.truth)


def compared(own: Recording, truth: Mapping[str, NDArray]) -> tuple[str, str]:
    """Whether all readings are there, up to one common sign."""
    signs = set()
    for name, values in truth.items():
        if name not in own:
            return "wrong", f"{name} is missing"
        if own[name].size != values.size:
            return "wrong", f"{name} has {own[name].size} rows instead of {values.size}"
        far = [float(np.abs(own[name] - s * values).max()) for s in (1.0, -1.0)]
        allowed = COUNTS if name in ("load_angle_rad", "position_command_rad") else 0.0
        if min(far) > max(allowed, 1e-6 * float(np.ptp(values))):
            return "wrong", f"{name} differs by {min(far):.3g}"
        if np.ptp(values) > 10.0 * allowed:
            signs.add(int(np.argmin(far)))
    return ("right", "") if len(signs) < 2 else ("wrong", "signs differ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--recordings", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    folders = sorted(arguments.cases.iterdir())
    totals: dict[str, int] = {}
    for dialect in DIALECTS:
        counts: dict[str, int] = {}
        for _ in range(arguments.recordings):
            case = read_case(folders[int(rng.integers(len(folders)))])
            r = case.recordings[int(rng.integers(len(case.recordings)))]
            with tempfile.TemporaryDirectory() as work:
                log = dialect(Path(work), {n: np.asarray(v) for n, v in r.columns.items()})
                rig = Path(work) / "own-rig.toml"
                rig.write_text(SERVO_RIG if log.is_servo else case.rig.to_toml(), encoding="utf-8")
                verdict, line = imported(log, rig, Path(work) / "case")
            counts[verdict] = counts.get(verdict, 0) + 1
            totals[verdict] = totals.get(verdict, 0) + 1
            if verdict != "right":
                print(f"  {dialect.__name__} {case.name} {r.file} {r.load.kind}: {verdict}: {line}")
        print(f"{dialect.__name__}: {counts}", flush=True)
    print(totals)


if __name__ == "__main__":
    main()
