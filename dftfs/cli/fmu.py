"""`dftfs fmu`: a scenario's machine as an FMU 3.0 for co-simulation, checked against its run."""

import argparse
import platform
import shutil
import subprocess
import tempfile
from pathlib import Path

from dftfs.cli.common import add_output, emit, progress
from dftfs.cli.output import output_folder
from dftfs.cli.scenario_run import run_of
from dftfs.errors import DftfsError
from dftfs.files import file_stem, refuse_existing, write_bytes
from rsea_core.control.c_header import c_name
from rsea_core.interop.fmu import FmuSource, fmu_source, fmu_zip
from rsea_core.interop.fmu_check import BOUND, checked
from rsea_core.scenarios.scenario import Scenario

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-O2", "-ffp-contract=off", "-fPIC",
         "-shared")  # fmt: skip
SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib")}
MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", type=Path, metavar="SCENARIO.toml")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, write and compile the FMU, give it the run's commands by fmpy, and compare."""
    say = progress()
    scenario = Scenario.from_toml(arguments.scenario)
    stem = c_name(file_stem(scenario.name))
    folder = output_folder(arguments, f"fmu-{scenario.name}")
    if folder is not None:
        refuse_existing([folder / f"{stem}.fmu"], force=arguments.force)
    result, _ = run_of(scenario, arguments.scenario.parent, say)
    ran = result.trajectory
    content = compiled(fmu_source(ran, name=stem))
    record = checked(content, ran)
    found_lines = _summary(record)
    if folder is not None:
        record["file"] = str(write_bytes(folder / f"{stem}.fmu", content))
        found_lines.append(record["file"])
    emit(record, "\n".join(found_lines), as_json=arguments.json)
    return 1 if record["passed"] is False else 0


def compiled(source: FmuSource) -> bytes:
    """The FMU with a library for this computer."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise DftfsError("an FMU needs a C compiler (cc or gcc): none on this computer")
    system, machine = platform.system(), platform.machine()
    if system not in SYSTEMS or machine not in MACHINES:
        raise DftfsError(
            f"an FMU is made on Linux or macOS (x86_64, arm64), not {system} {machine}"
        )
    name, ending = SYSTEMS[system]
    with tempfile.TemporaryDirectory() as made:
        for file, text in source.files.items():
            Path(made, file).write_text(text, encoding="utf-8")
        built = subprocess.run(
            [compiler, *FLAGS, "fmu.c", "-o", "library", "-lm"],
            cwd=made, capture_output=True, text=True,
        )  # fmt: skip
        if built.returncode != 0:
            raise DftfsError(f"{compiler} refuses the FMU: {built.stderr.splitlines()[0]}")
        library = Path(made, "library").read_bytes()
    return fmu_zip(source, library, f"{MACHINES[machine]}-{name}", ending)


def _summary(record: dict) -> list[str]:
    if record["passed"] is None:
        return ["not checked: fmpy is not installed (pip install fmpy)"]
    lines = [f"fmpy: {problem}" for problem in record["problems"]]
    lines = lines or ["pass: fmpy finds no error in the description"]
    for name, value in record["difference"].items():
        good = "pass" if value <= BOUND else "FAIL"
        lines.append(
            f"{good}: {name} differs from the simulation by {value:.2g} of its largest value"
            f" (allowed {BOUND:g})"
        )
    return lines
