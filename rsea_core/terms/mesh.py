"""Torques of the motor's angle, and play: cogging, ripple, backlash."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import (
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    Term,
    parameter,
    require_bounds,
)


def _further(what: str, wave: int):
    """Amplitude, cycles or phase of a second or third wave of cogging."""
    which = {2: "second", 3: "third"}[wave]
    if what == "amplitude":
        return parameter(
            0.0,
            unit="Nm (motor side)",
            bounds=(0.0, 1.0),
            source="10-40 % of the first; a fit",
            meaning=f"Amplitude of the {which} wave of that torque.",
        )
    if what == "cycles":
        return parameter(
            float(wave),
            unit="-",
            bounds=(1.0, 400.0),
            source="a multiple of slots and poles",
            free=False,
            meaning=f"Periods of the {which} wave in a turn of the motor.",
        )
    return parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning=f"Phase of the {which} wave at motor angle zero.",
    )


@dataclass(frozen=True, kw_only=True)
class MotorCogging(Term):
    """Torque periodic in the motor's angle, up to three waves; it stores and returns its energy.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "motor-cogging"
    law: ClassVar[str] = "harmonic"
    port: ClassVar[Port] = Port.GEAR

    amplitude_Nm: float = parameter(
        unit="Nm (motor side)",
        bounds=(0.0, 1.0),
        source="1-5 % of rated torque; a fit",
        meaning="Amplitude of the torque that is periodic in the motor angle.",
    )
    cycles_per_rev: float = parameter(
        unit="-",
        bounds=(1.0, 400.0),
        source="slots and poles, least common multiple",
        free=False,
        meaning="Periods of that torque in a turn of the motor.",
    )
    phase_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning="Phase of that torque at motor angle zero.",
    )
    amplitude_2_Nm: float = _further("amplitude", 2)
    cycles_2_per_rev: float = _further("cycles", 2)
    phase_2_rad: float = _further("phase", 2)
    amplitude_3_Nm: float = _further("amplitude", 3)
    cycles_3_per_rev: float = _further("cycles", 3)
    phase_3_rad: float = _further("phase", 3)

    def __post_init__(self):
        require_bounds(self)

    def waves(self) -> tuple[tuple[float, float, float], ...]:
        """Amplitude [Nm, motor side], cycles in a turn and phase [rad] of each wave."""
        return (
            (self.amplitude_Nm, self.cycles_per_rev, self.phase_rad),
            (self.amplitude_2_Nm, self.cycles_2_per_rev, self.phase_2_rad),
            (self.amplitude_3_Nm, self.cycles_3_per_rev, self.phase_3_rad),
        )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Amplitude on the motor side and cycles in a turn of the motor, of the largest wave."""
        amplitude, cycles, _phase = max(self.waves())
        return {"amplitude_Nm": amplitude, "cycles_per_rev": cycles}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitudes at the output, cycles per radian of the output."""
        found = {}
        for tag, (amplitude, cycles, phase) in zip(("", "_2", "_3"), self.waves(), strict=True):
            found[f"cogging_torque{tag}"] = gear.torque_to_output(amplitude)
            found[f"cogging_cycles{tag}_at_output"] = cycles / gear.motion_to_output(1.0)
            found[f"cogging_phase{tag}"] = phase
        return found

    def equation(self) -> str:
        """The law in one line."""
        waves = [
            f"{a:g} sin({c:g} theta_m + {p:g})" for j, (a, c, p) in enumerate(self.waves())
            if j == 0 or a
        ]  # fmt: skip
        together = waves[0] if len(waves) == 1 else f"({' + '.join(waves)})"
        return f"-N {together} on the wheel"


