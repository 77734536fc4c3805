"""The report data of a spring's bench, as plain data with the keys of a report's page."""

from typing import Any

import numpy as np

from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.spring_hardening import SpringHardening
from rsea_core.effects.spring_hysteresis import SpringHysteresis
from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.identify.spring_bench.diagnose import SpringConclusion
from rsea_core.identify.spring_bench.effects import effects_of
from rsea_core.identify.spring_bench.explanations import gain
from rsea_core.identify.spring_bench.loops import BenchRows
from rsea_core.identify.spring_bench.regression import zero_of
from rsea_core.recordings.finding import grouped_sentences

COMPARED, LOOPS, EXPLANATIONS = 4, 4, 8
TEXTS = {
    SpringHysteresis.effect: SpringHysteresis.headline,
    SpringHardening.effect: "The stiffness changes with the deflection.",
    SpringViscoelastic.effect: SpringViscoelastic.headline,
    SensorDelay.effect: "The torque is read later than the deflection.",
}


def spring_report_data(conclusion: SpringConclusion, document: dict) -> dict[str, Any]:
    """What a report shows of a spring's bench; keys are those of its page."""
    case, found = conclusion.case, conclusion.found
    scores = conclusion.fit_table()
    share = (document["location"] or {}).get("share_of_mismatch", 0.0)
    place = (document["location"] or {}).get("subsystem")
    return {
        "case": case.name,
        "rig": case.rig.name,
        "verdict": document["verdict"],
        "summary": document["summary"],
        "subsystem": place,
        "where": (document["location"] or {}).get("where", ""),
        "shares": {place: share} if place == "spring" else {},
        "parts": case.rig.parts,
        "sensors": tuple(dict.fromkeys(name for r in case.recordings for name in r.responses)),
        "loads": tuple(dict.fromkeys(r.load.kind for r in case.recordings)),
        "separability": _measured(conclusion),
        "effects": [_effect(e) for e in document["effects"]],
        "parameters": [
            {
                "name": name, "unit": "Nm/rad", "value": row["to"], "std": row["std"],
                "nominal": row["from"], "note": "of the elastic flank, before anything slips",
            }
            for name, row in document["parameters_corrected"].items()
        ],
        "scores": [
            {key: row[key] for key in
             ("file", "role", "signal", "unit", "noise_floor", "rmse_before",
              "rmse_parameters_only", "rmse_after")}
            for row in scores
        ],
        "comparisons": [_comparison(conclusion, r) for r in _shown(conclusion)[:COMPARED]],
        "laws": [_loop(conclusion, r) for r in _shown(conclusion)[:LOOPS]],
        "ladder": _ranked_explanations(conclusion),
        "weighed": "parts of the recordings that took no part in its fit",
        "remainder": _remainder(document, scores),
        "findings": grouped_sentences(conclusion.findings()),
        "facts": [
            ("compared with", conclusion.design.source if conclusion.design is not None
             else "the rig's stiffness" if found.known else "the best straight line"),
            *((r.file, f"{r.load.kind}, {r.role}: {r.description}") for r in case.recordings),
        ],
    }  # fmt: skip


def _shown(conclusion: SpringConclusion) -> list[BenchRows]:
    """Held-out recordings and the largest of the others, by turns."""
    by_size = sorted(conclusion.found.bench.rows, key=lambda r: -np.ptp(r.torque_Nm))
    held = sorted(conclusion.found.held, key=lambda r: -np.ptp(r.torque_Nm))
    found: list[BenchRows] = []
    for k in range(max(len(by_size), len(held))):
        found += [*held[k : k + 1], *by_size[k : k + 1]]
    return found


def _comparison(conclusion: SpringConclusion, r: BenchRows) -> dict:
    runs, spread = conclusion.simulated(r), max(float(np.std(r.torque_Nm)), 1e-300)
    described = {one.file: one.description for one in conclusion.case.recordings}
    return {
        "file": r.file, "role": r.role, "description": described[r.file], "signal": "torque_Nm",
        "unit": "Nm", "time_s": r.time_s - r.time_s[0], "recorded": r.torque_Nm, **runs,
        "noise_floor": conclusion.floor(r),
        **{f"nrmse_{tag}": float(np.sqrt(np.mean((y - r.torque_Nm) ** 2))) / spread
           for tag, y in runs.items()},
    }  # fmt: skip


