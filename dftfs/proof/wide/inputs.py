"""Shapes of unit peak over time, with the words that describe them."""

import numpy as np
from scipy.signal import max_len_seq

KINDS = ("chirp", "steps", "ramps", "triangle", "sine", "multisine", "noise", "prbs")


def shape(
    rng: np.random.Generator, kind: str, time: np.ndarray, cycle_s: float
) -> tuple[np.ndarray, str]:
    """A shape about as fast as ``cycle_s`` at these times. Starts at 0. ((n,), words)"""
    end, f = float(time[-1]), 1.0 / cycle_s
    period = cycle_s * rng.uniform(0.6, 3.0)
    if kind == "chirp":
        low, high = f * rng.uniform(0.15, 0.4), f * rng.uniform(1.5, 4.0)
        rate = np.log(high / low) / end
        values = np.sin(2 * np.pi * low * np.expm1(rate * time) / rate)
        description = f"chirp {low:.3g}-{high:.3g} Hz"
    elif kind == "steps":
        levels = rng.uniform(-1.0, 1.0, int(end / period) + 2)
        levels[0] = 0.0
        values, description = levels[(time / period).astype(int)], f"steps every {period:.3g} s"
    elif kind == "ramps":
        knots = np.arange(0.0, end + 2 * period, period)
        levels = rng.uniform(-1.0, 1.0, knots.size)
        levels[0] = 0.0
        held = np.repeat(levels, 2)[1 : knots.size + 1]
        values, description = np.interp(time, knots, held), f"ramps and holds of {period:.3g} s"
    elif kind == "triangle":
        period *= 2.0
        values = 2.0 / np.pi * np.arcsin(np.sin(2 * np.pi * time / period))
        description = f"triangle, {period:.3g} s period"
    elif kind == "sine":
        values, description = np.sin(2 * np.pi * time / period), f"sine {1.0 / period:.3g} Hz"
    elif kind == "multisine":
        lines = np.geomspace(0.2 * f, 3.0 * f, 12) * rng.uniform(0.95, 1.05, 12)
        phase = rng.uniform(0.0, 2 * np.pi, 12)
        sines = np.sin(2 * np.pi * lines * time[:, None] + phase) - np.sin(phase)
        values = (sines * lines**-0.5).sum(1) * np.clip(time * f, 0.0, 1.0)
        description = f"multisine {lines[0]:.3g}-{lines[-1]:.3g} Hz"
    elif kind == "noise":
        knots = np.arange(0.0, end + cycle_s, 0.3 * cycle_s)
        levels = rng.normal(size=knots.size)
        levels[0] = 0.0
        values, description = np.interp(time, knots, levels), f"noise below {1.5 * f:.3g} Hz"
    else:
        hold = 0.35 * period
        bits = 2.0 * max_len_seq(9, state=rng.integers(0, 2, 9) | np.eye(9, dtype=int)[0])[0] - 1.0
        values = bits[(time / hold).astype(int) % bits.size] * (time > 0.0)
        description = f"pseudorandom binary, {hold:.3g} s a bit"
    return values / max(np.abs(values).max(), 1e-9), description
