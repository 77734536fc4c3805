"""How the arrays of the fixed-step engine are laid out, and the tuples that carry them.

Places in the state, in what a row reads, in the switches and in what goes from call to call;
`find_features` and `machine_of` turn a model's numbers into the parts that its steps have.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import C0

DONE = -1  # how a run ends; else the row that was not finite
BENCH = 4  # structure: gear and load are both given, the spring answers

# the full state; everything on the output side of the gear: the motor's side as `gear`, what
# follows its backlash as `output` (equal to `gear` without backlash)
CURRENT, GEAR, GEAR_SPEED, LOAD, LOAD_SPEED = range(5)
OUTPUT, OUTPUT_SPEED = 5, 6
LINK, LINK_SPEED = 7, 8  # of what lies beyond the flexibility of the link
WINDING_RISE, CASE_RISE = 9, 10  # [K] above ambient
GEAR_DEFLECTION, LOAD_DEFLECTION = 11, 12  # of the elements of presliding friction [rad]
SLIP = 13  # deflections of the Maxwell-slip elements [rad]
BOUC_WEN = SLIP + e.N_SLIPS
BRANCH = BOUC_WEN + 1  # deflections of the Maxwell branches [rad]
N_STEP_STATES = BRANCH + e.N_BRANCHES
STATE_NAMES = (
    "current_A",
    "wheel_angle_rad",
    "wheel_velocity_rad_per_s",
    "load_angle_rad",
    "load_velocity_rad_per_s",
    "output_angle_rad",
    "output_velocity_rad_per_s",
    "link_angle_rad",
    "link_velocity_rad_per_s",
    "winding_rise_K",
    "case_rise_K",
    "gear_deflection_rad",
    "load_deflection_rad",
    *(f"slip_deflection_{k + 1}_rad" for k in range(e.N_SLIPS)),
    "bouc_wen_deflection_rad",
    *(f"branch_deflection_{k + 1}_rad" for k in range(e.N_BRANCHES)),
)

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

# what goes from call to call beside the state: the gains of the Maxwell branches
# (`step_torques.branch_gains`), the last row whose command has acted, the joint torque of a
# rigid machine, the accelerations of gear and load in the last step (NaN before the first)
N_GAINS = 2 * e.N_BRANCHES
LATEST, JOINT, GEAR_ACCELERATION, LOAD_ACCELERATION = range(N_GAINS, N_GAINS + 4)
N_CARRIED = N_GAINS + 4

# which parts of the step a machine needs: places in an array, found once a run
RIGID, LOAD_GIVEN, GEAR_GIVEN, TERMS, GEAR_DRY, LOAD_DRY, INTERNAL_STATES, BACKLASH_ON, LINK_ON = (
    range(9)
)
THERMAL, TRANSMISSION_ERROR = 9, 10
LINEAR = 11  # the spring
PLAIN = 12  # no more than dry friction of one level
PASSES = 13
SPEED = 14  # laws of the speed, which are evaluated at its mean over a step
N_FEATURES = 15


class ModelArrays(NamedTuple):
    """One model as the compiled kernel takes it."""

    plant: NDArray  # (24,) the fields of `Plant`
    spring: NDArray  # (r, 6) `SpringTable.regions`
    fx: NDArray  # (N_EFFECTS,)
    on: NDArray  # (N_FEATURES,) of int, by `find_features`


class Models(NamedTuple):
    """Several models, packed."""

    plants: NDArray  # (m, 24)
    springs: NDArray  # (regions of all, 6)
    ends: NDArray  # (m,) where each model's regions end
    fx: NDArray  # (m, N_EFFECTS)


class Columns(NamedTuple):
    """What is known of every row; columns that a recording does not have are empty."""

    time: NDArray  # (n,)
    steps: NDArray  # (n,) steps within each row, the last unused
    command: NDArray  # (n,)
    supply: NDArray  # (n,) or (0,) measured supply [V]
    enabled: NDArray  # (n,) or (0,) 0 where the bridge is open
    load_angle: NDArray  # (n,) or (0,) of a given load
    load_speed: NDArray
    gear_angle: NDArray  # (n,) or (0,) of a given gear (a spring bench)
    gear_speed: NDArray


class Carried(NamedTuple):
    """What goes from call to call of the kernel."""

    y: NDArray  # (N_STEP_STATES,) the state
    more: NDArray  # (N_CARRIED,)


class Record(NamedTuple):
    """What a run writes by row."""

    out: NDArray  # (rows, N_CHANNELS or, in a closed loop with its command, one more) or (0, ...)
    states: NDArray  # (rows, N_STEP_STATES) or (0, N_STEP_STATES)


class Loop(NamedTuple):
    """A closed loop around a run; without rows of `reference` there is none."""

    counts: NDArray  # (N_COUNTS,) of int, see `closed_loop`
    limits: NDArray  # (N_LIMITS or more,), see `closed_loop`
    parameters: NDArray  # of the controller, as `equations.CONTROLLER`
    internal: NDArray  # its state
    reference: NDArray  # (n, 3) with its first two derivatives
    signals: NDArray  # (N_SIGNALS,)
    answers: NDArray  # (N_ANSWERS,)
    metrics: NDArray  # (N_METRICS,)


class Machine(NamedTuple):
    """A model's numbers that stay over a run, and which parts its steps have."""

    plant: mp.Plant
    full: bool  # more than a plain machine
    terms: bool
    rigid: bool
    linear: bool  # the spring
    transmission_error: bool
    internal: bool  # of the spring
    backlash: bool
    link: bool
    load_given: bool
    gear_given: bool
    gear_dry: bool
    load_dry: bool
    contact: bool
    load_losses: bool  # of a rigid gear, solved in closed form
    thermal: bool
    source_resistance: bool  # the winding's resistance changes
    without_regeneration: bool
    winding: bool  # the drive is a voltage
    servo: bool  # that of a goal's distance
    speed_laws: bool
    passes: int
    gear_inertia: float  # without the output's, where there is backlash
    gear_damping: float
    output_inertia: float  # behind the backlash
    tip_inertia: float  # beyond the flexible link
    dead_time_V: float
    per_henry: float  # 0: the current follows the voltage at once
    stiffness: float  # of a linear spring


