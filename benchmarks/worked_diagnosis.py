"""The worked case of docs/diagnosis.md, section 9, and the table of its section 4.

    python -m benchmarks.worked_diagnosis OUT [--figure docs/diagnosis-worked.png]

`dftfs prove make` writes one case whose spring has a hysteresis that its rig file does not know,
simulated by the independent simulator of the proof. The diagnosis reads the case folder alone;
the concealed answer (`labels.json`) is opened afterwards and printed beside it.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dftfs.cli.main import main as dftfs
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.locate.mismatch_map import Located, locate
from rsea_core.identify.locate.signatures import signatures
from rsea_core.identify.locate.unknown_input import ranked_ports
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.diagnosis_json import msni_table
from rsea_core.identify.smoothing.separability import separability
from rsea_core.identify.smoothing.smoother import Smoothed, port_torques
from rsea_core.recordings.case import Case, read_case, read_test

SEED, EFFECT = "16", "spring-hysteresis"
SENSED_WITH = (
    ("pendulum", ("load_angle_rad",)),
    ("pendulum", ("load_angle_rad", "current_A")),
    ("pendulum", ("load_angle_rad", "torque_Nm")),
    ("pendulum", ("load_angle_rad", "current_A", "torque_Nm")),
    ("locked", ()),
    ("locked", ("current_A",)),
    ("locked", ("torque_Nm",)),
    ("locked", ("current_A", "torque_Nm")),
)
SOURCES = ("white innovations", "sandwich", "jackknife, recordings", "jackknife, pieces")
GREY, BLUE, VERMILION = "#69737d", "#0072B2", "#D55E00"


def made(folder: Path) -> Path:
    """The folder of the case; it is written where it is not there yet."""
    if (folder / "labels.json").exists():
        return folder / "cases" / "case-001"
    given_arguments = ["--cases", "1", "--seed", SEED, "--levels", "plain", "--only", EFFECT]
    if dftfs(["prove", "make", *given_arguments, "--out", str(folder)]) != 0:
        raise SystemExit("the case could not be made")
    return folder / "cases" / "case-001"


def print_separability() -> None:
    """The table of section 4: what sensors and load separate by direction alone."""
    print("Separability beside the motor angle, command duty")
    for load, sensors in SENSED_WITH:
        found = separability(load=load, command="duty", sensors=("motor_angle_rad", *sensors))
        print(f"  {load:9s} {', '.join(sensors) or 'nothing':42s} {found.sentence()}")


def print_location(case: Case, found: Sequence[Smoothed], located: Located) -> None:
    """What the sensors separate and where the mismatch lies."""
    print("\nSmoothing: ports, and the rate densities that maximise the likelihood")
    for recording, smoothed in zip(case.identification, found, strict=True):
        rates = ", ".join(f"{port} {rate:.2g}" for port, rate in smoothed.rate_density.items())
        print(f"  {recording.file} ({recording.load.kind}): {rates}")
        print(f"    {smoothed.separability.sentence()}")
    print("Location: share of the mismatch, with the parameters projected out")
    for name, share in sorted(located.shares.items(), key=lambda item: -item[1]):
        print(f"  {name:16s} {share:.3f} +- {located.shares_se[name]:.3f}")
    print(f"  level {located.level:.1f} noise standard deviations; {located.where()}")
    print("Residual signatures of the spring's port")
    for signature in signatures(case.identification, found, ports=["S"])[:3]:
        print(f"  z {abs(signature.z):.0f}: {signature.sentence}")


def print_ports(found: Diagnosis) -> None:
    """Gain of an unknown signal at each port, over parameters alone."""
    search = found.conclusion.search
    print("Unknown input on top of the parameters: gain in log-likelihood units, correlation time")
    for entry in ranked_ports(search.problem, search.parameters):
        print(f"  {entry.port:20s} {entry.gain:9.0f}  {entry.pace_s:g} s")


def print_fit(found: Diagnosis) -> None:
    """Mean squared normalised innovations, effective sample sizes, sources of uncertainty."""
    conclusion = found.conclusion
    search, powers = conclusion.search, msni_table(conclusion)
    print("Mean squared normalised innovation (1 is noise), innovations, effective sample size")
    print("  recording  rig file  parameters  with effect  innovations  effective")
    rows = zip(
        search.problem.fitted, search.nominal_msni, powers["parameters_only"], powers["after"],
        search.independent_blocks(), strict=True,
    )  # fmt: skip
    for prepared, nominal, parameters, after, effective in rows:
        print(
            f"  {prepared.recording.file:9s} {nominal:9.1f} {parameters:11.1f} {after:12.3f}"
            f" {prepared.whitener.size:12d} {effective:10.0f}"
        )
    print("Standard deviation of the loop's width by source, Nm")
    slope = width_slope(found)
    for name, covariance in zip(SOURCES, conclusion.spread.sources, strict=True):
        print(f"  {name:22s} {np.sqrt(slope @ covariance @ slope):.4f}")


def width_slope(found: Diagnosis, step: float = 1e-3) -> NDArray:
    """Derivatives (n,) of the loop's width by the unknowns of the fit."""
    x = found.conclusion.fit.x

    def width(at: NDArray) -> float:
        return found.conclusion.reported_figures(at, 0)["loop_width_Nm"]

    return np.array([(width(x + d) - width(x - d)) / (2 * step) for d in step * np.eye(x.size)])


