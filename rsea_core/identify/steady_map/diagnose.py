"""From a map of steady speeds to the contract's diagnosis, its model and the report data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.base import Term
from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.gear_load_friction import GearLoadFriction
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.variant import Law
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.steady_map.points import (
    MapFit,
    MapLaw,
    SteadyPoints,
    compare_laws,
    rms,
    steady_points,
)
from rsea_core.identify.steady_map.report_data import SIGNAL, map_report_data
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind, sentences

EXPLAINED = 0.35  # share of the error that parameters leave which a law must take away
TEMPERATURE = (
    12.0  # log-likelihood units by which confidence falls to 1/e, as in `selection.criteria`
)
MOST_SURE = 0.98
BY_LOAD = 0.75
"""Belief that friction which differs between driving and being driven does so by its load.

With one load level nothing in the map tells it from a friction that differs by direction.
"""
NOISE = 2.0  # standard errors: what is left below it is the map's own scatter
DWELL_s = 10.0  # of each speed of the next experiment
NEXT_SPEEDS = 8  # of it, each way


@dataclass(frozen=True, kw_only=True)
class Efficiencies:
    """What passes of the power while the motor drives the load and while the load drives it.

    Attributes
    ----------
    drive, back : float
        Of the whole drive at the load recorded, or of the gear's load-dependent part alone where
        loads differ; back at or below zero: it locks.
    drive_std, back_std : float
        With one load level they hold what the split into friction that the load causes and
        friction that is there without it leaves open.
    drive_most, back_most : float
        If the load causes no more than the difference between both directions.
    """

    drive: float
    back: float
    drive_std: float
    back_std: float
    drive_most: float
    back_most: float


@dataclass(frozen=True, kw_only=True)
class MapDiagnosis:
    """A diagnosis of a steady map.

    Attributes
    ----------
    document : dict
        `diagnosis.json`.
    model : FoundModel
    report_data : dict
        Plain data of the report's page.
    points : SteadyPoints
    fits : tuple of MapFit
        Best leave-one-out error first; `chosen` is one of them.
    next_columns : mapping or None
        A ready-to-run list of steady speeds.
    findings : tuple of Finding
        Those of the document, as data.
    """

    document: dict
    model: FoundModel
    report_data: dict
    points: SteadyPoints
    fits: tuple[MapFit, ...]
    chosen: MapFit
    next_columns: Mapping[str, NDArray] | None
    findings: tuple[Finding, ...]


def choose(fits: list[MapFit], n: int) -> MapFit:
    """The law of fewest values whose leave-one-out error is within a standard error of the best.

    (Hastie, Tibshirani and Friedman, The Elements of Statistical Learning, 2nd ed., 7.10.)
    """
    # mean of n squares of that size, as of normal errors
    limit = fits[0].score ** 2 * (1.0 + np.sqrt(2.0 / n))
    near = [fit for fit in fits if fit.score**2 <= limit]
    return min(near, key=lambda fit: (len(fit.values), fit.score))


def efficiencies(p: SteadyPoints, fit: MapFit) -> Efficiencies | None:
    """Efficiencies of a law by direction at one load, or of one by load; None without a load."""
    load = float(np.abs(p.load_Nm).max())
    if load == 0.0 or fit.law.levels not in ("two", "load"):
        return None
    if fit.law.levels == "load":
        driven, helped = fit.values["driven"], fit.values["helped"]
        drive, back = 1.0 / (1.0 + max(driven, 0.0)), 1.0 - max(helped, 0.0)
        return Efficiencies(
            drive=drive, back=back, drive_std=drive**2 * fit.std["driven"],
            back_std=fit.std["helped"], drive_most=drive, back_most=back,
        )  # fmt: skip
    driven, helped = _levels(p, fit)
    spread = np.hypot(fit.std["level"], fit.std["skew"])
    least = (max(driven - helped, 0.0) / load, max(helped - driven, 0.0) / load)
    drive, back = 1.0 / (1.0 + driven / load), 1.0 - helped / load
    drive_most, back_most = 1.0 / (1.0 + least[0]), 1.0 - least[1]
    return Efficiencies(
        drive=drive, back=back, drive_most=drive_most, back_most=back_most,
        drive_std=float(np.hypot((drive_most - drive) / np.sqrt(12.0), drive**2 * spread / load)),
        back_std=float(np.hypot((back_most - back) / np.sqrt(12.0), spread / load)),
    )  # fmt: skip


def _levels(p: SteadyPoints, fit: MapFit) -> tuple[float, float]:
    """Friction where the motor drives the load and where the load helps, at speed."""
    forward = fit.values["level"] + fit.values.get("skew", 0.0)
    backward = fit.values["level"] - fit.values.get("skew", 0.0)
    driven_forward = float(np.median(p.load_Nm)) > 0.0
    return (forward, backward) if driven_forward else (backward, forward)


def diagnose_map(case: Case) -> MapDiagnosis:
    """Diagnose a case of steady speeds.

    Raises
    ------
    RecordingError
        As `steady_points`.
    """
    p = steady_points(case)
    fits = compare_laws(p)
    n = int(np.sum(~p.held_out))
    chosen = choose(fits, n)
    plain = next(f for f in fits if f.law == MapLaw(levels="none", stribeck="none", drag="v"))
    verdict = _verdict(p, chosen, plain)
    found = efficiencies(p, chosen)
    seen = _seen(plain, chosen, n)
    effects = [] if verdict in ("no-mismatch", "parameters-only") else _effects(
        p, fits, chosen, found, seen, verdict, n
    )  # fmt: skip
    ask = found is not None and p.one_load and verdict != "unexplained"
    sentence, columns, separation = _next(case, p, chosen) if ask else ("", None, 0.0)
    shown = viscous_of(chosen if "viscous" in chosen.values else plain)
    corrected = _corrected(case, chosen, shown)
    rows = _rows(p, chosen, plain)
    where = _where(p, chosen)
    share = 1.0 - (rms(chosen.left_Nm[~p.held_out]) / rms(plain.left_Nm[~p.held_out])) ** 2
    located = bool(effects) or verdict == "unexplained"
    findings = (*case.notes(), *_findings(p, chosen, found))
    document = {
        "schema": 1,
        "verdict": verdict,
        "summary": _summary(p, chosen, found, verdict),
        "location": {
            "subsystem": "gear", "signal": SIGNAL, "where": where,
            "share_of_mismatch": round(max(float(share), 0.0), 3),
        } if located else None,
        "effects": effects,
        "parameters_corrected": corrected,
        "remainder": {
            "where": "gear", "signal": SIGNAL, "words": where,
            "size_in_noise": chosen.score, "recording": rows[-1]["file"],
        } if verdict == "unexplained" else None,
        "next_experiment": {
            "sentence": sentence, "load": "constant-torque", "extra_mass_kg": None,
            "sensors": [SIGNAL], "file": "next.csv",
            "rivals": [GearLoadFriction.effect, GearFriction.effect],
            "predicted_separation": separation,
        } if columns is not None else None,
        "fit": {"recordings": rows},
        "findings": list(sentences(findings)),
    }  # fmt: skip
    return MapDiagnosis(
        document=document,
        model=_model(case, p, fits, plain),
        report_data=map_report_data(case, p, fits, chosen, plain, document, findings),
        points=p, fits=tuple(fits), chosen=chosen, next_columns=columns, findings=findings,
    )  # fmt: skip


def _verdict(p: SteadyPoints, chosen: MapFit, plain: MapFit) -> str:
    left = p.torque_Nm - p.known_Nm
    used = ~p.held_out
    if rms((left / p.error_Nm)[used]) < NOISE:
        return "no-mismatch"
    if chosen.law == plain.law:
        return "parameters-only" if plain.score < NOISE else "unexplained"
    return "missing-physics" if chosen.score < (1.0 - EXPLAINED) * plain.score else "unexplained"


def _seen(plain: MapFit, chosen: MapFit, n: int) -> float:
    gain = n * np.log(plain.score / chosen.score)
    return float(min(1.0 - np.exp(-max(gain, 0.0) / TEMPERATURE), MOST_SURE))


def _effects(p, fits, chosen, found, seen, verdict, n) -> list[dict]:
    entries = []
    level = chosen.values.get("level")
    if level is not None and level > 0.0:
        entries.append(
            _entry(GearFriction.effect, seen, chosen.law.name,
                   {"coulomb_Nm": (level, chosen.std["level"], "Nm")}, [GearFriction.effect], [])
        )  # fmt: skip
    if found is not None:
        alike = [GearLoadFriction.effect, GearFriction.effect]
        confidence, others = BY_LOAD * seen, []
        if not p.one_load:
            rest = min((f for f in fits if f.law.levels != "load"), key=lambda f: f.score)
            gap = n * float(np.log(rest.score / chosen.score))
            confidence = seen * (1.0 - 0.5 * np.exp(-max(gap, 0.0) / TEMPERATURE))
            alike = [GearLoadFriction.effect]
            others = [{"name": GearFriction.effect, "delta_score": round(gap, 1),
                       "se": round(float(np.sqrt(2.0 * max(gap, 1.0))), 1)}]  # fmt: skip
        figures = {
            "drive_efficiency": (found.drive, found.drive_std, "-"),
            "backdrive_efficiency": (found.back, found.back_std, "-"),
        }
        if p.one_load:
            figures |= {
                "drive_efficiency_at_most": (found.drive_most, None, "-"),
                "backdrive_efficiency_at_most": (found.back_most, None, "-"),
            }
        law = "whole drive at one load" if p.one_load else "efficiencies"
        entries.append(_entry(GearLoadFriction.effect, confidence, law, figures, alike, others))
    if verdict == "unexplained":
        entries = [e | {"confidence": min(e["confidence"], 0.45)} for e in entries]
    return sorted(entries, key=lambda e: -e["confidence"])


def _entry(name, confidence, law, figures, alike, others) -> dict:
    return {
        "name": name, "subsystem": "gear", "confidence": round(float(confidence), 3), "law": law,
        "parameters": {
            key: {"value": value, "std": std, "unit": unit, "at_bound": False}
            for key, (value, std, unit) in figures.items()
        },
        "class": alike, "alternatives": others,
    }  # fmt: skip


def viscous_of(fit: MapFit) -> float | None:
    """Viscous friction of the motor side that a law found [Nms/rad]; None where it has none."""
    return max(fit.values["viscous"], 0.0) if "viscous" in fit.values else None


def _corrected(case: Case, chosen: MapFit, viscous: float | None) -> dict:
    if viscous is None or "viscous" not in chosen.values:
        return {}
    return {
        "motor_viscous_Nms_per_rad": {
            "from": case.rig.motor_viscous_Nms_per_rad, "to": viscous,
            "std": chosen.std["viscous"], "identifiable": True,
        }
    }  # fmt: skip


def _rows(p: SteadyPoints, chosen: MapFit, plain: MapFit) -> list[dict]:
    spread = float(np.std(p.torque_Nm))
    found = []
    for name in dict.fromkeys(p.file):
        at = np.array([f == name for f in p.file])
        errors = {
            "before": rms((p.torque_Nm - p.known_Nm)[at]),
            "parameters_only": rms(plain.left_Nm[at]),
            "after": rms(chosen.left_Nm[at]),
        }
        role = "validation" if p.held_out[at].any() else "identification"
        row = {"file": name, "role": role, "signal": SIGNAL, "unit": "Nm",
               "noise_floor": rms(p.error_Nm[at])}  # fmt: skip
        row |= {f"rmse_{tag}": e for tag, e in errors.items()}
        found.append(row | {f"nrmse_{tag}": e / spread for tag, e in errors.items()})
    return found


def _where(p: SteadyPoints, chosen: MapFit) -> str:
    speed = np.abs(p.speed_rad_per_s)
    text = (
        f"at all of {speed.size} steady speeds from {speed.min():.3g} to {speed.max():.3g} rad/s"
        " of the motor"
    )
    if chosen.law.levels in ("two", "load") and np.abs(p.load_Nm).max() > 0.0:
        driven, helped = _levels(p, chosen)
        if chosen.law.levels == "load":
            size = float(np.median(np.abs(p.load_Nm)))
            driven += size * chosen.values["driven"]
            helped += size * chosen.values["helped"]
        text += (
            f"; {1e3 * driven:.3g} mNm where the motor drives the load, {1e3 * helped:.3g} mNm"
            " where the load helps"
        )
    return text


def _summary(p: SteadyPoints, chosen: MapFit, found: Efficiencies | None, verdict: str) -> str:
    if verdict == "no-mismatch":
        return "The rig file explains the map of steady speeds down to its scatter."
    if verdict == "parameters-only":
        return "Load and viscous friction with another value explain the map of steady speeds."
    held = rms(chosen.left_Nm[p.held_out]) if p.held_out.any() else chosen.score * rms(p.error_Nm)
    left = f"at held-out speeds {1e3 * held:.3g} mNm rms of the motor's torque is left"
    if verdict == "unexplained":
        return f"Structure remains that no known law of friction explains; {left}."
    level = 1e3 * chosen.values.get("level", 0.0)
    text = f"Missing physics: gear friction ({chosen.law.name}), {level:.3g} mNm at the motor"
    if found is not None:
        locks = ": it locks" if found.back <= 0.0 else ""
        of = "the whole drive at this load" if p.one_load else "what the load causes"
        text += (
            f", and it differs by who drives: efficiency of {of} {100 * found.drive:.3g} %"
            f" driving, {100 * found.back:.3g} % back-driven{locks}"
        )
    return f"{text}; {left}."


def _findings(p: SteadyPoints, chosen: MapFit, found: Efficiencies | None) -> list[Finding]:
    reasons = []
    if chosen.law.stribeck in ("two", "skew") and found is not None:
        reasons.append(
            "the difference between driving and being driven is larger at low speed: it falls"
            f" to 1/e at {chosen.stribeck_rad_per_s:.3g} rad/s of the motor"
        )
    if found is not None and p.one_load:
        reasons.append(
            "one load level: friction that the load causes cannot be distinguished from friction"
            " that differs by direction. If the load causes all of it the efficiencies are"
            f" {found.drive:.3g} and {found.back:.3g}, if it causes the difference alone"
            f" {found.drive_most:.3g} and {found.back_most:.3g}; model.toml holds the latter"
        )
    if "quadratic" in chosen.values:
        reasons.append("drag grows with the square of the speed; model.toml holds viscous drag")
    return [Finding(kind=Kind.METHOD, text=text) for text in reasons]


def _next(case: Case, p: SteadyPoints, chosen: MapFit):
    """The same speeds with another load, and how far its two explanations then are apart."""
    size = np.abs(p.speed_rad_per_s)
    one_direction = np.geomspace(size.min(), size.max(), NEXT_SPEEDS)
    speeds = np.concatenate([-one_direction[::-1], one_direction])
    columns = {"time_s": DWELL_s * np.arange(speeds.size), "motor_velocity_rad_per_s": speeds}
    driven, helped = _levels(p, chosen)
    # without the load: nothing is left if it caused all, the smaller level if only the difference
    apart = min(driven, helped) * np.sqrt(speeds.size) / float(np.median(p.error_Nm))
    sentence = (
        "Take the weight off and run the steady speeds of next.csv again, at least"
        f" {DWELL_s:g} s each: friction that the load causes goes with it, friction by direction"
        " stays."
    )
    return sentence, columns, float(apart)


def _model(case: Case, p: SteadyPoints, fits: list[MapFit], plain: MapFit) -> FoundModel:
    """The law that simulations have: viscous, Coulomb and by load or direction."""
    simple = [f for f in fits if f.law.stribeck == "none" and f.law.drag == "v"]
    best = min(simple, key=lambda f: f.score)
    known, laws = laws_by_key(), []
    found = efficiencies(p, best)
    level, skew = best.values.get("level", 0.0), best.values.get("skew", 0.0)

    def add(kind: type[Term], variant: str, values: Mapping[str, float]) -> None:
        law: Law = known[f"{kind.effect}/{variant}"]
        laws.append((law, dict(values)))

    if found is not None:
        if best.law.levels == "two":
            level = min(_levels(p, best))
        if level > 0.0:
            add(GearFriction, "coulomb", {"coulomb_Nm": level})
        most = {"drive_efficiency": found.drive_most, "backdrive_efficiency": found.back_most}
        add(GearLoadFriction, "efficiencies", most)
    elif level > 0.0 and skew != 0.0:
        add(GearFriction, "asymmetric", {"coulomb_Nm": level, "asymmetry": skew / level})
    elif level > 0.0:
        add(GearFriction, "coulomb", {"coulomb_Nm": level})
    viscous = viscous_of(best)
    rig = replace(case.rig, motor_viscous_Nms_per_rad=viscous)
    return FoundModel(rig=rig, contact={}, laws=tuple(laws), ambient_C=25.0)
