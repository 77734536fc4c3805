"""The laws that remember: hysteresis, relaxation, presliding, heat. Compiled.

Rate-independent memory is made of stop operators (Jenkins elements): a spring in series with
a dry slider. One sticks at an anchor, where its stretch is the coordinate less the anchor, or
slides at its yield stretch; the anchor moves only while it slides. So its memory is a number
and a mode that change at located events, not a differential equation: exact, and the same at
any speed to the bit.

    stretch = x - anchor (sticks, |stretch| <= yield),   +-yield (slides, way = +-1)

The Bouc-Wen stretch z, the Maxwell branches and the temperatures are states with the rates
given here, all per second:

    z'   = d' (1 - |z/y|^n (shape + (1 - shape) sgn(d' z)))        torque k z, |z| <= y
    q_i' = d' - q_i / T_i                                          torque k_i q_i
    C_w h_w' = R i^2 - G_wc (h_w - h_c),  C_c h_c' = G_wc (h_w - h_c) - G_ca h_c
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e

# stop operators: four of the spring's deflection, then the gear's and the load's presliding
N_STOPS = e.N_SLIPS + 2
GEAR_STOP, LOAD_STOP = e.N_SLIPS, e.N_SLIPS + 1


@njit(error_model="numpy", inline="always")
def stop_yield(fx, stop):
    """Yield stretch [rad] of a stop operator; zero where there is none."""
    if stop == GEAR_STOP:
        return fx[e.GEAR_PRESLIDING]
    if stop == LOAD_STOP:
        return fx[e.LOAD_PRESLIDING]
    return fx[e.SLIP_YIELD + stop]


@njit(error_model="numpy", inline="always")
def gear_presliding(fx, stop_deflection, side, direction, speed):
    """Torque [Nm] of the gear's elastic-plastic friction; it acts against the motion.

    Stretched to a side, it has the stiffness of that side's breakaway level over the yield
    stretch; where the levels differ the stiffness changes at zero stretch, a located event.
    """
    if direction != 0:
        return direction * e.gear_coulomb(fx, direction, speed)
    level = e.gear_coulomb(fx, 1 if side > 0.0 else -1, 0.0)
    return level * stop_deflection / fx[e.GEAR_PRESLIDING]


@njit(error_model="numpy", inline="always")
def load_presliding(fx, stop_deflection, direction, speed):
    """Torque [Nm] of the load joint's elastic-plastic friction; it acts against the motion."""
    if direction != 0:
        return direction * e.load_coulomb(fx, speed)
    return e.load_coulomb(fx, 0.0) * stop_deflection / fx[e.LOAD_PRESLIDING]


@njit(error_model="numpy", inline="always")
def bouc_wen_rate(fx, stop_deflection, rate, same):
    """Rate [rad/s] of the Bouc-Wen stretch; `same`: 1 where rate and stretch have one sign."""
    share = np.abs(stop_deflection / fx[e.BOUC_WEN_YIELD]) ** fx[e.BOUC_WEN_EXPONENT]
    shape = fx[e.BOUC_WEN_SHAPE]
    return rate * (1.0 - share * (shape + (1.0 - np.abs(shape)) * same))


@njit(error_model="numpy", inline="always")
def branch_rate(fx, branch, stop_deflection, rate):
    """Rate [rad/s] of the elastic stretch of a Maxwell branch."""
    if fx[e.BRANCH_TIME + branch] == 0.0:
        return 0.0
    return rate - stop_deflection / fx[e.BRANCH_TIME + branch]


@njit(error_model="numpy", inline="always")
def heat_rates(fx, winding, case, joule_W):
    """Rates [K/s] of the temperature rises of winding and case over the ambient."""
    if fx[e.WINDING_CAPACITY] == 0.0:
        return 0.0, 0.0
    passed = fx[e.WINDING_TO_CASE] * (winding - case)
    lost = fx[e.CASE_TO_AMBIENT] * case
    return (joule_W - passed) / fx[e.WINDING_CAPACITY], (passed - lost) / fx[e.CASE_CAPACITY]


@njit(error_model="numpy")
def virgin_bouc_wen(fx, deflection):
    """Bouc-Wen stretch [rad] of a spring brought from zero to a deflection once."""
    if fx[e.BOUC_WEN] == 0.0 or deflection == 0.0:
        return 0.0
    side = 1.0 if deflection > 0.0 else -1.0
    steps = 50 + int(100.0 * abs(deflection) / fx[e.BOUC_WEN_YIELD])
    h, z = abs(deflection) / steps, 0.0
    for _ in range(steps):
        a = bouc_wen_rate(fx, z, 1.0, 1.0)
        b = bouc_wen_rate(fx, z + 0.5 * h * a, 1.0, 1.0)
        c = bouc_wen_rate(fx, z + 0.5 * h * b, 1.0, 1.0)
        d = bouc_wen_rate(fx, z + h * c, 1.0, 1.0)
        z += h * (a + 2.0 * b + 2.0 * c + d) / 6.0
    return side * (z if fx[e.BOUC_WEN_SHAPE] < 0.0 else min(z, fx[e.BOUC_WEN_YIELD]))
