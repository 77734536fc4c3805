"""How the current of a winding moves within one step of the fixed-step engine, and its heat."""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.body_steps import clip
from rsea_core.engines.fixed_step.layout import CASE_RISE, WINDING_RISE

DEAD_TIME_PASSES = 3
source_ohm = njit(error_model="numpy")(e.source_ohm.py_func)  # see `step_torques`


class Gains(NamedTuple):
    """How a winding's current follows over a step, see `winding_gains`."""

    decay: float
    lag: float
    ramp: float
    last_ramp: float


class Winding(NamedTuple):
    """A winding's current and what it follows by."""

    current: float  # [A]
    copper: float  # resistance [ohm] at its temperature
    torque_per_ampere: float
    volts_per_speed: float
    resistance: float  # with the supply's
    per_ohm: float
    rate: float  # resistance over inductance [1/s]
    settled: float  # current [A] under the command at rest
    gains: Gains
    gains_of: float  # time constants that the gains are of


@njit(error_model="numpy")
def winding_gains(x):
    """How a winding's current follows over x time constants at a speed that changes evenly.

    None of the gains where the current follows at once (x = 0). With the back-EMF's current at
    the mean speed taken for `final`, and `gained` what it changes by: the end is final + (current
    - final) decay - last_ramp gained, the mean is final + (current - final) lag + ramp gained.
    Exact; a step is about as long as L / R, so that the mean speed alone leaves milliamperes.
    """
    if x == 0.0:
        return Gains(0.0, 0.0, 0.0, 0.0)
    decay = np.exp(-x)
    lag = (1.0 - decay) / x
    if x < 1e-3:
        return Gains(decay, lag, x / 12.0, x * x / 12.0)
    return Gains(decay, lag, (1.0 - lag) / x - 0.5 * lag, 0.5 * (1.0 + decay) - lag)


@njit(error_model="numpy")
def near_mean(current, final, x):
    """About the mean over x time constants of a current that heads for `final`; at once: 0."""
    return final if x == 0.0 else current + (final - current) * x / (2.0 + x)


@njit(error_model="numpy")
def mean_to_edge(current, final, edge, x):
    """Mean of a current that heads for `final` over x time constants and is held at an edge."""
    if x == 0.0:
        return edge
    left = (edge - final) / (current - final) if current != final else 1.0
    if not 0.0 < left < 1.0:
        return edge
    share = min(-np.log(left) / x, 1.0)
    return share * final + (current - edge) / x + (1.0 - share) * edge


@njit(error_model="numpy")
def rounded(x):
    """A number to 33 bits: rows of a recording that differ by round-off are of one length."""
    c = x * 1048577.0  # 2^20 + 1 (Veltkamp)
    return c - (c - x)


@njit(error_model="numpy")
def warm_winding(plant, fx, y):
    """Resistance, torque and speed constant of the winding at its temperatures."""
    rise = 1.0 + fx[e.RESISTANCE_RISE] * y[WINDING_RISE]
    weaker = 1.0 - fx[e.CONSTANT_FALL] * y[CASE_RISE]
    weaker -= fx[e.CONSTANT_FALL_WINDING] * y[WINDING_RISE]
    return (
        plant.resistance * rise,
        plant.torque_per_ampere * weaker,
        plant.volts_per_speed * weaker,
    )


@njit(error_model="numpy")
def warm_up(fx, y, heat, h):
    """Warm winding and case for h under a heat flow [W]; explicit midpoint."""
    winding, case = y[WINDING_RISE], y[CASE_RISE]
    middle_w, middle_c = winding, case
    for length in (0.5 * h, h):
        across = fx[e.WINDING_TO_CASE] * (middle_w - middle_c)
        out = fx[e.CASE_TO_AMBIENT] * middle_c
        middle_w = winding + length * (heat - across) / fx[e.WINDING_CAPACITY]
        middle_c = case + length * (across - out) / fx[e.CASE_CAPACITY]
    y[WINDING_RISE], y[CASE_RISE] = middle_w, middle_c


