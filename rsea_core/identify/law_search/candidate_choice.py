"""Which of the laws that were screened are worth a fit (docs/diagnosis-search.md 10.4).

One screening sees what it can see: innovations forget what a filter with unknown torques absorbs,
long windows lose the phase, and values that moved to take a law's part hide it. So laws are
screened in the windows where they are judged, in short ones, by output error, and beside a fit
that stays close to the rig file.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.catalogue import of_one_body
from rsea_core.identify.law_search.candidate_fits import by_output_error, close_to_rig, far_from_rig
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.order_analysis import along_motion
from rsea_core.identify.law_search.pulses import pulses
from rsea_core.identify.law_search.screening import Candidate, Projection, screen
from rsea_core.identify.multistep.criteria import (
    DOUBTED_ERROR,
    HORIZONS,
    LATE_ROWS,
    LEAST_GAIN,
    PARENT,
    PULSES,
    SHORT,
    TRIED,
    TRIED_APART,
    TRIED_SHORT,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import (
    relative_error,
    with_windows,
    without_slow_torque,
)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What is fitted next.

    Attributes
    ----------
    candidates : list of Candidate
        Those that the screening of the judged windows shows come first.
    apart : set of str
        Keys of laws that only another screening shows: they are fitted to their ends, for a rough
        fit from where they were not seen says little of them.
    screened : list of Candidate
        All laws, in the windows where they are judged.
    short : Estimator or None
        In shorter windows, in which a fit begins; None where the judged ones are short and the fit
        before predicts them closely.
    """

    candidates: list[Candidate]
    screened: list[Candidate]
    short: Estimator | None
    apart: set[str] = field(default_factory=set)


def promising(found: Found, laws: Sequence[Law], *, quick: bool) -> Choice:
    """The candidates beside what was found, from every screening."""
    estimator, base, first = found.estimator, found.best, not found.steps
    left = _left(found, laws)
    projection = Projection(estimator, base)
    screened = screen(estimator, base, left, projection=projection)
    if first:
        found.screened = screened
    short = None
    if found.horizon is None or found.horizon > SHORT:
        short = estimator.having(with_windows(estimator, SHORT))
    both = sorted([*screened, *along_motion(projection, left)], key=lambda c: -c.held_out)
    chosen = standing_out(both, estimator.tempering)
    once = any(law.effect == LoadDisturbance.effect for law in base.hypothesis.laws)
    if not (once or (quick and not first)):  # a second law needs the test by whole recordings
        chosen += pulses(Projection(without_slow_torque(estimator), base))[:PULSES]
    apart: set[str] = set()
    if short is not None:  # in phase, where a law that is far off still shows
        new = _new(standing_out(screen(short, base, left), estimator.tempering), chosen)
        chosen += new[:TRIED_SHORT]
        apart |= {c.law.key for c in new[:1]}
    others = [] if quick else [by_output_error(estimator, base)]
    if first and far_from_rig(found.problem, base.x):
        others.append(close_to_rig(estimator, base))
    for other, fit in others:
        new = _new(standing_out(screen(other, fit, left), other.tempering), chosen)
        chosen += _from(fit, new[:TRIED_APART])
        apart |= {c.law.key for c in new[:TRIED_APART]}
    late = [] if quick else _late_readings(found, left)
    apart |= {c.law.key for c in late}
    chosen = late + [c for c in chosen if all(c.law is not other.law for other in late)]
    short = short or _where_predicted_closely(found)
    return Choice(candidates=chosen, screened=screened, short=short, apart=apart)


def _where_predicted_closely(found: Found) -> Estimator | None:
    """The next shorter windows, if the fit before errs by much in those judged.

    Where the simulated angle errs by a period of the law or more, its fit has many minima.
    """
    own, best = found.estimator, found.best
    at = HORIZONS.index(found.horizon)
    if at == 0 or relative_error(own, best.hypothesis, best.x) < DOUBTED_ERROR:
        return None
    return own.having(with_windows(own, HORIZONS[at - 1]))


def _late_readings(found: Found, laws: Sequence[Law]) -> list[Candidate]:
    """Each reading with the delay that the fit gives the command.

    In a closed loop a command that acts late and a reading that is late look alike, and before the
    law of the reading is tried the fit can only delay the command.
    """
    problem, base = found.problem, found.best
    delay = next((law for law in base.hypothesis.laws if law.kind is DriveDelay), None)
    if delay is None or delay.unknowns[0].log:
        return []
    at = problem.names(base.hypothesis).index(f"{delay.effect}.delay_s")
    late = base.x[at] * delay.unknowns[0].scale
    if late < LATE_ROWS * min(e.recording.sample_time_s for e in problem.fitted):
        return []
    x = base.x.copy()
    x[at] = 0.0
    return [
        Candidate(law=law, start=(late,), gain=0.0, held_out=0.0, deviation=0.0, size=1.0,
                  start_values=x)
        for law in laws if law.kind is SensorDelay
    ]  # fmt: skip


def _left(found: Found, laws: Sequence[Law]) -> list[Law]:
    """Laws of effects that are not in yet."""
    have = {(law.effect, law.sensor) for law in found.best.hypothesis.laws}
    same = of_one_body(found.problem.case.rig)
    if same & {effect for effect, _ in have}:
        have |= {(effect, None) for effect in same}
    return [w for w in laws if (w.effect, w.sensor) not in have]


def _new(candidates: Sequence[Candidate], chosen: Sequence[Candidate]) -> list[Candidate]:
    names = {(c.law.effect, c.law.sensor) for c in chosen}
    return [c for c in candidates if (c.law.effect, c.law.sensor) not in names]


def _from(fit: Estimate, candidates: Sequence[Candidate]) -> list[Candidate]:
    return [replace(c, start_values=fit.x) for c in candidates]


def standing_out(screened: Sequence[Candidate], tempering: float) -> list[Candidate]:
    """The best candidate of each effect in each reading, as far as it stands out."""
    chosen: list[Candidate] = []
    names: set[tuple] = set()
    for c in screened:
        c, name = _plainest(c, screened), (c.law.effect, c.law.sensor)
        faint = c.held_out < 0.4 * LEAST_GAIN * tempering or c.held_out < 1.5 * c.deviation
        if not faint and name not in names and len(chosen) < TRIED:
            chosen.append(c)
            names.add(name)
    return chosen


def _plainest(c: Candidate, screened: Sequence[Candidate]) -> Candidate:
    """The law that holds fewer values and has this one among its richer forms, if it is as good.

    The richer forms are tried once more when the effect is chosen (`with_richer_law`).
    """
    for other in screened:
        same = (other.law.effect, other.law.sensor) == (c.law.effect, c.law.sensor)
        if same and c.law.law in other.law.richer and other.held_out > PARENT * c.held_out:
            return other
    return c
