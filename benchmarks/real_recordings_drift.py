"""How far a machine's constant force wanders inside a record, and what a free run makes of it.

Where nothing pulls a machine back, a free run adds up every constant force: its error over a
record says how well the mean force of *that* record was known, whatever the laws. Whether another
record can be predicted to a millimetre is therefore decided by how much the mean force differs
from one part of the known record to the next.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import erf, sqrt

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
from rsea_core.effects.variant import TrialMachine
from rsea_core.identify.fitting.cross_validation import WindowedProblem, fit_windows
from rsea_core.identify.fitting.problem import (
    Hypothesis,
    PreparedRecording,
    Problem,
    predict_readings,
)
from rsea_core.identify.fitting.window_predictions import Cut, predict_many

PARTS = 4  # of a record: the cycles of EMPS
UNIT = 1e-3  # of the friction's level: force of the numerical slope
MEDIAN = 0.6745  # of the size of a normal number


@dataclass(frozen=True, kw_only=True)
class Wandering:
    """The constant force of a record by its parts, and the free run's sensitivity to it.

    Attributes
    ----------
    forces : (p,) array
        Constant force that each part shows beside the fitted laws, at the wheel [Nm].
    per_force : float
        Root mean square change of a free run over the record by one unit of constant force.
    """

    forces: NDArray
    per_force: float

    @property
    def spread(self) -> float:
        """Standard deviation of the parts' forces [Nm]."""
        return float(np.std(self.forces, ddof=1))

    @property
    def rms(self) -> float:
        """Error of a free run whose constant force is another part's, root mean square."""
        return self.spread * self.per_force

    @property
    def median(self) -> float:
        """The same, of every other record."""
        return MEDIAN * self.rms

    def chance(self, error: float) -> float:
        """Share of records whose free run is off by less than `error`, all else being perfect."""
        return erf(error / self.rms / sqrt(2.0))


def wandering(problem: Problem, piece: Cut, hypothesis: Hypothesis, x: NDArray) -> Wandering:
    """Constant forces of the parts of a record from its windows, by linear least squares.

    Parameters
    ----------
    piece : Cut
        The record, one channel.
    """
    prepared = piece.prepared
    plain = problem.trial_machine(prepared, hypothesis, x)
    size = UNIT * max(plain.fx[e.GEAR_FORWARD], 1e-6)
    pushed = _pushed(problem, prepared, hypothesis, x, size)
    runs = predict_many(piece, [plain, pushed], piece.overlapping)
    bounds = np.linspace(0, prepared.recording.rows, PARTS + 1)
    forces = []
    for low, high in pairwise(bounds):
        left, slope = [], []
        windows = zip(*runs, piece.overlapping, strict=True)
        for y, z, (first, last) in windows:
            if first >= low and last < high:
                left.append(prepared.measured[first : last + 1, 0] - y[:, 0])
                slope.append((z[:, 0] - y[:, 0]) / size)
        left, slope = np.concatenate(left), np.concatenate(slope)
        forces.append(float(slope @ left / (slope @ slope)))
    whole = predict_readings(prepared.replay, [plain, pushed], prepared.channels, prepared.where)[
        :, :, 0
    ]
    per_force = float(np.sqrt(np.mean((whole[1] - whole[0]) ** 2))) / size
    return Wandering(forces=np.array(forces), per_force=per_force)


def _pushed(
    problem: Problem, prepared: PreparedRecording, hypothesis: Hypothesis, x: NDArray, size: float
) -> TrialMachine:
    trial = problem.trial_machine(prepared, hypothesis, x)
    trial.put(e.GEAR_OFFSET, trial.fx[e.GEAR_OFFSET] - size)  # the offset acts against the motion
    return trial


def halves_held_out(problem: WindowedProblem, hypothesis: Hypothesis, x: NDArray) -> list[float]:
    """Errors of free runs over one half of a record with laws fitted to windows of the other.

    The half's run starts from the smoothed motion. First half fitted, then second half fitted.
    """
    ((file, piece),) = problem.cuts.items()
    rows = piece.prepared.recording.rows
    middle, found = rows // 2, []
    for fitted, held in (((0, middle), (middle, rows - 1)), ((middle, rows - 1), (0, middle))):
        w = piece.overlapping
        try:
            problem.used[file] = (w[:, 0] >= fitted[0]) & (w[:, 1] <= fitted[1])
            fit = fit_windows(problem, hypothesis, x)
        finally:
            problem.used[file] = np.ones(len(w), bool)
        run = predict_many(
            piece, [problem.trial_machine(piece.prepared, hypothesis, fit.x)], np.array([held])
        )
        error = run[0][0][:, 0] - piece.prepared.measured[held[0] : held[1] + 1, 0]
        found.append(float(np.sqrt(np.mean(error**2))))
    return found


def drift_rows(
    problem: WindowedProblem, hypothesis: Hypothesis, x: NDArray, goal_m: float
) -> list[tuple[str, str, str]]:
    """Lines of the page: what, our figure, what it is held against.

    Parameters
    ----------
    problem : WindowedProblem
        One record of a linear axis.
    goal_m : float
        Error of a free run whose chance is told [m].
    """
    piece = next(iter(problem.cuts.values()))
    found = wandering(problem, piece, hypothesis, x)
    forces = ", ".join(f"{force:+.2f}" for force in found.forces)
    halves = ", ".join(f"{1e3 * v:.2f}" for v in halves_held_out(problem, hypothesis, x))
    return [
        ("free run of each half of the first record, fitted to the other half",
         f"{halves} mm", ""),
        ("constant force of the first record by quarters, beside the laws",
         f"{forces} N (standard deviation {found.spread:.2f} N)",
         f"{goal_m / found.per_force:.3f} N of constant force are {1e3 * goal_m:.2f} mm"),
        ("free run of another record whose constant force is off by as much, laws perfect",
         f"{1e3 * found.rms:.1f} mm rms, median {1e3 * found.median:.1f} mm",
         f"below {1e3 * goal_m:.2f} mm: {100 * found.chance(goal_m):.0f} % of records"),
    ]  # fmt: skip
