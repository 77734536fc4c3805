"""The closed loop of the product: diagnose a machine, tune on what was found, test on the truth.

    python benchmarks/closed_loop.py [--out DIR] [--seeds N] [--quick]

For each machine: the truth simulator of `dftfs prove` (another integrator and other laws than
ours: LuGre bristles, Prandtl-Ishlinskii stops, a friction cone on the worm's thread) makes
recordings of a machine whose rig file knows nothing of its friction; `dftfs diagnose` reads them
alone and writes a model.toml. Controllers are then tuned twice with one budget (constriction swarm,
10 x 40 runs, the same seeds and bounds): on the rig file's machine and on the diagnosed one. All
run on the true machine, its encoders counting: on the reference that they were tuned for (sines of
4, 2 and 1 Nm) and on one that nothing was tuned for. Printed are errors against the machine's exact
spring torque. Of each machine that was tuned on, the controller with the lowest cost there is the
chosen one; exit status 1 if the one chosen on a diagnosis is not the better one on the truth.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
from dftfs.cli.common import table
from dftfs.files import write_text
from dftfs.proof.cases import Case as TrueCase
from dftfs.proof.cases import Recipe, make_case
from dftfs.proof.effects_base import changed
from dftfs.proof.truth import follow
from dftfs.proof.writing import write_case
from rsea_core import ActuatorModel, Load, Reference
from rsea_core.control import Controller, PidTorque
from rsea_core.control.tuning.figures_of_merit import Following, following
from rsea_core.control.tuning.tune import Task, tune
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.diagnose import diagnose
from rsea_core.model.model_file import read_model, read_model_file
from rsea_core.recordings.case import read_case

MACHINES = {
    "gear friction and spring hysteresis": (("gear-friction", "spring-hysteresis"), (11, 1)),
    "worm friction": (("gear-load-friction",), (11, 2)),
}
LOCKED = Load(kind="locked")
UNSEEN = Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=0.7)
PIECES = ((4.0, 1.0, 3), (2.0, 0.5, 1), (1.0, 2.0, 4))  # Nm, Hz, cycles; the first is not judged
FROM_s, DURATION_s = 1.0, 7.0
GAINS = {"kp": (1.0, 60.0), "ki": (0.0, 200.0), "kd": (0.0, 2.0)}
HELPED = {
    **GAINS, "friction_compensation": (0.0, 1.0), "friction_smoothing_rad_per_s": (0.002, 0.1),
}  # fmt: skip
CONTROLLERS = {"PID": GAINS, "PID, compensation of known friction": HELPED}


@dataclass(frozen=True, kw_only=True)
class Ran:
    """A controller on the true machine."""

    reference: Reference
    time_s: NDArray
    torque_Nm: NDArray
    duty: NDArray

    @property
    def judged(self) -> Following:
        rows = self.time_s >= FROM_s
        wanted = self.reference.sample(self.time_s)[rows, 0]
        return following(self.time_s[rows], wanted, self.torque_Nm[rows])

    @property
    def duty_change(self) -> float:
        return float(np.mean(np.abs(np.diff(self.duty[self.time_s >= FROM_s]))))


@numba.njit
def acting(controller, parameters, state, signals, answer):
    """One sample of a compiled controller."""
    controller(parameters, state, signals, answer)


def hand(controller: Controller, known: ActuatorModel, truth: TrueCase, rows: NDArray) -> Callable:
    """What a controller made for a known machine does at a true machine's encoders."""
    compiled = controller.compile(known, LOCKED)
    parameters, state = compiled.parameters.copy(), compiled.state.copy()
    signals, answer = np.zeros(k.N_SIGNALS), np.zeros(k.N_COMMANDS)
    sensors, waiting = truth.rig.sensors, [0.0]
    counts = 2.0 * np.pi / np.array([sensors.motor_counts_per_rev, sensors.load_counts_per_rev])

    def act(sample: int, exact: NDArray) -> float:
        signals[k.REFERENCE : k.REFERENCE + 3] = rows[sample]
        read = np.floor(exact[:2] / counts) * counts
        signals[k.READ_MOTOR_ANGLE], signals[k.READ_LOAD_ANGLE] = read
        signals[k.READ_CURRENT] = exact[3]
        acting(compiled.function, parameters, state, signals, answer)
        limit = compiled.command_limit
        answered = min(max(float(answer[k.COMMAND]), -limit), limit)
        if controller.delay_samples == 0:
            return answered
        acts, waiting[0] = waiting[0], answered
        return acts

    return act


def on_truth(
    controller: Controller, known: ActuatorModel, truth: TrueCase, reference: Reference
) -> Ran:
    """A controller on the true machine."""
    machine, physics, series, _ = changed(truth.rig.true, truth.applied)
    interval = controller.sample_time_s
    time = np.arange(0.0, DURATION_s, interval)
    act = hand(controller, known, truth, reference.sample(time))
    motion, duty = follow(
        machine, physics, series, "locked", act, samples=time.size, interval_s=interval
    )
    return Ran(reference=reference, time_s=time, torque_Nm=motion.values["torque_Nm"], duty=duty)


def tuned_on(folder: Path) -> Reference:
    """Sines of three sizes, one after the other, through a file as any reference can be given."""
    time, torque = [np.zeros(1)], [np.zeros(1)]
    for amplitude, frequency, cycles in PIECES:
        own = np.arange(1, round(1000 * cycles / frequency) + 1) / 1000.0
        torque.append(amplitude * np.sin(2.0 * np.pi * frequency * own))
        time.append(time[-1][-1] + own)
    columns = {"time_s": np.concatenate(time), "reference_torque_Nm": np.concatenate(torque)}
    return Reference(kind="csv", file=str(write_columns(folder / "reference.csv", columns)))


