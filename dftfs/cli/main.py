"""The program `dftfs`: parses the command line, runs one command, prints an error as one line."""

import difflib
import importlib
import os
import signal
import sys
from contextlib import suppress

from dftfs import __version__
from dftfs.cli.budgets import budgets
from dftfs.cli.command_map import COMMANDS, SENTENCES, overview
from dftfs.cli.endings import as_interrupts, by_interrupt, failed, interrupted
from dftfs.cli.parsing import OneLineParser, examples


def parser(argv: list[str]) -> OneLineParser:
    """The parser for these arguments: only the command that they name is imported."""
    top = OneLineParser(prog="dftfs", description=overview(SENTENCES), usage="dftfs COMMAND ...")
    top.add_argument("--version", action="version", version=f"dftfs {__version__}")
    commands = top.add_subparsers(
        dest="command", required=True, metavar="COMMAND", help="see above"
    )
    for (file, text), name in zip(COMMANDS.items(), SENTENCES):
        own = commands.add_parser(
            name, prog=f"dftfs {name}", description=text, epilog=examples(name)
        )
        if name in argv:
            module = importlib.import_module(f"dftfs.cli.{file}")
            module.add_arguments(own)
            own.add_common()
            own.set_defaults(run=module.run, parser=own)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    0 done, 1 a stated requirement failed, 2 wrong input, 3 a solver failed, 70 an error of the
    program itself, 130 interrupted, 128 + number ended by a signal.
    """
    given = sys.argv[1:] if argv is None else argv
    if not given:
        print(overview(SENTENCES))
        return 0
    try:
        with as_interrupts():
            return _run(given)
    except KeyboardInterrupt as error:
        return interrupted(given[0], error)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if interrupt := by_interrupt(error):
            return interrupted(given[0], interrupt)
        return failed(given, error)


def _run(given: list[str]) -> int:
    top = parser(given)
    if not given[0].startswith("-") and given[0] not in SENTENCES:
        near = difflib.get_close_matches(given[0][:100], SENTENCES, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else "`dftfs` lists the commands"
        top.exit(2, f"dftfs: unknown command {given[0]!r}; {hint}\n")
    arguments, unknown = top.parse_known_args(given)
    if unknown:
        arguments.parser.refuse(unknown)
    from dftfs.cli import common  # after parsing: `dftfs --help` imports no design
    from dftfs.report.provenance import record_command

    common.set_quiet(getattr(arguments, "quiet", False))
    record_command(given)
    try:
        with budgets(arguments):
            status = int(arguments.run(arguments))
    except BaseException:
        if folder := getattr(arguments, "made_folder", None):
            with suppress(OSError):  # it holds files
                folder.rmdir()
        raise
    finally:
        record_command(None)
    sys.stdout.flush()  # a full disk behind standard output shows here, not at exit
    return status


def program() -> int:
    """The command line as a process: done is done, a late Ctrl-C does not disturb the end."""
    # its threads wait for each other on small matrices; PARDISO and compiled loops have their own
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read once, when numpy is imported
    status = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status
