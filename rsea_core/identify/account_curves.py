"""Curves and ladder of a diagnosis: what was simulated, and what it was weighed against."""

import numpy as np

from rsea_core.identify.outcome import Outcome
from rsea_core.identify.problem import Hypothesis

COMPARED = 4  # signals drawn in full
RUNGS = 8


def curves(outcome: Outcome) -> list[dict]:
    """Recorded and simulated signals, held-out recordings first, the worst signals of each."""
    problem, plain = outcome.problem, Hypothesis()
    rows = {(r["file"], r["signal"]): r for r in outcome.fit_table()}
    benches = sorted(problem.benches, key=lambda b: b.recording.role != "validation")
    found: list[dict] = []
    for bench in benches:
        r = bench.recording
        mine = sorted(
            (row for (file, _), row in rows.items() if file == r.file),
            key=lambda row: -row["nrmse_before"],
        )
        if not mine or len(found) >= COMPARED:
            continue
        runs = {
            "before": (plain, problem.start(plain)),
            "parameters_only": (plain, outcome.search.parameters.x),
            "after": (outcome.fit.hypothesis, outcome.fit.x),
        }
        simulated = {
            name: problem.predict(bench, hypothesis, x[None])[0]
            for name, (hypothesis, x) in runs.items()
        }
        for row in mine[:2]:
            j = bench.channels.index(row["signal"])
            found.append(
                {
                    "file": r.file,
                    "role": r.role,
                    "description": r.description,
                    "signal": row["signal"],
                    "unit": row["signal"].rsplit("_", 1)[-1],
                    "time_s": r.time_s - r.time_s[0],
                    "recorded": bench.measured[:, j],
                    **{name: y[:, j] for name, y in simulated.items()},
                    "noise_floor": row["noise_floor"],
                    **{f"nrmse_{name}": row[f"nrmse_{name}"] for name in runs},
                }
            )
    return found[:COMPARED]


def ladder(outcome: Outcome) -> list[dict]:
    """The best fit of each set of effects, by score over parameters alone."""
    search = outcome.search
    base = search.score(search.parameters)
    seen: dict[tuple[str, ...], dict] = {}
    for fit in [*search.ranked(), search.parameters]:
        effects = fit.hypothesis.effects
        if effects in seen:
            continue
        gain = search.score(fit) - base
        seen[effects] = {
            "name": " + ".join(effects) or "parameters only",
            "subsystem": ", ".join(dict.fromkeys(law.subsystem for law in fit.hypothesis.laws)),
            "error": float(np.sqrt(np.max(fit.power))),
            "gain": float(gain),
            "se": outcome_error(gain),
            "chosen": effects == outcome.fit.hypothesis.effects,
            "note": ", ".join(law.law for law in fit.hypothesis.laws),
        }
    rungs = sorted(seen.values(), key=lambda rung: -rung["gain"])
    kept = [r for k, r in enumerate(rungs) if k < RUNGS or r["chosen"] or not r["subsystem"]]
    return [r for r in kept if np.isfinite(r["gain"])]


def outcome_error(gain: float) -> float:
    """Standard error of a difference of scores: it is a sum over stretches of the recordings."""
    return float(np.sqrt(2.0 * max(abs(gain), 1.0)))
