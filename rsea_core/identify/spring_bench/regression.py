"""Torque of a spring on its bench as a sum of columns: what each explanation adds, and the fit.

    torque = s H(d)                 H the design's curve
           + k stop(d; y)           slip: an elastic part that gives way beyond a reach y
           + c |H(d)| sgn(d')       contact friction between coils, from a contact's onset on
           + c (H - H low-passed)   lag: torque and deflection read at different times (c < 0),
                                    or a spring that relaxes (c > 0: a Maxwell branch of H)
           + c d^3                  hardening
           + c d^2                  asymmetry: K differs between the two directions
           + c (d - o)+             coils that touch beyond an onset o, in one direction or both

The columns of all explanations are made once; any choice of them is then a small least-squares
problem on sums over rows, every recording with an offset of its own. An explanation is judged by
how well it predicts quarters of recordings that took no part in its fit. Where a recording starts
unloaded its deflection counts from there: encoders are zeroed anywhere, and a clamp that has
slipped moves their zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.registry import SpringCurve
from rsea_core.identify.spring_bench.history_columns import fading, stop
from rsea_core.identify.spring_bench.loops import BenchRows
from rsea_core.identify.spring_bench.normal_equations import (
    Sums,
    error_of,
    least_squares,
    rest_of,
    ridge,
)
from rsea_core.machine.spring_table import SpringTable, spring_torque_Nm

SLIP, CONTACT, LAG, HARDENING, ASYMMETRY, KNEE, KNEES = (
    "slip", "contact friction", "lag", "hardening", "asymmetry", "knee", "knee both ways",
)  # fmt: skip
PIECES = (LAG, HARDENING, ASYMMETRY, KNEE, KNEES, SLIP, CONTACT)
ONSETS = np.linspace(0.15, 0.9, 16)  # of the largest deflection in a direction
REACHES = np.geomspace(0.01, 1.2, 48)  # of the deflection's range
COARSE = 4  # of these for the second slider
TIMES = np.geomspace(1.0, 1000.0, 10)  # of the time between rows
FOLDS = 4  # of a recording, each in turn predicted from the rest
ONSET = ("onset_rad", (np.geomspace(0.95, 1.05, 9), np.geomspace(0.99, 1.01, 9)))
FINE = {  # factors on a value that was found, and on the best of these
    KNEE: ONSET, KNEES: ONSET,
    SLIP: ("reach_rad", (np.geomspace(0.9, 1.1, 9), np.geomspace(0.99, 1.01, 5))),
    LAG: ("time_s", (np.geomspace(0.6, 1.7, 9), np.geomspace(0.9, 1.1, 9),
                     np.geomspace(0.98, 1.02, 9))),
}  # fmt: skip
BLOCKS = 6  # of a recording, for standard errors
UNLOADED = 0.05  # of the torque's range: less than this at the start is no load
FIRST = 3  # rows that may show where a recording starts; a ramp leaves it at once
NEEDED_SHARE = 0.02  # of a recording's rows that show its unloaded point
BOTH_DIRECTIONS = 0.3  # of the larger deflection: less the other way shows no contact there
REVERSAL = 0.01  # of the range: the turn over which contact friction changes its direction


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of the fit.

    Attributes
    ----------
    piece : str
        The explanation that it belongs to; "" for the design's curve.
    parameters : dict of str to float
        Inner values that the column was made with.
    """

    piece: str
    parameters: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A choice of explanations, fitted.

    Attributes
    ----------
    pieces : tuple of str
        Sorted; slip may be there twice.
    columns : tuple of int
        Of the bench's columns, the design's curve first.
    coefficients : (c,) array
    left_out : (recordings, FOLDS) array
        Squared torque error of each quarter when it took no part.
    in_sample : float
        Squared torque error; infinite where a slider would have to push.
    replicates : tuple of (columns, coefficients)
        The fits without each quarter, for the jackknife.
    """

    pieces: tuple[str, ...]
    columns: tuple[int, ...]
    coefficients: NDArray
    left_out: NDArray
    in_sample: float
    replicates: tuple[tuple[tuple[int, ...], NDArray], ...]

    @property
    def error(self) -> float:
        """Squared torque error on quarters that took no part."""
        return float(self.left_out.sum()) if np.isfinite(self.in_sample) else np.inf


class Bench:
    """The columns of recordings and their sums.

    Parameters
    ----------
    rows : sequence of BenchRows
        What is fitted.
    table : SpringTable
        The design's law.
    design : SpringCurve or None
        Its onset of contact.
    timed : bool
        False where time is only an index: no explanation may then use it.
    finer : tuple of Column
        More reaches of sliders and times of a lag to try.
    """

    def __init__(
        self,
        rows: Sequence[BenchRows],
        table: SpringTable,
        design: SpringCurve | None,
        *,
        timed: bool,
        finer: Sequence[Column] = (),
    ):
        self.rows, self.table, self.design, self.timed = tuple(rows), table, design, timed
        self.extra = tuple(finer)
        self.reach = max(float(np.ptp(r.deflection_rad)) for r in rows)
        self.onset = 0.0
        if design is not None and any(design.contact_onset_rad):
            self.onset = min(abs(v) for v in design.contact_onset_rad if v is not None)
        step = float(np.median(np.concatenate([np.diff(r.time_s) for r in rows])))
        longest = max(float(np.ptp(r.time_s)) for r in rows)
        self.columns = (
            Column(piece="", parameters={}),
            *(Column(piece=SLIP, parameters={"reach_rad": float(y * self.reach)}) for y in REACHES),
            Column(piece=CONTACT, parameters={"onset_rad": self.onset}),
            Column(piece=HARDENING, parameters={}),
            Column(piece=ASYMMETRY, parameters={}),
            *self._knees(),
            *(
                Column(piece=LAG, parameters={"time_s": t * step})
                for t in (TIMES if timed else ())
                if t * step < 0.25 * longest
            ),
            *self.extra,
        )
        own = self.columns[: len(self.columns) - len(self.extra)]
        self.coarse = sum(c.piece == SLIP for c in own)
        self.sums = [self._folds(r) for r in self.rows]
        self.spread = sum(float(np.sum((r.torque_Nm - r.torque_Nm.mean()) ** 2)) for r in rows)

    def _knees(self) -> list[Column]:
        """Onsets of contact, those of one direction with its sign."""
        deflections = [r.deflection_rad - zero_of(r) for r in self.rows]
        ends = [max(float((s * d).max()) for d in deflections) for s in (1.0, -1.0)]
        single = [s * o * end for s, end in zip((1.0, -1.0), ends, strict=True) for o in ONSETS
                   if end > BOTH_DIRECTIONS * max(ends)]  # fmt: skip
        both = [o * min(ends) for o in ONSETS if min(ends) > BOTH_DIRECTIONS * max(ends)]
        return [
            Column(piece=piece, parameters={"onset_rad": float(o)})
            for piece, onsets in ((KNEE, single), (KNEES, both)) for o in onsets
        ]  # fmt: skip

    def matrix(self, r: BenchRows, columns: Sequence[int]) -> NDArray:
        """(rows, columns) array of a recording."""
        return np.column_stack([self._column(r, self.columns[j]) for j in columns])

    def _column(self, r: BenchRows, column: Column) -> NDArray:
        deflection = r.deflection_rad - zero_of(r)
        if column.piece == SLIP:
            return stop(deflection, column.parameters["reach_rad"])
        if column.piece == HARDENING:
            return deflection**3
        if column.piece == ASYMMETRY:
            return deflection**2
        if column.piece in (KNEE, KNEES):
            return beyond(deflection, column)
        elastic = spring_torque_Nm(self.table, deflection)
        if column.piece == LAG:
            return fading(elastic, r.time_s, column.parameters["time_s"])
        if column.piece == CONTACT:
            direction = stop(deflection, REVERSAL * self.reach) / (REVERSAL * self.reach)
            return np.abs(elastic) * (np.abs(deflection) > self.onset) * direction
        return elastic

    def floor(self, r: BenchRows) -> float:
        """Standard deviation of the torque's noise and of what the deflection's makes of it."""
        blur = self.stiffness * apparent_noise(r.deflection_rad)
        return float(np.hypot(apparent_noise(r.torque_Nm), blur))

    def _folds(self, r: BenchRows) -> tuple[Sums, ...]:
        X = self.matrix(r, range(len(self.columns)))
        found = []
        for part in np.array_split(np.arange(r.torque_Nm.size), FOLDS):
            x, y = X[part], r.torque_Nm[part]
            found.append(
                Sums(
                    n=y.size, x=x.sum(axis=0), y=float(y.sum()), xx=x.T @ x, xy=x.T @ y,
                    yy=float(y @ y),
                )
            )  # fmt: skip
        return tuple(found)

    def refined(self, fit: Fit) -> tuple["Bench", Fit]:
        """The same recordings with finer reaches and times about those of a fit, and the fit.

        Columns that were there keep their places.
        """
        bench = self
        for stage in range(max(len(stages) for _, stages in FINE.values())):
            found = [bench.columns[j] for j in fit.columns if bench.columns[j].piece in FINE]
            more = tuple(near for column in found for near in _near(column, stage))
            bench = Bench(
                self.rows, self.table, self.design, timed=self.timed, finer=(*bench.extra, *more)
            )
            fit = bench.fit(fit.pieces)
        return bench, fit

    def choices(self, pieces: Sequence[str]) -> NDArray:
        """(choices, columns) array: every way to take one column for each explanation."""
        own = {
            piece: [j for j, c in enumerate(self.columns) if c.piece == piece]
            for piece in set(pieces)
        }
        parts = [own[p] for p in pieces if p != SLIP]
        sliders = pieces.count(SLIP)
        if sliders:
            few = own[SLIP]
            if sliders > 1:  # of the common grid a part, and what was refined
                few = [*few[: self.coarse : COARSE], *few[self.coarse :]]
            parts.append(list(combinations(few, sliders)))
        found = []
        for choice in product(*parts):
            flat = [0]
            for part in choice:
                flat += part if isinstance(part, tuple) else (part,)
            found.append(flat)
        return np.array(found, dtype=int)

    def can(self, piece: str) -> bool:
        """Whether these recordings have columns of an explanation."""
        return any(c.piece == piece for c in self.columns)

    def fit(self, pieces: Sequence[str]) -> Fit:
        """Fit a choice of explanations, and predict each quarter of each recording without it."""
        choices = self.choices(pieces)
        solved, squares = self._solve(choices, None)
        best = int(np.argmin(squares))
        left_out, replicates = np.zeros((len(self.rows), FOLDS)), []
        for k, fold in product(range(len(self.rows)), range(FOLDS)):
            trials, errors = self._solve(choices, (k, fold))
            j = int(np.argmin(errors))
            replicates.append((tuple(int(i) for i in choices[j]), trials[j]))
            left_out[k, fold] = error_of(
                self.sums[k][fold], rest_of(self.sums[k], fold), choices[j], trials[j]
            )
        return Fit(
            pieces=tuple(pieces), columns=tuple(int(j) for j in choices[best]),
            coefficients=solved[best], left_out=left_out, in_sample=float(squares[best]),
            replicates=tuple(replicates),
        )  # fmt: skip

    def _solve(self, choices: NDArray, left_out: tuple[int, int] | None) -> tuple[NDArray, NDArray]:
        """Coefficients and squared errors of all choices; infinite where a column must not be.

        A slider may not push, and a contact may not soften the spring. Beside sliders the rest of
        the spring may vanish, but not push either.
        """
        n = len(self.columns)
        gram, right, whole = np.zeros((n, n)), np.zeros(n), 0.0
        for k, folds in enumerate(self.sums):
            kept = rest_of(
                folds, left_out[1] if left_out is not None and left_out[0] == k else None
            )
            gram += kept.xx - np.outer(kept.x, kept.x) / kept.n
            right += kept.xy - kept.x * kept.y / kept.n
            whole += kept.yy - kept.y**2 / kept.n
        slides_of = np.array([c.piece == SLIP for c in self.columns])[choices]
        slides = slides_of.any(axis=1)
        solved, squares = least_squares(gram, right, whole, choices)
        alone = slides & (solved[:, 0] < 0.0)
        if alone.any():
            without, left = least_squares(gram, right, whole, choices[alone][:, 1:])
            solved[alone] = np.column_stack([np.zeros(alone.sum()), without])
            squares[alone] = left
        stiffens_of = np.array([c.piece in (SLIP, KNEE, KNEES) for c in self.columns])[choices]
        negative = np.any(stiffens_of & (solved < 0.0), axis=1)
        return solved, np.where(negative, np.inf, squares)

    # ---- what a fit says

    def predicted(self, r: BenchRows, fit: Fit) -> NDArray:
        """Torque of a recording up to its offset."""
        return self.matrix(r, fit.columns) @ fit.coefficients

    def alone(self, fit: Fit) -> list[tuple[float, float, float]]:
        """Of each recording: the factor on a fit that suits it best, squared error with and
        without it."""
        columns, found = np.ix_(fit.columns, fit.columns), []
        own = np.array(fit.columns)
        for folds in self.sums:
            whole = rest_of(folds, None)
            gram = (whole.xx - np.outer(whole.x, whole.x) / whole.n)[columns]
            right = (whole.xy - whole.x * whole.y / whole.n)[own]
            squares = whole.yy - whole.y**2 / whole.n
            along, size = fit.coefficients @ right, fit.coefficients @ gram @ fit.coefficients
            factor = along / max(size, 1e-300)
            plain = squares - 2.0 * along + size
            found.append((float(factor), float(squares - along * factor), float(plain)))
        return found

    def flank(self, fit: Fit) -> tuple[float, float]:
        """Elastic stiffness before anything slips, over the design's, and its standard error.

        From the scatter of the fit's scores over blocks of recordings.
        """
        slides = [self.per_stiffness * (self.columns[j].piece == SLIP) for j in fit.columns[1:]]
        weights = np.array([1.0, *slides])
        gram, scores = np.zeros((weights.size, weights.size)), []
        for r in self.rows:
            X, y = self.matrix(r, fit.columns), r.torque_Nm - r.torque_Nm.mean()
            X = X - X.mean(axis=0)
            gram = gram + X.T @ X
            left = y - X @ fit.coefficients
            scores += [X[part].T @ left[part] for part in np.array_split(np.arange(y.size), BLOCKS)]
        bread = np.linalg.inv(gram + ridge(gram))
        covariance = bread @ (np.array(scores).T @ np.array(scores)) @ bread
        variance = max(float(weights @ covariance @ weights), 0.0)
        return float(weights @ fit.coefficients), float(np.sqrt(variance))

    @property
    def stiffness(self) -> float:
        """Of the design at rest [Nm/rad]."""
        step = 1e-6
        rise = spring_torque_Nm(self.table, step) - spring_torque_Nm(self.table, -step)
        return float(rise) / (2.0 * step)

    @property
    def other_sign(self) -> float:
        """Largest deflection the less travelled way, over that of the other."""
        deflections = [r.deflection_rad - zero_of(r) for r in self.rows]
        ends = max(float(b.max()) for b in deflections), -min(float(b.min()) for b in deflections)
        return max(min(ends), 0.0) / max(*ends, 1e-300)

    @property
    def per_stiffness(self) -> float:
        """Of one Nm/rad, in the design's stiffness."""
        return 1.0 / self.stiffness


