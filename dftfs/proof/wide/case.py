"""One case: a machine, concealed effects of a chosen strength, recordings, and what is sealed."""

from dataclasses import dataclass, field, replace

import numpy as np

from dftfs.proof.wide.effects import EFFECTS, Effect
from dftfs.proof.wide.effects_outside import NEAREST, OUTSIDE
from dftfs.proof.wide.machines import KINDS, Drawn, draw_machine, logs
from dftfs.proof.wide.owner import Owner, draw_owner
from dftfs.proof.wide.plans import Dirt, draw_session, played
from dftfs.proof.wide.refit import Fit, Trace, refit, stacked
from dftfs.proof.wide.truth.applied import Applied, with_effects
from dftfs.proof.wide.truth.body import Extra
from dftfs.proof.wide.truth.simulate import Session, UnstableError, readings

LEVELS = ("plain", "concealed", "double", "null", "outside")
# rms that no constants mimic, in noise floors: where the search aims
STRENGTHS = {"plain": (15.0, 400.0), "concealed": (6.0, 40.0), "double": (15.0, 200.0),
             "outside": (12.0, 150.0)}  # fmt: skip
WEAKEST = 5.0
SMALLEST, LARGEST = 1e-3, 12.0
ALIKE = 1.5  # noise floors: a rival that leaves less is as true as the truth
CLOSE = 3.0
ATTEMPTS = 40


class TooWeakError(Exception):
    """This draw leaves no trace that could be found; the maker draws again."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What a case is to hold; a machine or an effect of None is drawn."""

    level: str
    machine: str | None = None
    effect: str | None = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """Everything that is written."""

    recipe: Recipe
    drawn: Drawn
    dirt: Dirt
    owner: Owner
    applied: tuple[Applied, ...]
    session: Session
    exact: list[dict[str, np.ndarray]]
    logged: list[dict[str, np.ndarray]]
    nominal: dict[str, np.ndarray]
    refitted: dict[str, np.ndarray]
    refit_values: dict[str, float]
    floor: list[dict[str, float]]
    strength: dict[str, float]
    share: dict[str, float]
    oracle: dict[str, float]
    gaps: dict[str, float] = field(default_factory=dict)
    peak_winding_C: float | None = None


def healthy(session: Session, like: Session) -> Session:
    """The machine of ``like`` without effects, given the commands that ``session`` was given."""
    planned = tuple(
        replace(p, delay_s=q.delay_s, pulse=q.pulse)
        for p, q in zip(session.planned, like.planned, strict=True)
    )
    return replace(session, body=like.body, extra=Extra(), sensors=like.sensors, planned=planned)


def floors(session: Session) -> list[dict[str, float]]:
    """Noise of every reading: its sensor's, and what the drive's own noise moves."""
    calm = replace(session, planned=tuple(replace(p, wander=None) for p in session.planned))
    out = []
    for p, a, b in zip(session.planned, readings(session), readings(calm), strict=True):
        out.append({c: float(np.hypot(session.sensors[c].floor, np.std(a[c] - b[c])))
                    for c in a if not (p.mode == 1 and c == "load_angle_rad")})  # fmt: skip
    return out


def traced(session: Session, bare: Session, applied: tuple[Applied, ...], trace: Trace):
    """The difference that effects make in the readings, over the floor; and the made session."""
    made = played(with_effects(session, applied))
    same = healthy(made, bare)
    return stacked(readings(made), trace.floor) - stacked(readings(same), trace.floor), made


def search(session: Session, trace: Trace, effect: Effect, aim: float) -> tuple[Applied, float]:
    """Turn the size until what no constants mimic is as strong as aimed at.

    Raises
    ------
    TooWeakError
        If no size is strong enough.
    """
    size, low, high, best = 0.7, SMALLEST, LARGEST, None
    for _ in range(9):
        applied = effect(size)
        try:
            found = trace.strength(
                trace.left_over(traced(session, trace.session, (applied,), trace)[0]))  # fmt: skip
        except UnstableError:
            high, size = size, np.sqrt(low * size)
            continue
        if best is None or abs(np.log(max(found, 1e-9) / aim)) < abs(np.log(best[1] / aim)):
            best = (applied, max(found, 1e-9))
        if 0.75 < found / aim < 1.33 or (size >= 0.99 * LARGEST and found < aim):
            break
        low, high = (size, high) if found < aim else (low, size)
        guess = size * (aim / max(found, 1e-3)) ** 0.8
        size = float(guess if low < guess < high else np.sqrt(low * high))
    if best is None or best[1] < WEAKEST:
        raise TooWeakError
    return best


