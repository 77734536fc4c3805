"""What no known effect explains, as a table that predicts: over the state that it follows.

A residual with a place is a signal in time, and no prediction can use it. Where it follows one
state of the machine, a table over that state can: a reading that errs with its own value (an
amplifier that clips or fades), with its place in the turn (an eccentric disc), with its speed
(counts that are lost); a torque on the load that depends on where the load is (a cable, a magnet).
The tables are nonparametric in the sense of latent forces (Rogers & Friis, MSSP 2022): nodes with a
prior, linear between them, as many as the recordings pay for. They are fitted like any law, through
the machine, and kept only if they explain pieces of the recordings that took no part in their fit.
They name nothing: the verdict stays `unexplained`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.residual_table import (
    NODES,
    SPEED,
    TEXTS,
    TURN,
    VALUE,
    place_law,
    reading_law,
)
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.jacobian import jacobian_at
from rsea_core.identify.fitting.least_squares import Fit, robust
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.selection.criteria import (
    EXPLAINED,
    FAR,
    NOISE_MSNI,
    Search,
    explained,
    tempering_of,
)

OFTEN, ALL = 10.0, 0.5  # of a motion: a fast part may lose more than the mean, never all
WIDE_rad = 0.02  # that a load must move before its place is asked
TURNS = 2.0  # that an angle must cover before its place in the turn is asked
ROUNDS = (6, 6)
PIECES, FOLDS = 25, 5  # of each recording; every fifth is left out in turn


@dataclass(frozen=True, kw_only=True)
class TableFit:
    """A table that a residual follows.

    Attributes
    ----------
    fit : Fit
        The rig's values and the table's nodes, the table as the only law.
    covariance : (n, n) array
        Of the fit's unknowns, by white innovations and priors.
    held_out : float
        Share of the excess that it explains where it did not look.
    words : str
    """

    fit: Fit
    covariance: NDArray
    held_out: float
    sentence: str

    @property
    def quiet(self) -> bool:
        """Whether it leaves no recording more than its noise."""
        return bool(np.all(self.fit.msni < NOISE_MSNI))


def table_fit(search: Search, base: Fit, column: str, peak: float) -> TableFit | None:
    """The table that a residual follows; None where none holds on unseen recordings.

    Parameters
    ----------
    base : Fit
        The rig's values jointly with the residual, without a law.
    column : str
        The reading that errs; empty: a torque on the load.
    peak : float
        Largest size of the residual.
    """
    best: Fit | None = None
    laws = _of_reading(search, base, column, peak) if column else _of_load(search, base, peak)
    for law in laws:
        hypothesis = Hypothesis(laws=(law,))
        x = np.concatenate([base.x, search.problem.start(hypothesis)[base.x.size :]])
        fit = replace(base, x=x)
        for iterations in ROUNDS:
            fit = search.fitter.fit(
                hypothesis, fit.x, iterations=iterations, tempering=tempering_of(fit.msni)
            )
        if best is None or search.score(fit) > search.score(best):
            best = fit
    if best is None:
        return None
    share, covariance = held_out_share(search, base, best)
    if not share > EXPLAINED:
        return None
    sentence = (
        f"it follows {TEXTS[best.hypothesis.laws[0].law]} ({round(100.0 * share)} % of it in pieces"
        " left out of the fit): a table in model.toml"
    )
    return TableFit(fit=best, covariance=covariance, held_out=share, sentence=sentence)


def held_out_share(search: Search, before: Fit, after: Fit) -> tuple[float, NDArray]:
    """Share of the excess that a fit explains where it did not look; covariance of its unknowns.

    Every fifth piece of the recordings is left out of the fit, five times: the step that the rest
    would take without it, innovations to first order. Tables are linear in their entries, so that
    this is nearly exact for them. (Approximate cross-validation: Giordano et al., AISTATS 2019.)
    """
    problem = search.problem
    derivatives = jacobian_at(search.fitter, after)
    _, weight = problem.prior(after.hypothesis)
    total = np.diag(weight**2 + 1e-9)
    without = [(np.zeros_like(total), np.zeros(len(total))) for _ in range(FOLDS)]
    fold_of = [np.arange(len(e)) * PIECES // len(e) % FOLDS for e in derivatives.innovations]
    for fold, e, w, J in zip(
        fold_of, derivatives.innovations, derivatives.weights, derivatives.columns, strict=True
    ):
        for number, (hessian, gradient) in enumerate(without):
            own = fold == number
            Jw = J[:, own] * w[own]
            hessian += np.einsum("itc,jtc->ij", Jw, J[:, own], optimize=True)
            gradient += np.einsum("itc,tc->i", Jw, e[own])
    total = total + sum(hessian for hessian, _ in without)
    moves = np.array([np.linalg.lstsq(total - H, g, rcond=None)[0] for H, g in without])
    msni = []
    for fold, e, J in zip(fold_of, derivatives.innovations, derivatives.columns, strict=True):
        out = e + np.einsum("ti,itc->tc", moves[fold], J, optimize=True)
        msni.append(robust(out, FAR)[0].mean())
    return explained(before, replace(after, msni=np.array(msni))), np.linalg.pinv(total)


def _of_reading(search: Search, base: Fit, column: str, peak: float) -> list[Law]:
    """Tables over what a reading can follow, the coarsest of each first."""
    signals = _signals(search, base, column)
    if not signals:
        return []
    every = np.concatenate([signal for _, signal in signals])
    span = float(every.min()), float(every.max())
    if not (np.all(np.isfinite(every)) and span[0] < span[1]):
        return []
    found = [reading_law(column, VALUE, n, span, peak) for n in NODES[VALUE]]
    if column.endswith("angle_rad"):
        if span[1] - span[0] > 2.0 * np.pi * TURNS:
            found += [reading_law(column, TURN, n, (0.0, 2.0 * np.pi), peak) for n in NODES[TURN]]
        fastest = max(float(np.abs(np.gradient(y, t)).max()) for t, y in signals)
        share = min(OFTEN * peak / (span[1] - span[0]), ALL)
        found += [reading_law(column, SPEED, n, (0.0, fastest), share) for n in NODES[SPEED]]
    return found


def _of_load(search: Search, base: Fit, peak: float) -> list[Law]:
    """A torque over where the load was."""
    signals = _signals(search, base, "load_angle_rad")
    if not signals:
        return []
    every = np.concatenate([signal for _, signal in signals])
    span = float(every.min()), float(every.max())
    wide = np.all(np.isfinite(every)) and span[1] - span[0] > WIDE_rad
    return [place_law(span, peak)] if wide else []


def _signals(search: Search, base: Fit, column: str) -> list[tuple[NDArray, NDArray]]:
    """Times and what a fit expects a reading to be, of every recording that has it."""
    found = []
    for prepared in search.problem.fitted:
        if column in prepared.channels:
            out = search.problem.predict(prepared, base.hypothesis, base.x[None])[0]
            found.append((prepared.recording.time_s, out[:, prepared.channels.index(column)]))
    return found
