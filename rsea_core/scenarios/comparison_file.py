"""A comparison of controllers in a file: the task, the budget, the controllers and their bounds."""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path

from rsea_core.control import Controller
from rsea_core.control.tuning.comparison import ComparedController, Comparison
from rsea_core.control.tuning.optimisers import DEFAULT, METHODS
from rsea_core.control.tuning.robustness import Disturbance
from rsea_core.control.tuning.tune import Task
from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import RseaError, ScenarioError
from rsea_core.files.toml_tables import (
    file_name,
    nearest,
    number,
    read_toml,
    require_known,
    table,
    word,
)
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.perturbed import Deviation, perturbed_models
from rsea_core.model.posterior import read_posterior
from rsea_core.scenarios.scenario import (
    controller_from_table,
    notes_of_rig,
    reference_kind,
    rig_and_spring,
    terms_of_rig,
)
from rsea_core.scenarios.scenario_terms import scenario_terms

TABLES = (
    "name", "rig", "rig_values", "spring", "load", "terms", "environment", "disturbance",
    "reference", "task", "budget", "controller", "disturbances", "known", "tolerances",
)  # fmt: skip
TASK_KEYS = (
    "duration_s", "from_s", "cost", "effort_weight", "force_N", "force_per_torque_per_m",
    "angle_scale_rad", "force_scale_N", "noise_motor_rad", "noise_load_rad", "noise_current_A",
    "noise_seed", "least_modulus_margin",
)  # fmt: skip
DISTURBANCE_KEYS = ("peak_Nm", "start_s", "end_s", "rise_s")
MOST_RUNS = 100_000  # of a budget: seeds, candidates, generations
PLANT_KEYS = ("rig", "rig_values", "spring", "terms", "environment", "disturbance")
DIAGNOSIS = "diagnosis"  # of [tolerances]: a file whose spreads are taken
BUDGET_KEYS = ("method", "seeds", "population", "generations", "perturbed")


SolveDesign = Callable[[str], SpringCurve]
"""Name of a spring design as the file has it, to its curve."""


def read_comparison(path: str | Path, solve_design: SolveDesign | None = None) -> Comparison:
    """The comparison of a TOML file; files that it names are looked for beside it.

    Parameters
    ----------
    solve_design : callable or None
        Solves a spring that is given as a design; None: such a spring is refused.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or an entry is unknown, missing or unusable.
    """
    path = Path(path)
    tables = read_toml(path, ScenarioError)
    try:
        return _comparison(tables, path, solve_design)
    except RseaError as problem:
        raise ScenarioError(f"{path}: {problem}") from problem


def _comparison(tables: Mapping, path: Path, solve_design: SolveDesign | None) -> Comparison:
    require_known(tables, TABLES, "the comparison", ScenarioError)
    for name in ("rig", "load", "reference", "task", "controller"):
        if name not in tables:
            raise ScenarioError(f"{name} is missing")
    model = _machine(tables, path.parent, solve_design)
    known = None
    if "known" in tables:
        own = table(tables["known"], "known", ScenarioError)
        require_known(own, PLANT_KEYS, "[known]", ScenarioError)
        known = _machine({**_plant(tables), **own}, path.parent, solve_design)
    task = _task(tables, model, known)
    budget = table(tables.get("budget", {}), "budget", ScenarioError)
    require_known(budget, BUDGET_KEYS, "[budget]", ScenarioError)
    tolerances, unmoved = _tolerances(tables, model, path.parent)
    return Comparison(
        name=file_name(tables.get("name", path.stem), "name", ScenarioError),
        task=task,
        controllers=tuple(
            _compared_controller(t, j, path.parent) for j, t in _listed(tables, "controller")
        ),
        disturbances=tuple(_disturbance(t, j) for j, t in _listed(tables, "disturbances")),
        notes=(*notes_of_rig(tables["rig"], path.parent), *unmoved),
        **_budget(budget),
        **tolerances,
    )


def _plant(tables: Mapping) -> dict:
    return {key: tables[key] for key in PLANT_KEYS if key in tables}


def _machine(tables: Mapping, folder: Path, solve_design: SolveDesign | None) -> ActuatorModel:
    """The machine of a file's tables, or of [known]."""
    entries = table(tables.get("spring", {}), "spring", ScenarioError)
    rig, spring, design = rig_and_spring(tables["rig"], entries, folder)
    if design is not None:
        if solve_design is None:
            raise ScenarioError(
                f"[spring] design = {design!r} must be solved first: run it by `dftfs compare`"
            )
        spring = solve_design(design)
    changes = table(tables.get("rig_values", {}), "rig_values", ScenarioError)
    require_known(changes, [f.name for f in fields(rig)], "[rig_values]", ScenarioError)
    rig = replace(rig, **changes)
    curve = () if spring is None else (spring,)
    held = terms_of_rig(tables["rig"], entries, folder)
    return ActuatorModel(rig, (*curve, *held, *scenario_terms(tables)))


