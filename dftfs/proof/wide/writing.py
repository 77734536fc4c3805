"""A case on disk: rig.toml, recordings and test as the contract asks; the answers elsewhere."""

import json
from pathlib import Path

import numpy as np

from dftfs.files import write_text
from dftfs.proof.wide.case import Case, first_angle
from dftfs.proof.wide.labels import CHANNELS, label
from dftfs.proof.wide.owner import RIG_KEYS
from dftfs.proof.wide.truth.simulate import Planned

CASES, HIDDEN = "cases", "hidden"
DIGITS = {"time_s": 10, "temperature_C": 4}


def table(columns: dict[str, np.ndarray]) -> str:
    """CSV text of equally long columns."""
    formats = [f"%.{DIGITS.get(c, 8)}g" for c in columns]
    rows = zip(*(v.tolist() for v in columns.values()), strict=True)
    lines = [",".join(f % x for f, x in zip(formats, row, strict=True)) for row in rows]
    return "\n".join([",".join(columns), *lines, ""])


def rig_text(case: Case) -> str:
    """The owner's view of the rig, in TOML."""
    m, owner = case.drawn, case.owner
    body = owner.body(case.drawn.body)
    parts = ["load"] if m.command is None else ["drive", "gear", "load"]
    if m.body.sprung:
        parts.insert(2, "spring")
    lines = ["[rig]", f'name = "{m.name}"', f"parts = {json.dumps(parts)}"]
    if m.kind.linear:
        lines.append('axis = "linear"')
    for n, key in RIG_KEYS.items():
        if n not in owner.errors or n in owner.absent:
            continue
        value = getattr(body, n)
        if n == "gravity":
            value = float(f"{value / 9.80665 / m.distance:.4g}")
            lines.append(f"load_distance_m = {float(f'{m.distance:.4g}')!r}")
            lines.append("gravity_angle_offset_rad = 0.0")
        lines.append(f"{key} = {value!r}")
    for column, sensor in case.session.sensors.items():
        if sensor.count and column.endswith("angle_rad"):
            side = column.split("_")[0]
            lines.append(f"{side}_encoder_counts_per_rev = {round(2 * np.pi / sensor.count)}")
        elif column in ("torque_Nm", "current_A"):
            lines.append(f"{column.split('_')[0]}_sensor_noise_{column[-2:].strip('_')}"
                         f" = {sensor.noise!r}")  # fmt: skip
    if owner.tolerances():
        lines += ["", "[tolerances]", *(f"{k} = {v!r}" for k, v in owner.tolerances().items())]
    for k, p in enumerate(case.session.planned[:-1], start=1):
        lines += ["", "[[recording]]", f'file = "rec{k}.csv"', f'role = "{p.role}"',
                  f'load = "{m.kind.load}"', f'description = "{p.description}"']  # fmt: skip
        if p.start.speed:
            lines.append("initial_rest = false")
    return "\n".join([*lines, ""])


def inputs(case: Case, p: Planned) -> dict[str, np.ndarray]:
    """Time and command columns of a recording."""
    columns = {"time_s": p.rows_s}
    if case.drawn.command is not None:
        columns[case.drawn.command] = p.row_commands()
    return columns


def test_text(case: Case) -> str:
    p, first = case.session.planned[-1], case.logged[-1]
    angle = first_angle(case.drawn, first, p.start.angle)
    lines = ["[[recording]]", 'file = "input.csv"', f'load = "{case.drawn.kind.load}"',
             f'description = "{p.description}"',
             f"initial_motor_angle_rad = {float(f'{case.drawn.body.gear_ratio * angle:.6g}')!r}",
             f"initial_load_angle_rad = {float(f'{angle:.6g}')!r}"]  # fmt: skip
    return "\n".join([*lines, ""])


def write_case(case: Case, name: str, folder: Path, sealed: Path) -> dict[str, object]:
    """Write one case and its hidden answers; returns its label."""
    place, hidden = folder / CASES / name, sealed / HIDDEN / name
    for path in (place / "test", hidden):
        path.mkdir(parents=True, exist_ok=True)
    for k, (p, r) in enumerate(
        zip(case.session.planned[:-1], case.logged[:-1], strict=True), start=1
    ):
        write_text(place / f"rec{k}.csv", table(inputs(case, p) | r))
    test = case.session.planned[-1]
    write_text(place / "test" / "input.csv", table(inputs(case, test)))
    write_text(place / "test" / "test.toml", test_text(case))
    shown = [c for c in CHANNELS if c in case.logged[-1]]
    for file, values in (("output.csv", case.logged[-1]), ("truth.csv", case.exact[-1]),
                         ("nominal.csv", case.nominal), ("refit.csv", case.refitted)):  # fmt: skip
        time = {"time_s": test.rows_s}
        write_text(hidden / file, table(time | {c: values[c] for c in shown}))
    answer = label(case)
    write_text(place / "rig.toml", rig_text(case))  # last: a case with a rig file is complete
    return answer
