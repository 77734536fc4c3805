"""`diagnosis.json` and the model of a multistep search."""

from collections.abc import Callable, Sequence

import numpy as np

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.identify.clamped_loads import with_yielding_clamps
from rsea_core.identify.law_search.search import investigate
from rsea_core.identify.multistep.command_timing import RowTimes
from rsea_core.identify.multistep.criteria import SURE
from rsea_core.identify.multistep.experiment import CLOCK, FILTER
from rsea_core.identify.result.corrected_model import FoundModel, heat_left, rest_of
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.diagnosis_json import corrected_parameters, fit_table, summary
from rsea_core.identify.servo_gains import servo_findings, with_servo_gains
from rsea_core.identify.window_verdict import WindowVerdict, unexplained_place
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

OF_THE_LOG = (CLOCK, FILTER)
OFFSET_SHOWN = 3.0  # deviations from which an amplifier's offset is worth a word
CLOCK_SHOWN = 5.0


def diagnose_windows(
    case: Case, *, quick: bool = False, say: Callable[[str], None] = lambda _: None
) -> Diagnosis:
    """Locate, name and fit what a case's recordings show and its rig file does not.

    Raises
    ------
    RecordingError
        If nothing in the recordings can be simulated.
    """
    case, filled = with_servo_gains(case)
    case, clamps = with_yielding_clamps(case)
    outcome = WindowVerdict(investigate(case, quick=quick, say=say), case, say)
    findings = [Finding(kind=Kind.METHOD, text=clamp.sentence()) for clamp in clamps]
    findings += findings_of(outcome) + servo_findings(outcome, filled)
    laws = _model_laws(outcome)
    rig, problem = outcome.rig(), outcome.problem
    contact = {}
    for p in problem.nominals:
        if p.key.startswith("contact_"):
            value = outcome.model_values()[0][p.key]
            contact[p.key] = value - p.value if p.additive else value / p.value
    model = FoundModel(
        rig=rig, contact=contact, laws=laws, ambient_C=outcome.ambient(),
        initial_rises_K=heat_left(problem, laws, rig.terminal_resistance_ohm or 1.0),
        rest_rad=rest_of(problem, laws, rig.spring_stiffness_Nm_per_rad or 0.0),
        command_between_rows="linear" if problem.timing.linear else "held",
    )  # fmt: skip
    return Diagnosis(
        document=document_of(outcome, findings), model=model, outcome=outcome,
        findings=tuple(findings),
    )  # fmt: skip


def _model_laws(outcome: WindowVerdict) -> tuple:
    """The laws of the model: those found, or the experiment's alone where they were refuted."""
    _, values = outcome.model_values()
    pairs = zip(outcome.model_fit.hypothesis.laws, values, strict=True)
    return tuple((law, found) for law, found in pairs if _kept(law, found))


def _kept(law, values) -> bool:
    """Whether a law belongs into a model: clocks are the log's, and a zero is none."""
    if law.effect in OF_THE_LOG:
        return False
    return not law.nuisance or any(value != 0.0 for value in values.values())


def document_of(outcome: WindowVerdict, findings: Sequence[Finding]) -> dict:
    """`diagnosis.json`."""
    return {
        "schema": 1,
        "verdict": outcome.verdict,
        "summary": summary(outcome),
        "location": location_of(outcome),
        "effects": outcome.effects(),
        "parameters_corrected": corrected_parameters(outcome),
        "remainder": unexplained_part_of(outcome),
        "next_experiment": None,
        "fit": {"recordings": fit_table(outcome), "innovation_power": power_table(outcome)},
        "findings": list(sentences(findings)),
    }


def location_of(outcome: WindowVerdict) -> dict | None:
    """Where most of the mismatch arises."""
    if outcome.verdict in ("no-mismatch", "parameters-only"):
        return None
    share = outcome.explained_excess()
    if outcome.unknown is not None:
        place = outcome.unknown.subsystem
        if outcome.found.steps and any(s is outcome.unknown for s in outcome.found.shapes):
            place = outcome.found.steps[0].law.subsystem
    elif outcome.found.steps or outcome.verdict == "unexplained":
        place = unexplained_place(outcome)
    else:
        place, share = outcome.effects()[0]["subsystem"], 1.0
    return {
        "subsystem": place,
        "signal": largest_channel(outcome),
        "where": outcome.mismatched_recordings(),
        "share_of_mismatch": round(share, 3),
    }


def largest_channel(outcome: WindowVerdict) -> str:
    """The reading in which the parameters leave most."""
    own, base = outcome.found.estimator, outcome.found.base
    totals: dict[str, float] = {}
    for t, e in zip(own.tracks, own.innovations([(base.hypothesis, base.x)]), strict=True):
        for j, name in enumerate(t.experiment.channels):
            totals[name] = totals.get(name, 0.0) + float(np.sum(e[0, :, j] ** 2))
    return max(totals, key=totals.get)


