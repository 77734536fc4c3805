"""Tables of a comparison: figures, remarks, disturbances, values of the controllers."""

from collections.abc import Mapping, Sequence

from dftfs.report.study.tables import Table

SHOWN = {
    "expected_rmse": "RMSE, expected",
    "rmse": "RMSE",
    "ranked": "ranked",
    "peak_error": "peak error",
    "overshoot_percent": "overshoot (%)",
    "settling_s": "settling (s)",
    "command_rms": "command rms",
    "command_change": "change per sample",
    "gain_margin_dB": "gain margin (dB)",
    "phase_margin_deg": "phase margin (°)",
    "modulus_margin": "modulus margin",
    "limit_cycle_Hz": "limit cycle (Hz)",
    "noisy_rmse": "RMSE with noise",
    "monte_carlo_rmse_mean": "RMSE, random machines (mean)",
    "monte_carlo_rmse_std": "standard deviation",
    "monte_carlo_rmse_worst": "worst",
    "wrong_compensator_rmse": "RMSE, compensator 30 % wrong",
    "wrong_compensator_percent": "increase (%)",
}


def moved_text(tolerances: Mapping) -> str:
    """What differs from random machine to random machine: standard deviations, relative or not."""
    shown = [
        f"{key} {100.0 * spread:.3g} %" if isinstance(spread, float) else f"{key} {spread.size:.3g}"
        for key, spread in tolerances.items()
    ]
    return ", ".join(shown) or "nothing"


def figures_table(comparison, verdicts: Sequence) -> Table:
    rows = [v.as_row() for v in verdicts]
    kept = [key for key in SHOWN if any(row[key] is not None for row in rows)]
    cells = [[row["controller"], *(_short(row[key]) for key in kept)] for row in rows]
    task = comparison.task
    return Table(
        caption=f"Figures, errors in {task.reference.unit}, from {task.from_s:g} s on",
        head=("controller", *(SHOWN[key] for key in kept)),
        rows=tuple(tuple(row) for row in cells),
        numeric=tuple(range(1, len(kept) + 1)),
    )


def reasons_table(verdicts: Sequence) -> Table | None:
    """What a reader of the ranking must know of each loop: why no rank, what is at a bound."""
    rows = [(v.name, "not ranked", reason) for v in verdicts for reason in v.reasons]
    rows += [(v.name, "at its bound", str(bound)) for v in verdicts for bound in v.at_bounds]
    rows += [
        (v.name, "conditionally stable", f"its gain may fall by {-v.margins.gain_fall_dB:.3g} dB")
        for v in verdicts
        if v.margins is not None and v.margins.is_stable and v.margins.gain_fall_dB > -60.0
    ]
    rows += [
        (v.name, "at full command", f"{v.limited_share:.1%} of the judged time")
        for v in verdicts
        if v.limited_share > 0.01
    ]
    rows += [
        (v.name, "off the reference", f"{v.following.steady_state_error:.3g} at the end")
        for v in verdicts
        if v.cycle is None and abs(v.following.steady_state_error) > 0.9 * v.following.rmse > 0.0
    ]
    if not rows:
        return None
    return Table(
        caption="Remarks", head=("controller", "what", "how much"), rows=tuple(rows), numeric=()
    )


def disturbed_table(comparison, verdicts: Sequence) -> Table | None:
    unit = comparison.task.reference.unit
    rows = tuple(
        (v.name, d.name, _short(d.rmse), _short(d.peak_deviation), _short(d.recovery_s))
        for v in verdicts
        for d in v.robustness.disturbed
    )
    if not rows:
        return None
    return Table(
        caption="External torques on the load: RMSE, largest difference to the same loop without"
        " them, time from their end until 5 % of it are left",
        head=("controller", "disturbance", f"RMSE ({unit})", f"largest ({unit})", "recovery (s)"),
        rows=rows,
        numeric=(2, 3, 4),
    )


def values_table(verdicts: Sequence) -> Table:
    rows = []
    for verdict in verdicts:
        for key, value in vars(verdict.controller).items():
            text = _short(value) if isinstance(value, float) else str(value)
            rows.append((verdict.name, key, text))
    return Table(
        caption="Controller parameters used in this comparison",
        head=("controller", "field", "value"),
        rows=tuple(rows),
        numeric=(2,),
    )


def _short(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
