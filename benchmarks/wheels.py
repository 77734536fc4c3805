"""Two wheels from one repository, each tried in a clean environment: `make wheels`.

    python -m benchmarks.wheels --out out/wheels             builds both and tries both
    python -m benchmarks.wheels --out out/wheels --no-try    builds them only

`rsea-core` is the actuator alone, with numpy, scipy and numba; `dftfs` holds the springs, the
command line and the reports, and requires `rsea-core`. The root's pyproject.toml stays the only
list of versions and dependencies. Tried: size of the wheels and of the environment, seconds of
import beyond numpy's, one simulation with `rsea-core` alone, `dftfs --help`, `dftfs design` and
the line that names the extra of a library that is missing. Exit status 1 where a limit is missed.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CORE_NEEDS = ("numpy", "scipy", "numba")
MOST_WHEEL_MB, MOST_ENVIRONMENT_MB, MOST_SECONDS = 5.0, 300.0, 0.3
DESCRIPTIONS = {
    "rsea-core": "Simulation, control and identification of rotary series elastic actuators",
}
IMPORT_SECONDS = """
import time
import {before}
start = time.perf_counter()
import {module}
print(time.perf_counter() - start)
"""
SIMULATE = """
import numpy as np
from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
rig = Rig.preset("rsea-bench")
time_s = np.arange(0.0, 1.0, 1e-3)
inputs = Inputs(
    time_s=time_s, duty=0.2 * np.sin(2 * np.pi * time_s), load=Load(kind="locked")
)
print(simulate(ActuatorModel(rig), inputs).torque_Nm[-1])
"""


def project(name: str) -> str:
    """The pyproject.toml of one of the wheels, from the root's."""
    root = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    whole, package = root["project"], name.replace("-", "_")
    core = [d for d in whole["dependencies"] if d.split(">")[0] in CORE_NEEDS]
    others = [d for d in whole["dependencies"] if d not in core]
    needs = core if name == "rsea-core" else [f"rsea-core=={whole['version']}", *others]
    lines = [
        "[build-system]",
        f"requires = {json.dumps(root['build-system']['requires'])}",
        'build-backend = "setuptools.build_meta"',
        "[project]",
        f'name = "{name}"',
        f'version = "{whole["version"]}"',
        f"description = {json.dumps(DESCRIPTIONS.get(name, whole['description']))}",
        f'requires-python = "{whole["requires-python"]}"',
        'license = "MIT"',
        'license-files = ["LICENSE"]',
        f"dependencies = {json.dumps(needs)}",
    ]
    if name == "dftfs":
        lines += ["[project.optional-dependencies]"]
        lines += [f"{k} = {json.dumps(v)}" for k, v in whole["optional-dependencies"].items()]
        lines += ["[project.scripts]", f'dftfs = "{whole["scripts"]["dftfs"]}"']
    data = json.dumps(root["tool"]["setuptools"]["package-data"][package])
    lines += ["[tool.setuptools.packages.find]", f'include = ["{package}*"]']
    return "\n".join([*lines, "[tool.setuptools.package-data]", f"{package} = {data}", ""])


