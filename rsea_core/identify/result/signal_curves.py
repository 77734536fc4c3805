"""Curves and ranked explanations of a diagnosis: what was simulated and weighed."""

from collections.abc import Sequence

import numpy as np

from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.judgement.alternatives import considered, distance_errors, nearest
from rsea_core.identify.result.conclusion import Conclusion

COMPARED, QUICK_COMPARED = 4, 2  # signals drawn in full, and by a quick look
EXPLANATIONS, RICHER = 8, 2  # explanations shown, with more effects than were chosen
SCREENED = "by the screening, not fitted"


def curves(
    conclusion: Conclusion, table: Sequence[dict], *, most: int = COMPARED
) -> list[dict]:  # fmt: skip
    """Recorded and simulated signals, held-out recordings first, the worst signals of each.

    Parameters
    ----------
    table : sequence of dict
        The conclusion's `fit_table`.
    most : int
        Signals, at most.
    """
    problem, plain = conclusion.problem, conclusion.problem.nominal
    rows = {(r["file"], r["signal"]): r for r in table}
    recordings = sorted(problem.prepared, key=lambda b: b.recording.role != "validation")
    found: list[dict] = []
    for prepared in recordings:
        r = prepared.recording
        mine = sorted(
            (row for (file, _), row in rows.items() if file == r.file),
            key=lambda row: -row["nrmse_before"],
        )
        if not mine or len(found) >= most:
            continue
        runs = {
            "before": (plain, problem.start(plain)),
            "parameters_only": (
                conclusion.search.parameters.hypothesis,
                conclusion.search.parameters.x,
            ),
            "after": (conclusion.fit.hypothesis, conclusion.fit.x),
        }
        simulated = {
            name: conclusion.predicted(prepared, hypothesis, x)
            for name, (hypothesis, x) in runs.items()
        }
        for row in mine[:2]:
            j = prepared.channels.index(row["signal"])
            found.append(
                {
                    "file": r.file,
                    "role": r.role,
                    "description": r.description,
                    "signal": row["signal"],
                    "unit": row["signal"].rsplit("_", 1)[-1],
                    "time_s": r.time_s - r.time_s[0],
                    "recorded": prepared.measured[:, j],
                    **{name: y[:, j] for name, y in simulated.items()},
                    "noise_floor": row["noise_floor"],
                    **{f"nrmse_{name}": row[f"nrmse_{name}"] for name in runs},
                }
            )
    return found[:most]


def ranked_explanations(conclusion: Conclusion) -> list[dict]:
    """What was considered, by score over parameters alone, as `alternatives` counts distances.

    An explanation's error is that of its distance to the chosen one.
    """
    if hasattr(conclusion, "ranked_explanations"):
        return conclusion.ranked_explanations()
    search, plain = conclusion.search, conclusion.search.parameters
    chosen = conclusion.fit if conclusion.fit.hypothesis.laws else plain
    mine = chosen.hypothesis.effects
    whole = search.behind(chosen, plain) if mine else 0.0
    others = considered(search, chosen, effects=max(len(mine), 1) + 1)
    found = [_explanation(chosen, whole, 0.0, chosen=True)]
    if mine:
        found.append(_explanation(plain, 0.0, distance_errors(search, chosen, [plain])[0]))
    as_short = [o for o in others if len(set(o.fit.hypothesis.effects)) <= len(mine)]
    listed = [n for name in mine for n in nearest(search, chosen, as_short, name)]
    # a prediction of more effects than were chosen is none: only fits say whether they are worth it
    richer = [o for o in others if o.fitted and len(set(o.fit.hypothesis.effects)) > len(mine)]
    shown = {id(o): o for o in (*listed, *richer[: RICHER if mine else EXPLANATIONS])}
    for other in shown.values():
        note = "" if other.fitted else SCREENED
        found.append(_explanation(other.fit, whole - other.behind, other.se, note=note))
    return sorted(found, key=lambda row: (not row["chosen"], -row["gain"]))


def _explanation(fit: Fit, gain: float, se: float, *, chosen: bool = False, note: str = "") -> dict:
    laws = fit.hypothesis.laws
    return {
        "name": " + ".join(fit.hypothesis.effects) or "parameters only",
        "subsystem": ", ".join(dict.fromkeys(law.subsystem for law in laws)),
        "error": float(np.sqrt(np.max(fit.msni))),
        "gain": float(gain),
        "se": se,
        "chosen": chosen,
        "note": ", ".join([*(law.law for law in laws), *([note] if note else [])]),
    }
