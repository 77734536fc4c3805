"""The physics terms by name; a new effect is one class and one line here."""

from rsea_core.terms.base import Parameter, Port, Term, parameter, require_bounds
from rsea_core.terms.drive import DriveDeadZone, DriveDelay, DriveSaturation
from rsea_core.terms.environment import ContactNonlinear
from rsea_core.terms.gear import (
    GearFriction,
    GearLoadFriction,
    GearTransmissionError,
    MotorCogging,
)
from rsea_core.terms.load import (
    LoadDisturbance,
    LoadDrag,
    LoadFriction,
    LoadUnbalance,
    SpringParallel,
)
from rsea_core.terms.spring import SpringCurve, SpringHardening

TERMS: dict[str, type[Term]] = {
    term.effect: term
    for term in (
        SpringCurve,
        GearFriction,
        GearLoadFriction,
        LoadFriction,
        ContactNonlinear,
        DriveDeadZone,
        DriveDelay,
        DriveSaturation,
        GearTransmissionError,
        LoadDisturbance,
        LoadDrag,
        LoadUnbalance,
        MotorCogging,
        SpringHardening,
        SpringParallel,
    )
}

__all__ = [
    "TERMS",
    "ContactNonlinear",
    "DriveDeadZone",
    "DriveDelay",
    "DriveSaturation",
    "GearFriction",
    "GearLoadFriction",
    "GearTransmissionError",
    "LoadDisturbance",
    "LoadDrag",
    "LoadFriction",
    "LoadUnbalance",
    "MotorCogging",
    "Parameter",
    "Port",
    "SpringCurve",
    "SpringHardening",
    "SpringParallel",
    "Term",
    "parameter",
    "require_bounds",
]
