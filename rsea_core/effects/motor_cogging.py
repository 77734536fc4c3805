"""Cogging: a torque ripple that repeats with the motor angle."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds


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
