"""What a motion says about units: the torque of a command against what the motion needs of it.

Inertia, gravity, springs and the friction that the rig file states need it. Friction that nobody
stated may need more, so that a command which gives more says little of its unit.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.registry import GearFriction, LoadFriction, SpringParallel
from rsea_core.importing.unit_evidence import (
    FOLLOWS,
    TOGETHER,
    Law,
    correlation_of,
    scale_of,
    slow_of,
    volts_of,
    window_of,
)
from rsea_core.machine.rig import Rig
from rsea_core.terms.known import KnownTerm

MOTION_TOLERANCE, HELD = 0.5, 4.0
GRAVITY_m_per_s2 = 9.81
CREEPING = 1e-3  # of the largest speed: friction has no direction below it
PARTS = {GearFriction.effect: "motor", LoadFriction.effect: "load", SpringParallel.effect: "load"}


def motion_laws(
    rig: Rig, c: Mapping[str, NDArray], ratio: float, terms: Sequence[KnownTerm] = ()
) -> list[Law]:
    """The torque of the command against what the motion needs of it.

    Second differences over rows are accelerations in a triangular window: everything else is
    averaged in the same one.
    """
    names = [n for n in ("motor_angle_rad", "load_angle_rad") if n in c]
    given = _driving_torque(rig, c, ratio)
    if not names or given is None:
        return []
    output = c[names[0]] / (ratio if names[0] == "motor_angle_rad" else 1.0)
    needs = _Needs(rig, terms, c, output, ratio)
    command, torque, damping = given
    if needs.inertia <= 0.0:
        return []
    n = max(2, window_of(c["time_s"]) // 2)
    span = n * max(float(np.median(np.diff(c["time_s"]))), 1e-12)
    if output.size < 4 * n:
        return []
    acceleration = (output[2 * n :] - 2.0 * output[n:-n] + output[: -2 * n]) / span**2
    speed = (output[2 * n :] - output[: -2 * n]) / (2.0 * span)
    needed = needs.inertia * acceleration + (damping + needs.viscous) * speed
    needed += _twice(needs.static, n) + needs.dry * _direction(speed)
    slope, together = scale_of(needed, _twice(torque, n))
    if abs(together) < TOGETHER:
        return []
    what = "inertia, gravity, spring and friction" if needs.dry else "inertia, gravity and spring"
    is_excess = not needs.dry and abs(slope) > 1.0
    return [
        Law(
            text=f"{command} gives {slope:.3g} times the torque that {what} need",
            ratio=slope,
            tolerance=MOTION_TOLERANCE,
            columns=(command, names[0]),
            held=HELD,
            is_excess=is_excess,
        )
    ]


def _twice(values: NDArray, n: int) -> NDArray:
    """Averages in a triangular window of n rows on both sides, at rows that have both."""
    once = slow_of(values, n)  # less the first value
    return slow_of(once, n)[1:-1] + once[0] + values[0]


def _direction(speed: NDArray) -> NDArray:
    """The sign of a speed, 0 where nothing moves."""
    return speed / np.hypot(speed, max(CREEPING * float(np.abs(speed).max()), 1e-300))


def _driving_torque(
    rig: Rig, c: Mapping[str, NDArray], ratio: float
) -> tuple[str, NDArray, float] | None:
    """The command, its torque at the gear's output, and the damping there by the back-EMF."""
    k_t, R, k_e = (rig.torque_constant_Nm_per_A, rig.terminal_resistance_ohm,
                   rig.back_emf_constant_Vs_per_rad)  # fmt: skip
    if not k_t:
        return None
    if "current_command_A" in c:
        return "current_command_A", ratio * k_t * c["current_command_A"], 0.0
    volts = volts_of(rig, c)
    if volts is None and "current_A" in c and "duty" not in c:
        return "current_A", ratio * k_t * c["current_A"], 0.0
    if volts is None or not R:
        return None
    return volts[0], ratio * k_t * volts[1] / R, ratio**2 * k_t * (k_e or k_t) / R


class _Needs:
    """What the gear's output needs of the command, by the rig file.

    Attributes
    ----------
    inertia : float
        0 where it is unknown.
    static : (n,) array
        Torque of gravity or of springs.
    viscous, dry : float
    """

    def __init__(
        self, rig: Rig, terms: Sequence[KnownTerm], c: Mapping[str, NDArray], output: NDArray,
        ratio: float,
    ):  # fmt: skip
        self.inertia = ratio**2 * (rig.motor_inertia_kgm2 or 0.0) + (rig.output_inertia_kgm2 or 0.0)
        self.viscous = ratio**2 * (rig.motor_viscous_Nms_per_rad or 0.0)
        self.viscous += rig.output_viscous_Nms_per_rad or 0.0
        self.static, self.dry = np.zeros_like(output), 0.0
        K, load = rig.spring_stiffness_Nm_per_rad, c.get("load_angle_rad")
        self._add(terms, "motor", output, ratio)
        if rig.has("spring"):
            if not K or (load is None and rig.has("load")):
                self.inertia = 0.0
                return
            together = 0.0 if load is None else correlation_of(output, load)
            if load is None or abs(together) < FOLLOWS:
                held = 0.0 if load is None else np.sign(together) * load
                self.static = self.static + K * (output - held)
                return
        self.inertia += rig.load_inertia_kgm2 or 0.0
        self.viscous += rig.load_viscous_Nms_per_rad or 0.0
        weight = GRAVITY_m_per_s2 * (rig.load_mass_kg or 0.0) * (rig.load_distance_m or 0.0)
        if rig.axis == "rotary":
            self.static = self.static + weight * np.sin(output)
        self._add(terms, "load", output, 1.0)

    def _add(self, terms: Sequence[KnownTerm], part: str, angle: NDArray, ratio: float) -> None:
        """Known friction and springs of a part, at the gear's output."""
        for term in (t.term for t in terms if PARTS.get(t.term.effect) == part):
            self.dry += ratio * getattr(term, "coulomb_Nm", 0.0)
            self.viscous += ratio**2 * getattr(term, "viscous_Nms_per_rad", 0.0)
            stiffness = getattr(term, "stiffness_Nm_per_rad", 0.0)
            self.static = self.static + stiffness * (angle - getattr(term, "rest_angle_rad", 0.0))
