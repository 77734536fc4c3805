"""Why a spring differs from its design: thickness, slip, contact friction, lag, hardening.

The explanations are columns beside the design's curve (`spring_fit`), taken one after the other
as long as each of them predicts quarters of recordings clearly better that took no part in its fit
(a whole recording would often ask for an extrapolation to torques that no other reached).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import bdtrc

from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import InputError
from rsea_core.identify.spring_bench.candidate import SpringCandidate
from rsea_core.identify.spring_bench.explanation_text import explanation_sentence
from rsea_core.identify.spring_bench.file_checks import (
    moves,
    sign_findings,
    unit_findings,
)
from rsea_core.identify.spring_bench.loops import (
    BenchRows,
    SpringMeasurement,
    bench_rows,
    measure_spring,
    turns,
)
from rsea_core.identify.spring_bench.regression import (
    ASYMMETRY,
    CONTACT,
    FINE,
    HARDENING,
    KNEE,
    KNEES,
    PIECES,
    SLIP,
    Bench,
    Fit,
    offset_of,
    zero_of,
)
from rsea_core.machine.rig import Rig
from rsea_core.machine.spring_table import SpringTable, linear_table, spring_torque_Nm
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

BETTER = 0.85  # of the error: an explanation that does not get there is not worth its name
RICHER = 0.95  # of the error: two sliders for one are a richer law, not another explanation
WORTH = 0.005  # of the torque's deviation: a smaller gain is not worth another explanation
SURE = 1.0  # standard errors by which the gain must exceed zero
CHANCE = 0.01  # that so many recordings improve by luck
MOST = 3  # explanations at once
APART, CLEARLY = 1.15, 1.3  # factors of stiffness and error: recordings are not one spring's
LARGE = 0.15  # of the largest torque: smaller recordings do not show a stiffness well
OTHER_SPRING = 2.0  # factor between stiffnesses beyond which a recording is of another spring

ALTERNATIVES = (  # of each group one: the coils touch once, and a knee corrects no polynomial
    {CONTACT, KNEE, KNEES},
    {HARDENING, KNEE, KNEES},
    {ASYMMETRY, KNEE, KNEES},
)

__all__ = ("SpringCandidate", "SpringDiagnosis", "diagnose_spring")


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
    findings : tuple of Finding
    bench : Bench
        Recordings and columns of the fit.
    held : tuple of BenchRows
        Validation recordings.
    measured : SpringMeasurement or None
        None where no swing shows its flank.
    turns_back : bool
        Whether a recording does: else what slips cannot be distinguished from what bends.
    known : bool
        Whether a design or the rig's stiffness was compared with.
    """

    candidates: tuple[SpringCandidate, ...]
    best: SpringCandidate
    thickness_ratio: float
    thickness_std: float
    held_out: float
    sentence: str
    findings: tuple[Finding, ...]
    bench: Bench = field(compare=False, repr=False)
    held: tuple[BenchRows, ...] = field(compare=False, repr=False)
    measured: SpringMeasurement | None = field(compare=False, repr=False)
    turns_back: bool
    known: bool

    @property
    def plain(self) -> SpringCandidate:
        """The design's curve with another scale."""
        return next(c for c in self.candidates if c.name == "scale")


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
    rows, sign = bench_rows(rig, chosen)
    if not any(moves(rig, r, row) for r in chosen for row in rows if row.file == r.file):
        raise InputError(
            "nothing moves: in no recording do both torque and deflection change beyond their noise"
        )
    measured = _measured(rig, chosen)
    table, known = _table(rig, design, rows)
    timed = not any(r.quasi_static for r in chosen)
    bench = Bench(rows, table, design, timed=timed)
    bench, tried = _search(bench)
    best = _candidate(bench, tried[-1])
    fitted = {best.name: best}
    for candidate in (_candidate(bench, fit) for fit in tried):
        fitted.setdefault(candidate.name, candidate)
    designed = _as_designed(bench)
    held = tuple(r for r in recordings if r.role == "validation")
    held_rows, held_sign = bench_rows(rig, held) if held else ((), sign)
    ratio = best.scale ** (1.0 / 3.0) if known and best.scale > 0.0 else float("nan")
    ratio_std = ratio * best.scale_std / (3.0 * best.scale) if known else float("nan")
    other = [r for r in held_rows if r.turned != (held_sign != sign)]
    turned = [r.file for r in (*(r for r in rows if r.turned), *other)]
    return SpringDiagnosis(
        candidates=tuple(sorted([*fitted.values(), designed], key=lambda c: c.error)),
        best=best,
        thickness_ratio=ratio,
        thickness_std=ratio_std,
        held_out=_held_out(bench, best.fit, held_rows),
        sentence=explanation_sentence(
            best, fitted["scale"], known, ratio, ratio_std, bench.stiffness
        ),
        findings=(
            *(() if measured is None else measured.findings),
            *sign_findings(turned),
            *unit_findings(best.scale if known else 1.0),
            *_not_one(bench, best),
            *_other_springs(bench, held_rows),
        ),
        bench=bench,
        held=held_rows,
        measured=measured,
        turns_back=any(turns(r.deflection_rad, r.torque_Nm).size > 2 for r in rows),
        known=known,
    )


