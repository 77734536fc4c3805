"""The friction models of the thesis' chapter 3 as named sets of terms.

The thesis states them at the joint; the terms take the motor's side, so every function asks
for the gear ratio. Table 3.1 prints f_b in Nm, which cannot be: read per rad/s the arctangent
never leaves its straight part and f_v and f_a f_b cannot be told apart; read per deg/s, the
unit of the bench program, the terms are separate and friction reaches 2 Nm. The second is the
default (errata F4).
"""

import math

import rsea_core.machine.quantities as q
from rsea_core.effects.registry import GearFriction, LoadFriction, Term
from rsea_core.errors import TermError

# Table 3.1, at the joint
OFFSET_Nm, COULOMB_Nm, VISCOUS, ARCTAN_Nm, ARCTAN_RATE = (
    1.3710e-2,
    6.1431e-4,
    2.910e-2,  # Nm per unit of speed
    3.1413e-1,
    1.3905e-2,  # per unit of speed
)
SPEED_UNITS = {"deg/s": math.pi / 180.0, "rad/s": 1.0}  # rad/s in one unit


def ncfm(*, gear_ratio: float, viscous_Nms_per_rad: float) -> tuple[Term, ...]:
    """Viscous friction alone (eq. 3.2), at the joint.

    Raises
    ------
    TermError
        If the friction is out of the bounds of `GearFriction`.
    """
    return (_gear(gear_ratio, viscous=viscous_Nms_per_rad),)


def lfm(
    *, gear_ratio: float, viscous_Nms_per_rad: float, normal_lever_m: float
) -> tuple[Term, ...]:
    """Viscous friction, and Coulomb friction in proportion to the bearing load (3.3-3.6).

    The bearing load is the sum of vectors |N|, which the printed 3.6 is not: its friction would
    drive the joint beyond 90 degrees. C_i is a lever in metres.

    Raises
    ------
    TermError
        If a value is out of its bounds.
    """
    viscous = _gear(gear_ratio, viscous=viscous_Nms_per_rad)
    return viscous, LoadFriction(coulomb_Nm=0.0, normal_lever_m=normal_lever_m)


def nlfm(*, gear_ratio: float, speed_unit: str = "deg/s") -> tuple[Term, ...]:
    """f_o + f_c sgn(w) + f_v w + f_a atan(f_b w) with the values of Table 3.1 (eq. 3.7).

    Raises
    ------
    TermError
        If the unit of speed is neither "deg/s" nor "rad/s".
    """
    if speed_unit not in SPEED_UNITS:
        raise TermError(f"speed_unit = {speed_unit!r} must be one of {', '.join(SPEED_UNITS)}")
    unit = SPEED_UNITS[speed_unit]
    friction = _gear(
        gear_ratio,
        viscous=VISCOUS / unit,
        coulomb=COULOMB_Nm,
        offset=OFFSET_Nm,
        arctan=ARCTAN_Nm,
        arctan_velocity=unit / ARCTAN_RATE,
    )
    return (friction,)


def stribeck(
    *,
    gear_ratio: float,
    coulomb_Nm: float,
    static_Nm: float,
    velocity_rad_per_s: float,
    shape: float = 2.0,
    viscous_Nms_per_rad: float = 0.0,
) -> tuple[Term, ...]:
    """The generalised Stribeck model (eq. 3.1; V_s is a velocity), at the joint.

    Raises
    ------
    TermError
        If static friction is below Coulomb's, or a value out of its bounds.
    """
    if not static_Nm >= coulomb_Nm > 0.0:
        raise TermError(
            f"static_Nm = {static_Nm:g} must not be below coulomb_Nm = {coulomb_Nm:g}, above 0"
        )
    friction = _gear(
        gear_ratio,
        viscous=viscous_Nms_per_rad,
        coulomb=coulomb_Nm,
        stribeck_rise=static_Nm / coulomb_Nm - 1.0,
        stribeck_velocity_rad_per_s=q.motion_to_motor(velocity_rad_per_s, gear_ratio),
        stribeck_shape=shape,
    )
    return (friction,)


def _gear(
    ratio: float,
    *,
    viscous: float,
    coulomb: float = 0.0,
    offset: float = 0.0,
    arctan: float = 0.0,
    arctan_velocity: float = 1.0,
    **more: float,
) -> GearFriction:
    """Friction at the joint as a term on the motor's side."""
    return GearFriction(
        coulomb_Nm=q.torque_to_motor(coulomb, ratio),
        viscous_Nms_per_rad=q.impedance_to_motor(viscous, ratio),
        offset_Nm=q.torque_to_motor(offset, ratio),
        arctan_Nm=q.torque_to_motor(arctan, ratio),
        arctan_velocity_rad_per_s=q.motion_to_motor(arctan_velocity, ratio),
        **more,
    )