@dataclass(frozen=True, kw_only=True)
class TorqueRipple(Term):
    """Torque constant that is periodic in the motor's angle, one harmonic.

    The factor 1 + r sin(n theta_m + phase) stands before the torque constant and before the
    back-EMF constant alike, as the shape of a winding's back-EMF gives it: it makes no energy.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "motor-cogging"
    law: ClassVar[str] = "ripple"
    port: ClassVar[Port] = Port.GEAR

    ripple_fraction: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="2-10 % of trapezoidal commutation; a fit",
        meaning="Amplitude of the torque constant's variation over its mean.",
    )
    cycles_per_rev: float = parameter(
        unit="-",
        bounds=(1.0, 400.0),
        source="six times the pole pairs",
        meaning="Periods of the variation in a turn of the motor.",
        free=False,
    )
    phase_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning="Phase of the variation at motor angle zero.",
    )

    def __post_init__(self):
        require_bounds(self)

    @property
    def key(self) -> str:
        """It may stand beside a cogging torque."""
        return f"{self.effect}:{self.law}"

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Fraction and cycles in a turn of the motor."""
        return {"ripple_fraction": self.ripple_fraction, "cycles_per_rev": self.cycles_per_rev}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Fraction, cycles per radian of the output."""
        return {
            "ripple_fraction": self.ripple_fraction,
            "ripple_cycles_at_output": self.cycles_per_rev / gear.motion_to_output(1.0),
            "ripple_phase": self.phase_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """A torque that is known needs no torque constant."""
        electric = command_name in ("duty", "voltage_V", "current_command_A")
        return None if electric else "needs a drive by duty, voltage or current"

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"k_t and k_e times 1 + {self.ripple_fraction:g}"
            f" sin({self.cycles_per_rev:g} theta_m + {self.phase_rad:g})"
        )


@dataclass(frozen=True, kw_only=True)
class GearBacklash(Term):
    """Play between worm and wheel: motor side and wheel are two bodies.

    The wheel with the spring's hub (J_o, B_o of the rig) is in mesh with one flank or free in
    the gap. A flank only pushes; where it would have to pull, it lets go. Closing the gap is
    an impact: both keep their momentum, less what a worm's friction takes of it, and part with the
    share `rebound` of the speed at which they met. The motor's friction stays on the motor side.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Nordin & Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38
    (2002) 1633; rigid contact: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts.
    """

    effect: ClassVar[str] = "gear-backlash"
    law: ClassVar[str] = "rigid-flanks"
    port: ClassVar[Port] = Port.GEAR

    width_rad: float = parameter(
        unit="rad (at the wheel)",
        bounds=(0.0, 0.2),
        source="0.1-0.5 mm over the wheel's radius; a fit",
        meaning="How far the wheel can be turned while the motor is held.",
    )
    wheel_inertia_kgm2: float = parameter(
        0.0,
        unit="kgm2",
        bounds=(0.0, 1e3),
        source="0: J_o of the rig, with B_o; a diagnosis: what its fit took",
        free=False,
        meaning="Share of the machine's inertia that moves with the wheel, behind the play.",
    )
    wheel_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 1e3),
        source="with wheel_inertia_kgm2 only: a diagnosis, what its fit took",
        free=False,
        meaning="Share of the viscous friction that acts on the wheel behind the play.",
    )
    rebound: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 0.95),
        source="0: none; some 0.3 of steel and bronze in grease; a fit",
        meaning="Speed at which the flanks part after an impact over that at which they met.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The whole gap at the wheel."""
        return {"width_rad": self.width_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The whole gap and the impact."""
        if self.width_rad == 0.0:
            return {}
        found = {"backlash_width": self.width_rad, "memory": 1.0}
        return found | ({"backlash_rebound": self.rebound} if self.rebound > 0.0 else {})

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """What is behind the play."""
        if self.width_rad == 0.0:
            return {}
        if self.wheel_inertia_kgm2 > 0.0:
            return self._given_wheel(rig)
        rig.need("the wheel behind the play", "motor_inertia_kgm2", "output_inertia_kgm2")
        for key in ("motor_inertia_kgm2", "output_inertia_kgm2"):
            if not getattr(rig, key) > 0.0:
                raise TermError(
                    f"{self.effect} on rig {rig.name!r}: {key} = {getattr(rig, key):g} must be"
                    " above 0, play lies between two bodies"
                )
        return {
            "backlash_wheel_inertia": rig.output_inertia_kgm2,
            "backlash_wheel_damping": rig.output_viscous_Nms_per_rad or 0.0,
        }

    def _given_wheel(self, rig) -> Mapping[str, float]:
        motor = (rig.gear_ratio or 1.0) ** 2 * (rig.motor_inertia_kgm2 or 0.0)
        whole = motor + (rig.output_inertia_kgm2 or 0.0)
        if not self.wheel_inertia_kgm2 < whole:
            raise TermError(
                f"{self.effect} on rig {rig.name!r}: wheel_inertia_kgm2 ="
                f" {self.wheel_inertia_kgm2:g} must be below the {whole:g} of motor and wheel"
            )
        return {
            "backlash_wheel_inertia": self.wheel_inertia_kgm2,
            "backlash_wheel_damping": self.wheel_damping_Nms_per_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """The wheel behind the play sits with the spring."""
        return "needs a spring, with which the wheel behind the play moves" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"|theta_m/N - theta_w| <= {0.5 * self.width_rad:g}: J_o w_w' = c - B_o w_w - tau_s,"
            " flank torque c on the motor side too, c pushes only, impact"
            + (f" with rebound {self.rebound:g}" if self.rebound > 0.0 else " without rebound")
        )
