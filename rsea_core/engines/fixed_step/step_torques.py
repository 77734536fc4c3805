"""What acts in the middle of a fixed step: spring and its memory, joints, contact; compiled.

Stops (Jenkins elements), Bouc-Wen's element and Maxwell branches follow a given piece of
deflection; the first two depend on the motion alone, at any rate. The laws of torque and
friction are those of `effects`.

Sources: stops: Iwan, J. Appl. Mech. 33 (1966) 893; Bouc-Wen: Wen, J. Eng. Mech. Div. 102 (1976)
249.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.gear_transmission_error as gear_error
import rsea_core.effects.layout as e
from rsea_core.engines.fixed_step.body_steps import Friction, clip
from rsea_core.engines.fixed_step.layout import BOUC_WEN, BRANCH, SLIP
from rsea_core.engines.fixed_step.step_inputs import pulse_share
from rsea_core.machine.spring_table import ANCHOR, C0, C1, C2, C3, UPPER

BOUC_WEN_PIECE, MOST_PIECES = 0.5, 10_000  # of a yield over the exponent: stable up to 2

# The laws of others without numba's own inlining, which counts references of array arguments at
# every use; LLVM inlines them anyway.
angle_error = njit(error_model="numpy")(gear_error.angle_error.py_func)
contact_torque = njit(error_model="numpy")(e.contact_torque.py_func)
load_coulomb = njit(error_model="numpy")(e.load_coulomb.py_func)
gear_torque = njit(error_model="numpy")(e.wheel_torque.py_func)


@njit(error_model="numpy")
def load_port(fx, hanging, speed):
    """Level [Nm] of what hooks add to the dry friction of the load's joint."""
    return e.load_friction_level(fx, hanging, speed, 0.0)


class Spring(NamedTuple):
    """The spring where it was looked at last."""

    torque: float
    lever: float  # the gear output takes the torque times this (transmission error)
    deflection: float
    region: int  # of its table


class Applied(NamedTuple):
    """Torques of positions and of the time on the bodies in the middle of a step."""

    gear: float
    load: float
    load_damping: float
    factor: float  # on both constants of the motor
    sliding: float  # level that hooks add to the dry friction of the load's joint, sliding
    holding: float  # and at rest
    link: float  # elastic torque of the flexible link
    load_inertia: float


@njit(error_model="numpy")
def deflection_of(fx, gear_ratio, output, load):
    """Deflection of the spring [rad], transmission error included."""
    error, _ = angle_error(fx, output, gear_ratio)
    return output + error - load


@njit(error_model="numpy")
def torque_near(regions, deflection, j):
    """Torque of a spring table [Nm] and the region of the deflection, searched from region j."""
    while j < regions.shape[0] - 1 and regions[j, UPPER] <= deflection:
        j += 1
    while j > 0 and regions[j - 1, UPPER] > deflection:
        j -= 1
    s = deflection - regions[j, ANCHOR]
    return regions[j, C0] + s * (regions[j, C1] + s * (regions[j, C2] + s * regions[j, C3])), j


@njit(error_model="numpy")
def _bouc_wen_slope(fx, deflection, change):
    share = abs(deflection) / fx[e.BOUC_WEN_YIELD]
    n = fx[e.BOUC_WEN_EXPONENT]
    if n == 1.0:
        power = share
    elif n == 2.0:
        power = share * share
    else:
        power = share**n
    sign = 1.0 if change * deflection > 0.0 else -1.0 if change * deflection < 0.0 else 0.0
    shape = fx[e.BOUC_WEN_SHAPE]
    return 1.0 - power * (shape + (1.0 - abs(shape)) * sign)


@njit(error_model="numpy")
def _bouc_wen_after(fx, deflection, change):
    """Deflection of the element after a change, by the midpoint rule over stable pieces."""
    longest = BOUC_WEN_PIECE * fx[e.BOUC_WEN_YIELD] / max(fx[e.BOUC_WEN_EXPONENT], 1.0)
    pieces = int(min(abs(change) / longest, MOST_PIECES)) + 1
    part = change / pieces
    for _ in range(pieces):
        middle = deflection + 0.5 * part * _bouc_wen_slope(fx, deflection, part)
        deflection += part * _bouc_wen_slope(fx, middle, part)
    return deflection


@njit(error_model="numpy")
def branch_gains(fx, h, gains):
    """What Maxwell branches need of a length h, for `remember`: gains (N_GAINS or more,)."""
    for j in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + j] != 0.0:
            x = h / fx[e.BRANCH_TIME + j]
            gains[j] = -np.expm1(-x)
            gains[e.N_BRANCHES + j] = 1.0 / x


