"""The numbers of a machine, as compiled code reads them."""

from typing import NamedTuple

# what the command of a row is
NO_DRIVE, DUTY, VOLTAGE, CURRENT, MOTOR_TORQUE, POSITION = range(6)


# how wheel and load are joined, and whether the load's motion is free or given
ELASTIC_FREE, ELASTIC_HELD, RIGID_FREE, RIGID_HELD = range(4)


class Plant(NamedTuple):
    """The numbers of a machine; everything on the output side of the gear, SI.

    POSITION is a servo: its torque takes the place of the current (1 Nm for 1 A, 1 ohm), so that
    `volts_per_command` is the gain on the angle [Nm/rad], `volts_per_speed` that on the speed
    [Nms/rad] and `current_limit` the largest torque [Nm].
    """

    drive: int
    structure: int
    volts_per_command: float  # DUTY: supply; VOLTAGE: 1
    resistance: float
    inductance: float  # 0: the current follows the voltage at once
    torque_per_ampere: float
    volts_per_speed: float
    torque_per_motor_torque: float
    current_limit: float  # inf: none
    inertia: float
    damping: float
    load_inertia: float
    load_damping: float
    gravity: float  # m g d
    gravity_offset: float
    load_torque: float
    contact_stiffness: float
    contact_damping: float
    contact_angle: float  # inf: none
    gear_ratio: float
    motor_count: float  # encoder count, motor side; 0: no quantisation
    load_count: float
    goal_dead_band: float = 0.0  # half-width about the goal in which a servo gives no torque [rad]
    goal_rate_s: float = 0.0  # a servo's goal is led by its rate times this
