"""Hybrid impedance control of the joint: HIC, and with powers of the errors FHIC.

    u = spow(S x_r'', alpha) + (1/J_d) [ K_v B_d spow(v, beta) + K_p K_d spow(x, gamma)
                                         + (1 - S)^delta f_r - f_e ]
    thesis weighting:    v = S x_r' - x',      x = S x_r - x
    subspace weighting:  v = S (x_r' - x'),    x = S (x_r - x)

S = 1 follows the angle x_r, S = 0 presses with f_r. By the thesis' weighting S = 0 still pulls
the joint to zero angle (so that its equation 4.34 does not hold) and S = 0.5 follows half of
x_r; the subspace weighting makes S = 0 true force control. HIC is FHIC with all exponents 1.
u is taken as per cent of PWM beside the neutral 50 (`percent_per_unit`), as the bench does.

Presets: "corrected" (the default values), "seed-printed" (equation 4.28 as printed, 1 kHz, no
filters of the bench) and "seed-code" (the listing of Appendix A: 62.5 Hz, degrees, its
recursive "moving average", differences of the set point, -f_r, pow(0, 0) = 1, PWM 1..99 %).

Source: the thesis' equations 4.27, 4.28, Table 5.12, Appendix A; specification, actuator.md
section 3; errata C15-C22, C29.
"""

import functools
import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import cfunc, njit

import rsea_core.engines.event_driven.states as k
from rsea_core.control.laws.base import (
    CompiledController,
    Controller,
    plant_with_spring,
    require_choices,
    require_sampling,
    require_values,
)
from rsea_core.control.laws.signed_power import spow
from rsea_core.control.laws.torque_loop import kept
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import table_torque
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.source_version import SOURCE_VERSION

UNITS = {"deg": math.degrees(1.0), "rad": 1.0}
WEIGHTINGS = ("subspace", "thesis")
FILTERS = ("first-order", "bench")
NEUTRAL_PERCENT = 50.0
BENCH_TICK_s = 0.016
BENCH_LIMIT = 0.98  # PWM 1..99 %
BENCH_STIFFNESS_Nm_per_deg = 1.150

# parameters
S, KV, KP, ALPHA, BETA, GAMMA, DELTA = range(7)
PER_INERTIA, DAMPING, STIFFNESS, FORCE, PER_TORQUE, UNIT, WEIGHTING = range(7, 14)
FORCE_SIGN, ZERO_POWER, PER_UNIT, LIMIT, T, KEEP, BENCH, GEAR = range(14, 22)
FORCE_FROM = 22
SPRING = 23
# state
ACTED, LAST_X, V1, V2, LAST_R, LAST_RATE, TIME = range(7)