def tuned_for(
    model: ActuatorModel, reference: Reference, bounds: dict, seeds: range, generations: int
) -> tuple[Controller, float]:
    """The best controller on a machine, and its cost there."""
    task = Task(
        model=model, loads=(LOCKED,), reference=reference, duration_s=DURATION_s, from_s=FROM_s
    )
    found = tune(task, PidTorque(), bounds, seeds=seeds, population=10, generations=generations)
    return found.controller, found.starts.best.cost


def one_machine(
    name: str, folder: Path, seeds: range, generations: int
) -> tuple[list[list[str]], dict[str, Ran], tuple[bool, str]]:
    """Make, diagnose, tune, test; rows of the table, runs for a picture, and what was gained."""
    effects, seed = MACHINES[name]
    level = "plain" if len(effects) == 1 else "double"
    truth = make_case(Recipe(level=level, effects=effects), seed)
    stem = "-".join(effects)
    write_case(truth, stem, folder)
    case = read_case(folder / "cases" / stem)
    found = diagnose(case)
    path = write_text(folder / "cases" / stem / "model.toml", found.model.to_toml())
    print(f"{name}\n  there: {', '.join(a.name for a in truth.applied)}")
    print(f"  diagnosis: {found.document['verdict']}: {found.document['summary']}")
    for note in read_model_file(path).notes:
        print(f"  {note}")
    machines = {"rig file": ActuatorModel(case.rig), "diagnosis": read_model(path)}
    reference = tuned_on(folder)
    rows, runs = [], {}
    chosen: dict[str, tuple[float, tuple[float, float]]] = {}
    for law, bounds in CONTROLLERS.items():
        for made_for, model in machines.items():
            controller, cost = tuned_for(model, reference, bounds, seeds, generations)
            ran = {r: on_truth(controller, model, truth, r) for r in (reference, UNSEEN)}
            first, second = ran[reference].judged, ran[UNSEEN].judged
            chosen[made_for] = min(
                chosen.get(made_for, (np.inf, ())), (cost, (first.rmse, second.rmse))
            )
            runs[f"{law}, tuned on the {made_for}"] = ran[reference]
            shown = (cost, first.rmse, first.peak_error, second.rmse, second.peak_error)
            rows.append(
                [law, made_for, *(f"{value:.4f}" for value in shown),
                 f"{ran[reference].duty_change:.4f}", gains(controller, bounds)]
            )  # fmt: skip
    before, after = chosen["rig file"][1], chosen["diagnosis"][1]
    summary = ", ".join(f"{b:.4f} to {a:.4f} Nm" for b, a in zip(before, after, strict=True))
    return rows, runs, (all(a < b for a, b in zip(after, before, strict=True)), summary)


def gains(controller: Controller, bounds: dict) -> str:
    """The tuned values, short."""
    short = {"friction_compensation": "comp", "friction_smoothing_rad_per_s": "smooth"}
    return " ".join(f"{short.get(n, n)} {getattr(controller, n):.3g}" for n in bounds)


HEADER = [
    "controller", "tuned on", "RMSE there", "RMSE on truth", "peak", "RMSE unseen", "peak",
    "duty change", "values",
]  # fmt: skip


def main() -> int:
    """All machines; prints a table each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="keep cases, models and a picture in this folder")
    parser.add_argument("--seeds", type=int, default=3, help="searches of each tuning (default 3)")
    parser.add_argument("--quick", action="store_true", help="one machine, a small budget")
    arguments = parser.parse_args()
    names = list(MACHINES)[: 1 if arguments.quick else None]
    generations = 8 if arguments.quick else 40
    better = True
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.out or Path(scratch)
        for name in names:
            rows, runs, gain = one_machine(name, folder, range(arguments.seeds), generations)
            print(table(HEADER, rows))
            print(f"  the controller chosen on its own machine, RMSE on truth: {gain[1]} unseen\n",
                  flush=True)  # fmt: skip
            better &= gain[0]
            if arguments.out is not None:
                draw(name, runs, arguments.out / f"{'-'.join(MACHINES[name][0])}.png")
    print("RMSE and peak in Nm, from 1 s on; unseen: a sine of 3 Nm at 0.7 Hz")
    print(f"chosen on the diagnosis better on every machine: {'yes' if better else 'no'}")
    return 0 if better else 1


def draw(name: str, runs: dict[str, Ran], path: Path) -> None:
    """Torque error over time of every controller on the true machine."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(CONTROLLERS), 1, figsize=(8, 5), sharex=True, sharey=True)
    for axis, law in zip(axes, CONTROLLERS, strict=True):
        for made_for, colour in (("rig file", "#b03a2e"), ("diagnosis", "#1f618d")):
            ran = runs[f"{law}, tuned on the {made_for}"]
            wanted = ran.reference.sample(ran.time_s)[:, 0]
            axis.plot(
                ran.time_s, wanted - ran.torque_Nm, colour, lw=1.0, label=f"tuned on the {made_for}"
            )
        axis.set_title(law, fontsize=10, loc="left")
        axis.set_ylabel("torque error (Nm)")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8, loc="upper right")
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(FROM_s, None)
    figure.suptitle(f"True machine with {name}: sines of 4, 2 and 1 Nm", fontsize=11)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
