"""A gravity torque that the rig file does not name: the parameters' own way to an effect."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.catalogue import unbalance
from rsea_core.identify.fit import Fit, Fitter
from rsea_core.identify.problem import Hypothesis, Problem
from rsea_core.identify.scales import scales_of
from rsea_core.identify.search_state import astray, tempering_of
from rsea_core.identify.uncertainty import Spread, covariance
from rsea_core.identify.verdict import CLEAR
from rsea_core.model import GRAVITY_m_per_s2

GRAVITY = ("load_mass_kg", "gravity_angle_offset_rad")
OFFSET_rad = 0.02  # the contract: more is an unbalance, less a correction
HEAVY = 3.0  # tolerances of m g d, likewise
# constants that grow with a torque reading's scale as the mass does, and not with the mass
SCALED = ("torque_constant_Nm_per_A", "motor_inertia_kgm2", "spring_stiffness_Nm_per_rad")


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


def unbalance_of(fitter: Fitter, fit: Fit, spread: Spread) -> dict | None:
    """A gravity torque that the rig does not name, read off the gravity that was fitted.

    An entry of `effects`, or None where mass and offset stay where the contract calls their move a
    correction, and where a clear mismatch is left: there values stand for what is missing. Beside
    laws values stand for what these lack: as a further effect it must be more than the owner's
    tolerances can hold.
    """
    problem = fitter.problem
    if np.any(fit.power > CLEAR):
        return None
    index = {p.key: j for j, p in enumerate(problem.nominals)}
    if "gravity_angle_offset_rad" not in index:
        return None
    turn, heavy = index["gravity_angle_offset_rad"], index.get("load_mass_kg")  # it may be weighed

    def vector(x: NDArray) -> NDArray:
        return gravity_moved(problem, x)

    x = fit.x
    std = spread.std
    moved = abs(x[turn]) * problem.nominals[turn].tolerance
    unsure = std[turn] * problem.nominals[turn].tolerance
    sure = (moved - OFFSET_rad) / max(unsure, 1e-3)
    if heavy is not None:
        excess = abs(x[heavy]) - _common(problem, x, heavy)
        sure = max(sure, (excess - HEAVY) / max(std[heavy], 0.2))
    if sure <= 0.0:
        return None
    if fit.hypothesis.laws:
        gone = astray(problem, fit)
        if not (gone[turn] or (heavy is not None and gone[heavy])):
            return None
    if heavy is None:  # one number that moved does not say which way the torque leans
        beside = _with_both_parts(fitter, fit, vector(x))
        fit, x = beside, beside.x
        spread = covariance(fitter, fit, tempering=tempering_of(fit.power))[0]
        own = fit.hypothesis.laws[-1]

        def vector(x: NDArray) -> NDArray:
            values = problem.values(fit.hypothesis, x)[1][-1]
            return np.array([values[knob.name] for knob in own.knobs]) + gravity_moved(problem, x)

    a, b = vector(x)
    J = np.array([(vector(x + d) - (a, b)) / 1e-3 for d in 1e-3 * np.eye(x.size)]).T
    r = float(np.hypot(a, b))
    along, across = (a * J[0] + b * J[1]) / r, (a * J[1] - b * J[0]) / r
    # the rig's own gravity is known to its tolerances only, and what it is off by is no unbalance
    rig = problem.case.rig
    weight = GRAVITY_m_per_s2 * rig.load_mass_kg * rig.load_distance_m
    heavy_share = 0.0 if heavy is None else problem.nominals[heavy].tolerance
    turn_rad = problem.nominals[turn].tolerance
    cos, sin = a / r, b / r
    own_along = weight * np.hypot(cos * heavy_share, sin * turn_rad)
    own_across = weight * np.hypot(sin * heavy_share, cos * turn_rad)
    return {
        "name": "load-unbalance",
        "subsystem": "load",
        "confidence": round(float(min(0.97, 1.0 - 0.5 * np.exp(-sure))), 3),
        "law": "eccentric mass",
        "parameters": {
            "torque_amplitude_Nm": {
                "value": r, "std": float(np.sqrt(spread.variance(along) + own_along**2)),
                "unit": "Nm", "at_bound": False,
            },
            "angle_rad": {
                "value": float(np.arctan2(b, a)),
                "std": float(np.sqrt(spread.variance(across) + own_across**2)) / r, "unit": "rad",
                "at_bound": False,
            },
        },
        "class": ["load-unbalance"],
        "alternatives": [],
    }  # fmt: skip


def _with_both_parts(fitter: Fitter, fit: Fit, torque: NDArray) -> Fit:
    """The fit with an unbalance that has both parts in the offset's place.

    Of a weighed load the offset alone can move, and it only turns gravity: what leans along the
    load's own weight went into other constants.
    """
    problem = fitter.problem
    law = unbalance(scales_of(problem.case).load_torque_Nm)
    hypothesis = Hypothesis(laws=(*fit.hypothesis.laws, law))
    n = len(problem.nominals)
    own = problem.start(Hypothesis(laws=(law,)), [tuple(float(part) for part in torque)])[n:]
    x = np.concatenate([fit.x, own])
    x[[p.key for p in problem.nominals].index("gravity_angle_offset_rad")] = 0.0
    return fitter.fit(hypothesis, x, iterations=8, tempering=tempering_of(fit.power), central=True)


def _common(problem: Problem, x: NDArray, heavy: int) -> float:
    """How many of its tolerances the mass moved together with motor and spring, by one factor.

    Torques that are all larger are the scale of what read them, and no gravity.
    """
    own = [(p.tolerance, v) for p, v in zip(problem.nominals, x, strict=False) if p.key in SCALED]
    if not own:
        return 0.0
    factor = sum(v / t for t, v in own) / sum(1.0 / t**2 for t, _ in own)
    shared = factor / problem.nominals[heavy].tolerance * np.sign(x[heavy])
    return float(np.clip(shared, 0.0, abs(x[heavy])))
