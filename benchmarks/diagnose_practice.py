"""Diagnose every case of a folder and score the diagnoses.

    python benchmarks/diagnose_practice.py CASES --out DIR [--only NAME ...] [--quick]
        [--score SCORE.py --labels LABELS.json --hidden HIDDEN]

A case that has its files in DIR already is not run again, so an interrupted run can be continued.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path


def diagnose(case: Path, out: Path, quick: bool) -> float:
    """Seconds that the diagnosis of one case took; predictions are written too."""
    began = time.perf_counter()
    given_arguments = [
        "diagnose",
        str(case),
        "--out",
        str(out),
        "--force",
        *(["--quick"] if quick else []),
    ]
    subprocess.run([sys.executable, "-m", "dftfs", *given_arguments], check=False)
    took = time.perf_counter() - began
    if (out / "model.toml").exists() and (case / "test").is_dir():
        given_arguments = ["predict", str(out / "model.toml"), str(case / "test")]
        given_arguments += ["--out", str(out / "prediction.csv")]
        subprocess.run([sys.executable, "-m", "dftfs", *given_arguments], check=False)
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--score", type=Path)
    parser.add_argument("--labels", type=Path)
    parser.add_argument("--hidden", type=Path)
    arguments = parser.parse_args()
    for case in sorted(arguments.cases.iterdir()):
        wanted = not arguments.only or case.name in arguments.only
        if wanted and not (arguments.out / case.name / "diagnosis.json").exists():
            took = diagnose(case, arguments.out / case.name, arguments.quick)
            print(f"{case.name}: {took:.0f} s", flush=True)
    if arguments.score:
        given_arguments = ["--labels", arguments.labels, "--hidden", arguments.hidden]
        given_arguments += ["--diagnoses", arguments.out, "--predictions", arguments.out]
        subprocess.run([sys.executable, arguments.score, *map(str, given_arguments)], check=False)


if __name__ == "__main__":
    main()
