"""The program `dftfs`: reads the words, hands over to one command, turns errors into one line."""

import argparse
import importlib
import os
import sys

from dftfs import __version__
from dftfs.errors import DftfsError
from rsea_core.errors import RseaError

COMMANDS = {
    "study": "the main job: design, CAD, finite elements, actuator, one report",
    "design": "closed forms, rod model, gaps and contact, in milliseconds",
    "export": "write STEP, STL and DXF of a design",
    "verify": "the large-displacement finite-element solve: curve, stress, contact, mesh error",
    "simulate": "the actuator with a spring and a controller, from a scenario file",
    "diagnose": "where simulation and recordings differ, and the physics that is missing",
    "predict": "what a diagnosed machine will read under unseen inputs",
    "materials": "the material table, every value with its source",
}


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, with exit status 2."""

    def error(self, message: str) -> None:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser(words: list[str]) -> argparse.ArgumentParser:
    """The parser for these words: only the command that they name is imported."""
    top = OneLineParser(prog="dftfs", description="Flat double-spiral springs and their actuator.")
    top.add_argument("--version", action="version", version=f"dftfs {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, what in COMMANDS.items():
        own = commands.add_parser(name, help=what, description=what)
        if name in words:
            module = importlib.import_module(f"dftfs.cli.{name}")
            module.add_arguments(own)
            own.set_defaults(run=module.run)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    0 done, 1 a stated requirement failed, 2 wrong input, 3 a solver failed, 130 interrupted.
    """
    words = sys.argv[1:] if argv is None else argv
    try:
        arguments = parser(words).parse_args(words)
        return int(arguments.run(arguments))
    except (DftfsError, RseaError) as error:
        line = " ".join(str(error).split())
        print(f"dftfs {words[0]}: {line}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print(f"dftfs {words[0]}: interrupted; nothing half-written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    sys.exit(main())
