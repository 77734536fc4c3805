"""What a step of the fast engine is made of: switches, inputs, friction levels, readings.

Compiled scalar functions that `stepping` puts together; the laws are those of `effects`.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects as e
import rsea_core.kernel as k
import rsea_core.step_laws as s
import rsea_core.terms.table as table
from rsea_core.terms.table import C0

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


# The laws of others without numba's own inlining, which counts references of array arguments at
# every use; LLVM inlines them anyway.
table_torque = njit(error_model="numpy")(table.table_torque.py_func)
acting_command = njit(error_model="numpy")(e.acting_command.py_func)
angle_error = njit(error_model="numpy")(e.angle_error.py_func)
wheel_torque = njit(error_model="numpy")(e.wheel_torque.py_func)
contact_torque = njit(error_model="numpy")(e.contact_torque.py_func)
load_coulomb = njit(error_model="numpy")(e.load_coulomb.py_func)


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
    linear: bool  # the spring
    plain: bool  # no more than dry friction of one level
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
def switches(plant, spring, fx):
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
    linear = spring.shape[0] == 2 and spring[1, C0] == 0.0 and spring[1, C0 - 1] == 0.0
    linear = linear and spring[0, C0 + 1] == spring[1, C0 + 1]
    for j in range(C0 + 2, spring.shape[1]):
        linear = linear and spring[0, j] == 0.0 and spring[1, j] == 0.0
    plain = structure == k.ELASTIC_FREE and not plant.contact_angle < np.inf
    for j in range(e.N_EFFECTS):
        allowed = j == e.ANY or e.WHEEL_DRY <= j <= e.GEAR_BACKWARD or j == e.LOAD_DRY
        allowed = allowed or j == e.LOAD_COULOMB or e.GEAR_DRIVE_LOSS <= j <= e.GEAR_BACKDRIVE_LOSS
        allowed = allowed or e.DEAD_ZONE <= j <= e.SOURCE_RESISTANCE
        plain = plain and (allowed or fx[j] == 0.0)
    return Switches(
        rigid,
        structure in (k.ELASTIC_HELD, k.RIGID_HELD, BENCH),
        structure in (k.RIGID_HELD, BENCH),
        fx[e.ANY] != 0.0,
        fx[e.WHEEL_DRY] != 0.0 or fx[e.GEAR_PRESLIDING] > 0.0,
        fx[e.LOAD_DRY] != 0.0 or fx[e.LOAD_PRESLIDING] > 0.0,
        memory,
        fx[e.BACKLASH] > 0.0 and not rigid,
        link,
        fx[e.WINDING_CAPACITY] > 0.0,
        fx[e.WHEEL_ERROR] != 0.0 or fx[e.WORM_ERROR] != 0.0,
        linear,
        plain,
        2 if speed else 1,
    )


@njit(error_model="numpy")
def gear_levels(fx, torque, speed, stretch):
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
        positive = stretch > 0.0 or (stretch == 0.0 and speed > 0.0)
        level = forward if positive else backward
        width = fx[e.GEAR_PRESLIDING]
        losses = forward_loss, backward_loss
        return (*losses, *losses, slip * level, rise * level / width, width)
    return (
        slip * forward + forward_loss,
        slip * backward + backward_loss,
        rise * forward + forward_loss,
        rise * backward + backward_loss,
        0.0,
        0.0,
        0.0,
    )


@njit(error_model="numpy")
def load_levels(plant, fx, angle, speed):
    """What `step_laws.move` needs of the load joint's friction."""
    normal, held = 0.0, 0.0
    if fx[e.NORMAL_FRICTION] > 0.0:
        hanging = angle + plant.gravity_offset
        down, across = fx[e.WEIGHT] * np.cos(hanging), fx[e.WEIGHT] * np.sin(hanging)
        normal = fx[e.NORMAL_FRICTION] * np.hypot(down + fx[e.MASS_LEVER] * speed * speed, across)
        held = fx[e.NORMAL_FRICTION] * fx[e.WEIGHT]
    level = load_coulomb(fx, speed)
    if fx[e.LOAD_PRESLIDING] > 0.0:
        width = fx[e.LOAD_PRESLIDING]
        stiffness = (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] / width
        return normal, normal, held, held, level, stiffness, width
    level, hold = level + normal, (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] + held
    return level, level, hold, hold, 0.0, 0.0, 0.0


@njit(error_model="numpy")
def mean_contact(plant, fx, angle, speed, h):
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
        elastic, lost = contact_torque(fx, plant.contact_stiffness, middle, speed)
        return elastic + lost, plant.contact_damping
    elastic, lost = contact_torque(fx, plant.contact_stiffness, deepest, speed)
    return (elastic + lost) * share / (fx[e.EXPONENT] + 1.0), share * plant.contact_damping


@njit(error_model="numpy")
def pulse_share(fx, start, h):
    """Share of a step in which the disturbance acts."""
    if fx[e.PULSE] == 0.0:
        return 0.0
    inside = min(start + h, fx[e.PULSE_END]) - max(start, fx[e.PULSE_START])
    return max(inside, 0.0) / h


@njit(error_model="numpy", inline="always")
def motion_at(motion, t):
    """Angle and speed of a given motion."""
    angle = motion.angle + t * (
        motion.speed + t * (0.5 * motion.acceleration + t * motion.jerk / 6.0)
    )
    return angle, motion.speed + t * (motion.acceleration + 0.5 * t * motion.jerk)


@njit(error_model="numpy")
def deflection_of(plant, fx, output, load):
    """Deflection of the spring [rad], transmission error included."""
    error, _ = angle_error(fx, output, plant.gear_ratio)
    return output + error - load


@njit(error_model="numpy")
def spring_reading(plant, spring, fx, on, y):
    """Torque [Nm] that a sensor between spring and load reads."""
    output = y[s.OUTPUT] if on.play else y[s.WHEEL]
    speed = y[s.OUTPUT_SPEED] if on.play else y[s.WHEEL_SPEED]
    deflection = output - y[s.LOAD]
    if on.error:
        deflection = deflection_of(plant, fx, output, y[s.LOAD])
    torque = spring[0, C0 + 1] * deflection if on.linear else table_torque(spring, deflection)
    if on.memory:
        torque += s.remembered_torque(fx, y)
    return torque + fx[e.SPRING_DAMPING] * (speed - y[s.LOAD_SPEED])
