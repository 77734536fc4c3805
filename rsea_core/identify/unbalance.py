"""A gravity torque that the rig file does not name: the parameters' own way to an effect."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fit import Fit
from rsea_core.identify.problem import Problem
from rsea_core.identify.uncertainty import Spread

OFFSET_rad = 0.02  # the contract: more is an unbalance, less a correction
HEAVY = 3.0  # tolerances of m g d, likewise


def unbalance_of(problem: Problem, fit: Fit, spread: Spread) -> dict | None:
    """A gravity torque that the rig does not name, read off the gravity that was fitted.

    An entry of `effects`, or None where mass and offset stay where the contract calls their move a
    correction.
    """
    index = {p.key: j for j, p in enumerate(problem.nominals)}
    if not {"gravity_angle_offset_rad", "load_mass_kg"} <= index.keys():
        return None
    rig = problem.case.rig
    weight = rig.load_mass_kg * 9.80665 * rig.load_distance_m
    turn, heavy = index["gravity_angle_offset_rad"], index["load_mass_kg"]
    tolerance = problem.nominals[heavy].tolerance

    def vector(x: NDArray) -> NDArray:
        mass = np.exp(tolerance * x[heavy])
        angle = problem.nominals[turn].at(x[turn])
        before = problem.nominals[turn].value
        return weight * np.array(
            [mass * np.cos(angle) - np.cos(before), mass * np.sin(angle) - np.sin(before)]
        )

    x = fit.x
    std = spread.std
    moved = abs(x[turn]) * problem.nominals[turn].tolerance
    unsure = std[turn] * problem.nominals[turn].tolerance
    heavier = abs(x[heavy]) - HEAVY
    sure = max((moved - OFFSET_rad) / max(unsure, 1e-3), heavier / max(std[heavy], 0.2))
    if sure <= 0.0:
        return None
    a, b = vector(x)
    J = np.array([(vector(x + d) - (a, b)) / 1e-3 for d in 1e-3 * np.eye(x.size)]).T
    r = float(np.hypot(a, b))
    along, across = (a * J[0] + b * J[1]) / r, (a * J[1] - b * J[0]) / r
    return {
        "name": "load-unbalance",
        "subsystem": "load",
        "confidence": round(float(min(0.97, 1.0 - 0.5 * np.exp(-sure))), 3),
        "law": "eccentric mass",
        "parameters": {
            "torque_amplitude_Nm": {
                "value": r, "std": float(np.sqrt(spread.variance(along))), "unit": "Nm",
                "at_bound": False,
            },
            "angle_rad": {
                "value": float(np.arctan2(b, a)),
                "std": float(np.sqrt(spread.variance(across))) / r, "unit": "rad",
                "at_bound": False,
            },
        },
        "class": ["load-unbalance"],
        "alternatives": [],
    }  # fmt: skip
