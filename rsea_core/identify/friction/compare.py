"""Friction laws compared: fitted on one part of the rows, judged on the other.

Least squares, the few nonlinear parameters by bounded search outside (variable projection, Golub
& Pereyra 1973). Uncertainties are a sandwich over blocks of rows, because errors of neighbouring
rows go together (Cameron & Miller, J. Human Resources 50 (2015) 317). What the rows cannot tell
apart is said: condition of the scaled columns, pairs of parameters that are correlated, and
parameters that leave the fit as it is.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rsea_core.identify.friction.data import FrictionData, friction_data
from rsea_core.identify.friction.laws import UNITS, FrictionLaw, laws
from rsea_core.recordings.case import Case

SINGULAR = 1e-10  # of the largest singular value of the scaled columns: no information at all
CORRELATED = 0.95
INSENSITIVE = 2.0  # standard deviations: a smaller value cannot be distinguished from zero
STARTS = (0.3, 1.0, 3.0)  # of the nonlinear parameters, times their start


@dataclass(frozen=True, kw_only=True)
class FrictionParameter:
    """A fitted value; `std` is None where the rows cannot tell it from the others."""

    name: str
    value: float
    std: float | None
    unit: str
    at_bound: bool


@dataclass(frozen=True, kw_only=True)
class FrictionFit:
    """One law fitted and judged.

    Attributes
    ----------
    law, note : str
    parameters : tuple of FrictionParameter
    rms_fit_Nm, rms_held_out_Nm : float
        Of what is left over, motor side.
    gap_to_best_se : float
        Held-out mean square above the best law's, in standard errors over blocks.
    condition : float
        Of the columns scaled to one length; inf where one is a sum of others.
    correlated : tuple of (name, name, correlation)
    insensitive : tuple of str
    """

    law: str
    note: str
    parameters: tuple[FrictionParameter, ...]
    rms_fit_Nm: float
    rms_held_out_Nm: float
    gap_to_best_se: float
    condition: float
    correlated: tuple[tuple[str, str, float], ...]
    insensitive: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class FrictionComparison:
    """Every law on one case, best on held-out rows first."""

    case: str
    rows: int
    blocks: int
    split: str
    fits: tuple[FrictionFit, ...]

    @property
    def best(self) -> FrictionFit:
        """The law with the smallest held-out error."""
        return self.fits[0]


def compare_friction(case: Case) -> FrictionComparison:
    """Fit and judge every friction law on a case.

    Raises
    ------
    RecordingError
        If the case says nothing of friction.
    """
    data = friction_data(case)
    fitted = [_fit(law, data) for law in laws(data)]
    losses = [_block_losses(data, residual) for _, residual in fitted]
    best = int(np.argmin([loss.mean() for loss in losses]))
    fits = []
    for (fit, _), loss in zip(fitted, losses, strict=True):
        gap = loss - losses[best]
        error = gap.std(ddof=1) / np.sqrt(gap.size) if gap.size > 1 else 0.0
        fits.append((fit, 0.0 if error == 0.0 else float(gap.mean() / error)))
    ordered = sorted(fits, key=lambda pair: pair[0]["rms_held_out_Nm"])
    return FrictionComparison(
        case=case.name,
        rows=data.friction_Nm.size,
        blocks=np.unique(data.block).size,
        split=data.split,
        fits=tuple(FrictionFit(**fit, gap_to_best_se=gap) for fit, gap in ordered),
    )


def _block_losses(data: FrictionData, residual: NDArray) -> NDArray:
    """Held-out mean square of every block."""
    blocks, index = np.unique(data.block[data.held_out], return_inverse=True)
    sums = np.bincount(index, residual[data.held_out] ** 2, minlength=blocks.size)
    return sums / np.bincount(index, minlength=blocks.size)


def _fit(law: FrictionLaw, data: FrictionData) -> tuple[dict, NDArray]:
    used = ~data.held_out
    names = tuple(law.nonlinear)
    low = np.array([law.nonlinear[n][1] for n in names])
    high = np.array([law.nonlinear[n][2] for n in names])

    def columns(free: NDArray) -> tuple[tuple[str, ...], NDArray]:
        found = law.columns(data, dict(zip(names, free, strict=True)))
        return tuple(found), np.column_stack(tuple(found.values()))

    def project(free: NDArray) -> NDArray:
        _, matrix = columns(free)
        return data.friction_Nm[used] - matrix[used] @ _solve(matrix[used], data.friction_Nm[used])

    free = np.zeros(0)
    if names:
        start = np.array([law.nonlinear[n][0] for n in names])
        found = [
            least_squares(
                lambda u: project(np.exp(u)),
                np.log(np.clip(start * factor, 1.001 * low, high / 1.001)),
                bounds=(np.log(low), np.log(high)),
                x_scale=0.3,
            )
            for factor in STARTS
        ]
        free = np.exp(min(found, key=lambda each: each.cost).x)
    linear, matrix = columns(free)
    coefficients = _solve(matrix[used], data.friction_Nm[used])
    residual = data.friction_Nm - matrix @ coefficients
    derivatives = [_slope(columns, free, i, coefficients) for i in range(free.size)]
    jacobian = np.column_stack((matrix, *derivatives))[used]
    values = np.concatenate((coefficients, free))
    bound = np.concatenate(
        (np.zeros(len(linear), bool), (free < 1.01 * low) | (free > high / 1.01))
    )
    std, condition, correlation = _spread(jacobian, residual[used], data.block[used])
    every = (*linear, *names)
    return {
        "law": law.name,
        "note": law.note,
        "parameters": _parameters(every, values, std, bound),
        "rms_fit_Nm": float(np.sqrt(np.mean(residual[used] ** 2))),
        "rms_held_out_Nm": float(np.sqrt(np.mean(residual[data.held_out] ** 2))),
        "condition": condition,
        "correlated": tuple(
            (every[i], every[j], float(correlation[i, j]))
            for i in range(len(every))
            for j in range(i + 1, len(every))
            if abs(correlation[i, j]) > CORRELATED
        ),
        "insensitive": tuple(
            name
            for name, value, s in zip(every, values, std, strict=True)
            if not abs(value) > INSENSITIVE * s
        ),
    }, residual


def _parameters(
    names: tuple[str, ...], values: NDArray, std: NDArray, bound: NDArray
) -> tuple[FrictionParameter, ...]:
    return tuple(
        FrictionParameter(
            name=name,
            value=float(value),
            std=float(s) if np.isfinite(s) else None,
            unit=UNITS[name],
            at_bound=bool(b),
        )
        for name, value, s, b in zip(names, values, std, bound, strict=True)
    )


def _solve(matrix: NDArray, target: NDArray) -> NDArray:
    """Least squares on scaled columns; the smallest solution where they are dependent."""
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    return np.linalg.lstsq(matrix / scale, target, rcond=SINGULAR)[0] / scale


def _slope(columns, free: NDArray, index: int, coefficients: NDArray) -> NDArray:
    """How the law changes with a nonlinear parameter, central difference."""
    step = 1e-4 * free[index]
    moved = free.copy()
    moved[index] += step
    above = columns(moved)[1] @ coefficients
    moved[index] -= 2.0 * step
    return (above - columns(moved)[1] @ coefficients) / (2.0 * step)


def _spread(jacobian: NDArray, residual: NDArray, block: NDArray) -> tuple[NDArray, float, NDArray]:
    """Standard deviations by the sandwich over blocks, condition, correlation.

    A parameter that takes part in a combination without any information has an infinite one.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    _, singular, axes = np.linalg.svd(scaled, full_matrices=False)
    identifiable = singular > SINGULAR * singular[0]
    condition = float(singular[0] / singular[-1]) if identifiable.all() else float("inf")
    inverse = (axes[identifiable].T / singular[identifiable] ** 2) @ axes[identifiable]
    blocks, index = np.unique(block, return_inverse=True)
    scores = np.zeros((blocks.size, scaled.shape[1]))
    np.add.at(scores, index, scaled * residual[:, None])
    meat = scores.T @ scores * blocks.size / max(blocks.size - 1, 1)
    spread = inverse @ meat @ inverse
    unidentifiable = (axes[~identifiable] ** 2).sum(axis=0) > 1e-6
    std = np.sqrt(np.maximum(np.diag(spread), 0.0)) / scale
    std[unidentifiable] = np.inf
    shape = np.sqrt(np.maximum(np.diag(inverse), np.finfo(float).tiny))
    correlation = inverse / np.outer(shape, shape)
    for direction in axes[~identifiable]:  # without information: fully exchangeable
        along = np.abs(direction) > 1e-3
        correlation[np.ix_(along, along)] = np.sign(np.outer(direction, direction))[
            np.ix_(along, along)
        ]
    return std, condition, correlation
