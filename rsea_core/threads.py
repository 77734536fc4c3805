"""Independent pieces of compiled work on threads."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numba
import numpy as np

PIECES_PER_THREAD = 4


def share_out(run: Callable[[int, int], None], count: int, *, parallel: bool = True) -> None:
    """Call run(begin, end) over 0..count in pieces, on as many threads as numba may use.

    `run` must leave the interpreter alone for most of its time (numba's nogil) and its pieces
    must not depend on each other; the first one runs alone because it may compile.
    """
    threads = min(numba.get_num_threads(), count)
    if threads == 1 or not parallel:
        run(0, count)
        return
    edges = np.linspace(0, count, min(PIECES_PER_THREAD * threads, count) + 1).astype(int)
    run(int(edges[0]), int(edges[1]))
    pool = _pool(threads, os.getpid())
    pieces = [pool.submit(run, int(a), int(b)) for a, b in pairwise(edges[1:])]
    for piece in pieces:
        piece.result()


@cache
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    """Threads that stay: starting them costs more than a short piece. A forked child has none."""
    return ThreadPoolExecutor(threads)
