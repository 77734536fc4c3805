"""Progress that does not flood, and lines of a long search that says nothing."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def now_and_then(say: Callable[[str], None], seconds: float = 5.0) -> Callable[[str], None]:
    """A progress function that passes on the first message and one in so many seconds."""
    last = -seconds

    def sometimes(message: str) -> None:
        nonlocal last
        now = time.perf_counter()
        if now - last >= seconds:
            last = now
            say(message)

    return sometimes


@contextmanager
def still_working(say: Callable[[str], None], seconds: float = 30.0) -> Iterator[None]:
    """While it lasts, a line in so many seconds on how much of its limit a search has simulated."""
    from rsea_core.numeric.work_limit import work_in_progress

    ended = threading.Event()

    def tell() -> None:
        while not ended.wait(seconds):
            work = work_in_progress()
            if work is not None:
                most = f" of at most {work.most:.2g}" if work.most < math.inf else ""
                say(f"searching: {work.done:.2g}{most} rows simulated")

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
