"""What a bench says of a spring, as the file contract has it: verdict, effects, model.

A bench is a case that cannot be replayed as a machine: quasi-static maps and loops, a spring
alone, or a drive of which the rig file does not know enough to move it, with torque against
deflection in every recording.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.registry import SpringCurve
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.errors import InputError
from rsea_core.identify.spring_bench.effects import AT_rad, confidence_of, effects_of, figures_of
from rsea_core.identify.spring_bench.explanation_text import phrase_of
from rsea_core.identify.spring_bench.explanations import (
    SpringDiagnosis,
    diagnose_spring,
)
from rsea_core.identify.spring_bench.loops import BenchRows, bench_rows
from rsea_core.identify.spring_bench.model import spring_model
from rsea_core.identify.spring_bench.regression import (
    SLIP,
    offset_of,
    zero_of,
)
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.finding import Finding, Kind, sentences
from rsea_core.recordings.quality_checks import data_warnings

REMAINS = 0.3  # of the torque's deviation, held out: more than this is no explanation
NOISE = 2.0  # floors: a design that is as near as this agrees
UNSURE = 0.45
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
class SpringConclusion:
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
            figures = figures_of(self.found, pieces)
            sure, others = confidence_of(self.found, pieces)
            if self.verdict in ("unexplained", "insufficient-data"):
                sure = min(sure, UNSURE)
            listed.append(
                {
                    "name": name,
                    "subsystem": "sensor:torque_Nm" if name == SensorDelay.effect else "spring",
                    "confidence": round(sure, 3),
                    "law": ", ".join(phrase_of(self.found.best, p) for p in dict.fromkeys(pieces)),
                    "parameters": figures,
                    "class": [name, *(o["name"] for o in others if o["delta_score"] < o["se"])],
                    "alternatives": others,
                }
            )
        return sorted(listed, key=lambda e: -e["confidence"])

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
        own = "sensor:torque_Nm" if list(named) == [SensorDelay.effect] else "spring"
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


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def diagnose_bench(case: Case, design: SpringCurve | None = None) -> SpringConclusion:
    """Diagnose a case that is a spring's bench.

    Raises
    ------
    InputError
        As `diagnose_spring`.
    """
    found = diagnose_spring(case.rig, case.recordings, design)
    return SpringConclusion(case=case, found=found, design=design)