def build(name: str, out: Path) -> Path:
    """The wheel of a package, built from a copy of its folder."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        package = name.replace("-", "_")
        ignored = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
        shutil.copytree(ROOT / package, place / package, ignore=ignored)
        shutil.copy(ROOT / "LICENSE", place)
        (place / "pyproject.toml").write_text(project(name), encoding="utf-8")
        out.mkdir(parents=True, exist_ok=True)
        pip = [sys.executable, "-m", "pip", "wheel", "-qq", "--no-deps"]
        subprocess.run([*pip, "--wheel-dir", out, place], check=True)
    return max(out.glob(f"{package}-*.whl"), key=lambda path: path.stat().st_mtime)


def environment(folder: Path, wheels: list[Path], *, constraints: bool = True) -> Path:
    """The interpreter of a new environment that holds the wheels and what they require."""
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    limits = ["-c", str(ROOT / "constraints.txt")] if constraints else []
    found = ["--find-links", str(wheels[0].parent)]
    pip = [str(python), "-m", "pip", "install", "-qq", "--disable-pip-version-check"]
    subprocess.run([*pip, *limits, *found, *map(str, wheels)], check=True)
    return python


def megabytes(folder: Path, package: str = "") -> float:
    """Size of what was installed, or of one package, without pip and without compiled copies."""
    places = next(folder.glob("lib/python*/site-packages")) / package
    parts = ((p, p.relative_to(folder).parts) for p in places.rglob("*"))
    not_counted = {"__pycache__", "pip", "setuptools", "pkg_resources"}
    kept = (p for p, names in parts if p.is_file() and not not_counted.intersection(names))
    return sum(p.stat().st_size for p in kept) / 1e6


def import_seconds(python: Path, before: str, module: str) -> float:
    """Seconds to import a module where another one is there already; the quickest of five."""
    code = IMPORT_SECONDS.format(before=before, module=module)
    return min(float(printed(python, code, python.parent)) for _ in range(5))


def printed(python: Path, code: str, folder: Path) -> str:
    """What a program prints in an environment, run outside of the repository."""
    run = [str(python), "-c", code]
    return subprocess.run(run, cwd=folder, check=True, capture_output=True, text=True).stdout


def command(python: Path, *given_arguments: str) -> tuple[int, str, float]:
    """Exit status, output and seconds of a `dftfs` command; the quickest of five runs of it."""
    timing = (
        "import subprocess, sys, time\nbest = 99.0\n"
        "for _ in range(5):\n    start = time.perf_counter()\n"
        "    done = subprocess.run(sys.argv[1:], capture_output=True, text=True)\n"
        "    best = min(best, time.perf_counter() - start)\n"
        "print(done.returncode, best)\nprint(done.stdout + done.stderr)"
    )
    program = str(python.with_name("dftfs"))
    run = [sys.executable, "-c", timing, program, *given_arguments]
    with tempfile.TemporaryDirectory() as folder:
        output = subprocess.run(run, cwd=folder, check=True, capture_output=True, text=True).stdout
    head, _, text = output.partition("\n")
    status, seconds = head.split()
    return int(status), text.strip(), float(seconds)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "wheels")
    parser.add_argument("--no-try", action="store_true", help="build only")
    arguments = parser.parse_args()
    missed = 0

    def say(what: str, value: float, most: float, unit: str) -> None:
        nonlocal missed
        missed += value > most
        verdict = "pass" if value <= most else "FAIL"
        print(f"{verdict}  {what}: {value:.3g} {unit} (at most {most:g} {unit})", flush=True)

    core, whole = (build(name, arguments.out.resolve()) for name in ("rsea-core", "dftfs"))
    for wheel in (core, whole):
        say(f"wheel {wheel.name}", wheel.stat().st_size / 1e6, MOST_WHEEL_MB, "MB")
    if arguments.no_try:
        return int(missed > 0)
    with tempfile.TemporaryDirectory() as folder:
        alone = Path(folder) / "alone"
        python = environment(alone, [core])
        say("environment with rsea-core alone", megabytes(alone), MOST_ENVIRONMENT_MB, "MB")
        print(f"      of that rsea_core itself: {megabytes(alone, 'rsea_core'):.1f} MB")
        torque = float(printed(python, SIMULATE, alone))
        print(f"torque at the end of a simulated second, rsea-core alone: {torque:.4f} Nm")
        seconds = import_seconds(python, "numpy", "rsea_core")
        say("import rsea_core after numpy", seconds, MOST_SECONDS, "s")
        seconds = import_seconds(python, "numpy", "rsea_core.simulation.simulate")
        print(f"      what a first simulation then loads, with scipy and numba: {seconds:.2f} s")
        python = environment(Path(folder) / "both", [whole])
        status, text, seconds = command(python, "--help")
        say(f"dftfs --help (exit status {status})", seconds + 99 * (status != 0), MOST_SECONDS, "s")
        for given_arguments in (("design", "ref"), ("export", "ref", "--out", "cad")):
            status, text, _ = command(python, *given_arguments)
            print(
                f"dftfs {' '.join(given_arguments)}: exit status {status}: {text.splitlines()[0]}"
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
