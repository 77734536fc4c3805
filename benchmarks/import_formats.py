"""Real sets from their owners' raw files, and real recordings written in every format, imported.

    python -m benchmarks.import_formats DATA

DATA is the folder with `real` and `real-2`. First the raw files of `muir-sea` (MATLAB) and
`pendulum-ringdown` (CSV without a header) through a `[columns]` table, against the hand-made cases:
the largest difference over the signal's span. Then the first recording of every case as mat, h5,
parquet, mcap, and csv with comma, semicolon and decimal comma, in degrees, milliamperes and
milliseconds under units in the names, through what `dftfs import --yes` proposes.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from rsea_core.errors import RseaError
from rsea_core.importing.case_maker import (
    ImportOptions,
    case_text,
    decided,
    labelled_columns,
    listed_recordings,
)
from rsea_core.recordings.case import Case, read_case
from rsea_core.recordings.readers.open_log import open_log

MUIR = """[columns]
time_s = "time"
current_command_A = { name = "motor_torque", unit = "A", scale = 2.920560747663551 }
motor_angle_rad = { name = "motor_position", unit = "rad", side = "load" }
load_angle_rad = "actual_position"
reference = ["reference_position"]
ignore = ["*"]
"""
PENDULUM = """[columns]
time_s = "1"
load_angle_rad = { name = "2", unit = "rad", zero = 3.141592653589793 }
ignore = ["*"]
"""
RAW = {
    "muir-sea": (MUIR, {
        "position_steps.csv": 'file = "raw/DoubleLoopReference.mat"',
        "torque_ramps_clamped.csv": 'file = "raw/InnerLoop.mat"\nload = "locked"',
        "hand_disturbance.csv": 'file = "raw/DoubleLoopDisturbance.mat"\nrole = "validation"',
    }),
    "pendulum-ringdown": (PENDULUM, {
        "first_half.csv": 'file = "raw/test1pend1.csv"\nstart_s = 0.8537\nend_s = 35.2502',
        "second_half.csv": 'file = "raw/test1pend1.csv"\nstart_s = 35.2568\nend_s = 69.6577\n'
                           "initial_rest = false",
    }),
}  # fmt: skip
FOREIGN = {"rad": ("deg", 180.0 / np.pi), "A": ("mA", 1e3), "s": ("ms", 1e3), "Nm": ("mNm", 1e3)}


def from_raw(data: Path, name: str) -> str:
    """The largest difference to the hand-made case, over each signal's span."""
    folder = data / "real-2" / name
    made = read_case(folder)
    columns, entries = RAW[name]
    head = (folder / "rig.toml").read_text(encoding="utf-8").partition("[[recording]]")[0]
    with tempfile.TemporaryDirectory() as work:
        (Path(work) / "raw").symlink_to(folder / "raw")
        text = head + columns + "".join(f"\n[[recording]]\n{e}\n" for e in entries.values())
        (Path(work) / "rig.toml").write_text(text, encoding="utf-8")
        case = read_case(work)
    by_file = {r.file: r for r in made.recordings}
    worst = 0.0
    for own, file in zip(case.recordings, entries):
        hand = by_file[file]
        for column in hand.columns:
            size = max(float(np.ptp(hand[column])), 1e-9)
            shift = hand["time_s"][0] if column == "time_s" else 0.0
            worst = max(worst, float(np.abs(own[column] + shift - hand[column]).max()) / size)
    return f"{name}: raw files against the hand-made case: largest difference {worst:.1e} of span"


def disguised(case: Case) -> dict[str, np.ndarray]:
    """The first recording with other units in the names."""
    r, found = case.recordings[0], {}
    for name, values in (r.columns if r.logged is None else r.logged).items():
        bare, _, unit = name.rpartition("_")
        other, factor = FOREIGN.get(unit, (unit, 1.0))
        if name.endswith("_per_s") or name in ("duty", "drive_enabled"):
            found[name] = np.asarray(values)
        else:
            found[f"{bare}_{other}"] = factor * np.asarray(values)
    return found


def write(path: Path, columns: dict[str, np.ndarray], kind: str) -> None:
    """The columns in a format."""
    if kind == "mat":
        from scipy.io import savemat

        savemat(path, columns)
    elif kind == "h5":
        import h5py

        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values
    elif kind == "parquet":
        import pyarrow as arrow
        from pyarrow import parquet

        parquet.write_table(arrow.table(columns), path)
    elif kind == "mcap":
        from mcap.writer import Writer

        with open(path, "wb") as stream:
            writer = Writer(stream)
            writer.start()
            schema = writer.register_schema("log", "jsonschema", b"{}")
            channel = writer.register_channel("/log", "json", schema)
            time = next(n for n in columns if n.startswith("time"))
            for row in zip(*(v.tolist() for v in columns.values())):
                message = dict(zip(columns, row))
                at = round(1e6 * (message[time] - columns[time][0]))
                data = json.dumps(message).encode()
                writer.add_message(channel, log_time=at, data=data, publish_time=at)
            writer.finish()
    else:
        delimiter, decimal = (";", ",") if kind == "semicolon" else (",", ".")
        lines = [delimiter.join(columns)]
        for row in zip(*(v.tolist() for v in columns.values())):
            lines.append(delimiter.join(f"{v:.17g}".replace(".", decimal) for v in row))
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def imported(case: Case, work: Path, kind: str) -> str:
    """Whether the recording comes back equal, without a file edited."""
    path = work / f"log.{'csv' if kind in ('comma', 'semicolon') else kind}"
    write(path, disguised(case), kind)
    options = ImportOptions(out=work / "case", load=case.recordings[0].load.kind)
    log = open_log(path)
    columns = labelled_columns([log], options)
    proposal = decided(columns, case.rig, options, path, None)
    listed = listed_recordings([log], proposal, case.rig, options)
    text = case_text(proposal, columns, listed, case.rig, {}, options)
    if options.load == "constant-torque":
        text = text.rstrip() + f"\nload_torque_Nm = {case.recordings[0].load.load_torque_Nm!r}\n"
    quasi = "quasi_static = true\n" if case.recordings[0].quasi_static else ""
    (work / "case").mkdir(exist_ok=True)
    (work / "case" / "rig.toml").write_text(text.rstrip() + "\n" + quasi, encoding="utf-8")
    own, hand = read_case(work / "case").recordings[0], case.recordings[0]
    worst = 0.0
    for column in hand.columns:
        if column not in own:
            return f"{column} is missing"
        size = max(float(np.ptp(hand[column])), 1e-9)
        start = hand["time_s"][0] if column == "time_s" else 0.0
        worst = max(worst, float(np.abs(own[column] + start - hand[column]).max()) / size)
    asked = f", {len(proposal.questions)} questions" if proposal.questions else ""
    return f"equal to {worst:.0e} of span{asked}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    arguments = parser.parse_args()
    for name in RAW:
        print(from_raw(arguments.data, name))
    folders = sorted(p.parent for p in arguments.data.glob("real*/*/rig.toml"))
    for folder in folders:
        case, results = read_case(folder), {}
        for kind in ("mat", "h5", "parquet", "mcap", "comma", "semicolon"):
            with tempfile.TemporaryDirectory() as work:
                try:
                    results.setdefault(imported(case, Path(work), kind), []).append(kind)
                except RseaError as problem:
                    results.setdefault(f"refused: {str(problem)[-160:]}", []).append(kind)
        for text, kinds in results.items():
            print(f"{folder.name}: {', '.join(kinds)}: {text}")


if __name__ == "__main__":
    main()
