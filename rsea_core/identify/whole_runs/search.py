"""Laws with which whole recordings are predicted to the sensors' noise.

Where parameters alone leave more, laws are added, each the one that lowers the error most, and
redundant ones removed. Laws that leave nothing but noise stand; others prove nothing
(docs/diagnosis-search.md 10.4).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rsea_core.effects.drive_dead_zone import DriveDeadZone
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import at_bound, count_values, fitted, settled
from rsea_core.identify.law_search.order_analysis import along_motion
from rsea_core.identify.law_search.pulses import pulse_ratio, pulses
from rsea_core.identify.law_search.screening import Candidate, Projection, screen, screen_again
from rsea_core.identify.multistep.criteria import (
    ALIKE_OF_GAIN,
    CLOSE_FIRST,
    CLOSE_TO_BEST,
    EXPLAINED,
    FIRST_RIVALS,
    LEAST_EXCESS,
    LEAST_OF_BEST,
    LEAST_OF_LEFT,
    LEFT_OF_EACH,
    NEARLY_EXPLAINED,
    NEEDS_NO_WINDOWS,
    NEGLIGIBLE_INCREASE,
    ORDERS,
    PER_VALUE,
    PRIOR_AMONG_ALIKE,
    PULSE_IN_WINDOWS,
    PULSES,
    QUICK_ITERATIONS,
    RICHER_GAIN,
    SAME_END,
    UNPREDICTED,
    WHOLE_LAWS,
    WHOLE_RIVALS,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import ANGLES
from rsea_core.identify.whole_runs.coarse_steps import in_coarse_steps, with_costs_of
from rsea_core.identify.whole_runs.forms import most_promising, of_other_effects
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    excess,
    misfit,
    refitted_from_rig,
)
from rsea_core.identify.whole_runs.short_rivals import rivals_of_short_windows
from rsea_core.identify.whole_runs.taken_laws import SIZES, TakenLaws, Trial, best_of_each_effect
from rsea_core.identify.whole_runs.unseen import needed, unseen_share, without
from rsea_core.numeric.work_limit import no_work_left


class WholeSearch(TakenLaws):
    """The search: a law added, redundant ones removed, each compared with its rivals."""

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
            return self.add_small(trials, say)
        self.first = self.first or trials
        self.take(best, self.to_minimum(best), trials, say)
        return True

    def add_small(self, trials: Sequence[Trial], say, share: float = EXPLAINED) -> bool:
        """Take a law that gains little, if it explains a share of what is left; whether one does.

        Beside a large effect a small one gains a small share of the cost. A wrong law explains only
        part of the errors that an inexact form of another law leaves. A torque that acts once can
        fit most of such an error where the motion is large: it must explain `NEEDS_NO_WINDOWS`.
        """
        before = self.excess()
        if before == 0.0:  # one reading errs, and others less than their noise
            return False
        lasting = [t for t in trials if t.law.effect != LoadDisturbance.effect]
        tried = [(t, share) for t in lasting[:1]]
        if trials and (not lasting or trials[0] is not lasting[0]):
            tried.insert(0, (trials[0], NEEDS_NO_WINDOWS))
        for best, least in tried:
            if not self.taken or best.gain < NEARLY_EXPLAINED * before:
                continue
            fit = self.to_minimum(best)
            explained = 1.0 - excess(self.own, fit.hypothesis, fit.x) / before
            say(f"  whole recordings: {best.law.key} explains {explained:.2f} of what others leave")
            if explained >= least:
                self.take(best, fit, trials, say)
                return True
        return False

    def add_last(self, say, share: float = EXPLAINED) -> bool:
        """Take a small law beside complete ones, which explains a share of what they leave.

        It must predict rows unseen. Further values of the laws before may have followed the error
        that it explains: plainer forms of these are tried beside it.
        """
        if self.excess() < LEAST_EXCESS or not 0 < len(self.taken) < WHOLE_LAWS:
            return False
        if not self.add_small(self.trials(), say, share):
            return False
        for law in tuple(self.taken[:-1]):
            self.plainer_form(law, say, -self.doubt())
        self.compare(say, last=True)
        self.predict(say)
        return True

    def trials(self) -> list[Trial]:
        """Candidates fitted beside what was taken, best first."""
        have = {(law.effect, law.sensor) for law in self.taken}
        left = [w for w in self.laws if (w.effect, w.sensor) not in have]
        projection = Projection(self.own, self.fit)
        screened = screen(self.own, self.fit, left, wrong_signs=True, projection=projection)
        screened = screen_again(self.own, self.fit, screened, projection=projection)
        if (LoadDisturbance.effect, None) not in have:
            screened += pulses(projection)[:PULSES]
        candidates = most_promising(screened) + self.of_free_pitch(left)
        candidates += along_motion(projection, left)[:ORDERS]
        candidates += of_other_effects(screened, candidates)
        quick = in_coarse_steps(self.own, self.fit, self.left())
        trials = self.fitted(self.fit, candidates, quick, iterations=QUICK_ITERATIONS)
        least = CLOSE_TO_BEST * max((t.gain for t in trials), default=0.0)
        trials = [self.continued(t) if t.gain > least else t for t in trials]
        return sorted(trials, key=lambda t: -t.gain)

    def of_free_pitch(self, laws: Sequence[Law]) -> list[Candidate]:
        """Cogging of a free pitch, from the pitch that windows show.

        Errors of whole recordings accumulate, so that almost any pitch lowers them.
        """
        laws = [law for law in laws if law.kind is MotorCogging and not law.fixed_numbers]
        base = self.found.base_estimator, self.found.base
        return along_motion(Projection(*base), laws) if laws else []

    def fitted(
        self, base: Estimate, candidates: Sequence[Candidate], quick: Estimator | None = None,
        iterations: int = 8,
    ) -> list[Trial]:  # fmt: skip
        """Candidates fitted beside a fit, best first; without those that end at a bound.

        The best of these is kept (`best_at_bound`) where it would be the first law taken. A fit
        ends where it can gain no more than a share of the best gain so far.

        Parameters
        ----------
        quick : Estimator or None
            In which candidates are fitted (`in_coarse_steps`); their gains are those of the
            search's own estimator.
        """
        own = self.own if quick is None else quick
        start = base if own is self.own else with_costs_of(own, base)
        found, bounded = [], []
        shared = own.jacobian(start.hypothesis, start.x)[1] if len(candidates) > 1 else None
        for c in candidates:
            gained = max((t.gain for t in found), default=0.0)
            target = start.cost - LEAST_OF_BEST * gained if gained > 0.0 else np.inf
            limits = {"iterations": iterations, "target_cost": target}
            fit = fitted(own, start, c, factors=SIZES, shared=shared, **limits)
            fit = fit if own is self.own else with_costs_of(self.own, fit)
            gain = base.cost - fit.cost - PER_VALUE * count_values(c.law)
            if np.isfinite(gain):
                left = misfit(self.own, fit.hypothesis, fit.x)
                ends = bounded if at_bound(self.own.problem, fit, c.law) else found
                ends.append(Trial(candidate=c, fit=fit, gain=gain, left=left))
        found.sort(key=lambda t: -t.gain)
        if not self.taken and bounded:
            best = max(bounded, key=lambda t: t.gain)
            self.best_at_bound = best if not found or best.gain > found[0].gain else None
        return found

    def add_all(self, say) -> None:
        """Take laws until what they leave is small enough, or none lowers the error further."""
        for _ in range(WHOLE_LAWS - len(self.taken)):
            if self.left() <= self.enough or not self.add(say):
                return
            self.prune(say)

    def begun_at_bound(self, say) -> "WholeSearch | None":
        """A search that begins with a law that fitted best alone, but at a bound.

        Alone, a law also follows the error of another one that is missing: a winding is hotter than
        any insulation allows where friction is not known yet. None where there is no such law,
        where it explains too little, where the search leaves no less than this one, or where a law
        stays at a bound.
        """
        if self.best_at_bound is None or self.left() <= self.enough:
            return None
        unexplained = excess(self.own, self.plain.hypothesis, self.plain.x)
        if self.best_at_bound.gain < NEARLY_EXPLAINED * unexplained or no_work_left():
            return None
        other = WholeSearch(self.own, self.plain, self.found, self.laws, self.enough)
        first = self.continued(self.best_at_bound)
        say(f"  whole recordings: searched again from {first.law.key}, at a bound if alone")
        other.take(first, first.fit, [first, *self.first], say)
        other.first = self.first
        if not other.add(say) or other.left() > self.left():
            return None
        other.prune(say)
        other.add_all(say)
        other.fit = converged(other.own, other.fit.hypothesis, other.fit.x)
        if other.left() > LEFT_OF_EACH * self.left():
            return None
        for law in tuple(other.taken):
            if at_bound(other.own.problem, other.fit, law) and not other.plainer_form(law, say):
                say(f"  whole recordings: {law.key} stays at a bound")
                return None
        return other

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

    def seek_rivals(self, say) -> None:
        """If the only law leaves more than noise, add rivals that were fitted in short windows."""
        if len(self.taken) != 1 or self.excess() < LEAST_EXCESS or no_work_left():
            return
        law = self.taken[0]
        others = [w for w in self.laws if (w.effect, w.sensor) != (law.effect, law.sensor)]
        found = rivals_of_short_windows(self.own, self.plain, self.fit, others)
        for t in found:
            say(f"  whole recordings: {t.law.key}, from short windows, leaves {t.left:.2f}")
        self.rivals[law.key] = _with_trials(self.rivals[law.key], found)
        self.first = _with_trials(self.first, found)

    def compare(self, say, last: bool = False) -> None:
        """Each law against its rivals beside the others; the plainest of those alike is taken.

        Parameters
        ----------
        last : bool
            Only the law taken last.
        """
        for law in tuple(self.taken[-1:] if last else self.taken):
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
            best = plainest(trials, self.doubt())
            if best.law is not law:
                say(f"  whole recordings: {best.law.key} in place of {law.key}")
            self.fit = best.fit
            self.taken = [w for w in self.taken if w is not law] + [best.law]
            self.rivals[best.law.key] = trials

    def predict(self, say) -> None:
        """Take out laws that do not predict rows which they were not fitted to.

        Rows unseen do not tell whether a torque acted once. It must also stand out in windows,
        where the unknown torque that acts all the time is part of the noise.
        """
        for law in tuple(self.taken):
            less = without(self.own, self.fit, law)
            predicts, self.ratios[law.key] = needed(self.own, self.fit, law, less)
            if predicts and law.only is not None:
                ratio = self.ratios[law.key] = self.ratio_in_windows(less)
                say(f"  whole recordings: {law.key} has a ratio of {ratio:.1f} in windows")
                predicts = ratio > PULSE_IN_WINDOWS
            if not predicts:
                say(f"  whole recordings: {law.key} is removed: it is not confirmed")
                self.fit = less
                self.taken.remove(law)

    def ratio_in_windows(self, less: Estimate) -> float:
        """Gain in windows over a fit without a pulse, over the other stretches' scatter."""
        own = self.found.base_estimator
        own, fit = settled(own, own.fit(self.fit.hypothesis, self.fit.x), once=True)
        return pulse_ratio(own, less, fit)

    def complete(self, say) -> bool:
        """Whether the laws leave nothing but noise, and predict rows unseen."""
        enough = bool(self.taken) and self.left() <= self.enough
        return enough and (
            unseen_share(self.found, self.own, self.fit, self.plain, say) < UNPREDICTED
        )


