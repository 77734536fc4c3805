"""Least squares on sums over rows, for thousands of choices of columns of the same rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Sums:
    """Sums over rows of columns x and torque y: all that least squares needs."""

    n: int
    x: NDArray
    y: float
    xx: NDArray
    xy: NDArray
    yy: float

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(
            n=self.n + other.n, x=self.x + other.x, y=self.y + other.y, xx=self.xx + other.xx,
            xy=self.xy + other.xy, yy=self.yy + other.yy,
        )  # fmt: skip


def rest_of(folds: Sequence[Sums], without: int | None) -> Sums:
    """The sums of a recording, without one of its parts."""
    kept = [f for j, f in enumerate(folds) if j != without]
    total = kept[0]
    for f in kept[1:]:
        total = total + f
    return total


def least_squares(
    gram: NDArray, right: NDArray, whole: float, choices: NDArray
) -> tuple[NDArray, NDArray]:
    """Coefficients and squared errors of many choices of columns, (choices, columns)."""
    if choices.shape[1] == 0:
        return np.zeros((len(choices), 0)), np.full(len(choices), whole)
    grams = gram[choices[:, :, None], choices[:, None, :]]
    rights = right[choices]
    solved = np.linalg.solve(grams + ridge(grams), rights[..., None])[..., 0]
    squares = whole - 2.0 * np.sum(solved * rights, axis=1)
    squares += np.einsum("ki,kij,kj->k", solved, grams, solved)
    return solved, np.maximum(squares, 0.0)


def ridge(gram: NDArray) -> NDArray:
    """What keeps a Gram matrix regular where two columns are alike."""
    diagonal = np.maximum(np.diagonal(gram, axis1=-2, axis2=-1), 1e-300)
    return 1e-10 * diagonal[..., None] * np.eye(gram.shape[-1])


def error_of(half: Sums, kept: Sums, choice: NDArray, solved: NDArray) -> float:
    """Squared error on a part that was left out, at the offset that the rest shows."""
    offset = (kept.y - solved @ kept.x[choice]) / kept.n
    total = half.y - solved @ half.x[choice]
    gram = half.xx[np.ix_(choice, choice)]
    squares = half.yy - 2.0 * solved @ half.xy[choice] + solved @ gram @ solved
    return float(max(squares - 2.0 * offset * total + half.n * offset**2, 0.0))