def unexplained_part_of(outcome: WindowVerdict) -> dict | None:
    """What no effect explains, in words; None where nothing is left."""
    if outcome.verdict != "unexplained":
        return None
    said = {"where": (location_of(outcome) or {}).get("subsystem")}
    shape = outcome.unknown
    if shape is None and outcome.uneven is not None:
        return said | {
            "words": f"{outcome.uneven.law.key} predicts better in a few stretches of the"
            " recordings only: something acts there that it is not"
        }
    if shape is None and outcome.formula is not None:
        return (
            said
            | formula_report(outcome)
            | {"words": f"a torque of angle and speed together; {outcome.formula.text()}"}
        )
    if shape is None and outcome.strained is not None:
        return said | {
            "words": f"no law fits, and {outcome.strained.key} would have to move far outside of"
            " its tolerance: something acts there that has no name here"
        }
    if shape is None and outcome.unpredicted:
        return said | {"words": "the model found predicts nothing: something acts without a name"}
    if shape is None and outcome.no_further:
        return said | {
            "words": f"{outcome.found.steps[0].law.key} predicts better only in the windows"
            " that it was fitted in: something acts that it is not"
        }
    if shape is None and not outcome.refuted:
        return said | {
            "words": "the laws found explain a part, unevenly: something acts that they are not"
        }
    if shape is None:
        return said | {
            "words": "the laws found do worse than parameters alone on recordings held out"
        }
    unit = "V" if shape.port == "V" else "Nm"
    return (
        said
        | formula_report(outcome)
        | {
            "words": shape.sentence() + _by_formula(outcome),
            "depends_on": shape.signal,
            "nodes": [float(v) for v in shape.nodes],
            f"values_{unit}": [float(v) for v in shape.values],
        }
    )


def _by_formula(outcome: WindowVerdict) -> str:
    if outcome.formula is not None:
        return f"; {outcome.formula.text()}"
    if outcome.found.steps:
        return ""
    return (
        "; no sum of three terms of the library (powers and waves of the angle times powers of"
        " the speed) was confirmed for it"
    )


def formula_report(outcome: WindowVerdict) -> dict:
    """The formula of an unknown torque as data; empty where there is none."""
    formula = outcome.formula
    if formula is None:
        return {}
    chosen = formula.selection
    sizes = zip(formula.term.terms, formula.deviations, chosen.shares, strict=True)
    return {
        "formula": {
            "words": formula.text(),
            "usual_speed_rad_per_s": chosen.usual_speed_rad_per_s,
            "share_of_free_function": formula.of_shape and round(formula.of_shape, 3),
            "terms": [
                {"function": term.text(), "coefficient_Nm": size, "std_Nm": std,
                 "selected": share}
                for (size, term), std, share in sizes
            ],
        }
    }  # fmt: skip


def power_table(outcome: WindowVerdict) -> dict:
    """Mean squared innovations of the fitted recordings, each fit in its own noise."""
    return {
        "files": [b.recording.file for b in outcome.problem.fitted],
        "parameters_only": [round(float(p), 3) for p in outcome.search.parameters.msni],
        "after": [round(float(p), 3) for p in outcome.fit.msni],
    }


def findings_of(outcome: WindowVerdict) -> list[Finding]:
    """What else is worth knowing: of the experiment, of values far off, of the files."""
    found = [f for f in outcome.recorded.notes() if f.kind is not Kind.RESAMPLED]
    found += [f for f in data_warnings(outcome.recorded) if outcome.stands(f)]
    std = outcome.spread.std
    at = len(outcome.problem.nominals)
    for law, values in zip(outcome.fit.hypothesis.laws, outcome.laws, strict=True):
        count = sum(p.scale > 0.0 for p in law.unknowns)
        if law.nuisance and count == 1:
            ((_, value),) = values.items()
            size = std[at] * law.unknowns[0].scale
            text = _nuisance_text(law, value, size)
            if text and abs(value) > (CLOCK_SHOWN if law.effect == CLOCK else OFFSET_SHOWN) * size:
                found.append(Finding(kind=Kind.METHOD, text=text))
        at += count
    timing = outcome.problem.timing
    if timing.rows is not RowTimes.LOGGED:
        text = f"the uneven stamps of these logs are times of {timing.rows}; simulated so"
        found.append(Finding(kind=Kind.METHOD, text=text))
    if timing.linear:
        text = "the command moves linearly from row to row of these logs; it is simulated so"
        found.append(Finding(kind=Kind.METHOD, text=text))
    for j, p in enumerate(outcome.problem.nominals):
        if abs(outcome.fit.x[j]) > SURE and abs(outcome.fit.x[j]) > 2.0 * std[j]:
            text = (
                f"{p.key} ended {abs(outcome.fit.x[j]):.1f} of its tolerances from the rig file's"
                f" value ({p.value:.4g} -> {outcome.nominal[p.key]:.4g}): is the file right?"
            )
            found.append(Finding(kind=Kind.METHOD, text=text))
    for file in outcome.found.shared:
        text = (
            f"{file}: its first two thirds were fitted, for no other recording lets the load move;"
            " the last third stayed held out"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    horizon = outcome.found.horizon
    if horizon is not None:
        seconds = [horizon * t.scale.time_s for t in outcome.estimator.tracks]
        text = (
            f"predictable for {max(seconds):.3g} s at a time: over longer runs the simulation"
            " leaves the recordings, and laws were judged in windows of that length"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    return found


def _nuisance_text(law, value: float, std: float) -> str:
    if law.kind is DriveOffset:
        return f"the drive adds {value:.3g} +- {std:.1g} to every command (amplifier offset)"
    if law.kind is DriveDelay:
        return f"the command acts {value * 1e3:.3g} +- {std * 1e3:.1g} ms late"
    if law.effect == CLOCK:
        return (
            f"the clock of {law.sensor} runs {value * 1e6:.0f} +- {std * 1e6:.0f} ppm off the"
            " command's"
        )
    return ""
