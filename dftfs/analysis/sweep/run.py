"""A sweep: many points of one design, each a row; what they share is solved once and kept.

A point is the design with some fields changed. Points that differ only by factors share one solve
(`dftfs.analysis.torsion.batch_solve`), solves run in parallel, and each is kept by its content
the moment it is finished (`dftfs.analysis.jobs.store`): an interrupted sweep loses only
what was being solved, and the next run continues from there. A point that fails is a row that says
why. The rows depend on the inputs and the code only: a resumed sweep gives the same table.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.jobs.store import ContentStore
from dftfs.analysis.sweep.points import SweepPoint, varied_fields
from dftfs.analysis.torsion.batch_solve import SharedProblem, solve_shared
from dftfs.analysis.torsion.result import SIGN
from dftfs.design import SpringDesign, load_design
from dftfs.errors import DesignError, DftfsError
from dftfs.spring.rod import wide_over_plane

Row = dict[str, object]
Runner = Callable[[Callable, Mapping[str, object]], Iterator[tuple[str, dict]]]

RESULTS = (
    "status",
    "reason",
    "material",
    "model",
    "stiffness_Nm_per_rad",
    "contact_winding_rad",
    "contact_winding_Nm",
    "stiffening_winding",
    "contact_unwinding_rad",
    "contact_unwinding_Nm",
    "stiffening_unwinding",
    "operating_torque_Nm",
    "peak_stress_Pa",
    "safety_factor_yield",
    "first_yield_winding_Nm",
    "first_yield_unwinding_Nm",
    "mass_kg",
)


@dataclass(frozen=True, kw_only=True)
class SweepResult:
    """All rows in the order of the points, and how they came about.

    rows : one mapping per point: ``point``, the varied fields as given, then `RESULTS`; a value
    that does not exist is None. designs : per point, None where there is none.
    shared_solves : distinct solves that the points need; from_cache of them were there already.
    """

    fields: tuple[str, ...]
    rows: tuple[Row, ...]
    designs: tuple[SpringDesign | None, ...]
    shared_solves: int
    from_cache: int

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the table's columns."""
        return ("point", *self.fields, *(name for name in RESULTS if name not in self.fields))

    @property
    def failed(self) -> int:
        """How many points have no result."""
        return sum(row["status"] != "ok" for row in self.rows)


def run_sweep(
    source: str,
    base: Mapping[str, str],
    points: Sequence[SweepPoint],
    *,
    model: str,
    states: int,
    beyond: float = 1.0,
    store: ContentStore,
    runner: Runner,
    on_progress: Callable[[str], None] = lambda message: None,
) -> SweepResult:
    """Solve every point of a sweep.

    Parameters
    ----------
    source : str
        As `dftfs.design.load_design` takes it.
    base : mapping
        Fields changed at every point; a point's own changes come after.
    model : {"rod", "2d", "3d"}
    states : int
        States per direction up to the first contact.
    beyond : float
        Where curves end over the deflection of the first contact (1: there).
    runner : callable
        Runs a function over tasks by key and yields (key, result).

    Raises
    ------
    DesignError
        If the design itself, a field's name, the model or the states are wrong.
    """
    fields = varied_fields(points)
    load_design(source, base)
    designs = [_design(source, base, point) for point in points]
    problems = [
        SharedProblem.of(d, model, states, beyond) if isinstance(d, SpringDesign) else None
        for d in designs
    ]
    keys = [problem.key if problem else None for problem in problems]
    tasks = {k: p.content() for k, p in zip(keys, problems) if k is not None and p is not None}
    outcomes = {key: kept for key in tasks if (kept := store.get(key)) is not None}
    kept, wanted = len(outcomes), len(tasks)
    on_progress(
        f"{len(points)} points, {wanted} solves ({model}): {kept} cached, {wanted - kept} to do"
    )
    missing = {key: task for key, task in tasks.items() if key not in outcomes}
    outcomes |= _solve_missing(missing, store, runner, on_progress)
    rows = tuple(
        _row(point, fields, design, problem, outcomes.get(key or ""))
        for point, design, problem, key in zip(points, designs, problems, keys)
    )
    return SweepResult(
        fields=fields,
        rows=rows,
        designs=tuple(d if isinstance(d, SpringDesign) else None for d in designs),
        shared_solves=wanted,
        from_cache=kept,
    )


def _solve_missing(
    missing: Mapping[str, object],
    store: ContentStore,
    runner: Runner,
    on_progress: Callable[[str], None],
) -> dict[str, dict]:
    """Solve tasks by key, each put into the store as soon as it is finished."""
    found: dict[str, dict] = {}
    for key, solved in runner(solve_shared, missing) if missing else ():
        if "crash" not in solved:  # not a property of the inputs: the next run tries again
            store.put(key, solved)
        found[key] = solved
        word = "solved" if "curve" in solved else solved.get("failure") or solved["crash"]
        on_progress(f"{len(found)} of {len(missing)}: {word}")
    return found


