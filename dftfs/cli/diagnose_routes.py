"""What `dftfs diagnose` does with each kind of case: a machine that moves, a map, a spring.

Each imports what it needs itself, which saves a second of start-up time.
"""

import argparse
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from dftfs.cli.common import progress, silent
from dftfs.cli.output import now_and_then

if TYPE_CHECKING:
    from rsea_core.effects.registry import SpringCurve
    from rsea_core.recordings.case import Case


class Result(NamedTuple):
    """A diagnosis, ready to be written.

    document : `diagnosis.json`; model_toml : text; shown : makes the report's plain data;
    columns, recording_toml : the next experiment's files, None where there are none;
    remainder : columns of the signal that nothing explains, None where there is none.
    """

    document: dict
    model_toml: str
    shown: Callable[[], dict]
    columns: Mapping | None = None
    recording_toml: str | None = None
    remainder: Mapping | None = None


def moving_machine(case: "Case", arguments: argparse.Namespace) -> Result:
    """Recordings of motions, replayed."""
    from rsea_core.identify.diagnose import diagnose
    from rsea_core.identify.experiment.experiment_file import FILE, as_entry, decisive_experiment
    from rsea_core.identify.result.report_data import report_data

    say = progress() if arguments.verbose else now_and_then(progress())
    found = diagnose(case, quick=arguments.quick, thorough=arguments.thorough, say=say)
    undecided = found.conclusion.verdict == "insufficient-data"
    experiment = None
    if undecided or not arguments.quick:
        experiment = decisive_experiment(found.conclusion)
    return Result(
        document=found.document | {"next_experiment": as_entry(experiment)},
        model_toml=found.model.to_toml(),
        shown=lambda: report_data(found, experiment=experiment, quick=arguments.quick),
        columns=None if experiment is None else experiment.columns,
        recording_toml=None if experiment is None else experiment.recording_toml(FILE),
        remainder=None
        if found.conclusion.residual is None
        else found.conclusion.residual.columns(),
    )


def steady_map(case: "Case", arguments: argparse.Namespace) -> Result:
    """A map of steady speeds."""
    from rsea_core.identify.steady_map.diagnose import diagnose_map

    found = diagnose_map(case)
    return Result(
        document=found.document, model_toml=found.model.to_toml(), shown=lambda: found.report_data,
        columns=found.next_columns,
    )  # fmt: skip


def spring_bench(case: "Case", arguments: argparse.Namespace) -> Result:
    """A spring against its design, from its loops."""
    from rsea_core.identify.spring_bench.diagnose import diagnose_bench
    from rsea_core.identify.spring_bench.next_loop import next_loop
    from rsea_core.identify.spring_bench.report_data import spring_report_data
    from rsea_core.model.model_file import model_to_toml

    say = progress() if arguments.verbose or arguments.fe is not None else silent
    design = None if arguments.fe is None else read_fe(arguments.fe, say)
    conclusion = diagnose_bench(case, design)
    loop = next_loop(conclusion)
    document = conclusion.document() | {"next_experiment": None if loop is None else loop.entry}
    return Result(
        document=document,
        model_toml=model_to_toml(conclusion.model()),
        shown=lambda: spring_report_data(conclusion, document),
        columns=None if loop is None else loop.columns,
        recording_toml=None if loop is None else loop.recording_toml,
    )


def read_fe(name: str, say: Callable[[str], None]) -> "SpringCurve":
    """The curve that a spring should have: of a CSV file, or solved of a design."""
    if name.endswith(".csv"):
        from rsea_core.model.spring_curve_file import read_spring_curve

        return read_spring_curve(name)
    from dftfs.analysis.study.actuator import spring_curve
    from dftfs.analysis.torsion.problem import TorsionProblem
    from dftfs.analysis.torsion.solve import (
        solve_torsion,  # the mesher and the engine take a second
    )
    from dftfs.design import load_design

    design = load_design(name)
    problem = TorsionProblem(design=design, dimension=2)
    say(f"spring {design.name}: {problem.model}")
    return spring_curve(solve_torsion(problem, on_progress=say), f"{design.name}, {problem.model}")
