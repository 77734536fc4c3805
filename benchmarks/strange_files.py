"""Strange files: each imported rightly, asked about, or refused in one line with nothing written.

    python -m benchmarks.strange_files CASES [--only WORD]

CASES is a folder of practice cases; one recording of one of them is written in every form of
`benchmarks.strange_tables` and in the binary forms below, whole, in halves and under other names,
and imported by `dftfs import`. Prints each file with what came of it, and the counts.
"""

import argparse
import contextlib
import gzip
import io
import json
import pickle
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.foreign_dialects import table as bench_table
from benchmarks.foreign_dialects import truth_of
from benchmarks.foreign_logs import compared
from benchmarks.strange_tables import ASKED, REFUSED, RIGHT, Table, table
from dftfs.cli.main import main as run_command
from rsea_core.recordings.case import read_case

ROWS = 3000
Strange = tuple[str, str, Callable[[Path, Table], list[Path]], tuple[str, ...]]


def write_binary(folder: Path, t: Table, kind: str) -> Path:
    """The table in a binary format."""
    path = folder / f"log.{kind}"
    if kind == "npz":
        np.savez(path, **t)
    elif kind == "mat":
        from scipy.io import savemat

        motor = {"pos": t["theta_m"], "current": t["iq"], "pwm": t["pwm"]}
        load = {"pos": t["theta_l"], "torque": t["loadcell"]}
        savemat(path, {"run": {"log": {"t": t["time"], "motor": motor, "load": load}}})
    elif kind == "h5":
        import h5py

        with h5py.File(path, "w") as file:
            file["values"] = np.stack(list(t.values()), axis=1)
            file["columns"] = [n.encode() for n in t]
    elif kind == "parquet":
        import pyarrow as arrow
        from pyarrow import parquet

        cells = [{"pos": a, "iq": b} for a, b in zip(t["theta_m"].tolist(), t["iq"].tolist())]
        own = {n: v for n, v in t.items() if n not in ("theta_m", "iq")}
        parquet.write_table(arrow.table({**own, "motor": cells}), path)
    elif kind == "tdms":
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("bench", n, v) for n, v in t.items()])
    else:
        _write_mcap(path, {"/log": t}, {"/log": 0.0})
    return path


def _write_mcap(path: Path, topics: dict[str, Table], begin: dict[str, float]) -> None:
    from mcap.writer import Writer

    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("row", "jsonschema", b"{}")
        for topic, t in topics.items():
            channel = writer.register_channel(topic, "json", schema)
            for k, at in enumerate(t["time"].tolist()):
                row = {n: float(v[k]) for n, v in t.items()} | {"time": at + begin[topic]}
                ns = round(1e9 * row["time"])
                data = json.dumps(row).encode()
                writer.add_message(channel, log_time=ns, data=data, publish_time=ns)
        writer.finish()


def _as_file(write: Callable[[Table], bytes], name: str = "log.csv"):
    def made(folder: Path, t: Table) -> list[Path]:
        path = folder / name
        path.write_bytes(write(t))
        return [path]

    return made


def _binary(kind: str, share: float = 1.0, name: str | None = None):
    def made(folder: Path, t: Table) -> list[Path]:
        path = write_binary(folder, t, kind)
        whole = path.read_bytes()
        path.write_bytes(whole[: max(10, int(share * len(whole)))])
        return [path.rename(folder / name) if name else path]

    return made


def _two_clocks(folder: Path, t: Table) -> list[Path]:
    load = {n: t[n] for n in ("time", "theta_l", "loadcell")}
    motor = {n: v for n, v in t.items() if n not in ("theta_l", "loadcell")}
    topics, begin = {"/motor": motor, "/load": load}, {"/motor": 0.0, "/load": 1.7e9}
    _write_mcap(folder / "log.mcap", topics, begin)
    return [folder / "log.mcap"]


def _two_units(folder: Path, t: Table) -> list[Path]:
    load = {"time": 1e3 * t["time"], "theta_l": t["theta_l"], "loadcell": t["loadcell"]}
    motor = {n: v for n, v in t.items() if n not in ("theta_l", "loadcell")}
    return [*_as_file(lambda _: table(motor).encode(), "motor.csv")(folder, t),
            *_as_file(lambda _: table(load).encode(), "load.csv")(folder, t)]  # fmt: skip


