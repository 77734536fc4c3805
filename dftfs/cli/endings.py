"""How a command ends that does not finish: an error as one line, a signal as an interrupt."""

import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.machinery import ExtensionFileLoader
from types import FrameType

from dftfs.cli.extras import missing_library
from dftfs.errors import DftfsError

MOST_CHARACTERS = 700  # of a message: a field of thousands is shown by its ends
RETRY_s = 0.02  # between attempts to deliver a signal that had to wait
INTERNAL_ERROR = 70  # sysexits.h: EX_SOFTWARE
_NAMES = ("SIGTERM", "SIGHUP", "SIGINT", "SIGALRM")  # the last: --time is over
ENDINGS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
_DEFAULT = (signal.SIG_DFL, signal.default_int_handler)  # another one, as nohup's, stays


class Ended(KeyboardInterrupt):
    """A signal that asks the program to end; handled as Ctrl-C is."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def failed(given: list[str], error: Exception) -> int:
    """One line for an error; the traceback of an internal one only where it is asked for."""
    if isinstance(error, expected()):
        line, status = str(error), error.exit_status
    elif "MemoryError" in (kind.__name__ for kind in type(error).__mro__):
        line, status = f"out of memory: {error}" if str(error) else "out of memory", 3
    elif line := missing_library(error):
        status = 2
    elif isinstance(error, OSError) and error.strerror:
        full = "the disk is full" if error.errno in (28, 122) else error.strerror
        line, status = f"{error.filename or 'standard output'}: {full}", 2
    else:
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{os.path.basename(last.filename)}:{last.lineno}"
        line = f"internal error, please report it: {type(error).__name__}: {str(error)[:300]}"
        line, status = f"{line} ({place}; -v prints the traceback)", INTERNAL_ERROR
        if {"-v", "--verbose"} & set(given):
            traceback.print_exception(error)
    if isinstance(error, OSError):  # what is left in the buffer cannot be written either
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    print(f"dftfs {given[0]}: {one_line(line)}", file=sys.stderr)
    return status


def one_line(text: str) -> str:
    """A message as it is printed: one line of printed characters, not too long."""
    line = " ".join(text.split())
    line = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in line)
    return line if len(line) <= MOST_CHARACTERS else f"{line[:500]} ... {line[-150:]}"


@contextmanager
def as_interrupts() -> Iterator[None]:
    """SIGTERM and SIGHUP end a command as Ctrl-C does: nothing half-written, no process left.

    A library that is interrupted while it loads or calls back may raise an error of its own in
    the interrupt's place: any error after a signal is the signal's. While a compiled library is
    loaded (some crash where that is interrupted) the signal waits.
    """
    received: list[Ended] = []

    def end(number: int, frame: FrameType | None) -> None:
        if _loads_compiled(frame):
            again = threading.Timer(RETRY_s, os.kill, (os.getpid(), number))
            again.daemon = True
            again.start()
            return
        received.append(Ended(number))
        raise received[-1]

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {n: signal.getsignal(n) for n in ENDINGS}
    ours = [n for n in ENDINGS if before[n] in _DEFAULT]
    for number in ours:
        signal.signal(number, end)
    try:
        yield
    except Exception as error:
        if received:
            raise received[-1] from error
        raise
    finally:
        for number in ours:
            signal.signal(number, before[number])


def _loads_compiled(frame: FrameType | None) -> bool:
    """Whether an extension module is being loaded somewhere below a frame."""
    while frame is not None:
        if frame.f_code.co_name in ("create_module", "exec_module") and isinstance(
            frame.f_locals.get("self"), ExtensionFileLoader
        ):
            return True
        frame = frame.f_back
    return False


def by_interrupt(error: BaseException | None) -> KeyboardInterrupt | None:
    """The interrupt that is behind an error: a compiled loop cannot raise it itself."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error


def interrupted(command: str, interrupt: KeyboardInterrupt) -> int:
    over = getattr(interrupt, "number", None) == getattr(signal, "SIGALRM", 0)
    why = "the time of --time is over" if over else "interrupted"
    print(f"dftfs {command}: {why}; nothing half-written", file=sys.stderr)
    return 128 + interrupt.number if isinstance(interrupt, Ended) else 130


def expected() -> tuple[type[Exception], ...]:
    """Errors that are printed as one line; the actuator's only where a command has loaded it."""
    actuator = sys.modules.get("rsea_core.errors")
    return (DftfsError, actuator.RseaError) if actuator else (DftfsError,)
