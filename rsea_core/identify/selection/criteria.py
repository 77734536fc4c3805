"""What a search knows and how hypotheses are scored, in log-likelihood units; the thresholds that
they must pass."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import PreparedRecording, Problem
from rsea_core.identify.selection.screening import Candidate

# Thresholds: what each is, what it was set on and what guards it stands in `judgement.thresholds`.
FAR = 10.0
BLOCK_s = 0.1  # innovations of a wrong law are dependent for about this long
LAWS_TRIED = 2
CLOSE = 400.0  # log-likelihood behind the best within which more work on a fit could reverse it

PRICE = 2.0
WORTH, WORTH_FURTHER = 12.0, 20.0
ROOM = 1.7
TEMPERATURE = 12.0
LEAST_MSNI, QUIET_MSNI, NOISE_MSNI, ROUGH_MSNI = 0.8, 1.2, 2.0, 25.0
QUIET_PRIOR_COST = 6.0
EXPLAINED = 0.35
NOISE_SPREAD = 0.15
CHANCE = 0.01
DOUBTFUL_GAIN, FALSE_ALARMS = 80.0, 0.01
# a bridge repeats itself less well than the noise of the replays says: where parameters alone are
# near the noise, nulls have gained up to 70 (a load encoder's half count is one such gain)
NEAR_NOISE_MSNI, UNREPEATABLE_GAIN = 1.6, 80.0
# a further effect must take away most of what the first one left, or it only compensates an error
# of that law
LEFT_MOST, LEFT_SOMEWHERE, UNREACHABLE = 0.7, 0.4, 0.9
SHARE_OF_ALL, LEFT_CLEAR = 0.05, 0.3  # and be a part of the whole, or leave almost nothing
FREE_RUN_WORSE = 1e-3
SCALE_GAIN, SCALE_PRIOR_SHARE = 20.0, 0.2
SCALE_FARTHEST = 1.4
SCALE_LOG_ODDS, SCALE_OVER_OTHER_CAUSE, SCALE_REPORTED = 7.0, 2.3, 3.0


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much a search tries: counts, never seconds, so that results can be repeated.

    Attributes
    ----------
    tried, short_tried : int
        Laws whose fits begin, of those that free runs and short runs propose.
    tried_more : int
        The same of a further effect, half of it by short runs.
    kept : int
        Fits of an effect that are run to their end.
    rounds : int
        Of iterations at a fit's end.
    settling : int
        Rounds that a fit may take to settle, 0 for none; `from_prior`: from the nominal values too,
        and parameters alone after a final refinement.
    richer : int
        Fits of an effect whose richer laws are tried.
    replays : int
        Of the null, where chance is asked.
    effects : int
        Effects that are looked for; `contented`: no other one where those found explain enough.
    begins : int
        Starts of a richer law that are followed; `revisits`: other laws of an effect that are
        tried jointly with a further one.
    signals : int
        Ports of an unknown signal whose values are brought to their best, where no law explains.
    reuses : int
        Further steps of a fit that differences serve.
    ports : bool
        Whether a verdict is tested against unknown signals at the ports (`unknown_input_test`).
    """

    tried: int = 7
    short_tried: int = 3
    tried_more: int = 4
    kept: int = 3
    rounds: int = 2
    settling: int = 5
    from_prior: bool = True
    richer: int = 3
    replays: int = 4
    effects: int = 3
    contented: bool = False
    begins: int = 2
    revisits: int = 2
    signals: int = 3
    reuses: int = 1
    ports: bool = True


