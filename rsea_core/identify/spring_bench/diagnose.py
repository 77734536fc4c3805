"""What a bench says of a spring, as the file contract has it: verdict, effects, model.

A bench is a case that cannot be replayed as a machine: quasi-static maps and loops, a spring
alone, or a drive of which the rig file does not know enough to move it, with torque against
deflection in every recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import InputError
from rsea_core.identify.spring_bench.explanations import (
    SpringCandidate,
    SpringDiagnosis,
    chance,
    diagnose_spring,
    gain,
    phrase_of,
)
from rsea_core.identify.spring_bench.loops import BenchRows, bench_rows
from rsea_core.identify.spring_bench.model import delay_s, spring_model
from rsea_core.identify.spring_bench.regression import (
    ASYMMETRY,
    CONTACT,
    HARDENING,
    SLIP,
    offset_of,
    zero_of,
)
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

AT_rad = 0.15  # where the contract compares loops and tangents
REMAINS = 0.3  # of the torque's deviation, held out: more than this is no explanation
NOISE = 2.0  # floors: a design that is as near as this agrees
MOST_SURE, UNSURE = 0.98, 0.45
BEYOND = 1.5  # of the deflection that was reached: figures there are extrapolated


def is_spring_bench(case: Case) -> bool:
    """Whether a case is about torque against deflection alone.

    A spring with its drive is one where that drive cannot be simulated: its inertia is not known
    and no recording has its angle.
    """
    chosen = case.identification
    try:
        rows, _ = bench_rows(case.rig, chosen)
    except InputError:
        return False
    if len(rows) < len(chosen):
        return False
    if case.rig.parts == ("spring",) or all(r.quasi_static for r in chosen):
        return True
    moves = case.rig.motor_inertia_kgm2 or case.rig.output_inertia_kgm2
    return not moves and not any("motor_angle_rad" in r for r in chosen)


@dataclass(frozen=True, kw_only=True)
class SpringOutcome:
    """A spring's diagnosis with its case.

    Attributes
    ----------
    case : Case
    found : SpringDiagnosis
    design : SpringCurve or None
        The curve that it was compared with.
    """

    case: Case
    found: SpringDiagnosis
    design: SpringCurve | None

    @property
    def rows(self) -> tuple[BenchRows, ...]:
        """All recordings, those that were fitted first."""
        return (*self.found.bench.rows, *self.found.held)

    def floor(self, r: BenchRows) -> float:
        """Standard deviation of a recording's torque sensor [Nm]."""
        recording = next(one for one in self.case.recordings if one.file == r.file)
        return noise_floor(self.case.rig, recording)["torque_Nm"]

    def simulated(self, r: BenchRows) -> dict[str, NDArray]:
        """Torque of a recording before, with another scale, and after; each with its offset."""
        bench, best = self.found.bench, self.found.best
        found = {"before": spring_torque_Nm(bench.table, r.deflection_rad - zero_of(r))}
        for name, candidate in (("parameters_only", self.found.plain), ("after", best)):
            found[name] = bench.predicted(r, candidate.fit)
        return {name: y + offset_of(r, r.torque_Nm - y) for name, y in found.items()}

    # ---- the document

    @property
    def verdict(self) -> str:
        """One of the contract's."""
        found = self.found
        if found.known and self._in_floors("before") < NOISE:
            return "no-mismatch"
        if found.best.pieces and not found.turns_back:
            return "insufficient-data"
        if not found.best.scale > 0.0:
            return "unexplained"
        if found.best.error > REMAINS and self._in_floors("after") > NOISE:
            return "unexplained"
        return "missing-physics" if found.best.pieces else "parameters-only"

    def _in_floors(self, tag: str) -> float:
        """Root mean square over the fitted recordings of an error over its noise."""
        bench = self.found.bench
        errors = [
            np.sqrt(np.mean((self.simulated(r)[tag] - r.torque_Nm) ** 2))
            / max(np.hypot(self.floor(r), bench.floor(r)), 1e-300)
            for r in bench.rows
        ]
        return float(np.sqrt(np.mean(np.square(errors))))

    def document(self) -> dict:
        """`diagnosis.json`."""
        verdict, found = self.verdict, self.found
        return {
            "schema": 1,
            "verdict": verdict,
            "summary": found.sentence,
            "location": self._location(verdict),
            "effects": self.effects() if verdict != "no-mismatch" else [],
            "parameters_corrected": self._corrected(),
            "remainder": self._remainder() if verdict == "unexplained" else None,
            "next_experiment": None,
            "fit": {"recordings": self.fit_table()},
            "findings": list(sentences(self.findings())),
            "spring": self._spring(),
        }

    def findings(self) -> tuple[Finding, ...]:
        """What else is worth knowing."""
        return (
            *self.case.notes(), *data_warnings(self.case, pairs=False), *self.found.findings,
            *(Finding(kind=Kind.MODEL_LIMIT, text=text) for text in self.left_out),
            *self._extrapolated(),
        )  # fmt: skip

    def fit_table(self) -> list[dict]:
        """Torque errors of every recording before, with another scale, after."""
        table = []
        for r in self.rows:
            spread = float(np.std(r.torque_Nm))
            row = {
                "file": r.file, "role": r.role, "signal": "torque_Nm", "unit": "Nm",
                "noise_floor": self.floor(r),
            }  # fmt: skip
            for tag, y in self.simulated(r).items():
                row[f"rmse_{tag}"] = float(np.sqrt(np.mean((y - r.torque_Nm) ** 2)))
                row[f"nrmse_{tag}"] = row[f"rmse_{tag}"] / max(spread, 1e-300)
            table.append(row)
        return table

    def effects(self) -> list[dict]:
        """The effects found, most convincing first."""
        listed = []
        for name, pieces in effects_of(self.found.best).items():
            figures = self._figures(pieces)
            sure, others = self._confidence(pieces)
            if self.verdict in ("unexplained", "insufficient-data"):
                sure = min(sure, UNSURE)
            listed.append(
                {
                    "name": name,
                    "subsystem": "sensor:torque_Nm" if name == "sensor-delay" else "spring",
                    "confidence": round(sure, 3),
                    "law": ", ".join(phrase_of(self.found.best, p) for p in dict.fromkeys(pieces)),
                    "parameters": figures,
                    "class": [name, *(o["name"] for o in others if o["delta_score"] < o["se"])],
                    "alternatives": others,
                }
            )
        return sorted(listed, key=lambda e: -e["confidence"])

    def _figures(self, pieces: Sequence[str]) -> dict:
        best = self.found.best.fit
        values = self._comparable(pieces, best.columns, best.coefficients)
        again = [self._comparable(pieces, *replicate) for replicate in best.replicates]
        found = {}
        for name, (value, unit) in values.items():
            others = np.array([one[name][0] for one in again if name in one])
            spread = float(np.sum((others - others.mean()) ** 2)) if others.size else np.nan
            std = np.sqrt((others.size - 1) / max(others.size, 1) * spread)  # jackknife
            found[name] = {"value": value, "std": float(std), "unit": unit, "at_bound": False}
        return found

    def _comparable(
        self, pieces: Sequence[str], columns: Sequence[int], coefficients: NDArray
    ) -> dict[str, tuple[float, str]]:
        """Figures by name, with their unit."""
        bench, at = self.found.bench, AT_rad
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

    def _confidence(self, pieces: Sequence[str]) -> tuple[float, list[dict]]:
        """How surely these pieces help beyond the rest, and what else could stand for them."""
        best = self.found.best.fit
        rest = tuple(p for p in best.pieces if p not in pieces)
        without = self.found.bench.fit(rest)
        mean, error = gain(without, best)
        sure = float(stdtr(best.left_out.size - 1, mean / max(error, 1e-300)))
        sure = max(sure, 1.0 - chance(without, best))
        others: dict[str, dict] = {}
        for candidate in self.found.candidates:
            if candidate.fit is None or set(rest) - set(candidate.pieces):
                continue
            more = [p for p in candidate.pieces if p not in rest]
            names = set(effects_of(candidate, more)) - set(effects_of(self.found.best))
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

    def _extrapolated(self) -> tuple[Finding, ...]:
        """Whether the contract's figures lie where no recording was."""
        reached = max(float(np.ptp(r.deflection_rad)) for r in self.found.bench.rows)
        if not self.found.best.pieces or 2.0 * AT_rad < BEYOND * reached:
            return ()
        text = (
            f"figures for ±{AT_rad:g} rad extrapolate the law found: the recordings span"
            f" {reached:.3g} rad"
        )
        return (Finding(kind=Kind.METHOD, text=text),)

    def _corrected(self) -> dict:
        best, bench = self.found.best, self.found.bench
        given = self.case.rig.spring_stiffness_Nm_per_rad
        return {
            "spring_stiffness_Nm_per_rad": {
                "from": bench.stiffness if self.design is not None else given,
                "to": best.scale * bench.stiffness,
                "std": best.scale_std * bench.stiffness,
                "identifiable": best.scale_std < 0.5 * best.scale,
            }
        }

    def _location(self, verdict: str) -> dict | None:
        if verdict in ("no-mismatch", "parameters-only"):
            return None
        named = effects_of(self.found.best)
        own = "sensor:torque_Nm" if list(named) == ["sensor-delay"] else "spring"
        best, plain = self.found.best.error, self.found.plain.error
        return {
            "subsystem": own,
            "signal": "torque_Nm",
            "where": self._where(),
            "share_of_mismatch": round(max(0.0, 1.0 - (best / plain) ** 2), 3),
        }

    def _where(self) -> str:
        """In words: in which recordings, and beyond which torque."""
        worst = sorted(
            (row for row in self.fit_table() if row["role"] == "identification"),
            key=lambda row: -row["nrmse_parameters_only"],
        )
        text = "with the stiffness re-estimated, in " + ", ".join(
            f"{row['file']} ({100 * row['nrmse_parameters_only']:.0f} % of its torque)"
            for row in worst[:3]
        )
        p = self.found.best.parameters
        if SLIP not in self.found.best.pieces:
            return text
        reaches = [(p[f"reach{tag}_rad"], p[f"stiffness_{j}_Nm_per_rad"])
                   for j, tag in ((1, "_1"), (2, "_2")) if f"reach{tag}_rad" in p]  # fmt: skip
        reaches = reaches or [(p["reach_rad"], p["stiffness_1_Nm_per_rad"])]
        limit = sum(y * k for y, k in reaches)
        return f"{text}; where the torque has turned by more than {2.0 * limit:.3g} Nm"

    def _remainder(self) -> dict:
        rows = [r for r in self.fit_table() if r["role"] == "identification"]
        worst = max(rows, key=lambda row: row["rmse_after"] / row["noise_floor"])
        return {
            "where": "spring",
            "size_in_noise": worst["rmse_after"] / worst["noise_floor"],
            "recording": worst["file"],
            "signal": "torque_Nm",
            "words": f"{100 * self.found.best.error:.0f} % of the torque is not predicted where it"
            f" took no part in the fit, most in {worst['file']}",
        }

    def _spring(self) -> dict:
        """What the bench measures, beyond the contract."""
        found, measured = self.found, self.found.measured
        own = {
            "thickness_ratio": _number(found.thickness_ratio),
            "thickness_std": _number(found.thickness_std),
            "held_out_nrmse": _number(found.held_out),
            "candidates": {c.name: {"nrmse": c.error, **c.parameters} for c in found.candidates},
        }
        if measured is not None:
            own |= {
                "flank_Nm_per_rad": measured.stiffness_Nm_per_rad,
                "flank_std": measured.stiffness_std,
                "flank_falling_rising_Nm_per_rad": [_number(v) for v in measured.by_direction],
                "largest_loop_width_Nm": _number(measured.width_Nm),
                "largest_loop_energy_J": _number(measured.energy_J),
                "slips_at_Nm": _number(measured.slip_Nm),
            }
        return own

    # ---- the model

    @property
    def left_out(self) -> tuple[str, ...]:
        """What of the explanation the model cannot hold."""
        return spring_model(self.case.rig, self.found, self.design)[1]

    def model(self) -> ActuatorModel:
        """The spring found, in its rig, for simulations and controllers."""
        return spring_model(self.case.rig, self.found, self.design)[0]


def effects_of(
    candidate: SpringCandidate, pieces: Sequence[str] | None = None
) -> dict[str, tuple[str, ...]]:
    """The contract's names of a candidate's explanations (or of some), with those behind each."""
    found: dict[str, tuple[str, ...]] = {}
    for piece in candidate.pieces if pieces is None else pieces:
        name = {SLIP: "spring-hysteresis", CONTACT: "spring-hysteresis"}.get(piece)
        name = name or ("spring-hardening" if piece in (HARDENING, ASYMMETRY) else None)
        if name is None:
            late = candidate.parameters["lag_coefficient"] < 0.0
            name = "sensor-delay" if late else "spring-viscoelastic"
        found[name] = (*found.get(name, ()), piece)
    return found


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def diagnose_bench(case: Case, design: SpringCurve | None = None) -> SpringOutcome:
    """Diagnose a case that is a spring's bench.

    Raises
    ------
    InputError
        As `diagnose_spring`.
    """
    found = diagnose_spring(case.rig, case.recordings, design)
    return SpringOutcome(case=case, found=found, design=design)