def _design(source: str, base: Mapping[str, str], point: SweepPoint) -> SpringDesign | DesignError:
    """The point's design, or why there is none; a misspelt field is an error of all rows."""
    try:
        return load_design(source, {**base, **dict(point.changes)})
    except DesignError as error:
        if "unknown field" in str(error):
            raise
        return error
    except DftfsError as error:
        return DesignError(str(error))
    except (ArithmeticError, ValueError) as error:  # a shape that the geometry did not foresee
        return DesignError(f"no outline: {type(error).__name__}: {error}")


def _row(
    point: SweepPoint,
    fields: Sequence[str],
    design: SpringDesign | DesignError,
    problem: SharedProblem | None,
    solved: dict | None,
) -> Row:
    given = {name: plain_value(value) for name, value in point.changes}
    row: Row = dict.fromkeys(RESULTS)
    row |= {"point": point.index, **{name: given.get(name) for name in fields}}
    if not isinstance(design, SpringDesign) or problem is None or solved is None:
        return row | {"status": "failed", "reason": " ".join(str(design).split())}
    row |= {"material": design.material.name, "mass_kg": float(design.mass_kg)}
    if "curve" not in solved:
        why = solved.get("failure") or f"the solve ended without a result: {solved['crash']}"
        return row | {"status": "failed", "reason": why}
    return row | {"status": "ok"} | _results(design, problem, solved["curve"])


def plain_value(text: str) -> object:
    """A number where the text is one."""
    try:
        return float(text)
    except ValueError:
        return text


def _results(design: SpringDesign, problem: SharedProblem, curve: Mapping) -> Row:
    """The shared curve with the design's factors, judged with its strengths.

    Torque and stress at an angle of the plane models, which do not know that a wide strip resists
    to curl, are scaled by the rod's ratio of both stiffnesses; stress over torque stays.
    """
    material, wide = design.material, 1.0
    if problem.model != "3d":
        elastic = material.youngs_modulus_Pa, material.poisson_ratio
        wide = wide_over_plane(design.outline, design.width_m, *elastic)
    by_torque, by_stress = (wide * factor for factor in problem.factors(design))
    torque = by_torque * np.array(curve["torque_Nm"])
    stress = by_stress * np.array(curve["peak_stress_Pa"])
    found: Row = {
        "model": curve["model"],
        "stiffness_Nm_per_rad": by_torque * curve["stiffness_Nm_per_rad"],
    }
    for direction, onset in curve["contact_onset"].items():
        if onset is not None:
            found[f"contact_{direction}_rad"] = onset["deflection_rad"]
            found[f"contact_{direction}_Nm"] = by_torque * onset["torque_Nm"]
            found[f"stiffening_{direction}"] = onset["stiffening"]
    asked, strength = design.requirements.operating_torque_Nm, design.material.yield_strength_Pa
    if asked is not None:
        worst = max(stress_at(asked, sign * torque, stress) for sign in SIGN.values())
        found |= {"operating_torque_Nm": asked, "peak_stress_Pa": worst}
        if strength is not None:
            found["safety_factor_yield"] = strength / worst
    if strength is not None:
        for direction, sign in SIGN.items():
            found[f"first_yield_{direction}_Nm"] = sign * _yield_torque(
                strength, sign * torque, stress
            )
    return found


def stress_at(asked_Nm: float, torque_Nm: np.ndarray, stress_Pa: np.ndarray) -> float:
    """Peak stress at a torque on the positive side of a curve (n,), elastic.

    Stress over torque is interpolated between the states, and kept beyond the last one.
    """
    side = torque_Nm > 0
    order = np.argsort(torque_Nm[side])
    at = torque_Nm[side][order]
    return float(asked_Nm * np.interp(asked_Nm, at, (stress_Pa[side][order]) / at))


def _yield_torque(strength_Pa: float, torque_Nm: np.ndarray, stress_Pa: np.ndarray) -> float:
    """Torque at which the peak stress reaches the strength: secants on the elastic curve."""
    side = torque_Nm > 0
    order = np.argsort(torque_Nm[side])
    at, peak = torque_Nm[side][order], np.maximum.accumulate(stress_Pa[side][order])
    if strength_Pa >= peak[-1]:
        return float(at[-1] * strength_Pa / peak[-1])
    return float(np.interp(strength_Pa, np.append(0.0, peak), np.append(0.0, at)))
