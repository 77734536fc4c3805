"""Where in time an external torque on the load could have acted: a matched filter over intervals.

The innovations of a recording are regressed on short pulses of load torque side by side; sums
over any interval of pulses then follow from cumulative sums, so that every start and end is
judged (generalised likelihood ratio over onset and duration).
"""

import numpy as np

from rsea_core.effects.load_disturbance import LONGEST, disturbance
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.least_squares import Fit, Fitter, robust
from rsea_core.identify.fitting.periodic_regressors import torque_columns

CELL_s = 0.08
TWO = 2  # proposals of each recording


def disturbances(fitter: Fitter, fit: Fit, load_torque_Nm: float) -> list[Law]:
    """Proposed pulses of load torque in each recording whose load can move."""
    problem = fitter.problem
    stiffness = problem.case.rig.spring_stiffness_Nm_per_rad or 0.0
    found = problem.innovations(fit.hypothesis, fit.x[None])
    laws = []
    for prepared, e in zip(problem.fitted, found, strict=True):
        if prepared.where.kind in ("locked", "imposed"):
            continue
        r = prepared.recording
        length = float(r.time_s[-1] - r.time_s[0])
        cells = max(int(length / CELL_s), 4)
        width = length / cells
        at = np.minimum(((r.time_s - r.time_s[0]) / width).astype(int), cells - 1)
        signals = (at[None] == np.arange(cells)[:, None]).astype(float)
        columns = torque_columns(prepared, stiffness, signals, "L").reshape(cells, -1)
        target = e[0].reshape(-1)
        root = np.sqrt(robust(target, fitter.far)[1]) if np.isfinite(fitter.far) else 1.0
        columns, target = columns * root, target * root
        h, G = columns @ target, columns @ columns.T
        H = np.concatenate(([0.0], np.cumsum(h)))
        S = np.zeros((cells + 1, cells + 1))
        S[1:, 1:] = G.cumsum(0).cumsum(1)
        taken = np.zeros(cells, bool)
        for _ in range(TWO):
            best = (0.0, 0, 0, 0.0)
            for a in np.flatnonzero(~taken):
                last = min(cells, a + int(LONGEST * cells))
                free = int(np.argmax(np.append(taken[a:last], True)))
                b = np.arange(a + 1, a + free + 1)
                energy = S[b, b] - S[a, b] - S[b, a] + S[a, a]
                inner = H[b] - H[a]
                drop = np.divide(inner**2, energy, out=np.zeros_like(inner), where=energy > 0.0)
                most = int(np.argmax(drop))
                if drop[most] > best[0]:
                    best = (drop[most], int(a), int(b[most]), inner[most] / energy[most])
            if best[0] <= 0.0:
                break
            _, a, b, peak = best
            taken[max(a - 1, 0) : b + 1] = True
            start = (r.time_s[0] + a * width, (b - a) * width, peak)
            law = disturbance(
                r.file, prepared.where.index, start, load_torque_Nm, float(r.time_s[-1])
            )
            laws.append(law)
    return laws
