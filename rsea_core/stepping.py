"""The fast engine: one compiled fixed-step kernel for every effect, switched by its numbers.

A step of length h, of second order with its events:

    positions go half a step with the speeds so far; position torques are taken there
    current      exact exponential under the mean speed of the step, its mean acts on the wheel
    each body    J (w+ - w) = h (push - drag (w+ + w)/2 - dry friction), solved in closed form
                 with the stop inside the step (`step_laws`): a stuck body has speed zero
    positions    go on with the mean of both speeds, spring memory follows the deflection

Laws of the speed (Stribeck, arctangent, quadratic drag, damping between bodies) are evaluated
at the mean speed in a second pass. The precise engine (`integrator`) is the oracle; the error
of this one is measured by `benchmarks/step_halving.py`.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects as e
import rsea_core.kernel as k
import rsea_core.step_laws as s
from rsea_core.terms.table import table_torque

BENCH = 4  # structure: wheel and load are both given, the spring answers
# what a row reads
MOTOR_ANGLE, LOAD_ANGLE, TORQUE, READ_CURRENT, TEMPERATURE = range(5)
MOTOR_SPEED, LOAD_SPEED_READ = 5, 6
N_CHANNELS = 7
CHANNELS = (
    "motor_angle_rad",
    "load_angle_rad",
    "torque_Nm",
    "current_A",
    "case_rise_K",
    "motor_velocity_rad_per_s",
    "load_velocity_rad_per_s",
)


class Switches(NamedTuple):
    """Which parts of the step a machine needs; found once a run."""

    rigid: bool
    load_given: bool
    wheel_given: bool
    any: bool
    wheel_dry: bool
    load_dry: bool
    memory: bool
    play: bool
    link: bool
    thermal: bool
    error: bool
    passes: int


class Input(NamedTuple):
    """What acts during a piece of a row."""

    volts: float  # of the source behind the winding, sag not counted
    command: float
    enabled: bool
    start: float  # time of the piece [s]


class Motion(NamedTuple):
    """A given motion over a piece: x0 + v0 t + a t^2/2 + j t^3/6."""

    angle: float
    speed: float
    acceleration: float
    jerk: float


@njit(error_model="numpy")
def switches(plant, fx):
    """Which parts of the step these numbers need."""
    memory = fx[e.BOUC_WEN] != 0.0
    for j in range(e.N_SLIPS):
        memory = memory or fx[e.SLIP_STIFFNESS + j] != 0.0
    for j in range(e.N_BRANCHES):
        memory = memory or fx[e.BRANCH_STIFFNESS + j] != 0.0
    structure = plant.structure
    rigid = structure == k.RIGID_FREE or structure == k.RIGID_HELD
    speed = fx[e.GEAR_RISE] != 0.0 or fx[e.LOAD_RISE] != 0.0 or fx[e.DRAG] != 0.0
    speed = speed or fx[e.ATAN_LEVEL] != 0.0 or fx[e.SPRING_DAMPING] != 0.0
    speed = speed or fx[e.LOSS_FACTOR] != 0.0 or fx[e.NORMAL_FRICTION] != 0.0
    loss = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    link = fx[e.LINK_STIFFNESS] > 0.0 and fx[e.LINK_INERTIA] > 0.0
    speed = speed or (link and fx[e.LINK_DAMPING] != 0.0) or (rigid and loss)
    return Switches(
        rigid,
        structure in (k.ELASTIC_HELD, k.RIGID_HELD, BENCH),
        structure in (k.RIGID_HELD, BENCH),
        fx[e.ANY] != 0.0,
        fx[e.WHEEL_DRY] != 0.0,
        fx[e.LOAD_DRY] != 0.0,
        memory,
        fx[e.BACKLASH] > 0.0 and not rigid,
        link,
        fx[e.WINDING_CAPACITY] > 0.0,
        fx[e.WHEEL_ERROR] != 0.0 or fx[e.WORM_ERROR] != 0.0,
        2 if speed else 1,
    )


@njit(error_model="numpy", inline="always")
def gear_levels(fx, torque, speed):
    """What `step_laws.move` needs of the gear's friction for a torque and a mean speed."""
    forward_loss, backward_loss = fx[e.GEAR_BACKDRIVE_LOSS], fx[e.GEAR_DRIVE_LOSS]
    if torque > 0.0:
        forward_loss, backward_loss = backward_loss, forward_loss
    carried = abs(torque)
    forward_loss, backward_loss = forward_loss * carried, backward_loss * carried
    slip, rise = 1.0, 1.0 + fx[e.GEAR_RISE]
    if fx[e.GEAR_RISE] > 0.0:
        slip += fx[e.GEAR_RISE] * np.exp(-((speed / fx[e.GEAR_STRIBECK]) ** 2))
    forward, backward = fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]
    if fx[e.GEAR_PRESLIDING] > 0.0:
        level = slip * (forward if speed >= 0.0 else backward)
        return (
            forward_loss,
            backward_loss,
            forward_loss,
            backward_loss,
            level,
            fx[e.GEAR_PRESLIDING],
        )
    return (
        slip * forward + forward_loss,
        slip * backward + backward_loss,
        rise * forward + forward_loss,
        rise * backward + backward_loss,
        0.0,
        0.0,
    )


