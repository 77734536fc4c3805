"""The physics terms by name; a new effect is one class and one line here.

Importing it is enough: `from ... import NewEffect as NewEffect` (the alias says that the name is
meant to be had from here). Effects are tried in the order of `_FIRST`, then in that of the imports.
"""

# ruff: noqa: I001  the order of these imports is that of the effects' numbers and of their sums
from rsea_core.effects.base import Port as Port, Term
from rsea_core.effects.drive_dead_zone import (
    DriveDeadTime,
    DriveDeadZone,
    OffsetDeadZone,
    RoundedDeadZone,
    ThresholdDeadZone,
)
from rsea_core.effects.drive_saturation import DriveSaturation
from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.gear_load_friction import GearEfficiency, GearLoadFriction
from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.series_backlash import SeriesBacklash as SeriesBacklash
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.motor_torque_ripple import TorqueRipple
from rsea_core.effects.spring_hysteresis import SpringBoucWen, SpringHysteresis
from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.effects.spring_hardening import SpringHardening
from rsea_core.effects.spring_contact import SpringContact
from rsea_core.effects.spring_curve import SpringCurve
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.effects.spring_parallel import StiffeningParallel as StiffeningParallel
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.load_friction_angle import LoadFrictionAngle as LoadFrictionAngle
from rsea_core.effects.load_drag import LoadDrag
from rsea_core.effects.load_drag import PowerDrag as PowerDrag
from rsea_core.effects.load_flexibility import LoadFlexibility
from rsea_core.effects.load_inertia_variation import LoadInertiaVariation as LoadInertiaVariation
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.load_position_torque import LoadPositionTorque
from rsea_core.effects.contact_nonlinear import ContactNonlinear
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.sensor_drift import SensorDrift
from rsea_core.effects.sensor_noise import SensorNoise
from rsea_core.effects.sensor_table import SensorTable
from rsea_core.effects.drive_servo import GoalDeadBand as GoalDeadBand
from rsea_core.effects.drive_servo import ServoTorqueLimit as ServoTorqueLimit
from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain as DriveNonlinearGain
from rsea_core.effects.formula_torque import FormulaTorque as FormulaTorque
from rsea_core.effects.formula_torque import GearFormulaTorque as GearFormulaTorque

_IMPORTED = tuple(
    kind
    for kind in tuple(vars().values())
    if isinstance(kind, type) and issubclass(kind, Term) and kind is not Term
)
# a diagnosis tries these first, in this order
_FIRST: tuple[type[Term], ...] = (
    DriveDeadZone,
    DriveDeadTime,
    OffsetDeadZone,
    RoundedDeadZone,
    ThresholdDeadZone,
    DriveSaturation,
    DriveThermal,
    DriveDelay,
    DriveOffset,
    GearFriction,
    GearBacklash,
    SeriesBacklash,
    GearTransmissionError,
    GearLoadFriction,
    GearEfficiency,
    MotorCogging,
    TorqueRipple,
    SpringHysteresis,
    SpringBoucWen,
    SpringViscoelastic,
    SpringHardening,
    SpringContact,
    SpringCurve,
    LoadUnbalance,
    LoadFriction,
    LoadDrag,
    SpringParallel,
    LoadFlexibility,
    LoadDisturbance,
    LoadPositionTorque,
    ContactNonlinear,
    SensorOffset,
    SensorScale,
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorTable,
)

LAWS: dict[str, dict[str, type[Term]]] = {}
"""Every term by effect and law."""
for _term in dict.fromkeys(_FIRST + _IMPORTED):
    LAWS.setdefault(_term.effect, {})[_term.law] = _term

TERMS: dict[str, type[Term]] = {effect: next(iter(laws.values())) for effect, laws in LAWS.items()}
"""The first law of every effect."""