@njit(error_model="numpy")
def as_plant(p):
    """The `Plant` of its numbers in an array."""
    return mp.Plant(
        int(p[0]), int(p[1]), p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
        p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21], p[22], p[23],
    )  # fmt: skip


@njit(error_model="numpy")
def _is_linear(spring):
    """Whether a spring table is one straight line through zero."""
    linear = spring.shape[0] == 2 and spring[1, C0] == 0.0 and spring[1, C0 - 1] == 0.0
    linear = linear and spring[0, C0 + 1] == spring[1, C0 + 1]
    for j in range(C0 + 2, spring.shape[1]):
        linear = linear and spring[0, j] == 0.0 and spring[1, j] == 0.0
    return linear


@njit(error_model="numpy")
def _is_plain(plant, fx):
    """Whether a machine has no effects but dry friction of one level and its command's."""
    plain = plant.structure == mp.ELASTIC_FREE and not plant.contact_angle < np.inf
    for j in range(e.N_EFFECTS):
        allowed = j == e.ANY or e.WHEEL_DRY <= j <= e.GEAR_BACKWARD or j == e.LOAD_DRY
        allowed = allowed or j == e.LOAD_COULOMB or j == e.GEAR_DRIVE_LOSS
        allowed = allowed or j == e.GEAR_BACKDRIVE_LOSS or j == e.DEAD_ZONE or j == e.COMMAND_DELAY
        allowed = allowed or j == e.COMMAND_OFFSET or j == e.COMMAND_DRIFT or j == e.ROUNDED_ZONE
        plain = plain and (allowed or fx[j] == 0.0)
    return plain


