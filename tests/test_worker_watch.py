"""A parallel run that loses a worker fails at once and names the test, whatever the worker left."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cases.places import ROOT

LOST = """
import os, pathlib, signal, time

def test_that_passes():
    pass

def test_that_takes_its_worker_along():
    {fate}
"""
# a child holds the dead worker's pipe, so that xdist goes on waiting
DIES = """child = os.fork()
    if child == 0:
        time.sleep(120)
        os._exit(0)
    pathlib.Path("child").write_text(str(child))
    os.kill(os.getpid(), signal.SIGKILL)"""
STOPS = "os.kill(os.getpid(), signal.SIGSTOP)"


@pytest.mark.parametrize(
    ("fate", "reason"), [(DIES, "a worker (process "), (STOPS, "no test has begun or ended")]
)
def test_a_lost_worker_ends_the_run_with_the_name_of_its_test(tmp_path: Path, fate, reason):
    (tmp_path / "test_lost.py").write_text(LOST.format(fate=fate))
    command = [sys.executable, "-m", "pytest", "-n", "1", "-p", "tests.worker_watch"]
    command += ["-o", "worker_silence_s=6", "-o", "worker_look_s=0.3", "test_lost.py"]
    began = time.monotonic()
    with (tmp_path / "out").open("w") as out:
        done = subprocess.run(
            command, cwd=tmp_path, stdout=out, stderr=out, timeout=110,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    child = tmp_path / "child"
    if child.exists():
        os.kill(int(child.read_text()), signal.SIGKILL)
    reported = (tmp_path / "out").read_text()
    assert done.returncode == 3, reported
    assert f"TESTS NOT FINISHED: {reason}" in reported
    assert "running then: test_lost.py::test_that_takes_its_worker_along" in reported
    assert "test_that_passes" not in reported
    assert time.monotonic() - began < 100.0
