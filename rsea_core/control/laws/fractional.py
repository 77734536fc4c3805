"""True operators of fractional order, and a PI^lambda D^mu torque loop made of them.

The thesis' "fractional" exponents are static powers (`signed_power`); here s^mu itself is meant.
Two realisations: Grunwald-Letnikov's sum, which is exact for vanishing steps and needs the whole
past, and Oustaloup's chain of first-order sections, which is right within a band of frequencies
and cheap enough for a loop:

    s^mu = w_h^mu prod_k (s + w'_k) / (s + w_k),   k = 0 .. n-1
    w'_k = w_b (w_h/w_b)^((k + 1/2 - mu/2) / n),   w_k = w_b (w_h/w_b)^((k + 1/2 + mu/2) / n)

each section sampled by the bilinear rule, its zero and pole prewarped (w -> 2/T tan(w T / 2)) so
that they stay at their frequencies, and the whole scaled to be exact in the middle of the band.
A chain is off by up to half its phase at its own ends: it begins a decade below the band.

Source: Podlubny, Fractional Differential Equations (1999), section 7.3; Oustaloup, Levron,
Mathieu & Nanot, IEEE Trans. Circuits Syst. I 47 (2000) 25; Monje et al., Fractional-order
Systems and Controls (2010), section 12.1.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import cfunc, njit
from numpy.typing import ArrayLike, NDArray

import rsea_core.control.laws.torque_loop as loop
import rsea_core.engines.event_driven.states as k
from rsea_core.errors import ControllerError
from rsea_core.numeric.source_version import SOURCE_VERSION

SECTIONS = 9
BELOW = 0.1  # of the lowest frequency asked for, where the chain begins
KP, KI, KD = range(loop.N_SHARED, loop.N_SHARED + 3)
I_CHAIN = loop.N_SHARED + 3
D_CHAIN = I_CHAIN + 1 + 2 * SECTIONS
SPRING = D_CHAIN + 1 + 2 * SECTIONS
I_STATE = loop.N_SHARED_STATE
D_STATE = I_STATE + 2 * SECTIONS
N_STATE = D_STATE + 2 * SECTIONS


def grunwald_letnikov(values: ArrayLike, order: float, step_s: float) -> NDArray:
    """Derivative of real order of evenly sampled values that are zero before the first.

    First order accurate in the step. Negative orders integrate.
    """
    x = np.asarray(values, dtype=float)
    j = np.arange(1, x.size)
    weights = np.concatenate(([1.0], np.cumprod(1.0 - (order + 1.0) / j)))
    return np.convolve(x, weights)[: x.size] / step_s**order


def oustaloup(order: float, low_rad_per_s: float, high_rad_per_s: float, sections: int = SECTIONS):
    """Gain, zeros and poles [rad/s] of the chain of sections for s^order, -1 < order < 1.

    Raises
    ------
    ControllerError
        If the order or the band cannot be used.
    """
    if not -1.0 < order < 1.0 or not 0.0 < low_rad_per_s < high_rad_per_s:
        raise ControllerError(
            f"Oustaloup's chain needs -1 < order < 1 and 0 < low < high, not {order},"
            f" {low_rad_per_s:g}, {high_rad_per_s:g} rad/s"
        )
    place = (np.arange(sections) + 0.5) / sections
    span = high_rad_per_s / low_rad_per_s
    zeros = low_rad_per_s * span ** (place - 0.5 * order / sections)
    poles = low_rad_per_s * span ** (place + 0.5 * order / sections)
    return high_rad_per_s**order, zeros, poles


def chain(order: float, low: float, high: float, sample_time_s: float) -> NDArray:
    """The sampled chain as the loop reads it: gain, then per section its zero and pole in z.

    From `low` to 0.2 pi / T it is s^order to 3 % and 5 degrees for orders of -0.8 to 0.8; above,
    its magnitude is too large and its phase lags: of s^0.5 by 23 % and 29 degrees at 0.8 pi / T.
    """
    _, zeros, poles = oustaloup(order, BELOW * low, high)
    at = [
        (1.0 - warped) / (1.0 + warped)
        for warped in np.tan(0.5 * sample_time_s * np.array((zeros, poles)))
    ]
    middle = np.sqrt(low * high)
    z = np.exp(1j * middle * sample_time_s)
    gain = middle**order / np.abs(np.prod((z - at[0]) / (z - at[1])))
    return np.concatenate(([gain], np.column_stack(at).ravel()))


@njit(error_model="numpy", cache=True)
def through(p, first, s, state, x):
    """A sample through the chain whose numbers begin at `first`, its memory at `state`."""
    for i in range(SECTIONS):
        zero, pole = p[first + 1 + 2 * i], p[first + 2 + 2 * i]
        y = pole * s[state + 2 * i + 1] + x - zero * s[state + 2 * i]
        s[state + 2 * i], s[state + 2 * i + 1] = x, y
        x = y
    return p[first] * x


@dataclass(frozen=True, kw_only=True)
class FractionalPidTorque(loop.TorqueLoop):
    """PI^lambda D^mu torque loop with feedforward (`fo_pid`).

    Attributes
    ----------
    kp, ki, kd : float
        Nm/Nm, s^-lambda, s^mu.
    integral_order, derivative_order : float
        lambda and mu, above 0 and below 1. The integral is s^(1 - lambda) / s, so that a
        constant error still ends.
    band_low_rad_per_s : float
        Lowest frequency at which the operators hold; they do up to a tenth of the sampling rate
        (`chain`), and the chain of sections ends at 80 % of Nyquist's.

    The others, and what is raised, are those of `torque_loop.TorqueLoop`.
    """

    kind: ClassVar[str] = "fo-pid"
    gains: ClassVar[tuple[str, ...]] = ("kp", "ki", "kd")
    n_states: ClassVar[int] = N_STATE

    kp: float = 60.0
    ki: float = 10.0
    kd: float = 0.2
    integral_order: float = 0.8
    derivative_order: float = 0.5
    band_low_rad_per_s: float = 0.1

    def __post_init__(self):
        super().__post_init__()
        for name in ("integral_order", "derivative_order"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ControllerError(
                    f"{self.kind}: {name} = {getattr(self, name)} must be above 0 and below 1"
                    " (1 is the PID's)"
                )
        if not 0.0 < self.band_low_rad_per_s < self._high():
            raise ControllerError(
                f"{self.kind}: band_low_rad_per_s = {self.band_low_rad_per_s:g} must be above 0"
                f" and below {self._high():.4g}"
            )

    def _high(self) -> float:
        return 0.8 * np.pi / self.sample_time_s

    def own(self, machine: loop.LoopMachine):
        """The gains and both operators as chains of first-order sections."""
        band = self.band_low_rad_per_s, self._high(), self.sample_time_s
        integral = chain(1.0 - self.integral_order, *band)
        derivative = chain(self.derivative_order, *band)
        gains = [self.kp, self.ki, self.kd]
        return _compiled(SOURCE_VERSION), np.concatenate((gains, integral, derivative))


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def fractional(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        error = loop.sense(p, s, y, spring)
        torque, friction, compensated = loop.prepared(p, s, y, spring)
        slow = through(p, I_CHAIN, s, I_STATE, error)
        fast = through(p, D_CHAIN, s, D_STATE, error)
        torque += friction + p[KP] * error + p[KD] * fast
        base = p[loop.PER_TORQUE] * torque + p[loop.PER_SPEED] * compensated
        loop.give(p, command, loop.integrated(p, s, base, p[KI] * p[loop.T] * slow))

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(fractional)