def begun_with_rival(search: WholeSearch, say) -> WholeSearch | None:
    """A complete search that begins with a close rival of the first law; None if none is.

    Two laws can explain nearly the same alone (a spring and an eccentric mass over a small angle);
    with the wrong one of the two, no further law fits.
    """
    first = best_of_each_effect(search.first)
    if search.left() <= search.enough or not search.taken or not first:
        return None
    others = [t for t in first[1:] if t.law.only is None]
    for t in others[:FIRST_RIVALS]:
        if t.gain < CLOSE_FIRST * first[0].gain or no_work_left():
            break
        say(
            f"  whole recordings: searched again from {t.law.key}, which alone gains nearly as much"
        )
        other = type(search)(search.own, search.plain, search.found, search.laws, search.enough)
        other.take(t, other.to_minimum(t), first, say)
        other.first = search.first
        other.add_all(say)
        if other.left() <= other.enough:
            return other
    return None


def _with_trials(known: Sequence[Trial], others: Sequence[Trial]) -> list[Trial]:
    """Known trials and others, which replace those of the same law, best first."""
    keys = {t.law.key for t in others}
    kept = [t for t in known if t.law.key not in keys]
    return sorted([*kept, *others], key=lambda t: -t.gain)


def _converged(search: WholeSearch, law: Law, trials: Sequence[Trial]) -> list[Trial]:
    """Trials of single laws: the law's refined fit, and its close rivals fitted to convergence."""
    near = [t for t in best_of_each_effect(trials) if t.gain > CLOSE_TO_BEST * trials[0].gain]
    found = []
    for t in trials:
        fit = search.fit if t.law is law else t.fit
        if t.law is not law and any(t is other for other in near[:WHOLE_RIVALS]):
            fit = converged(search.own, fit.hypothesis, fit.x)
            if fit.cost < search.fit.cost + search.doubt():  # as near to the rig file as the law's
                fit = refitted_from_rig(search.own, fit)
        left = misfit(search.own, fit.hypothesis, fit.x)
        gain = search.plain.cost - fit.cost - PER_VALUE * count_values(t.law)
        found.append(replace(t, fit=fit, gain=gain, left=left))
    return sorted(found, key=lambda t: -t.gain)


