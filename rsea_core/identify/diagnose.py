"""One call from a case to its diagnosis: of a spring's bench, a map of steady speeds, a machine.

`diagnose` is what `dftfs diagnose` calls. A machine that moves (`diagnose_machine`) is diagnosed by
free runs on the bench, by windows anywhere else. Free runs over whole recordings say most where the
machine holds them: the bench, with a duty to a bridge, every sensor and rows of a millisecond
(`is_bench`). Everywhere else laws are judged by predictions over windows with estimated starts and
an estimated noise (`multistep`). Where that leaves dependent innovations or finds no name - no law
fits the machine quite - free runs are a second opinion, and the diagnosis whose model predicts
clearly better is taken (`_better`). On the bench windows are asked in the same way where free runs
find no name, names that leave much, or one that an amplifier's offset imitates: free runs do not
model the errors of a log.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.registry import SpringCurve
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.errors import InputError, RecordingError, RseaError
from rsea_core.files.text_files import as_plain
from rsea_core.identify.experiment.experiment_file import FILE, as_entry, decisive_experiment
from rsea_core.identify.free_run_diagnosis import diagnose_free_runs
from rsea_core.identify.multistep.criteria import (
    DOUBTED_SHARE,
    EXPLAINED,
    NEEDS_NO_WINDOWS,
    NO_PREDICTION,
)
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.report_data import report_data
from rsea_core.identify.spring_bench.diagnose import is_spring_bench
from rsea_core.identify.static_diagnosis import (
    diagnose_spring_bench,
    diagnose_steady_map,
    require_spring_bench,
)
from rsea_core.identify.steady_map.points import is_steady_map
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.numeric.threads import on_one_blas_thread
from rsea_core.recordings.case import Case, read_case
from rsea_core.recordings.finding import Finding, Kind

BENCH_ROW_s = 2.5e-3
BENCH_RATIO = 20.0
BENCH_COLUMNS = ("motor_angle_rad", "load_angle_rad")
BETTER = 0.95  # free-run error over the other's, fitted and held-out recordings with equal weight
LIKE_AN_OFFSET = frozenset((LoadUnbalance.effect, SensorOffset.effect))
SHORT_LOG = 20_000  # rows fitted: of more, windows would take many minutes
PREDICTED = 0.02  # of the spread of recordings held out: no other search is needed below
NEAREST_NAME = 0.1  # confidence of a name that is only the nearest to what was seen
TERMS_UNUSED = Finding(
    kind=Kind.METHOD,
    text="the [[term]] tables of the rig file are not used: this method finds such laws by itself",
)
WINDOWS_FAILED = Finding(
    kind=Kind.METHOD,
    text="the search in windows failed numerically; laws were judged by free runs of whole"
    " recordings instead, which is less reliable for this machine; please report the case",
)


def diagnose(
    case: Case | str | Path,
    *,
    quick: bool = False,
    thorough: bool = False,
    design: SpringCurve | None = None,
    next_experiment: bool | None = None,
    say: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Say where recordings and rig file differ, which physics is missing, with what confidence.

    As `dftfs diagnose`: of a spring on its bench, of a map of steady speeds or of a machine that
    moves; which of these, the recordings say.

    Parameters
    ----------
    case : Case or path
        As `read_case` makes it, or its folder.
    quick : bool
        Fewer fits of fewer rows: a quick look, not to be acted on.
    thorough : bool
        Finer steps and no limit of work.
    design : SpringCurve or None
        Of a spring on its bench: the curve that it should have (`read_spring_curve`).
    next_experiment : bool or None
        Whether to compute, of a machine that moves, what to record next (seconds). None: not in a
        quick look. One that the verdict `insufficient-data` rests on is there in any case.
    say : callable or None
        Given a line now and then while it works.

    Raises
    ------
    RecordingError, RigError
        If the case breaks the file contract, or nothing in the recordings can be simulated.
    InputError
        If quick and thorough are both asked for, or a design is given and no spring is measured.
    """
    if quick and thorough:
        raise InputError("diagnose: quick and thorough exclude one another")
    say = say or _silent
    if not isinstance(case, Case):
        case = read_case(case, say)
    if design is not None:
        require_spring_bench(case, "diagnose: design")
    if is_spring_bench(case) or is_steady_map(case):
        spring = is_spring_bench(case)
        found = diagnose_spring_bench(case, design) if spring else diagnose_steady_map(case)
        found = found.having(TERMS_UNUSED) if case.known else found
    else:
        found = diagnose_machine(case, quick=quick, thorough=thorough, say=say)
        wanted = not quick if next_experiment is None else next_experiment
        found = _complete(found, wanted=wanted, quick=quick)
    return replace(found, document=as_plain(found.document))


