"""A limit of work that is counted and not timed.

What a search leaves out when it has worked long enough must not depend on the machine or on what
else runs there: the same inputs give the same result. Work is counted in units of the caller's
choice, and whoever is about to begin something optional asks whether any is left.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass
class Work:
    """Work done, its limit, and whether something was left out because of it.

    A strict limit also ends a search that has begun, once it has a first result.
    """

    most: float
    strict: bool = False
    done: float = 0.0
    curtailed: bool = False


_current: ContextVar[Work | None] = ContextVar("work", default=None)
_open: list[Work] = []  # for other threads, which do not see a context variable


@contextmanager
def limited_work(most: float, *, strict: bool = False) -> Iterator[Work]:
    """A context in which work is counted and limited; with inf it is only counted."""
    work = Work(most, strict)
    token = _current.set(work)
    _open.append(work)
    try:
        yield work
    finally:
        _open[:] = [other for other in _open if other is not work]
        _current.reset(token)


def work_in_progress() -> Work | None:
    """The innermost work that is counted now, on whatever thread; for messages only."""
    return _open[-1] if _open else None


@contextmanager
def share_of_work(share: float) -> Iterator[None]:
    """A context in which only a share of the limit may be used; the rest is left for later."""
    work = _current.get()
    if work is None:
        yield
        return
    most, work.most = work.most, share * work.most
    try:
        yield
    finally:
        work.most = most


def count_work(amount: float) -> None:
    """Add to the work done; nothing outside of a limit."""
    work = _current.get()
    if work is not None:
        work.done += amount


def no_work_left(*, begun: bool = False) -> bool:
    """Whether the limit is reached: whoever asks leaves something out then.

    Parameters
    ----------
    begun : bool
        Whether the search that asks has begun and has a first result: only a strict limit ends it.
    """
    work = _current.get()
    if work is None or work.done < work.most or (begun and not work.strict):
        return False
    work.curtailed = True
    return True
