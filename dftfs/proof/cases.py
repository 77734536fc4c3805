"""One case: a rig, its concealed effects, the recordings and the sealed answer."""

from dataclasses import dataclass, field, replace

import numpy as np

from dftfs.proof.bench import Bridge, Planned, Session, motions
from dftfs.proof.effects_base import Applied, Effect
from dftfs.proof.effects_drive import thermal_parameters
from dftfs.proof.effects_outside import NEAREST
from dftfs.proof.plans import ANY, EXCITING, FAMILIES, Family, draw_limits, draw_plan
from dftfs.proof.readings import SENSED, expected, readings
from dftfs.proof.recipes import ALL, MASKS, POOR, STRENGTHS, Poor
from dftfs.proof.refit import Trace, free_constants
from dftfs.proof.rigs import Rig, draw_rig, three_digits

WEAKEST = 1.5  # floors: below this there is no case
# The constants that the contract ties down where an effect is their twin.
PINNED = {
    "load-unbalance": ("load_mass_kg", "gravity_angle_offset_rad"),
    "sensor-scale": ("load_mass_kg", "load_inertia_kgm2", "motor_inertia_kgm2"),
}
WEAKER, STRONGER = 0.03, 2.0  # how far the strength is turned
# A pair cannot be told apart where the best rival leaves less (floors; share of the trace);
# it can where every rival leaves more.
ALIKE, ALIKE_SHARE, APART = 1.6, 0.85, 3.0
GAP_STEP_S = 200e-6
SMALLEST_OFFSET_RAD = 0.03  # a smaller turn of gravity is a parameter by the contract


class TooWeakError(Exception):
    """This draw leaves no trace that could be found; the maker draws again."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What a case is to hold."""

    level: str
    effects: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    poor: Poor | None = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """Everything that is written: the owner's view, the readings and the answer."""

    recipe: Recipe
    rig: Rig
    planned: tuple[Planned, ...]
    applied: tuple[Applied, ...]
    floor: list[dict[str, float]]
    strengths: dict[str, float]
    rival_gaps: dict[str, float]
    pushed: int
    readings: list[dict[str, np.ndarray]] = field(default_factory=list)
    expected: list[dict[str, np.ndarray]] = field(default_factory=list)
    masked: dict[str, float] = field(default_factory=dict)
    peak_winding_C: float | None = None


def columns_for(recipe: Recipe, rng: np.random.Generator) -> tuple[str, ...]:
    """The sensors of a case: all four mostly; fewer where nothing hangs on the one left out."""
    if recipe.poor is not None:
        return recipe.poor.columns
    columns = list(SENSED[:4])
    free = recipe.level in ("plain", "null") and not any(
        e.startswith(("sensor", "x-")) for e in recipe.effects
    )
    if free and rng.random() < 0.3:
        if rng.random() < 0.5 and "drive-dead-zone" not in recipe.effects:
            columns.remove("current_A")
        elif not any(e.startswith("spring-") for e in recipe.effects):
            columns.remove("torque_Nm")
    warm = "drive-thermal" in (*recipe.effects, *recipe.rivals)
    if warm or rng.random() < 0.1:
        columns.append("temperature_C")
    return tuple(columns)


def family_for(recipe: Recipe, rng: np.random.Generator) -> Family:
    if recipe.poor is not None:
        p = recipe.poor
        return Family(identification=p.slots, validation=(p.validation,), test=(p.test,))
    choices = set(ANY)
    for name in (*recipe.effects, *recipe.rivals):
        wanted = set(EXCITING.get(name, ANY))
        choices = choices & wanted or min(choices, wanted, key=len)
    if recipe.level == "null":
        choices = set(FAMILIES)
    return FAMILIES[str(rng.choice(sorted(choices)))]


def search(
    trace: Trace, session: Session, effect: Effect, aim: float, pinned: tuple[str, ...]
) -> tuple[Applied, float]:
    """Turn the strength until the trace that no constants mimic has the size aimed at."""
    strength, low, high = 1.0, WEAKER, STRONGER
    best = (effect(1.0), 0.0)
    for _ in range(6):
        applied = effect(strength)
        trial = replace(session, applied=(applied,))
        size = trace.strength(trace.left_over(trace.difference(trial), pinned=pinned))
        if best[1] == 0.0 or abs(np.log(size / aim)) < abs(np.log(best[1] / aim)):
            best = (applied, size)
        if 0.7 < size / aim < 1.4 or (strength >= STRONGER and size < aim):
            break
        if size < aim:
            low = strength
        else:
            high = strength
        guess = strength * (aim / max(size, 0.02)) ** 0.8
        inside = low * 1.05 < guess < high / 1.05
        reached = high if size < aim else low
        strength = guess if inside else float(np.sqrt(strength * reached))
        if high == STRONGER and guess > STRONGER:
            strength = STRONGER
    if best[1] < WEAKEST:
        raise TooWeakError
    return best


def gap_to(
    trace: Trace, session: Session, difference: np.ndarray, rival: str, rng: np.random.Generator
) -> float:
    """What is left of a trace when the best of a few draws of a rival effect may explain it."""
    gap = np.inf
    for _ in range(5):
        effect = ALL[rival](rng, session.machine)
        for strength in (0.3, 1.0):
            trial = replace(session, applied=(effect(strength),))
            column = trace.difference(trial, GAP_STEP_S)[:, None]
            if not np.isfinite(column).all() or np.abs(column).max() < 1e-6:
                continue
            gap = min(gap, trace.strength(trace.left_over(difference, also=column)))
    return float(gap)