@njit(error_model="numpy")
def find_features(plant, spring, fx, on):
    """Fill `on` (N_FEATURES,) with the parts of the step that these numbers need."""
    internal = fx[e.BOUC_WEN] != 0.0
    for j in range(e.N_SLIPS):
        internal = internal or fx[e.SLIP_STIFFNESS + j] != 0.0
    for j in range(e.N_BRANCHES):
        internal = internal or fx[e.BRANCH_STIFFNESS + j] != 0.0
    structure = plant.structure
    rigid = structure == mp.RIGID_FREE or structure == mp.RIGID_HELD
    loss = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    link = fx[e.LINK_STIFFNESS] > 0.0 and fx[e.LINK_INERTIA] > 0.0
    speed = fx[e.GEAR_RISE] != 0.0 or fx[e.LOAD_RISE] != 0.0 or fx[e.DRAG] != 0.0
    speed = speed or fx[e.ATAN_LEVEL] != 0.0 or fx[e.SPRING_DAMPING] != 0.0
    speed = speed or fx[e.NORMAL_FRICTION] != 0.0 or fx[e.DEAD_TIME] != 0.0
    speed = speed or fx[e.INERTIA_COSINE] != 0.0 or fx[e.INERTIA_SINE] != 0.0
    speed = speed or fx[e.OUTSIDE] != 0.0  # laws of users may be of any speed
    speed = speed or (link and fx[e.LINK_DAMPING] != 0.0)
    speed = speed or fx[e.GEAR_BRISTLE_DAMPING] != 0.0 or fx[e.LOAD_BRISTLE_DAMPING] != 0.0
    error = fx[e.WHEEL_ERROR] != 0.0 or fx[e.WORM_ERROR] != 0.0 or fx[e.WHEEL_ERROR_2] != 0.0
    on[RIGID] = rigid
    on[LOAD_GIVEN] = (
        structure == mp.ELASTIC_HELD or structure == mp.RIGID_HELD or structure == BENCH
    )
    on[GEAR_GIVEN] = structure == mp.RIGID_HELD or structure == BENCH
    on[TERMS] = fx[e.ANY] != 0.0
    on[GEAR_DRY] = fx[e.WHEEL_DRY] != 0.0 or fx[e.GEAR_PRESLIDING] > 0.0
    on[LOAD_DRY] = fx[e.LOAD_DRY] != 0.0 or fx[e.LOAD_PRESLIDING] > 0.0
    on[INTERNAL_STATES] = internal
    on[BACKLASH_ON] = fx[e.BACKLASH] > 0.0 and not rigid
    on[LINK_ON] = link
    on[THERMAL] = fx[e.WINDING_CAPACITY] > 0.0
    on[TRANSMISSION_ERROR] = error or fx[e.WORM_ERROR_2] != 0.0 or fx[e.WORM_ERROR_3] != 0.0
    on[LINEAR] = _is_linear(spring)
    on[PLAIN] = _is_plain(plant, fx)
    on[SPEED] = speed
    behind = link or fx[e.BACKLASH] > 0.0  # whose speeds are not foreseen
    iterated = rigid and loss and fx[e.GEAR_PRESLIDING] > 0.0  # else solved (`lossy_step`)
    on[PASSES] = 2 if (speed and behind) or iterated else 1


@njit(error_model="numpy", forceinline=True)
def machine_of(arrays, full):
    """The `Machine` of a model's arrays; `full` False: one that is plain."""
    fx, on, plant = arrays.fx, arrays.on, as_plant(arrays.plant)
    rigid, gear_given = full & (on[RIGID] != 0), full & (on[GEAR_GIVEN] != 0)
    backlash, link = full & (on[BACKLASH_ON] != 0), full & (on[LINK_ON] != 0)
    losses = (fx[e.GEAR_DRIVE_LOSS] != 0.0) | (fx[e.GEAR_BACKDRIVE_LOSS] != 0.0)
    load_losses = rigid & (not gear_given) & (fx[e.GEAR_PRESLIDING] == 0.0) & losses
    thermal = full & (on[THERMAL] != 0)
    changing = full & (thermal | (fx[e.SOURCE_RESISTANCE] != 0.0))
    gear_inertia, gear_damping = plant.inertia, plant.damping
    if backlash:
        gear_inertia -= fx[e.BACKLASH_INERTIA]
        gear_damping -= fx[e.BACKLASH_DAMPING]
    passes = on[PASSES] if full else 1
    tip_inertia = fx[e.LINK_INERTIA] if link else 0.0
    servo = plant.drive == mp.POSITION
    per_henry = 1.0 / plant.inductance if plant.inductance > 0.0 else 0.0
    return Machine(
        plant=plant,
        full=full,
        terms=full & (on[TERMS] != 0),
        rigid=rigid,
        linear=on[LINEAR] != 0,
        transmission_error=full & (on[TRANSMISSION_ERROR] != 0),
        internal=full & (on[INTERNAL_STATES] != 0),
        backlash=backlash,
        link=link,
        load_given=full & (on[LOAD_GIVEN] != 0),
        gear_given=gear_given,
        gear_dry=on[GEAR_DRY] != 0,
        load_dry=on[LOAD_DRY] != 0,
        contact=full & (plant.contact_angle < np.inf),
        load_losses=load_losses,
        thermal=thermal,
        source_resistance=changing,
        without_regeneration=changing & (fx[e.SOURCE_ONE_DIRECTION] != 0.0),
        winding=(plant.drive == mp.DUTY) | (plant.drive == mp.VOLTAGE) | servo,
        servo=servo,
        speed_laws=full & (on[SPEED] != 0),
        passes=passes,
        gear_inertia=gear_inertia,
        gear_damping=gear_damping,
        output_inertia=fx[e.BACKLASH_INERTIA],
        tip_inertia=tip_inertia,
        dead_time_V=fx[e.DEAD_TIME] * plant.volts_per_command,
        per_henry=per_henry,
        stiffness=arrays.spring[0, C0 + 1],
    )
