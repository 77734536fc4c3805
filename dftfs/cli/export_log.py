"""`dftfs export-log`: the recordings of a case as Parquet or MCAP, a machine as MJCF or URDF."""

import argparse
import json
import os
from pathlib import Path

from dftfs.cli.common import emit
from dftfs.cli.output import prepared
from dftfs.errors import DftfsError
from dftfs.files import refuse_existing, write_text
from rsea_core.errors import RecordingError
from rsea_core.interop.mjcf import to_mjcf
from rsea_core.interop.urdf import to_urdf
from rsea_core.model.model_file import read_model
from rsea_core.recordings.case import read_case
from rsea_core.recordings.readers.log import library
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.units import unit_of_column

FORMATS = ("parquet", "mcap")
MACHINES = {"urdf": ("URDF", ".urdf", to_urdf), "mjcf": ("MJCF", ".xml", to_mjcf)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("source", type=Path, metavar="CASE|MODEL.toml", help="case or machine")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder")
    parser.add_argument(
        "--format", choices=(*FORMATS, *MACHINES), help="parquet of recordings, urdf of a machine"
    )
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Write every recording of a case, or the machine of a model file."""
    if arguments.source.suffix == ".toml":
        return _machine(arguments)
    ending = arguments.format or FORMATS[0]
    if ending not in FORMATS:
        raise DftfsError(f"--format {ending} is of a machine, and {arguments.source} a case")
    case = read_case(arguments.source)
    folder = prepared(arguments, arguments.out)
    stems = [_stem(r.file) for r in case.recordings]
    if len(set(stems)) < len(stems):
        stems = [f"{k + 1}-{stem}" for k, stem in enumerate(stems)]
    paths = [folder / f"{stem}.{ending}" for stem in stems]
    refuse_existing(paths, force=arguments.force)
    write = {"parquet": _write_parquet, "mcap": _write_mcap}[ending]
    for r, path in zip(case.recordings, paths):
        unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            write(r, unfinished)
            unfinished.replace(path)
        except OSError as problem:
            raise DftfsError(f"{path}: cannot be written: {problem.strerror}") from problem
        finally:
            unfinished.unlink(missing_ok=True)
    emit({"files": paths}, "\n".join(map(str, paths)), as_json=arguments.json)
    return 0


def _stem(file: str) -> str:
    """A file's name without what a folder would take amiss."""
    bare = Path(file.partition(" [")[0]).stem + file.partition(" [")[2].rstrip("]")
    return bare.replace(" ", "").replace("..", "-")


def _write_parquet(r: Recording, path: Path) -> None:
    arrow, parquet = library("pyarrow", path), library("pyarrow.parquet", path)
    fields = [
        arrow.field(name, arrow.float64(), metadata={"unit": unit_of_column(name)})
        for name in r.columns
    ]
    schema = arrow.schema(fields, metadata={"load": r.load.kind, "role": r.role, "file": r.file})
    columns = [arrow.array(values) for values in r.columns.values()]
    parquet.write_table(arrow.table(columns, schema=schema), path)


def _write_mcap(r: Recording, path: Path) -> None:
    """One JSON message a row on the topic `/recording`; `time_s` to the last digit inside."""
    writer_module = library("mcap.writer", path)
    properties = {name: {"type": "number", "unit": unit_of_column(name)} for name in r.columns}
    schema = {"type": "object", "properties": properties}
    with open(path, "wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        kind = writer.register_schema("recording", "jsonschema", json.dumps(schema).encode())
        channel = writer.register_channel("/recording", "json", kind)
        names = list(r.columns)
        for row in zip(*(r[n].tolist() for n in names)):
            at = round(1e9 * (row[names.index("time_s")] - r.time_s[0]))
            data = json.dumps(dict(zip(names, row))).encode()
            writer.add_message(channel, log_time=at, data=data, publish_time=at)
        writer.add_metadata("recording", {"load": r.load.kind, "role": r.role, "file": r.file})
        writer.finish()


def _machine(arguments: argparse.Namespace) -> int:
    if arguments.format in FORMATS:
        raise DftfsError(f"--format {arguments.format} is of recordings; a machine: urdf, mjcf")
    name, ending, write = MACHINES[arguments.format or "urdf"]
    try:
        model = read_model(arguments.source)
    except FileNotFoundError as problem:
        raise RecordingError(f"{arguments.source}: cannot be read") from problem
    command = "duty" if model.rig.supply_voltage_V else "current_command_A"
    made = write(model, **({} if name == "URDF" else {"command_name": command}))
    path = arguments.out / f"{arguments.source.stem}{ending}"
    refuse_existing([path], force=arguments.force)
    write_text(prepared(arguments, arguments.out) / path.name, made.text)
    lines = [str(path), *(f"{name} cannot hold {what}" for what in made.left_out)]
    emit({"file": path, "left_out": made.left_out}, "\n".join(lines), as_json=arguments.json)
    return 0