def worth(trial: Trial) -> float:
    """Gain of a law less a price: dependent errors give every further value some gain."""
    return trial.gain - RICHER_GAIN * count_values(trial.law)


def explained_once(search: WholeSearch) -> float:
    """Share of what parameters leave that the first law explains, if it acts once; else 0."""
    first = search.first[0] if search.first else None
    once = first is not None and first.law.effect == LoadDisturbance.effect
    return first.gain / max(search.found.excess, 1.0) if once else 0.0


def plainest(trials: Sequence[Trial], doubt: float) -> Trial:
    """Of laws that gain as much as the best, as far as can be told, the plainest.

    Every machine has friction: where it explains as much, no dead zone of the drive is named.
    Encoders have whole counts, and gears are accurate: where a spring explains as much, neither a
    scale factor of an angle nor a transmission error is named; a scale factor before such an error.
    Uneven rows of a log leave an error in proportion to the gain, which further values can fit.
    Of equally plain laws one that keeps the machine close to its rig file is taken unless it gains
    far less: two encoders that disagree by a factor do not tell which of them is wrong. What acts
    on a rigid train acts alike in the gear and at the load: it is named at the load.
    """
    best = max(trials, key=worth)
    doubt = max(doubt, ALIKE_OF_GAIN * best.gain)
    alike = [t for t in trials if worth(t) > worth(best) - doubt]

    def complexity(t: Trial) -> tuple[bool, bool, int]:
        of_angle = t.law.effect == SensorScale.effect and t.law.sensor in ANGLES
        of_angle |= t.law.effect == GearTransmissionError.effect
        return t.law.effect == DriveDeadZone.effect, of_angle, count_values(t.law)

    def cost(t: Trial) -> float:
        return PRIOR_AMONG_ALIKE * t.fit.prior_cost - t.gain

    plain = [t for t in alike if complexity(t) == min(map(complexity, alike))]
    least = min(map(cost, plain))
    same = [t for t in plain if cost(t) < least + SAME_END]
    return min(same, key=lambda t: (t.law.subsystem != "load", cost(t)))
