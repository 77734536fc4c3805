"""Candidates of a sizing judged in several processes, in their order."""

import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial

from dftfs.analysis.jobs.worker_pool import METHOD, follow_parent
from dftfs.analysis.sizing.rod_candidate import Candidate, assess
from dftfs.analysis.sizing.task import SizingTask
from dftfs.errors import DesignError

Judge = Callable[[Sequence[tuple[int, ...]]], Iterable[Candidate]]


@contextmanager
def judge_pool(task: SizingTask, jobs: int) -> Iterator[Judge]:
    """What judges many candidates: this process for one job, else so many processes.

    Raises
    ------
    DesignError
        If there is not at least one job.
    """
    if jobs < 1:
        raise DesignError(f"--jobs {jobs} must be 1 or more")
    one = partial(assess, task)
    if jobs == 1:
        yield lambda many: map(one, many)
        return
    context = multiprocessing.get_context(METHOD)
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=follow_parent) as pool:
        yield lambda many: pool.map(one, many, chunksize=max(1, len(many) // (4 * jobs)))
