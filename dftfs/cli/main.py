"""The program `dftfs`: parses the command line, runs one command, prints an error as one line."""

import argparse
import importlib
import os
import sys

from dftfs import __version__
from dftfs.errors import DftfsError

COMMANDS = {
    "study": "design, CAD, finite elements, actuator simulation and one report",
    "design": "closed forms, rod model, gaps and contact, in milliseconds",
    "export": "write STEP, STL and DXF of a design",
    "deliver": "one zip for the shop: STEP, DXF, toleranced drawing, certificate, measuring sheet",
    "parts": "the reference parts: CAD files, drawings and a manifest in one folder",
    "verify": "the large-displacement finite-element solve: curve, stress, contact, mesh error",
    "sweep": "solve a design over a grid or a list of fields: table and plots, cached, resumable",
    "size": "find the best geometry for a stiffness, a torque, an envelope and a process",
    "tolerance": "the spread of stiffness and first contact, and which tolerance to tighten",
    "simulate": "simulate the actuator with a spring and a controller, from a scenario file",
    "compare": "controllers compared: one plant, one reference, one tuning budget",
    "tune": "tune a controller on a task, over several seeds",
    "friction": "friction laws compared on the recordings of a case, with their identifiability",
    "diagnose": "where simulation and recordings differ, and which physics the model lacks",
    "predict": "sensor readings that a diagnosed machine will give under new inputs",
    "prove": "validation of the diagnosis: cases with hidden effects, blind runs, scores",
    "thesis": "every number that the thesis prints, recomputed, with a verdict",
    "materials": "the material table, every value with its source",
}


class StoreOnce(argparse.Action):
    """An option's value; the same option twice is a mistake, not a quiet choice of the last."""

    def __call__(self, parser, namespace, values, option_string=None):
        # the namespace remembers, not the action: a parser may read more than one line
        known = getattr(namespace, self.dest, self.default)
        if option_string is not None and known is not self.default:
            raise argparse.ArgumentError(self, "given twice")
        setattr(namespace, self.dest, values)


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, with exit status 2."""

    def __init__(self, *args, **kwargs) -> None:
        super().__init__(*args, **kwargs)
        for name in (None, "store"):
            self.register("action", name, StoreOnce)

    def error(self, message: str) -> None:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser(argv: list[str]) -> argparse.ArgumentParser:
    """The parser for these arguments: only the command that they name is imported."""
    top = OneLineParser(prog="dftfs", description="Flat double-spiral springs and their actuator.")
    top.add_argument("--version", action="version", version=f"dftfs {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, what in COMMANDS.items():
        own = commands.add_parser(name, help=what, description=what)
        if name in argv:
            module = importlib.import_module(f"dftfs.cli.{name}")
            module.add_arguments(own)
            own.set_defaults(run=module.run)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    0 done, 1 a stated requirement failed, 2 wrong input, 3 a solver failed, 130 interrupted.
    """
    arguments_given = sys.argv[1:] if argv is None else argv
    try:
        top = parser(arguments_given)
        arguments, unknown = top.parse_known_args(arguments_given)
        if unknown:
            name = f"dftfs {arguments.command}"
            top.exit(2, f"{name}: unrecognized arguments: {' '.join(unknown)}; see {name} --help\n")
        return int(arguments.run(arguments))
    except _expected() as error:
        line = " ".join(str(error).split())
        print(f"dftfs {arguments_given[0]}: {line}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        return _interrupted(arguments_given[0])
    except SystemError as error:
        if not _by_interrupt(error):
            raise
        return _interrupted(arguments_given[0])
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _by_interrupt(error: BaseException | None) -> bool:
    """Whether an interrupt inside a compiled loop, which cannot raise it itself, is behind it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _interrupted(command: str) -> int:
    print(f"dftfs {command}: interrupted; nothing half-written", file=sys.stderr)
    return 130


def _expected() -> tuple[type[Exception], ...]:
    """Errors that are printed as one line; the actuator's only where a command has loaded it."""
    actuator = sys.modules.get("rsea_core.errors")
    return (DftfsError, actuator.RseaError) if actuator else (DftfsError,)


if __name__ == "__main__":
    sys.exit(main())
