"""A gravity torque that the rig file does not name: the parameters' own way to an effect."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.load_unbalance import unbalance as eccentric_mass
from rsea_core.identify.candidates.rig_parameters import unstated_std
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.covariance import Spread, covariance
from rsea_core.identify.judgement.criteria import (
    CLEAR_MSNI,
    UNBALANCE_TOLERANCES,
    UNBALANCE_OFFSET_rad,
)
from rsea_core.identify.selection.criteria import far_from_prior, tempering_of
from rsea_core.identify.selection.final_refinement import final_refinement
from rsea_core.model.actuator_model import GRAVITY_m_per_s2

GRAVITY = ("load_mass_kg", "gravity_angle_offset_rad")
# constants that grow with a torque reading's scale as the mass does, and not with the mass
SCALED = ("torque_constant_Nm_per_A", "motor_inertia_kgm2", "output_inertia_kgm2",
          "spring_stiffness_Nm_per_rad")  # fmt: skip


def gravity_moved(problem: Problem, x: NDArray) -> NDArray:
    """Sine and cosine part (2,) [Nm] of the gravity torque that moved nominal values add.

    Zero where neither mass nor offset may move.
    """
    values = {p.key: p.at(v) for p, v in zip(problem.nominals, x, strict=False)}
    rig = problem.case.rig
    mass, before = rig.load_mass_kg or 0.0, rig.gravity_angle_offset_rad or 0.0
    lever = GRAVITY_m_per_s2 * (rig.load_distance_m or 0.0)
    heavy = values.get("load_mass_kg", mass)
    angle = values.get("gravity_angle_offset_rad", before)
    return lever * np.array(
        [heavy * np.cos(angle) - mass * np.cos(before),
         heavy * np.sin(angle) - mass * np.sin(before)]
    )  # fmt: skip


def unmodelled_gravity(fitter: Fitter, fit: Fit, spread: Spread) -> dict | None:
    """A gravity torque that the rig does not name, read off the gravity that was fitted.

    An entry of `effects`, or None where mass and offset stay where the contract calls their move a
    correction, where a clear mismatch is left (there values stand for what is missing), and where
    the effect is among the laws. A weighed mass does not move: what hangs off the line through the
    joint shows in the offset, the rest of it in nothing, so that a law of both parts is fitted.
    Together with laws values stand for what these lack: there the move must be more than the
    owner's tolerances can hold.
    """
    problem = fitter.problem
    if np.any(fit.msni > CLEAR_MSNI) or LoadUnbalance.effect in fit.hypothesis.effects:
        return None
    index = {p.key: j for j, p in enumerate(problem.nominals)}
    if "gravity_angle_offset_rad" not in index:
        return None
    turn, heavy = index["gravity_angle_offset_rad"], index.get("load_mass_kg")  # it may be weighed
    x, std = fit.x, spread.std
    moved = abs(x[turn]) * problem.nominals[turn].tolerance
    unsure = std[turn] * problem.nominals[turn].tolerance
    sure = (moved - UNBALANCE_OFFSET_rad) / max(unsure, 1e-3)
    if heavy is not None:
        excess = abs(x[heavy]) - _common(problem, x, heavy)
        sure = max(sure, (excess - UNBALANCE_TOLERANCES) / max(std[heavy], 0.2))
    if sure <= 0.0:
        return None
    if fit.hypothesis.laws:
        far = far_from_prior(problem, fit)
        if not (far[turn] or (heavy is not None and far[heavy])):
            return None
    if heavy is None:
        fit, spread = _of_both_parts(fitter, fit)
    return gravity_entry(problem, fit, spread, sure)


def gravity_entry(problem: Problem, fit: Fit, spread: Spread, sure: float) -> dict:
    """The effect with amplitude and angle of the gravity that was fitted."""
    index, x = {p.key: j for j, p in enumerate(problem.nominals)}, fit.x
    turn, heavy = index["gravity_angle_offset_rad"], index.get("load_mass_kg")
    a, b = _parts(problem, fit.hypothesis, x)
    J = np.array(
        [(_parts(problem, fit.hypothesis, x + d) - (a, b)) / 1e-3 for d in 1e-3 * np.eye(x.size)]
    ).T
    r, angle = float(np.hypot(a, b)), float(np.arctan2(b, a))
    along, across = (a * J[0] + b * J[1]) / r, (a * J[1] - b * J[0]) / r**2
    if heavy is None:
        size = variance_of(problem, spread, along, "torque_amplitude_Nm", r, angle)
        turned = variance_of(problem, spread, across, "angle_rad", r, angle)
    else:  # the rig's own gravity is known to its tolerances only
        own = _weight(problem) * np.array(
            [problem.nominals[heavy].tolerance, problem.nominals[turn].tolerance]
        )
        size = spread.variance(along) + np.sum((own * (a / r, b / r)) ** 2)
        turned = spread.variance(across) + np.sum((own * (b / r, a / r)) ** 2) / r**2
    return {
        "name": LoadUnbalance.effect,
        "subsystem": "load",
        "confidence": round(float(min(0.97, 1.0 - 0.5 * np.exp(-sure))), 3),
        "law": "eccentric mass",
        "parameters": {
            "torque_amplitude_Nm": {
                "value": r, "std": float(np.sqrt(size)), "unit": "Nm", "at_bound": False,
            },
            "angle_rad": {
                "value": angle, "std": float(np.sqrt(turned)), "unit": "rad", "at_bound": False,
            },
        },
        "class": [LoadUnbalance.effect],
        "alternatives": [],
    }  # fmt: skip


def variance_of(
    problem: Problem, spread: Spread, slope: NDArray, name: str, torque: float, angle: float
) -> float:
    """Of amplitude or angle of an unbalance fitted jointly with the rig's own gravity.

    Recordings see the sum of both (`slope` (n,) is of the sum), and what the rig's own is off by
    is no unbalance: its tolerances count, and the lever's, which is none of the unknowns.
    """
    alone = slope.copy()
    for j, p in enumerate(problem.nominals):
        if p.key in GRAVITY:
            alone[j] = 0.0
    lever = GRAVITY_m_per_s2 * (problem.case.rig.load_distance_m or 0.0)
    off = lever * unstated_std(problem.case.rig, "load_mass_kg")
    off *= np.cos(angle) if name == "torque_amplitude_Nm" else np.sin(angle) / max(torque, 1e-12)
    return max(spread.variance(slope), spread.variance(alone)) + float(off) ** 2


def _weight(problem: Problem) -> float:
    rig = problem.case.rig
    return GRAVITY_m_per_s2 * (rig.load_mass_kg or 0.0) * (rig.load_distance_m or 0.0)


def _parts(problem: Problem, hypothesis: Hypothesis, x: NDArray) -> NDArray:
    """Sine and cosine part (2,) [Nm] of all gravity that the rig does not name."""
    found = gravity_moved(problem, x)
    for law, values in zip(hypothesis.laws, problem.values(hypothesis, x)[1], strict=True):
        if law.effect == LoadUnbalance.effect:
            found = found + np.array([values["sin_Nm"], values["cos_Nm"]])
    return found


def _of_both_parts(fitter: Fitter, fit: Fit) -> tuple[Fit, Spread]:
    """The fit with an eccentric mass in place of what gravity has turned, and its spread."""
    problem = fitter.problem
    law = eccentric_mass(typical_magnitudes_of(problem.case).load_torque_Nm)
    x = fit.x.copy()
    for j, p in enumerate(problem.nominals):
        if p.key in GRAVITY:
            x[j] = 0.0
    begin = gravity_moved(problem, fit.x) / [parameter.scale for parameter in law.unknowns]
    hypothesis = Hypothesis(laws=(*fit.hypothesis.laws, law))
    tempering = tempering_of(fit.msni)
    both = fitter.fit(hypothesis, np.concatenate([x, begin]), iterations=6, tempering=tempering)
    both = final_refinement(fitter, both)
    return both, covariance(fitter, both, tempering=tempering_of(both.msni))[0]


def _common(problem: Problem, x: NDArray, heavy: int) -> float:
    """How many of its tolerances the mass moved together with motor and spring, by a common factor.

    Torques that are all larger are the scale of what read them, and no gravity.
    """
    own = [(p.tolerance, v) for p, v in zip(problem.nominals, x, strict=False) if p.key in SCALED]
    if not own:
        return 0.0
    factor = sum(v / t for t, v in own) / sum(1.0 / t**2 for t, _ in own)
    shared = factor / problem.nominals[heavy].tolerance * np.sign(x[heavy])
    return float(np.clip(shared, 0.0, abs(x[heavy])))
