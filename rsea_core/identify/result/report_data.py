"""The report data of a diagnosis: everything that a report shows, as plain data.

Keys are those of the report's page (`dftfs.report.diagnosis.page`), which knows nothing of this
package; a page is made from this with no more than a change of types.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.figure_text import linear_units
from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.registry import LAWS
from rsea_core.errors import RseaError
from rsea_core.identify.experiment.experiment_file import as_page
from rsea_core.identify.experiment.next_experiment import NextExperiment
from rsea_core.identify.judgement.residual import UnexplainedResidual
from rsea_core.identify.locate.mismatch_map import Located, locate
from rsea_core.identify.locate.signatures import signatures
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.effect_curves import law_curves
from rsea_core.identify.result.signal_curves import (
    COMPARED,
    QUICK_COMPARED,
    curves,
    ranked_explanations,
)
from rsea_core.identify.smoothing.smoother import Smoothed, port_torques
from rsea_core.machine.rig import QUANTITIES, Rig
from rsea_core.recordings.finding import grouped_sentences
from rsea_core.recordings.recording import Recording

STRIP_BINS, STATE_BINS = 120, 22
LOOKED_AT = 0.1  # share of the mismatch from which a port's signatures are told
SHOWN_SIGNATURES = 6  # signatures
WEIGHED = "the recordings that were fitted; free values and moves of constants are paid for"
LEFT_OUT = ("left out", "torques and mismatch at the ports: run without --quick to see them")
LOST_ANGLE = (GearBacklash.effect, GearTransmissionError.effect)
ROTARY = ("motor_angle", "motor_velocity", "motor_inertia", "motor_viscous", "torque_constant",
          "back_emf_constant")  # fmt: skip
AT = {"V": "at the winding", "G": "at the gear", "S": "in the spring", "L": "on the load"}


def report_data(
    diagnosis: Diagnosis,
    *,
    experiment: NextExperiment | None = None,
    command: str = "",
    seconds: float | None = None,
    quick: bool = False,
) -> dict:
    """Plain data for the report of a diagnosis.

    Parameters
    ----------
    experiment : NextExperiment or None
        What to record next (`experiment_file.decisive_experiment`).
    command : str
        What was typed, for the page's last section.
    seconds : float or None
        How long the diagnosis took.
    quick : bool
        Compare fewer signals; no torques and mismatch at the ports, which need smoothed states.
    """
    conclusion, document = diagnosis.conclusion, diagnosis.document
    case, rig = conclusion.case, conclusion.rig()  # values found: ports show missing physics
    moving, smoothed = smoothed_recordings(rig, () if quick else case.identification)
    located = locate(rig, moving, smoothed) if moving else None
    place, scores = (document["location"] or {}).get("subsystem"), document["fit"]["recordings"]
    found: dict[str, Any] = {
        "case": case.name,
        "rig": case.rig.name,
        "verdict": document["verdict"],
        "summary": document["summary"],
        "doubted": bool(conclusion.data_errors()),
        "subsystem": place,
        "where": (document["location"] or {}).get("where", ""),
        "shares": {} if located is None else _shares(located, place, document["effects"]),
        "parts": case.rig.parts,
        "sensors": tuple(dict.fromkeys(name for r in case.recordings for name in r.responses)),
        "loads": tuple(dict.fromkeys(r.load.kind for r in case.recordings)),
        "separability": _separability(moving, smoothed),
        "effects": [_effect(e) for e in document["effects"]],
        "parameters": _parameters(document["parameters_corrected"]),
        "scores": [_score(row) for row in scores],
        "comparisons": curves(conclusion, scores, most=QUICK_COMPARED if quick else COMPARED),
        "ladder": ranked_explanations(conclusion),
        "laws": law_curves(conclusion),
        "weighed": WEIGHED,
        "remainder": _remainder(document),
        "next_experiment": as_page(experiment),
        "findings": grouped_sentences(diagnosis.findings),
        "facts": _facts(conclusion, command, seconds) + ([LEFT_OUT] if quick else []),
    }
    if located is not None and _is_mapped(conclusion, document["verdict"], place):
        found |= _located(moving, smoothed, located, found["where"])
    if conclusion.residual is not None:  # the summary says already what it is
        found |= {
            "where": conclusion.mismatched_recordings(),
            "shares": {place: conclusion.residual.share},
            "traces": _unknown(conclusion.residual),
        }
    return _in_linear_units(found, _rotary(rig)) if rig.axis == "linear" else found


def _rotary(rig: Rig) -> tuple[str, ...]:
    """First letters of the signals and values that keep radians: a screw's or pinion's motor."""
    return ROTARY if (rig.gear_ratio or 1.0) != 1.0 else ()


def _in_linear_units(page: Any, rotary: tuple[str, ...], key: str = "") -> Any:
    """The page with metres and newtons as units, in labels of axes and in sentences on shapes."""
    if isinstance(page, dict):
        if str(page.get("signal") or page.get("name")).startswith(rotary):
            return page
        return {name: _in_linear_units(value, rotary, name) for name, value in page.items()}
    if isinstance(page, (list, tuple)):
        return type(page)(_in_linear_units(value, rotary, key) for value in page)
    is_text = key in ("unit", "sentence", "signatures") or key.endswith("label")
    return linear_units(page) if is_text and isinstance(page, str) else page


def _is_mapped(conclusion: Conclusion, verdict: str, place: str | None) -> bool:
    """Whether maps of the mismatch show something."""
    quiet = ("no-mismatch", "parameters-only", *(() if place else ("insufficient-data",)))
    return conclusion.residual is None and verdict not in quiet


def _located(
    moving: Sequence[Recording], smoothed: Sequence[Smoothed], located: Located, where: str
) -> dict:
    """Where the mismatch is concentrated, what it looks like there, and its maps."""
    ports = [p for p, share in located.port_shares().items() if share > LOOKED_AT]
    shapes = signatures(moving, smoothed, ports=ports)[:SHOWN_SIGNATURES]
    return {
        "where": f"{located.where()}; {where}" if located.concentrations else where,
        "signatures": tuple(s.sentence for s in shapes),
        **_maps(moving, smoothed, located),
    }


def _unknown(left: UnexplainedResidual) -> list[dict]:
    """The signal that nothing explains, over time."""
    return [
        {
            "port": "?", "label": left.label, "unit": left.unit, "file": t.file,
            "time_s": t.time_s - t.time_s[0], "value": t.value, "std": t.std,
        }
        for t in left.traces
    ]  # fmt: skip


def smoothed_recordings(
    rig: Rig, recordings: Sequence[Recording]
) -> tuple[tuple[Recording, ...], tuple[Smoothed, ...]]:
    """The recordings that move and can be smoothed, and what the smoother makes of them."""
    found = []
    for r in recordings:
        try:
            torques = port_torques(rig, r)
        except (RseaError, np.linalg.LinAlgError):
            continue
        if isinstance(torques, Smoothed):
            found.append((r, torques))
    return tuple(r for r, _ in found), tuple(s for _, s in found)


def _shares(located: Located, place: str | None, effects: Sequence[Mapping]) -> dict[str, float]:
    """One subsystem a share: a class that cannot be split is its named member's.

    Lost motion and position errors of the gear act as a torque in the spring.
    """
    lost = any(e["name"] in LOST_ANGLE for e in effects)
    found: dict[str, float] = {}
    for name, share in located.shares.items():
        members = ["gear"] if lost and name == "spring" else located.members[name]
        owner = place if place in members else members[0]
        found[owner] = found.get(owner, 0.0) + float(share)
    return found


def _separability(moving: Sequence[Recording], smoothed: Sequence[Smoothed]) -> str:
    sentences: dict[str, list[str]] = {}
    for r, s in zip(moving, smoothed, strict=True):
        sentences.setdefault(s.separability.sentence(), []).append(r.load.kind)
    return " ".join(
        f"{' and '.join(dict.fromkeys(kinds)).capitalize()}: {sentence}."
        for sentence, kinds in sentences.items()
    )


def _headline(effect: str, law: str) -> str:
    laws = LAWS.get(effect, {})
    kind = laws.get(law, next(iter(laws.values()), None))
    return kind.headline if kind is not None else ""


def _effect(effect: Mapping) -> dict:
    return {
        "name": effect["name"],
        "subsystem": effect["subsystem"],
        "confidence": effect["confidence"],
        "law": effect["law"],
        "words": _headline(effect["name"], effect["law"]),
        "alike": tuple(name for name in effect["class"] if name != effect["name"]),
        "parameters": [
            {
                "name": (name if row["unit"] in ("", "-") else name.rsplit("_", 1)[0]).replace(
                    "_", " "
                ),
                "unit": row["unit"],
                "value": row["value"],
                "std": row["std"],
                "note": "at its bound" if row["at_bound"] else "",
            }
            for name, row in effect["parameters"].items()
            if not isinstance(row["value"], str)
        ],
    }


def _parameters(corrected: Mapping) -> list[dict]:
    return [
        {
            "name": name,
            "unit": _unit(name),
            "value": row["to"],
            "std": row["std"],
            "nominal": row["from"],
            "note": "" if row["identifiable"] else "not identifiable from these recordings alone",
        }
        for name, row in corrected.items()
    ]


def _unit(name: str) -> str:
    if name in QUANTITIES:
        return QUANTITIES[name]["unit"]
    effect, _, parameter = name.partition(".")
    if parameter:  # of a law that the rig file states
        kinds = LAWS[effect].values()
        known = (k.__dataclass_fields__.get(parameter) for k in kinds)
        return next(f.metadata["unit"] for f in known if f is not None)
    return {"stiffness": "Nm/rad", "damping": "Nms/rad"}.get(name.split("_")[1], "rad")


def _score(row: Mapping) -> dict:
    keys = ("file", "role", "signal", "noise_floor", "rmse_before", "rmse_parameters_only")
    return {key: row[key] for key in (*keys, "rmse_after")} | {"unit": unit_of(row["signal"])}


def unit_of(signal: str) -> str:
    """Unit of a column, the end of its name."""
    return signal.rsplit("_", 1)[-1]


def _remainder(document: Mapping) -> dict | None:
    rows = [r for r in document["fit"]["recordings"] if r["role"] == "validation"]
    rows = rows or document["fit"]["recordings"]
    signals = tuple(dict.fromkeys(r["signal"] for r in rows))
    if not signals:
        return None

    def worst(key: str) -> NDArray:
        return np.array(
            [max(r[key] / r["noise_floor"] for r in rows if r["signal"] == s) for s in signals]
        )

    text = (document["remainder"] or {}).get("words", "")
    after = worst("rmse_after")
    worst_signal = signals[int(after.argmax())]
    size = (
        f"The largest error that an open-loop run leaves is {after.max():.3g} times the noise"
        f" of its sensor, {worst_signal}."
    )
    return {
        "words": f"{text[:1].upper()}{text[1:]}. {size}" if text else size,
        "signals": signals,
        "before": worst("rmse_before"),
        "parameters_only": worst("rmse_parameters_only"),
        "after": after,
    }


def _facts(conclusion, command: str, seconds: float | None) -> list[tuple[str, str]]:
    case = conclusion.case
    found = [("command", command)] if command else []
    found.append(
        ("recordings", f"{len(case.identification)} chosen from, {len(case.validation)} held out")
    )
    found += [(r.file, f"{r.load.kind}, {r.role}: {r.description}") for r in case.recordings]
    return [*found, ("took", f"{seconds:.1f} s")] if seconds is not None else found


def _maps(moving: Sequence[Recording], smoothed: Sequence[Smoothed], located: Located) -> dict:
    """Port torques, mismatch over time and over state."""
    traces, strips = [], []
    for r, s, level in zip(moving, smoothed, located.by_recording, strict=True):
        time = s.time_s - s.time_s[0]
        for port in ("V", "G", "S", "L"):
            if port in s.ports:
                traces.append(
                    {
                        "port": port, "label": AT[port], "unit": "V" if port == "V" else "Nm",
                        "file": r.file, "time_s": time, "value": s.ports[port],
                        "std": s.ports_std[port],
                    }
                )  # fmt: skip
        edges = np.linspace(time[0], time[-1], STRIP_BINS + 1)
        strips.append({"file": r.file, "edges_s": edges, "level": _binned(time, level, edges)})
    return {"traces": traces, "strips": strips, "state_map": _state_map(located)}


def _binned(x: NDArray, level: NDArray, edges: NDArray) -> NDArray:
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    count = np.bincount(index, minlength=edges.size - 1)
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.bincount(index, level**2, edges.size - 1) / count)


def _state_map(located: Located) -> dict | None:
    """Mismatch over the wheel's speed and the torque that the spring (or the motor) carries."""
    second = next(
        (
            (name, label)
            for name, label in (
                ("torque_Nm", "spring torque (Nm)"),
                ("load_angle_rad", "load angle (rad)"),
                ("wheel_angle_rad", "wheel angle (rad)"),
            )
            if all(name in s.signals for s in located.residual)
        ),
        None,
    )
    if second is None:
        return None
    x = np.concatenate([s.signals["wheel_velocity_rad_per_s"] for s in located.residual])
    y = np.concatenate([s.signals[second[0]] for s in located.residual])
    power = np.concatenate([level**2 for level in located.by_recording])
    x_edges, y_edges = (_edges(v) for v in (x, y))
    total, _, _ = np.histogram2d(y, x, (y_edges, x_edges), weights=power)
    count, _, _ = np.histogram2d(y, x, (y_edges, x_edges))
    with np.errstate(invalid="ignore"):
        level = np.sqrt(np.where(count > 3, total / np.maximum(count, 1), np.nan))
    sentence = located.where()
    return {
        "x_label": "wheel speed (rad/s)", "y_label": second[1], "x_edges": x_edges,
        "y_edges": y_edges, "level": level, "sentence": sentence[:1].upper() + sentence[1:] + ".",
    }  # fmt: skip


def _edges(values: NDArray) -> NDArray:
    low, high = np.quantile(values, (0.002, 0.998))
    return np.linspace(low, max(high, low + 1e-9), STATE_BINS + 1)
