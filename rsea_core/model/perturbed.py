"""Machines that differ from a model by chance: which values move, how far, and the draws.

What the rig's file cannot know better moves by a share of its value, and so does the model's
friction: a loop that compensates it is otherwise tried with the very friction that it knows.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.effects.registry import Term
from rsea_core.errors import InputError, RseaError
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel

MOST_DRAWS = 100  # of one value, until the machine takes it
K_T, K_E = "torque_constant_Nm_per_A", "back_emf_constant_Vs_per_rad"
PERTURBED = {
    "torque_constant_Nm_per_A": 0.05,
    "terminal_resistance_ohm": 0.10,
    "motor_inertia_kgm2": 0.10,
    "motor_viscous_Nms_per_rad": 0.50,
}
"""Relative standard deviations of a rig's values; k_e moves with k_t.

The spring is left as it is: torque is read through it, so that a wrong stiffness is a scale of the
sensor, the same for every controller.
"""
FRICTION = (
    "gear-friction.coulomb_Nm",
    "gear-friction.viscous_Nms_per_rad",
    "gear-friction.arctan_Nm",
    "gear-load-friction.friction_coefficient",
    "load-friction.coulomb_Nm",
    "load-friction.normal_lever_m",
    "load-friction-angle.coulomb_Nm",
)
"""Friction of a model's effects, moved where it is not 0."""
FRICTION_SPREAD = 0.25


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """A standard deviation in a quantity's own unit, where others are relative."""

    size: float


Tolerances = Mapping[str, float | Deviation]
"""Of each quantity: a field of the rig, or "effect.parameter" of a term."""


def usual_tolerances(model: ActuatorModel) -> dict[str, float]:
    """`PERTURBED` of the rig, and FRICTION_SPREAD of the friction that the model has."""
    held = {f"{t.effect}.{name}": value for t in model.terms for name, value in vars(t).items()}
    friction = {key: FRICTION_SPREAD for key in FRICTION if held.get(key)}
    return {key: PERTURBED[key] for key in PERTURBED if getattr(model.rig, key)} | friction


def perturbed_models(
    model: ActuatorModel, count: int, seed: int, tolerances: Tolerances | None = None
) -> list[ActuatorModel]:
    """The model with values moved at random, the same for the same seed.

    Parameters
    ----------
    tolerances : mapping or None
        k_e moves with k_t where it has no tolerance of its own. What the rig or a term refuses (a
        negative inertia) is drawn again. None: `usual_tolerances`.

    Raises
    ------
    InputError
        If a quantity is none of the model's.
    """
    tolerances = usual_tolerances(model) if tolerances is None else tolerances
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        rig, terms = model.rig, list(model.terms)
        for key, spread in tolerances.items():
            if "." in key:
                _move_term(terms, key, spread, rng)
            elif not hasattr(rig, key):
                raise InputError(f"tolerance of {key!r}: the rig has no such value")
            elif getattr(rig, key) is not None:
                rig = _moved(rig, key, spread, rng)
            else:
                rng.standard_normal()
        k_t, k_e = model.rig.torque_constant_Nm_per_A, model.rig.back_emf_constant_Vs_per_rad
        if k_e is not None and K_T in tolerances and K_E not in tolerances:
            rig = replace(rig, **{K_E: k_e * rig.torque_constant_Nm_per_A / k_t})
        found.append(replace(model, rig=rig, terms=tuple(terms)))
    return found


def _moved(held: Rig | Term, name: str, spread: float | Deviation, rng: np.random.Generator):
    """A rig or a term with one value moved, by at most two deviations."""
    value = getattr(held, name)
    size = spread.size if isinstance(spread, Deviation) else spread * value
    for _ in range(MOST_DRAWS):
        away = size * float(np.clip(rng.standard_normal(), -2.0, 2.0))
        if value > 0.0 and value + away < 0.0:
            continue  # what is positive stays so
        try:
            return replace(held, **{name: value + away})
        except RseaError:
            continue
    raise InputError(f"tolerance of {name!r}: no value within it is one that can be")


def _move_term(terms: list, key: str, spread: float | Deviation, rng: np.random.Generator) -> None:
    effect, _, name = key.partition(".")
    for j, term in enumerate(terms):
        if term.effect == effect and isinstance(getattr(term, name, None), float):
            terms[j] = _moved(term, name, spread, rng)
            return
    raise InputError(f"tolerance of {key!r}: the machine has no such effect with such a number")
