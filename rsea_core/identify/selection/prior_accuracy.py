"""How well an owner knows the machine, as its constants say, and what that makes unlikely.

Tolerances say which constants are known well compared with which others; how well this rig file
knows them all shows in the constants themselves. Where most stay within a tenth of a tolerance,
three that moved by a whole one, all by the same factor, are no three errors. So the accuracy, a
common share of all tolerances, is unknown with every constant counted (the variance of unit weight
of geodesy, and its test of one suspect line: Pope, NOAA Technical Report NOS 65 NGS 1 (1976));
errors are Student's, so that single bad constants, which rig files have, speak for nothing but
themselves (Lange, Little and Taylor, JASA 84 (1989) 881).
"""

import numpy as np
from numpy.typing import NDArray

FREEDOM = 4.0  # of Student's distribution: what Lange, Little and Taylor use throughout
ACCURACIES = np.geomspace(0.1, 1.0, 30)
"""Shares of the tolerances that errors may have: none knows a machine to less than a tenth."""
KNOWN = 0.7  # standard deviation [tolerances] below which recordings know a constant
WIDEST = 0.3  # logarithm of the largest factor that is thought of
FACTORS = np.linspace(-WIDEST, WIDEST, 241)


def log_density(moves: NDArray, std: NDArray) -> NDArray:
    """Logarithms (m,) of the density of constants' errors, whatever the prior scale factor.

    Up to the constant of Student's distribution, once for each constant of the machine.

    Parameters
    ----------
    moves : (m, n) array
        Of constants from the rig file's, in tolerances.
    std : (n,) array
        How well the recordings know them, in tolerances.
    """
    widths = np.hypot(ACCURACIES[:, None], std)
    squares = (moves[:, None, :] / widths) ** 2
    each = -0.5 * (FREEDOM + 1.0) * np.log1p(squares / FREEDOM) - np.log(widths)
    return _log_mean(each.sum(axis=2))


def shared_factor(moves: NDArray, std: NDArray, direction: NDArray) -> tuple[float, float]:
    """Whether constants share a common factor rather than have all their own errors.

    Parameters
    ----------
    moves, std : (n,) arrays
        As in `log_density`; constants that recordings do not know count for nothing.
    way : (n,) array
        Tolerances that each constant moves by where the logarithm of the factor is one.

    Returns
    -------
    log_odds : float
        The logarithm of the odds, the factor unknown within `WIDEST`.
    factor : float
        Logarithm of the likeliest.
    """
    seen = std < KNOWN
    if not np.any(direction[seen]):
        return -np.inf, 0.0
    moves, std, direction = moves[seen], std[seen], direction[seen]
    found = log_density(moves - FACTORS[:, None] * direction, std)
    own = log_density(moves[None], std)[0]
    return float(_log_mean(found[None])[0] - own), float(FACTORS[np.argmax(found)])


def _log_mean(values: NDArray) -> NDArray:
    """Logarithms (m,) of means of exponentials of (m, n)."""
    most = values.max(axis=1)
    return most + np.log(np.mean(np.exp(values - most[:, None]), axis=1))
