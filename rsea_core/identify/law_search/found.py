"""What the search for laws found: parameters alone, the laws taken, and their rivals."""

from dataclasses import dataclass, field, replace

import numpy as np

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import settled
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.law_search.shape_search import Shape
from rsea_core.identify.multistep.criteria import (
    LEAST_EXCESS,
    LOST,
    NO_PREDICTION,
    SEARCH_STEPS,
    SOUND,
    UNEVEN_GAIN,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import Growth, relative_error, with_fine_steps
from rsea_core.identify.multistep.timing_choice import with_mean_commands

Entry = tuple[Candidate, Estimator, Estimate]
"""A candidate fitted to its end, in its own noise."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """One law taken, and those that it was compared with.

    Attributes
    ----------
    screened : float
        Held-out gain as the screening saw it, in the noise of the fit before.
    gain : float
        Fall of the cost, each with its own noise, less the price of its values.
    ratio : float
        Gain over its deviation between stretches of rows.
    tempering : float
        Share of independent innovations with the law.
    rivals : tuple of (Law, gain)
        Best of each other effect; those too that have a value at a bound, and cannot be taken.
    near : tuple of Entry
        Those that are ranked again where windows become longer.
    contender : Law or None
        Of another effect, with far more gain if the innovations of each count what they are worth.
    doubt : float or None
        Units of gain by which a rival is e times less probable; None: by the gain.
    """

    law: Law
    screened: float
    gain: float
    ratio: float
    tempering: float
    rivals: tuple[tuple[Law, float], ...]
    near: tuple[Entry, ...] = ()
    contender: Law | None = None
    doubt: float | None = None


@dataclass
class Found:
    """What a search found.

    Attributes
    ----------
    base, best : Estimate
        Parameters alone and with laws; the costs of `best` are with its own noise.
    horizon, base_horizon : float or None
        Up to which the machine is predictable with laws, and with parameters alone; None: all rows.
    lost : float
        Error over the spread of a reading, beyond which a horizon with laws is too long.
    steps : list of Step
        One for each law.
    refused : Step or None
        A law taken and taken out again, for it gained in too few stretches of rows.
    shared : dict of str
        Recordings held out of which a part was fitted, and why (`hold_out.with_shared_recordings`).
    pause_shown : bool
        Whether the pause before recordings held out was estimated from these.
    left_by_parameters : float
        What parameters alone leave of whole recordings, in deviations of the sensors' noise
        (`whole_runs`); inf: not known.
    excess : float
        Cost of these errors above that of the noise, in units.
    explained_once : float
        Share of that cost which a torque that acts once explains, if no law explains more.
    sound_below : float
        Misfit, in these deviations, below which parameters alone are sufficient.
    by_whole_runs : Found or None
        The law that alone explains most of the errors of the whole recordings fitted; it is claimed
        if windows confirm it.
    complete : bool
        Whether laws stand by whole recordings: they leave nothing but that noise, or little more.
    explained : float
        Share of what parameters alone leave beyond that noise, which complete laws explain, of all
        rows and of rows unseen.
    """

    problem: MultistepProblem
    base_estimator: Estimator
    base: Estimate
    estimator: Estimator
    best: Estimate
    horizon: float | None
    base_horizon: float | None = None
    lost: float = LOST
    shared: dict[str, str] = field(default_factory=dict)
    pause_shown: bool = False
    steps: list[Step] = field(default_factory=list)
    refused: Step | None = None
    base_shapes: list[Shape] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    screened: list[Candidate] = field(default_factory=list)
    left_by_parameters: float = np.inf
    excess: float = 0.0
    explained_once: float = 0.0
    sound_below: float = SOUND
    by_whole_runs: "Found | None" = None
    complete: bool = False
    explained: float = 1.0

    def in_windows_of(self, other: "Found") -> "Found":
        """Another growth of windows, with what whole recordings showed in this one."""
        return replace(
            other, left_by_parameters=self.left_by_parameters, excess=self.excess,
            explained_once=self.explained_once, sound_below=self.sound_below,
            by_whole_runs=self.by_whole_runs,
        )  # fmt: skip

    @property
    def sound(self) -> bool:
        """Whether parameters alone predict whole recordings to the sensors' noise."""
        return self.left_by_parameters < self.sound_below

    @property
    def needs_no_law(self) -> bool:
        """Whether parameters alone leave no more than noise, or predict no whole recording."""
        return (self.sound and not self.beyond_noise) or not self.left_by_parameters < np.inf

    @property
    def unpredicted(self) -> bool:
        """Whether no values of the parameters alone predict even windows."""
        own, base = self.base_estimator, self.base
        return relative_error(own, base.hypothesis, base.x) > NO_PREDICTION

    @property
    def beyond_noise(self) -> bool:
        """Whether parameters alone leave errors of a cost that noise does not explain."""
        return self.excess >= LEAST_EXCESS

    @property
    def acts_once(self) -> bool:
        """Whether all laws are external torques that acted once."""
        return all(step.law.effect == LoadDisturbance.effect for step in self.steps)

    @property
    def confirms_whole_runs(self) -> bool:
        """Whether windows show a single law, with a large gain, that whole recordings show too."""
        if self.by_whole_runs is None or len(self.steps) != 1:
            return False
        step = self.steps[0]
        return step.gain > UNEVEN_GAIN and step.law.key == self.by_whole_runs.steps[0].law.key

    @property
    def predicts_longer(self) -> bool:
        """Whether the machine is predictable for longer with laws than with parameters alone."""
        own, before = (np.inf if h is None else h for h in (self.horizon, self.base_horizon))
        return own > before

    def without_laws(self) -> "Found":
        """Parameters alone, from which another search begins."""
        return Found(
            problem=self.problem, base_estimator=self.base_estimator, base=self.base,
            estimator=self.base_estimator, best=self.base, horizon=self.base_horizon,
            base_horizon=self.base_horizon, lost=self.lost,
        )  # fmt: skip

    def parameters_alone(self) -> "Found":
        """The same without the laws, which something else refutes: parameters and their shapes."""
        return replace(self, steps=[], shapes=self.base_shapes, best=self.base,
                       estimator=self.base_estimator)  # fmt: skip

    def continue_from(self, estimator: Estimator, fit: Estimate) -> None:
        """Take a fit of the same laws that converged further."""
        if not self.steps:
            self.base_estimator, self.base = estimator, fit
        self.estimator, self.best = estimator, fit


def from_growth(growth: Growth, say, *, quick: bool = False) -> Found:
    """Parameters alone as a growth of windows ended, in steps for the search of laws."""
    estimator, base, horizon = growth
    estimator, base = with_fine_steps(estimator, base, say, per_cycle=SEARCH_STEPS)
    estimator = with_mean_commands(estimator, base)
    if not quick:
        estimator, base = settled(estimator, base)
    return Found(problem=estimator.problem, base_estimator=estimator, base=base, best=base,
                 estimator=estimator, horizon=horizon, base_horizon=horizon)  # fmt: skip
