"""The stages of one fixed step, which the kernel calls one after the other; compiled.

Each stage is inlined by LLVM, so that all numbers of a machine stay in registers. Scalars go from
stage to stage in named tuples, arrays bare: taking an array out of a tuple counts references.

    `middle_of`          positions go half a step with the speeds so far
    `spring_in_middle`   torques of positions are taken there (`step_torques`)
    `applied_in_middle`
    `winding_in_step`    (`winding`)
    `solve_step`         speeds at the end of the step and the winding's current
    `bodies_after`       positions go on with the mean of both speeds
    `spring_after`       the spring's memory follows the deflection (`step_torques`)
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.fixed_step.body_steps as b
import rsea_core.engines.fixed_step.layout as at
import rsea_core.engines.fixed_step.step_torques as t
import rsea_core.engines.fixed_step.winding as w
from rsea_core.engines.fixed_step.step_inputs import motion_at


class Bodies(NamedTuple):
    """Where the bodies are; names as in `layout`."""

    gear: float
    gear_speed: float
    output: float
    output_speed: float
    load: float
    load_speed: float
    tip: float  # what lies beyond the flexible link
    tip_speed: float
    gear_deflection: float
    load_deflection: float
    gear_acceleration: float  # of the last step; NaN before the first
    load_acceleration: float
    joint: float  # torque [Nm] between both sides of a rigid machine


class Middle(NamedTuple):
    """Positions in the middle of a step, its mean speeds as foreseen, the end of given motions."""

    gear: float
    gear_mean: float
    output: float
    output_mean: float
    load: float
    load_mean: float
    gear_after: float
    gear_speed_after: float
    load_after: float
    load_speed_after: float
    passes: int


class Drive(NamedTuple):
    """What the motor does over a step."""

    electric: bool  # current follows the speed; else `held` flows
    command_torque: float
    held: float
    torque_per_ampere: float
    amperes_per_speed: float  # back-EMF over resistance
    free_mean: float  # mean current at rest
    gains: w.Gains


class Means(NamedTuple):
    """Mean speeds over a step."""

    gear: float
    output: float
    load: float
    tip: float


class Torques(NamedTuple):
    """What acts on the bodies in one pass, dry friction apart."""

    gear: float
    gear_damping: float
    spring: float  # at the load
    output: float  # of the spring, on the gear output
    load: float
    load_damping: float
    link: float
    load_inertia: float


class Dry(NamedTuple):
    """Dry friction in one pass, and the damping with that of LuGre bristles."""

    gear: b.Friction
    free: b.Friction  # of the gear between its flanks
    load: b.Friction
    gear_damping: float
    load_damping: float


class Moved(NamedTuple):
    """What a step makes of the bodies: speeds at its end, displacements."""

    gear_speed: float
    gear: float
    gear_deflection: float
    output_speed: float
    output: float
    load_speed: float
    load: float
    load_deflection: float
    tip_speed: float
    joint: float


@njit(error_model="numpy", forceinline=True)
def bodies_of(machine, y, carried):
    """The bodies of a state (N_STEP_STATES,) and what is carried with it (N_CARRIED,)."""
    gear, speed = y[at.GEAR], y[at.GEAR_SPEED]
    output, output_speed = gear, speed
    if machine.backlash:
        output, output_speed = y[at.OUTPUT], y[at.OUTPUT_SPEED]
    return Bodies(
        gear, speed, output, output_speed, y[at.LOAD], y[at.LOAD_SPEED], y[at.LINK],
        y[at.LINK_SPEED], y[at.GEAR_DEFLECTION], y[at.LOAD_DEFLECTION],
        carried[at.GEAR_ACCELERATION], carried[at.LOAD_ACCELERATION], carried[at.JOINT],
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def keep_state(machine, bodies, current, y):
    """Write bodies and current into the state (N_STEP_STATES,)."""
    y[at.CURRENT], y[at.GEAR], y[at.GEAR_SPEED] = current, bodies.gear, bodies.gear_speed
    y[at.LOAD], y[at.LOAD_SPEED] = bodies.load, bodies.load_speed
    y[at.OUTPUT], y[at.OUTPUT_SPEED] = bodies.output, bodies.output_speed
    if machine.link:
        y[at.LINK], y[at.LINK_SPEED] = bodies.tip, bodies.tip_speed
    else:
        y[at.LINK], y[at.LINK_SPEED] = bodies.load, bodies.load_speed
    y[at.GEAR_DEFLECTION], y[at.LOAD_DEFLECTION] = bodies.gear_deflection, bodies.load_deflection


@njit(error_model="numpy", forceinline=True)
def middle_of(machine, piece, motions, bodies, start):
    """Where the bodies are in the middle of a step that begins `start` after its piece.

    Laws of the speed are taken at its mean, foreseen by the last step's acceleration.
    """
    half, load_motion, gear_motion = piece.half, motions[0], motions[1]
    load_after, load_speed_after = bodies.load, bodies.load_speed
    if machine.load_given:
        load, load_mean = motion_at(load_motion, start + half)
        load_after, load_speed_after = motion_at(load_motion, start + piece.h)
    else:
        load, load_mean = bodies.load + half * bodies.load_speed, bodies.load_speed
    gear_after, gear_speed_after = bodies.gear, bodies.gear_speed
    if machine.gear_given:
        gear, gear_mean = motion_at(gear_motion, start + half)
        gear_after, gear_speed_after = motion_at(gear_motion, start + piece.h)
    else:
        gear, gear_mean = bodies.gear + half * bodies.gear_speed, bodies.gear_speed
    output, output_mean = gear, gear_mean
    if machine.backlash:
        output = bodies.output + half * bodies.output_speed
        output_mean = bodies.output_speed
    passes = machine.passes
    if machine.speed_laws:
        if bodies.gear_acceleration == bodies.gear_acceleration:
            if not machine.gear_given:
                gear_mean += half * bodies.gear_acceleration
            if not machine.load_given:
                load_mean += half * bodies.load_acceleration
            if not machine.backlash:
                output_mean = gear_mean
        else:
            passes = 2
    return Middle(
        gear, gear_mean, output, output_mean, load, load_mean, gear_after, gear_speed_after,
        load_after, load_speed_after, passes,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def _torques(machine, fx, drive, spring, applied, bodies, means):
    """What acts in one pass."""
    gear, damping = applied.gear + drive.command_torque, machine.gear_damping
    if drive.electric:
        k_t, k_e, ramp = drive.torque_per_ampere, drive.amperes_per_speed, drive.gains.ramp
        gear += k_t * (drive.free_mean - 2.0 * ramp * k_e * bodies.gear_speed)
        damping += k_t * k_e * (1.0 - drive.gains.lag - 2.0 * ramp)
    else:
        gear += drive.torque_per_ampere * drive.held
    joined, load, load_damping, link = spring.torque, applied.load, applied.load_damping, 0.0
    if machine.link:
        link = applied.link + fx[e.LINK_DAMPING] * (means.load - means.tip)
    if machine.terms:
        damping += fx[e.GEAR_VISCOUS]
        damping += fx[e.VISCOUS_SKEW] if means.gear > 0.0 else -fx[e.VISCOUS_SKEW]
        if fx[e.SPRING_DAMPING] != 0.0:
            joined += fx[e.SPRING_DAMPING] * (spring.lever * means.output - means.load)
        if fx[e.ATAN_LEVEL] != 0.0:  # linear around the mean, implicit
            x = means.gear / fx[e.ATAN_VELOCITY]
            steep = fx[e.ATAN_LEVEL] / (fx[e.ATAN_VELOCITY] * (1.0 + x * x))
            gear -= fx[e.ATAN_LEVEL] * np.arctan(x) - steep * means.gear
            damping += steep
        if fx[e.DRAG] != 0.0:
            load_damping += e.drag_damping(fx, means.load)
        if machine.link:
            load -= link
    return Torques(
        gear, damping, joined, -spring.lever * joined, load, load_damping, link,
        applied.load_inertia,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def _dry_friction(machine, fx, torques, applied, bodies, means, transmitted, h):
    """Dry friction of gear and load in one pass; `transmitted`: the torque on the gear's teeth."""
    gear = free = load = b.NO_FRICTION
    gear_damping, load_damping = torques.gear_damping, torques.load_damping
    if machine.gear_dry:
        slip = t.gear_slip(fx, means.gear)
        gear = free = t.gear_levels(fx, slip, transmitted, means.gear, bodies.gear_deflection)
        if machine.backlash:  # between the flanks the teeth transmit nothing
            free = t.gear_levels(fx, slip, 0.0, means.gear, bodies.gear_deflection)
        if fx[e.GEAR_BRISTLE_DAMPING] > 0.0:
            share = b.bristle_share(gear, bodies.gear_deflection, h * means.gear)
            gear_damping += fx[e.GEAR_BRISTLE_DAMPING] * share
    if machine.load_dry:
        load = t.load_levels(fx, applied.sliding, applied.holding, means.load)
        if fx[e.LOAD_BRISTLE_DAMPING] > 0.0:
            share = b.bristle_share(load, bodies.load_deflection, h * means.load)
            load_damping += fx[e.LOAD_BRISTLE_DAMPING] * share
    return Dry(gear, free, load, gear_damping, load_damping)


