"""`diagnosis.json` and the model of a multistep search."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.files.csv_columns import unit_of
from rsea_core.identify.brief_case import brief_case, with_excerpts
from rsea_core.identify.clamped_loads import with_yielding_clamps
from rsea_core.identify.investigate import investigate
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.gear_mesh import as_effect
from rsea_core.identify.law_search.hold_out import predicts_rest
from rsea_core.identify.law_search.shape_search import Shape
from rsea_core.identify.multistep.command_timing import CommandTiming, RowTimes
from rsea_core.identify.multistep.criteria import FIRST_SHARE, SURE
from rsea_core.identify.multistep.log_nuisances import CLOCK, FILTER, MESH_DAMPER, RATIO
from rsea_core.identify.result.corrected_model import FoundModel, heat_left, rest_of
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.diagnosis_json import corrected_parameters, fit_table, summary
from rsea_core.identify.result.known_values import known_as_terms, known_values
from rsea_core.identify.servo_gains import servo_findings, with_servo_gains
from rsea_core.identify.whole_runs.single_zeros import zeros_of
from rsea_core.identify.whole_runs.stated_form import with_stated_form
from rsea_core.identify.window_verdict import WindowVerdict, unexplained_place
from rsea_core.numeric.work_limit import limited_work
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

QUICK_LOOK = Finding(
    kind=Kind.METHOD,
    text="a quick look: few candidates were fitted; run without --quick before acting on it",
)
EXPLAINS = ("missing-physics", "parameters-only", "no-mismatch")
SHARE_OF_FIRST_ROWS = 0.6  # in place of `FIRST_SHARE`, where long recordings are cut
MOST_WORK = 6e8  # simulated rows of a search, after which it begins nothing further
QUICK_WORK = 2e7  # of a quick look, after which a search ends once it has fitted one candidate
CURTAILED = Finding(
    kind=Kind.METHOD,
    text="the search reached its limit of work: further searches, which could find other laws, were"
    " left out (--thorough has no limit)",
)
OF_THE_LOG = (CLOCK, FILTER, RATIO)
OFFSET_SHOWN = 3.0  # deviations from which an amplifier's offset is stated
NEGLIGIBLE_OFFSET = 1e-4  # of the largest command: a smaller one is not stated
CLOCK_SHOWN = 5.0


def diagnose_windows(
    case: Case, *, quick: bool = False, thorough: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> Diagnosis:  # fmt: skip
    """Locate, name and fit what a case's recordings show and its rig file does not.

    Parameters
    ----------
    thorough : bool
        Without a limit of work (`MOST_WORK`), at which further searches are left out.

    Raises
    ------
    RecordingError
        If nothing in the recordings can be simulated.
    """
    case, filled = with_servo_gains(case)
    case, clamps = with_yielding_clamps(case)
    searched, cut = (case, ()) if thorough else brief_case(case) if quick else with_excerpts(case)
    most_work = np.inf if thorough else QUICK_WORK if quick else MOST_WORK
    with limited_work(most_work, strict=quick) as work:
        searched = with_stated_form(searched, say, quick=quick)
        share = SHARE_OF_FIRST_ROWS if cut else FIRST_SHARE
        found = investigate(searched, quick=quick, first_share=share, say=say)
    conclusion = WindowVerdict(found, searched if quick else case, say)
    if cut and not quick and not (conclusion.verdict in EXPLAINS and predicts_rest(found)):
        say("the rows held out are not explained: searched again with all rows")
        cut = ()
        with limited_work(most_work) as work:
            found = investigate(replace(case, known=searched.known), say=say)
        conclusion = WindowVerdict(found, case, say)
    say(f"work: {work.done:.3g} simulated rows")
    brief = QUICK_LOOK if quick else CURTAILED if work.curtailed else None
    findings = [*cut, *([brief] if brief else [])] + [
        Finding(kind=Kind.METHOD, text=clamp.sentence()) for clamp in clamps
    ]
    findings += findings_of(conclusion) + servo_findings(conclusion, filled)
    laws = _model_laws(conclusion)
    rig, problem = conclusion.rig(), conclusion.problem
    contact = {}
    for p in problem.nominals:
        if p.key.startswith("contact_"):
            value = conclusion.model_values()[0][p.key]
            contact[p.key] = value - p.value if p.additive else value / p.value
    _, values = conclusion.model_values()
    known = known_as_terms(conclusion, conclusion.model_fit.hypothesis, values)
    model = FoundModel(
        rig=rig, terms=known, contact=contact, laws=laws, ambient_C=conclusion.ambient(),
        initial_rises_K=heat_left(problem, laws, rig.terminal_resistance_ohm or 1.0),
        rest_rad=rest_of(problem, laws, rig.spring_stiffness_Nm_per_rad or 0.0),
        command_between_rows="linear" if problem.timing.linear else "held",
    )  # fmt: skip
    return Diagnosis(
        document=document_of(conclusion, findings), model=model, conclusion=conclusion,
        findings=tuple(findings),
    )  # fmt: skip


def _model_laws(conclusion: WindowVerdict) -> tuple:
    """The laws of the model: those found, or the experiment's alone where they were refuted."""
    _, values = conclusion.model_values()
    pairs = zip(map(as_effect, conclusion.model_fit.hypothesis.laws), values, strict=True)
    return tuple((law, found) for law, found in pairs if _kept(law, found))


