"""Bristles of dry friction (LuGre; without their damping and a Stribeck curve Dahl's). Compiled.

Where surfaces touch, bristles bend with the motion and give way once bent enough. For a speed w
and a level F(w) at which the surfaces slide, their deflection z [rad] and the torque against w are

    z'    = w s,    s = 1 - sgn(w) z / z_s(w)           s: share of a motion that bends them
    tau_f = sigma_0 z + sigma_1 w max(s, 0)
    sigma_0 = F(0) / z_b,    z_s(w) = z_b F(w) / F(0)

z_b is the deflection at which bristles at rest give way (`GEAR_PRESLIDING`, `LOAD_PRESLIDING`) and
F(w) = F_c (1 + rise exp(-|w / w_s|^p)). This is what a step of the fixed-step engine
(`body_steps.bristle_step`, `bristle_share`) converges to as it is halved. Source: Canudas de
Wit et al., IEEE Trans. Automatic Control 40 (1995) 419, eqs. 2 to 4, there with sigma_1 z' =
sigma_1 w s. Where s < 0 (bristles bent further than the grown speed lets them stay) that would
push the body on; without that part what is lost, sigma_0 w (1 - s) z + sigma_1 w^2 max(s, 0), is
never negative: they are passive at any sigma_1 (with it only at a small one: Barabanov and
Ortega, same journal 45 (2000) 830). Stored is sigma_0 z^2 / 2. Levels that differ in both
directions: the one of the side to which the bristles are bent.

Bristles of a loaded thread (`GEAR_BRISTLE` of 2) carry what a transmitted torque tau causes too:
F_c + c |tau| in place of F_c, where c is the loss of driving if tau acts to the side of the bend,
that of being back-driven if not. z does not depend on tau; where F_c + c |tau| is zero whatever
tau (the flanks apart, a direction without loss) bristles are let go, z = 0. They are passive under
a constant torque; one that grows while they are bent can get back more than they took, at most
c |tau| z_b / 2 each time, so that all their power counts as friction and nothing as stored.

Between events w keeps its sign, z its side and s its sign, so that all is smooth; the signs are
carried behind the states. Bristles beside set-valued friction rest where that holds the body.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k

# beyond a change of sign [rad/s; of z_b; of s], so that none comes of rounding
SLACK = 1e-13
# of a step times the rate |w| / z_s at which bristles follow a changed direction
STEP_PER_RATE = 1.0


@njit(error_model="numpy", inline="always")
def there_are(fx):
    """Whether a joint has bristles."""
    return fx[e.GEAR_BRISTLE] > 0.0 or fx[e.LOAD_BRISTLE] > 0.0


@njit(error_model="numpy", inline="always")
def are_at(fx, stop):
    """Whether a stop (`internal_states`) of presliding is made of bristles."""
    if stop == m.GEAR_STOP:
        return fx[e.GEAR_BRISTLE] > 0.0
    return stop == m.LOAD_STOP and fx[e.LOAD_BRISTLE] > 0.0


@njit(error_model="numpy", inline="always")
def carry_the_load(fx):
    """Whether the gear's bristles are those of its loaded thread."""
    return fx[e.GEAR_BRISTLE] > 1.5


@njit(error_model="numpy", inline="always")
def _gear_share(fx, y):
    """Share s of the motor side's motion that bends the gear's bristles."""
    steady = fx[e.GEAR_PRESLIDING] * e.gear_slip(fx, y[k.WW]) / (1.0 + fx[e.GEAR_RISE])
    return 1.0 - y[k.DIRECTION + m.GEAR_STOP] * y[k.GEAR_BRISTLE_DEFLECTION] / steady


@njit(error_model="numpy", inline="always")
def _load_share(fx, y):
    """Share s of the load's motion that bends the bristles of its joint."""
    steady = fx[e.LOAD_PRESLIDING] * e.load_coulomb(fx, y[k.WL]) / e.load_coulomb(fx, 0.0)
    return 1.0 - y[k.DIRECTION + m.LOAD_STOP] * y[k.LOAD_BRISTLE_DEFLECTION] / steady


@njit(error_model="numpy", inline="always")
def _gear_level(fx, y):
    """Level F(0) of the side to which the gear's bristles are bent, without load [Nm]."""
    return e.gear_coulomb(fx, 1 if y[k.GEAR_SIDE] > 0.0 else -1, 0.0)


