"""The sealed answers: the label of each case, in the form of the practice set, and its seal."""

import hashlib
import json
from pathlib import Path

import numpy as np

from dftfs.errors import DftfsError
from dftfs.files import write_text
from dftfs.proof.cases import Case, nearest_names
from dftfs.proof.machine import Machine

CHANNELS = ("motor_angle_rad", "load_angle_rad", "torque_Nm")
LABELS, SEAL, MANIFEST = "labels.json", "SHA256SUMS", "set.json"
HEARD = 5.0  # a channel that moves by less than this many deviations of its sensor says nothing


class SealError(DftfsError):
    """The labels are not the ones that were sealed before the diagnosis."""


def verdicts(case: Case) -> dict[str, float | str]:
    """The credit that each verdict earns, as the practice set's labels give it."""
    level = case.recipe.level
    if level == "null":
        if case.rig.nominal == case.rig.true:
            return {"no-mismatch": 1.0, "parameters-only": 0.7}
        return {"parameters-only": 1.0, "no-mismatch": 0.3}
    if level == "outside":
        return {"unexplained": 1.0, "missing-physics": 0.5}
    if level == "poor":
        return {
            "insufficient-data": 1.0,
            "missing-physics": "0.7 where it does not insist",
            "parameters-only": 0.3,
        }
    if case.recipe.effects == ("load-unbalance",):
        return {"missing-physics": 1.0, "parameters-only": 0.5}
    return {"missing-physics": 1.0}


def heard(case: Case) -> list[str]:
    """The channels of the hidden test that count: sensed, and moving by more than noise."""
    test, sensors = case.readings[-1], case.rig.sensors
    return [
        c
        for c in CHANNELS
        if c in test
        and test[c].std() > HEARD * sensors.noise(c)
        and not (case.planned[-1].load == "locked" and c == "load_angle_rad")
    ]


def nrmse(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square of a - b over the standard deviation of b."""
    return float(np.sqrt(np.mean((a - b) ** 2)) / b.std())


def label(
    case: Case, nominal: dict[str, np.ndarray], refitted: dict[str, np.ndarray], machine: Machine
) -> dict[str, object]:
    """One case's answer.

    ``nominal``, ``refitted``: predictions of the hidden test by the rig file and by the machine
    whose constants were fitted without any effect.
    """
    effects = [] if case.recipe.level == "outside" else [a.name for a in case.applied]
    output, truth = case.readings[-1], case.expected[-1]
    parameters: dict[str, dict[str, object]] = {}
    for one in case.applied if effects else ():
        parameters[one.name] = {k: float(v) for k, v in one.parameters.items()}
        if one.pulse is not None:
            parameters[one.name]["recording"] = f"rec{case.pushed + 1}.csv"
    constants = {
        k: [getattr(case.rig.nominal, k), getattr(case.rig.true, k)]
        for k in Machine._fields
        if not k.startswith("contact") or any(p.load == "contact" for p in case.planned)
    }
    return {
        "verdicts": verdicts(case),
        "subsystems": {a.subsystem: 1.0 for a in case.applied},
        "effects": effects,
        "effect_subsystem": {a.name: a.subsystem for a in case.applied},
        "nearest_names": nearest_names(case.recipe),
        "parameters": parameters,
        "description": "; ".join(a.description for a in case.applied if a.description),
        "level": case.recipe.level,
        "tier": "core",
        "hidden_test": {
            "load": case.planned[-1].load,
            "description": case.planned[-1].description,
            "nrmse": {
                c: {
                    "nominal": nrmse(nominal[c], output[c]),
                    "refit": nrmse(refitted[c], output[c]),
                    "floor": nrmse(truth[c], output[c]),
                    "std": float(output[c].std()),
                }
                for c in heard(case)
            },
        },
        "rivals": list(case.recipe.rivals),
        "rival_gaps": case.rival_gaps,
        "strength": case.strengths,
        "parameters_true_vs_rig": constants,
        "parameters_refit": {k: getattr(machine, k) for k in constants},
        "masked": case.masked,
    }


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def seal(folder: Path) -> str:
    """Write and return the SHA-256 of the label file, in the form that `sha256sum -c` reads."""
    value = digest(folder / LABELS)
    write_text(folder / SEAL, f"{value}  {LABELS}\n")
    return value


def answers(folder: Path) -> Path:
    """Where the labels and hidden tests of a set are: beside it (`set.json` says where), or in it.

    Raises
    ------
    SealError
        If `set.json` cannot be read.
    """
    manifest = folder / MANIFEST
    if not manifest.is_file():
        return folder
    try:
        return folder / json.loads(manifest.read_text(encoding="utf-8"))["sealed"]
    except (ValueError, KeyError, TypeError):
        raise SealError(f"{manifest}: must name the folder of the answers as sealed") from None


def check_seal(folder: Path) -> str:
    """The sealed digest, after checking it against the files that it was taken of.

    Raises
    ------
    SealError
        If there is no seal, no label file, or a sealed file has changed.
    """
    place = answers(folder)
    for name in (SEAL, LABELS):
        if not (place / name).is_file():
            raise SealError(f"{place / name}: not there; `dftfs prove make` writes it")
    lines = (place / SEAL).read_text(encoding="utf-8").split("\n")
    sealed = [line.split("  ", 1) for line in lines if line]
    for value, name in sealed:
        if not (place / name).is_file() or digest(place / name) != value:
            raise SealError(f"{place / name}: changed since it was sealed ({value[:12]}...)")
    if place == folder:
        return sealed[0][0]
    value = digest(place / SEAL)
    if json.loads((folder / MANIFEST).read_text(encoding="utf-8")).get("seal") != value:
        raise SealError(f"{place / SEAL}: is not the seal that {folder / MANIFEST} was made with")
    return value
