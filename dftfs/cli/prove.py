"""`dftfs prove`: validation of the diagnosis: cases with hidden effects, blind runs, scores."""

import argparse
from functools import partial

from dftfs.analysis.jobs.dask_cluster import run_on_cluster
from dftfs.cli.common import emit, progress
from dftfs.cli.prove_arguments import add_make, add_run, add_scores
from dftfs.errors import DftfsError
from dftfs.files import to_json, write_text
from dftfs.proof.baselines.running import run_baselines
from dftfs.proof.judging import judge
from dftfs.proof.labels import MANIFEST
from dftfs.proof.making import make
from dftfs.proof.recipes import LEVELS
from dftfs.proof.running import DIAGNOSE, PREDICT
from dftfs.proof.running import run as run_blind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The steps of a proof."""
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")
    add_make(steps, run_make)
    add_run(steps, run_diagnosis)
    add_scores(steps, run_boxes, run_score)


def run_make(arguments: argparse.Namespace) -> int:
    """Step one; an interrupted run is continued."""
    if arguments.machines == "wide":
        value = make_wide_set(arguments)
    else:
        if arguments.sealed or arguments.truth:
            raise DftfsError("--sealed and --truth go with --machines wide")
        value = make(
            arguments.cases,
            arguments.seed,
            arguments.out,
            levels=tuple(arguments.levels or LEVELS),
            only=tuple(arguments.only),
            jobs=arguments.jobs,
            report=progress(),
        )
    print(f"{arguments.cases} cases in {arguments.out / 'cases'}")
    print(f"labels sealed: SHA-256 {value}")
    return 0


def make_wide_set(arguments: argparse.Namespace) -> str:
    """Cases of any one-axis machine, or of an outsider's generator; returns the seal."""
    from dftfs.proof.wide.making import SHARES, make_wide

    if arguments.only:
        raise DftfsError("--only goes with --machines bench")
    levels = tuple(arguments.levels or SHARES)
    if not set(levels) <= set(SHARES):
        raise DftfsError(f"--levels: wide sets have {', '.join(SHARES)}")
    return make_wide(
        arguments.cases,
        arguments.seed,
        arguments.out,
        sealed=arguments.sealed,
        levels=levels,
        truth=arguments.truth,
        jobs=arguments.jobs,
        report=progress(),
    )


def run_diagnosis(arguments: argparse.Namespace) -> int:
    """Step two; an interrupted run is continued."""
    cluster = partial(run_on_cluster, address=arguments.cluster)
    predict = PREDICT if arguments.tool == DIAGNOSE else ""
    place = run_blind(
        arguments.folder,
        name=arguments.name,
        commands=(arguments.tool, predict if arguments.predict is None else arguments.predict),
        limit=arguments.limit,
        seconds=arguments.seconds,
        jobs=arguments.jobs,
        again=arguments.again,
        runner=cluster if arguments.cluster else None,
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
    if (arguments.folder / MANIFEST).is_file():
        return score_wide(arguments)
    from dftfs.proof.report import goals_table, write_reports  # draws: matplotlib

    found = judge(arguments.folder, arguments.name)
    sealed = f"Labels sealed before the first diagnosis, SHA-256 `{found.seal}`."
    lead, paths = [sealed, "", f"Diagnosis: `{found.commands[0]}`"], []
    if arguments.out is not None:
        paths = write_reports(
            arguments.out, found.summary, found.scores, found.errors, found.wins, lead
        )
        paths.append(write_text(arguments.out / "proof.json", to_json(found.summary)))
    rows = ["  ".join(row) for row in goals_table(found.summary).rows]
    lines = [f"labels: SHA-256 {found.seal}, as sealed", *rows]
    emit(found.summary, "\n".join([*lines, *map(str, paths)]), as_json=arguments.json)
    return 0


def score_wide(arguments: argparse.Namespace) -> int:
    """Step three of a wide set."""
    from dftfs.proof.wide.report import summary_lines, write_wide_report  # draws: matplotlib
    from dftfs.proof.wide.scores import judge_wide

    found = judge_wide(arguments.folder, arguments.name)
    paths = write_wide_report(arguments.out, found) if arguments.out is not None else []
    lines = [*summary_lines(found), *map(str, paths)]
    emit(found.figures, "\n".join(lines), as_json=arguments.json)
    return 0


def run(arguments: argparse.Namespace) -> int:
    """Run one step."""
    return arguments.go(arguments)
