"""Tasks on the cores of this machine, in processes whose failure does not affect the others.

A task that kills its process (out of memory, a fault in a library) is run once more on its own
and then reported as failed. Workers end by themselves when the process that started them does,
however it ends.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

TaskResult = tuple[str, dict]
METHOD = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"


def run_in_processes(
    function: Callable[[object], dict], tasks: Mapping[str, object], jobs: int
) -> Iterator[TaskResult]:
    """Yield (key, result) as tasks finish, in any order.

    Parameters
    ----------
    function : callable
        Importable by name; called with a task, returns plain data.
    tasks : mapping of key to task
    jobs : int
        Processes at once, 1 or more.

    Yields
    ------
    key, result
        What the function returned, or ``{"crash": why}`` where it raised or its process died.
    """
    left = dict(tasks)
    suspects: dict[str, object] = {}
    while left:
        for key, done_task in _until_broken(function, dict(left), jobs, suspects):
            del left[key]
            yield key, done_task
        for key in suspects:
            left.pop(key, None)
    for key, task in suspects.items():
        alone = dict(_until_broken(function, {key: task}, 1, {}))
        yield key, alone.get(key, {"crash": "its process died twice; out of memory?"})


def _until_broken(
    function: Callable[[object], dict],
    tasks: Mapping[str, object],
    jobs: int,
    suspects: dict[str, object],
) -> Iterator[TaskResult]:
    """Run until all is done or a process has died; then ``suspects`` holds what was running."""
    pool = ProcessPoolExecutor(
        min(jobs, len(tasks)),
        mp_context=multiprocessing.get_context(METHOD),
        initializer=follow_parent,
    )
    waiting = iter(tasks.items())
    running: dict[Future, str] = {}
    try:
        while True:
            # no more is submitted than can run, so that what was running is known
            for key, task in waiting:
                try:
                    running[pool.submit(function, task)] = key
                except BrokenProcessPool:
                    if not running:  # not even started: it counts as what broke the pool
                        suspects[key] = task
                    raise
                if len(running) == jobs:
                    break
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                key = running.pop(future)
                try:
                    done_task = future.result()
                except BrokenProcessPool:
                    running[future] = key
                    raise
                except Exception as error:  # an error of one task must not end the others
                    done_task = {"crash": f"{type(error).__name__}: {' '.join(str(error).split())}"}
                yield key, done_task
    except BrokenProcessPool:
        suspects.update({key: tasks[key] for key in running.values()})
    finally:
        for process in list((pool._processes or {}).values()) if running else ():
            process.terminate()  # interrupted or broken: nobody waits for these any more
        pool.shutdown(wait=True, cancel_futures=True)


def follow_parent() -> None:
    """In a worker: Ctrl-C is the parent's to handle, and when the parent is gone so is this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def watch() -> None:
        parent.join()
        os._exit(1)

    if parent is not None:
        threading.Thread(target=watch, daemon=True, name="follow-parent").start()
