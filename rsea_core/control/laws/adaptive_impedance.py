"""Adaptive fractional hybrid impedance: exponents scheduled by the environment's stiffness.

    u   = S u_x + (1 - S) u_f
    u_x = spow(x_r'', a0) + (1/J_d) [ K_vp B_d spow(x_r' - x', b0) + K_pp K_d spow(x_r - x, g0) ]
    u_f = (1/J_d) [ K_vf B_d spow(f_r' - f_e', b1) + K_pf K_d spow(f_r - f_e, g1) ]

f_r is constant here, so its derivatives vanish and u_f has no term with alpha1. The environment's
stiffness K_e = d tau_s / d theta_l is found by recursive least squares with forgetting on the
changes of torque and load angle, only while the joint presses and moves; its rate by a filter.
Five Gaussian sets on K_e (0..50 Nm/rad) and five on its rate (+-100 Nm/(rad s)) fire the 25
rules of Table 4.7 (product of memberships), whose five outputs are points between the exponents
for a soft and for a hard environment.

Of all this the thesis prints the rule table of alpha0, the ranges and the gains. The sets (evenly
spaced, crossing at one half), the same table for the other exponents, the estimator and the ends
of the schedule (Table 4.5's soft and hard columns) are a reconstruction and not the thesis'.

Source: the thesis' section 4.4.6, Tables 4.5 and 4.7, Appendix B; errata C28; Astrom &
Wittenmark, Adaptive Control (1995), section 2.2 (least squares with forgetting).
"""

import functools
from dataclasses import dataclass
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
from rsea_core.control.laws.impedance import NEUTRAL_PERCENT, UNITS, BENCH_STIFFNESS_Nm_per_deg
from rsea_core.control.laws.signed_power import spow
from rsea_core.control.laws.torque_loop import kept
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import table_torque
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.source_version import SOURCE_VERSION

# levels 0 (very soft) to 4 (very hard): rows the rate's sets, columns the stiffness'
RULES = np.array(
    [[0, 0, 1, 1, 2], [0, 0, 1, 1, 2], [0, 1, 1, 2, 3], [1, 1, 2, 3, 3], [1, 2, 2, 3, 4]]
)
STIFFEST_Nm_per_rad, FASTEST_Nm_per_rad_s = 50.0, 100.0
EXPONENTS = ("alpha0", "beta0", "gamma0", "beta1", "gamma1")
# Table 4.5, soft and hard; the force's exponents take the columns of the position's
SOFT = (0.3821, 0.7508, 0.7958, 0.7508, 0.7958)
HARD = (0.4650, 0.8142, 0.7891, 0.8142, 0.7891)

S, KVP, KPP, KVF, KPF, PER_INERTIA, DAMPING, STIFFNESS, FORCE, FORCE_FROM = range(10)
PER_TORQUE, UNIT, PER_UNIT, LIMIT, T, KEEP, GEAR, FORGET, PRESSING, RATE_KEEP = range(10, 20)
ENDS = 20
RULE_AT = ENDS + 10
SPRING = RULE_AT + 25
ACTED, LAST_X, SPEED, TIME, LAST_TORQUE, LAST_ANGLE, P, K_E, K_RATE, LAST_F, F_SPEED = range(11)
N_STATE = 11


