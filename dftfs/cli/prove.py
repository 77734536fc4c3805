"""`dftfs prove`: cases with concealed effects, blind runs of the diagnosis, scores."""

import argparse
from pathlib import Path

from dftfs.cli.common import progress
from dftfs.proof.making import make
from dftfs.proof.recipes import LEVELS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")
    one = steps.add_parser("make", help="write cases; the labels are sealed by SHA-256")
    one.add_argument("--cases", type=int, default=100)
    one.add_argument("--seed", type=int, required=True, help="draw it after the tool is frozen")
    one.add_argument("--out", type=Path, required=True, metavar="DIR")
    one.add_argument("--levels", nargs="+", choices=LEVELS, default=list(LEVELS))
    one.add_argument("--only", nargs="+", default=[], metavar="EFFECT", help="these effects only")
    one.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    one.set_defaults(go=run_make)


def run_make(arguments: argparse.Namespace) -> int:
    value = make(
        arguments.cases,
        arguments.seed,
        arguments.out,
        levels=tuple(arguments.levels),
        only=tuple(arguments.only),
        jobs=arguments.jobs,
        report=progress(),
    )
    print(f"{arguments.cases} cases in {arguments.out / 'cases'}")
    print(f"labels sealed: SHA-256 {value}")
    return 0


def run(arguments: argparse.Namespace) -> int:
    return arguments.go(arguments)