def _kept(law, values) -> bool:
    """Whether a law belongs into a model: clocks and drifts are the log's, and a zero is none."""
    if law.known or law.effect in OF_THE_LOG or (law.nuisance and law.only is not None):
        return False
    return not law.nuisance or any(value != 0.0 for value in values.values())


def document_of(conclusion: WindowVerdict, findings: Sequence[Finding]) -> dict:
    """`diagnosis.json`."""
    return {
        "schema": 1,
        "verdict": conclusion.verdict,
        "summary": summary(conclusion),
        "location": location_of(conclusion),
        "effects": conclusion.effects(),
        "parameters_corrected": corrected_parameters(conclusion),
        "remainder": unexplained_part_of(conclusion),
        "next_experiment": None,
        "fit": {"recordings": fit_table(conclusion), "innovation_power": power_table(conclusion)},
        "findings": list(sentences(findings)),
    }


def location_of(conclusion: WindowVerdict) -> dict | None:
    """Where most of the mismatch arises."""
    if conclusion.verdict in ("no-mismatch", "parameters-only"):
        return None
    share = conclusion.explained_excess()
    if conclusion.unknown is not None:
        place = place_of_unknown(conclusion.found, conclusion.unknown)
    elif conclusion.found.steps or conclusion.verdict == "unexplained":
        place = unexplained_place(conclusion)
    else:
        place, share = conclusion.effects()[0]["subsystem"], 1.0
    return {
        "subsystem": place,
        "signal": largest_channel(conclusion),
        "where": conclusion.mismatched_recordings(),
        "share_of_mismatch": round(share, 3),
    }


def place_of_unknown(found: Found, unknown: Shape) -> str:
    """The place of an unknown torque; that of the first law, if the law gains more."""
    remains = any(s is unknown for s in found.shapes)  # with the laws that were found
    if found.steps and remains and found.steps[0].gain > unknown.held_out:
        return found.steps[0].law.subsystem
    return unknown.subsystem


def largest_channel(conclusion: WindowVerdict) -> str:
    """The reading in which the parameters leave most."""
    own, base = conclusion.found.estimator, conclusion.found.base
    totals: dict[str, float] = {}
    for t, e in zip(own.tracks, own.innovations([(base.hypothesis, base.x)]), strict=True):
        for j, name in enumerate(t.experiment.channels):
            totals[name] = totals.get(name, 0.0) + float(np.sum(e[0, :, j] ** 2))
    return max(totals, key=totals.get)


