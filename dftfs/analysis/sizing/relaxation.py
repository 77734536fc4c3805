"""Where nothing meets a task: which requirements are in the way, and how far each would have to go.

Each requirement is taken out in turn and the search repeated for the least shortfall in it alone,
all others kept. What it finds is a design, judged again with the requirement as relaxed: "works
to 14 Nm" stands for a spring. A requirement without which the task is still not met is no remedy
by itself and is listed as such.

Torque and stiffness are one: of a given shape both the torque before contact and the torque at
the allowed stress are proportional to the width, and so is the stiffness. A spring that reaches
a share f of the asked torque reaches all of it at 1 / f of the stiffness.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

from dftfs.analysis.sizing.archive import Archive, Assess
from dftfs.analysis.sizing.grid import Grid
from dftfs.analysis.sizing.limits import RANGE, Limit, staged_violation
from dftfs.analysis.sizing.ranges import derived_ranges
from dftfs.analysis.sizing.rod_candidate import INFEASIBLE, Candidate, assess_values
from dftfs.analysis.sizing.search import search
from dftfs.analysis.sizing.task import SizingTask
from dftfs.analysis.strength.fatigue_lives import rated_line

Pool = Callable[[SizingTask], AbstractContextManager[Assess]]

_ZOOMS = ((0.2, 5), (0.05, 4))  # of the grids: the archive holds a whole search already
_WIDER_ZOOMS = ((1.0, 9), (0.15, 5))
_POPULATION = 24
_LARGEST_ENVELOPE = 2.0  # times the asked one
_MOST_STEPS = 8
# what only some tasks ask for: its limit's name, unit, and the sign of what is minimised
_STATED = {
    "min_bore_m": ("bore", "mm", -1),
    "max_mass_kg": ("mass", "g", 1),
    "min_lateral_N_per_m": ("lateral stiffness", "N/mm", -1),
    "max_inertia_kg_m2": ("inertia", "kg mm2", 1),
    "equal_range": (RANGE, "%", 1),
    "max_scatter": ("scatter of K, 2 standard deviations", "%", 1),
}
_NEAR = 0.05  # of what is asked
_SPARE = 1.002  # on each correction of a relaxed requirement, so that it ends on the safe side


@dataclass(frozen=True, kw_only=True)
class Relaxation:
    """A requirement that is in the way: what was asked, what can be met, and by which candidate.

    ``works`` is None where the task is not met even without the requirement.
    """

    requirement: str
    asked: float
    works: float | None
    unit: str
    candidate: Candidate | None

    def line(self) -> str:
        """One line of text."""
        if self.works is None:
            return f"{self.requirement}: no remedy by itself"
        return f"{self.requirement}: {self.asked:.4g} {self.unit} asked, works at {self.works:.4g}"


def relaxations(
    archive: Archive,
    pool: Pool,
    *,
    seed: int = 0,
    on_progress: Callable[[str], None] = lambda message: None,
) -> tuple[Relaxation, ...]:
    """The nearest requirement that can be met, for each one of a task that cannot.

    Parameters
    ----------
    archive : Archive
        What a search of the task has judged.
    pool : callable
        Judges candidates of a changed task.
    """
    found = []
    if archive.best.stress_Pa is not None:  # else nothing can be made, and nothing was loaded
        for look in (_torque_and_stiffness, _contact, _strength, _life):
            found += list(look(archive, seed))
            on_progress(f"{len(archive.known)} judged; {found[-1].line()}")
    for field, limit in _STATED.items():
        if getattr(archive.task, field) is not None and _near(archive.best, limit[0]):
            found.append(_without(archive.task, pool, seed, field, limit))
            on_progress(found[-1].line())
    for look in (_envelope, _process):  # a larger envelope is a finer process: scaled, they are one
        found.append(look(archive.task, pool, seed))
        on_progress(found[-1].line())
        if found[-1].works is None:
            break
    return tuple(found)


def _near(best: Candidate, name: str) -> bool:
    """Whether the nearest candidate breaks a limit or nearly so; no search is spent on others."""
    return all(limit.margin < _NEAR for limit in best.limits if limit.name == name)


def _least(archive: Archive, stages: tuple[str, ...], seed: int) -> Candidate:
    """The candidate with the least shortfall in some stages that keeps all others."""

    def merit(candidate: Candidate) -> float:
        if candidate.stress_Pa is None:
            return INFEASIBLE * (1 + candidate.violation)
        others = staged_violation(candidate.limits, without=stages)
        return INFEASIBLE * (1 + others) if others else shortfall(candidate, stages)

    ranked = replace(archive, merit=merit)
    return search(ranked, seed=seed + 1, zooms=_ZOOMS, population=_POPULATION)


def shortfall(candidate: Candidate, stages: tuple[str, ...]) -> float:
    """Largest factor that a candidate's limits of some stages miss what is asked by, less 1."""
    worst = -1.0
    for limit in candidate.limits:
        if limit.stage in stages:
            less = limit.unit == "Nm"  # a torque must not be below, a stress not above
            high, low = (limit.asked, limit.found) if less else (limit.found, limit.asked)
            worst = max(worst, high / max(low, 1e-12) - 1)
    return worst


