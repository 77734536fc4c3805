"""Run-out and form errors of wheel and worm, as lost angle at the spring."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

(
    WHEEL_ERROR,
    WHEEL_PHASE,
    WORM_ERROR,
    WORM_PHASE,
    WHEEL_ERROR_2,
    WHEEL_PHASE_2,
    WORM_ERROR_2,
    WORM_PHASE_2,
    WORM_ERROR_3,
    WORM_PHASE_3,
    ERROR_AT_ZERO,
    WHEEL_CYCLES,
) = slots(
    "wheel_error",
    "wheel_error_phase",
    "worm_error",
    "worm_error_phase",
    "wheel_error_2",
    "wheel_error_2_phase",
    "worm_error_2",
    "worm_error_2_phase",
    "worm_error_3",
    "worm_error_3_phase",
    "gear_error_at_zero",
    "wheel_error_cycles",
)


@njit(error_model="numpy", inline="always")
def angle_error(fx, wheel, gear_ratio):
    """Transmission error [rad] at the wheel, zero at angle zero, and its slope over the angle."""
    seconds = fx[WHEEL_ERROR_2] != 0.0 or fx[WORM_ERROR_2] != 0.0 or fx[WORM_ERROR_3] != 0.0
    if fx[WHEEL_ERROR] == 0.0 and fx[WORM_ERROR] == 0.0 and not seconds:
        return 0.0, 0.0
    cycles = max(fx[WHEEL_CYCLES], 1.0)
    slow = cycles * wheel + fx[WHEEL_PHASE]
    fast = gear_ratio * wheel + fx[WORM_PHASE]
    error = fx[WHEEL_ERROR] * np.sin(slow) + fx[WORM_ERROR] * np.sin(fast)
    slope = cycles * fx[WHEEL_ERROR] * np.cos(slow) + gear_ratio * fx[WORM_ERROR] * np.cos(fast)
    if seconds:
        slow = 2.0 * wheel + fx[WHEEL_PHASE_2]
        fast = 2.0 * gear_ratio * wheel + fx[WORM_PHASE_2]
        error += fx[WHEEL_ERROR_2] * np.sin(slow) + fx[WORM_ERROR_2] * np.sin(fast)
        slope += 2.0 * fx[WHEEL_ERROR_2] * np.cos(slow)
        slope += 2.0 * gear_ratio * fx[WORM_ERROR_2] * np.cos(fast)
    if fx[WORM_ERROR_3] != 0.0:
        fast = 3.0 * gear_ratio * wheel + fx[WORM_PHASE_3]
        error += fx[WORM_ERROR_3] * np.sin(fast)
        slope += 3.0 * gear_ratio * fx[WORM_ERROR_3] * np.cos(fast)
    return error - fx[ERROR_AT_ZERO], slope


def array_angle_error(fx, wheel, gear_ratio):
    """Transmission error [rad] for an array of wheel angles."""
    return angle_error.py_func(fx, wheel, gear_ratio)[0] + np.zeros_like(wheel)


TIMES = {2: "twice", 3: "three times"}


def _amplitude(part: str, wave: int, source: str):
    """Amplitude of the error so often per turn of wheel or worm."""
    return parameter(
        0.0,
        unit="rad (at the wheel)",
        bounds=(0.0, 0.05),
        source=source,
        meaning=f"Amplitude, at the wheel, of the error {TIMES[wave]} per turn of the {part}.",
    )


def _phase(part: str, wave: int):
    return parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning=f"Phase of the error {TIMES[wave]} per turn of the {part}.",
    )


WHEEL_ERROR_rad, WORM_ERROR_rad = 6e-3, 3e-3  # at the wheel, as priors: over a small angle a
# large one would be an offset or a stiffness
HARMONICS = (
    ("wheel", "", WHEEL_ERROR, WHEEL_PHASE),
    ("worm", "", WORM_ERROR, WORM_PHASE),
    ("wheel", "2_", WHEEL_ERROR_2, WHEEL_PHASE_2),
    ("worm", "2_", WORM_ERROR_2, WORM_PHASE_2),
    ("worm", "3_", WORM_ERROR_3, WORM_PHASE_3),
)
CYCLES, CYCLES_TRIED = "wheel_cycles_per_rev", (2, 3, 4)
OFFSET = "offset_rad"
HARMONIC = {"": "", "2_": "second_", "3_": "third_"}


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Position error once and twice per turn of wheel and worm, thrice per turn of the worm.

    It counts from where the angles read zero. There the spring is slack, but for an offset: the
    zeros of the encoders need not be where the gear's error is zero.
    """
    at_zero = 0.0
    for part, wave, amplitude, phase in HARMONICS:
        pair = f"{part}_sin_{wave}rad", f"{part}_cos_{wave}rad"
        if not v.keys().isdisjoint(pair):
            a, b = (v[name] for name in pair)
            d.put(amplitude, float(np.hypot(a, b)))
            d.put(phase, float(np.arctan2(b, a)))
            at_zero += b
    d.put(WHEEL_CYCLES, v.get(CYCLES, 1.0))
    d.put(ERROR_AT_ZERO, at_zero - v.get(OFFSET, 0.0))


