"""What a diagnosis says of a law in the contract's figures, each with its standard deviation."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, erfc

from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.variant import AT_ONE, FROM_ZERO, Law
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.judgement.covariance import LAW_SPREAD, Spread, between_laws
from rsea_core.identify.judgement.criteria import SHOWN_STD
from rsea_core.identify.judgement.unmodelled_gravity import variance_of
from rsea_core.identify.selection.criteria import TEMPERATURE

STEP = 1e-3  # of an unknown, for derivatives
PERIODIC = (GearTransmissionError.effect,)  # sizes of waves whose phases need not both show

Figures = Mapping[str, float | str]


def figures_with_std(
    problem: Problem,
    fit: Fit,
    spread: Spread,
    j: int,
    figures: Callable[[NDArray], Figures],
    others: Sequence[tuple[Figures, float]],
) -> dict[str, dict]:
    """Value, standard deviation and unit of every figure of law j of a fit.

    Parameters
    ----------
    figures : callable
        The contract's figures of the law at given unknowns (n,).
    others : sequence of (figures, log-likelihood units)
        The same by other laws of the effect, and how far they are behind.
    """
    law, values = fit.hypothesis.laws[j], figures(fit.x)
    jacobian = _derivatives(
        figures, fit.x, [n for n, v in values.items() if not isinstance(v, str)]
    )
    bounded = _at_bound(problem, fit)
    found = {}
    for name, value in values.items():
        if isinstance(value, str):
            found[name] = {"value": value, "std": None, "unit": "", "at_bound": False}
            continue
        variance = spread.variance(jacobian[name])
        if law.effect in PERIODIC:
            variance = max(variance, spread.mean_square(lambda x, n=name: figures(x)[n], fit.x))
        if law.effect == LoadUnbalance.effect:
            size, angle = values["torque_amplitude_Nm"], values["angle_rad"]
            variance = variance_of(problem, spread, jacobian[name], name, size, angle)
        alike = [(v[name], gap) for v, gap in others if name in v]
        variance += between_laws(value, alike, TEMPERATURE)
        size = value - 1.0 if name in AT_ONE else value
        variance += (LAW_SPREAD * size) ** 2 + (law.form_spread * size) ** 2
        found[name] = {
            "value": float(value),
            "std": float(np.sqrt(variance)),
            "unit": law.figure_unit(name),
            "at_bound": bool(np.any(bounded[jacobian[name] != 0.0])),
        }
    return found


def _at_bound(problem: Problem, fit: Fit) -> NDArray:
    """Which unknowns (n,) ended at a bound; at 0 a value is absent, which is no bound."""
    low, high = problem.bounds(fit.hypothesis)
    return (fit.x >= high - 1e-9) | ((fit.x <= low + 1e-9) & (low != 0.0))


def shown(figures: Mapping[str, dict]) -> bool:
    """Whether a law's figures (of `figures_with_std`) tell it from none.

    Innovations of a law that is all but right are not white: a further one can gain hundreds of
    log-likelihood units there, by a size that the scatter between blocks and recordings does not
    tell from none.
    """
    sizes = [
        (abs(f["value"] - (1.0 if n in AT_ONE else 0.0)), f["std"] or 0.0)
        for n, f in figures.items()
        if not isinstance(f["value"], str)
    ]
    # a figure that equals none, without a deviation, depends on no value that was fitted
    return not sizes or any(size >= SHOWN_STD * std for size, std in sizes if size or std)


def sizes_shown(law: Law, first: int, x: NDArray, spread: Spread) -> bool:
    """Whether the numbers to which a law is proportional, taken together, differ from no effect.

    A figure may depend on other unknowns as well (the width of a loop on the yield of a slip that
    never slides), and the data may determine two such numbers only together (both efficiencies of
    a gear). The squared Mahalanobis distance is compared with the chi-squared quantile that
    corresponds to `SHOWN_STD` deviations of one number. False for an unbalance: only the variance
    of its figure includes how far the rig's mass may be off.

    Parameters
    ----------
    first : int
        Index of the law's first unknown in x (n,).
    """
    if law.effect == LoadUnbalance.effect:
        return False
    at, apart = [], []
    for j, u in enumerate((u for u in law.unknowns if u.scale > 0.0), start=first):
        none = 1.0 / u.scale if u.name in AT_ONE and not u.log else 0.0
        # a size that is fitted by its logarithm is never zero; a ratio can be one
        if u.name in AT_ONE or (u.name in FROM_ZERO and not u.log):
            at.append(j)
            apart.append(x[j] - none)
    limit = chdtri(len(at), erfc(SHOWN_STD / np.sqrt(2.0))) if at else np.inf
    return bool(at) and spread.squared_distance(at, np.array(apart)) >= limit


def _derivatives(
    figures: Callable[[NDArray], Figures], x: NDArray, names: Sequence[str]
) -> dict[str, NDArray]:
    """Derivatives (n,) of figures by the unknowns."""
    jacobian = {name: np.zeros(x.size) for name in names}
    for i in range(x.size):
        d = np.zeros(x.size)
        d[i] = STEP
        up, down = figures(x + d), figures(x - d)
        for name in names:
            jacobian[name][i] = (up[name] - down[name]) / (2.0 * STEP)
    return jacobian
