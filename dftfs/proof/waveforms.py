"""Inputs of a bench: shapes of unit size over time, with the words that describe them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

INTERVAL_S = 1e-3
LEAD_S = 0.3  # every recording starts with the machine left alone


@dataclass(frozen=True, kw_only=True)
class Waveform:
    """A unit input (peak 1), one value per sample, and its description."""

    values: np.ndarray
    description: str

    @property
    def time_s(self) -> np.ndarray:
        return INTERVAL_S * np.arange(self.values.size)


def _active_time(seconds: float) -> np.ndarray:
    """Time since the end of the lead, negative before it. Shape (samples,)."""
    return INTERVAL_S * np.arange(round(seconds / INTERVAL_S) + 1) - LEAD_S


def _made(time: np.ndarray, shape: np.ndarray, description: str) -> Waveform:
    shape = np.where(time < 0.0, 0.0, shape)
    peak = np.abs(shape).max()
    return Waveform(values=shape / peak if peak > 0.0 else shape, description=description)


def triangle(rng: np.random.Generator) -> Waveform:
    """A slow symmetric triangle of a few seconds' period whose second half is smaller."""
    period = float(rng.choice([6.0, 7.0, 8.0, 9.0]))
    time = _active_time(1.4 * period + 0.5)
    phase = (time / period) % 1.0
    shape = 1.0 - 4.0 * np.abs((phase + 0.25) % 1.0 - 0.5)
    shape = np.where(time < period, shape, 0.5 * shape)
    return _made(time, shape, f"slow triangle, {period:g} s period")


def sine(rng: np.random.Generator, frequencies_Hz: tuple[float, ...]) -> Waveform:
    f = float(rng.choice(frequencies_Hz))
    time = _active_time(min(12.0, max(6.0, 2.5 / f)))
    return _made(time, np.sin(2 * np.pi * f * time), f"{f:g} Hz sine")


def two_rates(rng: np.random.Generator) -> Waveform:
    """One amplitude at two rates, and a smaller one: what separates a loop from a lag."""
    slow, fast = float(rng.choice([0.15, 0.2])), float(rng.choice([1.0, 1.5]))
    time = _active_time(12.0)
    turn = 1.0 / slow
    shape = np.where(time < turn, np.sin(2 * np.pi * slow * time), 0.0)
    late = time - turn
    big = np.where((late > 0) & (late < 3.0), np.sin(2 * np.pi * fast * late), 0.0)
    small = np.where(late >= 3.0, 0.35 * np.sin(2 * np.pi * fast * late), 0.0)
    return _made(time, shape + big + small, f"sine of {slow:g} Hz, then {fast:g} Hz")


def multisine(rng: np.random.Generator) -> Waveform:
    """Random phases, 0.4 to 12 Hz, amplitude falling with frequency."""
    time = _active_time(float(rng.choice([7.0, 8.0])))
    lines = np.geomspace(0.4, 12.0, 14) * rng.uniform(0.97, 1.03, 14)
    phase = rng.uniform(0, 2 * np.pi, 14)
    sines = np.sin(2 * np.pi * lines * time[:, None] + phase) - np.sin(phase)
    fade = np.clip(time / 0.3, 0.0, 1.0)
    return _made(time, fade * (sines * lines**-0.3).sum(1), "multisine 0.4-12 Hz")


def chirp(rng: np.random.Generator) -> Waveform:
    time = _active_time(9.0)
    low, high, span = 0.3, float(rng.choice([12.0, 15.0])), 8.7
    rate = np.log(high / low) / span
    return _made(
        time, np.sin(2 * np.pi * low * np.expm1(rate * time) / rate), f"chirp 0.3-{high:g} Hz"
    )


def steps(rng: np.random.Generator) -> Waveform:
    time = _active_time(8.0)
    levels = np.array([1.0, 0.0, -0.6, 0.4, -1.0, 0.0]) * rng.choice([-1.0, 1.0])
    index = np.clip((time / 1.3).astype(int), 0, levels.size - 1)
    return _made(time, levels[index] * rng.uniform(0.7, 1.0, levels.size)[index], "steps")


def switching(rng: np.random.Generator) -> Waveform:
    """Random levels held for random times."""
    time = _active_time(7.0)
    edges = np.cumsum(rng.uniform(0.08, 0.6, 80))
    level = rng.uniform(-1.0, 1.0, edges.size + 1)
    return _made(time, level[np.searchsorted(edges, time)], "random switching")


def ramps(rng: np.random.Generator) -> Waveform:
    time = _active_time(9.0)
    knots = np.cumsum(np.r_[0.0, rng.uniform(0.3, 1.2, 20)])
    level = np.repeat(rng.uniform(-1.0, 1.0, 11), 2)[:21]
    level[0] = 0.0
    return _made(time, np.interp(time, knots, level), "ramps and holds")


def shaking(rng: np.random.Generator) -> Waveform:
    f = float(rng.choice([2.5, 3.0, 4.0]))
    time = _active_time(14.0)
    return _made(time, np.sin(2 * np.pi * f * time), f"{f:g} Hz shaking")


def square(rng: np.random.Generator) -> Waveform:
    f = float(rng.choice([0.7, 0.8, 0.9]))
    time = _active_time(8.0)
    return _made(time, np.sign(np.sin(2 * np.pi * f * time)), f"{f:g} Hz square")


def two_tones(rng: np.random.Generator) -> Waveform:
    a, b = rng.uniform(0.3, 0.5), rng.uniform(0.9, 1.4)
    time = _active_time(7.0)
    return _made(
        time, np.sin(2 * np.pi * a * time) + 0.6 * np.sin(2 * np.pi * b * time), "two tones"
    )


def press(rng: np.random.Generator) -> Waveform:
    time = _active_time(9.0)
    period = float(rng.choice([5.0, 6.0]))
    return _made(time, np.sin(2 * np.pi * time / period), "slow press")


def nothing(rng: np.random.Generator) -> Waveform:
    """No drive at all; the bench lets the link go from an angle."""
    time = _active_time(float(rng.choice([4.0, 5.0])))
    return Waveform(values=np.zeros(time.size), description="let go")


WAVEFORMS: dict[str, Callable[[np.random.Generator], Waveform]] = {
    "triangle": triangle,
    "slow-sine": lambda rng: sine(rng, (0.15, 0.2, 0.3)),
    "sine": lambda rng: sine(rng, (0.4, 0.5, 0.7)),
    "fast-sine": lambda rng: sine(rng, (0.9, 1.2, 1.6)),
    "two-rates": two_rates,
    "multisine": multisine,
    "chirp": chirp,
    "steps": steps,
    "switching": switching,
    "ramps": ramps,
    "shaking": shaking,
    "square": square,
    "two-tones": two_tones,
    "press": press,
    "let-go": nothing,
}