@njit(error_model="numpy", forceinline=True)
def _plain_bodies(machine, fx, torques, bodies, h):
    """Both bodies of a plain machine after one pass."""
    gear = b.Body(machine.gear_inertia, torques.gear_damping, torques.gear - torques.spring)
    if machine.gear_dry:
        forward, backward = t.gear_losses(fx, torques.spring)
        forward += fx[e.GEAR_FORWARD]
        backward += fx[e.GEAR_BACKWARD]
        levels = b.Friction(forward, backward, forward, backward, 0.0, 0.0, 0.0)
        speed, moved = b.coulomb_step(gear, levels, bodies.gear_speed, h)
    else:
        speed = b.viscous_step(gear, bodies.gear_speed, h)
        moved = 0.5 * h * (bodies.gear_speed + speed)
    load = b.Body(machine.plant.load_inertia, torques.load_damping, torques.spring + torques.load)
    if machine.load_dry:
        level = fx[e.LOAD_COULOMB]
        levels = b.Friction(level, level, level, level, 0.0, 0.0, 0.0)
        load_speed, load_moved = b.coulomb_step(load, levels, bodies.load_speed, h)
    else:
        load_speed = b.viscous_step(load, bodies.load_speed, h)
        load_moved = 0.5 * h * (bodies.load_speed + load_speed)
    return Moved(
        speed, moved, bodies.gear_deflection, bodies.output_speed, 0.0, load_speed, load_moved,
        bodies.load_deflection, bodies.tip_speed, 0.0,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def _all_bodies(machine, fx, torques, dry, middle, bodies, h):
    """All bodies of a machine after one pass."""
    speed, moved, deflection = middle.gear_speed_after, 0.0, bodies.gear_deflection
    load_speed, load_moved = middle.load_speed_after, 0.0
    load_deflection, tip_speed, joint = bodies.load_deflection, bodies.tip_speed, 0.0
    output_speed, output_moved = bodies.output_speed, 0.0
    gear = b.Body(machine.gear_inertia, dry.gear_damping, torques.gear)
    load = b.Body(torques.load_inertia, dry.load_damping, torques.load)
    per_h = 1.0 / h
    if machine.load_losses:
        losses = fx[e.GEAR_DRIVE_LOSS], fx[e.GEAR_BACKDRIVE_LOSS]
        both = b.friction_of_both(dry.gear, dry.load)
        speed, moved, joint = b.lossy_step(gear, load, losses, both, bodies.gear_speed, h)
        load_speed, load_moved = speed, moved
    elif machine.rigid and not machine.gear_given:
        speed, moved, deflection = b.body_step(
            b.Body(
                gear.inertia + load.inertia, gear.damping + load.damping, gear.torque + load.torque
            ),
            b.friction_of_both(dry.gear, dry.load), deflection, bodies.gear_speed, h,
        )  # fmt: skip
        load_speed, load_moved, load_deflection = speed, moved, deflection
        slowed = load.torque - load.damping * moved * per_h
        joint = load.inertia * (speed - bodies.gear_speed) * per_h - slowed
    elif machine.backlash and not machine.gear_given:
        behind = b.Body(machine.output_inertia, fx[e.BACKLASH_DAMPING], torques.output)
        flanks = b.Flanks(0.5 * fx[e.BACKLASH], fx[e.BACKLASH_RESTITUTION])
        motion = bodies.gear_speed, bodies.output_speed, bodies.gear - bodies.output
        speed, moved, deflection, output_speed, output_moved = b.backlash_step(
            gear, behind, dry.gear, dry.free, deflection, flanks, motion, h
        )
    elif not machine.gear_given:
        under = b.Body(gear.inertia, gear.damping, gear.torque + torques.output)
        speed, moved, deflection = b.body_step(under, dry.gear, deflection, bodies.gear_speed, h)
    if not (machine.load_given or (machine.rigid and not machine.gear_given)):
        under = b.Body(load.inertia, load.damping, torques.spring + load.torque)
        load_speed, load_moved, load_deflection = b.body_step(
            under, dry.load, load_deflection, bodies.load_speed, h
        )
    if machine.rigid and machine.gear_given:
        accelerating = gear.inertia * (speed - bodies.gear_speed) * per_h
        joint = gear.torque - gear.damping * 0.5 * (bodies.gear_speed + speed) - accelerating
    if machine.link:
        tip_speed += h * torques.link / machine.tip_inertia
    if machine.gear_given:
        moved = middle.gear_after - bodies.gear
    return Moved(
        speed, moved, deflection, output_speed, output_moved, load_speed, load_moved,
        load_deflection, tip_speed, joint,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def solve_step(machine, fx, piece, middle, spring, applied, winding, bodies):
    """Speeds at the end of a step, displacements, the current and its mean square share.

    Where the current meets its limit, the step is solved again with its mean up to there held.

    Returns
    -------
    Moved, current at the end [A], mean current [A]
    """
    h, per_h, limit = piece.h, piece.per_h, machine.plant.current_limit
    k_t = winding.torque_per_ampere * applied.factor
    k_e = winding.volts_per_speed * applied.factor * winding.per_ohm
    settled, current, gains = winding.settled, winding.current, winding.gains
    free_mean = settled + (current - settled) * gains.lag
    drive = Drive(piece.electric, piece.torque, current, k_t, k_e, free_mean, gains)
    means = Means(middle.gear_mean, middle.output_mean, middle.load_mean, bodies.tip_speed)
    done, after, joint = 0, current, 0.0
    while True:
        torques = _torques(machine, fx, drive, spring, applied, bodies, means)
        if machine.full:
            transmitted = torques.spring
            if machine.load_losses:
                transmitted = 0.0
            elif machine.rigid:
                transmitted = joint if done > 0 else -applied.load
            dry = _dry_friction(machine, fx, torques, applied, bodies, means, transmitted, h)
            moved = _all_bodies(machine, fx, torques, dry, middle, bodies, h)
        else:
            moved = _plain_bodies(machine, fx, torques, bodies, h)
        joint = moved.joint
        mean = moved.gear * per_h
        final = settled - k_e * mean
        gained = k_e * (moved.gear_speed - bodies.gear_speed)
        if drive.electric:
            after = final + (current - final) * gains.decay - gains.last_ramp * gained
            if abs(after) > limit:
                edge = limit if after > 0.0 else -limit
                held = w.mean_to_edge(current, final, edge, w.rounded(h) * winding.rate)
                drive = Drive(False, piece.torque, held, k_t, k_e, free_mean, gains)
                means = Means(mean, means.output, means.load, means.tip)
                done, after = 0, edge
                continue
        done += 1
        if done >= middle.passes:
            break
        means = Means(
            mean,
            moved.output * per_h if machine.backlash else mean,
            means.load if machine.load_given else moved.load * per_h,
            0.5 * (bodies.tip_speed + moved.tip_speed),
        )
    mean_current = drive.held
    if drive.electric:
        mean_current = final + (current - final) * gains.lag + gains.ramp * gained
    return moved, after, mean_current


@njit(error_model="numpy", forceinline=True)
def bodies_after(machine, piece, middle, moved, bodies):
    """The bodies at the end of a step."""
    gear = middle.gear_after if machine.gear_given else bodies.gear + moved.gear
    load = middle.load_after if machine.load_given else bodies.load + moved.load
    gear_acceleration, load_acceleration = bodies.gear_acceleration, bodies.load_acceleration
    if machine.speed_laws:
        gear_acceleration = (moved.gear_speed - bodies.gear_speed) * piece.per_h
        load_acceleration = (moved.load_speed - bodies.load_speed) * piece.per_h
    output, output_speed = gear, moved.gear_speed
    if machine.backlash:
        output, output_speed = bodies.output + moved.output, moved.output_speed
    tip, tip_speed = bodies.tip, bodies.tip_speed
    if machine.link:
        tip += 0.5 * piece.h * (tip_speed + moved.tip_speed)
        tip_speed = moved.tip_speed
    return Bodies(
        gear, moved.gear_speed, output, output_speed, load, moved.load_speed, tip, tip_speed,
        moved.gear_deflection, moved.load_deflection, gear_acceleration, load_acceleration,
        moved.joint,
    )  # fmt: skip