FULL = Effort()
QUICK = Effort(
    tried=3, short_tried=2, kept=2, rounds=1, settling=1, from_prior=False, richer=1, replays=2,
    tried_more=2, effects=2, contented=True, begins=1, revisits=0, signals=1, reuses=2,
    ports=False,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SharedFactor:
    """What constants that moved by a common factor say of a reading's scale.

    Attributes
    ----------
    column : str
        The reading.
    log_odds : float
        By which a scale is likelier than errors of each constant's own, or than another cause that
        is nearly as likely.
    alone : float
        The same of errors of each constant's own.
    factor : float
        Logarithm of the scale.
    constants : tuple of str
        Those that mimic it.
    """

    column: str
    log_odds: float
    alone: float
    factor: float
    constants: tuple[str, ...]


@dataclass
class Search:
    """What a search knows.

    `best` is the chosen fit, `fits` every hypothesis' best, `predicted` what the screening foresaw
    of each set of effects (`alternatives`), `shared` what the constants say of a reading's scale.
    """

    problem: Problem
    fitter: Fitter
    nominal_msni: NDArray
    parameters: Fit
    effort: Effort = FULL
    short: list[PreparedRecording] = field(default_factory=list)
    longer: list[PreparedRecording] = field(default_factory=list)
    candidates: list[Candidate] = field(default_factory=list)
    fits: dict[str, Fit] = field(default_factory=dict)
    predicted: dict[frozenset[str], Fit] = field(default_factory=dict)
    best: Fit | None = None
    shared: SharedFactor | None = None
    _short_msni: dict[str, NDArray] = field(default_factory=dict)
    false_alarm_gain: float | None = None  # gain that chance alone reaches, where it was asked for

    def independent_blocks(self) -> NDArray:
        """Independent stretches of each recording, times channels."""
        return np.array(
            [
                len(b.channels) * (b.recording.time_s[-1] - b.recording.time_s[0]) / BLOCK_s
                for b in self.problem.fitted
            ]
        )

    def score(self, fit: Fit) -> float:
        """Log-likelihood units; larger is better."""
        free = fit.x.size - len(self.problem.nominals)
        return self.likelihood(fit.msni) - fit.prior_cost - PRICE * free

    def likelihood(self, msni: NDArray) -> float:
        """Log-likelihood of MSNI (recordings,) of free or short runs; -inf where one failed."""
        if not np.all(np.isfinite(msni)):
            return -np.inf
        return -0.5 * float(
            np.sum(self.independent_blocks() * np.log(np.maximum(msni, LEAST_MSNI)))
        )

    def tempered(self, fit: Fit) -> float:
        """Log-likelihood units as confidence counts them: of the likelihood, only its part by
        `TEMPERATURE`."""
        dear = self.score(fit) - self.likelihood(fit.msni)
        return self.likelihood(fit.msni) / TEMPERATURE + dear

    def behind(self, best: Fit, other: Fit) -> float:
        """Log-likelihood of a rival behind a fit, for `TEMPERATURE`.

        Likelihoods are tempered because laws are not quite the machine's; what a rival needs more
        of priors and free values (values that all move by a common factor, say) is no less than it
        is.
        """
        gap = self.score(best) - self.score(other)
        free = other.x.size - best.x.size
        dearer = other.prior_cost - best.prior_cost + PRICE * free
        return gap + (TEMPERATURE - 1.0) * max(dearer, 0.0)

    def short_msni(self, fit: Fit) -> NDArray:
        """Powers (recordings,) of a hypothesis fitted to short runs, from a fit to free ones."""
        known = self._short_msni.get(fit.hypothesis.key)
        if known is None:
            begun = self.fitter.fit(fit.hypothesis, fit.x, iterations=6, recordings=self.short)
            _, there, _ = self.fitter.evaluate(fit.hypothesis, fit.x[None], self.short)
            known = begun.msni if begun.msni.sum() < there[0].sum() else there[0]
            self._short_msni[fit.hypothesis.key] = known
        return known

    def keep(self, fit: Fit) -> Fit:
        """Remember a fit if it is the best of its hypothesis."""
        known = self.fits.get(fit.hypothesis.key)
        if known is None or self.score(fit) > self.score(known):
            self.fits[fit.hypothesis.key] = fit
        return self.fits[fit.hypothesis.key]

    def ranked(self) -> list[Fit]:
        """Fits by score."""
        return sorted(self.fits.values(), key=lambda f: -self.score(f))


def excess_left(before: Fit, after: Fit) -> tuple[float, float]:
    """Shares of the excess MSNI left by more effects: mean over recordings, and the least."""
    a = np.maximum(before.msni - 1.0, 0.0) + NOISE_SPREAD
    b = np.maximum(after.msni - 1.0, 0.0) + NOISE_SPREAD
    return float(np.exp(np.mean(np.log(b / a)))), float(np.min(b / a))


def explained(before: Fit, after: Fit) -> float:
    """Share of the excess that effects take away, as rms, mean over recordings."""
    had = np.maximum(before.msni - 1.0, 0.0) + NOISE_SPREAD
    left = np.maximum(after.msni - 1.0, 0.0) + NOISE_SPREAD
    weight = np.sqrt(had) - np.sqrt(NOISE_SPREAD)
    if np.sum(weight) < 0.3:
        return 1.0
    chosen = 1.0 - np.sqrt(np.minimum(left / had, 1.0))
    return float(np.sum(weight * chosen) / np.sum(weight))


def share_of_all(search: Search, before: Fit, after: Fit) -> float:
    """Part of all that parameters left which the further effect takes away."""
    whole = np.maximum(search.parameters.msni - 1.0, 0.0) + NOISE_SPREAD
    return float(np.max((before.msni - after.msni) / whole))


def far_from_prior(problem: Problem, fit: Fit) -> NDArray:
    """Which nominal values (n,) need another explanation than the stated tolerances.

    None, unless one lies farther from its prior mean than the farthest of so many normal deviates
    does but once in a hundred (Sidak); then all that are more than a deviation away: what drove the
    one has moved others along. Such values are evidence against a law as strong as what it leaves.
    """
    n = len(problem.nominals)
    centre, weight = problem.prior(fit.hypothesis)
    pulls = np.abs(weight * (fit.x - centre))[:n]
    bar = -ndtri(0.5 * (1.0 - (1.0 - CHANCE) ** (1.0 / max(n, 1))))
    return (pulls > 1.0) & bool(np.any(pulls > bar))


def reset_to_prior(fit: Fit, chosen: NDArray) -> NDArray:
    """Unknowns of a fit with some nominal values (n,) back at their nominal values."""
    x = fit.x.copy()
    x[: chosen.size][chosen] = 0.0
    return x


def tempering_of(msni: NDArray) -> float:
    """The share that innovations count where the law at hand leaves more than noise."""
    return 1.0 / max(1.0, float(np.median(msni)))


def room(search: Search, fit: Fit) -> bool:
    """Whether more than noise is left."""
    return bool(np.any(fit.msni > ROOM))


def formatted(msni: NDArray) -> str:
    """Numbers as text."""
    return ", ".join(f"{p:.3g}" for p in msni)
