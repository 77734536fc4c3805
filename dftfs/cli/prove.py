"""`dftfs prove`: validation of the diagnosis: cases with hidden effects, blind runs, scores."""

import argparse
from pathlib import Path

from dftfs.cli.common import emit, progress
from dftfs.files import to_json, write_text
from dftfs.proof.baselines.running import run_baselines
from dftfs.proof.judging import judge
from dftfs.proof.making import make
from dftfs.proof.recipes import LEVELS
from dftfs.proof.running import DIAGNOSE, PREDICT
from dftfs.proof.running import run as run_blind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The steps of a proof."""
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")
    one = steps.add_parser("make", help="write cases; their labels are sealed by SHA-256")
    one.add_argument(
        "--cases", "--count", type=int, default=100, metavar="N", help="how many (default 100)"
    )
    one.add_argument(
        "--machines",
        choices=("bench", "wide"),
        default="bench",
        help="siblings of the bench, or any one-axis machine (default bench)",
    )
    one.add_argument(
        "--sealed", type=Path, metavar="DIR", help="wide: folder of the answers (OUT_sealed)"
    )
    one.add_argument(
        "--truth",
        metavar="COMMAND",
        help="wide: another generator, run with {seed}, {case} and {hidden} filled in",
    )
    one.add_argument(
        "--seed", type=int, required=True, metavar="N", help="draw it after the tool is frozen"
    )
    one.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder of the set, new or begun"
    )
    one.add_argument(
        "--levels",
        nargs="+",
        choices=LEVELS,
        default=list(LEVELS),
        metavar="LEVEL",
        help=f"kinds of cases, of {', '.join(LEVELS)} (default all)",
    )
    one.add_argument("--only", nargs="+", default=[], metavar="EFFECT", help="only these effects")
    one.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (default 1)")
    one.set_defaults(go=run_make)
    two = steps.add_parser("run", help="diagnose every case in a process that sees only the case")
    add_run(two)
    two.add_argument("--limit", type=int, metavar="N", help="run at most N cases now")
    two.add_argument(
        "--seconds", type=float, default=900.0, metavar="S", help="limit of one case (default 900)"
    )
    two.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="processes at a time (default 1)"
    )
    two.add_argument(
        "--diagnose", default=DIAGNOSE, metavar="COMMAND", help=f"diagnosis ('{DIAGNOSE}')"
    )
    two.add_argument(
        "--predict", default=PREDICT, metavar="COMMAND", help=f"prediction ('{PREDICT}')"
    )
    two.set_defaults(go=run_diagnosis)
    boxes = steps.add_parser("baselines", help="fit black-box models to the same recordings")
    boxes.add_argument("folder", type=Path, metavar="DIR", help="a set that `make` wrote")
    boxes.set_defaults(go=run_boxes)
    three = steps.add_parser("score", help="check the seal, score, write the report")
    add_run(three)
    three.add_argument("--out", type=Path, metavar="DIR", help="folder for proof.md, proof.html")
    three.add_argument("--json", action="store_true", help="print the figures as JSON")
    three.set_defaults(go=run_score)


def add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="a set that `make` wrote")
    parser.add_argument("--name", default="diagnosis", help="name of the run inside DIR/runs")


def run_make(arguments: argparse.Namespace) -> int:
    """Step one; an interrupted run is continued."""
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


def run_diagnosis(arguments: argparse.Namespace) -> int:
    """Step two; an interrupted run is continued."""
    place = run_blind(
        arguments.folder,
        name=arguments.name,
        commands=(arguments.diagnose, arguments.predict),
        limit=arguments.limit,
        seconds=arguments.seconds,
        jobs=arguments.jobs,
        report=progress(),
    )
    print(place)
    return 0


def run_boxes(arguments: argparse.Namespace) -> int:
    """The baselines' held-out errors, for step three."""
    print(run_baselines(arguments.folder, report=progress()))
    return 0


def run_score(arguments: argparse.Namespace) -> int:
    """Step three."""
    from dftfs.proof.report import goals_table, write_reports  # draws: matplotlib

    found = judge(arguments.folder, arguments.name)
    lead = [f"Labels sealed before the first diagnosis, SHA-256 `{found.seal}`.", ""]
    lead += [f"Diagnosis: `{found.commands[0]}`"]
    paths = []
    if arguments.out is not None:
        paths = write_reports(
            arguments.out, found.summary, found.scores, found.errors, found.wins, lead
        )
        paths.append(write_text(arguments.out / "proof.json", to_json(found.summary)))
    lines = [f"labels: SHA-256 {found.seal}, as sealed"]
    lines += ["  ".join(row) for row in goals_table(found.summary).rows]
    emit(found.summary, "\n".join([*lines, *map(str, paths)]), as_json=arguments.json)
    return 0


def run(arguments: argparse.Namespace) -> int:
    """Run one step."""
    return arguments.go(arguments)
