"""Contact of `al1` against CalculiX: same ring, same pairs, both on one thread, in one run.

    python benchmarks/calculix_contact.py [unwinding] [winding] [--limit SECONDS]

CalculiX cannot do this on a cyclic sector (its cyclic symmetry knows no contact with the turned
copy): it solves the whole ring, half the width (the mid-plane is a mirror for both sides), on the
mesh of `dftfs study`; surface to surface, linear pressure-overclosure of the same stiffness,
between the tip and the coil before it, added only after 0.18 rad (apart before), increments of its
own choice. Ours solves the same ring with the same surfaces, contact throughout from rest, and,
for information, one sector with all of its surfaces. To 0.3 rad only unwinding has contact (from
0.20 rad; winding from 0.37 rad). Targets: torque within 1 %, CPU time at most a tenth. CPU and not
wall time, so that other work on the machine does not decide.

CalculiX takes some two minutes of CPU a direction. After ``--limit`` seconds of CPU time (default
3600) it is ended, and its time is a lower bound, said so. Exit status 1 if a target is missed, 2
without ccx.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from math import ceil
from pathlib import Path
from resource import RLIMIT_CPU, RUSAGE_CHILDREN, getrusage, setrlimit

import numpy as np
from calculix_contact_runs import DEFLECTIONS_RAD, HALVES, contact_deck
from calculix_deck import load_model, torques_Nm
from calculix_runs import ONE_THREAD, ROOT, ours, progress

SIGNS = {"unwinding": -1.0, "winding": 1.0}
TORQUE, TIME = 0.01, 0.10


def limited_calculix(folder: Path, job: str, limit_s: float) -> tuple[float, bool]:
    """CPU seconds of a deck, and whether it came to its end within the limit of CPU time."""
    before = getrusage(RUSAGE_CHILDREN)
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1")
    finished = True
    with (folder / f"{job}.log").open("w") as log:
        try:
            subprocess.run(
                ["ccx", "-i", job],
                cwd=folder,
                env=environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                preexec_fn=lambda: setrlimit(RLIMIT_CPU, (ceil(limit_s), ceil(limit_s))),
                check=True,
            )
        except subprocess.CalledProcessError:
            finished = False
    after = getrusage(RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, finished


def one_direction(folder: Path, direction: str, limit_s: float) -> dict:
    """Both sides of one direction."""
    angles = (SIGNS[direction] * np.array(DEFLECTIONS_RAD)).tolist()
    (folder / f"{direction}.inp").write_text(contact_deck(folder, np.array(angles)))
    progress(f"{direction}: ours, once for the compiled kernels, then timed")
    ours(folder, "calculix_contact_runs.solve_ring", f"warm-{direction}", angles)
    ring = ours(folder, "calculix_contact_runs.solve_ring", f"ring-{direction}", angles)
    sector = ours(folder, "calculix_contact_runs.solve_sector", f"sector-{direction}", angles)
    progress(f"{direction}: CalculiX, at most {limit_s:.0f} s of CPU")
    theirs_s, finished = limited_calculix(folder, direction, limit_s)
    with np.load(folder / f"ring-{direction}.npz") as stored:
        found = {name: stored[name].tolist() for name in stored.files}
    record = {
        "direction": direction,
        "calculix_cpu_s": theirs_s,
        "calculix_finished": finished,
        "ring_cpu_s": ring.cpu_s,
        "sector_cpu_s": sector.cpu_s,
        "cpu_ratio": ring.cpu_s / theirs_s,
        **found,
    }
    if finished:
        model = load_model(folder / "model.npz")
        dat = (folder / f"{direction}.dat").read_text()
        torque = HALVES * torques_Nm(dat, model, len(angles))
        record["calculix_torque_Nm"] = torque.tolist()
        record["torque_difference"] = float(np.abs(found["torque_Nm"] / torque - 1).max())
    return record


def main() -> int:
    """Run, print, write ``out/benchmarks/calculix_contact.json``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directions", nargs="*", help="unwinding, winding (default both)")
    parser.add_argument("--limit", type=float, default=3600.0, help="CPU seconds for CalculiX")
    arguments = parser.parse_args()
    if shutil.which("ccx") is None:
        print("ccx (CalculiX) is not installed", file=sys.stderr)
        return 2
    unknown = set(arguments.directions) - set(SIGNS)
    if unknown:
        print(f"direction {sorted(unknown)}: allowed are {', '.join(SIGNS)}", file=sys.stderr)
        return 2
    records = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        progress("mesh")
        ours(folder, "calculix_contact_runs.make_mesh")
        for direction in arguments.directions or SIGNS:
            records.append(one_direction(folder, direction, arguments.limit))
    missed = False
    for record in records:
        bound = "" if record["calculix_finished"] else " (ended before it had finished)"
        print(
            f"{record['direction']}: CalculiX {record['calculix_cpu_s']:.0f} s CPU{bound}, ring"
            f" {record['ring_cpu_s']:.1f} s, sector {record['sector_cpu_s']:.1f} s; ratio"
            f" {record['cpu_ratio']:.3f} (at most {TIME}), torque difference"
            f" {record.get('torque_difference', float('nan')):.2e} (at most {TORQUE})"
        )
        missed |= record["cpu_ratio"] > TIME or record.get("torque_difference", 0.0) > TORQUE
    out = ROOT / "out" / "benchmarks"
    out.mkdir(parents=True, exist_ok=True)
    (out / "calculix_contact.json").write_text(json.dumps(records, indent=1))
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
