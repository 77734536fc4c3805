"""The program `dftfs`: parses the command line, runs one command, prints an error as one line."""

import difflib
import importlib
import os
import signal
import sys

from dftfs import __version__
from dftfs.cli.budgets import budgets
from dftfs.cli.command_map import overview
from dftfs.cli.endings import as_interrupts, by_interrupt, failed, interrupted
from dftfs.cli.parsing import OneLineParser, examples

# by the module of dftfs/cli that runs the command
COMMANDS = {
    "study": "design, CAD, finite elements, actuator simulation and one report",
    "design": "closed forms, rod model, gaps and contact, in milliseconds",
    "export": "write STEP, STL and DXF of a design",
    "deck": "decks for CalculiX and Abaqus with named sets, and our fields of every step for VTK",
    "deliver": "one zip for the shop: STEP, DXF, toleranced drawing, certificate, measuring sheet",
    "mount": "what bolts or an elastic seat under hub and rim leave of the stiffness",
    "article": "the stiffness that a first article's measured dimensions give",
    "parts": "the reference parts with CAD files; `parts list`: sourced motors, gears, springs",
    "verify": "the large-displacement finite-element solve: curve, stress, contact, mesh error",
    "sweep": "solve a design over a grid or a list of fields: table and plots, cached, resumable",
    "size": "find the best geometry for a stiffness, a torque, an envelope and a process",
    "shape": "thickness and centreline along the arms for the most torque at yield per mass",
    "tolerance": "the spread of stiffness and first contact, and which tolerance to tighten",
    "simulate": "simulate the actuator with a spring and a controller, from a scenario file",
    "compare": "controllers compared: one plant, one reference, one tuning budget",
    "tune": "tune a controller on a task, over several seeds",
    "deploy": "a scenario's controller as guarded C99, with a bench that replays its simulation",
    "fmu": "a scenario's machine as an FMU 3.0 for co-simulation, checked against its simulation",
    "import_log": "logs of any format and names into a case: columns, units and signs proposed",
    "doctor": "health of the recordings of a case, and which errors of a log would be noticed",
    "export_log": "recordings of a case as Parquet or MCAP, a machine as MJCF or URDF",
    "friction": "friction laws compared on the recordings of a case, with their identifiability",
    "diagnose": "where simulation and recordings differ, and which physics the model lacks",
    "predict": "sensor readings that a diagnosed machine will give under new inputs",
    "prove": "validation of the diagnosis: cases with hidden effects, blind runs, scores",
    "thesis": "every number that the thesis prints, recomputed, with a verdict",
    "materials": "the material table, every value with its source",
    "report": "draw the pages of a result folder again from their data",
    "check_report": "a page's command run again, every value compared with the page's data",
    "schema": "JSON schema of a file that the program reads, for editors",
    "new": "write a commented design, rig, scenario, comparison or sizing task to start from",
    "completion": "completion of commands and options for bash, zsh or fish",
}
SPELLED = {
    "import_log": "import",
    "export_log": "export-log",
    "check_report": "check-report",
}  # else the module's own name
SENTENCES = {SPELLED.get(module, module): text for module, text in COMMANDS.items()}


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
    finally:
        record_command(None)
    sys.stdout.flush()  # a full disk behind standard output shows here, not at exit
    return status


def program() -> int:
    """The command line as a process: done is done, a late Ctrl-C does not disturb the end."""
    status = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status


if __name__ == "__main__":
    sys.exit(program())
