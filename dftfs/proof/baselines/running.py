"""All baselines on one case and on a whole set."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from dftfs.files import prepare_folder, to_json, write_text
from dftfs.proof.baselines.learners import (
    FAMILY,
    THRESHOLDS,
    Learned,
    best_by,
    friction,
    gaussian_process,
    sparse,
)
from dftfs.proof.baselines.ports import Recorded, lacking, read_case, together
from dftfs.proof.baselines.simulator import NAMES, PORTS, predict
from dftfs.proof.judging import BASELINES
from dftfs.proof.labels import CHANNELS, LABELS, check_seal
from dftfs.proof.machine import Machine
from dftfs.proof.running import case_names
from dftfs.proof.scoring import read_columns
from dftfs.proof.writing import CASES, HIDDEN

WORST = 10.0  # nrmse of a run that explodes


def run_with(machine: Machine, recorded: Recorded, learned: Learned) -> dict[str, np.ndarray]:
    return predict(
        machine,
        recorded.mode,
        recorded.interval_s,
        recorded.columns["duty"],
        recorded.start,
        learned.weights,
        learned.centres,
        learned.length,
    )


def misfit(machine: Machine, recorded: list[Recorded], learned: Learned) -> float:
    """Mean nrmse of free runs over recordings and moving channels."""
    errors = []
    for r in recorded:
        found = run_with(machine, r, learned)
        for c in CHANNELS:
            if c in r.columns and not (r.load == "locked" and c == "load_angle_rad"):
                target = r.columns[c]
                errors.append(np.sqrt(np.mean((found[c] - target) ** 2)) / target.std())
    return float(np.mean(errors))


def learn(machine: Machine, recorded: list[Recorded], seed: int) -> dict[str, Learned]:
    """Learn on the identification recordings; choices by free runs of the validation ones.

    The baselines may choose on validation recordings, which a diagnosis may not.
    """
    known = [r for r in recorded if r.role == "identification"]
    held = [r for r in recorded if r.role == "validation"]
    data = together([lacking(machine, r) for r in known])

    def error(learned: Learned) -> float:
        value = misfit(machine, held, learned)
        return value if np.isfinite(value) else np.inf

    nothing = Learned(name="nothing", weights=np.zeros((PORTS, len(NAMES))))
    process = gaussian_process(data, np.random.default_rng(seed))
    return {
        "sparse": best_by([*(sparse(data, t) for t in THRESHOLDS), nothing], error),
        "gaussian-process": best_by([process, nothing], error),
        "friction-family": best_by([*(friction(data, law) for law in FAMILY), nothing], error),
    }


def baseline_errors(
    case: Path, hidden: Path, label: dict, seed: int
) -> dict[str, dict[str, float]]:
    """nrmse of the hidden test per method and channel, with the constants of the label's refit."""
    constants = dict.fromkeys(Machine._fields, 0.0) | label["parameters_refit"]
    machine = Machine(**constants)
    learned = learn(machine, read_case(case), seed)
    target = read_columns(hidden / "output.csv")
    test = Recorded(
        role="test",
        load=label["hidden_test"]["load"],
        columns=target | read_columns(case / "test" / "input.csv"),
    )
    out: dict[str, dict[str, float]] = {}
    for name, one in learned.items():
        found = run_with(machine, test, one)
        out[name] = {}
        for channel, row in label["hidden_test"]["nrmse"].items():
            value = np.sqrt(np.mean((found[channel] - target[channel]) ** 2)) / row["std"]
            out[name][channel] = float(min(WORST, np.nan_to_num(value, nan=WORST)))
    return out


def run_baselines(folder: Path, report: Callable[[str], None] = lambda line: None) -> Path:
    """Baselines on every case of a sealed set that has none yet.

    Raises
    ------
    SealError
        If the labels are not the sealed ones.
    """
    check_seal(folder)
    labels = json.loads((folder / LABELS).read_text(encoding="utf-8"))
    place = prepare_folder(folder / BASELINES)
    for index, name in enumerate(case_names(folder), start=1):
        path = place / f"{name}.json"
        if path.exists():
            continue
        errors = baseline_errors(folder / CASES / name, folder / HIDDEN / name, labels[name], index)
        write_text(path, to_json(errors))
        report(f"{name}: baselines done")
    return place
