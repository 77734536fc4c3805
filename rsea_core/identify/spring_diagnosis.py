"""Why a spring measures differently from its design: scale, slip, contact friction, lag.

Each explanation is one column beside the design's curve H in a linear regression of torque on
what the deflection did (an inner yield or onset is taken from a grid); an explanation is believed
by how well it predicts halves of recordings that took no part in its fit (a whole one would often
ask for an extrapolation to torques that no other reached).

    torque = s H(d)                the strip is thicker or thinner: s = (t / t0)^3
           + k stop(d; y)          (with s smaller) a clamp that slips beyond k y, or friction
           + c |H(d)| sgn(d')      coils that rub, from a contact's onset on
           + c d'                  torque that lags (or leads) the deflection
           + c d^3                 hardening
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.identify.spring_bench import BenchRows, bench_rows, measure_spring
from rsea_core.recording import Recording
from rsea_core.rig import Rig
from rsea_core.terms import SpringCurve
from rsea_core.terms.table import SpringTable, linear_table, spring_torque_Nm

YIELDS = np.geomspace(0.01, 1.2, 48)  # of the deflection's range
COARSE = 5  # of these for pairs of sliders
BETTER = 0.85  # of the error: an explanation that does not get there is not worth its name
BLOCKS = 6  # of a recording, for standard errors
RICHER = 0.95  # of the error: two sliders for one are a richer law, not another explanation
SMOOTH_ROWS = 15  # over which a deflection's rate is fitted
NEARLY_ALL = 0.75  # of the stiffness in the slider: the joint slips as a whole


@dataclass(frozen=True, kw_only=True)
class SpringCandidate:
    """One explanation of the loops.

    Attributes
    ----------
    name : str
    error : float
        Root mean square torque error on recordings left out, over the torque's deviation.
    in_sample : float
    scale, scale_std : float
        Factor on the design's curve (its elastic flank, where something slips).
    parameters : mapping of str to float
    """

    name: str
    error: float
    in_sample: float
    scale: float
    scale_std: float
    parameters: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class SpringDiagnosis:
    """A spring against its design.

    Attributes
    ----------
    candidates : tuple of SpringCandidate
        Best first; "as designed" is always among them.
    best : SpringCandidate
        The simplest that nothing beats clearly.
    thickness_ratio, thickness_std : float
        (measured stiffness over the design's)^(1/3); nan without a design's curve.
    held_out : float
        Error of the best on the validation recordings; nan where there are none.
    sentence : str
    findings : tuple of str
    """

    candidates: tuple[SpringCandidate, ...]
    best: SpringCandidate
    thickness_ratio: float
    thickness_std: float
    held_out: float
    sentence: str
    findings: tuple[str, ...]


@njit(cache=True, error_model="numpy")
def stop(deflection, reach):
    """Deflection of an elastic element in series with a slider that gives way at `reach`.

    Rate-independent: the same path gives the same answer at any speed. It starts relaxed.
    """
    found = np.zeros(deflection.size)
    x = 0.0
    for row in range(1, deflection.size):
        x += deflection[row] - deflection[row - 1]
        if x > reach:
            x = reach
        elif x < -reach:
            x = -reach
        found[row] = x
    return found


def diagnose_spring(
    rig: Rig, recordings: Sequence[Recording], design: SpringCurve | None = None
) -> SpringDiagnosis:
    """Compare the loops of identification recordings with a design, and name what differs.

    Parameters
    ----------
    design : SpringCurve or None
        The finite-element curve; None compares with the rig's stiffness, or, where that is not
        known, with a straight line.

    Raises
    ------
    InputError
        If there is no torque against deflection.
    """
    chosen = [r for r in recordings if r.role == "identification"]
    measured = measure_spring(rig, chosen)
    rows, _ = bench_rows(rig, chosen)
    table, known = _table(rig, design, measured.stiffness_Nm_per_rad)
    fitted = [_candidate(name, maker, rows, table) for name, maker in _makers(rows, design)]
    plain = next(c for c in fitted if c.name == "scale")
    best = plain
    for candidate in sorted(fitted, key=lambda c: len(c.parameters)):
        if candidate.error < BETTER * best.error:
            best = candidate
    richer = next(c for c in fitted if c.name == "hysteresis")
    if best.name == "slip" and richer.error < RICHER * best.error:
        best = richer
    designed = _as_designed(rows, table)
    held_rows = [r for r in recordings if r.role == "validation"]
    held_out = float("nan")
    if held_rows:
        maker = dict(_makers(rows, design))[best.name]
        held_out = _held_out(maker, rows, bench_rows(rig, held_rows)[0], table)
    ratio = best.scale ** (1.0 / 3.0) if known and best.scale > 0.0 else float("nan")
    ratio_std = ratio * best.scale_std / (3.0 * best.scale) if known else float("nan")
    return SpringDiagnosis(
        candidates=tuple(sorted([*fitted, designed], key=lambda c: c.error)),
        best=best,
        thickness_ratio=ratio,
        thickness_std=ratio_std,
        held_out=held_out,
        sentence=_sentence(best, plain, known, ratio, ratio_std, measured.stiffness_Nm_per_rad),
        findings=measured.findings,
    )


Maker = Callable[[BenchRows, SpringTable], list[tuple[dict[str, float], list[NDArray]]]]


def _table(rig: Rig, design: SpringCurve | None, measured: float) -> tuple[SpringTable, bool]:
    if design is not None:
        return design.table(), True
    K = rig.spring_stiffness_Nm_per_rad
    return linear_table(measured if K is None else K), K is not None


def _makers(rows: Sequence[BenchRows], design: SpringCurve | None) -> list[tuple[str, Maker]]:
    """Explanations by name: what they add to H for each value of their inner parameter."""
    reach = max(float(np.ptp(r.deflection_rad)) for r in rows)
    onset = 0.0
    if design is not None and any(design.contact_onset_rad):
        onset = min(abs(v) for v in design.contact_onset_rad if v is not None)

    def scale(r: BenchRows, table: SpringTable):
        return [({}, [])]

    def lag(r: BenchRows, table: SpringTable):
        return [({}, [_rate(r)])]

    def hardening(r: BenchRows, table: SpringTable):
        return [({}, [r.deflection_rad**3])]

    def slip(r: BenchRows, table: SpringTable):
        return [({"reach_rad": y * reach}, [stop(r.deflection_rad, y * reach)]) for y in YIELDS]

    def hysteresis(r: BenchRows, table: SpringTable):
        return [
            (
                {"reach_1_rad": a * reach, "reach_2_rad": b * reach},
                [stop(r.deflection_rad, a * reach), stop(r.deflection_rad, b * reach)],
            )
            for a in YIELDS[::COARSE]
            for b in YIELDS[::COARSE]
            if a < b
        ]

    def contact(r: BenchRows, table: SpringTable):
        bend = r.deflection_rad
        direction = stop(bend, 0.01 * reach) / (0.01 * reach)
        beyond = np.abs(spring_torque_Nm(table, bend)) * (np.abs(bend) > onset)
        return [({"onset_rad": onset}, [beyond * direction])]

    return [
        ("scale", scale),
        ("lag", lag),
        ("hardening", hardening),
        ("slip", slip),
        ("contact friction", contact),
        ("hysteresis", hysteresis),
    ]


def _candidate(
    name: str, maker: Maker, rows: Sequence[BenchRows], table: SpringTable
) -> SpringCandidate:
    """Fit on all recordings, and its error on each recording when left out."""
    grids = [maker(r, table) for r in rows]
    moments = [
        [_halves(r, g[j][1], table) for r, g in zip(rows, grids, strict=True)]
        for j in range(len(grids[0]))
    ]
    solved = [_solve(halves, None) for halves in moments]
    best = int(np.argmin([s[1] for s in solved]))
    coefficients, squares = solved[best]
    std = _flank_error(rows, [g[best][1] for g in grids], table, coefficients)
    whole = sum(float(np.sum((r.torque_Nm - r.torque_Nm.mean()) ** 2)) for r in rows)
    left_out = 0.0
    for k in range(len(rows)):
        for half in (0, 1):
            trials = [_solve(halves, (k, half)) for halves in moments]
            j = int(np.argmin([t[1] for t in trials]))
            left_out += _error_of(moments[j][k][half], moments[j][k][1 - half], trials[j][0])
    inner = grids[0][best][0]
    scale, rest = float(coefficients[0]), coefficients[1:]
    parameters = dict(inner)
    if name in ("slip", "hysteresis"):
        K = float(spring_torque_Nm(table, 1e-6) - spring_torque_Nm(table, 0.0)) / 1e-6
        moved = float(rest.sum()) / K
        parameters["slipping_share"] = moved / (scale + moved) if scale + moved > 0 else np.nan
        parameters |= {f"stiffness_{j + 1}_Nm_per_rad": float(v) for j, v in enumerate(rest)}
        scale += moved  # of the elastic flank, before anything slips
    else:
        parameters |= {f"coefficient_{j + 1}": float(v) for j, v in enumerate(rest)}
    return SpringCandidate(
        name=name, error=float(np.sqrt(left_out / whole)),
        in_sample=float(np.sqrt(squares / whole)), scale=scale, scale_std=float(std),
        parameters=parameters,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class _Moments:
    """Sums over rows of columns x and torque y: all that least squares needs."""

    n: int
    x: NDArray
    y: float
    xx: NDArray
    xy: NDArray
    yy: float

    def __add__(self, other: "_Moments") -> "_Moments":
        return _Moments(
            n=self.n + other.n, x=self.x + other.x, y=self.y + other.y, xx=self.xx + other.xx,
            xy=self.xy + other.xy, yy=self.yy + other.yy,
        )  # fmt: skip


def _halves(r: BenchRows, columns: list[NDArray], table: SpringTable) -> tuple[_Moments, _Moments]:
    X = np.column_stack([spring_torque_Nm(table, r.deflection_rad), *columns])
    found = []
    for part in np.array_split(np.arange(r.torque_Nm.size), 2):
        x, y = X[part], r.torque_Nm[part]
        found.append(
            _Moments(
                n=y.size, x=x.sum(axis=0), y=float(y.sum()), xx=x.T @ x, xy=x.T @ y, yy=float(y @ y)
            )
        )
    return found[0], found[1]


def _solve(
    rows: Sequence[tuple[_Moments, _Moments]], left_out: tuple[int, int] | None
) -> tuple[NDArray, float]:
    """Coefficients and squared error, every recording with an offset of its own.

    Of several sliders none may push: that makes the error infinite.
    """
    gram, right, squares = 0.0, 0.0, 0.0
    for k, (first, second) in enumerate(rows):
        kept = first + second
        if left_out is not None and left_out[0] == k:
            kept = (second, first)[left_out[1]]
        gram = gram + kept.xx - np.outer(kept.x, kept.x) / kept.n
        right = right + kept.xy - kept.x * kept.y / kept.n
        squares += kept.yy - kept.y**2 / kept.n
    ridge = 1e-10 * np.diag(np.maximum(np.diag(gram), 1e-300))
    solved = np.linalg.solve(gram + ridge, right)
    left = squares - 2.0 * solved @ right + solved @ gram @ solved
    if solved.size > 2 and np.any(solved[1:] < 0.0):
        left = np.inf
    return solved, max(float(left), 0.0)


def _error_of(half: _Moments, kept: _Moments, solved: NDArray) -> float:
    """Squared error on a half that was left out, at the offset that the other half shows."""
    offset = (kept.y - solved @ kept.x) / kept.n
    total = half.y - solved @ half.x
    squares = half.yy - 2.0 * solved @ half.xy + solved @ half.xx @ solved
    return float(squares - 2.0 * offset * total + half.n * offset**2)


def _flank_error(
    rows: Sequence[BenchRows],
    extra: Sequence[list[NDArray]],
    table: SpringTable,
    solved: NDArray,
) -> float:
    """Standard error of the elastic flank's scale from the scatter over blocks of recordings."""
    gram, scores = 0.0, []
    for r, columns in zip(rows, extra, strict=True):
        X = np.column_stack([spring_torque_Nm(table, r.deflection_rad), *columns])
        X, y = X - X.mean(axis=0), r.torque_Nm - r.torque_Nm.mean()
        gram = gram + X.T @ X
        scores += [
            X[part].T @ (y[part] - X[part] @ solved)
            for part in np.array_split(np.arange(y.size), BLOCKS)
        ]
    bread = np.linalg.inv(gram + 1e-10 * np.diag(np.maximum(np.diag(gram), 1e-300)))
    covariance = bread @ (np.array(scores).T @ np.array(scores)) @ bread
    return float(np.sqrt(max(covariance[0, 0], 0.0)))


def _predicted(
    r: BenchRows, columns: list[NDArray], coefficients: NDArray, table: SpringTable
) -> NDArray:
    X = np.column_stack([spring_torque_Nm(table, r.deflection_rad), *columns])
    return X @ coefficients


def _free_offset(r: BenchRows, error: NDArray) -> float:
    """The offset that a recording's first rows show: its unloaded point."""
    return float(np.mean(error[: max(3, error.size // 50)]))


def _held_out(
    maker: Maker, rows: Sequence[BenchRows], held: Sequence[BenchRows], table: SpringTable
) -> float:
    grids = [maker(r, table) for r in rows]
    trials = [
        _solve([_halves(r, g[j][1], table) for r, g in zip(rows, grids, strict=True)], None)
        for j in range(len(grids[0]))
    ]
    j = int(np.argmin([t[1] for t in trials]))
    squares = whole = 0.0
    for r in held:
        error = r.torque_Nm - _predicted(r, maker(r, table)[j][1], trials[j][0], table)
        squares += float(np.sum((error - _free_offset(r, error)) ** 2))
        whole += float(np.sum((r.torque_Nm - r.torque_Nm.mean()) ** 2))
    return float(np.sqrt(squares / whole))


def _as_designed(rows: Sequence[BenchRows], table: SpringTable) -> SpringCandidate:
    squares = whole = 0.0
    for r in rows:
        error = r.torque_Nm - spring_torque_Nm(table, r.deflection_rad)
        squares += float(np.sum((error - _free_offset(r, error)) ** 2))
        whole += float(np.sum((r.torque_Nm - r.torque_Nm.mean()) ** 2))
    error = float(np.sqrt(squares / whole))
    return SpringCandidate(
        name="as designed", error=error, in_sample=error, scale=1.0, scale_std=0.0, parameters={}
    )


def _rate(r: BenchRows) -> NDArray:
    """Rate of deflection by least squares over a few rows either side; no one-sided filter."""
    rows = min(SMOOTH_ROWS, (r.deflection_rad.size - 1) // 2 * 2 - 1)
    if rows < 3:
        raise InputError(f"{r.file}: too few rows for a rate")
    half = rows // 2
    weights = np.arange(-half, half + 1.0)
    padded_x = np.pad(r.deflection_rad, half, mode="edge")
    padded_t = np.pad(r.time_s, half, mode="reflect", reflect_type="odd")
    return np.convolve(padded_x, weights[::-1], "valid") / np.convolve(
        padded_t, weights[::-1], "valid"
    )


def _sentence(
    best: SpringCandidate,
    plain: SpringCandidate,
    known: bool,
    ratio: float,
    ratio_std: float,
    stiffness: float,
) -> str:
    gain = f"(error {100 * plain.error:.2g} % to {100 * best.error:.2g} %)"
    if known:
        size = 100.0 * (best.scale - 1.0)
        head = f"The spring's elastic stiffness is {size:+.1f} ± {100 * best.scale_std:.1f} % off"
        head += f" its design: a strip {100 * (ratio - 1.0):+.2f} ± {100 * ratio_std:.2f} % thick"
    else:
        head = f"The spring's elastic stiffness is {stiffness:.4g} Nm/rad"
    share = best.parameters.get("slipping_share", 0.0)
    slips = "its clamp slips" if share > NEARLY_ALL else "a part of it rubs (hysteresis)"
    words = {
        "scale": "and that explains the loops",
        "lag": f"and its torque and deflection are read at different times {gain}",
        "hardening": f"and its stiffness goes another way with deflection {gain}",
        "contact friction": f"and its coils rub in proportion to the torque {gain}",
        "hysteresis": f"and {slips} {gain}",
        "slip": f"and {slips} {gain}",
    }
    return f"{head}, {words[best.name]}."
