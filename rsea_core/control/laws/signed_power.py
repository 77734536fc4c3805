"""Sign-preserving powers, which the thesis calls "fractional", and their gain at an amplitude.

    spow(x, p) = sgn(x) |x|^p,  and 0 at x = 0 for every p

It is a static function of the error, no derivative of fractional order (those are in
`fractional`). For p < 1 its slope at zero is infinite and for p = 0 it is a relay, so that a
gain or a margin means something only at a stated amplitude: the describing function, the ratio
of the first harmonic of spow(A sin t, p) to A, is

    N(A) = (2 / sqrt(pi)) Gamma(p/2 + 1) / Gamma((p + 3)/2) A^(p - 1)

Because of the power a gain converts between units by (180/pi)^p, not by 180/pi.

Source: the thesis' section 4.4.2 (its NEC algorithm); Gelb & Vander Velde, Multiple-Input
Describing Functions (1968), section 2.3.
"""

import math

from numba import njit


@njit(error_model="numpy", inline="always")
def spow(x, p):
    """sgn(x) |x|^p, 0 at 0."""
    if x == 0.0:
        return 0.0
    return abs(x) ** p if x > 0.0 else -(abs(x) ** p)


def describing_function(power: float, amplitude: float) -> float:
    """Gain of spow for a sine of this amplitude.

    Raises
    ------
    ValueError
        If the amplitude is not positive or the power negative.
    """
    if not amplitude > 0.0 or not power >= 0.0:
        raise ValueError(
            f"a describing function needs amplitude > 0 and power >= 0, not {amplitude}, {power}"
        )
    ratio = math.gamma(0.5 * power + 1.0) / math.gamma(0.5 * (power + 3.0))
    return 2.0 / math.sqrt(math.pi) * ratio * amplitude ** (power - 1.0)


def gain_per_radian(gain_per_degree_power: float, power: float) -> float:
    """A gain on spow(x in degrees) as the gain on spow(x in radians) that does the same."""
    return gain_per_degree_power * math.degrees(1.0) ** power
