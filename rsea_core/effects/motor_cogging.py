"""Cogging: a torque ripple that repeats with the motor angle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import gcd, lcm
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook, summed
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import LEAST_CYCLES, TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

(
    COGGING,
    COGGING_CYCLES,
    COGGING_PHASE,
    COGGING_2,
    COGGING_2_CYCLES,
    COGGING_2_PHASE,
    COGGING_3,
    COGGING_3_CYCLES,
    COGGING_3_PHASE,
) = slots(
    "cogging_torque",
    "cogging_cycles_at_output",
    "cogging_phase",
    "cogging_torque_2",
    "cogging_cycles_2_at_output",
    "cogging_phase_2",
    "cogging_torque_3",
    "cogging_cycles_3_at_output",
    "cogging_phase_3",
)
COGGING_HARMONICS = (COGGING, COGGING_2, COGGING_3)  # each followed by its cycles and phase


@hook("output_torque")
def cogging_torque(fx, wheel, speed, torque):
    """Up to three waves over the motor's angle."""
    if fx[COGGING] != 0.0:
        torque -= fx[COGGING] * np.sin(fx[COGGING_CYCLES] * wheel + fx[COGGING_PHASE])
    if fx[COGGING_2] != 0.0:
        torque -= fx[COGGING_2] * np.sin(fx[COGGING_2_CYCLES] * wheel + fx[COGGING_2_PHASE])
    if fx[COGGING_3] != 0.0:
        torque -= fx[COGGING_3] * np.sin(fx[COGGING_3_CYCLES] * wheel + fx[COGGING_3_PHASE])
    return torque


