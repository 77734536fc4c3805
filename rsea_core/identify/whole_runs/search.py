"""Laws with which whole recordings are predicted to the sensors' noise (docs/diagnosis.md 10.4).

Where parameters alone leave more than that, laws are added one by one, each the one that lowers
the error most, until nothing is left; then those are taken out that the others make redundant. A
set of laws that leaves nothing but noise stands, and no windows are searched; one that leaves more
proves nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.effects.drive_dead_zone import DriveDeadZone
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import at_bound, count_values, fitted
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.pulses import pulses
from rsea_core.identify.law_search.richer_laws import begun_with
from rsea_core.identify.law_search.screening import Candidate, Projection, screen, screen_again
from rsea_core.identify.multistep.criteria import (
    CLOSE_TO_BEST,
    DOUBT,
    LEAST_OF_LEFT,
    LEFT_OF_EACH,
    MANY_STARTS,
    NEGLIGIBLE_INCREASE,
    NEIGHBOURS,
    PER_VALUE,
    PULSES,
    QUICK_ITERATIONS,
    RICHER_GAIN,
    RIVAL_SCALE,
    UNPREDICTED,
    WHOLE_FORMS,
    WHOLE_RIVALS,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.whole_runs.forms import (
    alike,
    holds,
    most_promising,
    of_other_effects,
    richer_of,
)
from rsea_core.identify.whole_runs.sensor_noise import excess, misfit, well_fitted
from rsea_core.identify.whole_runs.unseen import needed, other_values, unseen_share, without

CONVERGED = 60  # iterations at most, of the law that is taken: its minimum may be flat
SIZES = (1.0, 0.3, 0.1)  # of the size that the screening saw: starts


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One candidate beside other laws, fitted to whole recordings.

    Attributes
    ----------
    gain : float
        Fall of the cost, less the price of the law's values.
    left : float
        Misfit [noise deviations].
    """

    candidate: Candidate
    fit: Estimate
    gain: float
    left: float

    @property
    def law(self) -> Law:
        """The candidate's law."""
        return self.candidate.law