def _silent(message: str) -> None:
    """Say nothing."""


def _complete(found: Diagnosis, *, wanted: bool, quick: bool) -> Diagnosis:
    """A machine's diagnosis with its next experiment, unexplained signal and report."""
    asked = wanted or found.verdict == "insufficient-data"
    experiment = decisive_experiment(found.conclusion) if asked else None
    residual = found.conclusion.residual
    return replace(
        found,
        document=found.document | {"next_experiment": as_entry(experiment)},
        next_columns=None if experiment is None else experiment.columns,
        next_recording=None if experiment is None else experiment.recording_toml(FILE),
        unexplained_columns=None if residual is None else residual.columns(),
        report_data=partial(report_data, found, experiment=experiment, quick=quick),
    )


def is_bench(case: Case) -> bool:
    """Whether the case is of the bench that free runs are made for."""
    rig = case.rig
    if case.known:  # free runs begin with laws that they choose
        return False
    whole = all(rig.has(part) for part in ("drive", "gear", "spring", "load"))
    return (
        whole
        and rig.axis != "linear"
        and (rig.gear_ratio or 1.0) >= BENCH_RATIO
        and all(_is_of_bench(r) for r in case.recordings if not r.quasi_static)
    )


def _is_of_bench(r) -> bool:
    """Whether a recording has the bench's command, sensors and even rows."""
    sensors = all(name in r for name in BENCH_COLUMNS)
    fast = r.sample_time_s <= BENCH_ROW_s and r.logged is None
    return r.command_name == "duty" and sensors and fast and r.initial_rest


