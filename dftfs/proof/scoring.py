"""One case's score: the rules of the practice set's `score.py`, written down as functions.

Every rule takes a label and a diagnosis as the dictionaries that their files hold.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

CLAIM = 0.5  # an effect below this confidence is not a claim (recordings.md)
NAMED = ("plain", "concealed", "confounded", "double")
# Comparable parameters whose neutral value is one: the error counts over the effect's size.
ABOUT_ONE = (
    "scale",
    "stiffness_ratio_at_0p15rad",
    "stiffness_rise_fast_over_static",
    "drive_efficiency",
    "backdrive_efficiency",
    "exponent",
)
# Constants that a true effect redefines: a contact whose force is no line has no stiffness, only
# one at a depth that is a convention of each law.
REDEFINED = {
    "contact-nonlinear": ("contact_stiffness_Nm_per_rad", "contact_damping_Nms_per_rad"),
}
SMALLEST_GAP = 0.002  # of nrmse: below this there is nothing to gain


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One comparable parameter: the truth, what was reported, its standard deviation if any."""

    name: str
    true: float
    reported: float | None
    std: float | None

    @property
    def error(self) -> float | None:
        """Error over the size of the effect."""
        if self.reported is None:
            return None
        size = abs(self.true - 1.0) if self.name.split(".")[-1] in ABOUT_ONE else abs(self.true)
        return (self.reported - self.true) / max(size, 1e-12)

    @property
    def deviations(self) -> float | None:
        """Error over the reported standard deviation."""
        return (
            (self.reported - self.true) / self.std if self.std and self.error is not None else None
        )


