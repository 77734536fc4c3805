"""The physics that a rig file does not state; one file an effect.

The registry is imported before any module of the package, so that the effects' numbers have the
same places in every process (`slots`). What a file of one's own effect needs stands here:
`docs/adding-an-effect.md`.
"""

from rsea_core.effects.base import Context, Free, Parameter, Port, Term, parameter, require_bounds
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.hooks import hook, summed
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.registry import (
    LAWS,
    TERMS,
    ContactNonlinear,
    DriveDeadTime,
    DriveDeadZone,
    DriveDelay,
    DriveSaturation,
    DriveThermal,
    GearBacklash,
    GearEfficiency,
    GearFriction,
    GearLoadFriction,
    GearTransmissionError,
    LoadDisturbance,
    LoadDrag,
    LoadFlexibility,
    LoadFriction,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    OffsetDeadZone,
    RoundedDeadZone,
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    SensorTable,
    SpringBoucWen,
    SpringContact,
    SpringCurve,
    SpringHardening,
    SpringHysteresis,
    SpringParallel,
    SpringViscoelastic,
    TorqueRipple,
)
from rsea_core.effects.slots import slots
from rsea_core.effects.user_effects import load_effects, register


def __getattr__(name: str):
    """An effect's class that is not named in `__all__`, by its name."""
    for laws in LAWS.values():
        for kind in laws.values():
            if kind.__name__ == name:
                return kind
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "LAWS",
    "N_EFFECTS",
    "TERMS",
    "ContactNonlinear",
    "Context",
    "DriveDeadTime",
    "DriveDeadZone",
    "DriveDelay",
    "DriveSaturation",
    "DriveThermal",
    "EffectCurve",
    "Free",
    "GearBacklash",
    "GearEfficiency",
    "GearFriction",
    "GearLoadFriction",
    "GearTransmissionError",
    "LoadDisturbance",
    "LoadDrag",
    "LoadFlexibility",
    "LoadFriction",
    "LoadPositionTorque",
    "LoadUnbalance",
    "MotorCogging",
    "OffsetDeadZone",
    "Parameter",
    "Port",
    "RoundedDeadZone",
    "SensorDelay",
    "SensorDrift",
    "SensorNoise",
    "SensorOffset",
    "SensorScale",
    "SensorTable",
    "SpringBoucWen",
    "SpringContact",
    "SpringCurve",
    "SpringHardening",
    "SpringHysteresis",
    "SpringParallel",
    "SpringViscoelastic",
    "Term",
    "TorqueRipple",
    "hook",
    "load_effects",
    "parameter",
    "register",
    "require_bounds",
    "slots",
    "summed",
]