def with_mask(rig: Rig, trace: Trace, difference: np.ndarray, name: str, share: float) -> Rig:
    """A rig file that was calibrated on the faulty machine: its constant takes the blame."""
    names = list(free_constants(trace.session))
    spread = free_constants(trace.session)
    constant = MASKS[name]
    if constant not in names:
        return rig
    column = trace.jacobian[:, names.index(constant)]
    shift = share * float(column @ difference) / float(column @ column)
    factor = float(np.exp(spread[constant] * np.clip(shift, -2.0, 2.0)))
    value = three_digits(getattr(rig.true, constant) * factor)
    return replace(rig, nominal=rig.nominal._replace(**{constant: value}))


def make_case(recipe: Recipe, seed: tuple[int, ...]) -> Case:
    """Draw until the effects leave a trace. Deterministic in recipe and seed.

    Raises
    ------
    TooWeakError
        If thirty draws leave none.
    """
    for attempt in range(30):
        try:
            return _drawn(recipe, np.random.default_rng([*seed, attempt]))
        except TooWeakError:
            continue
    raise TooWeakError(f"no trace of {recipe.effects} in thirty draws")


def _drawn(recipe: Recipe, rng: np.random.Generator) -> Case:
    null = recipe.level == "null"
    wrong = int(rng.integers(0, 5)) if null else int(rng.random() < 0.2) * int(rng.integers(1, 3))
    exact = null and rng.random() < 0.25
    rig = draw_rig(rng, columns_for(recipe, rng), wrong=wrong, exact=exact)
    planned = draw_plan(rig.nominal, family_for(recipe, rng), draw_limits(rng), rng)
    seen = planned[:-1]
    bridge = Bridge(gain=rng.uniform(2e-4, 6e-4), volts=rng.uniform(5e-4, 2e-3))
    session = Session(machine=rig.true, sensors=rig.sensors, planned=seen, bridge=bridge)
    swinging = [i for i, p in enumerate(seen) if p.role != "validation" and p.kind != "let-go"]
    swinging = [i for i in swinging if seen[i].load == "pendulum"] or swinging
    session = replace(session, pushed=int(rng.choice(swinging)))
    trace = Trace.of(session, rng)

    applied: tuple[Applied, ...] = ()
    strengths, gaps = {}, {}
    total = np.zeros_like(trace.base)
    for name in recipe.effects:
        effect = ALL[name](rng, rig.true)
        low, high = STRENGTHS[recipe.level]
        aim = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        one, size = search(trace, session, effect, aim, PINNED.get(name, ()))
        if name == "load-unbalance":
            _check_unbalance(one, rig)
        if one.subsystem.startswith("sensor:") and one.subsystem[7:] not in rig.sensors.columns:
            raise TooWeakError
        applied = (*applied, one)
        strengths[name] = size
        total = total + trace.difference(replace(session, applied=(one,)))
    for rival in recipe.rivals:
        gaps[rival] = gap_to(trace, session, total, rival, rng)
    _check_rivals(recipe, gaps, strengths)
    masked = {}
    if recipe.level == "concealed" and recipe.effects[0] in MASKS:
        rig = with_mask(rig, trace, total, recipe.effects[0], rng.uniform(0.5, 1.0))
        constant = MASKS[recipe.effects[0]]
        masked = {constant: getattr(rig.nominal, constant) / getattr(rig.true, constant)}
    drawn = Case(
        recipe=recipe,
        rig=rig,
        planned=planned,
        applied=applied,
        floor=trace.floor,
        strengths=strengths,
        rival_gaps=gaps,
        pushed=session.pushed,
        masked=masked,
    )
    return _recorded(drawn, replace(session, planned=planned, applied=applied), rng)


def _recorded(case: Case, whole: Session, rng: np.random.Generator) -> Case:
    """The case with its readings, noisy and expected, and what follows from the temperature."""
    planned, sensors = case.planned, case.rig.sensors
    for one in case.applied:
        for column, fault in one.faults.items():
            sensors = sensors.with_fault(column, fault)
    clean = motions(whole)
    noisy = motions(whole, noise=rng)
    peak = max(float(m.values["winding_C"].max()) for m in noisy)  # the test is a recording too
    return replace(
        case,
        readings=[
            readings(m.values, p.time_s, sensors, rng) for p, m in zip(planned, noisy, strict=True)
        ],
        expected=[
            expected(m.values, p.time_s, sensors) for p, m in zip(planned, clean, strict=True)
        ],
        applied=tuple(
            replace(a, parameters=thermal_parameters(peak)) if a.name == "drive-thermal" else a
            for a in case.applied
        ),
        peak_winding_C=peak,
    )


def _check_rivals(recipe: Recipe, gaps: dict[str, float], strengths: dict[str, float]) -> None:
    """A poor case must be unanswerable and a confounded one answerable: measured, not assumed."""
    if recipe.level == "poor":
        limit = min(ALIKE, ALIKE_SHARE * strengths[recipe.effects[0]])
        if min(gaps.values()) > limit:
            raise TooWeakError
    elif gaps and min(gaps.values()) < APART:
        raise TooWeakError


def _check_unbalance(applied: Applied, rig: Rig) -> None:
    weight = 9.80665 * rig.true.load_mass_kg * rig.true.load_distance_m
    turn = applied.parameters["torque_amplitude_Nm"] * np.sin(applied.parameters["angle_rad"])
    if abs(turn / weight) < SMALLEST_OFFSET_RAD:
        raise TooWeakError


def poor_recipe(index: int) -> Recipe:
    pair = POOR[index % len(POOR)]
    return Recipe(level="poor", effects=(pair.truth,), rivals=pair.rivals, poor=pair)


def nearest_names(recipe: Recipe) -> list[str]:
    return sorted({n for e in recipe.effects for n in NEAREST.get(e, ())})