@njit(error_model="numpy", inline="always")
def gear_torque(fx, y):
    """Torque [Nm] of the gear's bristles against positive motion, without what a load causes."""
    torque = _gear_level(fx, y) * y[k.GEAR_BRISTLE_DEFLECTION] / fx[e.GEAR_PRESLIDING]
    if y[k.GEAR_DAMPED] != 0.0:
        torque += fx[e.GEAR_BRISTLE_DAMPING] * y[k.WW] * _gear_share(fx, y)
    return torque


@njit(error_model="numpy", inline="always")
def load_torque(fx, y):
    """Torque [Nm] of the bristles of the load's joint against positive motion."""
    torque = e.load_coulomb(fx, 0.0) * y[k.LOAD_BRISTLE_DEFLECTION] / fx[e.LOAD_PRESLIDING]
    if y[k.LOAD_DAMPED] != 0.0:
        torque += fx[e.LOAD_BRISTLE_DAMPING] * y[k.WL] * _load_share(fx, y)
    return torque


@njit(error_model="numpy", inline="always")
def thread_loss(fx, y, torque_sign):
    """Torque against positive motion that a loaded thread's bristles make of the transmitted one.

    Per transmitted torque of this sign; below zero where it is back-driven.
    """
    side = y[k.GEAR_SIDE]
    per_width = (
        side * y[k.GEAR_BRISTLE_DEFLECTION] * (1.0 + fx[e.GEAR_RISE]) / fx[e.GEAR_PRESLIDING]
    )
    return per_width * (
        fx[e.GEAR_DRIVE_LOSS] if side * torque_sign > 0 else -fx[e.GEAR_BACKDRIVE_LOSS]
    )


@njit(error_model="numpy", inline="always")
def _let_go(fx, y, torque_sign):
    """Whether nothing presses the surfaces of a loaded thread together."""
    if not carry_the_load(fx) or _gear_level(fx, y) > 0.0:
        return False
    if fx[e.BACKLASH] > 0.0 and y[k.FLANK] == 0.0:
        return True
    driven = y[k.GEAR_SIDE] * torque_sign > 0
    return fx[e.GEAR_DRIVE_LOSS if driven else e.GEAR_BACKDRIVE_LOSS] == 0.0


@njit(error_model="numpy")
def rates(fx, mode, y, derivatives, row):
    """Fills in the deflections' rates [rad/s] and adds what the bristles lose [W]."""
    derivatives[row, k.GEAR_BRISTLE_DEFLECTION] = derivatives[row, k.LOAD_BRISTLE_DEFLECTION] = 0.0
    if fx[e.GEAR_BRISTLE] > 0.0 and not _let_go(fx, y, mode.torque_sign):
        share, deflection = _gear_share(fx, y), y[k.GEAR_BRISTLE_DEFLECTION]
        derivatives[row, k.GEAR_BRISTLE_DEFLECTION] = y[k.WW] * share
        kept = _gear_level(fx, y) * deflection / fx[e.GEAR_PRESLIDING] * share
        derivatives[row, k.POWER + k.GEAR_FRICTION] += (gear_torque(fx, y) - kept) * y[k.WW]
    if fx[e.LOAD_BRISTLE] > 0.0:
        share, deflection = _load_share(fx, y), y[k.LOAD_BRISTLE_DEFLECTION]
        derivatives[row, k.LOAD_BRISTLE_DEFLECTION] = y[k.WL] * share
        kept = e.load_coulomb(fx, 0.0) * deflection / fx[e.LOAD_PRESLIDING] * share
        derivatives[row, k.POWER + k.LOAD_FRICTION] += (load_torque(fx, y) - kept) * y[k.WL]


# ---- events


