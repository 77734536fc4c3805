"""Blind runs: each case is diagnosed in a process that sees a copy of the case and nothing else.

A case that ran to its end is one folder, put in place by one rename: an interrupted run continues
where it stopped, and what an interruption broke off is not filed. A case whose process was killed
is filed as crashed and run again by the next call. The seal of the labels is copied into the run
before the first diagnosis starts.
"""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from dftfs.errors import DftfsError
from dftfs.files import (
    OutputError,
    prepare_folder,
    to_json,
    write_text,
)
from dftfs.proof.labels import check_seal
from dftfs.proof.writing import CASES
from dftfs.staging import staging_folder, sweep_stale

DIAGNOSE = "{python} -m dftfs.cli.main diagnose {case} --out {out}"
PREDICT = (
    "{python} -m dftfs.cli.main predict {out}/model.toml {case}/test --out {out}/prediction.csv"
)
RUN, OUTCOME = "run.json", "outcome.json"
# by a signal, or by the exit status of a program that handles one
INTERRUPTED = {-signal.SIGHUP, -signal.SIGINT, -signal.SIGTERM, 129, 130, 143}


class RunError(DftfsError):
    """A run that cannot be started or does not belong to this set."""


def case_names(folder: Path) -> list[str]:
    """The cases of a set, sorted.

    Raises
    ------
    RunError
        If there are none.
    """
    names = sorted(p.parent.name for p in (folder / CASES).glob("*/rig.toml"))
    if not names:
        raise RunError(f"{folder / CASES}: no case; `dftfs prove make` writes them")
    return names


def filled_in(command: str, **places: object) -> list[str]:
    """The arguments of a command with its places filled in.

    Raises
    ------
    RunError
        If the command names a place that there is not.
    """
    try:
        return [word.format(**places) for word in shlex.split(command)]
    except (KeyError, IndexError, ValueError) as error:
        raise RunError(f"command {command!r}: {error}; known: {', '.join(places)}") from None