def _near(column: Column, stage: int) -> list[Column]:
    """Columns of the same piece with values near its own."""
    name, stages = FINE[column.piece]
    value = column.parameters[name]
    return [
        replace(column, parameters={name: float(value * f)})
        for factors in stages[stage : stage + 1]
        for f in factors
    ]


def beyond(deflection: NDArray, column: Column) -> NDArray:
    """Deflection beyond the onset of a contact, with its sign."""
    onset = column.parameters["onset_rad"]
    directions = (1.0, -1.0) if column.piece == KNEES else (np.sign(onset),)
    return sum(side * np.maximum(side * deflection - abs(onset), 0.0) for side in directions)


def offset_of(r: BenchRows, error: NDArray) -> float:
    """The offset that a recording's first rows show: its unloaded point."""
    return float(np.mean(error[: max(3, int(NEEDED_SHARE * error.size))]))


def apparent_noise(values: NDArray) -> float:
    """Standard deviation of white noise on a smooth signal, by its second differences."""
    second = np.abs(np.diff(values, 2))
    return float(1.4826 * np.median(second) / np.sqrt(6.0)) if second.size else 0.0


def zero_of(r: BenchRows) -> float:
    """Deflection of a recording that starts unloaded there; 0 of one that does not."""
    if abs(r.torque_Nm[:FIRST].mean()) > UNLOADED * np.ptp(r.torque_Nm):
        return 0.0
    return float(r.deflection_rad[:FIRST].mean())
