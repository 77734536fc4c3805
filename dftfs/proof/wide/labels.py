"""The sealed answer of one case, in the form of the practice set's labels."""

import numpy as np

from dftfs.proof.wide.case import Case, acceptable, nearest
from dftfs.proof.wide.truth.body import COPPER_PER_K

CHANNELS = ("motor_angle_rad", "load_angle_rad", "torque_Nm")
HEARD = 5.0  # a channel that moves by less than so many deviations of its sensor says nothing
NEIGHBOURS = {"gear": ("drive", "load"), "drive": ("gear",), "spring": ("gear", "load"),
              "load": ("gear", "environment")}  # fmt: skip
PLACES = {"spring-parallel": "load", "motor-cogging": "gear"}
# The same in rows of a rigid axis, or of a single reading, whatever their size.
ALIKE_RIGID = {"gear-friction": "load-friction", "load-friction": "gear-friction"}
ALIKE_READING = {"drive-delay": "sensor-delay", "sensor-delay": "drive-delay"}
BY_PARAMETERS = ("load-unbalance", "spring-parallel", "sensor-scale")


def names_as_true(case: Case) -> dict[str, str]:
    """Acceptable names and the effects that they stand for: measured, and by structure."""
    out = acceptable(case)
    readings = [c for c in case.drawn.columns if c != "current_A"]
    for one in case.applied:
        if not case.drawn.body.sprung and one.name in ALIKE_RIGID:
            out[ALIKE_RIGID[one.name]] = one.name
        if len(readings) == 1 and one.name in ALIKE_READING:
            out[ALIKE_READING[one.name]] = one.name
    return {n: t for n, t in out.items() if n not in {a.name for a in case.applied}}


def tolerated(case: Case) -> dict[str, str]:
    """Names that are true of the log, not of the machine."""
    out, dirt = {}, case.dirt
    one_reading = len(case.drawn.columns) == 1
    if dirt.delay_rows or dirt.linear:
        text = f"the command acts {dirt.delay_rows:.2f} samples late"
        if dirt.linear:
            text += " and moves in straight lines between rows"
        out["drive-delay"] = text
        if one_reading:
            out["sensor-delay"] = f"one reading only: {text}"
    if dirt.per_row > 1 and any(p.description.startswith("feedback") for p in case.session.planned):
        out["drive-delay"] = "the loop ran faster than the rows"
    if any(s.filter_s for s in case.session.sensors.values()):
        out["sensor-delay"] = "the speed is filtered by the drive"
    if dirt.clock:
        text = f"the clock of {dirt.clock[0]} runs {1e6 * dirt.clock[1]:.0f} ppm off"
        out |= {"sensor-delay": text, "sensor-drift": text}
    return out


def verdicts(case: Case) -> dict[str, float]:
    """The credit of each verdict."""
    level = case.recipe.level
    if level == "null":
        return {"parameters-only": 1.0, "no-mismatch": 1.0, "insufficient-data": 0.5,
                "missing-physics": 0.0}  # fmt: skip
    if level == "outside":
        return {"unexplained": 1.0, "missing-physics": 0.5}
    out = {"missing-physics": 1.0}
    if names_as_true(case):
        out["insufficient-data"] = 1.0
    if len(case.applied) == 1 and case.applied[0].name in BY_PARAMETERS:
        out["parameters-only"] = 0.7
    return out


def places(case: Case) -> dict[str, float]:
    """The credit of each place."""
    out: dict[str, float] = {}
    full = [a.subsystem for a in case.applied]
    for name in names_as_true(case):
        column = f"sensor:{case.drawn.columns[0]}"
        full.append(PLACES.get(name, column if name.startswith("sensor") else name.split("-")[0]))
    for place in full:
        out |= {n: 0.25 for n in NEIGHBOURS.get(place, ()) if n not in out}
    return out | dict.fromkeys(full, 1.0)


def parameters(case: Case) -> dict[str, dict]:
    """The comparable parameters of the catalogue's effects."""
    out: dict[str, dict] = {}
    for one in case.applied if case.recipe.level != "outside" else ():
        out[one.name] = {k: float(v) for k, v in one.parameters.items()}
        if one.pulse is not None:
            out[one.name]["recording"] = f"rec{one.pushed + 1}.csv"
        if one.name == "drive-thermal":
            rise = case.peak_winding_C - 22.0
            out[one.name] = {"resistance_rise_fraction": COPPER_PER_K * rise,
                             "peak_winding_C": case.peak_winding_C}  # fmt: skip
    return out


def nrmse(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)) / b.std())


def test_errors(case: Case) -> dict[str, object]:
    """Errors of rig file, refit and truth on the hidden test, over the reading's deviation."""
    output, truth = case.logged[-1], case.exact[-1]
    heard = [
        c for c in CHANNELS
        if c in output and output[c].std() > HEARD * case.session.sensors[c].floor
        and not (case.drawn.kind.load == "locked" and c == "load_angle_rad")
    ]  # fmt: skip
    return {
        "load": case.drawn.kind.load,
        "description": case.session.planned[-1].description,
        "nrmse": {c: {"nominal": nrmse(case.nominal[c], output[c]),
                      "refit": nrmse(case.refitted[c], output[c]),
                      "floor": nrmse(truth[c], output[c]),
                      "std": float(output[c].std())} for c in heard},
    }  # fmt: skip


def label(case: Case) -> dict[str, object]:
    """One case's answer."""
    named = [] if case.recipe.level == "outside" else [a.name for a in case.applied]
    reasons = [
        f"{n} leaves {case.gaps[n]:.2f} noise deviations of the trace: as true as {t}"
        for n, t in names_as_true(case).items() if n in case.gaps
    ]  # fmt: skip
    if case.dirt.offset:
        reasons.append(f"the amplifier adds {case.dirt.offset:+.4f} of full scale: not a claim")
    dirt = {k: v for k, v in vars(case.dirt).items() if v and not (k == "per_row" and v == 1)}
    return {
        "verdicts": verdicts(case),
        "subsystems": places(case),
        "effects": named,
        "effect_subsystem": {a.name: a.subsystem for a in case.applied},
        "nearest_names": nearest(case),
        "parameters": parameters(case),
        "acceptable": names_as_true(case) if named else {},
        "tolerated": tolerated(case),
        "reasons": reasons,
        "description": "; ".join(a.description for a in case.applied if a.description),
        "level": case.recipe.level,
        "tier": "core",
        "rivals": [],
        "machine": case.drawn.name,
        "drive": case.drawn.command,
        "columns": list(case.drawn.columns),
        "closed_loop": any(p.description.startswith("feedback") for p in case.session.planned),
        "dirt": dirt,
        "strength": case.strength,
        "share_of_motion": case.share,
        "oracle_rms_over_noise": case.oracle,
        "rival_gaps": case.gaps,
        "parameters_true_vs_rig": case.owner.table(case.drawn.body, case.drawn),
        "parameters_refit_steps": case.refit_values,
        "hidden_test": test_errors(case),
    }
