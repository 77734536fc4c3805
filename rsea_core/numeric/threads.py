"""Independent pieces of compiled work on threads."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, wraps
from itertools import pairwise
from types import CodeType

import numba
import numpy as np
from threadpoolctl import threadpool_limits

OPENBLAS = ("libopenblas", "libscipy_openblas")  # file names, of Linux distributions and wheels
PIECES_PER_THREAD = 4
_compiled: set[CodeType] = set()  # of every `run` whose first piece has been through


def share_out(run: Callable[[int, int], None], count: int, *, parallel: bool = True) -> None:
    """Call run(begin, end) over 0..count in pieces, on as many threads as numba may use.

    `run` must leave the interpreter alone for most of its time (numba's nogil) and its pieces
    must not depend on each other. The first piece of a `run` that this process has not seen runs
    alone, because it may compile.
    """
    share_out_all([(run, count)], parallel=parallel)


def share_out_all(
    works: Sequence[tuple[Callable[[int, int], None], int]], *, parallel: bool = True
) -> None:
    """As `share_out` of several works (run, count), whose pieces do not wait for each other's."""
    most = numba.get_num_threads()
    pieces = []
    for run, count in works:
        threads = min(most, count) if len(works) == 1 else most
        if threads <= 1 or not parallel:
            run(0, count)
            continue
        edges = np.linspace(0, count, min(PIECES_PER_THREAD * threads, count) + 1).astype(int)
        if run.__code__ not in _compiled:
            run(int(edges[0]), int(edges[1]))
            edges = edges[1:]
            _compiled.add(run.__code__)
        pieces += [(run, int(a), int(b)) for a, b in pairwise(edges)]
    if pieces:
        pool = _pool(most, os.getpid())
        for piece in [pool.submit(*each) for each in pieces]:
            piece.result()


def on_one_blas_thread(function: Callable) -> Callable:
    """A function during which OpenBLAS uses one thread.

    The matrices here have some ten rows: threads of BLAS wait for each other for longer than the
    product takes, and for the threads of `share_out`. The command line sets this for all it does.
    """

    @wraps(function)
    def limited(*args, **kwargs):
        with threadpool_limits(dict.fromkeys(OPENBLAS, 1)):
            return function(*args, **kwargs)

    return limited


@cache
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    """Threads that stay: starting them costs more than a short piece. A forked child has none."""
    return ThreadPoolExecutor(threads)