@njit(error_model="numpy", forceinline=True)
def winding_of(machine, fx, y, current):
    """The winding before its first step."""
    copper, k_t, k_e = warm_winding(machine.plant, fx, y)
    per_ohm = 1.0 / copper if copper > 0.0 else 0.0
    return Winding(
        current, copper, k_t, k_e, copper, per_ohm, copper * machine.per_henry, 0.0,
        Gains(0.0, 0.0, 0.0, 0.0), -1.0,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def winding_in_piece(machine, fx, y, piece, winding):
    """The winding under the command of a piece; gains are kept while what they are of stays."""
    current, copper, k_t, k_e, resistance, per_ohm, rate, settled, gains, gains_of = winding
    if machine.source_resistance:
        copper, k_t, k_e = warm_winding(machine.plant, fx, y)
        resistance = copper + source_ohm(fx, piece.command, piece.command)
        per_ohm, rate = 1.0 / resistance, resistance * machine.per_henry
    settled = 0.0
    if machine.winding:
        x = rounded(piece.h) * rate
        if x != gains_of:
            gains_of = x
            gains = winding_gains(x)
    elif machine.plant.drive == mp.CURRENT:
        current = clip(piece.command, machine.plant.current_limit)
    if piece.electric:
        settled = piece.volts * per_ohm
    if not piece.closed:
        current = 0.0
    return Winding(current, copper, k_t, k_e, resistance, per_ohm, rate, settled, gains, gains_of)


@njit(error_model="numpy", forceinline=True)
def winding_in_step(machine, fx, piece, winding, factor, mean):
    """The winding where the supply or the bridge makes its resistance depend on the current.

    Parameters
    ----------
    factor : float
        Of both constants, by the ripple over the motor's angle.
    mean : float
        Speed of the gear in the step.
    """
    current, copper, k_t, k_e, resistance, per_ohm, rate, settled, gains, gains_of = winding
    if machine.without_regeneration and piece.electric:
        final = (piece.volts - k_e * factor * mean) / copper
        heading = near_mean(current, final, piece.h * copper * machine.per_henry)
        resistance = copper + source_ohm(fx, piece.command, heading)
        per_ohm, rate = 1.0 / resistance, resistance * machine.per_henry
        settled, gains_of = piece.volts * per_ohm, rounded(piece.h) * rate
        gains = winding_gains(gains_of)
    if machine.full and piece.electric and machine.dead_time_V > 0.0:
        # dead time of a bridge takes voltage against the current, softly about zero: a
        # resistance that falls with the current, of the step's mean one
        reached = current
        for _ in range(DEAD_TIME_PASSES):
            size = max(abs(reached), 1e-6 * fx[e.DEAD_TIME_CURRENT])
            lost = machine.dead_time_V * np.tanh(size / fx[e.DEAD_TIME_CURRENT]) / size
            per_ohm = 1.0 / (resistance + lost)
            settled = piece.volts * per_ohm
            x, gains_of = piece.h * (resistance + lost) * machine.per_henry, -1.0
            gains = winding_gains(x)
            final = settled - k_e * factor * per_ohm * mean
            reached = final + (current - final) * gains.lag
    return Winding(current, copper, k_t, k_e, resistance, per_ohm, rate, settled, gains, gains_of)


@njit(error_model="numpy", forceinline=True)
def goal_in_step(machine, fx, piece, winding, angle, speed):
    """The servo in a step that begins at an angle and a speed of the gear.

    Its gain on the angle acts on the mean angle of the step, which is implicit: half a step of
    the mean speed makes it a damping added to that of the servo. Beyond the dead band, by the angle
    that the speed foresees, the goal is shifted by its width.
    """
    plant = machine.plant
    band, short, slope = plant.goal_dead_band + fx[e.GOAL_DEAD_BAND], 0.0, 0.0
    if piece.electric:
        short, slope = piece.command - angle, plant.volts_per_command
        if band > 0.0:
            ahead = short - piece.half * speed
            if abs(ahead) <= band:
                slope = 0.0
            short -= band if ahead > 0.0 else -band
    return Winding(
        winding.current, winding.copper, winding.torque_per_ampere,
        plant.volts_per_speed + slope * piece.half, winding.resistance, winding.per_ohm,
        winding.rate, slope * short, winding.gains, winding.gains_of,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def with_current(winding, current):
    """The winding at another current."""
    return Winding(
        current, winding.copper, winding.torque_per_ampere, winding.volts_per_speed,
        winding.resistance, winding.per_ohm, winding.rate, winding.settled, winding.gains,
        winding.gains_of,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def winding_after(machine, fx, y, piece, winding, speed, heat):
    """The winding after a piece, warmed in `y` by its heat: the sum of i^2 over the steps."""
    if machine.servo:
        winding = with_current(winding, 0.0)
    elif machine.winding and piece.closed and machine.plant.inductance == 0.0:
        at_once = winding.settled - winding.volts_per_speed * speed * winding.per_ohm
        winding = with_current(winding, clip(at_once, machine.plant.current_limit))
    if machine.thermal:
        warm_up(fx, y, winding.copper * heat / piece.n, piece.length)
    return winding
