"""Conversions between sides of the gear and between a machine's units and SI.

The only place where a quantity is reflected through the gear. With ratio N = motor speed
over output speed: angle, speed and acceleration go to the output by 1/N, torque by N (power
is kept), and whatever multiplies a motion to give a torque (inertia, damping, stiffness) by
N^2. What links an electrical to a mechanical quantity goes by N once: a torque constant
[Nm/A] because torque does, a back-EMF constant [Vs/rad] because speed does.

Every function takes floats or arrays and returns the same shape.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError

Quantity = float | NDArray

PWM_ZERO_PERCENT = 50.0  # the bench program's "PWM out": 0 full reverse, 50 stop, 100 full ahead


def motion_to_output(motor_side: Quantity, gear_ratio: float) -> Quantity:
    """Angle, speed or acceleration of the motor shaft as seen at the gear output."""
    return motor_side / gear_ratio


def motion_to_motor(output_side: Quantity, gear_ratio: float) -> Quantity:
    """Angle, speed or acceleration of the gear output as seen at the motor shaft."""
    return output_side * gear_ratio


def torque_to_output(motor_side: Quantity, gear_ratio: float) -> Quantity:
    """Torque [Nm] at the motor shaft as it acts at the output of a lossless gear."""
    return motor_side * gear_ratio


def torque_to_motor(output_side: Quantity, gear_ratio: float) -> Quantity:
    """Torque [Nm] at the output of a lossless gear as it acts at the motor shaft."""
    return output_side / gear_ratio


def impedance_to_output(motor_side: Quantity, gear_ratio: float) -> Quantity:
    """Inertia [kg m^2], damping [Nms/rad] or stiffness [Nm/rad] as seen at the output."""
    return motor_side * gear_ratio**2


def impedance_to_motor(output_side: Quantity, gear_ratio: float) -> Quantity:
    """Inertia, damping or stiffness at the output as seen at the motor shaft."""
    return output_side / gear_ratio**2


def transducer_to_output(motor_side: Quantity, gear_ratio: float) -> Quantity:
    """Torque constant [Nm/A] or back-EMF constant [Vs/rad] as seen at the output."""
    return motor_side * gear_ratio


@dataclass(frozen=True)
class GearReflection:
    """The reflections of one gear, for those who do not know its ratio."""

    ratio: float

    def torque_to_output(self, motor_side: Quantity) -> Quantity:
        """Torque [Nm] at the motor shaft as it acts at the output of a lossless gear."""
        return torque_to_output(motor_side, self.ratio)

    def motion_to_output(self, motor_side: Quantity) -> Quantity:
        """Angle or speed of the motor shaft as seen at the gear output."""
        return motion_to_output(motor_side, self.ratio)


def count_angle_rad(counts_per_rev: float) -> float:
    """Angle of one encoder count [rad].

    Raises
    ------
    InputError
        If counts_per_rev is not positive.
    """
    if not counts_per_rev > 0:
        raise InputError(f"counts_per_rev = {counts_per_rev} must be positive")
    return 2.0 * np.pi / counts_per_rev


def quantise_angle(angle_rad: ArrayLike, counts_per_rev: float) -> NDArray:
    """Reading [rad] of an incremental encoder: the last whole count passed, towards -inf."""
    count = count_angle_rad(counts_per_rev)
    return np.floor(np.asarray(angle_rad, dtype=float) / count) * count


def degrees_to_radians(angle_deg: ArrayLike) -> NDArray:
    """Angle in radians."""
    return np.deg2rad(np.asarray(angle_deg, dtype=float))


def radians_to_degrees(angle_rad: ArrayLike) -> NDArray:
    """Angle in degrees."""
    return np.rad2deg(np.asarray(angle_rad, dtype=float))


def pwm_to_duty(pwm_percent: ArrayLike) -> NDArray:
    """Bridge duty -1..1 of the bench program's PWM value.

    Raises
    ------
    InputError
        If a value lies outside 0..100.

    Source
    ------
    Appendix A of the thesis: 48 V over 50 percent, 50 percent is standstill.
    """
    pwm = np.asarray(pwm_percent, dtype=float)
    if np.any((pwm < 0.0) | (pwm > 2.0 * PWM_ZERO_PERCENT)):
        raise InputError("PWM out must lie in 0..100 percent (50 is standstill)")
    return (pwm - PWM_ZERO_PERCENT) / PWM_ZERO_PERCENT


def duty_to_pwm(duty: ArrayLike) -> NDArray:
    """The bench program's PWM value 0..100 of a bridge duty -1..1.

    Raises
    ------
    InputError
        If a value lies outside -1..1.
    """
    value = np.asarray(duty, dtype=float)
    if np.any(np.abs(value) > 1.0):
        raise InputError("duty must lie in -1..1")
    return PWM_ZERO_PERCENT * (1.0 + value)