@dataclass
class WholeSearch:
    """Laws taken so far, and what each was compared with."""

    own: Estimator
    plain: Estimate
    found: Found  # by parameters alone
    laws: Sequence[Law]
    enough: float  # misfit that is as good as none

    def __post_init__(self) -> None:
        self.fit, self.taken = self.plain, []
        self.rivals: dict[str, list[Trial]] = {}
        self.ratios: dict[str, float] = {}
        self.tried_forms: set[str] = set()
        self.first: list[Trial] = []

    def doubt(self) -> float:
        """Units by which a law may lose against a rival by what nothing explains."""
        return RIVAL_SCALE + DOUBT * excess(self.own, self.fit.hypothesis, self.fit.x)

    def left(self) -> float:
        """Misfit with the laws taken."""
        return misfit(self.own, self.fit.hypothesis, self.fit.x)

    def add(self, say) -> bool:
        """Take the law that lowers the error most; whether there is one."""
        trials = self.trials()
        worth = [t.gain for t in trials[:1] if t.left <= LEFT_OF_EACH * self.left()]
        least = max(max(worth, default=0.0) - self.doubt(), LEAST_OF_LEFT * self.plain_excess())
        if self.better_form(least, LEFT_OF_EACH, say):
            return True
        for best in trials[:1]:
            say(f"  whole recordings: {best.law.key} gains {best.gain:.0f}, leaves {best.left:.2f}")
        if not worth or worth[0] < LEAST_OF_LEFT * self.plain_excess():
            return False
        self.first = self.first or trials
        fit = self.own.fit(best.fit.hypothesis, best.fit.x, iterations=CONVERGED)
        self.fit = well_fitted(self.own, fit)
        self.taken.append(best.law)
        self.rivals[best.law.key] = trials
        self.nearest_number(best.law, say)
        return True

    def better_form(self, least: float, share: float, say) -> bool:
        """Take another form of a law; whether there is one worth it.

        A law that is not quite right leaves errors which a further, wrong one may follow.

        Parameters
        ----------
        least : float
            Gain.
        share : float
            Of what is left, that it may leave.
        """
        trials = [t for law in self.taken for t in self.other_forms(law)]
        best = max(trials, key=lambda t: t[1].gain, default=None)
        if best is None:
            return False
        law, trial = best
        if trial.gain < least or trial.left > share * self.left():
            return False
        self.replaced(law, trial, say)
        return True

    def refine(self, say) -> None:
        """Forms of the laws taken that are clearly better; rivals are compared beside these."""
        self.tried_forms.clear()
        while self.better_form(self.doubt(), 1.0, say):
            pass

    def nearest_number(self, law: Law, say) -> None:
        """Take a law's like with another fixed number, or with its harmonic, that leaves less.

        13 cycles in a turn explain most of what 12 do, and 16 explain more than 14 alone of 14
        cycles with their harmonic: a screening about parameters that are far off does not tell
        which number is right.
        """
        if not alike(law, self.laws) and not richer_of(law, self.laws):
            return
        own, tried, taken = self.own, {law.key}, law
        base = without(own, self.fit, law)
        number = [self.with_harmonic(law, self.fit, base)]
        while True:
            near = [w for w in alike(law, self.laws) if w.key not in tried][:NEIGHBOURS]
            tried |= {w.key for w in near}
            for c in screen_again(own, base, screen(own, base, near)) if near else []:
                fit = fitted(own, base, c, factors=SIZES)
                number += [(c.law, fit), self.with_harmonic(c.law, fit, base)]
            trials = [(w, self.in_place_of(taken, f)) for w, f in filter(None, number)]
            better = [t for t in trials if t[1] is not None and t[1].gain > 0.0]
            law, best = max(better, key=lambda t: t[1].gain, default=(law, None))
            if best is None or best.left >= self.left():
                return
            self.replaced(taken, best, say)
            taken, number = best.law, []

    def with_harmonic(self, law: Law, fit: Estimate, base: Estimate) -> tuple | None:
        """A law of a fixed number, and its fit with a further wave; None where it has none."""
        forms = richer_of(law, self.laws)
        if not forms:
            return None
        known = self.own.problem.values(fit.hypothesis, fit.x)[1][fit.hypothesis.laws.index(law)]
        others = (other_values(self.own, fit, law), base.x)
        _, h, x = begun_with(self.own, base, forms[0], known, others)
        return law, self.own.fit(h, x, iterations=8)

    def other_forms(self, law: Law) -> list[tuple[Law, Trial]]:
        """A taken law, and what laws of its effect that hold it gain in its place."""
        forms = [w for w in self.laws if holds(w, law) and w.key not in self.tried_forms]
        self.tried_forms |= {w.key for w in forms}
        if not forms:
            return []
        own, h = self.own, self.fit.hypothesis
        known = own.problem.values(h, self.fit.x)[1][h.laws.index(law)]
        base = without(own, self.fit, law)
        others = (other_values(own, self.fit, law), base.x)
        begun = [begun_with(own, base, form, known, others) for form in forms]
        trials = [
            self.in_place_of(law, own.fit(hypothesis, x, iterations=8))
            for _, hypothesis, x in sorted(begun, key=lambda b: b[0])[:WHOLE_FORMS]
        ]
        return [(law, t) for t in trials if t is not None]

    def replaced(self, law: Law, trial: Trial, say) -> None:
        """A law replaced by the one of a trial."""
        say(f"  whole recordings: {trial.law.key} in place of {law.key} gains {trial.gain:.0f}")
        self.fit = trial.fit
        self.taken = [w for w in self.taken if w is not law] + [trial.law]
        alone = replace(trial, gain=self.rivals[law.key][0].gain + trial.gain)
        self.rivals[trial.law.key] = [alone, *self.rivals[law.key]]

    def in_place_of(self, law: Law, fit: Estimate) -> Trial | None:
        """What a fit gains whose last law takes the place of another one."""
        own, form = self.own, fit.hypothesis.laws[-1]
        more = count_values(form) - count_values(law)
        gain = self.fit.cost - fit.cost - PER_VALUE * more
        if not np.isfinite(gain) or at_bound(own.problem, fit, form):
            return None
        values = own.problem.values(fit.hypothesis, fit.x)[1][-1]
        c = Candidate(
            law=form, start=tuple(values[p.name] for p in form.unknowns), gain=gain,
            held_out=gain, deviation=0.0, size=1.0,
        )  # fmt: skip
        return Trial(candidate=c, fit=fit, gain=gain, left=misfit(own, fit.hypothesis, fit.x))

    def plain_excess(self) -> float:
        """What parameters alone leave above the noise, in units."""
        return max(self.plain.cost - self.fit.cost, 0.0) + 1.0

    def trials(self) -> list[Trial]:
        """Candidates fitted beside what was taken, best first."""
        have = {(law.effect, law.sensor) for law in self.taken}
        left = [w for w in self.laws if (w.effect, w.sensor) not in have]
        screened = screen(self.own, self.fit, left, wrong_signs=True)
        screened = screen_again(self.own, self.fit, screened)
        if (LoadDisturbance.effect, None) not in have:
            screened += pulses(Projection(self.own, self.fit))[:PULSES]
        candidates = most_promising(screened) + self.of_many_starts(left)
        trials = self.fitted(self.fit, candidates)
        least = CLOSE_TO_BEST * max((t.gain for t in trials), default=0.0)
        others = of_other_effects(screened, candidates)
        quick = self.fitted(self.fit, others, iterations=QUICK_ITERATIONS)
        near = [t.candidate for t in quick if t.gain > least]
        return sorted(trials + self.fitted(self.fit, near), key=lambda t: -t.gain)

    def of_many_starts(self, laws: Sequence[Law]) -> list[Candidate]:
        """Laws whose wave may have any length, begun at the length that windows show.

        Errors of whole recordings accumulate, so that a wave of almost any length lowers them.
        """
        laws = [law for law in laws if len(law.starts) > MANY_STARTS]
        return screen(self.found.base_estimator, self.found.base, laws) if laws else []

    def fitted(
        self, base: Estimate, candidates: Sequence[Candidate], iterations: int = 8
    ) -> list[Trial]:
        """Candidates fitted beside a fit, best first."""
        found = []
        for c in candidates:
            fit = fitted(self.own, base, c, factors=SIZES, iterations=iterations)
            gain = base.cost - fit.cost - PER_VALUE * count_values(c.law)
            if np.isfinite(gain) and not at_bound(self.own.problem, fit, c.law):
                left = misfit(self.own, fit.hypothesis, fit.x)
                found.append(Trial(candidate=c, fit=fit, gain=gain, left=left))
        return sorted(found, key=lambda t: -t.gain)

    def prune(self, say) -> None:
        """Remove laws without which the misfit is small enough, or increases by a negligible share.

        A law that was taken first may have explained what a later one explains better.
        """
        most = max(self.enough, NEGLIGIBLE_INCREASE * self.left())
        for law in tuple(self.taken[:-1]):
            less = without(self.own, self.fit, law)
            if misfit(self.own, less.hypothesis, less.x) < most:
                say(f"  whole recordings: {law.key} is redundant")
                self.fit = less
                self.taken.remove(law)

    def compare(self, say) -> None:
        """Each law against its rivals beside the others; the plainest of those alike is taken."""
        for law in tuple(self.taken):
            trials = self.rivals[law.key]
            mine = next(t for t in trials if t.law is law)
            alone = len(self.plain.hypothesis.laws) + 1
            if max(len(self.fit.hypothesis.laws), len(mine.fit.hypothesis.laws)) > alone:
                others = {(w.effect, w.sensor) for w in self.taken if w is not law}
                near = [
                    t.candidate for t in best_of_each_effect(trials)
                    if (t.law.effect, t.law.sensor) not in others and t.law is not law
                ]  # fmt: skip
                less = without(self.own, self.fit, law)
                gain = less.cost - self.fit.cost - PER_VALUE * count_values(law)
                own = replace(mine, fit=self.fit, gain=gain, left=self.left())
                found = [own, *self.fitted(less, near[: WHOLE_RIVALS - 1])]
                trials = sorted(found, key=lambda t: -t.gain)
            else:
                trials = _converged(self, law, trials)
            best = _plainest(trials, self.doubt())
            if best.law is not law:
                say(f"  whole recordings: {best.law.key} in place of {law.key}")
            self.fit = best.fit
            self.taken = [w for w in self.taken if w is not law] + [best.law]
            self.rivals[best.law.key] = trials

    def predict(self, say) -> None:
        """Take out laws that do not predict rows which they were not fitted to."""
        for law in tuple(self.taken):
            less = without(self.own, self.fit, law)
            predicts, self.ratios[law.key] = needed(self.own, self.fit, law, less)
            if not predicts:
                say(f"  whole recordings: {law.key} does not predict rows that it has not seen")
                self.fit = less
                self.taken.remove(law)

    def complete(self, say) -> bool:
        """Whether the laws leave nothing but noise, and predict rows unseen."""
        enough = bool(self.taken) and self.left() <= self.enough
        return enough and (
            unseen_share(self.found, self.own, self.fit, self.plain, say) < UNPREDICTED
        )