@njit(error_model="numpy", inline="always")
def load_levels(plant, fx, angle, speed):
    """What `step_laws.move` needs of the load joint's friction."""
    slip, rise = 1.0, 1.0 + fx[e.LOAD_RISE]
    if fx[e.LOAD_RISE] > 0.0:
        slip += fx[e.LOAD_RISE] * np.exp(-((speed / fx[e.LOAD_STRIBECK]) ** 2))
    level = slip * fx[e.LOAD_COULOMB]
    if fx[e.LOAD_PRESLIDING] > 0.0:
        return 0.0, 0.0, 0.0, 0.0, level, fx[e.LOAD_PRESLIDING]
    hold = rise * fx[e.LOAD_COULOMB]
    return level, level, hold, hold, 0.0, 0.0


@njit(error_model="numpy", inline="always")
def _contact(plant, fx, angle, speed, h):
    """Mean torque of the contact over a step [Nm] of which damping is left out, and its drag."""
    depth = angle - plant.contact_angle
    share, deepest = s.contact_share(depth, depth + h * speed)
    if share == 0.0:
        return 0.0, 0.0
    middle = depth + 0.5 * h * speed
    if fx[e.EXPONENT] == 0.0:
        mean = middle if share == 1.0 else 0.5 * share * deepest
        return plant.contact_stiffness * mean, share * plant.contact_damping
    if share == 1.0:
        elastic, lost = e.contact_torque(fx, plant.contact_stiffness, middle, speed)
        return elastic + lost, plant.contact_damping
    elastic, lost = e.contact_torque(fx, plant.contact_stiffness, deepest, speed)
    return (elastic + lost) * share / (fx[e.EXPONENT] + 1.0), share * plant.contact_damping


@njit(error_model="numpy", inline="always")
def _overlap(fx, start, h):
    """Share of a step in which the disturbance acts."""
    if fx[e.PULSE] == 0.0:
        return 0.0
    inside = min(start + h, fx[e.PULSE_END]) - max(start, fx[e.PULSE_START])
    return max(inside, 0.0) / h


@njit(error_model="numpy", inline="always")
def _at(motion, t):
    """Angle and speed of a given motion."""
    angle = motion.angle + t * (
        motion.speed + t * (0.5 * motion.acceleration + t * motion.jerk / 6.0)
    )
    return angle, motion.speed + t * (motion.acceleration + 0.5 * t * motion.jerk)