def _loop(conclusion: SpringConclusion, r: BenchRows) -> dict:
    runs = conclusion.simulated(r)
    deflection = r.deflection_rad - zero_of(r)
    held = " (held out)" if r.role == "validation" else ""
    return {
        "title": f"{r.file}{held}", "x_label": "deflection (rad)", "y_label": "torque (Nm)",
        "x": deflection, "nominal": runs["before"], "found": runs["after"], "low": runs["after"],
        "high": runs["after"], "points": (deflection, r.torque_Nm),
        "caption": "Torque against deflection as recorded (grey), as designed, and as explained;"
        " the deflection counts from where the recording starts unloaded.",
    }  # fmt: skip


def _effect(effect: dict) -> dict:
    return {
        "name": effect["name"], "subsystem": effect["subsystem"],
        "confidence": effect["confidence"], "law": effect["law"],
        "words": TEXTS.get(effect["name"], ""),
        "alike": tuple(name for name in effect["class"] if name != effect["name"]),
        "parameters": [
            {
                "name": name.rsplit("_", 1)[0].replace("_", " "), "unit": row["unit"],
                "value": row["value"], "std": row["std"],
            }
            for name, row in effect["parameters"].items()
        ],
    }  # fmt: skip


def _ranked_explanations(conclusion: SpringConclusion) -> list[dict]:
    """Explanations by gain over a mere scale, in logarithms of the error on parts left out."""
    found = conclusion.found
    per_floor = float(
        np.mean([np.std(r.torque_Nm) / conclusion.floor(r) for r in found.bench.rows])
    )
    base, rows = found.plain.fit, []
    for candidate in found.candidates:
        if candidate.fit is None:
            continue
        blocks = base.left_out.size
        better = 0.5 * blocks * float(np.log(base.error / candidate.fit.error))
        mean, scatter = gain(base, candidate.fit)
        rows.append(
            {
                "name": "another scale" if not candidate.pieces else candidate.name,
                "subsystem": ", ".join(effects_of(candidate)) or "parameters",
                "error": candidate.error * per_floor, "gain": better,
                "se": abs(better * scatter / mean) if mean else 0.0,
                "chosen": candidate is found.best, "note": "",
            }
        )  # fmt: skip
    rows.sort(key=lambda row: -row["gain"])
    return [r for k, r in enumerate(rows) if k < EXPLANATIONS or r["chosen"] or r["gain"] == 0.0]


def _remainder(document: dict, scores: list[dict]) -> dict:
    rows = [row for row in scores if row["role"] == "validation"] or scores

    def worst(tag: str):
        return np.array([max(row[f"rmse_{tag}"] / row["noise_floor"] for row in rows)])

    after = float(worst("after")[0])
    text = (document["remainder"] or {}).get("words", "")
    size = f"The largest error that is left is {after:.3g} times the torque sensor's noise."
    return {
        "words": f"{text}. {size}" if text else size, "signals": ("torque_Nm",),
        "before": worst("before"), "parameters_only": worst("parameters_only"),
        "after": worst("after"),
    }  # fmt: skip


def _measured(conclusion: SpringConclusion) -> str:
    """Stiffness per direction, loop and knee, in a sentence."""
    m = conclusion.found.measured
    if m is None or not conclusion.found.turns_back:
        return "No recording turns back: friction cannot be distinguished from elasticity."
    directions = zip(("falling", "rising"), m.by_direction, strict=True)
    each = ", ".join(
        f"{direction} {value:.4g}" for direction, value in directions if np.isfinite(value)
    )
    text = f"Elastic flanks {m.stiffness_Nm_per_rad:.4g} ± {m.stiffness_std:.2g} Nm/rad ({each})"
    if np.isfinite(m.width_Nm) and np.isfinite(m.energy_J):
        text += f"; widest loop {m.width_Nm:.3g} Nm, {m.energy_J:.3g} J"
    if np.isfinite(m.slip_Nm):
        text += f"; swings leave their flank at {m.slip_Nm:.3g} Nm"
    return text + "."