def _measured(rig: Rig, chosen: Sequence[Recording]) -> SpringMeasurement | None:
    try:
        return measure_spring(rig, chosen)
    except InputError:
        return None


def _search(bench: Bench) -> tuple[Bench, list[Fit]]:
    """Forward choice: all fits that were tried, the chosen one last."""
    current = bench.fit(())
    tried = [current]
    for _ in range(MOST):
        found = []
        for piece in PIECES:
            most = 2 if piece == SLIP else 1
            if not bench.can(piece) or current.pieces.count(piece) >= most:
                continue
            if any(piece in group and group & set(current.pieces) for group in ALTERNATIVES):
                continue
            fit = bench.fit(tuple(sorted((*current.pieces, piece))))
            tried.append(fit)
            if _is_better(bench, current, fit):
                found.append(fit)
        if not found:
            break
        current = min(found, key=lambda fit: fit.error)
        if set(FINE) & set(current.pieces):
            bench, current = bench.refined(current)
    tried = [fit for fit in tried if fit.pieces != current.pieces and np.isfinite(fit.error)]
    return bench, [*tried, current]


def gain(worse: Fit, better: Fit) -> tuple[float, float]:
    """Mean gain of squared error over the quarters left out, and its standard error."""
    gains = (worse.left_out - better.left_out).ravel()
    return float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(gains.size))


def chance(worse: Fit, better: Fit) -> float:
    """Probability that luck alone improves as many recordings (a sign test)."""
    improved = better.left_out.sum(axis=1) < worse.left_out.sum(axis=1)
    return float(bdtrc(improved.sum() - 1.0, improved.size, 0.5)) if improved.any() else 1.0


def _is_better(bench: Bench, now: Fit, fit: Fit) -> bool:
    """Clearly smaller errors in sum, or in so many recordings that it is no chance.

    The sum is the largest recordings'; what acts in all of them, such as a lag, shows in each.
    """
    if not np.isfinite(fit.error):
        return False
    each = np.sqrt(fit.left_out.sum(axis=1) / now.left_out.sum(axis=1))
    if np.exp(np.mean(np.log(each))) < BETTER and chance(now, fit) < CHANCE:
        return True
    before, after = np.sqrt(now.error / bench.spread), np.sqrt(fit.error / bench.spread)
    mean, error = gain(now, fit)
    limit = RICHER if fit.pieces == (SLIP, SLIP) else BETTER
    return after < min(before - WORTH, limit * before) and mean > SURE * error


def _table(
    rig: Rig, design: SpringCurve | None, rows: Sequence[BenchRows]
) -> tuple[SpringTable, bool]:
    if design is not None:
        return design.table(), True
    K = rig.spring_stiffness_Nm_per_rad
    if K is not None:
        return linear_table(K), True
    over = sum(np.sum(_centred(r.deflection_rad) * _centred(r.torque_Nm)) for r in rows)
    return linear_table(
        float(over / sum(np.sum(_centred(r.deflection_rad) ** 2) for r in rows))
    ), False


def _centred(values):
    return values - values.mean()


def name_of(pieces: Sequence[str]) -> str:
    """The name of a choice of explanations."""
    if not pieces:
        return "scale"
    named = [p for p in PIECES if p in pieces and p != SLIP]
    if SLIP in pieces:
        named.insert(0, "hysteresis" if list(pieces).count(SLIP) > 1 else SLIP)
    return " and ".join(named)


