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
from collections.abc import Callable, Iterator, Mapping
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

DIAGNOSE = "{python} -m dftfs diagnose {case} --out {out}"
PREDICT = "{python} -m dftfs predict {out}/model.toml {case}/test --out {out}/prediction.csv"
RUN, OUTCOME = "run.json", "outcome.json"
# by a signal, or by the exit status of a program that handles one
INTERRUPTED = {-signal.SIGHUP, -signal.SIGINT, -signal.SIGTERM, 129, 130, 143}
FINISHED, CRASHED, STOPPED = "finished", "crashed", "stopped"
Runner = Callable[[Callable[[object], dict], Mapping[str, object]], Iterator[tuple[str, dict]]]


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
        if status == 0 and (out / "diagnosis.json").is_file() and commands[1]:
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
    again: bool = False,
    runner: Runner | None = None,
    report: Callable[[str], None] = lambda line: None,
) -> Path:
    """Run the diagnosis on every case of a sealed set that has no outcome yet.

    Parameters
    ----------
    name : str
        The run's folder inside ``folder/runs``: several tools or versions can be compared.
    commands : tuple of str
        Diagnosis and prediction with ``{python}``, ``{case}``, ``{out}``; no prediction if empty.
    limit, seconds, jobs : int, float, int
        Cases in this call, longest time of one, processes (wall times compare with one only).
    again : bool
        Repeat what crashed or was stopped.
    runner : callable, optional
        Maps a function over tasks elsewhere and yields (case, result) as they finish.

    Raises
    ------
    RunError
        If the run has another command or seal, a number is below one or the name is a path.
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
    if again:
        _clear(place, names)
    todo = [n for n in names if not is_finished(place / n)][:limit]
    if runner is not None:
        _run_elsewhere(runner, folder, place, todo, (commands, seconds, report))
        return place
    _run_here(jobs, folder, place, todo, (commands, seconds, report))
    return place


def _run_here(jobs: int, folder: Path, place: Path, todo: list[str], settings: tuple) -> None:
    """Run cases in processes of this machine, which end with this one."""
    commands, seconds, report = settings
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


def _clear(place: Path, names: list[str]) -> None:
    """Take away the results of cases that did not finish."""
    for case in names:
        if (place / case).is_dir() and state_of(place / case) != FINISHED:
            shutil.rmtree(place / case)


def _run_elsewhere(
    runner: Runner, folder: Path, place: Path, todo: list[str], settings: tuple
) -> None:
    """Run cases by a mapper whose workers see the task alone."""
    commands, seconds, report = settings
    tasks = {n: (files_of(folder / CASES / n), commands, seconds) for n in todo}
    for index, (case, result) in enumerate(runner(remote_case, tasks), start=1):
        if "crash" in result:
            report(f"{case}: not run: {result['crash']} ({index} of {len(todo)})")
            continue
        put_files(place / case, result["files"])
        report(f"{case}: {_summary(place / case, result['outcome'])} ({index} of {len(todo)})")


def state_of(place: Path) -> str | None:
    """Whether a case's diagnosis finished, crashed or was stopped; None where it was not run."""
    path = place / OUTCOME
    if not path.is_file():
        return None
    outcome = json.loads(path.read_text(encoding="utf-8"))
    if outcome["diagnose_status"] == 0 and (place / "diagnosis.json").is_file():
        return FINISHED
    return STOPPED if outcome["diagnose_status"] is None else CRASHED


def files_of(folder: Path) -> dict[str, bytes]:
    """The files of a folder by their path in it, to travel with a task."""
    paths = (p for p in sorted(folder.rglob("*")) if p.is_file())
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in paths}


def put_files(target: Path, files: Mapping[str, bytes]) -> None:
    """Write a folder that appears whole."""
    waiting = target.with_name(f".{target.name}.{os.getpid()}")
    shutil.rmtree(waiting, ignore_errors=True)
    for name, content in files.items():
        (waiting / name).parent.mkdir(parents=True, exist_ok=True)
        (waiting / name).write_bytes(content)
    os.replace(waiting, target)


def remote_case(task: tuple[Mapping[str, bytes], tuple[str, str], float]) -> dict:
    """Run one case on a worker that has no file system in common with the asking process."""
    files, commands, seconds = task
    with tempfile.TemporaryDirectory(prefix="proof-") as room:
        put_files(Path(room) / "case", files)
        outcome = run_case(Path(room) / "case", Path(room) / "result", commands, seconds)
        return {"files": files_of(Path(room) / "result"), "outcome": outcome}


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
