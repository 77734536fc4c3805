"""How well the fitted values are known: a sandwich over stretches of the recordings.

Innovations of a law that is nearly right are dependent, so the inverse of the Hessian alone is
far too sure. The middle of the sandwich is the scatter of the gradients of whole stretches.
(Huber, 5th Berkeley Symposium (1967); White, Econometrica 50 (1982) 1.)
"""

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fit import STEP, Fit, Fitter, robust

STRETCH_s = 0.5


def covariance(fitter: Fitter, fit: Fit) -> tuple[NDArray, NDArray]:
    """Covariance (n, n) of the unknowns and the Hessian of innovations (n, n), no priors."""
    problem, x = fitter.problem, fit.x
    _low, high = problem.bounds(fit.hypothesis)
    steps = np.where(x + STEP > high, -STEP, STEP)
    _, _, found = fitter.evaluate(fit.hypothesis, np.vstack([x, *(x + np.diag(steps))]))
    n = x.size
    hessian, middle = np.zeros((n, n)), np.zeros((n, n))
    for bench, e in zip(problem.fitted, found, strict=True):
        blocks = e.shape[1]
        J = (e[1:] - e[0]) / steps[:, None, None]
        J[~np.all(np.isfinite(J), axis=(1, 2))] = 0.0
        w = np.ones_like(e[0]) if np.isinf(fitter.far) else robust(e[0], fitter.far)[1]
        hessian += np.einsum("itc,tc,jtc->ij", J, w, J, optimize=True)
        slope = np.einsum("itc,tc->it", J, w * e[0], optimize=True)
        row_s = bench.recording.sample_time_s * bench.whitener.block
        length = max(1, round(STRETCH_s / row_s))
        edges = np.arange(0, blocks, length)
        sums = np.add.reduceat(slope, edges, axis=1)
        middle += sums @ sums.T
    _, weight = problem.prior(fit.hypothesis)
    whole = hessian + np.diag(weight**2 + 1e-9)
    inverse = np.linalg.inv(whole)
    spread = np.maximum(fit.power.mean(), 1.0)
    sandwich = inverse @ (middle + np.diag(weight**2)) @ inverse
    floor = inverse * spread
    # a fit has taken part of the scatter away; never less than white innovations of that power
    scale = np.sqrt(np.maximum(np.diag(floor) / np.maximum(np.diag(sandwich), 1e-300), 1.0))
    return sandwich * np.outer(scale, scale), hessian
