"""The contract's document of a diagnosis, `diagnosis.json`, from its outcome."""

from collections.abc import Sequence

import numpy as np

from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.identify.candidates.rig_parameters import unstated_std
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.detectability import minimum_detectable_sizes
from rsea_core.identify.judgement.insufficient_data import undetectable_sentence
from rsea_core.identify.judgement.unmodelled_gravity import (
    GRAVITY,
)
from rsea_core.identify.result.outcome import Outcome
from rsea_core.identify.result.summary import summary_of
from rsea_core.identify.selection.common_scale_factor import (
    scale_sentence,
)
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

QUIET = 5.0  # a channel that moves by less than this many sensor deviations is left out


def largest_channel(outcome: Outcome) -> str:
    """The channel in which the parameters-only innovations are largest."""
    f = outcome.search.parameters
    found = outcome.problem.innovations(f.hypothesis, f.x[None])
    totals: dict[str, float] = {}
    for bench, e in zip(outcome.problem.fitted, found, strict=True):
        for j, name in enumerate(bench.channels):
            totals[name] = totals.get(name, 0.0) + float(np.nansum(e[0, :, j] ** 2))
    return max(totals, key=totals.get) if totals else ""


def location_of(outcome: Outcome) -> dict | None:
    """Where most of the mismatch arises."""
    if outcome.verdict in ("no-mismatch", "parameters-only"):
        return None
    laws = outcome.fit.hypothesis.laws
    if outcome.question is not None and not laws:
        return None
    candidates = outcome.search.candidates
    if outcome.residual is not None:
        return {
            "subsystem": outcome.residual.subsystem,
            "signal": largest_channel(outcome),
            "where": f"{outcome.residual.sentence()}; {outcome.mismatched_recordings()}",
            "share_of_mismatch": round(outcome.residual.share, 3),
        }
    if laws:
        place = laws[0].subsystem
    elif outcome.unbalance is not None:
        place = "load"
    elif candidates:
        place = candidates[0].law.subsystem
    else:
        return None
    share = next(
        (c.share for c in candidates if laws and c.law.effect == laws[0].effect),
        candidates[0].share if candidates else 0.0,
    )
    return {
        "subsystem": place,
        "signal": largest_channel(outcome),
        "where": outcome.mismatched_recordings(),
        "share_of_mismatch": round(float(min(max(share, outcome.explained_excess()), 1.0)), 3),
    }


def corrected_parameters(outcome: Outcome) -> dict:
    """Nominal values that moved."""
    found = {}
    count = len(outcome.problem.nominals)
    std = np.sqrt(outcome.spread.std[:count] ** 2 + [outcome.between(j) for j in range(count)])
    own = {p.key: j for j, p in enumerate(outcome.problem.nominals)}
    if outcome.unbalance is not None or LoadUnbalance.effect in outcome.fit.hypothesis.effects:
        for key in GRAVITY:  # only its sum with the unbalance is seen
            if key in own:
                std[own[key]] = max(std[own[key]], abs(outcome.fit.x[own[key]]), 1.0)
    for j, p in enumerate(outcome.problem.nominals):
        per = p.tolerance if p.additive else p.tolerance * abs(p.at(outcome.fit.x[j]))
        found[p.key] = {
            "from": p.value,
            "to": outcome.nominal[p.key],
            "std": float(np.hypot(std[j] * per, unstated_std(outcome.case.rig, p.key))),
            "identifiable": bool(std[j] < 0.7),
        }
    return found


