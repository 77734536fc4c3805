"""The physics terms by name; a new effect is one class and one line here."""

from rsea_core.terms.base import Context, Parameter, Port, Term, parameter, require_bounds
from rsea_core.terms.drive import DriveDeadTime, DriveDeadZone, DriveDelay, DriveSaturation
from rsea_core.terms.environment import ContactNonlinear
from rsea_core.terms.gear import GearEfficiency, GearFriction, GearLoadFriction
from rsea_core.terms.hysteresis import SpringBoucWen, SpringHysteresis, SpringViscoelastic
from rsea_core.terms.load import (
    LoadDisturbance,
    LoadDrag,
    LoadFlexibility,
    LoadFriction,
    LoadUnbalance,
    SpringParallel,
)
from rsea_core.terms.mesh import GearBacklash, MotorCogging, TorqueRipple
from rsea_core.terms.position import LoadPositionTorque
from rsea_core.terms.sensors import (
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    SensorTable,
)
from rsea_core.terms.spring import SpringContact, SpringCurve, SpringHardening
from rsea_core.terms.thermal import DriveThermal
from rsea_core.terms.transmission import GearTransmissionError

_CLASSES: tuple[type[Term], ...] = (
    SpringCurve,
    GearFriction,
    GearLoadFriction,
    GearEfficiency,
    GearBacklash,
    LoadFriction,
    ContactNonlinear,
    DriveDeadZone,
    DriveDeadTime,
    DriveDelay,
    DriveSaturation,
    DriveThermal,
    GearTransmissionError,
    LoadDisturbance,
    LoadDrag,
    LoadFlexibility,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    TorqueRipple,
    SpringHardening,
    SpringContact,
    SpringHysteresis,
    SpringBoucWen,
    SpringViscoelastic,
    SpringParallel,
    SensorOffset,
    SensorScale,
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorTable,
)

LAWS: dict[str, dict[str, type[Term]]] = {}
"""Every term by effect and law."""
for _term in _CLASSES:
    LAWS.setdefault(_term.effect, {})[_term.law] = _term

TERMS: dict[str, type[Term]] = {effect: next(iter(laws.values())) for effect, laws in LAWS.items()}
"""The first law of every effect."""

__all__ = [
    "LAWS",
    "TERMS",
    "ContactNonlinear",
    "Context",
    "DriveDeadTime",
    "DriveDeadZone",
    "DriveDelay",
    "DriveSaturation",
    "DriveThermal",
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
    "Parameter",
    "Port",
    "SensorDelay",
    "SensorDrift",
    "SensorNoise",
    "SensorOffset",
    "SensorScale",
    "SpringBoucWen",
    "SpringContact",
    "SpringCurve",
    "SpringHardening",
    "SpringHysteresis",
    "SpringParallel",
    "SpringViscoelastic",
    "Term",
    "TorqueRipple",
    "parameter",
    "require_bounds",
]