@dataclass(frozen=True, kw_only=True)
class AdaptiveImpedance(Controller):
    """AFHIC; the law is in the module's docstring.

    Attributes
    ----------
    selection : float
        S, 0 to 1.
    kvp, kpp, kvf, kpf : float
        Gains of angle and force (Appendix B).
    soft, hard : (5,) tuples of float
        alpha0, beta0, gamma0, beta1, gamma1 at both ends of the schedule.
    inertia, damping, stiffness_Nm_per_unit, force_N, force_from_s, force_per_torque_per_m,
    angle_unit, percent_per_unit, filter_s, sample_time_s, delay_samples : as HybridImpedance
    forgetting_s : float
        Time constant with which the estimator forgets.
    pressing_Nm : float
        Magnitude of the torque from which on the joint counts as pressing on something, on
        either side.

    Raises
    ------
    ControllerError
        If a value is outside what it may be.
    """

    kind: ClassVar[str] = "adaptive-impedance"
    reference_name: ClassVar[str] = "reference_angle_rad"

    selection: float = 0.5
    kvp: float = 0.1524
    kpp: float = 0.4403
    kvf: float = 0.1524
    kpf: float = 0.4403
    soft: tuple[float, ...] = SOFT
    hard: tuple[float, ...] = HARD
    inertia: float = 1.0
    damping: float = 1.0
    stiffness_Nm_per_unit: float = BENCH_STIFFNESS_Nm_per_deg
    force_N: float = 0.0
    force_from_s: float = 0.0
    force_per_torque_per_m: float = 4.0
    angle_unit: str = "deg"
    percent_per_unit: float = 1.0
    filter_s: float = 0.01
    forgetting_s: float = 0.2
    pressing_Nm: float = 0.3
    sample_time_s: float = 1e-3
    delay_samples: int = 1

    def __post_init__(self):
        require_sampling(self)
        require_values(self, ["selection"], "in 0..1")
        for name in ("soft", "hard"):
            ends = tuple(float(x) for x in getattr(self, name))
            object.__setattr__(self, name, ends)
            if len(ends) != len(EXPONENTS) or not all(0.0 <= x <= 1.0 for x in ends):
                raise ControllerError(
                    f"adaptive-impedance: {name} = {ends} must be {len(EXPONENTS)} exponents"
                    f" ({', '.join(EXPONENTS)}) in 0..1"
                )
        gains = ("kvp", "kpp", "kvf", "kpf", "damping", "filter_s", "pressing_Nm")
        require_values(self, gains, "finite and not negative")
        require_values(self, ("inertia", "percent_per_unit", "forgetting_s"), "finite and above 0")
        require_choices(self, angle_unit=UNITS)

    @property
    def has_gain_at_rest(self) -> bool:
        """Whether every error enters linearly at both ends of the schedule."""
        return min(*self.soft[1:], *self.hard[1:]) == 1.0

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
        p[[S, KVP, KPP, KVF, KPF]] = self.selection, self.kvp, self.kpp, self.kvf, self.kpf
        p[[PER_INERTIA, DAMPING]] = 1.0 / self.inertia, self.damping
        p[[STIFFNESS, FORCE]] = self.stiffness_Nm_per_unit, self.force_N
        p[[FORCE_FROM, PER_TORQUE]] = self.force_from_s, self.force_per_torque_per_m
        p[[UNIT, PER_UNIT]] = UNITS[self.angle_unit], self.percent_per_unit / NEUTRAL_PERCENT
        p[[LIMIT, T, GEAR]] = 1.0, self.sample_time_s, plant.gear_ratio
        p[KEEP] = kept(self.filter_s, self.sample_time_s)
        p[[FORGET, RATE_KEEP]] = (
            np.exp(-self.sample_time_s / self.forgetting_s),
            kept(self.forgetting_s, self.sample_time_s),
        )
        p[PRESSING] = self.pressing_Nm
        p[ENDS:RULE_AT] = (*self.soft, *self.hard)
        p[RULE_AT:] = RULES.ravel()
        return CompiledController(
            function=_compiled(SOURCE_VERSION),
            parameters=np.concatenate((p, model.spring_table(load).regions.ravel())),
            state=np.zeros(N_STATE),
            command_name="duty",
            command_limit=1.0,
        )


def scheduled(stiffness_Nm_per_rad: float, rate_Nm_per_rad_s: float) -> float:
    """Where between soft (0) and hard (1) the rules put the exponents."""
    rules = RULES.astype(float).ravel()
    return _level(rules, 0, stiffness_Nm_per_rad, rate_Nm_per_rad_s)