def rival_gaps(
    rng: np.random.Generator, case_session: Session, trace: Trace, m: Drawn,
    applied: tuple[Applied, ...], total: np.ndarray,
) -> dict[str, float]:  # fmt: skip
    """What is left of the effects' trace when a rival in their place, drawn a few times, and the
    constants explain it. Noise floors."""
    gaps: dict[str, float] = {}
    truth = {a.name for a in applied}
    for name, draw in EFFECTS.items():
        if name in truth:
            continue
        for size in (0.2, 1.0):
            rival = draw(rng, m, case_session)
            if rival is None:
                break
            try:
                column, _ = traced(case_session, trace.session, (rival(size),), trace)
            except UnstableError:
                continue
            if np.abs(column).max() > 1e-3:
                left = trace.strength(trace.left_over(total, also=column[:, None]))
                gaps[name] = min(gaps.get(name, np.inf), left)
    return gaps


def make_case(recipe: Recipe, seed: tuple[int, ...]) -> Case:
    """Draw until the effects leave a trace. Deterministic in recipe and seed.

    Raises
    ------
    TooWeakError
        If no draw leaves one.
    """
    for attempt in range(ATTEMPTS):
        try:
            return drawn_case(recipe, np.random.default_rng([*seed, attempt]))
        except (TooWeakError, UnstableError, np.linalg.LinAlgError):
            continue
    raise TooWeakError(f"no trace of {recipe} in {ATTEMPTS} draws")


def chosen_effects(
    rng: np.random.Generator, recipe: Recipe, m: Drawn, session: Session
) -> list[Effect]:
    """The effects of the recipe on this machine.

    Raises
    ------
    TooWeakError
        If the machine has no place for one.
    """
    if recipe.level == "null":
        return []
    table = OUTSIDE if recipe.level == "outside" else EFFECTS
    names = [recipe.effect] if recipe.effect else []
    fits = {n: e for n, d in table.items() if (e := d(rng, m, session))}
    names = [n for n in names if n in fits]
    if recipe.effect and not names:
        raise TooWeakError
    wanted = 2 if recipe.level == "double" else 1
    others = [n for n in fits if n not in names]
    taken: set[str] = set()
    while len(names) < wanted:
        if not others:
            raise TooWeakError
        names.append(others.pop(int(rng.integers(len(others)))))
    for name in names:  # effects of one case never change the same number
        keys = set(fits[name](1.0).extra) | {f"fault {c}" for c in fits[name](1.0).faults}
        if keys & taken:
            raise TooWeakError
        taken |= keys
    return [fits[n] for n in names]


def drawn_case(recipe: Recipe, rng: np.random.Generator) -> Case:
    """One draw."""
    name = recipe.machine or str(rng.choice(list(KINDS)))
    m, whole, dirt = draw_session(rng, draw_machine(rng, name))
    seen = tuple(p for p in whole.planned if p.role != "test")
    session = replace(whole, planned=seen)
    effects = chosen_effects(rng, recipe, m, session)
    bare = played(session)
    owner = draw_owner(rng, m)
    fit = Fit.of(bare, m.command, owner.magnitudes)
    trace = Trace.of(bare, floors(bare), fit)
    applied: tuple[Applied, ...] = ()
    strength, share = {}, {}
    for effect in effects:
        one, size = search(session, trace, effect, logs(rng, STRENGTHS[recipe.level]))
        applied, strength[one.name] = (*applied, one), size
    gaps: dict[str, float] = {}
    if applied:
        # in feedback the commands answer to the effects: the trace is taken at those of the log
        total, made = traced(session, bare, applied, trace)
        trace = Trace.of(healthy(made, bare), trace.floor, fit)
        strength["together"] = trace.strength(trace.left_over(total))
        if strength["together"] < WEAKEST:
            raise TooWeakError
        share = shares(total, trace, readings(made))
        gaps = rival_gaps(rng, session, trace, m, applied, total)
        if recipe.level == "concealed":
            owner = owner.fooled(trace.jacobian, total, fit, rng)
    trial = Case(recipe=recipe, drawn=m, dirt=dirt, owner=owner, applied=applied, session=whole,
                 exact=[], logged=[], nominal={}, refitted={}, refit_values={}, floor=trace.floor,
                 strength=strength, share=share, oracle={}, gaps=gaps)  # fmt: skip
    return recorded(trial, rng)


