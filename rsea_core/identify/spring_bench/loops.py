"""A spring on a bench: what its torque against deflection says, loop by loop.

Stiffness of the elastic flanks (just after each reversal, where nothing slips yet) and of whole
swings, in both directions, loop width and energy, the knee where a swing leaves its flank, and
how all that goes with amplitude and rate. Recordings are `imposed`, locked or quasi-static ones
with `torque_Nm` and `spring_deflection_rad` (or two encoders).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.machine.rig import Rig
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

SWING = 0.15  # of the range: a smaller turn back is noise, not a reversal
FLANK = (0.03, 0.3)  # of a swing's torque: where its elastic slope is read
LARGE = 0.15  # of the largest torque: smaller swings do not show a flank well
NEEDED_ROWS = 5
BINS = 24  # of a swing's path, for its knee
KNEE = 0.6, 1.5  # tangent over flank: below it slips, above it touches
WIDE = 3.0  # standard errors
CLEAR = 0.5  # correlation from which a recording shows its torque's sign by itself


@dataclass(frozen=True, kw_only=True)
class Loop:
    """One swing of torque from turn to turn.

    Attributes
    ----------
    file : str
    direction : int
        +1 where the torque grows.
    torque_range_Nm, deflection_range_rad : float
    flank_Nm_per_rad, flank_std : float
        Slope just after the turn; nan where there are too few rows.
    secant_Nm_per_rad : float
    width_Nm, energy_J : float
        Of the loop that this swing closes with the one before it; nan for the first.
    knee_Nm, knee_rad : float
        Torque and deflection, from the turn on, at which the slope leaves that of the flank; nan
        where it never does.
    knee_kind : str
        "slips", "touches" or "".
    rate_rad_per_s : float
        Of deflection, mean over the swing.
    """

    file: str
    direction: int
    torque_range_Nm: float
    deflection_range_rad: float
    flank_Nm_per_rad: float
    flank_std: float
    secant_Nm_per_rad: float
    width_Nm: float
    energy_J: float
    knee_Nm: float
    knee_rad: float
    knee_kind: str
    rate_rad_per_s: float


@dataclass(frozen=True, kw_only=True)
class SpringMeasurement:
    """What a set of loops says of a spring.

    Attributes
    ----------
    sign : int
        -1 where the logged torque opposes the deflection (a sign of the bench, said as a finding).
    stiffness_Nm_per_rad, stiffness_std : float
        Of the elastic flanks, median and its standard error.
    by_direction : (float, float)
        Flank stiffness where the torque falls and where it grows.
    secants : (n, 2) array
        Torque range and secant stiffness of each swing.
    width_Nm, energy_J : float
        Largest loop.
    slip_Nm : float
        Torque beyond which swings slip, as half the median knee from a turn; nan if they do not.
    loops : tuple of Loop
    findings : tuple of Finding
    """

    sign: int
    stiffness_Nm_per_rad: float
    stiffness_std: float
    by_direction: tuple[float, float]
    secants: NDArray
    width_Nm: float
    energy_J: float
    slip_Nm: float
    loops: tuple[Loop, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, kw_only=True)
class BenchRows:
    """Deflection and torque of one recording, the torque's sign turned to the spring's."""

    file: str
    role: str
    time_s: NDArray
    deflection_rad: NDArray
    torque_Nm: NDArray
    turned: bool = False  # its logged torque has the other sign than those of most


def bench_rows(rig: Rig, recordings: Sequence[Recording]) -> tuple[tuple[BenchRows, ...], int]:
    """The rows of every recording that has torque and deflection, and the sign of the torque.

    A spring's torque grows with its deflection; a recording whose own torque clearly falls is
    turned, whatever the others' sign, and says so.

    Raises
    ------
    InputError
        If none has both.
    """
    found = []
    for r in recordings:
        deflection = _deflection(rig, r)
        if deflection is not None and "torque_Nm" in r.responses:
            found.append((r, deflection, np.asarray(r["torque_Nm"], dtype=float)))
    if not found:
        raise InputError("a spring bench needs torque_Nm and spring_deflection_rad (or two angles)")
    leans = [_lean(x, y) for _, x, y in found]
    sign = 1 if sum(p * np.ptp(y) for p, (_, _, y) in zip(leans, found, strict=True)) >= 0.0 else -1
    own = [int(np.sign(p)) if abs(p) > CLEAR else sign for p in leans]
    rows = tuple(
        BenchRows(
            file=r.file, role=r.role, time_s=r.time_s, deflection_rad=read_only(x.copy()),
            torque_Nm=read_only(s * y), turned=s != sign,
        )
        for s, (r, x, y) in zip(own, found, strict=True)
    )  # fmt: skip
    return rows, sign


def _lean(x: NDArray, y: NDArray) -> float:
    """Correlation of two readings; 0 where one stands still."""
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    return float(np.corrcoef(x, y)[0, 1])


def measure_spring(rig: Rig, recordings: Sequence[Recording]) -> SpringMeasurement:
    """Measure every swing of the recordings.

    Raises
    ------
    InputError
        If there is no torque against deflection, or it never turns back.
    """
    rows, sign = bench_rows(rig, recordings)
    loops = tuple(loop for r in rows for loop in _loops(r))
    flanks = np.array([p.flank_Nm_per_rad for p in loops])
    known = np.isfinite(flanks)
    if not known.any():
        raise InputError("no recording turns back: a loop needs torque in both directions")
    ranges = np.array([p.torque_range_Nm for p in loops])
    large = known & (ranges > LARGE * ranges.max())
    known = large if large.any() else known
    stiffness = float(np.median(flanks[known]))
    off = 1.4826 * float(np.median(np.abs(flanks[known] - stiffness)))
    std = 1.2533 * off / np.sqrt(known.sum())  # of a median
    std = max(std, float(np.nanmedian([p.flank_std for p in loops])))
    direction = np.array([p.direction for p in loops])
    by_direction = tuple(
        float(np.median(flanks[known & (direction == d)])) if np.any(known & (direction == d))
        else float("nan")
        for d in (-1, 1)
    )  # fmt: skip
    slips = [0.5 * p.knee_Nm for p in loops if p.knee_kind == "slips"]
    widths = [p.width_Nm for p in loops if np.isfinite(p.width_Nm)]
    energies = [p.energy_J for p in loops if np.isfinite(p.energy_J)]
    return SpringMeasurement(
        sign=sign,
        stiffness_Nm_per_rad=stiffness,
        stiffness_std=std,
        by_direction=by_direction,
        secants=np.array([(p.torque_range_Nm, p.secant_Nm_per_rad) for p in loops]),
        width_Nm=max(widths, default=float("nan")),
        energy_J=max(energies, default=float("nan")),
        slip_Nm=float(np.median(slips)) if slips else float("nan"),
        loops=loops,
        findings=_findings(loops, sign, stiffness, std),
    )


def turns(deflection: NDArray, torque: NDArray) -> NDArray:
    """Rows of the first, every turning and the last point of a loading path.

    The path is followed along deflection and torque together, each over its range, so that a hold
    (one stands still) is no turn; turns smaller than `SWING` of the range are not counted.
    """
    x, y = np.ptp(deflection), np.ptp(torque)
    if x == 0.0 or y == 0.0:
        return np.array([0, deflection.size - 1])
    path = deflection / x + torque / y
    least = SWING * np.ptp(path)
    found, extreme, rising = [0], 0, 0
    for row in range(1, path.size):
        ahead = path[row] - path[extreme]
        if rising == 0:
            if abs(ahead) > least:
                rising = 1 if ahead > 0 else -1
                extreme = row
        elif rising * ahead > 0.0:
            extreme = row
        elif rising * ahead < -least:
            found.append(extreme)
            rising, extreme = -rising, row
    found.append(extreme if rising else path.size - 1)
    return np.unique(found)


def _deflection(rig: Rig, r: Recording) -> NDArray | None:
    if "spring_deflection_rad" in r.responses:
        return np.asarray(r["spring_deflection_rad"], dtype=float)
    if "motor_angle_rad" in r and ("load_angle_rad" in r or r.load.is_held):
        held = r.columns.get("load_angle_rad", 0.0)
        return np.asarray(r["motor_angle_rad"]) / (rig.gear_ratio or 1.0) - held
    return None


def _loops(r: BenchRows) -> list[Loop]:
    at, found = turns(r.deflection_rad, r.torque_Nm), []
    for number, (first, last) in enumerate(pairwise(at)):
        x, y = r.deflection_rad[first : last + 1], r.torque_Nm[first : last + 1]
        swing, deflection = float(y[-1] - y[0]), float(x[-1] - x[0])
        if swing == 0.0 or deflection == 0.0 or x.size < NEEDED_ROWS:
            continue
        flank, flank_std = _flank(x, y)
        knee = _knee(x, y, flank)
        before = at[number - 1] if number else None
        width, energy = (
            (float("nan"), float("nan"))
            if before is None
            else _loop_of(
                r.deflection_rad[before : last + 1], r.torque_Nm[before : last + 1], first - before
            )
        )
        seconds = float(r.time_s[last] - r.time_s[first])
        found.append(
            Loop(
                file=r.file, direction=int(np.sign(swing)), torque_range_Nm=abs(swing),
                deflection_range_rad=abs(deflection), flank_Nm_per_rad=flank, flank_std=flank_std,
                secant_Nm_per_rad=swing / deflection, width_Nm=width, energy_J=energy,
                knee_Nm=knee[0], knee_rad=knee[1], knee_kind=knee[2],
                rate_rad_per_s=abs(deflection) / max(seconds, 1e-300),
            )
        )  # fmt: skip
    return found


def _flank(x: NDArray, y: NDArray) -> tuple[float, float]:
    """Slope of torque on deflection just after the turn, and its standard error."""
    share = (y - y[0]) / (y[-1] - y[0])
    reached = np.flatnonzero(share > FLANK[1])
    end = int(reached[0]) if reached.size else y.size
    begin = int(np.flatnonzero(share[:end] < FLANK[0])[-1]) if end else 0
    part = slice(begin, end)
    if end - begin < NEEDED_ROWS or np.ptp(x[part]) == 0.0:
        return float("nan"), float("nan")
    X = np.column_stack([x[part] - x[part].mean(), np.ones(end - begin)])
    solved, *_ = np.linalg.lstsq(X, y[part], rcond=None)
    left = y[part] - X @ solved
    error = np.sqrt(np.sum(left**2) / max(end - begin - 2, 1) / np.sum(X[:, 0] ** 2))
    return float(solved[0]), float(error)


def _knee(x: NDArray, y: NDArray, flank: float) -> tuple[float, float, str]:
    """Torque and deflection from the turn on at which the slope leaves the flank's for good."""
    none = (float("nan"), float("nan"), "")
    if not flank > 0.0:
        return none
    share = 0.5 * ((y - y[0]) / (y[-1] - y[0]) + (x - x[0]) / (x[-1] - x[0]))
    share = np.clip(share, 0.0, 1.0)  # along the path, so that a slip has bins of its own
    index = np.minimum((share * BINS).astype(int), BINS - 1)
    count = np.bincount(index, minlength=BINS)
    filled = np.flatnonzero(count > 0)
    mean_x = np.bincount(index, x, BINS)[filled] / count[filled]
    mean_y = np.bincount(index, y, BINS)[filled] / count[filled]
    run = np.diff(mean_x)
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent = np.where(run != 0.0, np.diff(mean_y) / run, np.inf) / flank
    for kind, beyond in (("slips", tangent < KNEE[0]), ("touches", tangent > KNEE[1])):
        inner = beyond[2:-1]
        if inner.size >= 4 and inner[-3:].all():
            start = 2 + int(np.flatnonzero(~inner)[-1] + 1) if not inner.all() else 2
            return abs(float(mean_y[start] - y[0])), abs(float(mean_x[start] - x[0])), kind
    return none


