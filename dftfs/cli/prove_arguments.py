"""The arguments of `dftfs prove`: make, run, baselines, and score or report."""

import argparse
from collections.abc import Callable
from pathlib import Path

from dftfs.proof.recipes import LEVELS
from dftfs.proof.running import DIAGNOSE, PREDICT

Go = Callable[[argparse.Namespace], int]


def add_make(steps, go: Go) -> None:
    """Step one."""
    one = steps.add_parser("make", help="write cases; their labels are sealed by SHA-256")
    one.add_argument(
        "--cases",
        "--count",
        type=int,
        default=100,
        metavar="N",
        help="number of cases (default 100)",
    )
    one.add_argument(
        "--seed", type=int, required=True, metavar="N", help="choose it after the code is final"
    )
    one.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder of the set, new or incomplete",
    )
    one.add_argument(
        "--machines",
        choices=("bench", "wide"),
        default="bench",
        help="variants of the bench, or any one-axis machine (default bench)",
    )
    one.add_argument(
        "--levels",
        nargs="+",
        choices=LEVELS,
        metavar="LEVEL",
        help=f"kinds of cases, of {', '.join(LEVELS)} (default all; confounded, poor: bench only)",
    )
    one.add_argument(
        "--only", nargs="+", default=[], metavar="EFFECT", help="bench: only these effects"
    )
    one.add_argument(
        "--sealed", type=Path, metavar="DIR", help="wide: folder of the answers (OUT_sealed)"
    )
    one.add_argument(
        "--truth",
        metavar="COMMAND",
        help="wide: another generator, called for each case with {seed}, {case}, {hidden}",
    )
    one.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (default 1)")
    one.set_defaults(go=go)


def add_run(steps, go: Go) -> None:
    """Step two."""
    two = steps.add_parser("run", help="diagnose every case in a process that sees only the case")
    add_set(two)
    two.add_argument("--limit", type=int, metavar="N", help="run at most N cases now")
    two.add_argument(
        "--seconds", type=float, default=900.0, metavar="S", help="limit of one case (default 900)"
    )
    two.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="processes at a time (default 1)"
    )
    two.add_argument("--cluster", metavar="ADDRESS", help="run on a Dask cluster instead")
    two.add_argument(
        "--again", action="store_true", help="repeat cases that crashed or ran out of time"
    )
    two.add_argument(
        "--tool",
        "--diagnose",
        dest="tool",
        default=DIAGNOSE,
        metavar="COMMAND",
        help=f"writes {{out}}/diagnosis.json for {{case}} ('{DIAGNOSE}')",
    )
    two.add_argument("--predict", metavar="COMMAND", help=f"prediction; '' for none ('{PREDICT}')")
    two.set_defaults(go=go)


def add_scores(steps, boxes: Go, score: Go) -> None:
    """Step three."""
    one = steps.add_parser("baselines", help="fit black-box models to the same recordings")
    one.add_argument("folder", type=Path, metavar="DIR", help="a set that `make` wrote")
    one.set_defaults(go=boxes)
    three = steps.add_parser(
        "score", aliases=["report"], help="check the seal, score, write the report"
    )
    add_set(three)
    three.add_argument("--out", type=Path, metavar="DIR", help="folder for proof.md, proof.html")
    three.add_argument("--json", action="store_true", help="print the figures as JSON")
    three.set_defaults(go=score)


def add_set(parser: argparse.ArgumentParser) -> None:
    """A set and a run in it."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a set that `make` wrote")
    parser.add_argument("--name", default="diagnosis", help="name of the run inside DIR/runs")
