"""A sweep that is killed, or loses a worker of a cluster, ends with the same table."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import psutil
import pytest

from dftfs.analysis.jobs.dask_cluster import run_on_cluster
from dftfs.analysis.jobs.store import ContentStore
from dftfs.analysis.jobs.worker_pool import run_in_processes
from dftfs.analysis.sweep.points import grid_points, parse_vary
from dftfs.analysis.sweep.run import run_sweep
from dftfs.analysis.sweep.table import csv_text
from dftfs.analysis.torsion.batch_solve import SharedProblem
from dftfs.cli.main import main
from dftfs.errors import DesignError

VARY = "turns=1.7:1.95:8"
PATIENCE_S = 60


def command(folder, cache):
    arguments = ["sweep", "al1", "--vary", VARY, "--model", "rod", "--states", "2", "--jobs", "2"]
    return [*arguments, "--out", str(folder), "--cache", str(cache)]


def entries(cache):
    return {path: path.stat().st_mtime_ns for path in cache.glob("*/*.json")}


def wait_until(condition, patience_s=PATIENCE_S):
    end = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def test_killed_in_the_middle_the_next_run_completes_with_the_same_table(tmp_path, capsys):
    cache = tmp_path / "cache"
    process = subprocess.Popen(
        [sys.executable, "-m", "dftfs", *command(tmp_path / "killed", cache)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_until(lambda: len(entries(cache)) >= 3)
    children = psutil.Process(process.pid).children(recursive=True)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    before = entries(cache)
    assert 3 <= len(before) < 8, "the kill came too late to prove anything"
    assert not list((tmp_path / "killed").iterdir())
    wait_until(lambda: not any(c.is_running() and c.status() != "zombie" for c in children))
    assert main([*command(tmp_path / "killed", cache), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["from_cache"], record["shared_solves"]) == (len(before), 8)
    after = entries(cache)
    assert {path: after[path] for path in before} == before, "a kept solve was done again"
    assert main(command(tmp_path / "whole", tmp_path / "other cache")) == 0
    for name in ("sweep.csv", "sweep.parquet"):
        whole, resumed = ((tmp_path / f / name).read_bytes() for f in ("whole", "killed"))
        assert whole == resumed, name


def test_a_cluster_that_loses_a_worker_gives_the_same_table(tmp_path):
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    points = grid_points([parse_vary(VARY)])

    def run(runner, folder):
        store = ContentStore(folder=tmp_path / folder)
        return run_sweep("al1", {}, points, model="rod", states=2, store=store, runner=runner)

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:

        def losing(function, tasks):
            found = run_on_cluster(function, tasks, cluster.scheduler_address)
            for count, done_task in enumerate(found):
                if count == 1:
                    os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
                yield done_task

        result = run(losing, "cluster")
    local = run(partial(run_in_processes, jobs=1), "local")
    assert result.failed == 0
    assert csv_text(result) == csv_text(local)


def test_a_scheduler_that_does_not_answer_is_named():
    pytest.importorskip("distributed", reason="needs the extra cluster")
    with pytest.raises(DesignError, match="no scheduler answers"):
        list(run_on_cluster(SharedProblem.of, {"a": 1}, "tcp://127.0.0.1:9", connect_s=0.2))


BAD = [
    ([], "give --vary"),
    (["--vary", "width_mm=4", "--list", "x.csv"], "give --vary"),
    (["--vary", "width_mm=4:5"], "START:STOP:COUNT"),
    (["--vary", "widht_mm=4"], "nearest known one is 'width_mm'"),
    (["--list", "nowhere.csv"], "cannot be read"),
    (["--vary", "width_mm=4", "--jobs", "0"], "--jobs"),
    (["--vary", "width_mm=4", "--states", "0"], "states"),
    (["--vary", "width_mm=4", "--export", "igs"], "known are step"),
    (["--vary", "width_mm=4", "--set", "turns=9"], "overlap"),
    (["--vary", "width_mm=4", "--cache", "/proc/nowhere"], "cannot be written"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=[" ".join(w) for w, _ in BAD])
def test_wrong_input_is_one_line_with_status_2(arguments, message, tmp_path, capsys):
    where = [] if "--cache" in arguments else ["--cache", str(tmp_path / "c")]
    status = main(["sweep", "al1", "--out", str(tmp_path / "o"), *where, *arguments])
    captured = capsys.readouterr()
    assert (status, captured.out) == (2, "")
    assert message in captured.err.strip().splitlines()[-1]
    assert not list((tmp_path / "o").glob("*"))


def test_a_table_that_is_there_is_not_overwritten(tmp_path, capsys):
    arguments = ["sweep", "al1", "--vary", "width_mm=4,-1", "--model", "rod", "--states", "1"]
    arguments += ["--out", str(tmp_path / "o"), "--cache", str(tmp_path / "c"), "--jobs", "1"]
    assert main(arguments) == 0
    assert "width_mm = -1 must be positive" in capsys.readouterr().out
    assert main(arguments) == 2
    assert "--force" in capsys.readouterr().err