def _parameters(v: Values, rig: Rig) -> Values:
    """Amplitude and phase for a pair of waves."""
    given = {name: v[name] for name in (CYCLES, OFFSET) if name in v}
    for part, wave, _, _ in HARMONICS:
        if f"{part}_sin_{wave}rad" in v:
            a, b = v[f"{part}_sin_{wave}rad"], v[f"{part}_cos_{wave}rad"]
            given[f"{part}_{HARMONIC[wave]}amplitude_rad"] = float(np.hypot(a, b))
            given[f"{part}_{HARMONIC[wave]}phase_rad"] = float(np.arctan2(b, a))
    return given


def _with(zero: Unknown, law: Law) -> Law:
    """A law with an offset of the encoders."""
    starts = tuple((*start, 0.0) for start in law.starts)
    return replace(law, unknowns=(*law.unknowns, zero), starts=starts)


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return array_angle_error(d.fx, x, d.machine_numbers.gear_ratio)


@dataclass(frozen=True, kw_only=True)
class GearTransmissionError(Term):
    """Position error periodic in the angles of wheel and worm, as lost angle at the spring.

    The spring sees theta_w + e(theta_w) - e(0) + offset, slack where the angles are zero but for
    the offset, and the wheel tau_s (1 + e'), so that no energy is made. The wheel's own inertia
    behind the error is neglected. Of a rigid train the load's angle is theta_w + e(theta_w) - e(0)
    + offset; the torques that move it by e are neglected too.
    """

    effect: ClassVar[str] = "gear-transmission-error"
    law: ClassVar[str] = "eccentricity"
    port: ClassVar[Port] = Port.GEAR
    headline: ClassVar[str] = "Transmission error: a position error that repeats with the angle."
    figure_units: ClassVar[Mapping[str, str]] = {
        "wheel_amplitude_rad": "rad",
        "worm_amplitude_rad": "rad",
    }
    curve: ClassVar = EffectCurve(
        title="Error of the gear's output", x_label="wheel angle (rad)", y_label="error (rad)",
        over="wheel_angle", evaluate=_drawn,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="worm", part="gear",
        size=lambda m: ((1.5e-3, 0.0), "1.5 mrad of transmission error"),
    )  # fmt: skip

    wheel_amplitude_rad: float = parameter(
        0.0,
        unit="rad (at the wheel)",
        bounds=(0.0, 0.05),
        source="eccentricity, once per turn",
        meaning="Amplitude of the position error periodic in the angle of the wheel.",
    )
    wheel_phase_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning="Phase of the wheel error at wheel angle zero.",
    )
    wheel_cycles_per_rev: float = parameter(
        1.0,
        unit="-",
        bounds=(1.0, 1e4),
        source="1: eccentricity; 2: ovality; 3: distortion by three screws",
        free=False,
        meaning="Periods of that error in a turn of the wheel.",
    )
    worm_amplitude_rad: float = parameter(
        0.0,
        unit="rad (at the wheel)",
        bounds=(0.0, 0.01),
        source="run-out, once per worm turn",
        meaning="Amplitude, at the wheel, of the error once per turn of the worm.",
    )
    worm_phase_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning="Phase of the worm error at motor angle zero.",
    )
    offset_rad: float = parameter(
        0.0,
        unit="rad (at the wheel)",
        bounds=(-0.05, 0.05),
        source="where the encoders' zeros were set; a fit",
        meaning="Position error where the angles read zero.",
    )
    wheel_second_amplitude_rad: float = _amplitude("wheel", 2, "ovality; a fit")
    wheel_second_phase_rad: float = _phase("wheel", 2)
    worm_second_amplitude_rad: float = _amplitude("worm", 2, "ovality; a fit")
    worm_second_phase_rad: float = _phase("worm", 2)
    worm_third_amplitude_rad: float = _amplitude("worm", 3, "thread form; a fit")
    worm_third_phase_rad: float = _phase("worm", 3)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Amplitudes of the largest harmonics of wheel and worm.

        The error of a strain wave gear repeats twice in a turn of its wave generator.
        """
        worm = (self.worm_amplitude_rad, self.worm_second_amplitude_rad,
                self.worm_third_amplitude_rad)  # fmt: skip
        wheel = (self.wheel_amplitude_rad, self.wheel_second_amplitude_rad)
        return {"wheel_amplitude_rad": max(wheel), "worm_amplitude_rad": max(worm)}

    @property
    def error_at_zero_rad(self) -> float:
        """What the waves make at angle zero."""
        harmonics = (
            (self.wheel_amplitude_rad, self.wheel_phase_rad),
            (self.worm_amplitude_rad, self.worm_phase_rad),
            (self.wheel_second_amplitude_rad, self.wheel_second_phase_rad),
            (self.worm_second_amplitude_rad, self.worm_second_phase_rad),
            (self.worm_third_amplitude_rad, self.worm_third_phase_rad),
        )
        return sum(a * math.sin(p) for a, p in harmonics)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitudes and phases."""
        return {
            "wheel_error": self.wheel_amplitude_rad,
            "wheel_error_phase": self.wheel_phase_rad,
            "worm_error": self.worm_amplitude_rad,
            "worm_error_phase": self.worm_phase_rad,
            "wheel_error_2": self.wheel_second_amplitude_rad,
            "wheel_error_2_phase": self.wheel_second_phase_rad,
            "worm_error_2": self.worm_second_amplitude_rad,
            "worm_error_2_phase": self.worm_second_phase_rad,
            "worm_error_3": self.worm_third_amplitude_rad,
            "worm_error_3_phase": self.worm_third_phase_rad,
            "gear_error_at_zero": self.error_at_zero_rad - self.offset_rad,
            "wheel_error_cycles": self.wheel_cycles_per_rev,
        }

    def equation(self) -> str:
        turns = "" if self.wheel_cycles_per_rev == 1.0 else f"{self.wheel_cycles_per_rev:g} "
        return (
            "tau_s = f(theta_w + e - theta_l), wheel feels tau_s (1 + de/dtheta_w),"
            f" e = {self.wheel_amplitude_rad:g} sin({turns}theta_w + {self.wheel_phase_rad:g})"
            f" + {self.worm_amplitude_rad:g} sin(theta_m + {self.worm_phase_rad:g})"
            + "".join(
                f" + {a:g} sin({angle} + {p:g})"
                for a, p, angle in (
                    (self.wheel_second_amplitude_rad, self.wheel_second_phase_rad, "2 theta_w"),
                    (self.worm_second_amplitude_rad, self.worm_second_phase_rad, "2 theta_m"),
                    (self.worm_third_amplitude_rad, self.worm_third_phase_rad, "3 theta_m"),
                )
                if a
            )
            + f" - {self.error_at_zero_rad - self.offset_rad:g}"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """One wave of wheel or worm, both, and their harmonics."""
        deflection = typical.deflection_rad
        rigid, times = False, 0.3  # largest error, in deflections
        if typical.relative:
            rigid = typical.rig is None or not typical.rig.has("spring")  # None: to read any file
            times = 4.0 if rigid else 1.5  # of a rigid train the error is all that the ends differ
        most = times * deflection
        bounds = {"scale": 0.02 * deflection, "low": -most, "high": most}

        def pair(part: str, wave: str, prior: float) -> tuple[Unknown, ...]:
            names = (f"{part}_{p}_{wave}rad" for p in ("sin", "cos"))
            return tuple(Unknown(name=name, unit="rad", prior=prior, **bounds) for name in names)

        wheel, worm = pair("wheel", "", WHEEL_ERROR_rad), pair("worm", "", WORM_ERROR_rad)
        both = (*wheel, *worm)
        second = (*pair("wheel", "2_", 0.5 * WHEEL_ERROR_rad),
                  *pair("worm", "2_", 0.5 * WORM_ERROR_rad))  # fmt: skip
        # of the worm: many turns in a recording; the wheel's is a bend
        third = pair("worm", "3_", 0.3 * WORM_ERROR_rad)
        small = 0.03 * deflection
        start = (small, 0.0, small, 0.0)
        common = {"effect": cls.effect, "subsystem": "gear", "write": _write, "kind": cls,
                  "parameters": _parameters}  # fmt: skip
        found = (
            Law(law="wheel", unknowns=wheel, starts=((small, 0.0),), **common,
                richer=("wheel and worm", "two harmonics")),
            Law(law="worm", unknowns=worm, starts=((small, 0.0),), **common,
                richer=("wheel and worm", "two harmonics")),
            Law(law="wheel and worm", unknowns=both, starts=(start,), **common,
                richer=("two harmonics", "three harmonics")),
            Law(law="two harmonics", unknowns=(*both, *second),
                starts=((*start, *(0.1 * small,) * 4),), richer=("three harmonics",), **common),
            Law(law="three harmonics", unknowns=(*both, *second, *third),
                starts=((*start, *(0.1 * small,) * 4, *(0.05 * small,) * 2),), **common),
        )  # fmt: skip
        twice = Law(law="worm, twice a turn", unknowns=pair("worm", "2_", WORM_ERROR_rad),
                    starts=((small, 0.0),), richer=("two harmonics",), **common)  # fmt: skip
        several = [
            law
            for n in CYCLES_TRIED
            for fixed in [Unknown(name=CYCLES, unit="-", low=n, high=n, scale=0.0)]
            for law in (
                Law(law=f"wheel, {n} a turn", unknowns=(*wheel, fixed), **common,
                    starts=((small, 0.0, float(n)),), richer=(f"wheel, {n} a turn, and worm",)),
                Law(law=f"wheel, {n} a turn, and worm", unknowns=(*wheel, fixed, *worm), **common,
                    starts=((small, 0.0, float(n), small, 0.0),), follows=True),
            )
        ]  # fmt: skip
        if not typical.relative:
            return found
        zero = Unknown(name=OFFSET, unit="rad", prior=WHEEL_ERROR_rad, **bounds)
        return tuple(
            _with(zero, law) if rigid or any(u in law.unknowns for u in wheel) else law
            for law in (*found, twice, *several)
        )

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The amplitudes."""
        turns = {"wheel_amplitude_rad": "wheel", "worm_amplitude_rad": "worm"}
        parts = [f"{f(name, 'rad')} with the turn of the {turn}" for name, turn in turns.items()
                 if f.figures.get(name)]  # fmt: skip
        if not parts:
            raise KeyError("amplitude")
        return "a transmission error of the gear, " + " and ".join(parts)
