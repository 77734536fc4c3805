"""Ends a parallel run that has lost a worker, instead of waiting for it for ever.

pytest-xdist learns of a worker's end when the worker's pipe closes. A process that the worker has
forked keeps that pipe open, and a worker that is stopped or blocked in compiled code never closes
it: the run would wait without a word. This plugin of the controlling process looks after both.
"""

import os
import threading
import time

import psutil
import pytest

INTERNAL_ERROR = 3  # exit status of pytest
LOOKS_DEAD = 3  # in a row, before a dead worker counts as lost: xdist mostly notices by itself


def pytest_addoption(parser: pytest.Parser) -> None:
    silence = "longest time without a test that begins or ends"
    parser.addini("worker_silence_s", silence, default="600")
    parser.addini("worker_look_s", "time between two looks at the workers", default="5")


def pytest_configure(config: pytest.Config) -> None:
    if getattr(config.option, "dist", "no") != "no":  # a worker itself has "no"
        watch = WorkerWatch(
            config,
            silence_s=float(config.getini("worker_silence_s")),
            look_s=float(config.getini("worker_look_s")),
        )
        config.pluginmanager.register(watch, "worker-watch")


class WorkerWatch:
    """Looks at the workers every `look_s`, and gives up after `silence_s` without any progress."""

    def __init__(self, config: pytest.Config, *, silence_s: float, look_s: float) -> None:
        self.config, self.silence_s, self.look_s = config, silence_s, look_s
        self.begun: dict[str, None] = {}  # tests that run now, in the order of their beginning
        self.failed: list[str] = []
        self.last_news = time.monotonic()
        self.over = threading.Event()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodeready(self) -> None:
        self.last_news = time.monotonic()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.begun[nodeid] = None
        self.last_news = time.monotonic()

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        self.begun.pop(nodeid, None)
        self.last_news = time.monotonic()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_sessionstart(self) -> None:
        threading.Thread(target=self.look, daemon=True).start()

    def pytest_sessionfinish(self) -> None:
        self.over.set()

    def look(self) -> None:
        dead: dict[int, int] = {}
        while not self.over.wait(self.look_s):
            ended = [p.pid for p in psutil.Process().children() if is_dead(p)]
            dead = {pid: dead.get(pid, 0) + 1 for pid in ended}
            if max(dead.values(), default=0) >= LOOKS_DEAD:
                self.give_up(f"a worker (process {ended[0]}) has died without a word")
            if time.monotonic() - self.last_news > self.silence_s:
                self.give_up(f"no test has begun or ended for {self.silence_s:g} s")

    def give_up(self, reason: str) -> None:
        """Say what is known and end everything: no other thread would answer any more."""
        terminal = self.config.pluginmanager.getplugin("terminalreporter")
        terminal.write_line("")
        terminal.write_sep("=", f"TESTS NOT FINISHED: {reason}", red=True)
        for title, tests in (("running then", self.begun), ("failed before", self.failed)):
            for test in list(tests):
                terminal.write_line(f"{title}: {test}")
        terminal.flush()
        for worker in psutil.Process().children():
            worker.kill()
        os._exit(INTERNAL_ERROR)


def is_dead(worker: psutil.Process) -> bool:
    """Whether a child of this process has ended and nobody has asked how: xdist would have."""
    try:
        return worker.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