@njit(error_model="numpy")
def remember(fx, y, change, gains):
    """Move the spring's memory by a change of deflection that is passed steadily.

    `gains` are those of `branch_gains` for the time that it takes.
    """
    for j in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + j] != 0.0:
            y[SLIP + j] = clip(y[SLIP + j] + change, fx[e.SLIP_YIELD + j])
    if fx[e.BOUC_WEN] != 0.0:
        y[BOUC_WEN] = _bouc_wen_after(fx, y[BOUC_WEN], change)
    for j in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + j] != 0.0:
            y[BRANCH + j] += gains[j] * (change * gains[e.N_BRANCHES + j] - y[BRANCH + j])


@njit(error_model="numpy")
def remembered_torque(fx, y):
    """Torque [Nm] of the spring's memory elements."""
    torque = 0.0
    for j in range(e.N_SLIPS):
        torque += fx[e.SLIP_STIFFNESS + j] * y[SLIP + j]
    for j in range(e.N_BRANCHES):
        torque += fx[e.BRANCH_STIFFNESS + j] * y[BRANCH + j]
    return torque + fx[e.BOUC_WEN] * y[BOUC_WEN]


@njit(error_model="numpy")
def gear_losses(fx, torque):
    """Friction that a transmitted torque causes in a worm that slides forward and backward."""
    helped, braked = fx[e.GEAR_BACKDRIVE_LOSS] * abs(torque), fx[e.GEAR_DRIVE_LOSS] * abs(torque)
    if torque > 0.0:
        helped, braked = braked, helped
    return helped, braked


@njit(error_model="numpy")
def gear_slip(fx, speed):
    """Factor of the gear's friction level that slides at a speed (Stribeck)."""
    if fx[e.GEAR_RISE] == 0.0:
        return 1.0
    share = abs(speed / fx[e.GEAR_STRIBECK])
    fallen = share * share
    if fx[e.STRIBECK_SHAPE] > 0.0:  # zero: the usual 2
        fallen = share ** fx[e.STRIBECK_SHAPE]
    return 1.0 + fx[e.GEAR_RISE] * np.exp(-fallen)


@njit(error_model="numpy")
def gear_levels(fx, slip, torque, speed, deflection):
    """The gear's `Friction` under a transmitted torque at a mean speed.

    `slip` is the factor of `gear_slip` at that speed, `deflection` that of the presliding element.
    """
    forward_loss, backward_loss = gear_losses(fx, torque)
    rise = 1.0 + fx[e.GEAR_RISE]
    forward, backward = fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]
    if fx[e.GEAR_PRESLIDING] > 0.0:
        positive = deflection > 0.0 or (deflection == 0.0 and speed > 0.0)
        level = forward if positive else backward
        width = fx[e.GEAR_PRESLIDING]
        stiffness = rise * level / width
        if fx[e.GEAR_BRISTLE] > 1.5:  # the bristles carry what grows with the load too
            loss = forward_loss if positive else backward_loss
            carried, most = slip * (level + loss), rise * (level + loss)
            return Friction(0.0, 0.0, 0.0, 0.0, carried, most / width, -width)
        if fx[e.GEAR_BRISTLE] != 0.0:
            width = -width
        return Friction(
            forward_loss, backward_loss, forward_loss, backward_loss, slip * level, stiffness, width
        )
    return Friction(
        slip * forward + forward_loss,
        slip * backward + backward_loss,
        rise * forward + forward_loss,
        rise * backward + backward_loss,
        0.0,
        0.0,
        0.0,
    )


@njit(error_model="numpy")
def load_levels(fx, added, held, speed):
    """The `Friction` of the load's joint; hooks add levels `added` in sliding and `held` at rest.

    What hooks add has no elasticity: beside a presliding element it stays set-valued.
    """
    level = load_coulomb(fx, speed)
    if fx[e.LOAD_PRESLIDING] > 0.0:
        width = fx[e.LOAD_PRESLIDING]
        stiffness = (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] / width
        if fx[e.LOAD_BRISTLE] != 0.0:
            width = -width
        return Friction(added, added, held, held, level, stiffness, width)
    level, hold = level + added, (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] + held
    return Friction(level, level, hold, hold, 0.0, 0.0, 0.0)


@njit(error_model="numpy")
def _contact_share(depth, depth_after):
    """Share of a step in contact, and the largest depth in it, of a steady passage."""
    if depth > 0.0 and depth_after > 0.0:
        return 1.0, 0.0
    deepest = max(depth, depth_after)
    if deepest <= 0.0:
        return 0.0, 0.0
    return deepest / abs(depth_after - depth), deepest


