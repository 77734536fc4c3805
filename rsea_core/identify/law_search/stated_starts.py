"""Where the fit of a law begins that takes the place of one that the rig file states.

Beside a stated level of friction a screening must see what a richer law adds, a Stribeck peak or a
change with the angle, and not a level that it would have to find again: what both laws have begins
as it was fitted.
"""

from collections.abc import Sequence

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.multistep.estimator import Estimate

TORQUE, ANGLE = "coulomb_Nm", "presliding_rad"  # of dry friction on either side of a gear


def beside_stated(
    problem: Problem, fit: Estimate, law: Law, start: Sequence[float]
) -> tuple[float, ...]:
    """A start of a law with the fitted values of the stated law whose place it takes, if any."""
    laws, shared = fit.hypothesis.laws, {}
    if not any(w.known for w in laws):
        return tuple(start)
    values, together = problem.values(fit.hypothesis, fit.x)[1], Hypothesis(laws=(*laws, law))
    for stated, v in zip(laws, values, strict=True):
        if problem.acts(stated, fit.hypothesis) and not problem.acts(stated, together):
            free = {u.name: v[u.name] for u in stated.unknowns if u.scale > 0.0}
            shared |= _on_side_of(law, stated, free, problem.case.rig.gear_ratio or 1.0)
    return tuple(
        min(max(shared.get(u.name, value), u.low), u.high)
        for u, value in zip(law.unknowns, start, strict=True)
    )


def _on_side_of(law: Law, stated: Law, values: dict, ratio: float) -> dict:
    """Values of a stated law on the side of the gear that a law of the same body is stated on."""
    motor = GearFriction.effect
    if (law.effect == motor) == (stated.effect == motor):
        return values
    if LoadFriction.effect not in (law.effect, stated.effect):
        return {}
    up = ratio if law.effect == motor else 1.0 / ratio
    factors = {TORQUE: 1.0 / up, ANGLE: up}
    return {name: values[name] * factor for name, factor in factors.items() if name in values}
