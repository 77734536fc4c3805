"""What a step of the fast engine is made of: switches, inputs, friction levels, readings.

Compiled scalar functions that `stepping` puts together; the laws are those of `effects`.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.gear_transmission_error as gear_error
import rsea_core.effects.layout as e
import rsea_core.engines.fixed_step.body_moves as s
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import ANCHOR, C0, C1, C2, C3, UPPER

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
acting_command = njit(error_model="numpy")(e.acting_command.py_func)
angle_error = njit(error_model="numpy")(gear_error.angle_error.py_func)
source_ohm = njit(error_model="numpy")(e.source_ohm.py_func)
wheel_torque = njit(error_model="numpy")(e.wheel_torque.py_func)
contact_torque = njit(error_model="numpy")(e.contact_torque.py_func)
load_coulomb = njit(error_model="numpy")(e.load_coulomb.py_func)


# which parts of the step a machine needs: places in an array, found once a run
RIGID, LOAD_GIVEN, WHEEL_GIVEN, TERMS, WHEEL_DRY, LOAD_DRY, MEMORY, PLAY, LINK = range(9)
THERMAL, ERROR = 9, 10
LINEAR = 11  # the spring
PLAIN = 12  # no more than dry friction of one level
PASSES = 13
SPEED = 14  # laws of the speed, which are evaluated at its mean over a step
N_SWITCHES = 15
DEAD_TIME_PASSES = 3
# what goes from call to call of the kernel beside the state: the last row whose command has
# acted, the joint torque of a rigid machine; what `step_laws.branch_gains` keeps
LATEST, JOINT = s.N_GAINS, s.N_GAINS + 1
# accelerations of wheel and load in the last step, NaN before the first
WHEEL_RATE, LOAD_RATE = s.N_GAINS + 2, s.N_GAINS + 3
N_CARRIED = s.N_GAINS + 4


class Motion(NamedTuple):
    """A given motion over a piece: x0 + v0 t + a t^2/2 + j t^3/6."""

    angle: float
    speed: float
    acceleration: float
    jerk: float


@njit(error_model="numpy")
def as_plant(p):
    """The `Plant` of its numbers in an array."""
    return mp.Plant(
        int(p[0]), int(p[1]), p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
        p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21],
    )  # fmt: skip


@njit(error_model="numpy")
def find_switches(plant, spring, fx, on):
    """Fill `on` (N_SWITCHES,) with the parts of the step that these numbers need."""
    memory = fx[e.BOUC_WEN] != 0.0
    for j in range(e.N_SLIPS):
        memory = memory or fx[e.SLIP_STIFFNESS + j] != 0.0
    for j in range(e.N_BRANCHES):
        memory = memory or fx[e.BRANCH_STIFFNESS + j] != 0.0
    structure = plant.structure
    rigid = structure == mp.RIGID_FREE or structure == mp.RIGID_HELD
    loss = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    link = fx[e.LINK_STIFFNESS] > 0.0 and fx[e.LINK_INERTIA] > 0.0
    speed = fx[e.GEAR_RISE] != 0.0 or fx[e.LOAD_RISE] != 0.0 or fx[e.DRAG] != 0.0
    speed = speed or fx[e.ATAN_LEVEL] != 0.0 or fx[e.SPRING_DAMPING] != 0.0
    speed = speed or fx[e.NORMAL_FRICTION] != 0.0 or fx[e.DEAD_TIME] != 0.0
    speed = speed or (link and fx[e.LINK_DAMPING] != 0.0)
    speed = speed or fx[e.GEAR_BRISTLE_DAMPING] != 0.0 or fx[e.LOAD_BRISTLE_DAMPING] != 0.0
    linear = spring.shape[0] == 2 and spring[1, C0] == 0.0 and spring[1, C0 - 1] == 0.0
    linear = linear and spring[0, C0 + 1] == spring[1, C0 + 1]
    for j in range(C0 + 2, spring.shape[1]):
        linear = linear and spring[0, j] == 0.0 and spring[1, j] == 0.0
    plain = structure == mp.ELASTIC_FREE and not plant.contact_angle < np.inf
    for j in range(e.N_EFFECTS):
        allowed = j == e.ANY or e.WHEEL_DRY <= j <= e.GEAR_BACKWARD or j == e.LOAD_DRY
        allowed = allowed or j == e.LOAD_COULOMB or j == e.GEAR_DRIVE_LOSS
        allowed = allowed or j == e.GEAR_BACKDRIVE_LOSS or j == e.DEAD_ZONE or j == e.COMMAND_DELAY
        plain = plain and (allowed or fx[j] == 0.0)
    on[RIGID] = rigid
    on[LOAD_GIVEN] = (
        structure == mp.ELASTIC_HELD or structure == mp.RIGID_HELD or structure == BENCH
    )
    on[WHEEL_GIVEN] = structure == mp.RIGID_HELD or structure == BENCH
    on[TERMS] = fx[e.ANY] != 0.0
    on[WHEEL_DRY] = fx[e.WHEEL_DRY] != 0.0 or fx[e.GEAR_PRESLIDING] > 0.0
    on[LOAD_DRY] = fx[e.LOAD_DRY] != 0.0 or fx[e.LOAD_PRESLIDING] > 0.0
    on[MEMORY] = memory
    on[PLAY] = fx[e.BACKLASH] > 0.0 and not rigid
    on[LINK] = link
    on[THERMAL] = fx[e.WINDING_CAPACITY] > 0.0
    on[ERROR] = fx[e.WHEEL_ERROR] != 0.0 or fx[e.WORM_ERROR] != 0.0
    if fx[e.WHEEL_ERROR_2] != 0.0 or fx[e.WORM_ERROR_2] != 0.0 or fx[e.WORM_ERROR_3] != 0.0:
        on[ERROR] = True
    on[LINEAR] = linear
    on[PLAIN] = plain
    on[SPEED] = speed
    behind = link or fx[e.BACKLASH] > 0.0  # whose speeds are not foreseen
    iterated = rigid and loss and fx[e.GEAR_PRESLIDING] > 0.0  # else solved (`lossy_move`)
    on[PASSES] = 2 if (speed and behind) or iterated else 1


@njit(error_model="numpy")
def warm_winding(plant, fx, y):
    """Resistance, torque and speed constant of the winding at its temperatures."""
    rise = 1.0 + fx[e.RESISTANCE_RISE] * y[s.WINDING_RISE]
    weaker = 1.0 - fx[e.CONSTANT_FALL] * y[s.CASE_RISE]
    weaker -= fx[e.CONSTANT_FALL_WINDING] * y[s.WINDING_RISE]
    return (
        plant.resistance * rise,
        plant.torque_per_ampere * weaker,
        plant.volts_per_speed * weaker,
    )


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
def gear_levels(fx, slip, torque, speed, stretch):
    """What `step_laws.move` needs of the gear's friction for a torque and a mean speed.

    `slip` is the factor of `gear_slip` at that speed.
    """
    forward_loss, backward_loss = gear_losses(fx, torque)
    rise = 1.0 + fx[e.GEAR_RISE]
    forward, backward = fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]
    if fx[e.GEAR_PRESLIDING] > 0.0:
        positive = stretch > 0.0 or (stretch == 0.0 and speed > 0.0)
        level = forward if positive else backward
        width = fx[e.GEAR_PRESLIDING]
        losses = forward_loss, backward_loss
        stiffness = rise * level / width
        if fx[e.GEAR_BRISTLE] > 1.5:  # the bristles carry what grows with the load too
            loss = forward_loss if positive else backward_loss
            carried, most = slip * (level + loss), rise * (level + loss)
            return 0.0, 0.0, 0.0, 0.0, carried, most / width, -width
        if fx[e.GEAR_BRISTLE] != 0.0:
            width = -width
        return (*losses, *losses, slip * level, stiffness, width)
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
def load_levels(fx, across, down, speed):
    """What `step_laws.move` needs of the load joint's friction.

    `across`, `down` are sine and cosine of the angle from where the load hangs.
    """
    normal, held = 0.0, 0.0
    if fx[e.NORMAL_FRICTION] > 0.0:
        along = fx[e.WEIGHT] * down + fx[e.MASS_LEVER] * speed * speed
        across *= fx[e.WEIGHT]
        normal = fx[e.NORMAL_FRICTION] * np.sqrt(along * along + across * across)
        held = fx[e.NORMAL_FRICTION] * fx[e.WEIGHT]
    level = load_coulomb(fx, speed)
    if fx[e.LOAD_PRESLIDING] > 0.0:
        width = fx[e.LOAD_PRESLIDING]
        stiffness = (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] / width
        if fx[e.LOAD_BRISTLE] != 0.0:
            width = -width
        return normal, normal, held, held, level, stiffness, width
    level, hold = level + normal, (1.0 + fx[e.LOAD_RISE]) * fx[e.LOAD_COULOMB] + held
    return level, level, hold, hold, 0.0, 0.0, 0.0


@njit(error_model="numpy")
def mean_contact(fx, stiffness, damping, depth, speed, h):
    """Mean torque of the contact over a step [Nm] of which damping is left out, and its drag."""
    share, deepest = s.contact_share(depth, depth + h * speed)
    if share == 0.0:
        return 0.0, 0.0
    middle = depth + 0.5 * h * speed
    if fx[e.EXPONENT] == 0.0:
        mean = middle if share == 1.0 else 0.5 * share * deepest
        return stiffness * mean, share * damping
    if share == 1.0:
        elastic, lost = contact_torque(fx, stiffness, middle, speed)
        return elastic + lost, damping
    elastic, lost = contact_torque(fx, stiffness, deepest, speed)
    return (elastic + lost) * share / (fx[e.EXPONENT] + 1.0), share * damping


@njit(error_model="numpy", inline="always")
def tapered_area(x, taper):
    """Integral from 0 to x of a pulse over 0..1 whose flanks are cosines over taper/2 each."""
    x = min(max(x, 0.0), 1.0)
    if taper <= 0.0:
        return x
    half = 0.5 * taper
    rise = min(x, half)
    area = 0.5 * (rise - half / np.pi * np.sin(np.pi * rise / half))
    if x > half:
        area += min(x, 1.0 - half) - half
    if x > 1.0 - half:
        left = x - (1.0 - half)
        area += 0.5 * (left + half / np.pi * np.sin(np.pi * left / half))
    return area


@njit(error_model="numpy")
def risen_area(t, rise):
    """Integral from 0 to t of a share that rises from 0 to 1 within `rise`."""
    return 0.5 * t * t / rise if t < rise else t - 0.5 * rise


@njit(error_model="numpy")
def pulse_share(fx, start, h):
    """Mean of the disturbance over a step, of its peak: a pulse with cosine flanks (Tukey)."""
    if fx[e.PULSE] == 0.0:
        return 0.0
    rise = fx[e.PULSE_RISE]
    if rise > 0.0:
        begin = max(start, fx[e.PULSE_START])
        end = max(min(start + h, fx[e.PULSE_END]), begin)
        until, since = end - fx[e.PULSE_START], begin - fx[e.PULSE_START]
        return (risen_area(until, rise) - risen_area(since, rise)) / h
    length = fx[e.PULSE_END] - fx[e.PULSE_START]
    begin = (start - fx[e.PULSE_START]) / length
    after = tapered_area(begin + h / length, fx[e.PULSE_TAPER])
    return (after - tapered_area(begin, fx[e.PULSE_TAPER])) * length / h


@njit(error_model="numpy")
def motion_at(motion, t):
    """Angle and speed of a given motion."""
    angle = motion.angle + t * (
        motion.speed + t * (0.5 * motion.acceleration + t * motion.jerk / 6.0)
    )
    return angle, motion.speed + t * (motion.acceleration + 0.5 * t * motion.jerk)


@njit(error_model="numpy")
def motion_of(angle, speed, row, h):
    """The cubic between two rows of a given motion."""
    slope = (angle[row + 1] - angle[row]) / h
    before, after = speed[row], speed[row + 1]
    return Motion(
        angle[row],
        before,
        2.0 * (3.0 * slope - 2.0 * before - after) / h,
        6.0 * (before + after - 2.0 * slope) / (h * h),
    )


@njit(error_model="numpy")
def later(motion, t):
    """A given motion counted from a later time."""
    angle, speed = motion_at(motion, t)
    return Motion(angle, speed, motion.acceleration + t * motion.jerk, motion.jerk)


@njit(error_model="numpy")
def next_piece(time, row, delay, offset, latest):
    """The last row whose command acts at an offset within a row, and where that piece ends.

    Rows are searched from `latest` on, -1 before the first one acts.
    """
    length = time[row + 1] - time[row]
    slack = 1e-9 * length  # a delay of whole rows makes no slivers
    now = time[row] + offset - delay + slack
    while latest < row and time[latest + 1] <= now:
        latest += 1
    if latest == row:
        return latest, length
    due = time[latest + 1] + delay - time[row]
    return latest, due if due < length - slack else length


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