def shares(total: np.ndarray, trace: Trace, values: list[dict]) -> dict[str, float]:
    """Rms of the effects' trace over the reading's own standard deviation, by column."""
    base, out = stacked(values, trace.floor), {}
    for a, b, c in trace.blocks:
        spread = max(float(base[a:b].std()), 1e-12)
        out[c] = max(out.get(c, 0.0), float(np.sqrt(np.mean(total[a:b] ** 2))) / spread)
    return out


def recorded(case: Case, rng: np.random.Generator) -> Case:
    """The case with its readings, the rig file's and the refit's predictions, and the oracle.

    Raises
    ------
    TooWeakError
        If the nominal structure, fitted in earnest, explains the readings after all.
    """
    session = played(with_effects(case.session, case.applied))
    exact = readings(session)
    logged = [{c: session.sensors[c].logged(v, rng) for c, v in r.items()} for r in exact]
    same = healthy(session, played(case.session))
    nominal = replace(same, body=case.owner.body(same.body))
    nominal = replace(nominal, planned=tuple(
        replace(p, wander=None, start=p.start._replace(
            angle=first_angle(case.drawn, r, p.start.angle)))
        for p, r in zip(nominal.planned, logged, strict=True)))  # fmt: skip
    used = [k for k, p in enumerate(session.planned) if p.role == "identification"]
    known = replace(nominal, planned=tuple(nominal.planned[k] for k in used))
    fit = Fit.of(known, case.drawn.command, case.owner.magnitudes)
    floor = [case.floor[k] for k in used]
    shift, left = refit(known, [logged[k] for k in used], floor, fit, case.owner.prior(fit))
    truth = stacked([exact[k] for k in used], floor) - stacked([logged[k] for k in used], floor)
    oracle = {"truth": float(np.sqrt(np.mean(truth**2))), "refit": left}
    if case.applied and left < 0.8 * WEAKEST:
        raise TooWeakError
    plain = [replace(p, offset=0.0, delay_s=0.0, linear=False) for p in nominal.planned]
    test = replace(nominal, planned=tuple(plain[-1:]))
    fitted = fit.moved(nominal, shift)
    peak = None
    if any(a.name == "drive-thermal" for a in case.applied):
        peak = 22.0 + hottest(session)
    return replace(
        case, session=session, exact=exact, logged=logged, oracle=oracle,
        nominal=readings(replace(test, sensors=same.sensors))[0],
        refitted=readings(replace(fitted, planned=fitted.planned[-1:]))[0],
        refit_values={n: float(s) for n, s in zip(fit.names, shift, strict=True)},
        peak_winding_C=peak,
    )  # fmt: skip


def first_angle(m: Drawn, reading: dict[str, np.ndarray], true: float) -> float:
    """The angle that a reader starts from: the first row's."""
    if "load_angle_rad" in reading:
        return float(reading["load_angle_rad"][0])
    if "motor_angle_rad" in reading:
        return float(reading["motor_angle_rad"][0]) / m.body.gear_ratio
    return true


def hottest(session: Session) -> float:
    """Largest rise of the winding in the recordings, kelvin, from case warmth and mean heat."""
    from dftfs.proof.wide.truth.simulate import motion, step_of

    x, b, top, warm = session.extra, session.body, 0.0, 0.0
    for p in session.planned:
        out = motion(session, replace(p, start=p.start._replace(winding_K=warm, case_K=warm)))
        step, rise = step_of(session, p)[0], warm
        for i, case in zip(out[:-1, 4], out[:-1, 6], strict=True):
            heat = i * i * b.resistance * (1.0 + x.copper_per_K * rise)
            rise += step * (heat - (rise - case) / x.winding_to_case) / x.winding_capacity
            top = max(top, rise)
        warm = 0.6 * float(out[-1, 6])
    return top


def acceptable(case: Case) -> dict[str, str]:
    """Names that are as true as the truth in these rows, and the effect that they stand for."""
    if len(case.applied) != 1 or case.recipe.level == "outside":
        return {}
    return {n: case.applied[0].name for n, gap in case.gaps.items() if gap < ALIKE}


def nearest(case: Case) -> list[str]:
    if case.recipe.level != "outside":
        return []
    close = [n for n, gap in case.gaps.items() if gap < CLOSE]
    return sorted({*NEAREST[case.applied[0].name], *close})