def _tolerances(tables: Mapping, model: ActuatorModel, folder: Path) -> tuple[dict, list[str]]:
    """The machines' spread, and what of a diagnosis it goes without."""
    if "tolerances" not in tables:
        return {}, []
    given = dict(table(tables["tolerances"], "tolerances", ScenarioError))
    found: dict[str, float | Deviation] = {}
    notes = []
    if DIAGNOSIS in given:
        file = word(given.pop(DIAGNOSIS), f"[tolerances] {DIAGNOSIS}", ScenarioError)
        posterior = read_posterior(folder / file, model)
        found |= {key: Deviation(size=size) for key, size in posterior.deviations.items()}
        notes += [f"{file}: {posterior.note}"] if posterior.held else []
    for key, value in given.items():
        spread = number(value, f"[tolerances] {key}", ScenarioError)
        if not 0.0 <= spread < 0.5:
            raise ScenarioError(f"[tolerances] {key} = {spread:g} must be a share in 0..0.5")
        found[key] = spread
    perturbed_models(model, 1, 0, found)  # names what the machine does not have
    return {"tolerances": found}, notes


def _disturbance(entries: Mapping, j: int) -> Disturbance:
    where = f"[[disturbances]] number {j + 1}"
    require_known(entries, DISTURBANCE_KEYS, where, ScenarioError)
    for key in DISTURBANCE_KEYS[:3]:
        if key not in entries:
            raise ScenarioError(f"{where}: {key} is missing")
    values = {key: number(v, f"{where} {key}", ScenarioError) for key, v in entries.items()}
    return Disturbance(**values)


def _listed(tables: Mapping, name: str):
    found = tables.get(name, [])
    if not isinstance(found, list) or not all(isinstance(t, Mapping) for t in found):
        raise ScenarioError(f"{name} must be written as [[{name}]] tables")
    return list(enumerate(found))


def _task(tables: Mapping, model: ActuatorModel, known: ActuatorModel | None) -> Task:
    entries = table(tables["task"], "task", ScenarioError)
    require_known(entries, TASK_KEYS, "[task]", ScenarioError)
    if "duration_s" not in entries:
        raise ScenarioError("[task] duration_s is missing")
    values = dict(entries)
    noise = tuple(
        number(values.pop(key, 0.0), f"[task] {key}", ScenarioError)
        for key in ("noise_motor_rad", "noise_load_rad", "noise_current_A")
    )
    for key in values.keys() - {"cost"}:
        values[key] = number(values[key], f"[task] {key}", ScenarioError)
    values["noise_seed"] = int(values.get("noise_seed", 0))
    loads = tables["load"] if isinstance(tables["load"], list) else [tables["load"]]
    reference = table(tables["reference"], "reference", ScenarioError)
    return Task(
        model=model,
        known_model=known,
        loads=tuple(
            Load.from_table(table(entry, "load", ScenarioError), "[load]") for entry in loads
        ),
        reference=reference_kind(reference).from_table(reference, "[reference]"),
        noise=noise,
        **values,
    )


def _budget(entries: Mapping) -> dict:
    values = dict(entries)
    seeds = values.get("seeds", 1)
    if isinstance(seeds, int) and not isinstance(seeds, bool) and 0 < seeds <= MOST_RUNS:
        seeds = list(range(seeds))
    if not isinstance(seeds, list) or not seeds or not all(isinstance(s, int) for s in seeds):
        raise ScenarioError(f"[budget] seeds = {seeds!r} must be a count or a list of integers")
    values["seeds"] = tuple(seeds)
    method = word(values.get("method", DEFAULT), "[budget] method", ScenarioError)
    if method not in METHODS:
        raise ScenarioError(f"[budget] method {method!r} is unknown; {nearest(method, METHODS)}")
    for key in ("population", "generations", "perturbed"):
        value = values.get(key, 0)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= MOST_RUNS:
            raise ScenarioError(
                f"[budget] {key} = {value!r} must be a whole number from 0 to {MOST_RUNS}"
            )
    return values


def _compared_controller(entries: Mapping, j: int, folder: Path) -> ComparedController:
    values = dict(entries)
    name, bounds = values.pop("name", None), values.pop("tune", {})
    where = f"[[controller]] {name or j + 1}"
    if name is not None and not isinstance(name, str):
        raise ScenarioError(f"[[controller]] number {j + 1}: name = {name!r} must be a word")
    try:
        controller = controller_from_table(values, folder)
    except RseaError as problem:
        raise ScenarioError(f"{where}: {problem}") from problem
    bounds = table(bounds, f"{where} tune", ScenarioError)
    for key, pair in bounds.items():
        if not isinstance(getattr(controller, key, None), float):
            numbers = [f.name for f in fields(controller) if isinstance(f.default, float)]
            raise ScenarioError(f"{where}: tune {key!r} is no number; {nearest(key, numbers)}")
        if not (isinstance(pair, list) and len(pair) == 2):
            raise ScenarioError(f"{where}: tune {key} = {pair!r} must be [lowest, highest]")
    ranges = {
        key: tuple(number(x, f"{where}: tune {key}", ScenarioError) for x in pair)
        for key, pair in bounds.items()
    }
    return ComparedController(
        name=str(name or controller.kind), controller=controller, bounds=ranges
    )


def controller_to_toml(controller: Controller) -> str:
    """A controller as the [controller] table of a scenario."""
    lines = ["[controller]", f'kind = "{controller.kind}"']
    for f in fields(controller):
        value = getattr(controller, f.name)
        if isinstance(value, tuple):
            text = "[" + ", ".join(repr(float(x)) for x in value) + "]"
        elif isinstance(value, bool):
            text = str(value).lower()
        else:
            text = f'"{value}"' if isinstance(value, str) else repr(value)
        lines.append(f"{f.name} = {text}")
    return "\n".join([*lines, ""])
