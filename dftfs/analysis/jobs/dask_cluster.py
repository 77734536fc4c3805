"""The same tasks on a Dask cluster (extra "cluster"). Only this module imports distributed.

A worker that dies gives its tasks back to the scheduler, which gives them to another (three
times); workers that come later join in. Results travel as plain data and are kept by the process
that asked, so workers need no common file system, only the same code.
"""

import importlib
import time
from collections.abc import Callable, Iterator, Mapping

from dftfs.analysis.jobs.store import code_version
from dftfs.errors import DesignError, SolveError

_CONNECT_S = 10.0
_POLL_S = 1.0
_NO_WORKERS_S = 60.0


def run_on_cluster(
    function: Callable[[object], dict],
    tasks: Mapping[str, object],
    address: str,
    *,
    no_workers_s: float = _NO_WORKERS_S,
    connect_s: float = _CONNECT_S,
) -> Iterator[tuple[str, dict]]:
    """Yield (key, result) as tasks finish on the cluster, as `run_in_processes` does.

    Parameters
    ----------
    address : str
        Of the scheduler, e.g. ``tcp://node1:8786``.
    no_workers_s : float
        How long to wait while the cluster has no worker at all.
    connect_s : float
        How long to wait for the scheduler.

    Raises
    ------
    DesignError
        If Dask is not installed, the scheduler does not answer or a worker runs another version.
    SolveError
        If there is no worker for too long; what was finished is cached.
    """
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise DesignError("--cluster needs Dask: pip install 'dftfs[cluster]'") from None
    try:
        client = distributed.Client(address, timeout=connect_s)
    except (OSError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise DesignError(f"--cluster {address}: no scheduler answers there: {reason}") from None
    with client:
        _wait_for_worker(client, address, no_workers_s)
        _require_same_code(client, address)
        futures = {
            client.submit(function, task, key=f"dftfs-{key}", pure=True): key
            for key, task in tasks.items()
        }
        yield from _finished(distributed, client, futures, address, no_workers_s)


def _finished(distributed, client, futures: dict, address: str, patience_s: float) -> Iterator:
    left, alone_since = set(futures), None
    while left:
        try:
            done = distributed.wait(left, timeout=_POLL_S, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            done = set()
        for future in done:
            left.discard(future)
            if future.status == "finished":
                yield futures[future], future.result()
            else:
                error = future.exception()
                text = f"{type(error).__name__}: {' '.join(str(error).split())}"
                yield futures[future], {"crash": text}
            future.release()
        if client.scheduler_info()["workers"]:
            alone_since = None
            continue
        alone_since = alone_since or time.monotonic()
        if left and time.monotonic() - alone_since > patience_s:
            raise SolveError(
                f"--cluster {address}: no worker for {patience_s:g} s, {len(left)} solves are"
                " left; the finished ones are cached: run the command again to continue"
            )


def _wait_for_worker(client, address: str, patience_s: float) -> None:
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except TimeoutError:
        raise DesignError(f"--cluster {address}: no worker within {patience_s:g} s") from None


def _require_same_code(client, address: str) -> None:
    for worker, theirs in client.run(code_version).items():
        if theirs != code_version():
            raise DesignError(
                f"--cluster {address}: worker {worker} runs another version of the code ({theirs},"
                f" here {code_version()}): install the same version of dftfs there"
            )