@njit(error_model="numpy", cache=True)
def _level(p, first, stiffness, rate):
    """Weighted mean of the rules' levels, 0 to 1."""
    x = min(max(stiffness / STIFFEST_Nm_per_rad, 0.0), 1.0)
    y = min(max(0.5 + 0.5 * rate / FASTEST_Nm_per_rad_s, 0.0), 1.0)
    weight, total = 0.0, 0.0
    for i in range(5):
        # neighbours cross at one half: exp(-ln 2 ((x - c) / (spacing / 2))^2)
        one = np.exp(-np.log(2.0) * ((y - 0.25 * i) / 0.125) ** 2)
        for j in range(5):
            both = one * np.exp(-np.log(2.0) * ((x - 0.25 * j) / 0.125) ** 2)
            weight += both
            total += both * p[first + 5 * i + j] * 0.25
    return total / weight


@njit(error_model="numpy", inline="always")
def _estimate(p, s, torque, angle):
    """Recursive least squares of the environment's stiffness, and its filtered rate."""
    moved, gained = angle - s[LAST_ANGLE], torque - s[LAST_TORQUE]
    if abs(torque) < p[PRESSING]:
        s[LAST_ANGLE], s[LAST_TORQUE] = angle, torque
        s[K_RATE] = p[RATE_KEEP] * s[K_RATE]
        return
    if abs(moved) < 1e-3:
        return
    gain = s[P] * moved / (p[FORGET] + s[P] * moved * moved)
    last = s[K_E]
    s[K_E] = min(max(last + gain * (gained - last * moved), 0.0), 2.0 * STIFFEST_Nm_per_rad)
    s[P] = min((s[P] - gain * moved * s[P]) / p[FORGET], 1e6)
    s[K_RATE] = p[RATE_KEEP] * s[K_RATE] + (1.0 - p[RATE_KEEP]) * (s[K_E] - last) / p[T]
    s[LAST_ANGLE], s[LAST_TORQUE] = angle, torque


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def adaptive(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        angle = y[k.READ_LOAD_ANGLE]
        torque = table_torque(spring, y[k.READ_MOTOR_ANGLE] / p[GEAR] - angle)
        x, force = angle * p[UNIT], p[PER_TORQUE] * torque
        if s[ACTED] == 0.0:
            s[ACTED], s[LAST_X], s[LAST_F], s[P] = 1.0, x, force, 1e4
            s[LAST_ANGLE], s[LAST_TORQUE] = angle, torque
        s[SPEED] = p[KEEP] * s[SPEED] + (1.0 - p[KEEP]) * (x - s[LAST_X]) / p[T]
        s[F_SPEED] = p[KEEP] * s[F_SPEED] + (1.0 - p[KEEP]) * (force - s[LAST_F]) / p[T]
        s[LAST_X], s[LAST_F] = x, force
        _estimate(p, s, torque, angle)
        level = _level(p, RULE_AT, s[K_E], s[K_RATE])
        e = ENDS
        a0 = p[e] + level * (p[e + 5] - p[e])
        b0 = p[e + 1] + level * (p[e + 6] - p[e + 1])
        g0 = p[e + 2] + level * (p[e + 7] - p[e + 2])
        b1 = p[e + 3] + level * (p[e + 8] - p[e + 3])
        g1 = p[e + 4] + level * (p[e + 9] - p[e + 4])
        wanted = p[FORCE] if s[TIME] >= p[FORCE_FROM] - 0.5 * p[T] else 0.0
        s[TIME] += p[T]
        far = p[KPP] * p[STIFFNESS] * spow(y[k.REFERENCE] * p[UNIT] - x, g0)
        slow = p[KVP] * p[DAMPING] * spow(y[k.REFERENCE_RATE] * p[UNIT] - s[SPEED], b0)
        by_angle = spow(y[k.REFERENCE_ACCELERATION] * p[UNIT], a0) + p[PER_INERTIA] * (far + slow)
        weak = p[KPF] * p[STIFFNESS] * spow(wanted - force, g1)
        rough = p[KVF] * p[DAMPING] * spow(-s[F_SPEED], b1)
        by_force = p[PER_INERTIA] * (weak + rough)
        asked = p[PER_UNIT] * (p[S] * by_angle + (1.0 - p[S]) * by_force)
        command[k.COMMAND] = min(max(asked, -p[LIMIT]), p[LIMIT])
        command[k.UNSATURATED] = asked

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(adaptive)
