"""Which sum of simple functions of the states an unknown torque is: sparse regression.

The regression is made on innovations, as the screening of named laws (`law_search/screening.py`):
each function is the response of the linear errors' machine, the free values are projected out, and
blocks of rows are left out. So noise, closed loops and biased parameters count as they do there.
Taken: the library of SINDy (Brunton, Proctor & Kutz 2016), the stability selection of Meinshausen
& Buhlmann (2010) over halves of the blocks, as ensemble-SINDy (Fasel et al. 2022) does with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
from rsea_core.effects.formula_torque import (
    ANGLE_FUNCTIONS,
    MOST_TERMS,
    SPEED_FUNCTIONS,
    FormulaTerm,
)
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.shape_search import responses

STATES = {"G": (k.TW, k.WW), "L": (k.TL, k.WL)}
SEEN = 0.02  # share of a function's response that the free values must leave
MORE = 0.08  # of the gain so far, that a further term must add
HALVES, STABLE = 40, 0.6  # resamples; share of them in which a term must be chosen
RIDGE = 1e-9
LIBRARY = tuple(
    FormulaTerm(angle=angle, speed=speed) for angle in ANGLE_FUNCTIONS for speed in SPEED_FUNCTIONS
)


@dataclass(frozen=True, kw_only=True)
class Selection:
    """Terms chosen at a port.

    Attributes
    ----------
    coefficients : tuple of float
        Nm, as the regression has them.
    shares : tuple of float
        Of the resamples that chose the term.
    held_out, deviation : float
        Gain on blocks left out, and its standard deviation, as of a `Candidate`.
    """

    port: str
    usual_speed_rad_per_s: float
    terms: tuple[FormulaTerm, ...]
    coefficients: tuple[float, ...]
    shares: tuple[float, ...]
    held_out: float
    deviation: float


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """Normal equations of all functions in each block: (b, m, m) and (b, m)."""

    XX: NDArray
    xy: NDArray

    def solved(self, chosen: Sequence[int], rows: NDArray) -> NDArray:
        """Coefficients of the chosen functions from some blocks."""
        at = np.ix_(chosen, chosen)
        A, b = self.XX[rows].sum(axis=0)[at], self.xy[rows].sum(axis=0)[list(chosen)]
        return np.linalg.solve(A + RIDGE * np.trace(A) * np.eye(len(A)), b)

    def gain(self, chosen: Sequence[int], rows: NDArray) -> float:
        """Fall of the cost of some blocks by the chosen functions."""
        a = self.solved(chosen, rows)
        return 0.5 * float(a @ self.xy[rows].sum(axis=0)[list(chosen)])

    def held_out(self, chosen: Sequence[int]) -> tuple[float, float]:
        """Gain of each block with coefficients from the others, summed; its deviation."""
        every, falls = np.arange(len(self.xy)), []
        for b in every:
            a = self.solved(chosen, every[every != b])
            xx = self.XX[b][np.ix_(chosen, chosen)]
            falls.append(float(a @ self.xy[b][list(chosen)] - 0.5 * a @ xx @ a))
        return float(np.sum(falls)), float(np.std(falls) * np.sqrt(len(falls)))

    def chosen(self, allowed: Sequence[int], rows: NDArray) -> list[int]:
        """Forward selection: the function that lowers the cost most enters, while it pays."""
        found: list[int] = []
        gain = 0.0
        while len(found) < MOST_TERMS:
            trials = [(self.gain([*found, j], rows), j) for j in allowed if j not in found]
            best, j = max(trials, default=(0.0, -1))
            if j < 0 or best - gain < max(MORE * best, 2.0):
                break
            found, gain = [*found, j], best
        return found


def blocks_of(projection: Projection, port: str) -> tuple[Blocks, list[int], float]:
    """Normal equations of the library at a port, the functions that are seen, the usual speed."""
    tracks = projection.estimator.tracks
    angle, speed = STATES[port]
    usual = float(np.sqrt(np.mean(np.concatenate([t.motion[:, speed] for t in tracks]) ** 2)))
    changes = []
    for t in tracks:
        theta, omega = t.motion[:, angle], t.motion[:, speed]
        values = np.array([term.values(theta, omega, usual) for term in LIBRARY])
        changes.append(responses(t, port, values))
    return *blocks_of_changes(projection, changes), usual


def blocks_of_changes(
    projection: Projection, changes: Sequence[NDArray]
) -> tuple[Blocks, list[int]]:
    """Normal equations of functions, and those that are seen.

    Parameters
    ----------
    changes : sequence of (m, blocks, p) arrays
        Responses to the m functions of each recording.
    """
    C = projection.columns(changes)
    B = np.linalg.solve(projection.L, projection.J @ C.T)
    free = C - (projection.J.T @ np.linalg.solve(projection.L.T, B)).T
    whole, left = np.linalg.norm(C, axis=1), np.linalg.norm(free, axis=1)
    seen = np.all(np.isfinite(C), axis=1) & (left > SEEN * np.maximum(whole, 1e-300))
    free[~seen] = 0.0
    count = projection.blocks[-1] + 1
    XX, xy = np.zeros((count, len(C), len(C))), np.zeros((count, len(C)))
    for b in range(count):
        rows = free[:, projection.blocks == b]
        XX[b], xy[b] = rows @ rows.T, rows @ projection.left[projection.blocks == b]
    return Blocks(XX=XX, xy=xy), [int(j) for j in np.flatnonzero(seen)]


def select(projection: Projection, port: str, *, seed: int = 0) -> Selection | None:
    """The terms that explain most of what is left at a port, as far as they are stable.

    Returns
    -------
    Selection or None
        None where nothing enters, or no term is chosen in most halves of the rows.
    """
    blocks, seen, usual = blocks_of(projection, port)
    if usual <= 0.0 or not seen:
        return None
    every = np.arange(len(blocks.xy))
    whole = blocks.chosen(seen, every)
    rng, counts = np.random.default_rng(seed), dict.fromkeys(whole, 0)
    for _ in range(HALVES):
        half = rng.choice(every, len(every) // 2, replace=False)
        for j in blocks.chosen(seen, half):
            if j in counts:
                counts[j] += 1
    kept = [j for j in whole if counts[j] >= STABLE * HALVES]
    if not kept:
        return None
    held_out, deviation = blocks.held_out(kept)
    return Selection(
        port=port, usual_speed_rad_per_s=usual, terms=tuple(LIBRARY[j] for j in kept),
        coefficients=tuple(float(v) for v in blocks.solved(kept, every)),
        shares=tuple(counts[j] / HALVES for j in kept), held_out=held_out, deviation=deviation,
    )  # fmt: skip