def _further(what: str, wave: int):
    """Amplitude, cycles or phase of a second or third wave of cogging."""
    which = {2: "second", 3: "third"}[wave]
    if what == "amplitude":
        return parameter(
            0.0,
            unit="Nm (motor side)",
            bounds=(0.0, 1e9),
            source="10-40 % of the first; a fit",
            meaning=f"Amplitude of the {which} wave of that torque.",
        )
    if what == "cycles":
        return parameter(
            float(wave),
            unit="-",
            bounds=(0.1, 1e6),
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


def _of_slots_and_poles() -> set[int]:
    """Cycles of cogging of three-phase motors with concentrated windings, by slots and poles.

    Their least common multiple, where the winding can be symmetric (slots over three times their
    common divisor with the pole pairs is whole) and a coil spans about a pole.

    Source
    ------
    Zhu & Howe, Influence of design parameters on cogging torque in permanent magnet machines, IEEE
    Trans. Energy Convers. 15 (2000) 407.
    """
    return {
        lcm(slots, poles)
        for slots in range(9, 49, 3)
        for poles in range(6, 57, 2)
        if 2 * poles <= 3 * slots <= 4.5 * poles and slots % (3 * gcd(slots, poles // 2)) == 0
    }


CYCLES_TRIED = tuple(range(1, 49))
DETENTS = {50, 100, 200, 400}  # of stepping motors with 50 and 100 teeth
MANY_CYCLES = tuple(
    c for c in sorted(_of_slots_and_poles() | DETENTS) if max(CYCLES_TRIED) < c <= max(DETENTS)
)
PERIODS_TRIED = 60  # in the travel of a linear motor


def cogging(typical: TypicalMagnitudes, cycles: tuple[int, ...]) -> Law:
    """A torque over the motor's angle of one wave or a few, by their cycles in a turn."""
    ripple = 0.05 * typical.motor_torque_Nm
    unknowns, start = [], []
    for wave, c in zip(("", "2_", "3_"), cycles, strict=False):
        unknowns += [
            Unknown(name=f"{p}_{wave}Nm", unit="Nm", low=-20 * ripple, high=20 * ripple,
                    scale=0.2 * ripple) for p in ("sin", "cos")
        ]  # fmt: skip
        unknowns.append(Unknown(name=f"cycles_{wave}per_rev", unit="-", low=c, high=c, scale=0.0))
        start += [0.1 * ripple, 0.0, float(c)]
    return Law(
        effect="motor-cogging", law=f"{'+'.join(map(str, cycles))} per turn", subsystem="gear",
        write=_write, unknowns=tuple(unknowns), starts=(tuple(start),), kind=MotorCogging,
        parameters=_parameters,
    )  # fmt: skip


def with_harmonic(law: Law) -> list[Law]:
    """A law of one wave, and what may take its place: the same with a wave of half its length."""
    richer = f"{law.law}, two waves"
    second = [replace(u, name=f"{u.name[:3]}_2_Nm") for u in law.unknowns[:2]]
    starts = tuple((*start, 0.2 * start[0], 0.0) for start in law.starts)
    two = replace(law, law=richer, unknowns=(*law.unknowns, *second), starts=starts, follows=True)
    return [replace(law, richer=(richer,)), two]


def linear_motor_cogging(typical: TypicalMagnitudes) -> list[Law]:
    """Waves over the position of a linear motor, whose pitch no rig file states: it is fitted.

    Starts are half a wave apart in the travel: a wave that is off by a quarter is still in phase
    with the true one over most of it. Iron-core motors have harmonics: the second law has two.
    """
    one_wave = typical.cycle_of_travel  # cycles in 2 pi m
    ripple = 0.05 * typical.motor_torque_Nm
    size = {"low": -20 * ripple, "high": 20 * ripple, "scale": 0.2 * ripple}
    first = [Unknown(name=f"{p}_Nm", unit="Nm", **size) for p in ("sin", "cos")]
    pitch = Unknown(
        name="cycles_per_rev", unit="-", low=0.5 * one_wave, high=2 * PERIODS_TRIED * one_wave,
        scale=0.02 * one_wave,
    )  # fmt: skip
    wave_numbers = np.arange(LEAST_CYCLES, PERIODS_TRIED, 0.5) * one_wave
    return with_harmonic(
        Law(effect="motor-cogging", law="free pitch", subsystem="gear", unknowns=(*first, pitch),
            starts=tuple((0.1 * ripple, 0.0, float(c)) for c in wave_numbers),
            write=_write, kind=MotorCogging, parameters=_parameters,
            follows=True)  # screened along the motion
    )  # fmt: skip


def _cycles(v: Values, wave: str) -> float:
    """Cycles of a wave: of a second one without its own, twice those of the first."""
    own = v.get(f"cycles_{wave}per_rev")
    return 2.0 * v["cycles_per_rev"] if own is None else own


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Up to three waves of torque over the motor's angle."""
    for at, wave in zip(COGGING_HARMONICS, ("", "2_", "3_"), strict=True):
        if f"sin_{wave}Nm" in v:
            a, b = v[f"sin_{wave}Nm"], v[f"cos_{wave}Nm"]
            d.put(at, w.ratio * float(np.hypot(a, b)))
            d.put(at + 1, _cycles(v, wave) * w.ratio)
            d.put(at + 2, float(np.arctan2(b, a)))


def _parameters(v: Values, rig: Rig) -> Values:
    """Amplitude and phase for a pair of waves."""
    given = {}
    for wave in ("", "2_", "3_"):
        if f"sin_{wave}Nm" in v:
            a, b = v[f"sin_{wave}Nm"], v[f"cos_{wave}Nm"]
            given |= {
                f"amplitude_{wave}Nm": float(np.hypot(a, b)),
                f"cycles_{wave}per_rev": _cycles(v, wave),
                f"phase_{wave}rad": float(np.arctan2(b, a)),
            }
    return given


@dataclass(frozen=True, kw_only=True)
class MotorCogging(Term):
    """Torque periodic in the motor's angle, up to three waves; it stores and returns its energy."""

    effect: ClassVar[str] = "motor-cogging"
    law: ClassVar[str] = "harmonic"
    port: ClassVar[Port] = Port.GEAR
    headline: ClassVar[str] = "Cogging: a torque ripple that repeats with the motor angle."
    figure_units: ClassVar[Mapping[str, str]] = {"amplitude_Nm": "Nm", "cycles_per_rev": "-"}
    curve: ClassVar = EffectCurve(
        title="Torque over the motor's angle", x_label="wheel angle (rad)",
        y_label="torque at the wheel (Nm)", over="wheel_angle",
        evaluate=lambda d, v, x: summed("output_torque", d.fx, x, 0.0 * x),
    )  # fmt: skip

    amplitude_Nm: float = parameter(
        unit="Nm (motor side)",
        bounds=(0.0, 1e9),
        source="1-5 % of rated torque; a fit",
        meaning="Amplitude of the torque that is periodic in the motor angle.",
    )
    cycles_per_rev: float = parameter(
        unit="-",
        bounds=(0.1, 1e6),
        source="slots and poles, least common multiple; of a linear motor 2 pi over its pitch",
        free=False,
        meaning="Periods of that torque in a turn of the motor; of a linear motor in 2 pi m.",
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

    def harmonics(self) -> tuple[tuple[float, float, float], ...]:
        """Amplitude [Nm, motor side], cycles in a turn and phase [rad] of each wave."""
        return (
            (self.amplitude_Nm, self.cycles_per_rev, self.phase_rad),
            (self.amplitude_2_Nm, self.cycles_2_per_rev, self.phase_2_rad),
            (self.amplitude_3_Nm, self.cycles_3_per_rev, self.phase_3_rad),
        )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Amplitude on the motor side and cycles in a turn of the motor, of the largest wave."""
        amplitude, cycles, _phase = max(self.harmonics())
        return {"amplitude_Nm": amplitude, "cycles_per_rev": cycles}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitudes at the output, cycles per radian of the output."""
        found = {}
        for tag, (amplitude, cycles, phase) in zip(("", "_2", "_3"), self.harmonics(), strict=True):
            found[f"cogging_torque{tag}"] = gear.torque_to_output(amplitude)
            found[f"cogging_cycles{tag}_at_output"] = cycles / gear.motion_to_output(1.0)
            found[f"cogging_phase{tag}"] = phase
        return found

    def equation(self) -> str:
        harmonics = [
            f"{a:g} sin({c:g} theta_m + {p:g})" for j, (a, c, p) in enumerate(self.harmonics())
            if j == 0 or a
        ]  # fmt: skip
        together = harmonics[0] if len(harmonics) == 1 else f"({' + '.join(harmonics)})"
        return f"-N {together} on the wheel"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """One wave of each number of cycles in a turn; of a linear motor one of a free pitch."""
        rig = typical.rig
        direct = rig is not None and rig.axis == "linear" and (rig.gear_ratio or 1.0) == 1.0
        if direct and typical.relative:
            return linear_motor_cogging(typical)
        found = [cogging(typical, (c,)) for c in CYCLES_TRIED if typical.motor_passes(c)]
        if typical.relative:
            many = [cogging(typical, (c,)) for c in MANY_CYCLES if typical.rows_show(c)]
            found += [replace(law, follows=True) for law in many]  # screened along the motion
        return [w for law in found for w in with_harmonic(law)] if typical.relative else found

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """Amplitude and cycles of the largest wave; of a linear motor its pitch."""
        if f.linear:
            pitch_mm = 2e3 * np.pi / f.figures["cycles_per_rev"]
            return f"cogging of {f('amplitude_Nm', 'Nm')}, every {pitch_mm:.4g} mm"
        return (
            f"cogging of {f('amplitude_Nm', 'Nm')} at the motor,"
            f" {f.figures['cycles_per_rev']:.0f} times a turn"
        )