def _settled(
    changed: Callable[[float], SizingTask],
    candidate: Candidate,
    stages: tuple[str, ...],
    factor: float,
) -> tuple[float, Candidate | None]:
    """The factor by which a requirement must give way until the candidate keeps every limit.

    Each judgement says what is still missing; None where it does not settle.
    """
    for _ in range(_MOST_STEPS):
        task = changed(factor)
        again = assess_values(task, dict(candidate.values_mm) | _number(task, candidate))
        if again.feasible:
            return factor, again
        if staged_violation(again.limits, without=stages):
            break
        factor *= (1 + shortfall(again, stages)) * _SPARE
    return factor, None


def _number(task: SizingTask, candidate: Candidate) -> dict[str, float]:
    names = [material.name for material in task.materials] or [task.material.name]
    return {"material_number": 1.0 + names.index(candidate.material)}


def _torque_and_stiffness(archive: Archive, seed: int) -> Iterator[Relaxation]:
    task, stages = archive.task, ("contact", "stress", "life")
    best = _least(archive, stages, seed)
    asked, stiffness = task.contact_free_torque_Nm, task.stiffness_Nm_per_rad

    def weaker(factor: float) -> SizingTask:
        return replace(
            task,
            contact_free_torque_Nm=asked / factor,
            operating_torque_Nm=task.operating_torque_Nm / factor,
        )

    first = max(1.0, 1 + shortfall(best, stages))
    factor, met = _settled(weaker, best, stages, first)
    yield Relaxation(
        requirement="torque, before contact and in operation",
        asked=asked,
        works=asked / factor if met else None,
        unit="Nm",
        candidate=met,
    )
    factor, met = _settled(
        lambda f: replace(task, stiffness_Nm_per_rad=f * stiffness), best, stages, first
    )
    yield Relaxation(
        requirement="stiffness",
        asked=stiffness,
        works=factor * stiffness if met else None,
        unit="Nm/rad",
        candidate=met,
    )


def _contact(archive: Archive, seed: int) -> Iterator[Relaxation]:
    """Coils that may touch before the operating torque, which stays as asked."""
    task, best = archive.task, _least(archive, ("contact",), seed + 1)
    asked = task.contact_free_torque_Nm
    factor, met = _settled(
        lambda f: replace(task, contact_free_torque_Nm=asked / f),
        best,
        ("contact",),
        max(1.0, 1 + shortfall(best, ("contact",))),
    )
    yield Relaxation(
        requirement="torque before contact alone",
        asked=asked,
        works=asked / factor if met else None,
        unit="Nm",
        candidate=met,
    )


def _strength(archive: Archive, seed: int) -> Iterator[Relaxation]:
    task, best = archive.task, _least(archive, ("stress",), seed + 2)
    kept = best.stress_Pa is not None and not staged_violation(best.limits, without=("stress",))
    factor = 1 + shortfall(best, ("stress",)) if kept else 1.0
    strength = task.material.yield_strength_Pa or 0.0
    yield Relaxation(
        requirement=f"yield strength of {best.material}, at the same modulus",
        asked=strength / 1e6,
        works=factor * strength / 1e6 if kept else None,
        unit="MPa",
        candidate=best if kept else None,
    )


def _life(archive: Archive, seed: int) -> Iterator[Relaxation]:
    """Fewer cycles at the same torque; a life is a power of the amplitude (Basquin)."""
    task, asked = archive.task, archive.task.life_cycles
    if asked is None:
        return
    best = _least(archive, ("life",), seed + 3)
    material = next(m for m in (*task.materials, task.material) if m.name == best.material)
    line, _ = rated_line(material, gradient_per_mm=0, surface=task.surface, survival=task.survival)
    power = -1 / line.slope
    factor, met = _settled(
        lambda f: replace(task, life_cycles=asked / f**power),
        best,
        ("life",),
        max(1.0, 1 + shortfall(best, ("life",))),
    )
    yield Relaxation(
        requirement="cycles in either direction",
        asked=asked,
        works=asked / factor**power if met else None,
        unit="cycles",
        candidate=met,
    )


