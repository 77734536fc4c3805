"""The figures of a whole run: rates, curves and tables over the cases' scores."""

import itertools
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from dftfs.proof.scoring import NAMED, Score

BINS = np.linspace(0.0, 1.0, 11)
STRENGTH_EDGES = (1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 1e9)
TWO_SIDED_95 = 1.96


@dataclass(frozen=True, kw_only=True)
class Rate:
    """A share with its count and Wilson's 95 % interval."""

    share: float
    count: int
    low: float
    high: float

    @staticmethod
    def of(values: list[float]) -> "Rate | None":
        """Mean of values in 0..1; None where there is none."""
        if not values:
            return None
        n, p, z = len(values), float(np.mean(values)), TWO_SIDED_95
        centre = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z * np.sqrt(max(p * (1 - p), 0.0) / n + z * z / (4 * n * n)) / (1 + z * z / n)
        return Rate(share=p, count=n, low=max(0.0, centre - half), high=min(1.0, centre + half))


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Reliability of the stated confidences: rows (mean confidence, share true, count)."""

    rows: list[tuple[float, float, int]]
    brier: float
    expected_error: float


@dataclass(frozen=True, kw_only=True)
class Summary:
    """All figures of a run."""

    cases: int
    without_diagnosis: list[str]
    verdict: Rate | None
    location: Rate | None
    top1: Rate | None
    class_top1: Rate | None
    precision: Rate | None
    recall: Rate | None
    false_alarm: Rate | None
    rivals_named: Rate | None
    gain: float | None
    gain_beyond: float | None
    calibration: Calibration | None
    coverage_effects: Rate | None
    coverage_constants: Rate | None
    parameter_error: float | None
    within_20_percent: Rate | None
    detection: list[tuple[float, float, int, int]]
    half_detected_at: float | None
    confusion: dict[str, dict[str, int]]
    by_level: dict[str, dict[str, Rate | None]]
    by_effect: dict[str, dict[str, int]]
    experiments: Rate | None
    wall_s: dict[str, float] = field(default_factory=dict)


def some(scores: list[Score], name: str) -> list[float]:
    return [getattr(s, name) for s in scores if getattr(s, name) is not None]


def calibration(events: list[tuple[float, bool]]) -> Calibration | None:
    """Brier score and expected calibration error over ten equal bins (Naeini 2015)."""
    if not events:
        return None
    stated = np.array([c for c, _ in events])
    true = np.array([float(t) for _, t in events])
    which = np.clip(np.digitize(stated, BINS) - 1, 0, BINS.size - 2)
    rows, error = [], 0.0
    for k in range(BINS.size - 1):
        inside = which == k
        if inside.any():
            rows.append(
                (float(stated[inside].mean()), float(true[inside].mean()), int(inside.sum()))
            )
            error += inside.mean() * abs(rows[-1][0] - rows[-1][1])
    return Calibration(
        rows=rows, brier=float(np.mean((stated - true) ** 2)), expected_error=float(error)
    )


def found_by_strength(scores: list[Score]) -> list[tuple[float, bool]]:
    return [
        (s.strength[name], name in s.hits)
        for s in scores
        if s.level in NAMED
        for name in s.truth
        if name in s.strength
    ]


def detection(pairs: list[tuple[float, bool]]) -> list[tuple[float, float, int, int]]:
    """Rows (lower edge, upper edge, found, all) over strength."""
    rows = []
    for low, high in itertools.pairwise(STRENGTH_EDGES):
        inside = [found for strength, found in pairs if low <= strength < high]
        if inside:
            rows.append((low, high, sum(inside), len(inside)))
    return rows


def half_point(pairs: list[tuple[float, bool]]) -> float | None:
    """Strength at which half of the effects are found: logistic in log strength, a weak prior.

    None where all or none are found, where the curve does not rise, or where it lies outside the
    strengths that there are.
    """
    if len(pairs) < 10 or len({found for _, found in pairs}) < 2:
        return None
    x = np.log([s for s, _ in pairs])
    y = np.array([float(f) for _, f in pairs])

    def cost(p: np.ndarray) -> float:
        u = p[0] + p[1] * x
        return float(np.sum(np.logaddexp(0.0, u) - y * u) + 0.02 * p @ p)

    a, b = minimize(cost, np.array([0.0, 1.0])).x
    if b <= 0.05 or not x.min() <= -a / b <= x.max():
        return None
    return float(np.exp(-a / b))


def confusion(scores: list[Score]) -> dict[str, dict[str, int]]:
    """True effect (single ones, null, outside) against the first claim or the verdict."""
    table: dict[str, Counter] = {}
    for s in scores:
        if s.level in ("double", "poor"):
            continue
        truth = {"null": "(null)", "outside": "(outside)"}.get(s.level) or s.truth[0]
        answer = s.claimed[0] if s.claimed else f"({s.verdict or 'none'})"
        table.setdefault(truth, Counter())[answer] += 1
    return {t: dict(sorted(row.items())) for t, row in sorted(table.items())}


def by_effect(scores: list[Score]) -> dict[str, dict[str, int]]:
    out: dict[str, Counter] = {}
    for s in scores:
        for kind in ("hits", "missed", "false"):
            for name in getattr(s, kind):
                out.setdefault(name, Counter())[kind] += 1
    return {n: {k: c[k] for k in ("hits", "missed", "false")} for n, c in sorted(out.items())}


def inside_95(scores: list[Score], kind: str) -> Rate | None:
    z = [p.deviations for s in scores for p in getattr(s, kind) if p.deviations is not None]
    return Rate.of([float(abs(v) < TWO_SIDED_95) for v in z])


def mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def summarise(scores: list[Score]) -> Summary:
    """Figures of a run."""
    hits = sum(len(s.hits) for s in scores)
    missed = sum(len(s.missed) for s in scores)
    false = sum(len(s.false) for s in scores)
    errors = [abs(p.error) for s in scores for p in s.parameters if p.error is not None]
    pairs = found_by_strength(scores)
    levels = sorted({s.level for s in scores})
    nulls = [s for s in scores if s.level == "null"]
    alarms = [float(s.verdict in ("missing-physics", "unexplained")) for s in nulls]
    walls = some(scores, "wall_s")
    unanswerable = [s for s in scores if s.verdict == "insufficient-data"]
    return Summary(
        cases=len(scores),
        without_diagnosis=[s.case for s in scores if s.verdict is None],
        verdict=Rate.of(some(scores, "verdict_credit")),
        location=Rate.of(some(scores, "location")),
        top1=Rate.of(some(scores, "top1")),
        class_top1=Rate.of(some(scores, "class_top1")),
        precision=Rate.of([1.0] * hits + [0.0] * false),
        recall=Rate.of([1.0] * hits + [0.0] * missed),
        false_alarm=Rate.of(alarms),
        rivals_named=Rate.of(some(scores, "rivals_named")),
        gain=mean(some(scores, "gain")),
        gain_beyond=mean(some(scores, "gain_beyond")),
        calibration=calibration([e for s in scores for e in s.events]),
        coverage_effects=inside_95(scores, "parameters"),
        coverage_constants=inside_95(scores, "constants"),
        parameter_error=float(np.median(errors)) if errors else None,
        within_20_percent=Rate.of([float(e < 0.2) for e in errors]),
        detection=detection(pairs),
        half_detected_at=half_point(pairs),
        confusion=confusion(scores),
        by_level={
            level: {
                name: Rate.of(some([s for s in scores if s.level == level], name))
                for name in ("verdict_credit", "location", "top1")
            }
            for level in levels
        },
        by_effect=by_effect(scores),
        experiments=Rate.of([float(s.experiment) for s in unanswerable]),
        wall_s=(
            {"median": float(np.median(walls)), "worst": float(np.max(walls))} if walls else {}
        ),
    )