class Children:
    """The processes of a run: started in sessions of their own, ended with it, however it ends."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen] = set()
        self.stopped = threading.Event()
        # the kernel ends a child whose parent is killed, where this program is there to ask it
        self._tied = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []

    def call(self, command: list[str], log: Path, seconds: float) -> tuple[int | None, float]:
        """Exit status (None: stopped for its time) and wall time; the output goes to the log.

        Raises
        ------
        RunError
            If the program cannot be started.
        """
        begun = time.perf_counter()
        if self._tied and shutil.which(command[0]) is None:
            raise RunError(f"{command[0]}: cannot be started: there is no such program")
        with log.open("ab") as file:
            try:
                child = subprocess.Popen(
                    [*self._tied, *command],
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    cwd=log.parent,
                    start_new_session=True,
                )
            except OSError as error:
                raise RunError(f"{command[0]}: cannot be started: {error.strerror}") from None
            self._running.add(child)
            try:
                if self.stopped.is_set():
                    _end(child)
                status: int | None = child.wait(timeout=seconds)
            except subprocess.TimeoutExpired:
                _end(child)
                status = None
            finally:
                self._running.discard(child)
        return status, time.perf_counter() - begun

    def stop(self) -> None:
        """End every process; calls that wait for one return."""
        self.stopped.set()
        for child in list(self._running):
            _end(child)


def _end(child: subprocess.Popen) -> None:
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def run_case(
    case: Path,
    target: Path,
    commands: tuple[str, str],
    seconds: float,
    children: Children | None = None,
) -> dict:
    """Diagnose and predict one case; the folder ``target`` appears whole at the end.

    It does not appear where the run, or one of the two processes, was interrupted.
    """
    children = children or Children()
    with staging_folder(Path(tempfile.gettempdir())) as room:
        seen, out = room / "case", room / "out"
        shutil.copytree(case, seen)
        out.mkdir()
        places = {"python": sys.executable, "case": seen, "out": out}
        log = out / "log.txt"
        status, wall = children.call(filled_in(commands[0], **places), log, seconds)
        outcome = {"diagnose_status": status, "diagnose_s": wall, "predict_status": None}
        if status == 0 and (out / "diagnosis.json").is_file():
            outcome["predict_status"], outcome["predict_s"] = children.call(
                filled_in(commands[1], **places), log, seconds
            )
        outcome["state"] = _state(outcome["diagnose_status"], outcome["predict_status"])
        if children.stopped.is_set() or outcome["state"] == "interrupted":
            return outcome | {"state": "interrupted"}
        write_text(out / OUTCOME, to_json(outcome))
        waiting = target.with_name(f".{target.name}.{os.getpid()}")
        shutil.rmtree(waiting, ignore_errors=True)
        shutil.copytree(out, waiting)
        shutil.rmtree(target, ignore_errors=True)  # of a crash before
        os.replace(waiting, target)
    return outcome


def _state(*statuses: int | None) -> str:
    """How a case ended: "finished" (also without a diagnosis), "interrupted" or "crashed"."""
    if set(statuses) & INTERRUPTED:
        return "interrupted"
    return "crashed" if any(s is not None and s < 0 for s in statuses) else "finished"


def is_finished(place: Path) -> bool:
    """Whether the case in a folder of a run ran to its end; a case of an older version did."""
    path = place / OUTCOME
    if not path.is_file():
        return False
    return json.loads(path.read_text(encoding="utf-8")).get("state", "finished") == "finished"


def run(
    folder: Path,
    *,
    name: str = "diagnosis",
    commands: tuple[str, str] = (DIAGNOSE, PREDICT),
    limit: int | None = None,
    seconds: float = 900.0,
    jobs: int = 1,
    report: Callable[[str], None] = lambda line: None,
) -> Path:
    """Run the diagnosis on every case of a sealed set that has no outcome yet.

    Parameters
    ----------
    name : str
        The run's folder inside ``folder/runs``: several tools or versions can be compared.
    commands : tuple of str
        Diagnosis and prediction; ``{python}``, ``{case}``, ``{out}`` are filled in.
    limit : int, optional
        At most so many cases in this call.
    seconds : float
        Longest time for one case.
    jobs : int
        Processes at a time; wall times are comparable with one only.

    Raises
    ------
    RunError
        If the run was begun with another command or another seal, a number is below one, or the
        name is a path.
    SealError
        If the labels are not the sealed ones.
    """
    for option, value in (("limit", limit), ("seconds", seconds), ("jobs", jobs)):
        if value is not None and not value >= 1:
            raise RunError(f"--{option} {value:g}: at least 1")
    if Path(name).name != name:
        raise RunError(f"--name {name}: must be a name, not a path")
    place = _prepared(folder, name, commands)
    names = case_names(folder)
    todo = [n for n in names if not is_finished(place / n)][:limit]
    children = Children()

    def one(case: str) -> str:
        try:
            outcome = run_case(folder / CASES / case, place / case, commands, seconds, children)
        except OSError as error:
            raise OutputError(f"{place / case}: cannot be written: {error.strerror}") from None
        return f"{case}: {_summary(place / case, outcome)}"

    with ThreadPoolExecutor(jobs) as pool:
        try:
            for index, line in enumerate(pool.map(one, todo), start=1):
                report(f"{line} ({index} of {len(todo)})")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            children.stop()
            raise
    return place


def _prepared(folder: Path, name: str, commands: tuple[str, str]) -> Path:
    """The folder of a run, new or begun with the same labels and commands."""
    seal = check_seal(folder)
    place = prepare_folder(folder / "runs" / name)
    order = {"seal": seal, "commands": list(commands)}
    if (place / RUN).exists():
        before = json.loads((place / RUN).read_text(encoding="utf-8"))
        if before != order:
            raise RunError(f"{place}: begun with other labels or commands; choose another --name")
    else:
        write_text(place / RUN, to_json(order))
    sweep_stale(Path(tempfile.gettempdir()))
    for leftover in place.glob(".case*"):
        shutil.rmtree(leftover, ignore_errors=True)
    return place


def _summary(place: Path, outcome: dict) -> str:
    path = place / "diagnosis.json"
    if outcome["state"] != "finished":
        return f"{outcome['state']}, status {outcome['diagnose_status']}; not counted, run again"
    if outcome["diagnose_status"] != 0 or not path.is_file():
        return f"no diagnosis, status {outcome['diagnose_status']}"
    found = json.loads(path.read_text(encoding="utf-8"))
    names = "+".join(e["name"] for e in found.get("effects", []))
    return f"{found.get('verdict')} {names}, {outcome['diagnose_s']:.0f} s"