@dataclass(frozen=True, kw_only=True)
class HybridImpedance(Controller):
    """HIC and FHIC; the law is in the module's docstring.

    Attributes
    ----------
    selection : float
        S, 0 (force) to 1 (angle).
    kv, kp : float
        K_v, K_p.
    alpha, beta, gamma, delta : float
        Exponents, 0 to 1; all 1 is HIC.
    inertia, damping, stiffness_Nm_per_unit : float
        J_d, B_d, K_d of the wanted impedance, per angle unit.
    force_N : float
        f_r.
    force_from_s : float
        f_r acts from this time on.
    force_per_torque_per_m : float
        f_e = this times the measured torque; the bench's 4 is a lever of 0.25 m.
    angle_unit : "deg" or "rad"
        Unit in which angles enter the powers; gains belong to it (`signed_power`).
    weighting : "subspace" or "thesis"
    legacy_sign : bool
        True: -f_r, as Appendix A has it.
    legacy_zero_power : bool
        True: 0 to the power of 0 is 1, as C's pow has it.
    percent_per_unit : float
        Per cent of PWM for one unit of u: a gain that the thesis does not write.
    speed_filter : "first-order" or "bench"
        Filter of the load's speed: first order with `filter_s`, or the bench's recursion.
    filter_s : float
    sample_time_s, delay_samples : float, int
    command_limit : float
        Of the duty.

    Raises
    ------
    ControllerError
        If a value is outside what it may be.
    """

    kind: ClassVar[str] = "impedance"
    reference_name: ClassVar[str] = "reference_angle_rad"

    selection: float = 0.5
    kv: float = 0.251
    kp: float = 2.175
    alpha: float = 1.0
    beta: float = 1.0
    gamma: float = 1.0
    delta: float = 1.0
    inertia: float = 1.0
    damping: float = 1.0
    stiffness_Nm_per_unit: float = BENCH_STIFFNESS_Nm_per_deg
    force_N: float = 0.0
    force_from_s: float = 0.0
    force_per_torque_per_m: float = 4.0
    angle_unit: str = "deg"
    weighting: str = "subspace"
    legacy_sign: bool = False
    legacy_zero_power: bool = False
    percent_per_unit: float = 1.0
    speed_filter: str = "first-order"
    filter_s: float = 0.01
    sample_time_s: float = 1e-3
    delay_samples: int = 1
    command_limit: float = 1.0

    def __post_init__(self):
        require_sampling(self)
        require_values(self, ("selection", "alpha", "beta", "gamma", "delta"), "in 0..1")
        least_zero = ("kv", "kp", "damping", "stiffness_Nm_per_unit", "filter_s", "force_from_s")
        require_values(self, least_zero, "finite and not negative")
        require_values(self, ("inertia", "percent_per_unit"), "finite and above 0")
        if not 0.0 < self.command_limit <= 1.0:
            raise ControllerError(
                f"impedance: command_limit = {self.command_limit} must be above 0, at most 1"
            )
        require_choices(self, angle_unit=UNITS, weighting=WEIGHTINGS, speed_filter=FILTERS)

    @classmethod
    def preset(cls, name: str) -> "HybridImpedance":
        """ "corrected", "seed-printed" or "seed-code" (see the module's docstring).

        Raises
        ------
        ControllerError
            If the name is none of them.
        """
        printed = cls(weighting="thesis")
        found = {
            "corrected": cls(),
            "seed-printed": printed,
            "seed-code": replace(
                printed,
                legacy_sign=True,
                legacy_zero_power=True,
                speed_filter="bench",
                sample_time_s=BENCH_TICK_s,
                delay_samples=0,
                command_limit=BENCH_LIMIT,
            ),
        }
        if name not in found:
            raise ControllerError(f"impedance preset {name!r} must be one of {', '.join(found)}")
        return found[name]

    def findings(self) -> list[str]:
        """What a user of these values should know, in sentences."""
        found = []
        if 0.0 < self.selection < 1.0 and self.weighting == "thesis":
            found.append(
                f"selection {self.selection:g} with the thesis' weighting follows"
                f" {self.selection:g} times the reference angle"
            )
        if self.selection < 1.0 and self.weighting == "thesis" and self.kp > 0.0:
            found.append(
                "the thesis' weighting pulls the joint to zero angle also in its force control:"
                " the force does not reach its reference"
            )
        small = [n for n in ("beta", "gamma") if getattr(self, n) < 1.0]
        if small:
            found.append(
                f"{', '.join(small)} below 1: infinite gain at zero error, so the loop chatters"
                " there; margins hold at a stated amplitude only"
            )
        if self.legacy_sign:
            found.append("f_r enters with the listing's minus: give it as a reaction")
        return found

    @property
    def has_gain_at_rest(self) -> bool:
        """Whether both errors enter linearly."""
        return self.beta == 1.0 and self.gamma == 1.0

    def compile(self, model: ActuatorModel, load: Load) -> CompiledController:
        """The law for one machine.

        Raises
        ------
        ControllerError
            If wheel and load are rigidly joined, so that there is no torque to measure.
        RigError
            If the rig lacks a value that the law needs.
        """
        plant = plant_with_spring(self, model, "duty", load)
        p = np.zeros(SPRING)
        p[[S, KV, KP]] = self.selection, self.kv, self.kp
        p[[ALPHA, BETA, GAMMA, DELTA]] = self.alpha, self.beta, self.gamma, self.delta
        p[[PER_INERTIA, DAMPING]] = 1.0 / self.inertia, self.damping
        p[[STIFFNESS, FORCE]] = self.stiffness_Nm_per_unit, self.force_N
        p[[PER_TORQUE, UNIT]] = self.force_per_torque_per_m, UNITS[self.angle_unit]
        p[WEIGHTING] = WEIGHTINGS.index(self.weighting)
        p[FORCE_SIGN] = -1.0 if self.legacy_sign else 1.0
        p[ZERO_POWER] = self.legacy_zero_power
        p[[PER_UNIT, LIMIT]] = self.percent_per_unit / NEUTRAL_PERCENT, self.command_limit
        p[[T, KEEP]] = self.sample_time_s, kept(self.filter_s, self.sample_time_s)
        p[[BENCH, GEAR]] = self.speed_filter == "bench", plant.gear_ratio
        p[FORCE_FROM] = self.force_from_s
        return CompiledController(
            function=_compiled(SOURCE_VERSION),
            parameters=np.concatenate((p, model.spring_table(load).regions.ravel())),
            state=np.zeros(7),
            command_name="duty",
            command_limit=self.command_limit,
        )