def unexplained_part_of(conclusion: WindowVerdict) -> dict | None:
    """What no effect explains, in words; None where nothing is left."""
    if conclusion.verdict != "unexplained":
        return None
    known = {"where": (location_of(conclusion) or {}).get("subsystem")}
    shape = conclusion.unknown
    if shape is None and conclusion.uneven is not None:
        return known | {
            "words": f"{conclusion.uneven.law.key} predicts better in a few stretches of the"
            " recordings only: something acts there that it is not"
        }
    if shape is None and conclusion.formula is not None:
        return known | formula_report(conclusion) | {"words": conclusion.formula.sentence()}
    if conclusion.reason is not None:
        return known | {"words": conclusion.reason}
    if shape is None and conclusion.unpredicted:
        return known | {"words": "the model found predicts nothing: something acts without a name"}
    if shape is None and conclusion.no_further:
        return known | {
            "words": f"{conclusion.found.steps[0].law.key} predicts better only in the windows"
            " that it was fitted in: something acts that it is not"
        }
    if shape is None and not conclusion.refuted:
        return known | {
            "words": "the laws found explain a part, unevenly: something acts that they are not"
        }
    if shape is None:
        return known | {
            "words": "the laws found do worse than parameters alone on recordings held out"
        }
    unit = "V" if shape.port == "V" else "Nm"
    return (
        known
        | formula_report(conclusion)
        | {
            "words": shape.sentence() + _by_formula(conclusion),
            "depends_on": shape.signal,
            "opposes_motion": shape.friction,
            "nodes": [float(v) for v in shape.nodes],
            f"values_{unit}": [float(v) for v in shape.values],
        }
    )


def _by_formula(conclusion: WindowVerdict) -> str:
    if conclusion.formula is not None:
        return f"; {conclusion.formula.text()}"
    if conclusion.found.steps:
        return ""
    return (
        "; no sum of three terms of the library (powers and waves of the angle times powers of"
        " the speed) was confirmed for it"
    )


def formula_report(conclusion: WindowVerdict) -> dict:
    """The formula of what has no name as data; empty where there is none."""
    return {} if conclusion.formula is None else {"formula": conclusion.formula.report()}


def power_table(conclusion: WindowVerdict) -> dict:
    """Mean squared innovations of the fitted recordings, each fit in its own noise."""
    return {
        "files": [b.recording.file for b in conclusion.problem.fitted],
        "parameters_only": [round(float(p), 3) for p in conclusion.search.parameters.msni],
        "after": [round(float(p), 3) for p in conclusion.fit.msni],
    }