@njit(error_model="numpy")
def deflection_of(plant, fx, output, load):
    """Deflection of the spring [rad], transmission error included."""
    error, _ = e.angle_error(fx, output, plant.gear_ratio)
    return output + error - load


@njit(error_model="numpy")
def spring_reading(plant, spring, fx, on, y):
    """Torque [Nm] that a sensor between spring and load reads."""
    output = y[s.OUTPUT] if on.play else y[s.WHEEL]
    speed = y[s.OUTPUT_SPEED] if on.play else y[s.WHEEL_SPEED]
    torque = table_torque(spring, deflection_of(plant, fx, output, y[s.LOAD]))
    if on.memory:
        torque += s.remembered_torque(fx, y)
    return torque + fx[e.SPRING_DAMPING] * (speed - y[s.LOAD_SPEED])


@njit(error_model="numpy")
def advance(plant, spring, fx, on, given, load_motion, wheel_motion, h, n, y):
    """Take n steps of length h from the state y; returns the joint torque of a rigid machine."""
    current, wheel, speed = y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED]
    load, load_speed = y[s.LOAD], y[s.LOAD_SPEED]
    output, output_speed = wheel, speed
    if on.play:
        output, output_speed = y[s.OUTPUT], y[s.OUTPUT_SPEED]
    # ---- the winding
    resistance, k_t, k_e = plant.resistance, plant.torque_per_ampere, plant.volts_per_speed
    if on.thermal:
        resistance *= 1.0 + fx[e.RESISTANCE_RISE] * y[s.WINDING_RISE]
        factor = 1.0 - fx[e.CONSTANT_FALL] * y[s.CASE_RISE]
        k_t, k_e = k_t * factor, k_e * factor
    electric = plant.drive == k.DUTY or plant.drive == k.VOLTAGE
    decay, lag, given_torque = 0.0, 0.0, 0.0
    copper = resistance
    if electric:
        resistance += given.command * given.command * fx[e.SOURCE_RESISTANCE]
        if plant.inductance > 0.0:
            x = h * resistance / plant.inductance
            decay = np.exp(-x)
            lag = (1.0 - decay) / x
        electric = given.enabled
    elif plant.drive == k.CURRENT:
        current = s.clip(given.command, plant.current_limit)
    elif plant.drive == k.MOTOR_TORQUE:
        given_torque = plant.torque_per_motor_torque * given.command
    if not given.enabled:
        current, given_torque = 0.0, 0.0
    settled = given.volts / resistance if electric else 0.0
    limit = plant.current_limit
    # ---- bodies
    front, behind = plant.inertia, fx[e.BACKLASH_INERTIA]
    if on.play:
        front -= behind
    tip_inertia = fx[e.LINK_INERTIA] if on.link else 0.0
    near = plant.load_inertia - tip_inertia
    tip, tip_speed = y[s.LINK], y[s.LINK_SPEED]
    gear_stretch, load_stretch = y[s.GEAR_STRETCH], y[s.LOAD_STRETCH]
    has_contact = plant.contact_angle < np.inf
    heat, joint, deflection = 0.0, 0.0, 0.0
    if on.memory:
        deflection = deflection_of(plant, fx, output, load)
    for step in range(n):
        start = step * h
        half = 0.5 * h
        # ---- positions in the middle, and what depends on them
        load_after, load_speed_after = load, load_speed
        if on.load_given:
            load_middle, load_speed_middle = _at(load_motion, start + half)
            load_after, load_speed_after = _at(load_motion, start + h)
        else:
            load_middle, load_speed_middle = load + half * load_speed, load_speed
        wheel_after, speed_after = wheel, speed
        if on.wheel_given:
            wheel_middle, mean = _at(wheel_motion, start + half)
            wheel_after, speed_after = _at(wheel_motion, start + h)
        else:
            wheel_middle, mean = wheel + half * speed, speed
        output_middle, output_mean = wheel_middle, mean
        if on.play:
            output_middle, output_mean = output + half * output_speed, output_speed
        torque, lever = 0.0, 1.0
        deflection_middle = output_middle - load_middle
        if on.error:
            error, slope = e.angle_error(fx, output_middle, plant.gear_ratio)
            deflection_middle += error
            lever += slope
        if not on.rigid:
            torque = table_torque(spring, deflection_middle)
            if on.memory:
                s.remember(fx, y, deflection_middle - deflection, half)
                torque += s.remembered_torque(fx, y)
        push, load_push = 0.0, plant.load_torque
        factor = 1.0
        if on.any:
            push = e.wheel_torque(fx, wheel_middle) - fx[e.GEAR_OFFSET]
            if fx[e.RIPPLE] != 0.0:
                factor += fx[e.RIPPLE] * np.sin(
                    fx[e.RIPPLE_CYCLES] * wheel_middle + fx[e.RIPPLE_PHASE]
                )
            load_push -= fx[e.PARALLEL] * (load_middle - fx[e.PARALLEL_REST])
            if fx[e.UNBALANCE] != 0.0:
                load_push -= fx[e.UNBALANCE] * np.sin(load_middle + fx[e.UNBALANCE_ANGLE])
            load_push += fx[e.PULSE] * _overlap(fx, given.start + start, h)
        if plant.gravity != 0.0:
            load_push -= plant.gravity * np.sin(load_middle + plant.gravity_offset)
        load_drag = plant.load_damping
        if has_contact:
            pressed, damping = _contact(plant, fx, load, load_speed, h)
            load_push -= pressed
            load_drag += damping
        link_torque, tip_mean = 0.0, tip_speed
        if on.link:
            link_torque = fx[e.LINK_STIFFNESS] * (load_middle - tip - half * tip_speed)
        k_tf, k_ef = k_t * factor, k_e * factor
        free_mean = settled + (current - settled) * lag
        # ---- speeds, once with the old ones in the laws of the speed, then with their mean
        capped, held, done, after = False, current, 0, current
        way, load_way, tip_after = 0.0, 0.0, tip_speed
        stretch_after, load_stretch_after = gear_stretch, load_stretch
        output_after, output_way = output_speed, 0.0
        joint = 0.0
        while True:
            shaft, drag = push + given_torque, plant.damping
            if electric and not capped:
                shaft += k_tf * free_mean
                drag += k_tf * k_ef / resistance * (1.0 - lag)
            else:
                shaft += k_tf * held
            joined, load_shaft, load_drag_now = torque, load_push, load_drag
            if on.any:
                if fx[e.SPRING_DAMPING] != 0.0:
                    joined += fx[e.SPRING_DAMPING] * (output_mean - load_speed_middle)
                if fx[e.ATAN_LEVEL] != 0.0:  # linear around the mean, implicit
                    x = mean / fx[e.ATAN_VELOCITY]
                    steep = fx[e.ATAN_LEVEL] / (fx[e.ATAN_VELOCITY] * (1.0 + x * x))
                    shaft -= fx[e.ATAN_LEVEL] * np.arctan(x) - steep * mean
                    drag += steep
                if fx[e.DRAG] != 0.0:
                    load_drag_now += fx[e.DRAG] * abs(load_speed_middle)
                if on.link:
                    twist = load_speed_middle - tip_mean
                    load_shaft -= link_torque + fx[e.LINK_DAMPING] * twist
            friction = load_friction = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            if on.wheel_dry:
                carried = joined
                if on.rigid:
                    carried = joint if done > 0 else -load_push
                friction = gear_levels(fx, carried, mean)
            if on.load_dry:
                load_friction = load_levels(plant, fx, load_middle, load_speed_middle)
            if on.rigid and not on.wheel_given:
                both = (
                    friction[0] + load_friction[0], friction[1] + load_friction[1],
                    friction[2] + load_friction[2], friction[3] + load_friction[3],
                    friction[4] + load_friction[4], max(friction[5], load_friction[5]),
                )  # fmt: skip
                speed_after, way, stretch_after = s.move(
                    plant.inertia + near, drag + load_drag_now, shaft + load_shaft, both,
                    gear_stretch, speed, h,
                )  # fmt: skip
                load_speed_after, load_way, load_stretch_after = speed_after, way, stretch_after
                slowed = load_shaft - load_drag_now * way / h
                joint = near * (speed_after - speed) / h - slowed
            else:
                if not on.wheel_given:
                    if on.play:
                        speed_after, way, stretch_after, output_after, output_way = s.play_move(
                            front, behind, drag, 0.0, shaft, -lever * joined, friction,
                            gear_stretch, 0.5 * fx[e.BACKLASH],
                            (speed, output_speed, wheel - output), h,
                        )  # fmt: skip
                    else:
                        speed_after, way, stretch_after = s.move(
                            front, drag, shaft - lever * joined, friction, gear_stretch, speed, h
                        )
                if not on.load_given:
                    load_speed_after, load_way, load_stretch_after = s.move(
                        near, load_drag_now, joined + load_shaft, load_friction, load_stretch,
                        load_speed, h,
                    )  # fmt: skip
                if on.rigid:
                    accelerating = plant.inertia * (speed_after - speed) / h
                    joint = shaft - drag * 0.5 * (speed + speed_after) - accelerating
            if on.link:
                pulled = link_torque + fx[e.LINK_DAMPING] * (load_speed_middle - tip_mean)
                tip_after = tip_speed + h * pulled / tip_inertia
            if on.wheel_given:
                way = wheel_after - wheel
            mean = way / h
            if electric and not capped:
                end = settled - k_ef * mean / resistance
                after = end + (current - end) * decay
                if abs(after) > limit:
                    capped = True
                    edge = limit if after > 0.0 else -limit
                    share = 0.0
                    if decay > 0.0 and after != current:
                        share = min(max((edge - current) / (after - current), 0.0), 1.0)
                    held = edge - 0.5 * share * (edge - current)
                    done = 0
                    continue
            done += 1
            if done >= on.passes:
                break
            output_mean = output_way / h if on.play else mean
            tip_mean = 0.5 * (tip_speed + tip_after)
            if not on.load_given:
                load_speed_middle = load_way / h
        # ---- on to the end of the step
        if electric:
            mean_current = held
            if capped:
                current = limit if after > 0.0 else -limit
            else:
                end = settled - k_ef * mean / resistance
                mean_current = end + (current - end) * lag
                current = end + (current - end) * decay
            heat += mean_current * mean_current
        else:
            heat += current * current
        wheel = wheel_after if on.wheel_given else wheel + way
        load = load_after if on.load_given else load + load_way
        speed, load_speed = speed_after, load_speed_after
        gear_stretch, load_stretch = stretch_after, load_stretch_after
        if on.play:
            output, output_speed = output + output_way, output_after
        else:
            output = wheel
        if on.link:
            tip += 0.5 * h * (tip_speed + tip_after)
            tip_speed = tip_after
        if on.memory:
            deflection = deflection_of(plant, fx, output, load)
            s.remember(fx, y, deflection - deflection_middle, half)
    if electric and plant.inductance == 0.0:
        current = s.clip(settled - k_e * speed / resistance, limit)
    y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED] = current, wheel, speed
    y[s.LOAD], y[s.LOAD_SPEED] = load, load_speed
    y[s.OUTPUT], y[s.OUTPUT_SPEED] = output, output_speed if on.play else speed
    y[s.LINK], y[s.LINK_SPEED] = (tip, tip_speed) if on.link else (load, load_speed)
    y[s.GEAR_STRETCH], y[s.LOAD_STRETCH] = gear_stretch, load_stretch
    if on.thermal:
        s.warm_up(fx, y, copper * heat / n, n * h)
    return joint