@njit(error_model="numpy", inline="always")
def power(p, x, exponent):
    """spow, or with the listing's pow(0, 0) = 1."""
    if x == 0.0 and exponent == 0.0 and p[ZERO_POWER] != 0.0:
        return 1.0
    return spow(x, exponent)


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def impedance(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        x = y[k.READ_LOAD_ANGLE] * p[UNIT]
        r = y[k.REFERENCE] * p[UNIT]
        rate, acceleration = y[k.REFERENCE_RATE] * p[UNIT], y[k.REFERENCE_ACCELERATION] * p[UNIT]
        if p[BENCH] != 0.0:
            # the listing starts from zeros, so its first tick differences jump
            speed = ((x - s[LAST_X]) / p[T] + s[V1] + s[V2]) / 3.0
            rate = (r - s[LAST_R]) / p[T]
            acceleration = (rate - s[LAST_RATE]) / p[T]
            s[LAST_R], s[LAST_RATE] = r, rate
        else:
            if s[ACTED] == 0.0:
                s[ACTED], s[LAST_X] = 1.0, x
            speed = p[KEEP] * s[V1] + (1.0 - p[KEEP]) * (x - s[LAST_X]) / p[T]
        s[V2], s[V1], s[LAST_X] = s[V1], speed, x
        torque = table_torque(spring, y[k.READ_MOTOR_ANGLE] / p[GEAR] - y[k.READ_LOAD_ANGLE])
        force = p[FORCE] if s[TIME] >= p[FORCE_FROM] - 0.5 * p[T] else 0.0
        s[TIME] += p[T]
        if p[WEIGHTING] == 0.0:
            slow, far = p[S] * (rate - speed), p[S] * (r - x)
        else:
            slow, far = p[S] * rate - speed, p[S] * r - x
        pushed = p[KV] * p[DAMPING] * power(p, slow, p[BETA])
        pushed += p[KP] * p[STIFFNESS] * power(p, far, p[GAMMA])
        pushed += p[FORCE_SIGN] * power(p, 1.0 - p[S], p[DELTA]) * force
        pushed -= p[PER_TORQUE] * torque
        u = power(p, p[S] * acceleration, p[ALPHA]) + p[PER_INERTIA] * pushed
        asked = p[PER_UNIT] * u
        command[k.COMMAND] = min(max(asked, -p[LIMIT]), p[LIMIT])
        command[k.UNSATURATED] = asked

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(impedance)
