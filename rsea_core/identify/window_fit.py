"""A fit of the multistep search as reports read it, and the covariances of its values."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.candidates.rig_parameters import Nominal
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.covariance import Spread
from rsea_core.identify.law_search.found import Step
from rsea_core.identify.multistep.criteria import (
    RIVAL_SCALE,
    RIVAL_SHARE,
    UNBELIEVED,
    WITHIN_ROW,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator, stretches_of
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.kalman_filter import huber_squares

DAMPING, INDUCTANCE = "viscous_Nms_per_rad", "terminal_inductance_H"
RESISTANCE = "terminal_resistance_ohm"


@dataclass(frozen=True, kw_only=True)
class FoundFit:
    """A fitted hypothesis as reports read it.

    Attributes
    ----------
    msni : (benches,) array
        Mean square innovation of each fitted recording.
    """

    hypothesis: Hypothesis
    x: NDArray
    msni: NDArray
    prior_cost: float = 0.0


@dataclass
class FoundSearch:
    """The part of a search that reports read."""

    parameters: FoundFit
    candidates: Sequence = ()
    short: Sequence = ()
    fits: dict = field(default_factory=dict)


def fit_of(estimator: Estimator, fit: Estimate) -> FoundFit:
    """An estimate with what it leaves of each recording."""
    found = estimator.innovations([(fit.hypothesis, fit.x)])
    msni = np.array([float(np.mean(huber_squares(e))) for e in found])
    return FoundFit(hypothesis=fit.hypothesis, x=fit.x, msni=msni)


def spread_of(estimator: Estimator, fit: FoundFit) -> Spread:
    """Covariances of the unknowns: white innovations, and the scatter of the blocks' gradients."""
    level, columns = estimator.jacobian(fit.hypothesis, fit.x)
    _, weight = estimator.problem.prior(fit.hypothesis)
    n = fit.x.size
    hessian, middle = np.diag(weight**2), np.diag(weight**2)
    for block, e, J in zip(stretches_of(estimator.tracks), level, columns, strict=True):
        flat = J.reshape(n, -1)
        hessian = hessian + flat @ flat.T
        gradient = np.einsum("itc,tc->it", J, e)
        sums = np.array([np.bincount(block, g) for g in gradient])
        middle = middle + sums @ sums.T
    inverse = np.linalg.inv(hessian + 1e-9 * np.eye(n))
    return Spread(sources=(inverse, inverse @ middle @ inverse))


def strained_value(problem: MultistepProblem, fit: FoundFit) -> Nominal | None:
    """The stated value from which a fit went furthest (a damping: upwards), if too far.

    An inductance that changes the winding's time constant by a small share of a row does not
    count: a command that moves within rows looks the same.
    """
    moved = np.abs(fit.x[: len(problem.nominals)]) * problem.stated
    nominal = problem.values(fit.hypothesis, fit.x)[0]
    row = min(e.recording.sample_time_s for e in problem.fitted)
    for j, p in enumerate(problem.nominals):
        if p.key.endswith(DAMPING) and fit.x[j] < 0.0:
            moved[j] = 0.0
        if p.key == INDUCTANCE:
            change = abs(nominal[p.key] - getattr(problem.case.rig, p.key))
            if change < WITHIN_ROW * row * (nominal.get(RESISTANCE) or np.inf):
                moved[j] = 0.0
    return problem.nominals[int(np.argmax(moved))] if np.any(moved >= UNBELIEVED) else None


def rungs_of(steps: Sequence[Step], parameters: FoundFit, fit: FoundFit) -> list[dict]:
    """What was considered, by gain over parameters alone."""
    found = [_rung("parameters only", "", parameters.msni, 0.0)]
    gain = 0.0
    names: list[str] = []
    for step in steps:
        for law, other in step.rivals:
            name = " + ".join([*names, law.effect])
            found.append(_rung(name, law.subsystem, fit.msni, gain + other, law.law))
        gain += step.gain
        names.append(step.law.effect)
        name, place = " + ".join(names), step.law.subsystem
        found.append(_rung(name, place, fit.msni, gain, step.law.law))
    chosen = " + ".join(names) or "parameters only"
    for rung in found:
        rung["chosen"] = rung["name"] == chosen and rung["gain"] == gain
    return sorted(found, key=lambda rung: (not rung["chosen"], -rung["gain"]))


def _rung(name: str, place: str, power: NDArray, gain: float, note: str = "") -> dict:
    return {
        "name": name, "subsystem": place, "error": float(np.sqrt(np.max(power))), "gain": gain,
        "se": RIVAL_SCALE + RIVAL_SHARE * abs(gain), "chosen": False, "note": note,
    }  # fmt: skip
