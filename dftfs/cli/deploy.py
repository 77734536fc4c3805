"""`dftfs deploy`: a scenario's controller as C99 for the machine, with guard, log and bench."""

import argparse
import shutil
import subprocess
import tempfile
from dataclasses import asdict, replace
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress
from dftfs.cli.output import output_folder
from dftfs.cli.scenario_run import run_of
from dftfs.errors import DftfsError
from dftfs.files import file_stem, prepare_folder, refuse_existing, write_text
from rsea_core.control.c_header import REALS, c_name
from rsea_core.control.deployment import deployment, limits_of
from rsea_core.errors import SimulationError
from rsea_core.interop.machine_in_c import machine_in_c
from rsea_core.interop.ros2_control import FILES, ros2_package
from rsea_core.scenarios.scenario import Scenario

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-O1",
         "-ffp-contract=off")  # fmt: skip
LIMITS = {
    "watchdog-s": "without a call the command is zero after this time (default: 3 periods)",
    "torque-Nm": "of the spring; beyond it the command is zero (default: twice the run's)",
    "motor-speed-rad-per-s": "a faster change of the reading is a fault (default: twice the run's)",
    "load-speed-rad-per-s": "the same on the load's side",
    "rate-per-s": "of the command (default: its range in four samples)",
    "continuous-A": "current the drive stands for ever; beyond it, filtered, the command is zero",
    "thermal-s": "time constant of that filter (I2t; default: no such limit)",
    "blend-s": "time from the measured value to the reference after enabling (default: 0.2)",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", type=Path, metavar="SCENARIO.toml")
    parser.add_argument(
        "--real", choices=REALS, default="double", help="precision of the C (default: double)"
    )
    for name, text in LIMITS.items():
        parser.add_argument(f"--{name}", type=float, metavar="X", help=text)
    parser.add_argument(
        "--travel-rad", type=float, nargs=2, metavar=("LOW", "HIGH"), help="angles of the load"
    )
    parser.add_argument(
        "--ros2",
        action="store_true",
        help="also write a ros2_control controller plugin, a skeleton (folder NAME_ros2)",
    )
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, write the C files, and run the bench where there is a compiler."""
    say = progress()
    scenario = Scenario.from_toml(arguments.scenario)
    stem = c_name(file_stem(scenario.name))
    folder = output_folder(arguments, f"deploy-{scenario.name}")
    ends = (".h", "_guard.h", "_log.h", "_bench.c", "_plant.h", "_plant.c", "_loop.c")
    names = [*(stem + end for end in ends), "replay.csv", "rig.toml", "log.csv"]
    if arguments.ros2:
        names += [f"{stem}_ros2/{path}" for path in FILES.values()]
    if folder is not None:
        refuse_existing([folder / name for name in names], force=arguments.force)
    result, _ = run_of(scenario, arguments.scenario.parent, say)
    ran, given = result.trajectory, {}
    for name in LIMITS:
        key = name.replace("-", "_")
        if getattr(arguments, key) is not None:
            given[key] = getattr(arguments, key)
    if arguments.travel_rad is not None:
        given["lowest_rad"], given["highest_rad"] = arguments.travel_rad
    limits = replace(limits_of(ran, scenario.controller), **given)
    texts = deployment(
        scenario.controller, ran, scenario.reference, limits, name=stem, real=arguments.real
    )
    try:
        texts |= machine_in_c(scenario.controller, ran, name=stem, real=arguments.real)
    except SimulationError as problem:
        say(f"no loop in C: {problem}")
    good, messages, log = _bench(texts, stem)
    if arguments.ros2:
        texts |= ros2_package(
            scenario.controller, ran.command_name, texts, name=stem, real=arguments.real
        )
    if folder is not None:
        if log is not None:
            texts["log.csv"] = log
        for name in texts:
            prepare_folder((folder / name).parent)
        written = [str(write_text(folder / name, text)) for name, text in texts.items()]
    else:
        written = []
    record = {"limits": asdict(limits), "bench_passed": good, "bench": messages, "files": written}
    emit(record, "\n".join([*messages, *written]), as_json=arguments.json)
    return 1 if good is False else 0


def _bench(texts: dict[str, str], stem: str) -> tuple[bool | None, list[str], str | None]:
    """Whether bench and loop passed (None: no compiler), what they said, the bench's log."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None, ["bench not run: no C compiler (cc or gcc) on this machine"], None
    with tempfile.TemporaryDirectory() as made:
        for name, text in texts.items():
            Path(made, name).write_text(text, encoding="utf-8")
        good, messages = _ran(compiler, made, [f"{stem}_bench.c"], ["replay.csv", "log.csv"])
        if f"{stem}_loop.c" in texts:
            closed, more = _ran(
                compiler, made, [f"{stem}_loop.c", f"{stem}_plant.c"], ["replay.csv"]
            )
            good, messages = good and closed, [*messages, *more]
        return good, messages, Path(made, "log.csv").read_text(encoding="utf-8")


def _ran(compiler: str, made: str, sources: list[str], given: list[str]) -> tuple[bool, list[str]]:
    """Compile and run; whether it ended with 0, and what both wrote."""
    built = subprocess.run(
        [compiler, *FLAGS, *sources, "-o", "program", "-lm"],
        cwd=made, capture_output=True, text=True,
    )  # fmt: skip
    if built.returncode != 0:
        raise DftfsError(f"{compiler} refuses {sources[0]}: {built.stderr.splitlines()[0]}")
    done = subprocess.run(["./program", *given], cwd=made, capture_output=True, text=True)
    return done.returncode == 0, [*built.stderr.splitlines(), *done.stdout.splitlines()]
