"""Dry friction of motor and gear; the laws are the kernel's, here are their parameters.

Coulomb and Stribeck friction act on the motor side, where the bearings turn fast; the worm's
friction acts at the mesh and grows with the torque that passes through it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import Gear, Port, Term, parameter, require_bounds

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"
SHIGLEY = "Shigley, Mechanical Engineering Design, worm gears; actuator specification 1.3"


@dataclass(frozen=True, kw_only=True)
class GearFriction(Term):
    """Coulomb and Stribeck friction of motor bearing and gear, different in both directions.

    While the motor turns at speed w, F = F_c (1 + rise exp(-(w/w_s)^2)) against the motion, with
    F_c = coulomb (1 + asymmetry) for positive and coulomb (1 - asymmetry) for negative motion.
    At rest it holds, exactly, up to F_c (1 + rise).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "gear-friction"
    port: ClassVar[Port] = Port.GEAR

    coulomb_Nm: float = parameter(
        unit="Nm (motor side)", bounds=(0.0, 1.0), source="mean of both directions; a fit"
    )
    asymmetry: float = parameter(
        0.0, unit="-", bounds=(-0.9, 0.9), source="0: the same in both directions"
    )
    stribeck_rise: float = parameter(
        0.0, unit="-", bounds=(0.0, 3.0), source=f"0: no Stribeck peak; {ARMSTRONG}"
    )
    stribeck_velocity_rad_per_s: float = parameter(
        5.0, unit="rad/s (motor side)", bounds=(0.05, 100.0), source=ARMSTRONG
    )

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law at the gear output."""
        coulomb = gear.torque_to_output(self.coulomb_Nm)
        if coulomb == 0.0:
            return {}
        return {
            "wheel_dry": 1.0,
            "gear_coulomb_forward": coulomb * (1.0 + self.asymmetry),
            "gear_coulomb_backward": coulomb * (1.0 - self.asymmetry),
            "gear_stribeck_rise": self.stribeck_rise,
            "gear_stribeck_velocity": gear.motion_to_output(self.stribeck_velocity_rad_per_s),
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the load is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"N F_c (1 + {self.stribeck_rise:g} exp(-(w_m/{self.stribeck_velocity_rad_per_s:g})^2))"
            f" against w_w, F_c = {self.coulomb_Nm * (1 + self.asymmetry):.4g} Nm forward,"
            f" {self.coulomb_Nm * (1 - self.asymmetry):.4g} Nm backward; holds exactly at rest"
        )


@dataclass(frozen=True, kw_only=True)
class GearLoadFriction(Term):
    """Friction of a worm that grows with the torque it carries, and locks.

    With lead angle l and friction angle phi = atan(mu), the output side feels mu_w |tau_s|
    against its motion: mu_w = tan(l + phi)/tan(l) - 1 where the motor drives the load and
    1 - tan(l - phi)/tan(l) where the load drives the motor. With phi >= l the load cannot move
    the motor: the worm holds any torque.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or the worm could not be driven at all.
    """

    effect: ClassVar[str] = "gear-load-friction"
    port: ClassVar[Port] = Port.GEAR

    lead_angle_rad: float = parameter(unit="rad", bounds=(0.01, 0.8), source=SHIGLEY)
    friction_coefficient: float = parameter(
        unit="-", bounds=(0.0, 0.5), source="0.06-0.08 steel on bronze, lubricated; " + SHIGLEY
    )

    def __post_init__(self):
        require_bounds(self)
        if self.lead_angle_rad + math.atan(self.friction_coefficient) >= 0.5 * math.pi:
            raise TermError(
                f"{self.effect}: lead_angle_rad = {self.lead_angle_rad} and friction_coefficient"
                f" = {self.friction_coefficient} leave no torque: lead and friction angle must"
                " stay below pi/2 together"
            )

    @property
    def drive_efficiency(self) -> float:
        """tan(l)/tan(l + phi), where the motor drives the load."""
        phi = math.atan(self.friction_coefficient)
        return math.tan(self.lead_angle_rad) / math.tan(self.lead_angle_rad + phi)

    @property
    def backdrive_efficiency(self) -> float:
        """tan(l - phi)/tan(l), where the load drives the motor; at or below zero it locks."""
        phi = math.atan(self.friction_coefficient)
        return math.tan(self.lead_angle_rad - phi) / math.tan(self.lead_angle_rad)

    @property
    def is_self_locking(self) -> bool:
        """Whether the load cannot move the motor."""
        return self.backdrive_efficiency <= 0.0

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Loss per torque in both directions of power flow."""
        if self.friction_coefficient == 0.0:
            return {}
        return {
            "wheel_dry": 1.0,
            "gear_drive_loss": 1.0 / self.drive_efficiency - 1.0,
            "gear_backdrive_loss": 1.0 - self.backdrive_efficiency,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Its torque is the spring's."""
        return "needs a spring: its friction follows the spring torque" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        locks = "self-locking" if self.is_self_locking else "not self-locking"
        return (
            f"mu_w |tau_s| against w_w, mu_w = {1.0 / self.drive_efficiency - 1.0:.4g} driving"
            f" (efficiency {self.drive_efficiency:.4g}), {1.0 - self.backdrive_efficiency:.4g}"
            f" back-driven (efficiency {self.backdrive_efficiency:.4g}, {locks})"
        )


@dataclass(frozen=True, kw_only=True)
class MotorCogging(Term):
    """Torque periodic in the motor's angle, one harmonic; it stores and returns its energy.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "motor-cogging"
    port: ClassVar[Port] = Port.GEAR

    amplitude_Nm: float = parameter(
        unit="Nm (motor side)", bounds=(0.0, 1.0), source="1-5 % of rated torque; a fit"
    )
    cycles_per_rev: float = parameter(
        unit="-", bounds=(1.0, 400.0), source="slots and poles, least common multiple", free=False
    )
    phase_rad: float = parameter(0.0, unit="rad", bounds=(-7.0, 7.0), source="a fit")

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitude at the output, cycles per turn of the output."""
        return {
            "cogging_torque": gear.torque_to_output(self.amplitude_Nm),
            "cogging_cycles_at_output": self.cycles_per_rev / gear.motion_to_output(1.0),
            "cogging_phase": self.phase_rad,
        }

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"-N {self.amplitude_Nm:g} sin({self.cycles_per_rev:g} theta_m + {self.phase_rad:g})"
            " on the wheel"
        )


