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
    friction,
    gaussian_process,
    sparse,
)
from dftfs.proof.baselines.ports import Lacking, Recorded, lacking, read_case, together
from dftfs.proof.baselines.simulator import NAMES, PORTS, predict
from dftfs.proof.judging import BASELINES
from dftfs.proof.labels import CHANNELS, LABELS, check_seal
from dftfs.proof.machine import Machine
from dftfs.proof.refit import FREE, moved
from dftfs.proof.running import case_names
from dftfs.proof.scoring import read_columns
from dftfs.proof.writing import CASES, HIDDEN

WORST = 10.0  # nrmse of a run that explodes
EVERY, STEPS, TURNS, PRIOR = 4, 3, 2, 0.02
ADJUSTED = (
    "terminal_resistance_ohm",
    "torque_constant_Nm_per_A",
    "back_emf_constant_Vs_per_rad",
    "motor_inertia_kgm2",
    "motor_viscous_Nms_per_rad",
    "spring_stiffness_Nm_per_rad",
    "load_inertia_kgm2",
    "load_viscous_Nms_per_rad",
    "load_mass_kg",
)


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


def residual(machine: Machine, recorded: list[Recorded], learned: Learned) -> np.ndarray:
    """Free runs less readings over the readings' deviation, every fourth sample, all channels."""
    parts = []
    for r in recorded:
        found = run_with(machine, r, learned)
        for c in CHANNELS:
            if c in r.columns and not (r.load == "locked" and c == "load_angle_rad"):
                target = r.columns[c][::EVERY]
                parts.append((found[c][::EVERY] - target) / target.std() / np.sqrt(target.size))
    left = np.concatenate(parts)
    return left if np.isfinite(left).all() else np.full(left.size, np.inf)


def misfit(machine: Machine, recorded: list[Recorded], learned: Learned) -> float:
    """Root of the summed squared nrmse of free runs."""
    left = residual(machine, recorded, learned)
    return float(np.sqrt(left @ left))


def adjust(machine: Machine, recorded: list[Recorded], learned: Learned) -> Machine:
    """Constants once more, with the learned torques in place: Levenberg-Marquardt, few steps."""
    free = {k: v for k, v in FREE.items() if k in ADJUSTED}
    shift, damping = np.zeros(len(free)), 1e-3
    left = residual(machine, recorded, learned)
    if not np.isfinite(left).all():
        return machine
    for _ in range(STEPS):
        jacobian = np.empty((left.size, len(free)))
        for j in range(len(free)):
            other = shift.copy()
            other[j] += 0.02
            ahead = residual(moved(machine, free, other), recorded, learned)
            jacobian[:, j] = (ahead - left) / 0.02
        if not np.isfinite(jacobian).all():
            break
        prior = PRIOR * float(left @ left)
        normal = jacobian.T @ jacobian + prior * np.eye(len(free))
        for _ in range(4):
            slope = -jacobian.T @ left - prior * shift
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slope)
            trial = np.clip(shift + step, -3.0, 3.0)
            rest = residual(moved(machine, free, trial), recorded, learned)
            if rest @ rest < left @ left:
                break
            damping *= 10.0
        else:
            break
        shift, left = trial, rest
    return moved(machine, free, shift)


def learn(
    machine: Machine, recorded: list[Recorded], seed: int
) -> dict[str, tuple[Machine, Learned]]:
    """Learn on the identification recordings; choices by free runs of the validation ones.

    Learning and the constants take turns, `TURNS` times, and every method may keep to no learned
    torque at all. The baselines may choose on validation recordings, which a diagnosis may not.
    """
    known = [r for r in recorded if r.role == "identification"]
    held = [r for r in recorded if r.role == "validation"]
    nothing = Learned(name="nothing", weights=np.zeros((PORTS, len(NAMES))))
    methods: dict[str, Callable[[Lacking], list[Learned]]] = {
        "sparse": lambda data: [sparse(data, t) for t in THRESHOLDS],
        "gaussian-process": lambda data: [gaussian_process(data, np.random.default_rng(seed))],
        "friction-family": lambda data: [friction(data, law) for law in FAMILY],
    }
    out = {}
    for name, candidates in methods.items():
        best = (misfit(machine, held, nothing), machine, nothing)
        here = machine
        for _ in range(TURNS):
            learned_ones = candidates(together([lacking(here, r) for r in known]))
            chosen = min(learned_ones, key=lambda one: misfit(here, held, one))
            here = adjust(here, known, chosen)
            value = misfit(here, held, chosen)
            if value < best[0]:
                best = (value, here, chosen)
        out[name] = best[1:]
    return out


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
    for name, (own, one) in learned.items():
        found = run_with(own, test, one)
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
