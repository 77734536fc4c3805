"""A case on disk: rig.toml, recordings and test as the contract asks, the hidden answers apart."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from dftfs.files import write_text
from dftfs.proof.bench import Planned, Session
from dftfs.proof.cases import Case
from dftfs.proof.labels import CHANNELS, label
from dftfs.proof.machine import Machine
from dftfs.proof.readings import Sensors
from dftfs.proof.refit import refit, simulated
from dftfs.proof.rigs import three_digits

CASES, HIDDEN = "cases", "hidden"
FORMATS = {
    "time_s": "%.3f",
    "duty": "%.5f",
    "motor_angle_rad": "%.5f",
    "load_angle_rad": "%.5f",
    "current_A": "%.3f",
    "torque_Nm": "%.3f",
    "temperature_C": "%.1f",
}
EXACT = FORMATS | {"motor_angle_rad": "%.6f", "load_angle_rad": "%.7f", "torque_Nm": "%.5f"}


def table(columns: dict[str, np.ndarray], formats: dict[str, str]) -> str:
    """CSV text of equally long columns."""
    row = ",".join(formats[c] for c in columns)
    lines = [row % values for values in zip(*(v.tolist() for v in columns.values()), strict=True)]
    return "\n".join([",".join(columns), *lines, ""])


def contact_lines(machine: Machine) -> list[str]:
    return [
        f"{name} = {three_digits(getattr(machine, name))!r}"
        for name in Machine._fields
        if name.startswith("contact")
    ]


def rig_text(case: Case) -> str:
    """The owner's view of the rig, in TOML."""
    rig, sensors = case.rig, case.rig.sensors
    lines = ["[rig]", 'name = "rsea-bench"']
    lines += [
        f"{name} = {getattr(rig.nominal, name)!r}"
        for name in Machine._fields
        if not name.startswith("contact")
    ]
    lines += [
        f"motor_encoder_counts_per_rev = {sensors.motor_counts_per_rev}",
        f"load_encoder_counts_per_rev = {sensors.load_counts_per_rev}",
        f"torque_sensor_noise_Nm = {sensors.torque_noise_Nm!r}",
        f"current_sensor_noise_A = {sensors.current_noise_A!r}",
    ]
    if rig.tolerances:
        lines += ["", "[tolerances]", *(f"{k} = {v!r}" for k, v in rig.tolerances.items())]
    if rig.anchored:
        quantities = ", ".join(f'"{a}"' for a in rig.anchored)
        lines += ["", "[anchor]", f"quantities = [{quantities}]"]
    for k, planned in enumerate(case.planned[:-1], start=1):
        lines += [
            "",
            "[[recording]]",
            f'file = "rec{k}.csv"',
            f'role = "{planned.role}"',
            f'load = "{planned.load}"',
            f'description = "{planned.description}"',
        ]
        if planned.load == "contact":
            lines += contact_lines(rig.nominal)
    return "\n".join([*lines, ""])


def test_text(case: Case) -> str:
    planned, first = case.planned[-1], case.readings[-1]
    lines = [
        "# inputs of one more recording of this rig; predict motor_angle_rad, load_angle_rad,",
        "# torque_Nm, where the rig has them",
        "[[recording]]",
        'file = "input.csv"',
        f'load = "{planned.load}"',
        f'description = "{planned.description}"',
    ]
    for name in ("motor_angle_rad", "load_angle_rad"):
        start = float(first[name][0]) if name in first else getattr(planned, name)
        lines.append(f"initial_{name} = {start:.6f}")
    if "temperature_C" in first:
        lines.append(f"initial_temperature_C = {float(first['temperature_C'][:50].mean()):.1f}")
    if planned.load == "contact":
        lines += contact_lines(case.rig.nominal)
    return "\n".join([*lines, ""])


def owners_session(case: Case, machine: Machine, which: slice) -> Session:
    """What the owner can simulate: healthy sensors, no effects, starts from the first readings."""
    planned: list[Planned] = []
    for p, r in zip(case.planned[which], case.readings[which], strict=True):
        start = {n: float(r[n][0]) for n in ("motor_angle_rad", "load_angle_rad") if n in r}
        planned.append(replace(p, backlash_place=0.0, **start))
    sensors = Sensors(columns=CHANNELS)
    return Session(machine=machine, sensors=sensors, planned=tuple(planned))


def write_case(case: Case, name: str, folder: Path) -> dict[str, object]:
    """Write one case and its hidden answers; returns its label.

    The refit sees the identification recordings only, as every diagnosis does.
    """
    place, hidden = folder / CASES / name, folder / HIDDEN / name
    for path in (place / "test", hidden):
        path.mkdir(parents=True, exist_ok=True)
    for k, (p, r) in enumerate(zip(case.planned, case.readings, strict=True), start=1):
        columns = {"time_s": p.time_s, "duty": p.command}
        if p.role == "test":
            write_text(place / "test" / "input.csv", table(columns, FORMATS))
        else:
            write_text(place / f"rec{k}.csv", table(columns | r, FORMATS))
    write_text(place / "test" / "test.toml", test_text(case))
    seen = [k for k, p in enumerate(case.planned) if p.role == "identification"]
    whole = owners_session(case, case.rig.nominal, slice(None))
    known = replace(
        whole,
        planned=tuple(whole.planned[k] for k in seen),
        sensors=replace(whole.sensors, columns=case.rig.sensors.columns),
    )
    machine = refit(known, [case.readings[k] for k in seen], [case.floor[k] for k in seen])
    test = replace(whole, planned=whole.planned[-1:])
    nominal = simulated(test)[0]
    refitted = simulated(replace(test, machine=machine))[0]
    time = {"time_s": case.planned[-1].time_s}
    shown = [c for c in CHANNELS if c in case.readings[-1]]
    for file, values, formats in (
        ("output.csv", case.readings[-1], FORMATS),
        ("truth.csv", case.expected[-1], EXACT),
        ("nominal.csv", nominal, EXACT),
        ("refit.csv", refitted, EXACT),
    ):
        write_text(hidden / file, table(time | {c: values[c] for c in shown}, formats))
    answer = label(case, nominal, refitted, machine)
    write_text(place / "rig.toml", rig_text(case))  # last: a case with a rig file is complete
    return answer
