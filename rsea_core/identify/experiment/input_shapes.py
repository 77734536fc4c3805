"""The inputs that a next experiment may use: shapes of unit amplitude, and what limits them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ROW_s = 2e-3
REST_s = 0.5  # before and after, so that a start at rest shows
FREQUENCIES_Hz = (0.4, 0.7, 1.1, 1.7, 2.5, 3.6, 5.2, 7.3, 9.6, 12.0)
PHASES = (0.0, 2.1, 4.6, 1.3, 5.2, 3.7, 0.6, 2.9, 5.9, 4.1)  # low crest, no period of its own


@dataclass(frozen=True, kw_only=True)
class Shape:
    """An input of unit amplitude, a sample a row of `ROW_s`.

    Attributes
    ----------
    words : str
        How a person at the bench would say it.
    value : (n,) array
    """

    description: str
    value: NDArray

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.value.size * ROW_s


def shapes() -> Mapping[str, Shape]:
    """The menu by name."""
    return {
        "triangle": Shape(
            description="a slow triangle at full, half and quarter amplitude",
            value=_framed([a * _triangle(8.0) for a in (1.0, 0.5, 0.25)]),
        ),
        "multisine": Shape(
            description="a multisine from 0.4 to 12 Hz", value=_framed([_multisine(10.0)])
        ),
        "sine-pair": Shape(
            description="a sine of one amplitude at 0.2 Hz and again at 2 Hz",
            value=_framed([_sine(0.2, 10.0), _sine(2.0, 6.0)]),
        ),
        "steps": Shape(
            description="steps of both signs, each held 1.5 s",
            value=_framed([np.repeat([1.0, 0.0, -1.0, 0.5, -0.5, 1.0, -1.0, 0.0], 750)]),
        ),
        "warm-run": Shape(
            description="a minute of 3 Hz shaking", value=_framed([_sine(3.0, 60.0)])
        ),
        "hold": Shape(
            description="a quick load held for 15 s and let go for 5 s",
            value=_framed([np.repeat([1.0, 0.0], (7500, 2500))]),
        ),
    }


def _framed(parts: list[NDArray]) -> NDArray:
    rest = np.zeros(round(REST_s / ROW_s))
    return np.concatenate([rest, *parts, rest])


def _time(seconds: float) -> NDArray:
    return np.arange(round(seconds / ROW_s)) * ROW_s


def _triangle(period_s: float) -> NDArray:
    return 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * _time(period_s) / period_s))


def _sine(frequency_Hz: float, seconds: float) -> NDArray:
    return np.sin(2.0 * np.pi * frequency_Hz * _time(seconds))


def _multisine(seconds: float) -> NDArray:
    time = _time(seconds)
    value = sum(
        np.sin(2.0 * np.pi * f * time + p) for f, p in zip(FREQUENCIES_Hz, PHASES, strict=True)
    )
    return value / np.abs(value).max()
