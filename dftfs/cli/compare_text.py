"""The result of `dftfs compare` as text."""

from collections.abc import Mapping
from pathlib import Path

from dftfs.cli.common import table
from dftfs.report.control.comparison_tables import moved_text
from rsea_core.control.tuning.comparison import (
    Comparison,
    Verdict,
    order_probabilities,
    pareto_front,
    ranking,
)

COLUMNS = {
    "expected_rmse": "expected",
    "rmse": "rmse",
    "peak_error": "peak",
    "command_rms": "command_rms",
    "command_change": "command_change",
    "gain_margin_dB": "gain_margin_dB",
    "phase_margin_deg": "phase_margin_deg",
    "noisy_rmse": "noisy_rmse",
    "monte_carlo_rmse_mean": "random_mean",
    "monte_carlo_rmse_std": "random_std",
    "monte_carlo_rmse_worst": "random_worst",
    "wrong_compensator_percent": "wrong_comp_%",
    "seeds_failed_share": "seeds_failed",
}


def comparison_text(
    comparison: Comparison, verdicts: list[Verdict], files: Mapping[str, Path]
) -> str:
    """Ranked controllers in a table, the others with the reason, what is at a bound."""
    ranked, others = ranking(verdicts)
    rows = [[v.name, *(_short(v.as_row()[column]) for column in COLUMNS)] for v in ranked]
    lines = [
        f"{comparison.name}: RMSE from {comparison.task.from_s:g} s on, events located;"
        f" {len(ranked)} of {len(verdicts)} ranked by the mean over {comparison.perturbed} random"
        " machines"
    ]
    if comparison.perturbed:
        lines.append(
            f"random machines differ in (standard deviations) {moved_text(comparison.moved)}"
        )
    if rows:
        lines.append(table(["controller", *COLUMNS.values()], rows))
    for pair in order_probabilities(verdicts):
        low, high = pair.difference
        lines.append(
            f"{pair.better} before {pair.worse}: probability {pair.probability:.3f},"
            f" difference {low:.3g} to {high:.3g} {comparison.task.reference.unit}"
        )
    if ranked:
        lines.append("Pareto front (error, effort, chatter, spread): " + ", ".join(
            pareto_front(verdicts)))  # fmt: skip
    for v in others:
        lines.append(f"not ranked: {v.name} (RMSE {v.following.rmse:.4g}): {v.reasons[0]}")
    for v in verdicts:
        lines += [f"at its bound: {v.name}: {bound}" for bound in v.at_bounds]
    disturbed = [
        [v.name, d.name, _short(d.rmse), _short(d.peak_deviation), _short(d.recovery_s)]
        for v in verdicts
        for d in v.robustness.disturbed
    ]
    if disturbed:
        lines.append(table(["controller", "disturbance", "rmse", "peak", "recovery_s"], disturbed))
    elif comparison.disturbances:
        lines.append("disturbances left out: the output is locked, no external torque moves it")
    return "\n".join([*lines, *(str(path) for path in files.values())])


def _short(value: object) -> str:
    if value is None or value != value:  # not a number: nothing to say
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