def _candidate(bench: Bench, fit: Fit) -> SpringCandidate:
    scale, std = bench.flank(fit)
    return SpringCandidate(
        name=name_of(fit.pieces), error=float(np.sqrt(fit.error / bench.spread)),
        in_sample=float(np.sqrt(fit.in_sample / bench.spread)), scale=scale, scale_std=std,
        parameters=parameters_of(bench, fit.columns, fit.coefficients), fit=fit,
    )  # fmt: skip


def parameters_of(bench: Bench, columns: Sequence[int], coefficients) -> dict[str, float]:
    """What a fit's columns were made with and what stands before them."""
    found: dict[str, float] = {}
    sliders = [j for j in columns if bench.columns[j].piece == SLIP]
    moved = 0.0
    for j, c in zip(columns, coefficients, strict=True):
        piece = bench.columns[j].piece
        if piece == SLIP:
            tag = f"_{sliders.index(j) + 1}" if len(sliders) > 1 else ""
            found[f"reach{tag}_rad"] = bench.columns[j].parameters["reach_rad"]
            found[f"stiffness_{sliders.index(j) + 1}_Nm_per_rad"] = float(c)
            moved += float(c) * bench.per_stiffness
        elif piece:
            if piece == ASYMMETRY:
                found["other_way"] = bench.other_sign
            key = piece.replace(" ", "_")
            found[f"{key}_coefficient"] = float(c)
            found |= {f"{key}_{k}": v for k, v in bench.columns[j].parameters.items()}
    if sliders:
        flank = float(coefficients[0]) + moved
        found["slipping_share"] = moved / flank if flank > 0.0 else float("nan")
    return found


def _held_out(bench: Bench, fit: Fit | None, held: Sequence[BenchRows]) -> float:
    if fit is None or not held:
        return float("nan")
    squares = whole = 0.0
    for r in held:
        error = r.torque_Nm - bench.predicted(r, fit)
        squares += float(np.sum((error - offset_of(r, error)) ** 2))
        whole += float(np.sum(_centred(r.torque_Nm) ** 2))
    return float(np.sqrt(squares / whole))


def _as_designed(bench: Bench) -> SpringCandidate:
    squares = 0.0
    for r in bench.rows:
        error = r.torque_Nm - spring_torque_Nm(bench.table, r.deflection_rad - zero_of(r))
        squares += float(np.sum((error - offset_of(r, error)) ** 2))
    error = float(np.sqrt(squares / bench.spread))
    return SpringCandidate(
        name="as designed", error=error, in_sample=error, scale=1.0, scale_std=0.0, parameters={}
    )


def _other_springs(bench: Bench, held: Sequence[BenchRows]) -> tuple[Finding, ...]:
    """Validation recordings whose stiffness has nothing to do with that of the others."""
    stiffnesses = [_slope(r) for r in bench.rows]
    low, high = min(stiffnesses) / OTHER_SPRING, max(stiffnesses) * OTHER_SPRING
    return tuple(
        Finding(
            kind=Kind.OTHER_SPRING, file=r.file, column="torque_Nm", is_question=True,
            text=f"its torque rises by {_slope(r):.3g} Nm/rad, in the recordings that were fitted"
            f" by {min(stiffnesses):.3g} to {max(stiffnesses):.3g}: another spring",
        )
        for r in held
        if not low < _slope(r) < high
    )  # fmt: skip


def _not_one(bench: Bench, best: SpringCandidate) -> tuple[Finding, ...]:
    """Whether each recording is far better explained with a stiffness of its own."""
    ranges = np.array([np.ptp(r.torque_Nm) for r in bench.rows])
    found = np.array(bench.alone(best.fit))[ranges > LARGE * ranges.max()]
    factors, own, shared = found.T
    if factors.size < 2 or not np.all(factors > 0.0):
        return ()
    times = np.sqrt(shared.sum() / max(float(own.sum()), 1e-300))
    if factors.max() < APART * factors.min() or times < CLEARLY:
        return ()
    low, high = (best.scale * bench.stiffness * f for f in (factors.min(), factors.max()))
    text = (
        f"each recording is explained by a different stiffness {times:.2g} times better, from"
        f" {low:.4g} to {high:.4g} Nm/rad: these are not one spring, or its mounting was changed"
    )
    return (Finding(kind=Kind.SEVERAL_SPRINGS, text=text),)


def _slope(r: BenchRows) -> float:
    x, y = _centred(r.deflection_rad), _centred(r.torque_Nm)
    return float(abs(x @ y) / max(float(x @ x), 1e-300))
