"""The contract's document of a diagnosis, `diagnosis.json`, from its conclusion."""

from collections.abc import Sequence

import numpy as np

from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.identify.candidates.rig_parameters import unstated_std
from rsea_core.identify.judgement.detectability import minimum_detectable_sizes
from rsea_core.identify.judgement.insufficient_data import undetectable_sentence
from rsea_core.identify.judgement.unmodelled_gravity import (
    GRAVITY,
)
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.known_values import corrected_entries
from rsea_core.identify.result.summary import summary_of
from rsea_core.identify.selection.common_scale_factor import (
    scale_sentence,
)
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

QUIET = 5.0  # a channel that moves by less than this many sensor deviations is left out


def largest_channel(conclusion: Conclusion) -> str:
    """The channel in which the parameters-only innovations are largest."""
    f = conclusion.search.parameters
    found = conclusion.problem.innovations(f.hypothesis, f.x[None])
    totals: dict[str, float] = {}
    for prepared, e in zip(conclusion.problem.fitted, found, strict=True):
        for j, name in enumerate(prepared.channels):
            totals[name] = totals.get(name, 0.0) + float(np.nansum(e[0, :, j] ** 2))
    return max(totals, key=totals.get) if totals else ""


def location_of(conclusion: Conclusion) -> dict | None:
    """Where most of the mismatch arises."""
    if conclusion.verdict in ("no-mismatch", "parameters-only"):
        return None
    laws = conclusion.fit.hypothesis.laws
    if conclusion.question is not None and not laws:
        return None
    candidates = conclusion.search.candidates
    if conclusion.residual is not None:
        return {
            "subsystem": conclusion.residual.subsystem,
            "signal": largest_channel(conclusion),
            "where": f"{conclusion.residual.sentence()}; {conclusion.mismatched_recordings()}",
            "share_of_mismatch": round(conclusion.residual.share, 3),
        }
    if laws:
        place = laws[0].subsystem
    elif conclusion.unbalance is not None:
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
        "signal": largest_channel(conclusion),
        "where": conclusion.mismatched_recordings(),
        "share_of_mismatch": round(float(min(max(share, conclusion.explained_excess()), 1.0)), 3),
    }


def corrected_parameters(conclusion: Conclusion) -> dict:
    """Nominal values that moved."""
    found = {}
    count = len(conclusion.problem.nominals)
    std = np.sqrt(
        conclusion.spread.std[:count] ** 2 + [conclusion.between(j) for j in range(count)]
    )
    own = {p.key: j for j, p in enumerate(conclusion.problem.nominals)}
    if (
        conclusion.unbalance is not None
        or LoadUnbalance.effect in conclusion.fit.hypothesis.effects
    ):
        for key in GRAVITY:  # only its sum with the unbalance is seen
            if key in own:
                std[own[key]] = max(std[own[key]], abs(conclusion.fit.x[own[key]]), 1.0)
    for j, p in enumerate(conclusion.problem.nominals):
        per = p.tolerance if p.additive else p.tolerance * abs(p.at(conclusion.fit.x[j]))
        found[p.key] = {
            "from": p.value,
            "to": conclusion.nominal[p.key],
            "std": float(np.hypot(std[j] * per, unstated_std(conclusion.case.rig, p.key))),
            "identifiable": bool(std[j] < 0.7),
        }
    return found | corrected_entries(conclusion)


def fit_table(conclusion: Conclusion) -> list[dict]:
    """Open-loop errors of every recording and channel before, with parameters, after."""
    rows = []
    plain, fit, known = conclusion.problem.nominal, conclusion.fit, conclusion.search.parameters
    zero = conclusion.problem.start(plain)
    for prepared in conclusion.problem.prepared:
        before = conclusion.predicted(prepared, plain, zero)
        only = conclusion.predicted(prepared, known.hypothesis, known.x)
        after = conclusion.predicted(prepared, fit.hypothesis, fit.x)
        for j, name in enumerate(prepared.channels):
            measured = prepared.measured[:, j]
            spread, floor = float(np.std(measured)), prepared.floors[name]
            if spread < QUIET * floor:
                continue
            row = {
                "file": prepared.recording.file,
                "role": prepared.recording.role,
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


def msni_table(conclusion: Conclusion) -> dict:
    """Mean squared innovations of the fitted recordings; 1 is the sensors and the bridge."""
    found = {"files": [b.recording.file for b in conclusion.problem.fitted]}
    for name, fit in (("parameters_only", conclusion.search.parameters), ("after", conclusion.fit)):
        found[name] = [round(float(p), 3) for p in fit.msni]
        if conclusion.search.short:
            found[f"short_runs_{name}"] = [
                round(float(p), 3) for p in conclusion.search.short_msni(fit)
            ]
    return found


def residual_entry(conclusion: Conclusion) -> dict | None:
    """What no effect explains, as text; None where nothing above noise is left."""
    if conclusion.verdict != "unexplained":
        return None
    msni = conclusion.search.parameters.msni
    worst = int(np.argmax(msni))
    residual_keys = {
        "where": (location_of(conclusion) or {}).get("subsystem"),
        "words": conclusion.mismatched_recordings(),
    }
    residual_keys |= {} if conclusion.residual is None else conclusion.residual.entry()
    return residual_keys | {
        "size_in_noise": float(np.sqrt(msni[worst])),
        "recording": conclusion.problem.fitted[worst].recording.file,
        "signal": largest_channel(conclusion),
    }


def summary(conclusion: Conclusion) -> str:
    """One or two sentences that a person can act on, what must be corrected before the rest.

    Physics that was found is stated first: some of it makes readings contradict each other.
    """
    errors, text = conclusion.data_errors(), summary_of(conclusion)
    if not errors:
        return text
    more = f" ({len(errors) - 1} more in the findings)" if len(errors) > 1 else ""
    end = "" if errors[0].is_question and not more else "."
    correct = f"irst correct what is wrong in the files: {errors[0].sentence()}{more}{end}"
    if conclusion.verdict == "missing-physics":
        return f"{text} But f{correct}"
    return f"F{correct} As the files are: {text}"


def findings_of(conclusion: Conclusion) -> list[Finding]:
    """What else is worth knowing."""
    quiet = not conclusion.fit.hypothesis.laws and conclusion.verdict != "unexplained"
    undetectable = (
        undetectable_sentence(minimum_detectable_sizes(conclusion.search)) if quiet else None
    )
    alike = (
        None
        if conclusion.residual is not None
        else scale_sentence(conclusion.search, conclusion.fit)
    )
    method = [Finding(kind=Kind.METHOD, text=w) for w in (alike, undetectable) if w is not None]
    return [*conclusion.recorded.notes(), *data_warnings(conclusion.recorded), *method]


def document_of(conclusion: Conclusion, findings: Sequence[Finding] | None = None) -> dict:
    """`diagnosis.json`, with its own findings or those given."""
    return {
        "schema": 1,
        "verdict": conclusion.verdict,
        "summary": summary(conclusion),
        "location": location_of(conclusion),
        "effects": conclusion.effects(),
        "parameters_corrected": corrected_parameters(conclusion),
        "remainder": residual_entry(conclusion),
        "next_experiment": None,
        "fit": {"recordings": fit_table(conclusion), "innovation_power": msni_table(conclusion)},
        "findings": list(sentences(findings_of(conclusion) if findings is None else findings)),
    }
