"""The spring's effects as the true machine has them; loops are measured on the law itself."""

import math

import numpy as np

from dftfs.proof.effects_base import Applied, Effect, Effects
from dftfs.proof.machine import Machine, Physics
from dftfs.proof.truth_laws import loop_torque

LOOP_RAD = 0.15  # the contract compares loops of this half-amplitude
SPRING = Effects()


def loop_of(physics: Physics, stops: np.ndarray) -> dict[str, float]:
    """Width at zero deflection and energy of the loop of +-0.15 rad, third turn."""
    path = LOOP_RAD * np.sin(np.linspace(0.0, 6 * np.pi, 60001))
    torque = loop_torque(physics, stops, path)
    last = slice(40000, None)
    energy = float(np.trapezoid(torque[last], path[last]))
    return {"loop_width_Nm": float(torque[40000] - torque[50000]), "loop_energy_J": abs(energy)}


@SPRING.add("spring-hysteresis", "spring")
def spring_hysteresis(rng: np.random.Generator, machine: Machine) -> Effect:
    width = rng.uniform(0.3, 1.0)
    bouc_wen = bool(rng.random() < 0.5)
    yield_rad, exponent = rng.uniform(0.01, 0.04), rng.uniform(1.0, 2.0)
    reach = rng.uniform(0.01, 0.03) * np.geomspace(0.15, 4.0, 8)
    share = rng.uniform(0.5, 1.0, 8) * np.exp(-reach / 0.05)

    def at(strength: float) -> Applied:
        top = 0.5 * width * strength
        stops = np.zeros((0, 2))
        changes: dict[str, float] = {}
        if bouc_wen:
            changes = {
                "loop_torque_Nm": top,
                "loop_yield_rad": yield_rad,
                "loop_exponent": exponent,
            }
        else:
            torque = top * share / share.sum()
            stops = np.column_stack([torque / reach, torque])
        return Applied(
            description="Bouc-Wen" if bouc_wen else "Prandtl-Ishlinskii",
            parameters=loop_of(Physics(**changes), stops),
            physics=changes,
            series={"stops": stops},
        )

    return at


@SPRING.add("spring-hardening", "spring")
def spring_hardening(rng: np.random.Generator, machine: Machine) -> Effect:
    rise = rng.uniform(0.12, 0.4) if rng.random() < 0.6 else -rng.uniform(0.08, 0.2)

    def at(strength: float) -> Applied:
        ratio = 1.0 + max(-0.6, rise * strength)
        b = math.acosh(ratio) if ratio > 1.0 else -math.acos(ratio)
        return Applied(
            parameters={"stiffness_ratio_at_0p15rad": ratio},
            physics={"hardening_per_rad": b / LOOP_RAD},
        )

    return at


@SPRING.add("spring-contact", "spring")
def spring_contact(rng: np.random.Generator, machine: Machine) -> Effect:
    onset, factor = rng.uniform(0.08, 0.14), rng.uniform(1.0, 4.0)
    side = float(rng.choice([-1.0, 0.0, 1.0]))
    stiffness = machine.spring_stiffness_Nm_per_rad
    return lambda strength: Applied(
        parameters={"onset_rad": onset, "onset_Nm": stiffness * onset},
        physics={
            "coils_touch_rad": onset,
            "coils_touch_side": side,
            "coils_touch_stiffness_Nm_per_rad": factor * strength * stiffness,
        },
    )


@SPRING.add("spring-viscoelastic", "spring")
def spring_viscoelastic(rng: np.random.Generator, machine: Machine) -> Effect:
    rise = rng.uniform(0.08, 0.3)
    if rng.random() < 0.6:
        times = np.array([rng.uniform(0.02, 0.08), rng.uniform(0.2, 1.0)])
    else:  # a spread of times: what a fractional element is made of
        times = np.geomspace(0.01, 2.0, 6)
    share = rng.uniform(0.5, 1.0, times.size)
    share /= share.sum()

    def at(strength: float) -> Applied:
        branch = machine.spring_stiffness_Nm_per_rad * rise * strength * share
        return Applied(
            description=f"{times.size} branches",
            parameters={"stiffness_rise_fast_over_static": 1.0 + rise * strength},
            series={"branches": np.column_stack([branch, times])},
        )

    return at
