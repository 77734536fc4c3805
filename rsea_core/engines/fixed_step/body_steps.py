"""What one fixed step makes of a body under dry friction, and of two with backlash between them.

Compiled scalar functions. The torques of a step are taken at its middle and held, so that each
law here has a closed form over the step: a body under a constant torque and dry friction slows
down, stops within the step and stays or turns round; two bodies with backlash between them fly,
meet, part once and go on together.

Sources: Moreau and Jean's time stepping of set-valued friction (Acary and Brogliato, Numerical
Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10), with the stop located inside
the step, which keeps it second order.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

MAX_BACKLASH_PIECES = 8  # of a step, between meetings of the flanks


class Body(NamedTuple):
    """A body under what acts on it over a step, in SI units."""

    inertia: float
    damping: float  # torque over the mean speed
    torque: float  # applied, constant


class Friction(NamedTuple):
    """Dry friction of a body [Nm, Nm/rad, rad]; zeros are no friction."""

    forward: float  # level of sliding
    backward: float
    hold_forward: float  # level of breaking away
    hold_backward: float
    level: float  # of sliding of the presliding element
    stiffness: float  # of that element
    width: float  # deflection at which it yields; below zero: a LuGre bristle model


class Flanks(NamedTuple):
    """The two flanks of a backlash."""

    half_gap: float  # [rad]
    restitution: float  # coefficient of restitution: share of the speed at which they met


NO_FRICTION = Friction(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@njit(error_model="numpy")
def clip(value, limit):
    """The value kept within -limit..limit."""
    return min(max(value, -limit), limit)


@njit(error_model="numpy")
def viscous_step(body, speed, h):
    """Speed after h under a constant torque and a drag proportional to the mean speed."""
    half = 0.5 * h * body.damping
    return ((body.inertia - half) * speed + h * body.torque) / (body.inertia + half)


@njit(error_model="numpy")
def _with_torque(body, torque):
    """The body under another torque."""
    return Body(body.inertia, body.damping, torque)


@njit(error_model="numpy")
def coulomb_step(body, friction, speed, h):
    """A body with set-valued dry friction: (speed, displacement) after h.

    Of the friction, the levels of sliding and of breaking away count. A body that stops within h
    stays there (its speed is exactly zero) or turns round.
    """
    torque, direction = body.torque, 0.0
    if speed > 0.0:
        direction = 1.0
    elif speed < 0.0:
        direction = -1.0
    elif torque > friction.hold_forward:
        direction = 1.0
    elif torque < -friction.hold_backward:
        direction = -1.0
    if direction == 0.0:
        return 0.0, 0.0
    level = friction.forward if direction > 0.0 else friction.backward
    after = viscous_step(_with_torque(body, torque - direction * level), speed, h)
    if direction * after >= 0.0:
        return after, 0.5 * h * (speed + after)
    if speed == 0.0:  # the sliding level is above the torque: it has not moved
        return 0.0, 0.0
    stop = h * speed / (speed - after)
    travelled, rest = 0.5 * stop * speed, h - stop
    after = 0.0
    if torque > friction.hold_forward:
        after = max(viscous_step(_with_torque(body, torque - friction.forward), 0.0, rest), 0.0)
    elif torque < -friction.hold_backward:
        after = min(viscous_step(_with_torque(body, torque + friction.backward), 0.0, rest), 0.0)
    return after, travelled + 0.5 * rest * after


@njit(error_model="numpy")
def presliding_step(body, friction, dry, deflection, speed, h):
    """A body held by a Jenkins element beside dry friction: (speed, displacement, deflection).

    The element's torque is stiffness * deflection until it yields, then `level`; its mean over
    the step is taken by the trapezoidal rule and implicit, so that a stiff element needs no short
    step. `dry` is the set-valued rest.
    """
    stiffness, width = friction.stiffness, friction.width
    elastic = body.torque - stiffness * deflection
    direction = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if direction == 0.0:
        if abs(elastic) <= dry:
            return 0.0, 0.0, deflection
        direction = 1.0 if elastic > 0.0 else -1.0
    half, spring = 0.5 * h * body.damping, 0.25 * h * h * stiffness
    after = (body.inertia - half - spring) * speed + h * (elastic - direction * dry)
    after /= body.inertia + half + spring
    moved = 0.5 * h * (speed + after)
    middle = deflection + 0.5 * moved
    if abs(middle) > width:
        sign = 1.0 if middle > 0.0 else -1.0
        torque = body.torque - direction * dry - sign * friction.level
        after = viscous_step(_with_torque(body, torque), speed, h)
        moved = 0.5 * h * (speed + after)
    if dry > 0.0 and direction * after < 0.0:
        # it stops within the step, and goes back only if element and torque overcome `dry`
        stop = h * speed / (speed - after) if speed != 0.0 else 0.0
        moved, rest = 0.5 * stop * speed, h - stop
        elastic = body.torque - stiffness * clip(deflection + moved, width)
        after = 0.0
        if abs(elastic) > dry:
            back = dry if elastic > 0.0 else -dry
            after = (elastic - back) * rest / (body.inertia + 0.25 * rest * rest * stiffness)
        moved += 0.5 * rest * after
    return after, moved, clip(deflection + moved, width)


@njit(error_model="numpy")
def bristle_step(body, friction, dry, deflection, speed, h):
    """A body held by LuGre bristles beside dry friction: (speed, displacement, deflection).

    The bristles' deflection z follows dz/dx = 1 - sgn(dx) z stiffness / level and their torque is
    stiffness * z (LuGre: Canudas de Wit et al., IEEE TAC 40 (1995) 419, its micro-damping in the
    body's damping, see `bristle_share`; at one level Dahl's). z over a displacement is the exact
    exponential; its mean over the step is implicit.
    """
    level, stiffness = friction.level, friction.stiffness
    elastic = body.torque - stiffness * deflection
    direction = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if direction == 0.0:
        if abs(elastic) <= dry:
            return 0.0, 0.0, deflection
        direction = 1.0 if elastic > 0.0 else -1.0
    if level <= 0.0:
        after, moved = coulomb_step(body, Friction(dry, dry, dry, dry, 0.0, 0.0, 0.0), speed, h)
        return after, moved, 0.0
    steady, half = level / stiffness, 0.5 * h * body.damping
    moved, after = h * speed, speed
    tangent = stiffness * (1.0 - direction * deflection / steady)
    for _ in range(2):
        r = abs(moved) / steady
        curve = 1.0 - r / 3.0
        if r > 1e-3:
            curve = 2.0 * (1.0 - (1.0 - np.exp(-r)) / r) / r
        spring = 0.25 * h * h * tangent * curve
        if spring >= 0.0:
            after = (body.inertia - half - spring) * speed + h * (elastic - direction * dry)
            after /= body.inertia + half + spring
        else:  # the bristles give way: what they lose in the step is taken as it was foreseen
            loss = 0.5 * tangent * curve * moved
            torque = elastic - loss - direction * dry
            after = viscous_step(_with_torque(body, torque), speed, h)
        moved = 0.5 * h * (speed + after)
    if dry > 0.0 and direction * after < 0.0:
        moved = 0.5 * h * speed * speed / (speed - after) if speed != 0.0 else 0.0
        after = 0.0
    end = steady if moved > 0.0 else -steady
    return after, moved, end + (deflection - end) * np.exp(-abs(moved) / steady)


@njit(error_model="numpy")
def bristle_share(friction, deflection, displacement):
    """Share of a displacement by which LuGre bristles deflect: one at rest, none where all slide.

    Their micro-damping (LuGre's sigma_1) acts on this share alone. `displacement` is what is
    foreseen of a step: one that turns back deflects them within a step or two, and the share at
    the step's begin would be kept too long.
    """
    level, stiffness = friction.level, friction.stiffness
    if level <= 0.0:
        return 0.0
    sign = 1.0 if displacement > 0.0 else -1.0 if displacement < 0.0 else 0.0
    share = max(0.0, 1.0 - sign * deflection * stiffness / level)
    r = abs(displacement) * stiffness / level
    return share * ((1.0 - np.exp(-r)) / r if r > 1e-6 else 1.0)


@njit(error_model="numpy")
def body_step(body, friction, deflection, speed, h):
    """A body after h under whatever dry friction it has: (speed, displacement, deflection)."""
    if friction.width != 0.0:
        forward = speed > 0.0 or (speed == 0.0 and body.torque > 0.0)
        dry = friction.forward if forward else friction.backward
        if friction.width < 0.0:
            return bristle_step(body, friction, dry, deflection, speed, h)
        return presliding_step(body, friction, dry, deflection, speed, h)
    if friction.hold_forward == 0.0 and friction.hold_backward == 0.0:
        after = viscous_step(body, speed, h)
        return after, 0.5 * h * (speed + after), deflection
    after, moved = coulomb_step(body, friction, speed, h)
    return after, moved, deflection


@njit(error_model="numpy")
def lossy_step(motor, load, losses, friction, speed, h):
    """Two bodies on one rigid shaft with a lossy gear in between: (speed, displacement, joint).

    The gear's friction is loss |joint| against the motion, and joint = J_l a - load torque: both
    depend on the acceleration. Where the motor drives the load the friction is losses[0] joint,
    where the load drives -losses[1] joint, so that load and its inertia just count 1 + c times,
    c = losses[0] or -losses[1], whichever fits the sign of the joint's torque. A gear whose load
    would have to drive itself (no inertia left) jams. A body that stops stays until the next step.
    """
    direction = 1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0
    if direction == 0.0:
        direction = 1.0 if motor.torque + load.torque > 0.0 else -1.0
    after, moved, joint = 0.0, 0.0, -load.torque
    hold_forward, hold_backward = np.inf, np.inf
    if speed == 0.0:
        hold_forward, hold_backward = friction.hold_forward, friction.hold_backward
    held = Friction(friction.forward, friction.backward, hold_forward, hold_backward, 0.0, 0.0, 0.0)
    for driven in (True, False):
        share = 1.0 + losses[0] if driven else 1.0 - losses[1]
        if motor.inertia + load.inertia * share <= 0.0:
            return 0.0, 0.0, -load.torque
        both = Body(
            motor.inertia + load.inertia * share,
            motor.damping + load.damping * share,
            motor.torque + load.torque * share,
        )
        after, moved = coulomb_step(both, held, speed, h)
        if speed == 0.0 and direction * after < 0.0:
            after, moved = 0.0, 0.0
        joint = (load.inertia * (after - speed) + load.damping * moved) / h - load.torque
        if driven and direction * joint >= 0.0:
            break
    return after, moved, joint


@njit(error_model="numpy")
def friction_of_both(one, two):
    """The friction of two joints that turn as one."""
    return Friction(
        one.forward + two.forward,
        one.backward + two.backward,
        one.hold_forward + two.hold_forward,
        one.hold_backward + two.hold_backward,
        one.level + two.level,
        one.stiffness + two.stiffness,
        one.width if abs(one.width) > abs(two.width) else two.width,
    )


@njit(error_model="numpy")
def backlash_step(motor, output, friction, free, deflection, flanks, motion, h):
    """Two bodies with backlash between them after h: (speed, displacement, deflection) of the
    motor's side, (speed, displacement) of the output behind the backlash.

    They part after their first meeting by their coefficient of restitution and stay together at
    the next one within h. `friction` and `free` are those of the motor's side in tooth contact
    and between the flanks, `deflection` that of its presliding element; `motion` is (speed of the
    motor's side, of the output, gap), the gap being the motor's less the output's angle.
    """
    speed, output_speed, gap = motion
    half_gap, restitution = flanks
    moved, output_moved, left = 0.0, 0.0, h
    both = motor.inertia + output.inertia
    joined = Body(both, motor.damping + output.damping, motor.torque + output.torque)
    for _ in range(MAX_BACKLASH_PIECES):
        sign = 0.0
        if gap >= half_gap and speed >= output_speed:
            sign = 1.0
        elif gap <= -half_gap and speed <= output_speed:
            sign = -1.0
        if sign != 0.0:
            if speed != output_speed:
                speed = (motor.inertia * speed + output.inertia * output_speed) / both
                output_speed = speed
            after, by, deflected = body_step(joined, friction, deflection, speed, left)
            free_torque = output.torque - output.damping * by / left
            if sign * (output.inertia * (after - speed) / left - free_torque) >= 0.0:
                return after, moved + by, deflected, after, output_moved + by
        after, by, deflected = body_step(motor, free, deflection, speed, left)
        output_after = viscous_step(output, output_speed, left)
        output_by = 0.5 * left * (output_speed + output_after)
        gap_after = gap + by - output_by
        if abs(gap_after) <= half_gap:
            return after, moved + by, deflected, output_after, output_moved + output_by
        # the flanks meet: when, taking the gap's acceleration as constant
        limit = half_gap if gap_after > 0.0 else -half_gap
        closing = speed - output_speed
        curvature = 0.5 * (after - output_after - closing) / left
        length = min(_first_root(curvature, closing, gap - limit, left), left)
        after, by, deflection = body_step(motor, free, deflection, speed, length)
        output_after = viscous_step(output, output_speed, length)
        moved, output_moved = (
            moved + by,
            output_moved + 0.5 * length * (output_speed + output_after),
        )
        gap, left = limit, left - length
        parting = restitution * (after - output_after) / both
        speed = (motor.inertia * after + output.inertia * output_after) / both
        speed, output_speed = speed - output.inertia * parting, speed + motor.inertia * parting
        restitution = 0.0
        if left <= 1e-12 * h:
            break
    return speed, moved, deflection, output_speed, output_moved


@njit(error_model="numpy")
def _first_root(a, b, c, default):
    """Smallest root above zero of a t^2 + b t + c, with c the distance to go."""
    under = b * b - 4.0 * a * c
    if under < 0.0:
        return default
    q = -0.5 * (b + (np.sqrt(under) if b >= 0.0 else -np.sqrt(under)))
    first, second = default, default
    if a != 0.0 and q / a > 0.0:
        first = q / a
    if q != 0.0 and c / q > 0.0:
        second = c / q
    return min(first, second)
