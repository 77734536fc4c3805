"""The processes of `benchmarks/calculix.py`: what they cost, and in which order they run."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from statistics import median

import numpy as np
from calculix_deck import load_model

from dftfs.fem.deck import deck

ROOT = Path(__file__).resolve().parents[1]
DEFLECTIONS_RAD = np.round(0.023 * np.arange(1, 11), 3)
REPEATS = 2
ONE_THREAD = (
    "OMP_NUM_THREADS",
    "CCX_NPROC_EQUATION_SOLVER",
    "CCX_NPROC_STIFFNESS",
    "CCX_NPROC_RESULTS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)


@dataclass(frozen=True, kw_only=True)
class Run:
    """One process: wall and CPU time, peak resident memory."""

    wall_s: float
    cpu_s: float
    peak_MB: float


def measured(command: Sequence[str], folder: Path, log: Path) -> Run:
    """Run a program on one thread and wait for it.

    Raises
    ------
    RuntimeError
        If it fails, or its memory is hidden below this process' own.
    """
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1")
    environment["PYTHONPATH"] = os.pathsep.join((str(ROOT), str(ROOT / "benchmarks")))
    with log.open("w") as output:
        begun = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=output, stderr=subprocess.STDOUT
        )
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            process.kill()
            raise
        wall_s = time.perf_counter() - begun
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        end = "\n".join(log.read_text(errors="replace").splitlines()[-15:])
        raise RuntimeError(f"{command[0]} ended with status {process.returncode}:\n{end}")
    # Linux starts a child's peak at its parent's size when it was spawned
    if usage.ru_maxrss <= getrusage(RUSAGE_SELF).ru_maxrss:
        raise RuntimeError("peak memory cannot be told: this process is larger than its child")
    return Run(wall_s=wall_s, cpu_s=usage.ru_utime + usage.ru_stime, peak_MB=usage.ru_maxrss / 1024)


def calculix(folder: Path, job: str) -> Run:
    """Run a deck."""
    return measured(["ccx", "-i", job], folder, folder / f"{job}.log")


def ours(folder: Path, function: str, *arguments: object) -> Run:
    """Call one function, ``module.name``, in a Python of its own."""
    module, name = function.split(".")
    values = ", ".join(repr(a) for a in arguments)
    script = (
        f"from pathlib import Path; from {module} import {name}; {name}(Path({str(folder)!r}),"
        f" {values})"
    )
    return measured([sys.executable, "-c", script], folder, folder / f"{name}.log")


def run_all(folder: Path) -> dict[str, list[Run]]:
    """Every process, in turn: untimed ones first, then CalculiX and ours alternating."""
    steps, last = DEFLECTIONS_RAD.tolist(), DEFLECTIONS_RAD[-1:].tolist()
    progress("mesh and decks")
    ours(folder, "calculix_sector.make_mesh")
    model = load_model(folder / "model.npz")
    for job, tight in (("default", False), ("tight", True)):
        (folder / f"{job}.inp").write_text(deck(model, DEFLECTIONS_RAD, tight=tight))
    progress("untimed: ours, for its compiled kernels")
    ours(folder, "calculix_ring.solve_ring", "adaptive", last)
    ours(folder, "calculix_sector.solve_sector", "sector", last)
    progress("untimed: CalculiX with a tight residual")
    runs: dict[str, list[Run]] = {"tight": [calculix(folder, "tight")]}
    runs |= {name: [] for name in ("default", "fixed", "adaptive", "sector")}
    for repeat in range(1, REPEATS + 1):
        progress(f"{repeat} of {REPEATS}: CalculiX, 10 increments")
        runs["default"].append(calculix(folder, "default"))
        progress(f"{repeat} of {REPEATS}: ours, 10 increments, adaptive, one sector")
        runs["fixed"].append(ours(folder, "calculix_ring.solve_ring", "fixed", steps))
        runs["adaptive"].append(ours(folder, "calculix_ring.solve_ring", "adaptive", last))
        runs["sector"].append(ours(folder, "calculix_sector.solve_sector", "sector", steps))
    return runs


def progress(message: str) -> None:
    """A line on standard error with the time of day."""
    print(f"[{time.strftime('%H:%M:%S')}] {message}", file=sys.stderr, flush=True)


def middle(runs: list[Run]) -> Run:
    """Medians of several runs."""
    return Run(**{name: median(asdict(r)[name] for r in runs) for name in asdict(runs[0])})