@dataclass(frozen=True, kw_only=True)
class Score:
    """What one case earns. None: the rule does not apply to this case."""

    case: str
    level: str
    truth: tuple[str, ...]
    strength: dict[str, float]
    verdict: str | None
    claimed: tuple[str, ...]
    verdict_credit: float
    location: float | None
    top1: float | None
    class_top1: float | None
    gain: float | None
    gain_beyond: float | None
    events: tuple[tuple[float, bool], ...] = ()
    hits: tuple[str, ...] = ()
    missed: tuple[str, ...] = ()
    false: tuple[str, ...] = ()
    rivals_named: float | None = None
    parameters: tuple[Parameter, ...] = ()
    constants: tuple[Parameter, ...] = ()
    experiment: bool = False
    wall_s: float | None = None
    channels: dict[str, dict[str, float]] = field(default_factory=dict)


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """A CSV with a header as columns."""
    with path.open(encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    return dict(zip(names, table.T, strict=True))


def ranked(found: dict) -> list[dict]:
    return sorted(found.get("effects") or [], key=lambda e: -e.get("confidence", 1.0))


def claims(found: dict) -> list[str]:
    if found.get("verdict") in ("no-mismatch", "parameters-only"):
        return []
    return [e["name"] for e in ranked(found) if e.get("confidence", 1.0) >= CLAIM]


def others(found: dict) -> set[str]:
    return {a["name"] for e in ranked(found) for a in e.get("alternatives") or []}


def verdict_credit(label: dict, found: dict) -> float:
    credit = label["verdicts"].get(found.get("verdict"), 0.0)
    if isinstance(credit, str):  # a poor case whose effect leaves a trace: no insisting
        top = max((e.get("confidence", 1.0) for e in ranked(found)), default=0.0)
        return 0.7 if top < 0.6 or others(found) & set(label["rivals"]) else 0.0
    return float(credit)


def location_credit(label: dict, found: dict) -> float | None:
    if not label["subsystems"] or label["level"] == "poor":
        return None
    place = (found.get("location") or {}).get("subsystem")
    if place is None and found.get("effects"):
        place = found["effects"][0].get("subsystem")
    return float(label["subsystems"].get(place, 0.0))


def top_credit(label: dict, found: dict) -> float | None:
    if label["level"] not in NAMED:
        return None
    truth, effects = set(label["effects"]), ranked(found)
    if "load-unbalance" in truth and found.get("verdict") == "parameters-only":
        moved = set(found.get("parameters_corrected") or {})
        right = moved & {"load_mass_kg", "load_distance_m", "gravity_angle_offset_rad"}
        credit = label["verdicts"].get("parameters-only", 0.0)
        return float(credit) if right else 0.0
    named = bool(effects) and effects[0]["name"] in truth
    return float(named and found.get("verdict") == "missing-physics")


def class_credit(label: dict, found: dict) -> float | None:
    """As `top_credit`, but a truth inside the first effect's stated class counts too."""
    top = top_credit(label, found)
    effects = ranked(found)
    if top is None or top > 0.0 or not effects:
        return top
    return float(bool(set(effects[0].get("class") or []) & set(label["effects"])))


def comparable(label: dict, found: dict) -> tuple[Parameter, ...]:
    """Comparable parameters of the effects that are both true and reported."""
    rows = []
    for effect in ranked(found):
        for key, true in (label["parameters"].get(effect["name"]) or {}).items():
            if not isinstance(true, int | float):
                continue
            reported = (effect.get("parameters") or {}).get(key)
            value = reported.get("value") if isinstance(reported, dict) else reported
            std = reported.get("std") if isinstance(reported, dict) else None
            rows.append(
                Parameter(name=f"{effect['name']}.{key}", true=true, reported=value, std=std)
            )
    return tuple(rows)


def corrected(label: dict, found: dict) -> tuple[Parameter, ...]:
    """Corrected constants of the rig that the diagnosis calls identifiable."""
    rows = []
    gone = {key for effect in label["effects"] for key in REDEFINED.get(effect, ())}
    for key, change in (found.get("parameters_corrected") or {}).items():
        pair = label["parameters_true_vs_rig"].get(key)
        if pair is None or key in gone or not change.get("identifiable"):
            continue
        rows.append(Parameter(name=key, true=pair[1], reported=change["to"], std=change.get("std")))
    return tuple(rows)


def hidden_errors(hidden: Path, label: dict, prediction: Path | None) -> dict[str, dict]:
    """Per channel of the hidden test: nrmse of rig file, refit, truth and prediction."""
    if not label["hidden_test"]["nrmse"]:
        return {}
    measured, truth = read_columns(hidden / "output.csv"), read_columns(hidden / "truth.csv")
    nominal = read_columns(hidden / "nominal.csv")
    predicted = read_columns(prediction) if prediction and prediction.is_file() else {}
    out = {}
    for channel, reference in label["hidden_test"]["nrmse"].items():
        target, spread = measured[channel], reference["std"]

        def error(y: np.ndarray, target: np.ndarray = target, spread: float = spread) -> float:
            return float(np.sqrt(np.mean((y - target) ** 2)) / spread)

        row = {
            "nominal": error(nominal[channel]),
            "floor": error(truth[channel]),
            "refit": reference["refit"],
        }
        if channel in predicted:
            y = predicted[channel]
            if y.size != target.size:
                y = np.interp(measured["time_s"], predicted["time_s"], y)
            row["predicted"] = error(np.nan_to_num(y, nan=1e6))
        out[channel] = row
    return out


def gain(channels: dict[str, dict], start: str) -> float | None:
    """Mean over channels of the share of the reachable improvement from ``start`` to the floor."""
    shares = []
    for row in channels.values():
        room = row[start] - row["floor"]
        if "predicted" in row and room > max(SMALLEST_GAP, 0.5 * row["floor"]):
            shares.append(np.clip((row[start] - row["predicted"]) / room, -1.0, 1.0))
    return float(np.mean(shares)) if shares else None


def score_case(
    case: str,
    label: dict,
    found: dict | None,
    hidden: Path,
    prediction: Path | None,
    wall_s: float | None = None,
) -> Score:
    """Everything that one diagnosis earns. ``found`` None: there is no diagnosis."""
    found = found or {"verdict": None, "effects": []}
    level, truth = label["level"], set(label["effects"])
    claimed = claims(found)
    hits = truth & set(claimed) if level in NAMED else set()
    missed = truth - set(claimed) if level in NAMED else set()
    false: set[str] = set()
    if level != "poor":
        false = set(claimed) - truth - set(label.get("nearest_names") or [])
    channels = hidden_errors(hidden, label, prediction)
    rivals = set(label["rivals"])
    # constants stand for something only where the machine around them is the true one
    understood = level != "outside" and not missed and not false
    return Score(
        case=case,
        level=level,
        truth=tuple(label["effects"]) or tuple(label["effect_subsystem"]),
        strength=label.get("strength", {}),
        verdict=found.get("verdict"),
        claimed=tuple(claimed),
        verdict_credit=verdict_credit(label, found),
        location=location_credit(label, found),
        top1=top_credit(label, found),
        class_top1=class_credit(label, found),
        gain=gain(channels, "nominal") if level != "poor" else None,
        gain_beyond=gain(channels, "refit") if level not in ("poor", "null") else None,
        events=tuple(
            (float(np.clip(e.get("confidence", 1.0), 0.0, 1.0)), e["name"] in truth)
            for e in ranked(found)
            if e["name"] not in (label.get("nearest_names") or [])
        ),
        hits=tuple(sorted(hits)),
        missed=tuple(sorted(missed)),
        false=tuple(sorted(false)),
        rivals_named=(
            len(others(found) & rivals) / len(rivals) if rivals and level != "poor" else None
        ),
        parameters=comparable(label, found),
        constants=corrected(label, found) if understood else (),
        experiment=bool(found.get("next_experiment")),
        wall_s=wall_s,
        channels=channels,
    )