def _loop_of(x: NDArray, y: NDArray, turn: int) -> tuple[float, float]:
    """Torque between the two swings at their middle deflection, and the energy that they lose."""
    out, back = slice(0, turn + 1), slice(turn, x.size)
    low = max(x[out].min(), x[back].min())
    high = min(x[out].max(), x[back].max())
    if not high > low:
        return float("nan"), float("nan")
    grid = np.linspace(low, high, 101)
    curves = [_single_valued(x[part], y[part], grid) for part in (out, back)]
    gap = np.abs(curves[0] - curves[1])
    return float(gap[50]), float(np.trapezoid(gap, grid))


def _single_valued(x: NDArray, y: NDArray, grid: NDArray) -> NDArray:
    order = np.argsort(x, kind="stable")
    return np.interp(grid, x[order], y[order])


def _findings(
    loops: Sequence[Loop], sign: int, stiffness: float, std: float
) -> tuple[Finding, ...]:
    found = []
    if sign < 0:
        text = "torque_Nm falls where the deflection grows: one of the two has the other sign"
        found.append(Finding(kind=Kind.SIGN, text=text))
    secants = np.array([abs(p.secant_Nm_per_rad) for p in loops])
    ranges = np.array([p.torque_range_Nm for p in loops])
    largest = secants[ranges > 0.8 * ranges.max()]
    if largest.size and np.median(largest) < 0.8 * stiffness - WIDE * std:
        text = (
            f"the stiffness of whole swings falls to {np.median(largest):.4g} Nm/rad at the largest"
            f" torque while the elastic flanks keep {stiffness:.4g} ± {std:.2g} Nm/rad: the spring"
            " is not softer, something slips"
        )
        found.append(Finding(kind=Kind.SLIDING, text=text))
    return tuple(found)
