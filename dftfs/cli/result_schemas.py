"""JSON schemas of the files that the commands write, beside those that they read.

What is a record of the program is described by the record's own annotations (`of_record`), so that
file and schema cannot differ; the rest is listed here.
"""

from collections.abc import Callable
from functools import partial

from dftfs.cli.diagnosis_schema import diagnosis
from dftfs.cli.schema_tables import (
    NUMBER,
    TEXT,
    closed,
    list_of,
    nullable,
    of_record,
    table_of,
)

_REAL = nullable(NUMBER)


def _verification(**more: dict) -> dict:
    state = ("deflection_rad", "torque_Nm", "tangent_Nm_per_rad", "peak_von_mises_Pa",
             "min_clearance_m")  # fmt: skip
    place = "dftfs.analysis.torsion"
    known = {
        "design": TEXT, "material": TEXT, "model": TEXT, "stiffness_Nm_per_rad": NUMBER,
        "curve": list_of({**table_of(_REAL), "required": list(state)}), "wall_s": NUMBER,
        "contact_onset": table_of(nullable(of_record(f"{place}.result:ContactOnset"))),
        "ended_by": table_of(TEXT), "mesh": of_record(f"{place}.result:MeshSummary"),
        "mesh_error": nullable(of_record(f"{place}.mesh_error:MeshErrorEstimate")),
    }  # fmt: skip
    return closed((*known, *more), tuple(known), **known, **more)


def _verify() -> dict:
    check = of_record("dftfs.analysis.strength.checks:Check")
    open_ = {}
    return _verification(strength=list_of(check), mesh_series=list_of({}), fatigue=open_,
                         friction_loop=open_, structure=open_)  # fmt: skip


def _study() -> dict:
    more = dict.fromkeys(
        ("stiffness_uncertainty_Nm_per_rad", "stiffness_2d_Nm_per_rad", "stiffness_rod_Nm_per_rad",
         "eq_2_1_Nm_per_rad", "lateral_stiffness_N_per_m", "mass_kg"), NUMBER)  # fmt: skip
    check = of_record("dftfs.analysis.strength.checks:Check")
    provenance = of_record("dftfs.analysis.study.result:Provenance")
    return _verification(**more, checks=list_of(check), paths=table_of(TEXT), structure={},
                         actuator=closed(("metrics", "limits")), friction_loop={},
                         provenance=provenance)  # fmt: skip


def _simulation() -> dict:
    metrics = [of_record(f"rsea_core.simulation.tracking_metrics:{k}Metrics")
               for k in ("Tracking", "Angle")]  # fmt: skip
    keys = ("scenario", "engine", "engine_reason", "metrics", "limits")
    limits = nullable(of_record("rsea_core.performance.limits:TrackingLimits"))
    return closed(keys, keys, scenario=TEXT, engine=TEXT, engine_reason=nullable(TEXT),
                  metrics={"anyOf": metrics}, limits=limits)  # fmt: skip


def _tolerance() -> dict:
    place = "dftfs.analysis.study.tolerance"
    keys = ("design", "tolerances", "spreads", "fit_error", "samples", "seed")
    return closed(keys, keys, design=TEXT, tolerances=of_record(f"{place}:Tolerances"),
                  samples=NUMBER, spreads=list_of(of_record(f"{place}:Spread")), fit_error=NUMBER,
                  seed=NUMBER)  # fmt: skip


def _comparison() -> dict:
    order = closed(("better", "worse", "probability", "difference"), ("better", "worse"),
                   better=TEXT, worse=TEXT, probability=NUMBER,
                   difference=list_of(_REAL))  # fmt: skip
    row = {"type": "object", "required": ["controller", "kind", "rmse", "ranked"]}
    keys = ("name", "rows", "pareto_front", "order", "controllers", "moved")
    return closed(keys, keys, name=TEXT, rows=list_of(row), pareto_front=list_of(TEXT),
                  order=list_of(order), controllers=table_of({"type": "object"}),
                  moved=table_of({}))  # fmt: skip


def _size() -> dict:
    candidate = of_record("dftfs.analysis.sizing.rod_candidate:Candidate")
    keys = ("task", "best", "binding", "front", "judged", "compared", "confirmed",
            "search_wall_s", "wall_s")  # fmt: skip
    return closed(keys, keys, task=TEXT, best=candidate, front=list_of(candidate),
                  judged=NUMBER, binding={}, compared={}, confirmed={})  # fmt: skip


RESULTS: dict[str, Callable[[], dict]] = {
    "diagnosis": diagnosis,
    "study": _study,
    "verify": _verify,
    "simulation": _simulation,
    "tolerance": _tolerance,
    "friction": partial(of_record, "rsea_core.identify.friction.compare:FrictionComparison"),
    "comparison": _comparison,
    "size": _size,
    "shape": partial(of_record, "dftfs.analysis.shape.compare:Comparison"),
    "tuned": partial(of_record, "rsea_core.control.tuning.tune:Tuned"),
}
