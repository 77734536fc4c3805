"""A fit of the multistep search as reports read it, and the covariances of its values."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.identify.candidates.rig_parameters import Nominal
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.covariance import (
    Spread,
    inverse_prior_std,
    jackknife_of_identifiable,
    no_wider,
)
from rsea_core.identify.law_search.found import Found, Step
from rsea_core.identify.multistep.criteria import (
    DELAY_ROWS,
    DOUBTED_ERROR,
    RIVAL_SCALE,
    RIVAL_SHARE,
    TIMING_DOUBT,
    UNBELIEVED,
    UNKNOWN_MOST,
    UNKNOWN_SHARE,
    WITHIN_ROW,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator, stretches_of
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import with_best_delay, with_problem
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.noise_estimate import SLOW_INPUT
from rsea_core.identify.multistep.steps import normal_equations
from rsea_core.machine.inputs import POSITION_COMMAND

DAMPING, INDUCTANCE = "viscous_Nms_per_rad", "terminal_inductance_H"
NO_SHARE = 1e-4  # of the usual torque: a smaller unknown one explains no error
RESISTANCE = "terminal_resistance_ohm"


@dataclass(frozen=True, kw_only=True)
class FoundFit:
    """A fitted hypothesis as reports read it.

    Attributes
    ----------
    msni : (recordings,) array
        Mean square innovation of each fitted recording.
    """

    hypothesis: Hypothesis
    x: NDArray
    msni: NDArray
    prior_cost: float = 0.0


@dataclass
class FoundSearch:
    """The part of a search that reports read."""

    parameters: FoundFit
    candidates: Sequence = ()
    short: Sequence = ()
    fits: dict = field(default_factory=dict)


def fit_of(estimator: Estimator, fit: Estimate) -> FoundFit:
    """An estimate with what it leaves of each recording."""
    found = estimator.innovations([(fit.hypothesis, fit.x)])
    msni = np.array([float(np.mean(huber_squares(e))) for e in found])
    return FoundFit(hypothesis=fit.hypothesis, x=fit.x, msni=msni)


def spread_of(estimator: Estimator, fit: FoundFit) -> Spread:
    """Covariances of the unknowns, of which each figure takes the largest.

    White innovations of the power that is left; the scatter of the gradients of stretches; the
    jackknife over stretches and over recordings (`judgement.covariance`). No direction is wider
    than its prior.
    """
    level, columns = estimator.jacobian(fit.hypothesis, fit.x, fine=True)
    _, weight = estimator.problem.prior(fit.hypothesis)
    prior = np.diag(weight**2)
    stretches, recordings = [], []
    for block, e, J in zip(stretches_of(estimator.tracks), level, columns, strict=True):
        parts = (block == b for b in range(block[-1] + 1))
        stretches += [normal_equations([e[own]], [J[:, own]]) for own in parts]
        recordings.append(normal_equations([e], [J]))
    inverse = np.linalg.inv(sum(A for A, _ in recordings) + prior + 1e-9 * np.eye(fit.x.size))
    middle = prior + sum(np.outer(g, g) for _, g in stretches)
    white = inverse * max(float(np.mean([np.mean(huber_squares(e)) for e in level])), 1.0)
    apart = [
        jackknife_of_identifiable(*zip(*parts, strict=True), prior)
        for parts in (stretches, recordings)
    ]
    known = inverse_prior_std(white, weight)
    sources = (white, inverse @ middle @ inverse, *apart)
    return Spread(sources=tuple(no_wider(C, known) for C in sources))


def strained_value(problem: MultistepProblem, fit: FoundFit) -> Nominal | None:
    """The stated value from which a fit went furthest (a damping: upwards), if too far.

    An inductance that changes the winding's time constant by a small share of a row does not
    count: a command that moves within rows looks the same. None where commands are smoothed:
    commands that the log lacks may have moved the value.
    """
    if problem.timing.smooth:
        return None
    moved = np.abs(fit.x[: len(problem.nominals)]) * problem.stated
    nominal = problem.values(fit.hypothesis, fit.x)[0]
    row = min(e.recording.sample_time_s for e in problem.fitted)
    for j, p in enumerate(problem.nominals):
        if p.key.endswith(DAMPING) and fit.x[j] < 0.0:
            moved[j] = 0.0
        if p.key == INDUCTANCE:
            change = abs(nominal[p.key] - getattr(problem.case.rig, p.key))
            if change < WITHIN_ROW * row * (nominal.get(RESISTANCE) or np.inf):
                moved[j] = 0.0
    return problem.nominals[int(np.argmax(moved))] if np.any(moved >= UNBELIEVED) else None


def late_command(judged) -> dict | None:
    """A delay of the command beyond what a log's own convention can be; not of a servo.

    A command that moves linearly acts half a row earlier than one that is held: where readings do
    not tell which, the delay is known to half a row.

    judged : `WindowVerdict`
    """
    if any(r.command_name == POSITION_COMMAND for r in judged.case.identification):
        return None
    for j, law in enumerate(judged.fit.hypothesis.laws):
        if law.kind is not DriveDelay or law.unknowns[0].log:  # the rig file states it
            continue
        delay = judged.laws[j]["delay_s"]
        at = judged.index_of(j)
        std = judged.spread.std[at] * law.unknowns[0].scale
        row = max(t.experiment.recording.sample_time_s for t in judged.estimator.tracks)
        latest = law.unknowns[0].high - 1e-3 * row
        of_log = (1.0 + 0.5 * judged.problem.timing.linear) * row  # linear: half a row of hold
        if DELAY_ROWS * row < delay < latest and delay - of_log > 5.0 * std:
            if _other_hold_is_as_likely(judged):
                std = np.hypot(std, 0.5 * row)
            return {
                "name": law.effect, "subsystem": "drive", "confidence": 0.95,
                "law": law.law, "class": [law.effect], "alternatives": [],
                "parameters": {"delay_s": {"value": delay, "std": float(std), "unit": "s",
                                           "at_bound": False}},
            }  # fmt: skip
    return None


def _other_hold_is_as_likely(judged) -> bool:
    """Whether commands that move the other way between rows are as likely, with another delay."""
    own, fit = judged.estimator, judged.fit
    timing = replace(judged.problem.timing, linear=not judged.problem.timing.linear)
    problem = MultistepProblem(judged.problem.case, timing=timing, steps=own.problem.steps)
    other = with_best_delay(with_problem(own, problem), fit.hypothesis, fit.x)
    return other.cost < own.fit(fit.hypothesis, fit.x, iterations=5).cost + TIMING_DOUBT


def unknown_torque(estimator: Estimator, error: float) -> str | None:
    """The torque that no log holds and no law explains, in words; None if it is negligible.

    Of the mean over `Scale.time_s`, the root mean square. `error` is that of the predictions over
    the spread of the readings: where nothing pulls a machine back, a small torque moves it far.
    """
    share, size, time_s = _largest_unknown_torque(estimator)
    if share < NO_SHARE or (share < UNKNOWN_SHARE and error < DOUBTED_ERROR):
        return None
    linear = estimator.problem.case.rig.axis == "linear"
    what, unit = ("force", "N") if linear else ("torque", "Nm")
    return (
        f"an unknown {what} of {size:.2g} {unit}, averaged over {time_s:.2g} s"
        f" ({100.0 * share:.2g} % of the usual {what})"
    )


def leaves_much_torque(estimator: Estimator) -> bool:
    """Whether that torque is so large that values of the rig explain no recording.

    Commands that a log holds smoothed cause an unknown torque themselves.
    """
    smooth = estimator.problem.timing.smooth
    return not smooth and _largest_unknown_torque(estimator)[0] > UNKNOWN_MOST


def leaves_some_torque(estimator: Estimator) -> bool:
    """Whether that torque and the slow one are more than a negligible share of the usual one.

    An amplifier's offset that drifts makes predictions over long windows depend on each other and
    is no physics of the machine.
    """
    return _largest_unknown_torque(estimator, slow=True)[0] > UNKNOWN_SHARE


def explains_only_negligible_torque(found: Found) -> bool:
    """Whether laws found in windows explain no more torque than a drifting amplifier offset.

    Laws that are complete over whole recordings may be that small.
    """
    acting = found.steps and all(step.law.sensor is None for step in found.steps)
    return bool(acting) and not (found.complete or leaves_some_torque(found.base_estimator))


def _largest_unknown_torque(
    estimator: Estimator, *, slow: bool = False
) -> tuple[float, float, float]:
    """Share of the usual torque, size [Nm], and the time of the mean [s].

    Parameters
    ----------
    slow : bool
        Include the standard deviation of the torque that varies slowly.
    """
    found = []
    for t in estimator.tracks:
        inputs = t.noise.inputs[[0, 1, SLOW_INPUT] if slow else [0, 1]]
        size, usual = float(np.linalg.norm(inputs)), float(max(t.scale.torque_Nm))
        found.append((size / usual if usual > 0.0 else 0.0, size, t.scale.time_s))
    return max(found)


def ranked_explanations(steps: Sequence[Step], parameters: FoundFit, fit: FoundFit) -> list[dict]:
    """What was considered, by gain over parameters alone."""
    found = [_explanation("parameters only", "", parameters.msni, 0.0)]
    gain = 0.0
    names: list[str] = []
    for step in steps:
        for law, other in step.rivals:
            name = " + ".join([*names, law.effect])
            found.append(_explanation(name, law.subsystem, fit.msni, gain + other, law.law))
        gain += step.gain
        names.append(step.law.effect)
        name, place = " + ".join(names), step.law.subsystem
        found.append(_explanation(name, place, fit.msni, gain, step.law.law))
    chosen = " + ".join(names) or "parameters only"
    for row in found:
        row["chosen"] = row["name"] == chosen and row["gain"] == gain
    return sorted(found, key=lambda row: (not row["chosen"], -row["gain"]))


def _explanation(name: str, place: str, power: NDArray, gain: float, note: str = "") -> dict:
    return {
        "name": name, "subsystem": place, "error": float(np.sqrt(np.max(power))), "gain": gain,
        "se": RIVAL_SCALE + RIVAL_SHARE * abs(gain), "chosen": False, "note": note,
    }  # fmt: skip
