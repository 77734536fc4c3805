"""The effects that a spring's explanation amounts to: names, figures, confidence."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.spring_contact import SpringContact
from rsea_core.effects.spring_hardening import SpringHardening
from rsea_core.effects.spring_hysteresis import SpringHysteresis
from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.identify.spring_bench.explanations import (
    SpringCandidate,
    SpringDiagnosis,
    chance,
    gain,
)
from rsea_core.identify.spring_bench.model import delay_s
from rsea_core.identify.spring_bench.regression import (
    ASYMMETRY,
    CONTACT,
    HARDENING,
    KNEE,
    KNEES,
    SLIP,
)

AT_rad = 0.15  # where the contract compares loops and tangents
MOST_SURE = 0.98


def figures_of(spring: SpringDiagnosis, pieces: Sequence[str]) -> dict:
    """The contract's figures of some explanations, with their deviations by jackknife."""
    best = spring.best.fit
    values = _figures_by_name(spring, pieces, best.columns, best.coefficients)
    again = [_figures_by_name(spring, pieces, *replicate) for replicate in best.replicates]
    found = {}
    for name, (value, unit) in values.items():
        others = np.array([one[name][0] for one in again if name in one])
        spread = float(np.sum((others - others.mean()) ** 2)) if others.size else np.nan
        std = np.sqrt((others.size - 1) / max(others.size, 1) * spread)  # jackknife
        found[name] = {"value": value, "std": float(std), "unit": unit, "at_bound": False}
    return found


def _figures_by_name(
    spring: SpringDiagnosis,
    pieces: Sequence[str],
    columns: Sequence[int],
    coefficients: NDArray,
) -> dict[str, tuple[float, str]]:
    """Figures by name, with their unit."""
    bench, at = spring.bench, AT_rad
    terms = [(bench.columns[j], float(c)) for j, c in zip(columns, coefficients, strict=True)]
    flank = terms[0][1] * bench.stiffness + sum(c for k, c in terms if k.piece == SLIP)
    width = energy = slip = 0.0
    stiffness_ratio, found = 1.0, {}
    for column, c in terms[1:]:
        if column.piece not in pieces:
            continue
        if column.piece == SLIP:
            reach = column.parameters["reach_rad"]
            over = max(at - reach, 0.0)
            width += 2.0 * c * min(reach, over)
            energy += 4.0 * c * reach * over
            slip += c * reach
        elif column.piece == CONTACT:
            energy += 2.0 * c * bench.stiffness * at**2
        elif column.piece == HARDENING:
            stiffness_ratio += 3.0 * c * at**2 / flank
        elif column.piece in (KNEE, KNEES):
            onset = column.parameters["onset_rad"]
            found["onset_rad"] = (abs(onset), "rad")
            found["onset_Nm"] = (flank * abs(onset), "Nm")
        elif column.piece == ASYMMETRY:
            stiffness_ratio += 2.0 * c * at / flank
        elif c < 0.0:
            found["delay_s"] = (delay_s(terms[0][1], c, column.parameters["time_s"]), "s")
        else:
            share = 1.0 + c * bench.stiffness / flank
            found["stiffness_rise_fast_over_static"] = (share, "-")
            found["time_s"] = (column.parameters["time_s"], "s")
    if {SLIP, CONTACT} & set(pieces):
        found |= {"loop_width_Nm": (width, "Nm"), "loop_energy_J": (energy, "J")}
    if SLIP in pieces:
        found["slip_Nm"] = (slip, "Nm")
    if {HARDENING, ASYMMETRY} & set(pieces):
        found["stiffness_ratio_at_0p15rad"] = (stiffness_ratio, "-")
    return found


def confidence_of(spring: SpringDiagnosis, pieces: Sequence[str]) -> tuple[float, list[dict]]:
    """How surely these pieces help beyond the rest, and what else could stand for them."""
    best = spring.best.fit
    rest = tuple(p for p in best.pieces if p not in pieces)
    without = spring.bench.fit(rest)
    mean, error = gain(without, best)
    sure = float(stdtr(best.left_out.size - 1, mean / max(error, 1e-300)))
    sure = max(sure, 1.0 - chance(without, best))
    others: dict[str, dict] = {}
    for candidate in spring.candidates:
        if candidate.fit is None or set(rest) - set(candidate.pieces):
            continue
        more = [p for p in candidate.pieces if p not in rest]
        names = set(effects_of(candidate, more)) - set(effects_of(spring.best))
        if not more or len(names) != 1 or set(pieces) & set(more):
            continue
        behind = 0.5 * best.left_out.size * np.log(candidate.fit.error / best.error)
        lost, scatter = gain(candidate.fit, best)
        se = abs(behind * scatter / lost) if lost else 0.0
        entry = {
            "name": names.pop(), "delta_score": round(float(behind), 1), "se": round(se, 1),
        }  # fmt: skip
        known = others.setdefault(entry["name"], entry)
        if entry["delta_score"] < known["delta_score"]:
            others[entry["name"]] = entry
    listed = sorted(others.values(), key=lambda o: o["delta_score"])
    alike = sum(o["delta_score"] < o["se"] for o in listed)
    return min(sure / (1.0 + alike), MOST_SURE), listed


def effects_of(
    candidate: SpringCandidate, pieces: Sequence[str] | None = None
) -> dict[str, tuple[str, ...]]:
    """The contract's names of a candidate's explanations (or of some), with those behind each."""
    found: dict[str, tuple[str, ...]] = {}
    for piece in candidate.pieces if pieces is None else pieces:
        name = {SLIP: SpringHysteresis.effect, CONTACT: SpringHysteresis.effect}.get(piece)
        name = name or (SpringHardening.effect if piece in (HARDENING, ASYMMETRY) else None)
        name = name or (SpringContact.effect if piece in (KNEE, KNEES) else None)
        if name is None:
            late = candidate.parameters["lag_coefficient"] < 0.0
            name = SensorDelay.effect if late else SpringViscoelastic.effect
        found[name] = (*found.get(name, ()), piece)
    return found