def _without(
    task: SizingTask, pool: Pool, seed: int, field: str, limit: tuple[str, str, int]
) -> Relaxation:
    """What a limit that only some tasks state comes to where all others are kept."""
    name, unit, sign = limit
    # far enough to keep nothing out, so that the limit is still judged
    free = replace(task, **{field: getattr(task, field) * (1e-6 if sign < 0 else 1e6)})

    def value(candidate: Candidate) -> Limit:
        return next(one for one in candidate.limits if one.name == name)

    def merit(candidate: Candidate) -> float:
        if candidate.feasible:
            return sign * value(candidate).found
        return INFEASIBLE * (1 + candidate.violation)

    with pool(free) as judge:
        best = search(
            Archive.of(free, judge, merit), seed=seed, zooms=_WIDER_ZOOMS, population=_POPULATION
        )
    scale = value(best).asked / getattr(free, field) if best.limits else 1.0
    return Relaxation(
        requirement=name,
        asked=scale * getattr(task, field),
        works=value(best).found if best.feasible else None,
        unit=unit,
        candidate=best if best.feasible else None,
    )


def _envelope(task: SizingTask, pool: Pool, seed: int) -> Relaxation:
    """The smallest outside diameter of a task whose envelope is larger."""
    large = 1e3 * _LARGEST_ENVELOPE * task.envelope_m
    derived = derived_ranges(large, task.process)
    fixed = {name: grid for name, grid in task.by_name.items() if not grid.steps}
    grids = []
    for grid in task.grids:
        given = derived.get(grid.name)
        name = "outer_diameter_mm" if grid.name == "outer_radius_mm" else grid.name
        given = derived[name] if name == "outer_diameter_mm" else given
        if isinstance(given, list) and grid.name not in fixed and grid.name != "turns":
            low = 0.4 * large if name == "outer_diameter_mm" else min(given[0], grid.low)
            grid = Grid(name=name, low=low, high=given[1], increment=given[2])
        grids.append(grid)
    wider = replace(task, envelope_m=1e-3 * large, grids=tuple(grids))

    def merit(candidate: Candidate) -> float:
        return across(candidate) if candidate.feasible else INFEASIBLE * (1 + candidate.violation)

    def across(candidate: Candidate) -> float:
        return next(limit.found for limit in candidate.limits if limit.name == "envelope")

    with pool(wider) as judge:
        best = search(
            Archive.of(wider, judge, merit), seed=seed, zooms=_WIDER_ZOOMS, population=_POPULATION
        )
    return Relaxation(
        requirement="envelope",
        asked=1e3 * task.envelope_m,
        works=across(best) if best.feasible else None,
        unit="mm",
        candidate=best if best.feasible else None,
    )


def _process(task: SizingTask, pool: Pool, seed: int) -> Relaxation:
    """The gap and inside radius of a finer process of the same kind, as a share of this one's."""
    made = task.process
    finer = replace(made, gap_m=made.gap_m / 10, inside_radius_m=made.inside_radius_m / 10)
    finer = replace(finer, gap_per_width=0.0, inside_radius_per_width=0.0)
    derived = derived_ranges(1e3 * task.envelope_m, finer)
    grids = tuple(
        Grid(name=g.name, low=derived[g.name][0], high=g.high, increment=g.increment)
        if g.name == "fillet_radius_mm" and isinstance(derived[g.name], list) and g.steps
        else g
        for g in task.grids
    )
    other = replace(task, process=finer, grids=grids)

    def gap(candidate: Candidate) -> float:
        names = ("smallest gap between coils", "slit's width at its end")
        return min(limit.found for limit in candidate.limits if limit.name in names)

    def merit(candidate: Candidate) -> float:
        return -gap(candidate) if candidate.feasible else INFEASIBLE * (1 + candidate.violation)

    with pool(other) as judge:
        best = search(
            Archive.of(other, judge, merit), seed=seed, zooms=_WIDER_ZOOMS, population=_POPULATION
        )
    return Relaxation(
        requirement=f"gap that {made.name} cuts",
        asked=1e3 * made.gap_m,
        works=gap(best) if best.feasible else None,
        unit="mm",
        candidate=best if best.feasible else None,
    )
