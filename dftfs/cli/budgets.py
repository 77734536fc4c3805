"""--time and --memory: what a command may take of the machine, honoured by the system itself."""

import argparse
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from dftfs.errors import DftfsError

try:
    import resource
except ImportError:  # not on Windows
    resource = None
GB = 1e9
LEAST_GB = 0.5  # the interpreter with its compiled kernels


def add_budgets(parser: argparse.ArgumentParser) -> None:
    """The two options."""
    parser.add_argument(
        "--time", type=float, default=argparse.SUPPRESS, metavar="SECONDS",
        help="stop after this many seconds (status 142)",
    )  # fmt: skip
    parser.add_argument(
        "--memory", type=float, default=argparse.SUPPRESS, metavar="GB", dest="most_GB",
        help="memory limit of each process (status 3)",
    )  # fmt: skip


@contextmanager
def budgets(arguments: argparse.Namespace) -> Iterator[None]:
    """Bound the time of what runs inside, and the memory of this process and its children.

    Raises
    ------
    DftfsError
        If a budget is no number above its least, or the system cannot keep it.
    """
    seconds, most = getattr(arguments, "time", None), getattr(arguments, "most_GB", None)
    if seconds is not None and not 0.0 < seconds < 1e7:
        raise DftfsError(f"--time {seconds:g}: must be above 0 and below 1e7 s")
    if most is not None and not LEAST_GB <= most < 1e6:
        raise DftfsError(f"--memory {most:g}: must be {LEAST_GB} or more, in GB")
    before = None
    try:
        if most is not None:
            if resource is None:
                raise DftfsError("--memory: this system cannot limit the memory of a process")
            before = resource.getrlimit(resource.RLIMIT_DATA)
            resource.setrlimit(resource.RLIMIT_DATA, (int(most * GB), before[1]))
        if seconds is not None:
            if not hasattr(signal, "setitimer"):
                raise DftfsError("--time: this system has no timer for it")
            signal.setitimer(signal.ITIMER_REAL, seconds)
        yield
    finally:
        if seconds is not None and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        if before is not None:
            resource.setrlimit(resource.RLIMIT_DATA, before)
