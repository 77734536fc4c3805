"""The discretisation error of the stiffness: a mesh series, its extrapolation, a verdict.

Source: Roache, "Quantification of uncertainty in computational fluid dynamics", Annu. Rev. Fluid
Mech. 29 (1997): Richardson extrapolation with the observed order, and a safety factor on it.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import MeshErrorEstimate
from dftfs.fem.newton import linear_tangent

_RATIO = 1.5
_ORDER_RANGE = (1.0, 6.0)  # outside it the series is not in its asymptotic range
_SAFETY = 1.25  # Roache's factor for three meshes
_CONVERGED = 1e-3


def stiffness_error(
    problem: TorsionProblem,
    *,
    solver: str = "auto",
    on_progress: Callable[[str], None] = lambda message: None,
) -> MeshErrorEstimate:
    """Tangent stiffness at rest on three meshes, each 1.5 times finer than the one before.

    In 3D one more solve with twice the layers gives the error through the width, which is added.

    Returns
    -------
    MeshErrorEstimate
        ``relative_error`` bounds the error of the first mesh (the one that is solved on).
    """
    sizes = (1.0, 1 / _RATIO, 1 / _RATIO**2)
    values = []
    for size in sizes:
        finer = replace(problem, sizing=problem.sizing.finer(1 / size))
        values.append(finer.copies * linear_tangent(finer.static_problem(), solver=solver))
        on_progress(f"{problem.model}, element size x {size:.2f}: K = {values[-1]:.4f} Nm/rad")
    width_error = 0.0
    if problem.dimension == 3:
        layered = replace(problem, layers=2 * problem.layers)
        width_error = (
            layered.copies * linear_tangent(layered.static_problem(), solver=solver) - values[0]
        ) * (4 / 3)
    return _estimate(sizes, tuple(values), width_error)


def _estimate(
    sizes: tuple[float, ...], values: tuple[float, ...], width_error: float
) -> MeshErrorEstimate:
    first, second = values[0] - values[1], values[1] - values[2]
    same_sign = first * second > 0
    order = float(np.log(first / second) / np.log(_RATIO)) if same_sign else float("nan")
    regular = same_sign and order >= _ORDER_RANGE[0]
    # a series that falls faster than its elements can is taken at their order
    power = min(order, _ORDER_RANGE[1]) if regular else 1.0
    correction = second / (_RATIO**power - 1)
    extrapolated = values[2] - correction + width_error
    spread = max(values) - min(values)
    error = abs(values[0] - extrapolated) if regular else spread + abs(width_error)
    relative = _SAFETY * error / abs(extrapolated)
    if regular and relative < _CONVERGED:
        verdict = "converged"
    elif regular or relative < _CONVERGED:
        verdict = "converging"
    else:
        verdict = "not converging"
    return MeshErrorEstimate(
        sizes=sizes,
        stiffness_Nm_per_rad=values,
        extrapolated_Nm_per_rad=float(extrapolated),
        observed_order=order,
        relative_error=float(relative),
        verdict=verdict,
    )
