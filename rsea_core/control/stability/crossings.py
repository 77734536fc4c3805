"""Where a loop's frequency response crosses the circle and the axis that decide its margins.

Crossings are bracketed on a grid that is dense around every resonance of the open loop, then
located by Brent's method on the response itself. The signs are those of python-control: a
phase margin below 0 is an angle by which the loop is beyond -180 degrees at its gain crossover.

Source: Astrom & Murray, Feedback Systems (2008), section 9.3.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

Response = Callable[[NDArray], NDArray]
"""Frequencies [Hz] (f,) to the open loop, complex (f,)."""

SLOWEST_Hz = 1e-2
FREQUENCIES = 2000
AROUND = 12  # frequencies on either side of a resonance
NOT_A_CROSSING = 1e-3  # of the axis or circle: the sign changed through a pole on the circle


@dataclass(frozen=True, kw_only=True)
class Crossings:
    """Every crossing of a loop.

    Attributes
    ----------
    gain_Hz, gain_dB : arrays
        Crossings of the negative real axis, and the gain change that would bring each to -1.
    phase_Hz, phase_deg : arrays
        Crossings of magnitude one, and the signed phase margin of each, in -180..180.
    modulus_margin, modulus_Hz : float
        Smallest distance from -1, and where.
    """

    gain_Hz: NDArray
    gain_dB: NDArray
    phase_Hz: NDArray
    phase_deg: NDArray
    modulus_margin: float
    modulus_Hz: float

    @property
    def gain_margin(self) -> tuple[float, float]:
        """Nearest gain change [dB] that brings the loop to -1 and its frequency; inf, NaN: none."""
        return _nearest(self.gain_dB, self.gain_Hz)

    @property
    def gain_rise_dB(self) -> float:
        """Smallest rise of the gain that brings the loop to -1, inf where there is none."""
        return float(self.gain_dB[self.gain_dB > 0.0].min(initial=np.inf))

    @property
    def gain_fall(self) -> tuple[float, float]:
        """Smallest fall of the gain [dB, below 0] that does, and its frequency; -inf, NaN: none."""
        falls = self.gain_dB < 0.0
        if not falls.any():
            return -np.inf, np.nan
        return _nearest(self.gain_dB[falls], self.gain_Hz[falls])

    @property
    def phase_margin(self) -> tuple[float, float]:
        """Nearest phase margin [deg] and its frequency; inf, NaN: no gain crossover."""
        return _nearest(self.phase_deg, self.phase_Hz)

    @property
    def delay_margin_s(self) -> float:
        """Shortest delay that turns a crossing of magnitude one to -1; inf: none does."""
        lag = np.radians(self.phase_deg) % (2.0 * np.pi)
        return float((lag / (2.0 * np.pi * self.phase_Hz)).min(initial=np.inf))


def _nearest(values: NDArray, where: NDArray) -> tuple[float, float]:
    if not values.size:
        return np.inf, np.nan
    j = int(np.abs(values).argmin())
    return float(values[j]), float(where[j])


def crossings(response: Response, sample_time_s: float, poles: NDArray) -> Crossings:
    """Locate every crossing of a sampled loop between 0.01 Hz and half its sampling rate.

    Parameters
    ----------
    poles : complex array
        Of the open loop, in z; the grid is refined around those near the unit circle.
    """
    f = _grid(sample_time_s, poles)
    L = response(f)

    def at(frequency: float) -> complex:
        return complex(response(np.array([frequency]))[0])

    gain_Hz = [
        g
        for g in _roots(f, L.imag, lambda x: at(x).imag)
        if at(g).real < 0.0 and abs(at(g).imag) < NOT_A_CROSSING * abs(at(g).real)
    ]
    if L[-1].real < 0.0:  # at half the sampling rate the loop is real
        gain_Hz.append(f[-1])
    with np.errstate(divide="ignore"):  # a loop that is 0 crosses nothing
        phase_Hz = [
            g
            for g in _roots(f, np.log(np.abs(L)), lambda x: np.log(abs(at(x))))
            if abs(abs(at(g)) - 1.0) < NOT_A_CROSSING
        ]
    nearest = int(np.abs(1.0 + L).argmin())
    ends = f[max(nearest - 1, 0)], f[min(nearest + 1, f.size - 1)]
    refined = minimize_scalar(
        lambda x: abs(1.0 + at(x)), bounds=ends, method="bounded", options={"xatol": 1e-9 * ends[1]}
    )
    least = min((float(abs(1.0 + L[nearest])), f[nearest]), (float(refined.fun), refined.x))
    return Crossings(
        gain_Hz=np.array(gain_Hz),
        gain_dB=np.array([-20.0 * np.log10(-at(g).real) for g in gain_Hz]),
        phase_Hz=np.array(phase_Hz),
        phase_deg=np.array([np.degrees(np.angle(-at(g))) for g in phase_Hz]),
        modulus_margin=least[0],
        modulus_Hz=float(least[1]),
    )


def _grid(sample_time_s: float, poles: NDArray) -> NDArray:
    half = 0.5 / sample_time_s
    parts = [np.geomspace(min(SLOWEST_Hz, 1e-4 * half), half, FREQUENCIES)]
    for pole in np.asarray(poles):
        centre = abs(np.angle(pole)) / (2.0 * np.pi * sample_time_s)
        width = max(abs(np.log(max(abs(pole), 1e-300))) / (2.0 * np.pi * sample_time_s), 1e-9)
        if 0.0 < centre <= half and width < 0.1 * half:
            steps = width * np.geomspace(0.05, 30.0, AROUND)
            parts.append(centre + np.concatenate((-steps, [0.0], steps)))
    f = np.unique(np.concatenate(parts))
    return f[(f > 0.0) & (f <= half)]


def _roots(f: NDArray, values: NDArray, function: Callable[[float], float]) -> list[float]:
    found = []
    for i in np.flatnonzero(np.diff(np.signbit(values)) != 0):
        if values[i + 1] == 0.0 or values[i] == 0.0:
            found.append(float(f[i + 1] if values[i + 1] == 0.0 else f[i]))
        elif np.signbit(function(f[i])) != np.signbit(function(f[i + 1])):
            found.append(float(brentq(function, f[i], f[i + 1], xtol=1e-14, rtol=1e-13)))
    return found
