"""Sparse regression, a Gaussian process and a fixed friction family on the lacking torques."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dftfs.proof.baselines.ports import Lacking
from dftfs.proof.baselines.simulator import NAMES, PORTS

THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
RIDGE = 1e-3
CENTRES = 150
LENGTHS = (0.5, 1.0, 2.0)
NOISES = (0.03, 0.1, 0.3)
# Friction at the gear output, from the simplest law to all of it: the family of the Better Actuator
# Models (Duclusaud et al. 2024): Coulomb-viscous, Stribeck, load-dependent, both, direction,
# quadratic. "deflection" lets each law correct what the refit of the constants took for stiffness.
BASE = ("deflection", "output-sign", "output-speed")
FAMILY = {
    "M1": BASE,
    "M2": (*BASE, "output-stribeck-0.15"),
    "M3": (*BASE, "load-sign"),
    "M4": (*BASE, "load-sign", "output-stribeck-0.15", "load-stribeck"),
    "M5": (*BASE, "load-sign", "output-stribeck-0.15", "direction"),
    "M6": (*BASE, "load-sign", "output-stribeck-0.15", "load-stribeck", "output-square"),
}


@dataclass(frozen=True, kw_only=True)
class Learned:
    """Weights at the ports, over the dictionary or over kernel centres."""

    name: str
    weights: np.ndarray
    centres: np.ndarray | None = None
    length: float = 1.0


def least_squares(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    scale = np.maximum(np.sqrt(np.mean(a**2, axis=0)), 1e-9)
    u = a / scale
    normal = u.T @ u + RIDGE * b.size * np.eye(u.shape[1])
    return np.linalg.solve(normal, u.T @ b) / scale


def sparse(data: Lacking, threshold: float) -> Learned:
    """Sequentially thresholded least squares (Brunton et al. 2016), port by port.

    ``threshold`` is the root mean square that a feature must contribute, over that of the target.
    """
    features = data.features()
    weights = np.zeros((PORTS, features.shape[1]))
    for port in range(PORTS):
        known = np.isfinite(data.torques[:, port])
        if not known.any():
            continue
        a, b = features[known], data.torques[known, port]
        size = np.sqrt(np.mean(a**2, axis=0))
        kept = size > 1e-6
        for _ in range(10):
            if not kept.any():
                break
            w = np.zeros(kept.size)
            w[kept] = least_squares(a[:, kept], b)
            small = np.abs(w) * size < threshold * np.sqrt(np.mean(b**2))
            if not (small & kept).any():
                break
            kept &= ~small
        weights[port, kept] = least_squares(a[:, kept], b) if kept.any() else 0.0
    return Learned(name=f"threshold {threshold:g}", weights=weights)


def gaussian_process(data: Lacking, rng: np.random.Generator) -> Learned:
    """Zero-mean process with a squared-exponential kernel of deflection, speeds and angle.

    Length and noise by the marginal likelihood at the gear output, which is known everywhere, on a
    random subset (Rasmussen and Williams 2006, algorithm 2.1); each port is then solved on the
    samples where it is known, scaled to unit variance.
    """
    pick = rng.choice(data.states.shape[0], min(CENTRES, data.states.shape[0]), replace=False)
    x, torques = data.states[pick], data.torques[pick]
    apart = ((x[:, None] - x[None]) ** 2).sum(-1)
    y = torques[:, 0] / torques[:, 0].std()
    best: tuple[float, float, float] | None = None
    for length in LENGTHS:
        kernel = np.exp(-0.5 * apart / length**2)
        for noise in NOISES:
            factor = cho_factor(kernel + noise**2 * np.eye(len(x)), lower=True)
            likelihood = -0.5 * float(y @ cho_solve(factor, y))
            likelihood -= float(np.log(np.diag(factor[0])).sum())
            if best is None or likelihood > best[0]:
                best = (likelihood, length, noise)
    _, length, noise = best
    kernel = np.exp(-0.5 * apart / length**2)
    weights = np.zeros((PORTS, len(x)))
    for port in range(PORTS):
        known = np.flatnonzero(np.isfinite(torques[:, port]))
        spread = torques[known, port].std() if known.size else 0.0
        if spread > 0.0:
            inside = kernel[np.ix_(known, known)] + noise**2 * np.eye(known.size)
            solved = cho_solve(cho_factor(inside, lower=True), torques[known, port] / spread)
            weights[port, known] = spread * solved
    return Learned(name=f"length {length:g}", weights=weights, centres=x, length=length)


def friction(data: Lacking, law: str) -> Learned:
    """One law of the family at the gear output; coefficients by least squares."""
    columns = [NAMES.index(n) for n in FAMILY[law]]
    a, b = data.features()[:, columns], data.torques[:, 0]
    weights = np.zeros((PORTS, len(NAMES)))
    weights[0, columns] = least_squares(a, b)
    return Learned(name=law, weights=weights)