def best_of_each_effect(trials: Sequence[Trial]) -> list[Trial]:
    """The best trial of each effect and reading, best first."""
    found: dict[tuple, Trial] = {}
    for t in trials:
        found.setdefault((t.law.effect, t.law.sensor), t)
    return list(found.values())


def _converged(search: WholeSearch, law: Law, trials: Sequence[Trial]) -> list[Trial]:
    """Trials of single laws: the law's refined fit, and its close rivals fitted to convergence."""
    near = [t for t in best_of_each_effect(trials) if t.gain > CLOSE_TO_BEST * trials[0].gain]
    found = []
    for t in trials:
        fit = search.fit if t.law is law else t.fit
        if t.law is not law and any(t is other for other in near[:WHOLE_RIVALS]):
            fit = search.own.fit(fit.hypothesis, fit.x, iterations=CONVERGED)
        gain = search.plain.cost - fit.cost - PER_VALUE * count_values(t.law)
        left = misfit(search.own, fit.hypothesis, fit.x)
        found.append(replace(t, fit=fit, gain=gain, left=left))
    return sorted(found, key=lambda t: -t.gain)


def worth(trial: Trial) -> float:
    """Gain of a law less a price: dependent errors give every further value some gain."""
    return trial.gain - RICHER_GAIN * count_values(trial.law)


def _plainest(trials: Sequence[Trial], doubt: float) -> Trial:
    """Of laws that gain as much as the best, as far as can be told, the plainest.

    Every machine has friction: where it explains as much, no dead zone of the drive is named.
    """
    best = max(map(worth, trials))
    alike = [t for t in trials if worth(t) > best - doubt]
    return min(
        alike, key=lambda t: (t.law.effect == DriveDeadZone.effect, count_values(t.law), -t.gain)
    )
