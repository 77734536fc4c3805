"""A log of 1 GB through `[columns]`: peak memory and time.

    python -m benchmarks.large_log [--gigabytes 1.0] [--folder /tmp/large-log]

Writes a CSV in degrees and milliseconds with eight columns, reads it as a case in a process of its
own, prints its rows, seconds and peak memory, and removes it.
"""

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

RIG = """[rig]
name = "large"
parts = ["drive", "gear", "load"]
torque_constant_Nm_per_A = 0.1
gear_ratio = 10.0
[columns]
time_s = { name = "t", unit = "ms" }
duty = { name = "pwm", unit = "percent" }
motor_angle_rad = { name = "qm", unit = "deg" }
load_angle_rad = { name = "ql", unit = "deg" }
current_A = "i"
ignore = ["*"]
[[recording]]
file = "log.csv"
load = "free"
"""


def write_log(path: Path, size: float) -> None:
    """Rows until the file has this many bytes, in blocks."""
    rows, start = 200_000, 0
    with open(path, "w", encoding="utf-8") as stream:
        stream.write("t,pwm,qm,ql,i,spare1,spare2,spare3\n")
        while stream.tell() < size:
            t = np.arange(start, start + rows)
            angle = np.degrees(np.sin(1e-3 * t))
            columns = [t, 50 * np.sin(1e-3 * t), 10 * angle, angle, np.cos(1e-3 * t)]
            columns += [np.sin(7e-4 * t + k) for k in range(3)]
            np.savetxt(stream, np.column_stack(columns), fmt="%.9g", delimiter=",")
            start += rows


def read_alone(folder: Path) -> None:
    """Read the case and print what it took."""
    from rsea_core.recordings.case import read_case

    begun = time.perf_counter()
    rows = read_case(folder, lambda text: print(text, file=sys.stderr)).recordings[0].rows
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2
    print(f"{rows} rows in {time.perf_counter() - begun:.0f} s, peak memory {peak:.2f} GiB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gigabytes", type=float, default=1.0)
    parser.add_argument("--folder", type=Path, default=Path("/tmp/large-log"))
    parser.add_argument("--read", action="store_true", help="only read what is there")
    arguments = parser.parse_args()
    if arguments.read:
        read_alone(arguments.folder)
        return
    arguments.folder.mkdir(parents=True, exist_ok=True)
    log = arguments.folder / "log.csv"
    try:
        write_log(log, 1e9 * arguments.gigabytes)
        (arguments.folder / "rig.toml").write_text(RIG, encoding="utf-8")
        command = [sys.executable, "-m", "benchmarks.large_log", "--read"]
        subprocess.run([*command, "--folder", str(arguments.folder)], check=True)
    finally:
        log.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
