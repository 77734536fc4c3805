"""Signatures that are slopes: on load, on deflection beyond a band, on time, on a rate."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.locate.signature_rows import (
    MOTION,
    WHAT,
    PortRows,
    Signature,
    slope_of,
    unit_of,
)

LEAST_EXPLAINED = 0.05  # of a torque's variance: a smaller slope is not worth a sentence


def quadrant_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """Friction against transmitted torque, driving and driven."""
    speed, torque = rows.signals.get(MOTION["wheel"]), rows.signals.get("torque_Nm")
    if rows.port != "G" or speed is None or torque is None:
        return []
    moving = np.abs(speed) > 0.1 * np.sqrt(np.mean(speed**2))
    friction, load = -rows.torque * np.sign(speed), np.abs(torque)
    found, block = [], rows.blocks()
    for quantity, side in (("driving", 1.0), ("being driven", -1.0)):
        mask = moving & (speed * torque * side > 0.0)
        if mask.sum() < 100 or np.ptp(load[mask]) <= 0.0:
            continue
        value, se, explained = slope_of(load[mask], friction[mask], block[mask], rng)
        if explained < LEAST_EXPLAINED:
            continue
        found.append(
            Signature(
                name=f"load slope {quantity}", port="G", value=value, se=se, unit="-",
                sentence=f"The gear's friction grows by {value:.3g} ± {se:.1g} Nm per Nm of"
                f" transmitted torque while {quantity}.",
                details={},
            )
        )  # fmt: skip
    return found


def band_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """A slope that begins beyond a deflection, against one that grows all the way."""
    if rows.port != "S" or "spring_deflection_rad" not in rows.signals:
        return []
    deflection, step = rows.signals["spring_deflection_rad"], max(1, rows.torque.size // 6000)
    x, y, block = deflection[::step], rows.torque[::step], rows.blocks()[::step]
    most = float(np.abs(x).max())
    if not most > 0.0:
        return []

    def fitted(column: NDArray) -> tuple[float, float]:
        X = np.column_stack([np.ones_like(x), x, column])
        solved, *_ = np.linalg.lstsq(X, y, rcond=None)
        return float(np.sum((y - X @ solved) ** 2)), float(solved[2])

    onsets = np.linspace(0.2, 0.9, 15) * most
    kinks = [np.sign(x) * np.maximum(np.abs(x) - d, 0.0) for d in onsets]
    costs = [fitted(kink)[0] for kink in kinks]
    best = int(np.argmin(costs))
    smooth_cost = fitted(x**3)[0]
    straight = float(np.sum((y - np.polyval(np.polyfit(x, y, 1), x)) ** 2))
    beyond = np.abs(x) > onsets[best]
    curved = y - np.polyval(np.polyfit(x, y, 1), x)
    value, se, explained = slope_of(kinks[best], curved, block, rng)
    if explained < LEAST_EXPLAINED:
        return []
    shape = "a kink fits better than a cubic" if costs[best] < smooth_cost else "a smooth growth"
    return [
        Signature(
            name="slope outside a band", port="S", value=value, se=se, unit="Nm/rad",
            sentence=f"The spring's missing torque changes slope beyond {onsets[best]:.3g} rad"
            f" ({100 * beyond.mean():.0f} % of the time) by {fitted(kinks[best])[1]:+.3g} Nm/rad;"
            f" {shape}.",
            details={
                "onset_rad": float(onsets[best]),
                "slope_Nm_per_rad": fitted(kinks[best])[1],
                "kink_over_cubic": costs[best] / max(smooth_cost, 1e-300),
                "kink_over_line": costs[best] / max(straight, 1e-300),
            },
        )
    ]  # fmt: skip


def trend_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """Drift of the torque itself over time, and with temperature where it was read."""
    found, block = [], rows.blocks()
    of = [("time", rows.time_s, "s")]
    if "temperature_C" in rows.signals and np.ptp(rows.signals["temperature_C"]) > 1.0:
        of.append(("temperature", rows.signals["temperature_C"], "degree"))
    for quantity, x, unit in of:
        centred = (
            x
            - np.bincount(rows.recording, x)[rows.recording]
            / np.bincount(rows.recording)[rows.recording]
        )
        value, se, explained = slope_of(centred, rows.torque, block, rng)
        if explained < LEAST_EXPLAINED:
            continue
        found.append(
            Signature(
                name=f"trend with {quantity}", port=rows.port, value=value, se=se,
                unit=f"{unit_of(rows.port)}/{unit}",
                sentence=f"The {WHAT[rows.port]} drifts by {value:+.3g} ± {se:.1g}"
                f" {unit_of(rows.port)} per {unit}.",
                details={},
            )
        )  # fmt: skip
    if "current_A" in rows.signals and rows.port == "V":
        current = rows.signals["current_A"]
        value, se, explained = slope_of(
            current * rows.time_s, rows.torque, block, rng, extra=current
        )
        if explained < LEAST_EXPLAINED:
            return found
        found.append(
            Signature(
                name="resistance trend", port="V", value=-value, se=se, unit="ohm/s",
                sentence=f"The winding's resistance grows by {-value:.3g} ± {se:.1g} ohm a second.",
                details={},
            )
        )  # fmt: skip
    return found


def lag_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """A torque that follows a rate of change: a delay of the command, a lag of the spring."""
    if rows.port == "S" and MOTION["deflection"] in rows.signals:
        rate = rows.signals[MOTION["deflection"]]
        value, se, explained = slope_of(rate, rows.torque, rows.blocks(), rng)
        if explained < LEAST_EXPLAINED:
            return []
        return [
            Signature(
                name="rate slope", port="S", value=value, se=se, unit="Nms/rad",
                sentence=f"The spring's missing torque is {value:+.3g} ± {se:.1g} Nms/rad times the"
                " rate of deflection.",
                details={},
            )
        ]  # fmt: skip
    if rows.port != "V" or "command" not in rows.signals:
        return []
    command = rows.signals["command"]
    change = np.concatenate(([0.0], np.diff(command)))
    change[np.concatenate(([True], np.diff(rows.recording) != 0))] = 0.0
    value, se, explained = slope_of(
        change / rows.row_s, rows.torque, rows.blocks(), rng, extra=command
    )
    if explained < LEAST_EXPLAINED:
        return []
    return [
        Signature(
            name="command lag", port="V", value=value, se=se, unit="V per (command/s)",
            sentence="The drive's error follows the command's rate of change: it acts"
            f" {'late' if value < 0 else 'early'}.",
            details={},
        )
    ]  # fmt: skip