def fit_table(outcome: Outcome) -> list[dict]:
    """Open-loop errors of every recording and channel before, with parameters, after."""
    rows = []
    plain = Hypothesis()
    zero = outcome.problem.start(plain)
    for bench in outcome.problem.benches:
        before = outcome.problem.predict(bench, plain, zero[None])[0]
        only = outcome.search.parameters
        only = outcome.problem.predict(bench, only.hypothesis, only.x[None])[0]
        after = outcome.problem.predict(bench, outcome.fit.hypothesis, outcome.fit.x[None])[0]
        for j, name in enumerate(bench.channels):
            measured = bench.measured[:, j]
            spread, floor = float(np.std(measured)), bench.floors[name]
            if spread < QUIET * floor:
                continue
            row = {
                "file": bench.recording.file,
                "role": bench.recording.role,
                "signal": name,
                "unit": name.rsplit("_", 1)[-1],
                "noise_floor": floor,
            }
            for tag, y in (("before", before), ("parameters_only", only), ("after", after)):
                rmse = float(np.sqrt(np.mean((y[:, j] - measured) ** 2)))
                row[f"rmse_{tag}"] = rmse
                row[f"nrmse_{tag}"] = rmse / spread
            rows.append(row)
    return rows


def msni_table(outcome: Outcome) -> dict:
    """Mean squared innovations of the fitted recordings; 1 is the sensors and the bridge."""
    found = {"files": [b.recording.file for b in outcome.problem.fitted]}
    for name, fit in (("parameters_only", outcome.search.parameters), ("after", outcome.fit)):
        found[name] = [round(float(p), 3) for p in fit.msni]
        if outcome.search.short:
            found[f"short_runs_{name}"] = [
                round(float(p), 3) for p in outcome.search.short_msni(fit)
            ]
    return found


def residual_entry(outcome: Outcome) -> dict | None:
    """What no effect explains, as text; None where nothing above noise is left."""
    if outcome.verdict != "unexplained":
        return None
    msni = outcome.search.parameters.msni
    worst = int(np.argmax(msni))
    said = {
        "where": (location_of(outcome) or {}).get("subsystem"),
        "words": outcome.mismatched_recordings(),
    }
    said |= {} if outcome.residual is None else outcome.residual.entry()
    return said | {
        "size_in_noise": float(np.sqrt(msni[worst])),
        "recording": outcome.problem.fitted[worst].recording.file,
        "signal": largest_channel(outcome),
    }


def summary(outcome: Outcome) -> str:
    """One or two sentences that a person can act on, what must be mended before the rest.

    Physics that was found speaks first: some of it makes readings contradict each other.
    """
    errors, text = outcome.data_errors(), summary_of(outcome)
    if not errors:
        return text
    more = f" ({len(errors) - 1} more in the findings)" if len(errors) > 1 else ""
    end = "" if errors[0].is_question and not more else "."
    mend = f"irst mend what the files say wrong: {errors[0].sentence()}{more}{end}"
    if outcome.verdict == "missing-physics":
        return f"{text} But f{mend}"
    return f"F{mend} As the files are: {text}"


def findings_of(outcome: Outcome) -> list[Finding]:
    """What else is worth knowing."""
    quiet = not outcome.fit.hypothesis.laws and outcome.verdict != "unexplained"
    undetectable = (
        undetectable_sentence(minimum_detectable_sizes(outcome.search)) if quiet else None
    )
    alike = None if outcome.residual is not None else scale_sentence(outcome.search, outcome.fit)
    method = [Finding(kind=Kind.METHOD, text=w) for w in (alike, undetectable) if w is not None]
    return [*outcome.recorded.notes(), *data_warnings(outcome.recorded), *method]


def document_of(outcome: Outcome, findings: Sequence[Finding] | None = None) -> dict:
    """`diagnosis.json`, with its own findings or those given."""
    return {
        "schema": 1,
        "verdict": outcome.verdict,
        "summary": summary(outcome),
        "location": location_of(outcome),
        "effects": outcome.effects(),
        "parameters_corrected": corrected_parameters(outcome),
        "remainder": residual_entry(outcome),
        "next_experiment": None,
        "fit": {"recordings": fit_table(outcome), "innovation_power": msni_table(outcome)},
        "findings": list(sentences(findings_of(outcome) if findings is None else findings)),
    }