@njit(error_model="numpy")
def mean_contact(fx, plant, load, speed, h):
    """Mean torque of the contact over a step [Nm] of which damping is left out, and its drag."""
    depth = load - plant.contact_angle
    share, deepest = _contact_share(depth, depth + h * speed)
    if share == 0.0:
        return 0.0, 0.0
    middle, stiffness = depth + 0.5 * h * speed, plant.contact_stiffness
    if fx[e.EXPONENT] == 0.0:
        mean = middle if share == 1.0 else 0.5 * share * deepest
        return stiffness * mean, share * plant.contact_damping
    if share == 1.0:
        elastic, lost = contact_torque(fx, stiffness, middle, speed)
        return elastic + lost, plant.contact_damping
    elastic, lost = contact_torque(fx, stiffness, deepest, speed)
    return (elastic + lost) * share / (fx[e.EXPONENT] + 1.0), share * plant.contact_damping


@njit(error_model="numpy", forceinline=True)
def spring_of(machine, fx, bodies):
    """The spring before its first step."""
    deflection = 0.0
    if machine.internal:
        deflection = deflection_of(fx, machine.plant.gear_ratio, bodies.output, bodies.load)
    return Spring(0.0, 1.0, deflection, 0)


@njit(error_model="numpy", forceinline=True)
def spring_in_row(machine, fx, y, table, spring, bodies):
    """The spring at the begin of a row, with the torque that the load receives there [Nm]."""
    torque, region = bodies.joint, spring.region
    if not machine.rigid:
        now = bodies.output - bodies.load
        if machine.internal:
            now = spring.deflection
        elif machine.transmission_error:
            now = deflection_of(fx, machine.plant.gear_ratio, bodies.output, bodies.load)
        if machine.linear:
            torque = machine.stiffness * now
        else:
            torque, region = torque_near(table, now, region)
        if machine.full:
            if machine.internal:
                torque += remembered_torque(fx, y)
            torque += fx[e.SPRING_DAMPING] * (bodies.output_speed - bodies.load_speed)
    return Spring(torque, spring.lever, spring.deflection, region)


@njit(error_model="numpy", forceinline=True)
def spring_in_middle(machine, fx, y, table, carried, spring, middle):
    """The spring in the middle of a step; its memory in `y` follows the deflection there."""
    torque, lever, region = 0.0, 1.0, spring.region
    deflection = middle.output - middle.load
    if machine.transmission_error:
        error, slope = angle_error(fx, middle.output, machine.plant.gear_ratio)
        deflection += error
        lever += slope
    if not machine.rigid:
        if machine.linear:
            torque = machine.stiffness * deflection
        else:
            torque, region = torque_near(table, deflection, region)
        if machine.internal:
            remember(fx, y, deflection - spring.deflection, carried)
            torque += remembered_torque(fx, y)
    return Spring(torque, lever, deflection, region)


@njit(error_model="numpy", forceinline=True)
def spring_after(machine, fx, y, carried, spring, bodies):
    """The spring at the end of a step; its memory in `y` follows the deflection there."""
    deflection = spring.deflection
    if machine.internal:
        deflection = deflection_of(fx, machine.plant.gear_ratio, bodies.output, bodies.load)
        remember(fx, y, deflection - spring.deflection, carried)
    return Spring(spring.torque, spring.lever, deflection, spring.region)


@njit(error_model="numpy", forceinline=True)
def applied_in_middle(machine, fx, piece, middle, bodies, start):
    """Torques that depend on positions and on the time."""
    plant = machine.plant
    gear, load, factor = 0.0, plant.load_torque, 1.0
    inertia = plant.load_inertia
    if machine.terms:
        gear = gear_torque(fx, middle.gear, middle.gear_mean)
        if fx[e.RIPPLE] != 0.0:
            angle = fx[e.RIPPLE_CYCLES] * middle.gear + fx[e.RIPPLE_PHASE]
            factor += fx[e.RIPPLE] * np.sin(angle)
        load = e.load_torque_by_angle(fx, middle.load, middle.load_mean, load)
        load += fx[e.PULSE] * pulse_share(fx, piece.begin + start, piece.h)
        share, slope = e.inertia_factor(fx, middle.load)
        load -= 0.5 * inertia * slope * middle.load_mean * middle.load_mean
        inertia *= share
    hanging = middle.load + plant.gravity_offset
    if plant.gravity != 0.0:
        load -= plant.gravity * np.sin(hanging)
    sliding, holding = 0.0, 0.0
    if fx[e.LOAD_DRY] != 0.0:  # here, not in each pass: hooks make the passes slow to run
        sliding = load_port(fx, hanging, middle.load_mean)
        holding = load_port(fx, hanging, 0.0)
    damping = plant.load_damping
    if machine.contact:
        pressed, damped = mean_contact(fx, plant, bodies.load, bodies.load_speed, piece.h)
        load -= pressed
        damping += damped
    link = 0.0
    if machine.link:
        deflected = middle.load - bodies.tip - piece.half * bodies.tip_speed
        link = fx[e.LINK_STIFFNESS] * deflected
    return Applied(gear, load, damping, factor, sliding, holding, link, inertia)
