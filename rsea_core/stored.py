"""Energy that the laws of `effects` store, for arrays of states: the ledger's side of them."""

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects as e
from rsea_core.uniform_spline import spline_integral


def one_less_cosine(angle: NDArray) -> NDArray:
    """1 - cos, with all its digits at small angles too [rad]."""
    return 2.0 * np.sin(0.5 * angle) ** 2


def stored_J(fx, wheel, load):
    """Energy that terms store [J] for arrays of wheel and load angle [rad]."""
    stored = 0.5 * fx[e.PARALLEL] * (load - fx[e.PARALLEL_REST]) ** 2
    stored = stored + fx[e.GEAR_OFFSET] * wheel
    stored = stored + fx[e.UNBALANCE] * one_less_cosine(load + fx[e.UNBALANCE_ANGLE])
    for wave in e.COGGING_WAVES:
        if fx[wave] != 0.0:
            angle = fx[wave + 1] * wheel + fx[wave + 2]
            stored = stored + fx[wave] / fx[wave + 1] * one_less_cosine(angle)
    if fx[e.POSITION_STEP] != 0.0:
        u = (np.asarray(load) - fx[e.POSITION_FIRST]) / fx[e.POSITION_STEP]
        for j in range(e.N_POSITIONS):
            node = fx[e.POSITION_TORQUE + j] * fx[e.POSITION_STEP]
            stored = stored - node * spline_integral(u - j)
    return stored


def contact_stored_J(fx, stiffness, depth):
    """Energy stored in a contact [J] for an array of depths [rad], none below zero."""
    if fx[e.EXPONENT] == 0.0:
        return 0.5 * stiffness * depth**2
    p, reference = fx[e.EXPONENT], fx[e.DEPTH]
    return stiffness * reference**2 * (depth / reference) ** (p + 1.0) / (p + 1.0)