@njit(error_model="numpy")
def switch_value(fx, y, stop):
    """Above zero where a sign that is carried for the bristles of this joint is wrong."""
    if stop == m.LOAD_STOP:
        turned = -y[k.DIRECTION + stop] * y[k.WL]
        if fx[e.LOAD_BRISTLE_DAMPING] > 0.0 and fx[e.LOAD_RISE] > 0.0:
            share = _load_share(fx, y)
            turned = max(turned, -share if y[k.LOAD_DAMPED] != 0.0 else share)
        return turned - SLACK
    turned = -y[k.DIRECTION + stop] * y[k.WW]
    if fx[e.GEAR_BRISTLE_DAMPING] > 0.0 and fx[e.GEAR_RISE] > 0.0:
        share = _gear_share(fx, y)
        turned = max(turned, -share if y[k.GEAR_DAMPED] != 0.0 else share)
    one = fx[e.GEAR_FORWARD] == fx[e.GEAR_BACKWARD]
    if not one or fx[e.GEAR_DRIVE_LOSS] != fx[e.GEAR_BACKDRIVE_LOSS]:
        turned = max(turned, -y[k.GEAR_SIDE] * y[k.GEAR_BRISTLE_DEFLECTION] / fx[e.GEAR_PRESLIDING])
    return turned - SLACK


@njit(error_model="numpy")
def start(y):
    """Bristles that are not bent yet."""
    y[k.DIRECTION + m.GEAR_STOP] = y[k.DIRECTION + m.LOAD_STOP] = 1.0
    y[k.GEAR_DAMPED] = y[k.LOAD_DAMPED] = y[k.GEAR_SIDE] = 1.0


@njit(error_model="numpy")
def set_signs(fx, mode, y):
    """Set the signs that are carried for bristles; lets go those that nothing presses together."""
    if fx[e.LOAD_BRISTLE] > 0.0:
        direction = y[k.DIRECTION + m.LOAD_STOP]
        if direction * y[k.WL] < -SLACK or (y[k.WL] == 0.0 and mode.load == -direction):
            y[k.DIRECTION + m.LOAD_STOP] = -direction
        share = _load_share(fx, y)
        if abs(share) > SLACK:
            y[k.LOAD_DAMPED] = 1.0 if share > 0.0 else 0.0
    if fx[e.GEAR_BRISTLE] > 0.0:
        direction = y[k.DIRECTION + m.GEAR_STOP]
        if direction * y[k.WW] < -SLACK or (y[k.WW] == 0.0 and mode.wheel == -direction):
            y[k.DIRECTION + m.GEAR_STOP] = direction = -direction
        if y[k.GEAR_SIDE] * y[k.GEAR_BRISTLE_DEFLECTION] < -SLACK * fx[e.GEAR_PRESLIDING]:
            y[k.GEAR_SIDE] = -y[k.GEAR_SIDE]
        if _let_go(fx, y, mode.torque_sign):
            y[k.GEAR_BRISTLE_DEFLECTION] = 0.0
        if y[k.GEAR_BRISTLE_DEFLECTION] == 0.0:
            y[k.GEAR_SIDE] = direction
        share = _gear_share(fx, y)
        if abs(share) > SLACK:
            y[k.GEAR_DAMPED] = 1.0 if share > 0.0 else 0.0


# ---- steps


@njit(error_model="numpy")
def _passing_rate(speed, acceleration, per_rad):
    """How fast [1/s] a deflection of 1 / per_rad is passed within a step of its STEP_PER_RATE."""
    rate = per_rad * abs(speed)
    return 0.5 * (rate + np.sqrt(rate * rate + 4.0 * STEP_PER_RATE * per_rad * abs(acceleration)))


@njit(error_model="numpy")
def longest_step_s(fx, inertia, torque, y, derivatives):
    """The step [s] that bristles allow at a state whose rates are in the first row of slopes.

    Explicit steps must follow the rate |w| / z_s with which z settles, at the speed that the
    acceleration leads to within the step, and the stiffness that a thread has under its torque.
    """
    rate = 0.0
    if fx[e.GEAR_BRISTLE] > 0.0:
        per_rad = (1.0 + fx[e.GEAR_RISE]) / fx[e.GEAR_PRESLIDING]
        rate = _passing_rate(y[k.WW], derivatives[0, k.WW], per_rad)
        if carry_the_load(fx):
            loss = max(fx[e.GEAR_DRIVE_LOSS], fx[e.GEAR_BACKDRIVE_LOSS])
            rate = max(rate, np.sqrt(loss * abs(torque) * per_rad / inertia))
    if fx[e.LOAD_BRISTLE] > 0.0:
        per_rad = (1.0 + fx[e.LOAD_RISE]) / fx[e.LOAD_PRESLIDING]
        rate = max(rate, _passing_rate(y[k.WL], derivatives[0, k.WL], per_rad))
    return STEP_PER_RATE / rate if rate > 0.0 else np.inf
