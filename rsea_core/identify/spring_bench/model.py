"""The spring that a bench found, as a model that simulations and controllers can use."""

from dataclasses import replace

import numpy as np

from rsea_core.effects.registry import (
    SensorDelay,
    SpringCurve,
    SpringHysteresis,
    SpringViscoelastic,
    Term,
)
from rsea_core.errors import RseaError
from rsea_core.identify.spring_bench.explanations import SpringDiagnosis
from rsea_core.identify.spring_bench.regression import (
    ASYMMETRY,
    CONTACT,
    HARDENING,
    KNEE,
    KNEES,
    LAG,
    SLIP,
    beyond,
    zero_of,
)
from rsea_core.machine.rig import Rig
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel

POINTS = 41  # of an elastic curve
RIGID = 1e-3  # of the flank's stiffness: what is left of a spring all of which slips


def delay_s(scale: float, coefficient: float, time_s: float) -> float:
    """How late a torque is read, of slow motion, by the column of a low-pass."""
    return -coefficient * time_s / max(scale, 1e-300)


def spring_model(
    rig: Rig, found: SpringDiagnosis, design: SpringCurve | None
) -> tuple[ActuatorModel, tuple[str, ...]]:
    """The rig with the spring found, and what of it no term can hold, a sentence each."""
    best, bench = found.best, found.bench
    flank = best.scale * bench.stiffness
    if not flank > 0.0:
        return ActuatorModel(rig), ("the model is the rig's: no elastic stiffness was found",)
    scale = float(best.fit.coefficients[0])
    parallel = scale * bench.stiffness
    sliders: dict[str, float] = {}
    terms: list[Term] = []
    notes: list[str] = []

    def add(what: str, make) -> None:
        try:
            terms.append(make())
        except RseaError as problem:
            notes.append(f"the model leaves {what} out: {problem}")

    for j, c in zip(best.fit.columns[1:], best.fit.coefficients[1:], strict=True):
        column, c = bench.columns[j], float(c)
        if column.piece == SLIP:
            k = len(sliders) // 2 + 1
            sliders[f"stiffness_{k}_Nm_per_rad"] = c
            sliders[f"yield_{k}_rad"] = column.parameters["reach_rad"]
        elif column.piece == CONTACT:
            notes.append("the model leaves out friction between the coils: no effect has it")
        elif column.piece == LAG:
            time_s = column.parameters["time_s"]
            if c < 0.0:
                late = delay_s(scale, c, time_s)
                add("the lag", lambda late=late: SensorDelay(column="torque_Nm", delay_s=late))
            else:
                branch = {
                    "branch_stiffness_1_Nm_per_rad": c * bench.stiffness,
                    "branch_time_1_s": time_s,
                }
                add("the relaxation", lambda branch=branch: SpringViscoelastic(**branch))
    if sliders:
        add("the sliding", lambda: SpringHysteresis(**sliders))
    if design is not None or {HARDENING, ASYMMETRY, KNEE, KNEES} & set(best.pieces):
        add("the curved elastic law", lambda: _elastic(found, design))
    stiffness = max(parallel, RIGID * flank) if sliders else flank
    return (
        ActuatorModel(replace(rig, spring_stiffness_Nm_per_rad=stiffness), tuple(terms)),
        tuple(notes),
    )


def _elastic(found: SpringDiagnosis, design: SpringCurve | None) -> SpringCurve:
    """The elastic law as points: the design's range, or the deflections that were reached."""
    best, bench = found.best, found.bench
    deflections = [r.deflection_rad - zero_of(r) for r in bench.rows]
    ends = (
        min(0.0, *(float(b.min()) for b in deflections)),
        max(0.0, *(float(b.max()) for b in deflections)),
    )
    if design is not None:
        ends = float(design.deflection_rad[0]), float(design.deflection_rad[-1])
    knees = [bench.columns[j] for j in best.fit.columns if bench.columns[j].piece in (KNEE, KNEES)]
    onsets = [s * k.parameters["onset_rad"] for k in knees for s in (1.0, -1.0)]
    corners = [o for o in (0.0, *onsets) if ends[0] <= o <= ends[1]]
    deflection = np.union1d(np.linspace(*ends, POINTS), corners)
    torque = float(best.fit.coefficients[0]) * spring_torque_Nm(bench.table, deflection)
    for j, c in zip(best.fit.columns[1:], best.fit.coefficients[1:], strict=True):
        column = bench.columns[j]
        if column.piece in (KNEE, KNEES):
            torque = torque + float(c) * beyond(deflection, column)
        power = {HARDENING: 3, ASYMMETRY: 2}.get(column.piece)
        torque = torque + (0.0 if power is None else float(c) * deflection**power)
    if SLIP in best.pieces:
        torque = torque + RIGID * best.scale * bench.stiffness * deflection
    source = design.source if design is not None else "recordings"
    return SpringCurve(deflection_rad=deflection, torque_Nm=torque, source=f"{source}, corrected")
