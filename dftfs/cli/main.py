"""The program `dftfs`: reads the words, hands over to one command, turns errors into one line."""

import argparse
import os
import sys

from dftfs import __version__
from dftfs.cli import design, export, materials, simulate, study, verify
from dftfs.errors import DftfsError
from rsea_core.errors import CoreError

COMMANDS = (study, design, export, verify, simulate, materials)


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, with exit status 2."""

    def error(self, message: str) -> None:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = OneLineParser(prog="dftfs", description="Flat double-spiral springs and their actuator.")
    top.add_argument("--version", action="version", version=f"dftfs {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in COMMANDS:
        name = module.__name__.rsplit(".", 1)[1]
        own = commands.add_parser(name, help=module.HELP, description=module.HELP)
        module.add_arguments(own)
        own.set_defaults(run=module.run)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    0 done, 1 a stated requirement failed, 2 wrong input, 3 a solver failed, 130 interrupted.
    """
    arguments = parser().parse_args(argv)
    try:
        return int(arguments.run(arguments))
    except (DftfsError, CoreError) as error:
        line = " ".join(str(error).split())
        print(f"dftfs {arguments.command}: {line}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print(f"dftfs {arguments.command}: interrupted; nothing half-written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    sys.exit(main())
