"""The next experiment of a diagnosis: its two nearest explanations as rivals."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from rsea_core.engines.fixed_step.replay import Numbers, Replay
from rsea_core.errors import RseaError
from rsea_core.identify.experiment.next_experiment import (
    DECIDES,
    OPTIONAL,
    BenchLimits,
    NextExperiment,
    Rival,
    next_experiment,
)
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording, Problem
from rsea_core.recordings.case import Case

MARGIN = 1.2  # how far beyond what was recorded an experiment may go
NEAR = 40.0  # log-likelihood units: rivals further behind are out of the question
QUICK = ("triangle", "multisine", "sine-pair", "steps", "hold")
FILE = "next.csv"


class Judged(Protocol):
    """What an experiment needs of a conclusion."""

    case: Case
    problem: Problem
    fit: Fit
    verdict: str
    question: Any  # `insufficient.OpenQuestion` or None; that module needs this one

    def rivals(self) -> Sequence[tuple[Fit, float]]:
        """Fits that name other effects, and log-likelihood units behind the best."""


def rivals_of(conclusion: Judged) -> tuple[Fit, Fit] | None:
    """The chosen explanation and the nearest other one; parameters alone where there is none."""
    others = [f for f, gap in conclusion.rivals() if gap < NEAR]
    if conclusion.verdict in ("no-mismatch", "parameters-only"):
        return None
    if others:
        return conclusion.fit, others[0]
    return None


def experiment_of(conclusion: Judged, fits: tuple[Fit, Fit]) -> NextExperiment | None:
    """The experiment that separates two fits; None where the menu has none."""
    case, problem = conclusion.case, conclusion.problem
    command = next((r.command_name for r in case.identification if r.command_name), None)
    contact = next((r.load for r in case.recordings if r.load.kind == "contact"), None)
    columns = {name for r in case.recordings for name in r.responses}
    reached = {
        name: max((float(np.abs(r[name]).max()) for r in case.recordings if name in r), default=0.0)
        for name in ("current_A", "torque_Nm", "load_angle_rad")
    }
    least = 0.0 if case.rig.axis == "linear" and reached["load_angle_rad"] else 0.2
    limits = BenchLimits(
        current_A=case.rig.current_limit_A or MARGIN * reached["current_A"] or np.inf,
        torque_Nm=MARGIN * (reached["torque_Nm"] or _torque(conclusion)) or np.inf,
        load_angle_rad=max(MARGIN * reached["load_angle_rad"], least),
    )
    rivals = tuple(Rival(name=_name(f), numbers=_numbers(problem, f)) for f in fits)
    optional = OPTIONAL if case.rig.has("spring") else ("current_A",)
    try:
        return next_experiment(
            case.rig, rivals, sensors=tuple(columns), command=command or "duty", limits=limits,
            contact=contact, inputs=QUICK, optional=optional,
        )  # fmt: skip
    except RseaError:
        return None


def _name(fit: Fit) -> str:
    """The laws of a fit, without what every hypothesis has of the log's errors."""
    laws = tuple(law for law in fit.hypothesis.laws if not law.nuisance)
    return Hypothesis(laws=laws).key


def decisive_experiment(conclusion: Judged) -> NextExperiment | None:
    """What to record next; None where nothing is open or no experiment would settle it."""
    if conclusion.question is not None:
        return conclusion.question.experiment
    fits = rivals_of(conclusion)
    return None if fits is None else experiment_of(conclusion, fits)


def as_entry(found: NextExperiment | None) -> dict | None:
    """The experiment as `diagnosis.json` has it."""
    if found is None:
        return None
    return {
        "sentence": found.sentence,
        "load": found.load.kind,
        "extra_mass_kg": found.extra_mass_kg,
        "sensors": list(found.best.sensors),
        "file": FILE,
        "rivals": list(found.rivals),
        "predicted_separation": found.best.separation,
    }


def as_page(found: NextExperiment | None) -> dict | None:
    """The experiment as plain data for a report."""
    if found is None:
        return None
    command = next(name for name in found.columns if name != "time_s")
    return {
        "sentence": found.sentence,
        "file": FILE,
        "load": found.best.load,
        "sensors": found.best.sensors,
        "separation": found.best.separation,
        "threshold": DECIDES,
        "rivals": found.rivals,
        "command_label": command.rsplit("_", 1)[0].replace("_", " "),
        "time_s": found.columns["time_s"],
        "command": found.columns[command],
        "signal": found.signal,
        "unit": found.signal.rsplit("_", 1)[-1],
        "predicted": (found.predicted[0], found.predicted[1]),
    }


def _torque(conclusion: Judged) -> float:
    """Largest spring torque of the fitted model over the recordings."""
    most = 0.0
    for prepared in conclusion.problem.fitted:
        machine = conclusion.problem.trial_machine(
            prepared, conclusion.fit.hypothesis, conclusion.fit.x
        )
        out = prepared.replay.run(_packed(machine))
        most = max(most, float(np.abs(out[:, 3]).max()))
    return most


def _numbers(problem: Problem, fit: Fit):
    """What a fit's machine is under any replay: that of the recording with the same load."""

    def numbers(replay: Replay) -> Numbers:
        prepared = _prepared(problem, replay)
        return _packed(problem.trial_machine(prepared, fit.hypothesis, fit.x))

    return numbers


def _prepared(problem: Problem, replay: Replay) -> PreparedRecording:
    same = [b for b in problem.prepared if b.recording.load.kind == replay.load.kind]
    like = (same or problem.prepared)[0]
    where = replace(like.where, kind=replay.load.kind, file="", index=-1, time_s=replay.time_s)
    return replace(like, replay=replay, base=replay.numbers(problem.model), where=where)


def _packed(machine) -> Numbers:
    return Numbers(machine.plant, machine.regions, machine.fx)
