"""What readers of files accept and commands write, as JSON schema, for editors and programs.

Every schema is made from the readers' own lists of keys, so that it cannot differ from them. Values
that only a reader can judge (a controller's fields, an effect's parameters) are left open.
"""

from collections.abc import Callable

from dftfs.analysis.sizing import task as sizing
from dftfs.cli.result_schemas import RESULTS
from dftfs.cli.schema_tables import NUMBER, TABLE, TABLES, TEXT, closed, list_of, one_of
from dftfs.design import REQUIRED, REQUIREMENT_KEYS, SPRING_KEYS
from rsea_core.machine.inputs import LOADS, Load
from rsea_core.machine.rig import AXES, COUNT, NOT_NEGATIVE, PARTS, POSITIVE, QUANTITIES
from rsea_core.machine.rig import TABLES as RIG_TABLES
from rsea_core.model.diagnosed_effects import FOUND_KEYS, LAW_KEYS
from rsea_core.model.model_file import TABLES as MODEL_TABLES
from rsea_core.recordings.case import RECORDING_KEYS
from rsea_core.scenarios import comparison_file as comparison
from rsea_core.scenarios import scenario

RANGES = {
    POSITIVE: {"exclusiveMinimum": 0},
    NOT_NEGATIVE: {"minimum": 0},
    COUNT: {"type": "integer", "exclusiveMinimum": 0},
}


def schema(name: str) -> dict:
    """The JSON schema of a kind of file; ``name`` is a key of `SCHEMAS`."""
    return {"title": f"dftfs {name}"} | SCHEMAS[name]()


def _rig_table() -> dict:
    values = {
        key: NUMBER | RANGES.get(info["allowed"], {}) | {"description": f"in {info['unit']}"}
        for key, info in QUANTITIES.items()
    }
    parts = {"type": "array", "items": one_of(*PARTS)}
    keys = ("name", "parts", "axis", *QUANTITIES)
    return closed(keys, ["name"], name=TEXT, parts=parts, axis=one_of(*AXES), **values)


def _tolerances() -> dict:
    return closed(QUANTITIES, **dict.fromkeys(QUANTITIES, NUMBER))


def _anchor() -> dict:
    return closed(("quantities",), quantities={"type": "array", "items": one_of(*QUANTITIES)})


def _rig() -> dict:
    roles = one_of("identification", "validation")
    recording = closed(RECORDING_KEYS, file=TEXT, role=roles, load=one_of(*LOADS), columns=TABLE,
                       description=TEXT)  # fmt: skip
    return closed(RIG_TABLES, ["rig"], rig=_rig_table(), tolerances=_tolerances(),
                  anchor=_anchor(), term=TABLES, recording=list_of(recording),
                  columns=TABLE)  # fmt: skip


def _model() -> dict:
    law = closed(LAW_KEYS, effect=TEXT, law=TEXT, values=TABLE)
    return closed(MODEL_TABLES, ["rig"], rig=_rig_table(), tolerances=_tolerances(),
                  anchor=_anchor(), term=TABLES, found=closed(FOUND_KEYS),
                  law=list_of(law))  # fmt: skip


def _design() -> dict:
    spring = closed(SPRING_KEYS, (*REQUIRED, "material"), name=TEXT, material=TEXT, turns=NUMBER,
                    centreline=TEXT, materials_file=TEXT, n_arms={"type": "integer"},
                    **{k: NUMBER for k in SPRING_KEYS if k.endswith("_mm")})  # fmt: skip
    asked = closed(REQUIREMENT_KEYS, **dict.fromkeys(REQUIREMENT_KEYS, NUMBER))
    mesh = closed(("size", "layers"), size=NUMBER, layers={"type": "integer"})
    return closed(("spring", "requirements", "mesh"), ["spring"], spring=spring,
                  requirements=asked, mesh=mesh)  # fmt: skip


def _load() -> dict:
    return closed(tuple(Load.__dataclass_fields__), kind=one_of(*LOADS))


def _spring() -> dict:
    return closed(scenario.SPRING_KEYS, curve_csv=TEXT, design=TEXT)


def _scenario() -> dict:
    return closed(
        scenario.TABLES, name=TEXT, rig={"anyOf": [TEXT, _rig_table()]}, spring=_spring(),
        load=_load(), reference=TABLE, controller=TABLE, terms=TABLES, environment=TABLE,
        disturbance=TABLE, sensors=TABLE, simulation=closed(scenario.SIMULATION_KEYS),
    )  # fmt: skip


def _comparison() -> dict:
    whole = {"type": "integer"}
    budget = closed(comparison.BUDGET_KEYS, method=TEXT, population=whole, generations=whole,
                    perturbed=whole)  # fmt: skip
    plant = {"rig": {"anyOf": [TEXT, _rig_table()]}, "spring": _spring(), "terms": TABLES,
             "rig_values": closed(QUANTITIES), "environment": TABLE,
             "disturbance": TABLE}  # fmt: skip
    return closed(
        comparison.TABLES, **plant, name=TEXT, reference=TABLE, budget=budget,
        load={"anyOf": [_load(), list_of(_load())]},
        task=closed(comparison.TASK_KEYS), controller=TABLES,
        known=closed(comparison.PLANT_KEYS, **plant), tolerances=TABLE,
    )  # fmt: skip


def _task() -> dict:
    keys = (*sizing.NUMBERS, *sizing.TEXT_KEYS, "centreline", "compare", "process_file", "n_arms")
    compare = {"type": "array", "items": TEXT}
    task = closed(keys, compare=compare, centreline=TEXT, process_file=TEXT)
    return closed(("task", "variables"), task=task, variables=closed(sizing.VARIABLES))


SCHEMAS: dict[str, Callable[[], dict]] = {
    "rig": _rig,
    "model": _model,
    "design": _design,
    "scenario": _scenario,
    "comparison": _comparison,
    "task": _task,
    **{f"{name}-result": make for name, make in RESULTS.items()},
}