def _zip(t: Table) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        archive.writestr("log.csv", table(t))
    return made.getvalue()


def all_of_them() -> Iterator[Strange]:
    """Name, what has to come of it, writer of the files, and options."""
    for expected, group in (("right", RIGHT), ("asked", ASKED), ("refused", REFUSED)):
        yield from ((name, expected, _as_file(write), ()) for name, write in group.items())
    for kind in ("npz", "mat", "h5", "parquet", "tdms", "mcap"):
        yield f"{kind}, nested or with names beside", "right", _binary(kind), ()
        yield f"{kind} named .csv", "right", _binary(kind, name="log.csv"), ()
        yield from ((f"{share:.0%} of a {kind}", "refused", _binary(kind, share), ())
                    for share in (0.97, 0.5, 0.001))  # fmt: skip
    yield "csv named .parquet", "right", _as_file(lambda t: table(t).encode(), "log.parquet"), ()
    yield "csv named .mat", "refused", _as_file(lambda t: table(t).encode(), "log.mat"), ()
    yield "packed by gzip", "refused", _as_file(lambda t: gzip.compress(b"t,x\n")), ()
    yield "a zip archive", "refused", _as_file(_zip, "log.zip"), ()
    yield "a workbook", "refused", _as_file(_zip, "log.xlsx"), ()
    yield "a pickle", "refused", _as_file(pickle.dumps), ()
    yield "clocks that disagree", "refused", _two_clocks, ("--yes",)
    yield "clocks in two units", "refused", _two_units, ("--yes",)
    yield "not there", "refused", lambda folder, t: [folder / "none.csv"], ()
    yield "two runs, split", "right", _as_file(REFUSED["two runs, each from zero"]), ("--split",)
    yield "no time, its rate", "right", _as_file(REFUSED["no time"]), ("--rate-hz", "1000")


def outcome(
    work: Path, made: list[Path], options: tuple[str, ...], truth: dict, rig: str
) -> tuple[str, str]:
    """right, asked, refused or wrong, and the line that says why."""
    (work / "own-rig.toml").write_text(rig, encoding="utf-8")
    before = set(work.rglob("*"))
    out = work / "case"
    given = ["import", *map(str, made), "--rig", str(work / "own-rig.toml"), "--out", str(out)]
    printed = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(printed):
        status = run_command([*given, *options])
    lines = printed.getvalue().strip().splitlines()
    if status != 0:
        left = set(work.rglob("*")) - before
        errors = [line for line in lines if not line.startswith("question:")]
        good = status == 2 and len(errors) == 1 and not left
        verdict = "asked" if "answer each with --column" in lines[-1] else "refused"
        return (verdict, lines[-1]) if good else ("wrong", f"status {status}, {lines}, left {left}")
    r = read_case(out).recordings[0]
    if r.rows < ROWS:  # a column with fewer readings ends earlier
        truth = {n: v[: r.rows] for n, v in truth.items() if n != "torque_Nm"}
    return compared(r, truth)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    case = read_case(sorted(arguments.cases.iterdir())[1])
    r = next(r for r in case.recordings if r.load.kind == "pendulum")
    columns = {n: np.asarray(v)[:ROWS] for n, v in r.columns.items()}
    truth, t = truth_of(columns), bench_table(columns)
    counts: dict[str, int] = {}
    for name, expected, write, options in all_of_them():
        if arguments.only not in name:
            continue
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            work = Path(folder)
            (work / "logs").mkdir()
            made = write(work / "logs", t)
            verdict, line = outcome(work, made, options, truth, case.rig.to_toml())
            line = line.replace(folder, "").replace("/case/..", "")[:160]
        good = verdict == expected
        key = verdict if good else f"{verdict} instead of {expected}"
        counts[key] = counts.get(key, 0) + 1
        mark = " " if good else "*"
        print(f"{mark} {name}: {verdict}, {time.perf_counter() - begun:.1f} s. {line}", flush=True)
    print(f"{sum(counts.values())} files: {counts}")


if __name__ == "__main__":
    main()
