"""The report data of a diagnosed map of steady speeds: what its report shows, as plain data."""

from collections.abc import Mapping, Sequence

import numpy as np

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.gear_load_friction import GearLoadFriction
from rsea_core.identify.steady_map.points import MapFit, SteadyPoints, rms
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, grouped_sentences

SIGNAL = "motor_torque_Nm"
EXPLANATIONS = 8
SENTENCES = {
    GearFriction.effect: GearFriction.headline,
    GearLoadFriction.effect: GearLoadFriction.headline,
}


def map_report_data(
    case: Case,
    p: SteadyPoints,
    fits: Sequence[MapFit],
    chosen: MapFit,
    plain: MapFit,
    document: Mapping,
    findings: Sequence[Finding],
) -> dict:
    """Plain data with the names of the report's page (`dftfs.report.diagnosis.page`).

    Parameters
    ----------
    plain : MapFit
        Of viscous friction alone.
    document : mapping
        `diagnosis.json`.
    findings : sequence of Finding
        Those of the document.
    """
    n = int(np.sum(~p.held_out))
    place = (document["location"] or {}).get("subsystem")
    held = p.held_out if p.held_out.any() else ~p.held_out
    return {
        "case": case.name, "rig": case.rig.name, "verdict": document["verdict"],
        "summary": document["summary"], "subsystem": place,
        "where": (document["location"] or {}).get("where", ""),
        "shares": {place: 1.0} if place else {}, "parts": case.rig.parts,
        "sensors": tuple(dict.fromkeys(c for r in case.recordings for c in r.responses)),
        "loads": tuple(dict.fromkeys(r.load.kind for r in case.recordings)),
        "separability": "At steady speeds the motor's torque is all that gear, bearings and load"
        " take: where it goes shows only in how it depends on speed and load.",
        "effects": [_effect(e) for e in document["effects"]],
        "parameters": [
            {"name": name, "unit": "Nms/rad", "value": row["to"], "std": row["std"],
             "nominal": row["from"], "note": ""}
            for name, row in document["parameters_corrected"].items()
        ],
        "scores": [
            {k: row[k] for k in ("file", "role", "signal", "unit", "noise_floor", "rmse_before",
                                 "rmse_parameters_only", "rmse_after")}
            for row in document["fit"]["recordings"]
        ],
        "ladder": [_explanation(fit, chosen, plain, n) for fit in fits[:EXPLANATIONS]],
        "laws": [_curve(p, chosen)],
        "remainder": {
            "words": "What is left of the motor's torque at speeds that took no part.",
            "signals": (SIGNAL,),
            "before": np.array([rms(((p.torque_Nm - p.known_Nm) / p.error_Nm)[held])]),
            "parameters_only": np.array([rms((plain.left_Nm / p.error_Nm)[held])]),
            "after": np.array([rms((chosen.left_Nm / p.error_Nm)[held])]),
        },
        "findings": grouped_sentences(findings),
        "facts": [
            ("recordings", f"{len(case.identification)} chosen from, {len(case.validation)} held"
             " out"),
            ("points", f"{n} steady speeds fitted, {int(p.held_out.sum())} held out"),
        ],
    }  # fmt: skip


def _effect(e: Mapping) -> dict:
    return {
        "name": e["name"], "subsystem": e["subsystem"], "confidence": e["confidence"],
        "law": e["law"], "alike": tuple(a for a in e["class"] if a != e["name"]),
        "words": SENTENCES[e["name"]],
        "parameters": [
            {
                "name": name.replace("_Nm", "").replace("_", " "),
                "unit": row["unit"] if row["unit"] != "-" else "",
                "value": row["value"], "std": row["std"], "note": "",
            }
            for name, row in e["parameters"].items()
        ],
    }  # fmt: skip


def _explanation(fit: MapFit, chosen: MapFit, plain: MapFit, n: int) -> dict:
    """A law that was compared: its gain over viscous friction alone, in log-likelihood."""
    gain = n * np.log(plain.score / fit.score)
    return {
        "name": fit.law.name, "subsystem": "gear", "error": fit.score,
        "gain": float(gain), "se": float(np.sqrt(2.0 * max(abs(gain), 1.0))),
        "chosen": fit is chosen, "note": f"{len(fit.values)} values",
    }  # fmt: skip


def _curve(p: SteadyPoints, chosen: MapFit) -> dict:
    """Torque of the motor over its speed; the law's jump at zero is left open."""
    order = np.argsort(p.speed_rad_per_s)
    x, torque = p.speed_rad_per_s[order], p.torque_Nm[order]
    found = (chosen.friction(p) + p.load_Nm)[order]
    X = chosen.law.columns(p, chosen.stribeck_rad_per_s, chosen.shape)[order]
    band = 1.96 * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", X, chosen.covariance, X), 0.0))
    return {
        "title": "Torque of the motor at steady speeds", "x_label": "motor speed (rad/s)",
        "y_label": "motor torque (Nm)", "x": x, "nominal": p.known_Nm[order], "found": found,
        "low": found - band, "high": found + band, "points": (x, torque),
        "caption": f"{chosen.law.name}; points are recordings.",
    }  # fmt: skip