def print_answer(found: Diagnosis, label: dict) -> None:
    """Figures and corrected values beside the concealed ones."""
    print(f"\nVerdict: {found.document['verdict']}; concealed: {', '.join(label['effects'])}")
    print("  quantity                        rig file      found      +-         true  deviations")
    for effect in found.document["effects"]:
        truth = label["parameters"].get(effect["name"], {})
        print(f"  {effect['name']}, {effect['law']}, confidence {effect['confidence']:.2f}")
        for name, figure in effect["parameters"].items():
            if name in truth:
                print_row(name, None, figure["value"], figure["std"], truth[name])
        rivals = effect["alternatives"][:3]
        listed = ", ".join(f"{r['name']} {r['delta_score']:.0f} +- {r['se']:.0f}" for r in rivals)
        print(f"  alternatives, behind by: {listed}")
    for name, value in found.document["parameters_corrected"].items():
        nominal, truth = label["parameters_true_vs_rig"][name]
        print_row(name, nominal, value["to"], value["std"], truth)


def print_row(name: str, nominal: float | None, value: float, std: float, truth: float) -> None:
    """One figure beside the true one."""
    before = "" if nominal is None else f"{nominal:.5g}"
    off = (value - truth) / std
    print(f"  {name:30s} {before:>9s} {value:10.5g} {std:8.2g} {truth:12.5g} {off:+10.1f}")


def print_test(found: Diagnosis, folder: Path, label: dict) -> None:
    """Errors of the prediction of the hidden test."""
    test = read_test(folder / "cases" / "case-001" / "test", found.model.rig)[0]
    predicted = found.model.predict(test)
    rows = np.genfromtxt(folder / "hidden" / "case-001" / "output.csv", delimiter=",", names=True)
    print("\nHidden test, rms error over the standard deviation of the reading")
    print("  channel            rig file  parameters  diagnosis      floor")
    for name, known in label["hidden_test"]["nrmse"].items():
        error = float(np.sqrt(np.mean((predicted[name] - rows[name]) ** 2)) / rows[name].std())
        print(
            f"  {name:17s} {known['nominal']:9.4f} {known['refit']:11.4f} {error:10.4f}"
            f" {known['floor']:10.4f}"
        )


def draw(found: Diagnosis, smoothed: Smoothed, path: Path) -> None:
    """The port torque of the spring, and the innovations with and without the effect."""
    figure = Figure(figsize=(9.6, 3.6), dpi=130, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    deflection, torque = smoothed.signals["spring_deflection_rad"], smoothed.ports["S"]
    left.plot(deflection, torque, color=BLUE, linewidth=0.7)
    left.set(
        xlabel="spring deflection [rad]", ylabel="unknown torque in the spring [Nm]",
        title="rec1.csv: torque at port S, smoothed",
    )  # fmt: skip
    problem = found.conclusion.problem
    prepared = problem.fitted[0]
    torque_column = prepared.channels.index("torque_Nm")
    for fit, colour, given_arguments in (
        (found.conclusion.search.parameters, VERMILION, "parameters only"),
        (found.conclusion.fit, BLUE, "with spring-hysteresis"),
    ):
        innovation = problem.innovations(fit.hypothesis, fit.x[None])[0][0, :, torque_column]
        time = (
            np.arange(innovation.size) * prepared.whitener.block * prepared.recording.sample_time_s
        )
        right.plot(time, innovation, color=colour, linewidth=0.6, label=given_arguments)
    right.set(
        xlabel="time [s]", ylabel="normalised innovation", title="rec1.csv: torque_Nm, whitened"
    )
    right.legend(frameon=False, loc="lower right")
    for axes in (left, right):
        axes.grid(color="#e3e7ec", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, metadata={"Software": None})
    print(path)


def main() -> None:
    """Make the case, diagnose it, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, metavar="OUT", help="folder for the case")
    parser.add_argument("--figure", type=Path, metavar="PNG", help="picture to write")
    arguments = parser.parse_args()
    print_separability()
    case = read_case(made(arguments.out))
    found = diagnose(case)
    rig = (
        found.conclusion.rig()
    )  # with the values found, so that the ports hold missing physics alone
    smoothed = [port_torques(rig, recording) for recording in case.identification]
    print_location(case, smoothed, locate(rig, case.identification, smoothed))
    print_ports(found)
    print_fit(found)
    label = json.loads((arguments.out / "labels.json").read_text())["case-001"]
    print_answer(found, label)
    print_test(found, arguments.out, label)
    if arguments.figure:
        draw(found, smoothed[0], arguments.figure)


if __name__ == "__main__":
    main()