@on_one_blas_thread
def diagnose_machine(
    case: Case,
    *,
    quick: bool = False,
    thorough: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Locate, name and fit what recordings of a moving machine show and its rig file does not.

    Raises
    ------
    RecordingError
        If nothing in the recordings can be simulated.
    """
    if all(r.quasi_static for r in case.identification):
        raise RecordingError(
            f"{case.name}: only quasi-static recordings, nothing to replay: a spring's loops need"
            " torque_Nm against spring_deflection_rad (or two angles), a map of steady speeds needs"
            " motor_velocity_rad_per_s"
        )
    if is_bench(case):
        found = diagnose_free_runs(case, quick=quick, thorough=thorough, say=say)
        if not quick and (_leaves_much(found) or _may_be_an_offset(case, found)):
            say("laws leave much, or an offset imitates one: a second opinion by windows")
            other = diagnose_windows(case, thorough=thorough, say=say)
            if other.conclusion.found.complete:
                return other
            unnamed = case.validation and found.document["verdict"] == "unexplained"
            return _better(found, lambda: other, say) if unnamed else found
        if quick or not case.validation or found.document["verdict"] != "unexplained":
            return found
        say("no name fits: a second opinion by windows, which model the errors of the log")
        return _better(found, lambda: diagnose_windows(case, thorough=thorough, say=say), say)
    try:
        found = diagnose_windows(case, quick=quick, thorough=thorough, say=say)
    except (np.linalg.LinAlgError, FloatingPointError) as numeric:
        say(f"windows: {numeric}; free runs instead")
        try:
            found = diagnose_free_runs(case, quick=quick, thorough=thorough, say=say)
            found = found.having(WINDOWS_FAILED)
            return found.having(TERMS_UNUSED) if case.known else found
        except np.linalg.LinAlgError as again:
            text = f"{case.name}: no machine of rig.toml can be fitted to these recordings: {again}"
            raise RecordingError(text) from again
    if quick or case.known or not case.validation or not _is_doubtful(found):
        return found  # free runs do not have the laws that a rig file states
    say("innovations stay dependent, or nothing is named: a second opinion by free runs")
    return _better(found, lambda: diagnose_free_runs(case, thorough=thorough, say=say), say)


def _leaves_much(found: Diagnosis) -> bool:
    """Whether laws named by free runs leave a large share of what parameters leave."""
    named = found.document["verdict"] == "missing-physics"
    return named and found.conclusion.explained_excess() < EXPLAINED


def _may_be_an_offset(case: Case, found: Diagnosis) -> bool:
    """Whether an amplifier's offset, which free runs do not model, imitates a law that they name.

    A constant torque of the drive is an eccentric mass over a small angle, and behind a spring a
    zero error of an angle.
    """
    rows = sum(r.time_s.size for r in case.identification)
    named = {effect["name"] for effect in found.document["effects"]}
    return rows <= SHORT_LOG and not LIKE_AN_OFFSET.isdisjoint(named)


def _better(first: Diagnosis, second: Callable[[], Diagnosis], say) -> Diagnosis:
    """The second where it predicts clearly better, else the first.

    Recordings fitted and recordings held out count alike: the friction of one machine differs
    from recording to recording, so few recordings held out do not judge alone (EMPS).
    """
    try:
        other = second()
    except (RseaError, np.linalg.LinAlgError, FloatingPointError) as refused:
        say(f"no second opinion: {refused}")
        return first
    mine, theirs = (
        float(np.sqrt(held_out_error(d) * free_run_error(d, role="identification")))
        for d in (first, other)
    )
    say(f"error of free runs: first {mine:.3g}, second {theirs:.3g} of the recordings' spread")
    verdicts = tuple(d.document["verdict"] for d in (first, other))
    if verdicts == ("missing-physics", "unexplained"):
        return first  # a law with a name is no worse for a table that predicts better
    if theirs > NO_PREDICTION:
        return first  # nothing holds the machine where free runs begin: no opinion
    own = held_out_error(other, "parameters_only")  # the same where it names no law
    if not (theirs < BETTER * mine and held_out_error(other) <= own):
        return first
    return with_disagreement(other, first)


def with_disagreement(chosen: Diagnosis, other: Diagnosis) -> Diagnosis:
    """The chosen diagnosis with a note on what the other method found and this one does not have.

    A law that one of two methods fits must not disappear without a word; a nearest name may.
    """
    named = {effect["name"] for effect in chosen.document["effects"]}
    lost = [
        e for e in other.document["effects"]
        if e["name"] not in named and e["confidence"] > NEAREST_NAME
    ]  # fmt: skip
    if not lost:
        return chosen
    laws = " and ".join(f"{e['name']} ({e['law']})" for e in lost)
    text = (
        f"two methods disagree: the other one found {laws}, but its model predicts whole recordings"
        " less well; this model does not include it"
    )
    return chosen.having(Finding(kind=Kind.METHOD, text=text))


def _is_doubtful(found: Diagnosis) -> bool:
    """Whether laws leave dependent innovations or have no name, and predict less well.

    Complete laws (docs/diagnosis-search.md 10.4) are in no doubt. Laws found with an elastic gear
    mesh cannot be compared with free runs, which do not model it.
    """
    search = found.conclusion.found
    meshed = any(law.effect == MESH_DAMPER for law in search.best.hypothesis.laws)
    if meshed or (search.complete and search.explained > NEEDS_NO_WINDOWS):
        return False
    dependent = found.conclusion.estimator.tempering < DOUBTED_SHARE
    unnamed = found.document["verdict"] == "unexplained"
    return (dependent or unnamed) and held_out_error(found) > PREDICTED


def held_out_error(found: Diagnosis, fit: str = "after") -> float:
    """Geometric mean of the free-run errors on the recordings held out, over their spread."""
    return free_run_error(found, fit, "validation")


def free_run_error(found: Diagnosis, fit: str = "after", role: str = "validation") -> float:
    """Geometric mean of the free-run errors on the recordings of a role, over their spread."""
    rows = found.document["fit"]["recordings"]
    errors = [row[f"nrmse_{fit}"] for row in rows if row["role"] == role]
    if not errors or not np.all(np.isfinite(errors)):
        return np.inf
    return float(np.exp(np.mean(np.log(np.maximum(errors, 1e-9)))))