def findings_of(conclusion: WindowVerdict) -> list[Finding]:
    """What else is worth knowing: of the experiment, of values far off, of the files."""
    found = [f for f in conclusion.recorded.notes() if f.kind is not Kind.RESAMPLED]
    found += [f for f in data_warnings(conclusion.recorded) if conclusion.stands(f)]
    std, at = conclusion.spread.std, len(conclusion.problem.nominals)
    for law, values in zip(conclusion.fit.hypothesis.laws, conclusion.laws, strict=True):
        count = sum(p.scale > 0.0 for p in law.unknowns)
        if law.nuisance and not law.known and count == 1:
            ((_, value),) = values.items()
            size = std[at] * law.unknowns[0].scale
            text = _nuisance_text(law, value, size, _span(conclusion))
            if text and abs(value) > (CLOCK_SHOWN if law.effect == CLOCK else OFFSET_SHOWN) * size:
                found.append(Finding(kind=Kind.METHOD, text=text))
        at += count
    found += _timing_findings(conclusion.problem.timing)
    found += _zeros(conclusion)
    meshes = any(law.effect == MESH_DAMPER for law in conclusion.fit.hypothesis.laws)
    if meshes:
        stiffness = conclusion.nominal["spring_stiffness_Nm_per_rad"]
        text = (
            "motor and load angle disagree, and the rig file has no spring between them: the gear's"
            f" mesh is modelled as a spring ({stiffness:.3g} Nm/rad) with a damper"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    for j, p in enumerate(conclusion.problem.nominals):
        if meshes and p.key == "spring_stiffness_Nm_per_rad":
            continue  # no value of the file
        moved = abs(conclusion.fit.x[j])
        if moved > SURE and moved > 2.0 * std[j]:
            text = (
                f"{p.key} ended {moved:.1f} of its tolerances from the rig file's"
                f" value ({p.value:.4g} -> {conclusion.nominal[p.key]:.4g}): is the file right?"
            )
            found.append(Finding(kind=Kind.METHOD, text=text))
    found += [
        Finding(
            kind=Kind.METHOD,
            text=f"{v.key} ended {abs(v.moved):.1f} of its tolerances from the rig file's value"
            f" ({v.stated:.4g} -> {v.found:.4g} {v.unit}): is the file right?",
        )
        for v in known_values(conclusion)
        if abs(v.moved) > max(SURE, 2.0 * v.unsure)
    ]
    found += [Finding(kind=Kind.METHOD, text=text) for text in _fitted_of_held_out(conclusion)]
    if conclusion.unknown_torque is not None:
        text = f"the model leaves {conclusion.unknown_torque}: smaller effects cannot be detected"
        found.append(Finding(kind=Kind.METHOD, text=text))
    horizon = conclusion.found.horizon
    if horizon is not None:
        seconds = [horizon * t.scale.time_s for t in conclusion.estimator.tracks]
        text = (
            f"predictable for {max(seconds):.3g} s at a time: over longer runs the simulation"
            " leaves the recordings, and laws were judged in windows of that length"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    return found


def _timing_findings(timing: CommandTiming) -> list[Finding]:
    """How the commands and rows of the logs are simulated, where it is not as the log has them."""
    texts = []
    if timing.rows is not RowTimes.LOGGED:
        texts.append(
            "the time stamps of these logs are uneven: they are the times of"
            f" {timing.rows}; the simulation uses this"
        )
    if timing.smooth:
        texts.append(
            "commands in the log do not act as logged, as if their loop ran faster than the log"
            " and a row held one of several commands; the simulation uses smoothed commands. With"
            " them, an unknown torque is no evidence of missing physics: log the mean command of"
            " each row"
        )
    elif timing.linear:
        texts.append("the command moves linearly from row to row of these logs; it is simulated so")
    return [Finding(kind=Kind.METHOD, text=text) for text in texts]


def _zeros(conclusion: WindowVerdict) -> list[Finding]:
    """Zeros that one recording alone has."""
    fit, found = conclusion.fit, []
    for file, column, size in zeros_of(conclusion.estimator, fit.hypothesis, fit.x):
        text = (
            f"the zero of {column} differs by {size:.3g} {unit_of(column)} in this recording alone;"
            " the simulation allows for it"
        )
        found.append(Finding(kind=Kind.METHOD, text=text, file=file, column=column))
    return found


def _fitted_of_held_out(conclusion: WindowVerdict) -> list[str]:
    """What was taken from recordings held out, a sentence each."""
    found = [
        f"{file}: its first two thirds were fitted, for {why}; the last third stayed held out"
        for file, why in conclusion.found.shared.items()
    ]
    pauses = [v["pause_s"] for v in conclusion.laws if "pause_s" in v]
    if not conclusion.found.pause_shown:
        pauses = []
    return found + [
        f"the pause of the motor before the recordings held out, about {pause_s:.0f} s, was"
        " estimated from them, and nothing else was"
        for pause_s in pauses
    ]


def _span(conclusion: WindowVerdict) -> float:
    """Largest command of all recordings, in its unit."""
    recordings = [r for r in conclusion.case.recordings if r.command_name is not None]
    return max((float(np.max(np.abs(r[r.command_name]))) for r in recordings), default=0.0)


def _nuisance_text(law, value: float, std: float, span: float) -> str:
    """What a nuisance's value says; nothing of a negligible one.

    span : largest command
    """
    if law.nuisance and law.only is not None:
        return f"the amplifier offset drifts by {value:.2g} +- {std:.1g} per second in {law.only}"
    if law.kind is DriveOffset:
        if abs(value) < NEGLIGIBLE_OFFSET * span:
            return ""
        return f"the drive adds {value:.3g} +- {std:.1g} to every command (amplifier offset)"
    if law.kind is DriveDelay:
        return f"the command acts {value * 1e3:.3g} +- {std * 1e3:.1g} ms late"
    if law.effect == CLOCK:
        return (
            f"the clock of {law.sensor} runs {value * 1e6:.0f} +- {std * 1e6:.0f} ppm off the"
            " command's"
        )
    return ""