@dataclass(frozen=True, kw_only=True)
class GearTransmissionError(Term):
    """Position error periodic in the angles of wheel and worm, as lost angle at the spring.

    The spring sees theta_w + e(theta_w), and the wheel tau_s (1 + e'), so that no energy is
    made. The wheel's own inertia behind the error is neglected.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "gear-transmission-error"
    port: ClassVar[Port] = Port.GEAR

    wheel_amplitude_rad: float = parameter(
        0.0, unit="rad (at the wheel)", bounds=(0.0, 0.05), source="eccentricity, once per turn"
    )
    wheel_phase_rad: float = parameter(0.0, unit="rad", bounds=(-7.0, 7.0), source="a fit")
    worm_amplitude_rad: float = parameter(
        0.0,
        unit="rad (at the wheel)",
        bounds=(0.0, 0.01),
        source="run-out, once per worm turn",
    )
    worm_phase_rad: float = parameter(0.0, unit="rad", bounds=(-7.0, 7.0), source="a fit")

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitudes and phases."""
        return {
            "wheel_error": self.wheel_amplitude_rad,
            "wheel_error_phase": self.wheel_phase_rad,
            "worm_error": self.worm_amplitude_rad,
            "worm_error_phase": self.worm_phase_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It deflects the spring."""
        return "needs a spring, whose deflection it changes" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            "tau_s = f(theta_w + e - theta_l), wheel feels tau_s (1 + de/dtheta_w),"
            f" e = {self.wheel_amplitude_rad:g} sin(theta_w + {self.wheel_phase_rad:g})"
            f" + {self.worm_amplitude_rad:g} sin(theta_m + {self.worm_phase_rad:g})"
        )
