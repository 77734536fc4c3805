"""What goes into a case: levels, pairs and the words of the labels."""

from dataclasses import dataclass

from dftfs.proof.effects_base import Draw
from dftfs.proof.effects_drive import DRIVE_AND_GEAR
from dftfs.proof.effects_load import LOAD_AND_SENSORS
from dftfs.proof.effects_outside import OUTSIDE
from dftfs.proof.effects_spring import SPRING

EFFECTS: dict[str, Draw] = DRIVE_AND_GEAR | SPRING | LOAD_AND_SENSORS
ALL: dict[str, Draw] = EFFECTS | OUTSIDE

LEVELS = ("plain", "concealed", "confounded", "double", "null", "outside", "poor")
# Shares of a run; the rest of the rounding goes to the first ones.
SHARES = {
    "plain": 0.26,
    "concealed": 0.20,
    "confounded": 0.10,
    "double": 0.13,
    "null": 0.16,
    "outside": 0.09,
    "poor": 0.06,
}
# The size of the trace that no constants mimic, in noise floors: where the search aims.
STRENGTHS = {
    "plain": (30.0, 400.0),
    "concealed": (4.0, 30.0),
    "confounded": (20.0, 200.0),
    "double": (20.0, 200.0),
    "outside": (15.0, 120.0),
    "poor": (1.9, 3.2),
}

# (what is there, what it can be taken for); the sensors and inputs that split them are present
CONFOUNDED = (
    ("drive-dead-zone", "gear-friction"),
    ("gear-friction", "drive-dead-zone"),
    ("spring-hysteresis", "spring-viscoelastic"),
    ("spring-viscoelastic", "spring-hysteresis"),
    ("gear-friction", "spring-hysteresis"),
    ("spring-hardening", "spring-contact"),
    ("spring-contact", "spring-hardening"),
    ("gear-backlash", "spring-contact"),
    ("load-friction", "gear-friction"),
    ("spring-parallel", "load-unbalance"),
    ("drive-delay", "sensor-delay"),
    ("sensor-delay", "drive-delay"),
    ("gear-transmission-error", "motor-cogging"),
    ("motor-cogging", "gear-transmission-error"),
    ("drive-saturation", "drive-thermal"),
    ("gear-load-friction", "gear-friction"),
)

DOUBLES = (
    ("gear-friction", "spring-hysteresis"),
    ("gear-backlash", "gear-friction"),
    ("drive-thermal", "spring-viscoelastic"),
    ("motor-cogging", "load-friction"),
    ("gear-load-friction", "load-drag"),
    ("spring-hardening", "gear-friction"),
    ("drive-dead-zone", "spring-viscoelastic"),
    ("load-unbalance", "spring-hysteresis"),
    ("drive-delay", "gear-friction"),
    ("sensor-delay", "spring-hardening"),
    ("sensor-scale", "motor-cogging"),
    ("gear-transmission-error", "load-friction"),
    ("drive-saturation", "gear-friction"),
    ("load-disturbance", "gear-load-friction"),
    ("spring-parallel", "drive-dead-zone"),
    ("load-flexibility", "gear-backlash"),
    ("contact-nonlinear", "gear-friction"),
    ("sensor-drift", "spring-contact"),
)


@dataclass(frozen=True, kw_only=True)
class Poor:
    """An alias pair without the sensor or the input that splits it."""

    truth: str
    rivals: tuple[str, ...]
    columns: tuple[str, ...]
    slots: tuple[tuple[str, str], ...]
    validation: tuple[str, str]
    test: tuple[str, str]


POOR = (
    Poor(
        truth="spring-hysteresis",
        rivals=("spring-viscoelastic", "gear-friction"),
        columns=("motor_angle_rad",),
        slots=(("locked", "slow-sine"),),
        validation=("locked", "slow-sine"),
        test=("locked", "slow-sine"),
    ),
    Poor(
        truth="spring-viscoelastic",
        rivals=("spring-hysteresis", "gear-friction"),
        columns=("motor_angle_rad",),
        slots=(("locked", "slow-sine"),),
        validation=("locked", "slow-sine"),
        test=("locked", "sine"),
    ),
    Poor(
        truth="gear-friction",
        rivals=("spring-hysteresis", "drive-dead-zone"),
        columns=("motor_angle_rad", "load_angle_rad"),
        slots=(("locked", "triangle"),),
        validation=("locked", "slow-sine"),
        test=("locked", "ramps"),
    ),
    Poor(
        truth="drive-dead-zone",
        rivals=("gear-friction", "spring-hysteresis"),
        columns=("motor_angle_rad", "load_angle_rad"),
        slots=(("locked", "triangle"),),
        validation=("locked", "slow-sine"),
        test=("locked", "ramps"),
    ),
    Poor(
        truth="spring-contact",
        rivals=("spring-hardening",),
        columns=("motor_angle_rad",),
        slots=(("locked", "slow-sine"),),
        validation=("locked", "slow-sine"),
        test=("locked", "ramps"),
    ),
)

# A rig file that was calibrated on the faulty machine: the constant that hides the effect.
MASKS = {
    "gear-friction": "motor_viscous_Nms_per_rad",
    "gear-load-friction": "torque_constant_Nm_per_A",
    "gear-backlash": "spring_stiffness_Nm_per_rad",
    "drive-dead-zone": "torque_constant_Nm_per_A",
    "drive-thermal": "terminal_resistance_ohm",
    "drive-saturation": "terminal_resistance_ohm",
    "spring-hysteresis": "spring_stiffness_Nm_per_rad",
    "spring-hardening": "spring_stiffness_Nm_per_rad",
    "spring-viscoelastic": "spring_stiffness_Nm_per_rad",
    "load-friction": "load_viscous_Nms_per_rad",
    "load-drag": "load_viscous_Nms_per_rad",
    "spring-parallel": "load_inertia_kgm2",
    "contact-nonlinear": "contact_stiffness_Nm_per_rad",
    "load-flexibility": "load_inertia_kgm2",
}
