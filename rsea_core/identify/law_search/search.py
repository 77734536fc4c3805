"""The search: parameters with the experiment's nuisances first, then law after law.

A law enters if it predicts rows that it was not fitted to, and by more than the spread between
blocks of rows; laws are compared by likelihood, each with the noise that it needs itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.sensor_drift import SensorDrift
from rsea_core.effects.sensor_noise import SensorNoise
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.angle_relation import angle_relation
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_choice import Choice, promising
from rsea_core.identify.law_search.candidate_fits import (
    absent,
    at_bound,
    confirmed,
    continued_parent,
    cost_of_mass,
    count_values,
    fitted,
    from_prior,
    gain_of,
    refitted_from_parent,
    resmoothed_fit,
    restarted,
    settled,
    settled_by_output_error,
    too_fast,
    widened,
)
from rsea_core.identify.law_search.found import Entry, Found, Step, from_growth
from rsea_core.identify.law_search.gear_mesh import first_laws
from rsea_core.identify.law_search.pruning import pruned, without_weak_end
from rsea_core.identify.law_search.pulses import pulse_ratio
from rsea_core.identify.law_search.richer_laws import (
    preferred,
    with_richer_law,
    with_richer_rivals,
)
from rsea_core.identify.law_search.screening import Candidate, Projection
from rsea_core.identify.law_search.shape_search import shapes
from rsea_core.identify.law_search.window_lengths import lengthened
from rsea_core.identify.multistep.command_timing import CommandTiming
from rsea_core.identify.multistep.criteria import (
    AGAIN,
    CONTENDS,
    CONTINUATIONS,
    FEWER_FINISHED,
    FINISHED,
    FORMS,
    FURTHER_GAIN,
    FURTHER_MOST,
    FURTHER_SHARE,
    LAWS,
    LEAST_GAIN,
    LEAST_RATIO,
    ONLY_PULSE,
    OWED,
    PARENT,
    PER_VALUE,
    PULSE_CHOICE,
    PULSE_RATIO,
    SECOND_STARTS,
    UNCONVERGED,
    WEAK,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import Experiment
from rsea_core.identify.multistep.horizons import likelier
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER, nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.numeric.work_limit import no_work_left
from rsea_core.recordings.case import Case

TORQUE_CONSTANT = "torque_constant_Nm_per_A"
ANGLES = ("motor_angle_rad", "load_angle_rad")
HOLDS_NO_CLAIM = (DriveDelay.effect, SensorNoise.effect)  # nuisances, or no physics


def begun(
    case: Case, timing: CommandTiming | None, say, *, quick: bool = False,
    mesh: tuple[Law, ...] = (),
) -> Found:  # fmt: skip
    """Parameters alone, under one timing of the command; None: that which they prefer.

    Parameters
    ----------
    mesh : tuple of Law
        Free values of a gear's mesh that stands for a spring: the first law is in the gear.
    """
    h = Hypothesis(laws=(*nuisances(case), *mesh))
    growth = parameters_with_timing(case, h, say, timing=timing, quick=quick or bool(mesh))
    return from_growth(growth, say, quick=quick)


def searched(
    case: Case, timing: CommandTiming | None, say, *, quick: bool = False,
    mesh: tuple[Law, ...] = (),
) -> Found:  # fmt: skip
    """The search in windows, from parameters alone (`begun`) on."""
    found = begun(case, timing, say, quick=quick, mesh=mesh)
    laws = laws_of(found)
    add_all(found, first_laws(laws) if mesh else laws, say, quick=quick, further=not mesh)
    return found


def laws_of(found: Found) -> list[Law]:
    """Every law that the case can have and its rows can show."""
    case = found.problem.case
    meshes = any(law.effect == MESH_DAMPER for law in found.base.hypothesis.laws)
    relation = None if meshes else angle_relation(case)
    return [
        law for law in catalogue(case, relative=True).values()
        if law.effect not in HOLDS_NO_CLAIM
        and not (meshes and law.subsystem == "spring")
        and not (relation is not None and relation.refutes(law))
        and _observable(law, found.base_estimator)
    ]  # fmt: skip


def add_all(
    found: Found, first: Sequence[Law], say, *, quick: bool = False, further: bool = True
) -> None:
    """Add laws, the first one of those given, as long as one is worth it; then shapes are tried.

    Parameters
    ----------
    further : bool
        Look for further laws as thoroughly as for the first: a stiff mesh costs short steps.
    """
    laws = laws_of(found)
    step = _next_law(found, first, say, quick=quick)
    if step is not None:
        found.steps.append(step)
        lengthened(found, say, quick=quick)
        _add_laws(found, laws, say, quick=quick or not further)
    if pruned(found, say):  # the first law hid others: what is left may be found now
        _add_laws(found, laws, say, quick=quick or not further)
        pruned(found, say)
    without_weak_end(found)
    found.base_shapes = found.shapes = shapes(Projection(found.base_estimator, found.base))
    for shape in found.base_shapes[:2]:
        say(f"  {shape.sentence()}: held-out gain {shape.held_out:.1f} +- {shape.deviation:.1f}")
    if found.steps:
        found.shapes = shapes(Projection(found.estimator, found.best))


def _add_laws(found: Found, laws: Sequence[Law], say, *, quick: bool) -> None:
    """Add law after law, with longer windows as far as they allow."""
    while len(found.steps) < LAWS and not no_work_left(begun=True):
        step = _next_law(found, laws, say, quick=quick)
        if step is None:
            break
        found.steps.append(step)
        lengthened(found, say, quick=quick)


def _observable(law: Law, estimator: Estimator) -> bool:
    """Whether the readings can show a law of a sensor: two of them tell which one is late.

    One angle alone shows no offset (it is an angle of gravity) and no error of a rigid train. One
    reading alone shows no drift, which moves as by a slow torque, and no scale factor where the
    torque constant is free.
    """
    single = all(len(t.experiment.channels) == 1 for t in estimator.tracks)
    angles = max(_angles(t.experiment) for t in estimator.tracks)
    constant = any(p.key == TORQUE_CONSTANT for p in estimator.problem.nominals)
    unseen = {
        GearTransmissionError: angles < 2 and not estimator.problem.case.rig.has("spring"),
        SensorOffset: law.sensor in ANGLES and angles < 2,
        SensorDelay: single,
        SensorDrift: single,
        SensorScale: single and constant,
    }
    return not unseen.get(law.kind, False)


def _angles(e: Experiment) -> int:
    """How many angles a recording has, the goal of a servo and a deflection among them."""
    goal = e.recording.command_name == POSITION_COMMAND
    return goal + sum(name.endswith("_rad") for name in e.channels)


def _next_law(found: Found, laws: Sequence[Law], say, *, quick: bool) -> Step | None:
    """Take the best further law whose gain is even, if one is worth it."""
    finished, beyond, choice = _ranked(found, laws, say, quick=quick)
    base = found.best
    worth = _worth_over_parent(found, finished)
    richest: set[str] = set()
    refused = 0
    if not quick:
        finished, richest = with_richer_rivals(finished, base, laws, worth, say)
    while finished:
        entry, *finished = finished
        if worth(entry) < _enough(found, laws, entry):
            return None
        if entry[0].law.key not in richest:
            entry = with_richer_law(entry, base, laws, say)
        c, own, fit = entry
        once = c.law.only is not None
        ratio = pulse_ratio(own, base, fit) if once else confirmed(own, base, fit)
        say(f"  best {c.law.key}: gain {gain_of(own, base, fit):.1f}, ratio {ratio:.1f}")
        if ratio >= (LEAST_RATIO if not once else _least_pulse_ratio(c)):
            break
        if not found.steps:  # nearest names: what gains most, though unevenly
            found.screened.insert(refused, c)
        refused += 1
    else:
        return None
    found.estimator, found.best = resmoothed_fit(own, fit)
    return Step(
        law=c.law,
        screened=next((s.held_out for s in choice.screened if s.law.key == c.law.key), c.held_out),
        gain=worth(entry),
        ratio=ratio,
        tempering=own.tempering,
        rivals=tuple(
            (o.law, worth((o, p, q))) for o, p, q in finished + _best_of_each(beyond, worth)
        ),
        near=tuple(e for e in finished if worth(e) > AGAIN * worth(entry)),
        contender=_contender(base, entry, finished),
    )


def _contender(base: Estimate, entry: Entry, others: Sequence[Entry]) -> Law | None:
    """The law with far more gain than the best, each in its own share of independent innovations.

    As long as a second effect is missing, a wrong law whose innovations are dependent may be
    likelier than the right one.
    """

    def own(e: Entry) -> float:
        return gain_of(e[1], base, e[2])

    lasting = [e for e in others if e[0].law.only is None]
    if not lasting:
        return None
    best = max(lasting, key=own)
    far = own(best) > CONTENDS * max(own(entry), 0.0)
    return best[0].law if far and best[0].law.effect != entry[0].law.effect else None


def _ranked(
    found: Found, laws: Sequence[Law], say, *, quick: bool
) -> tuple[list[Entry], list[Entry], Choice]:
    """The candidates fitted to their ends, best first, those at a bound, and what was chosen.

    Where the best one's values are better ones without its law too, the fit that it was added to
    had not converged: these take its place, and laws are screened again. A law is no evidence for
    what continuing a fit gains.
    """
    finished: list[Entry] = []
    beyond: list[Entry] = []
    for continuation in range(1 if quick else CONTINUATIONS + 1):
        choice = promising(found, laws, quick=quick)
        done = {entry[0].law.key for entry in finished + beyond}
        new = [c for c in choice.candidates if c.law.key not in done]
        for c in new:
            say(f"  {c.law.key}: held-out gain {c.held_out:.1f} +- {c.deviation:.1f}")
        ends, bounds, without = _finished(found, replace(choice, candidates=new), say, quick=quick)
        finished, beyond = finished + ends, beyond + bounds
        finished.sort(key=_worth_over_parent(found, finished), reverse=True)
        last = quick or continuation == CONTINUATIONS
        if last or not any(_continued(found, e, finished, say) for e in finished[:1] + without):
            break
    if finished:
        worth = _worth_over_parent(found, finished)
        finished = preferred(restarted(finished, worth, say), worth)
    return finished, beyond, choice


def _continued(found: Found, entry: Entry, finished: Sequence[Entry], say) -> bool:
    """Whether an entry's other values fit better without its law too; the search goes on from them.

    This holds for a law whose fit ended at its absence as well: its gain is not the law's.
    """
    further = continued_parent(found.best, entry)
    if further is None:
        return False
    owed = gain_of(further[0], found.best, further[1])
    best = _worth_over_parent(found, finished)(finished[0]) if finished else 0.0
    if owed < max(UNCONVERGED, OWED * best):
        return False
    say(f"  the fit before had not converged: {owed:.1f} without {entry[0].law.key}")
    found.continue_from(*further)
    return True


def _worth_over_parent(found: Found, finished: Sequence[Entry]) -> Callable[[Entry], float]:
    """What an entry gains over the fit that it was added to, less the price of its values."""
    if not finished:
        return lambda entry: 0.0
    # one share for all: two laws that fit alike are alike, however dependent each seems
    share = min(finished, key=lambda entry: entry[2].negative_log_likelihood)[1].tempering
    base = found.best

    def worth(entry: Entry) -> float:
        c, own, fit = entry
        gain = gain_of(own, base, fit, share) - cost_of_mass(found.problem, entry)
        chosen = PULSE_CHOICE if c.law.only is not None else 0.0
        return gain - PER_VALUE * count_values(c.law) - chosen

    return worth


def _finished(
    found: Found, choice: Choice, say, *, quick: bool
) -> tuple[list[Entry], list[Entry], list[Entry]]:
    """The best candidates fitted to their ends, each in its own noise.

    Those at a bound are listed apart, and so is the best of those whose fit ended at their absence.
    """
    estimator, base, short = found.estimator, found.best, choice.short
    rough = [(c, fitted(estimator, base, c, short)) for c in choice.candidates]
    rough.sort(key=lambda pair: pair[1].cost)
    most = FEWER_FINISHED if quick else FINISHED
    chosen = rough[:most] + [pair for pair in rough[most:] if pair[0].law.key in choice.apart]
    finished, beyond, without, best = [], [], [], 0.0
    for place, (c, fit) in enumerate(chosen):
        if place > 0 and no_work_left(begun=place < FEWER_FINISHED):
            break
        enough = np.inf if quick or place >= SECOND_STARTS else WEAK * best
        entry, bound = _end(estimator, base, c, fit, say, enough=enough)
        for other in _other_forms(c, choice.screened) if bound and not quick else ():
            beyond.append(entry)
            fit = fitted(estimator, base, other, short)
            entry, bound = _end(estimator, base, other, fit, say, enough=WEAK * best)
            if not bound:
                break
        best = max(best, gain_of(entry[1], base, entry[2]))
        if absent(*entry):
            say(f"  {entry[0].law.key}: moves no prediction")
            without = [max([*without, entry], key=lambda e: gain_of(e[1], base, e[2]))]
            continue
        (beyond if bound else finished).append(entry)
    return finished, beyond, without


def _end(
    estimator: Estimator, base: Estimate, c: Candidate, fit: Estimate, say, *, enough: float
) -> tuple[Entry, bool]:
    """The candidate with its noise and its fit, and whether a value ran into a bound.

    Parameters
    ----------
    enough : float
        Gain from which a second start pays (`settled`).
    """
    begun = from_prior(estimator, fit)
    own, fit = settled(estimator, begun, once=True)
    if gain_of(own, base, fit) > enough:
        own, fit = likelier((own, fit), settled_by_output_error(estimator, begun))
    if gain_of(own, base, fit) < 0.0:
        own, fit = refitted_from_parent(estimator, base, c)
    c, own, fit = widened(c, own, fit)
    bound = at_bound(own.problem, fit, c.law) or too_fast(own, fit)
    say(f"  {c.law.key}: gain {gain_of(own, base, fit):.1f}{', at a bound' if bound else ''}")
    return (c, own, fit), bound


def _other_forms(c: Candidate, screened: Sequence[Candidate]) -> list[Candidate]:
    """Other laws of a candidate's effect that promise something, best first."""
    same = [o for o in screened if (o.law.effect, o.law.sensor) == (c.law.effect, c.law.sensor)]
    return [o for o in same if o.law.law != c.law.law and o.held_out > PARENT * c.held_out][:FORMS]


def _best_of_each(entries: list[Entry], worth) -> list[Entry]:
    """The best entry of each effect in each reading."""
    best: dict[tuple, Entry] = {}
    for entry in sorted(entries, key=worth):
        best[entry[0].law.effect, entry[0].law.sensor] = entry
    return list(best.values())


def _least_pulse_ratio(c: Candidate) -> float:
    """Of a torque that acts once: less where nothing like it is anywhere else."""
    return PULSE_RATIO * (1.0 if c.held_out < ONLY_PULSE * c.deviation else 0.5)


def _enough(found: Found, laws: Sequence[Law], entry) -> float:
    """Worth that a law must have to be taken: more of a further one, and of one of many forms."""
    c, own, _ = entry
    enough = LEAST_GAIN + np.log(max(sum(law.effect == c.law.effect for law in laws), 1))
    if not found.steps:
        return enough
    share = min(FURTHER_SHARE * len(found.steps) / own.tempering, FURTHER_MOST)
    return max(enough, FURTHER_GAIN, share * found.steps[0].gain)
