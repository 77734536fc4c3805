"""Laws taken so far in a search of whole recordings, and their other forms."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import at_bound, count_values, fitted
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.richer_laws import begun_with
from rsea_core.identify.law_search.screening import Candidate, screen, screen_again
from rsea_core.identify.multistep.criteria import (
    DOUBT,
    NEIGHBOURS,
    PER_VALUE,
    RIVAL_SCALE,
    SHORTLISTED,
    WHOLE_FORMS,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.whole_runs.forms import alike, holds, richer_of
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    excess,
    misfit,
    refitted_from_rig,
    well_fitted,
)
from rsea_core.identify.whole_runs.unseen import other_values, without

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


def best_of_each_effect(trials: Sequence[Trial]) -> list[Trial]:
    """The best trial of each effect and reading, best first."""
    found: dict[tuple, Trial] = {}
    for t in trials:
        found.setdefault((t.law.effect, t.law.sensor), t)
    return list(found.values())


@dataclass
class TakenLaws:
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
        self.best_at_bound: Trial | None = None

    def doubt(self) -> float:
        """Units by which a law may lose against a rival by what nothing explains."""
        return RIVAL_SCALE + DOUBT * self.excess()

    def excess(self) -> float:
        """Cost of the errors beyond noise with the laws taken."""
        return excess(self.own, self.fit.hypothesis, self.fit.x)

    def left(self) -> float:
        """Misfit with the laws taken."""
        return misfit(self.own, self.fit.hypothesis, self.fit.x)

    def plain_excess(self) -> float:
        """What parameters alone leave above the noise, in units."""
        return max(self.plain.cost - self.fit.cost, 0.0) + 1.0

    def take(self, best: Trial, fit: Estimate, trials: Sequence[Trial], say) -> None:
        """A trial's law, with its fit of whole recordings."""
        self.fit = fit
        self.taken.append(best.law)
        self.rivals[best.law.key] = list(trials)
        self.nearest_number(best.law, say)

    def shortlist(self) -> frozenset[str]:
        """Effects of the laws taken, and of trials that gained a share of what the best did."""
        effects = {law.effect for law in self.taken}
        for trials in (self.first, *self.rivals.values()):
            least = SHORTLISTED * max((t.gain for t in trials), default=0.0)
            effects |= {t.law.effect for t in trials if t.gain > least}
        return frozenset(effects)

    def continued(self, trial: Trial) -> Trial:
        """A trial after more iterations of its fit."""
        fit = self.own.fit(trial.fit.hypothesis, trial.fit.x, iterations=8)
        gain = trial.gain + trial.fit.cost - fit.cost
        return replace(trial, fit=fit, gain=gain, left=misfit(self.own, fit.hypothesis, fit.x))

    def to_minimum(self, trial: Trial) -> Estimate:
        """A trial's fit, continued to its minimum; to the lowest of several if it leaves much."""
        fit = converged(self.own, trial.fit.hypothesis, trial.fit.x)
        if misfit(self.own, fit.hypothesis, fit.x) <= self.enough:
            return refitted_from_rig(self.own, fit)
        return well_fitted(self.own, fit)

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

    def plainer_form(self, law: Law, say, least: float = -np.inf) -> bool:
        """Take the best plainer form of a law; whether one ends at no bound and gains enough.

        Parameters
        ----------
        least : float
            Gain: below zero what a plainer form may lose.
        """
        own, h = self.own, self.fit.hypothesis
        known = own.problem.values(h, self.fit.x)[1][h.laws.index(law)]
        base = without(own, self.fit, law)
        others = (other_values(own, self.fit, law),)
        begun = [begun_with(own, base, w, known, others) for w in self.laws if holds(law, w)]
        ends = [self.in_place_of(law, converged(own, *start[1:])) for start in begun]
        best = max(filter(None, ends), key=lambda t: t.gain, default=None)
        if best is None or best.gain < least:
            return False
        self.replaced(law, best, say)
        return True

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
