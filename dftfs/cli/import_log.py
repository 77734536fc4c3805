"""`dftfs import`: a stranger's logs in, a case folder with a commented rig.toml out."""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from dftfs.cli.common import emit, progress, silent, table
from dftfs.errors import DftfsError
from dftfs.files import OutputError, write_text
from dftfs.report.recording_page import recording_page
from rsea_core.errors import RecordingError, RigError, RseaError
from rsea_core.files.toml_tables import read_toml
from rsea_core.importing import log_columns as lc
from rsea_core.importing.case_text import (
    NEEDED,
    ListedRecording,
    columns_text,
    missing_values,
    parts_of,
    recording_text,
    rig_text,
)
from rsea_core.importing.proposal import Proposal, answered, propose
from rsea_core.importing.robot_model import rig_values
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import read_case
from rsea_core.recordings.quality_checks import data_warnings
from rsea_core.recordings.readers.log import Log
from rsea_core.recordings.readers.open_log import open_log
from rsea_core.recordings.units import factor_and_offset, unit_of_column

RIG, PREVIEW = "rig.toml", "preview.html"
HELD_SPAN = 0.01  # of the motor behind the gear: a load that moves less was held


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="file or folder")
    parser.add_argument("--out", type=Path, required=True, metavar="CASE", help="case folder")
    parser.add_argument("--rig", metavar="RIG", help="rig.toml with values, or rsea-bench")
    parser.add_argument("--model", type=Path, metavar="XML", help="values of a MJCF or URDF file")
    parser.add_argument("--joint", metavar="J", help="of a log with several joints")
    parser.add_argument("--split", nargs="?", const="", metavar="FLAG",
                        help="several runs: at gaps, or where column FLAG is 0")  # fmt: skip
    parser.add_argument("--rate-hz", type=float, metavar="HZ", help="of a log without times")
    parser.add_argument(
        "--load", default=None, help="pendulum, free, locked ... (default: guessed)"
    )
    parser.add_argument("--column", action="append", default=[], metavar="NAME=COL:UNIT[:SIGN]",
                        help="an answer, e.g. motor_angle_rad=enc1:deg:-1")  # fmt: skip
    parser.add_argument("--yes", action="store_true", help="take every proposal, ask nothing")
    parser.add_argument("--force", action="store_true", help="write into a case that is there")
    parser.add_argument("--json", action="store_true", help="print the proposal as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Look, propose, ask, write, read back."""
    out = arguments.out
    if (out / RIG).exists():
        return _add_to_case(arguments)
    if out.exists() and any(out.iterdir()) and not arguments.force:
        raise OutputError(f"{out} exists and is not empty; --force writes into it")
    rig = _rig(arguments)
    known = rig_values(arguments.model, arguments.joint) if arguments.model is not None else {}
    groups = _recordings([open_log(path, progress()) for path in arguments.logs])
    columns, labels = _columns(groups[0], arguments)
    proposal = _decided(columns, labels, rig, arguments)
    listed = [one for group in groups for one in _listed(group, proposal, columns, rig, arguments)]
    text = _case_text(proposal, columns, listed, rig, known, arguments)
    return _write(out, text, proposal, columns, rig, arguments)


def _rig(arguments: argparse.Namespace) -> Rig | None:
    if arguments.rig is None:
        return None
    path = Path(arguments.rig)
    return Rig.from_toml(path) if path.suffix == ".toml" else Rig.preset(arguments.rig)


def _recordings(logs: list[Log]) -> list[list[Log]]:
    """Logs with the same columns are recordings; others are files of one recording."""
    names = [sorted(n for s in log.streams for n in s.columns) for log in logs]
    if all(n == names[0] for n in names):
        return [[log] for log in logs]
    return [logs]


def _columns(group: list[Log], arguments: argparse.Namespace):
    columns, labels = lc.columns_on_one_clock(group, arguments.joint)
    if arguments.rate_hz is not None:
        rows = next(iter(columns.values())).values.size
        clock = np.arange(rows) / arguments.rate_hz
        columns = {
            "row time [s]": lc.Column(name="", topic=None, values=clock, unit="s"),
            **columns,
        }
        labels["row time [s]"] = "time [s]"
    return columns, labels


def _decided(columns, labels, rig: Rig | None, arguments: argparse.Namespace) -> Proposal:
    """The proposal, with every question answered or taken."""
    raw = {labels[n] if _unique(labels, n) else n: c.values for n, c in columns.items()}
    units = {labels[n] if _unique(labels, n) else n: c.unit for n, c in columns.items() if c.unit}
    try:
        proposal = propose(raw, units, rig)
    except RecordingError as problem:
        raise RecordingError(f"{arguments.logs[0]}: {problem}") from problem
    if proposal.rate_needed:
        raise RecordingError(
            f"{arguments.logs[0]}: no column is a time; say how fast it was logged with --rate-hz"
        )
    for answer in arguments.column:
        proposal = _answer(proposal, answer, raw)
    if not proposal.questions or arguments.yes:
        return proposal
    if not sys.stdin.isatty():
        raise DftfsError(
            f"{len(proposal.questions)} questions: {' | '.join(proposal.questions)} Answer with"
            " --column, or take the proposals with --yes"
        )
    for question in proposal.questions:
        reply = input(f"{question} [Enter: as proposed, or NAME=COLUMN:UNIT[:SIGN]] ").strip()
        proposal = _answer(proposal, reply, raw) if reply else proposal
    return proposal


def _unique(labels: dict[str, str], name: str) -> bool:
    return list(labels.values()).count(labels[name]) == 1 and bool(labels[name])


def _answer(proposal: Proposal, answer: str, raw) -> Proposal:
    target, equals, value = answer.partition("=")
    name, *rest = value.split(":")
    if not equals or not 1 <= len(rest) <= 2 or name not in raw:
        raise DftfsError(
            f"--column {answer}: write NAME=COLUMN:UNIT[:SIGN] with a column of the log:"
            f" {', '.join(raw)}"
        )
    if len(rest) == 2 and rest[1] not in ("1", "-1"):
        raise DftfsError(f"--column {answer}: the sign must be 1 or -1")
    factor_and_offset(rest[0], unit_of_column(target), 1.0)  # refuses a unit that is none
    sign = int(rest[1]) if len(rest) == 2 else 1
    return answered(proposal, target, name=name, unit=rest[0], sign=sign)


def _listed(group, proposal: Proposal, first, rig, arguments) -> list[ListedRecording]:
    """The `[[recording]]` entries of one group of files."""
    here = [_relative(log.path, arguments.out) for log in group]
    columns, labels = _columns(group, arguments)
    by_label = {labels[n] if _unique(labels, n) else n: c.values for n, c in columns.items()}
    time = proposal.column("time_s")
    factor, _ = factor_and_offset(time.unit, "s", None)
    time_s = factor * by_label[time.name]
    load = arguments.load or _load(by_label, proposal, rig)
    base = {"file": here[0], "with_files": tuple(here[1:]), "load": load,
            "description": f"imported from {group[0].path.name}"}  # fmt: skip
    if arguments.split is None:
        return [ListedRecording(**base)]
    if not arguments.split:
        parts = lc.parts_at_gaps(time_s)
    elif arguments.split in columns:
        parts = lc.parts_at_flag(time_s, columns[arguments.split].values)
    else:
        raise DftfsError(f"--split {arguments.split}: no such column; {', '.join(columns)}")
    return [ListedRecording(**base, start_s=a, end_s=b) for a, b in parts]


def _relative(path: Path, out: Path) -> str:
    return Path(os.path.relpath(path.resolve(), out.resolve())).as_posix()


def _load(raw, proposal: Proposal, rig: Rig | None) -> str:
    """How the load was held, from what moves."""
    motor, load = (proposal.column(f"{s}_angle_rad") for s in ("motor", "load"))
    if motor is None or load is None or rig is None:
        return "pendulum"
    spans = []
    for c in (motor, load):
        factor, _ = factor_and_offset(c.unit, "rad", c.counts_per_rev)
        spans.append(factor * float(np.ptp(raw[c.name])))
    behind = spans[0] / (1.0 if motor.side == "load" else rig.gear_ratio or 1.0)
    return "locked" if spans[1] < HELD_SPAN * behind else "pendulum"


def _case_text(proposal: Proposal, columns, listed, rig, known, arguments) -> str:
    labels = _columns_by_label(columns, arguments)
    entries = []
    for c in proposal.columns:
        if arguments.rate_hz is not None and c.target == "time_s":
            continue
        own = labels[c.name]
        entries.append((c, own.name, own.topic))
    kept = [labels[n] for n in proposal.references if n in labels]
    references = [f"{c.topic}: {c.name}" if c.topic else c.name for c in kept]
    text = columns_text(entries, references=references, rate_Hz=arguments.rate_hz)
    parts = rig.parts if rig else parts_of([c.target for c in proposal.columns])
    return rig_text(rig, arguments.out.name, parts, text, listed, known)


def _columns_by_label(columns, arguments):
    labels = {n: lc.without_joint_label(n, c, arguments.joint) for n, c in columns.items()}
    return {labels[n] if _unique(labels, n) else n: c for n, c in columns.items()}


def _write(out: Path, text: str, proposal: Proposal, columns, rig, arguments) -> int:
    """The case, read back before it appears; then the preview and what is missing."""
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".unfinished-") as made:
        write_text(Path(made) / RIG, text)
        case, problem = None, None
        try:
            case = read_case(made)
        except RigError as found:
            problem = str(found).replace(str(Path(made)), str(out))
        except RseaError as found:
            raise RecordingError(str(found).replace(str(Path(made)), str(out))) from found
    out.mkdir(exist_ok=True)
    write_text(out / RIG, text)
    notes = [] if case is None else [f.sentence() for f in (*case.notes(), *data_warnings(case))]
    rows = [
        (c.target, c.name, f"{'-' if c.sign < 0 else ''}{c.unit}", f"{c.confidence:.0%}", c.reason)
        for c in proposal.columns
    ]
    header = ("reading", "column", "unit", "sure", "why")
    if case is not None:
        page = recording_page(
            f"{out.name}: imported", header, rows, notes,
            [(r.file, r.time_s, {n: r[n] for n in r.columns if n != "time_s"})
             for r in case.recordings],
        )  # fmt: skip
        write_text(out / PREVIEW, page)
    missing = missing_values(rig, parts_of([c.target for c in proposal.columns]))
    lines = [table(header, rows)]
    lines += [f"taken without asking: {q}" for q in proposal.questions]
    lines += (
        [f"reference, not fitted: {', '.join(proposal.references)}"] if proposal.references else []
    )
    lines += [f"note: {note}" for note in notes]
    lines += [f"missing in [rig]: {key}: {NEEDED[key]}" for key in missing]
    lines += [f"not complete yet: {problem}"] if problem else []
    lines += [str(out / RIG), *([str(out / PREVIEW)] if case is not None else [])]
    emit({"case": str(out), "columns": rows, "questions": proposal.questions, "notes": notes,
          "missing": missing}, "\n".join(lines), as_json=arguments.json)  # fmt: skip
    return 0


def _add_to_case(arguments: argparse.Namespace) -> int:
    """Another log for a case that has its map already: listed, read back, nothing asked."""
    path = arguments.out / RIG
    if "columns" not in read_toml(path, RigError):
        raise DftfsError(f"{path} exists without [columns]; import into another folder")
    groups = _recordings([open_log(log, silent) for log in arguments.logs])
    listed = [
        ListedRecording(
            file=_relative(group[0].path, arguments.out),
            with_files=tuple(_relative(log.path, arguments.out) for log in group[1:]),
            load=arguments.load or "pendulum",
            description=f"imported from {group[0].path.name}",
        )
        for group in groups
    ]
    text = path.read_text(encoding="utf-8").rstrip() + "\n\n"
    text += "\n".join(recording_text(r) for r in listed)
    with tempfile.TemporaryDirectory(dir=arguments.out.parent, prefix=".unfinished-") as made:
        write_text(Path(made) / RIG, text)
        try:
            case = read_case(made)
        except RseaError as found:
            raise RecordingError(str(found).replace(str(made), str(arguments.out))) from found
    write_text(path, text)
    notes = [f.sentence() for f in data_warnings(case)]
    lines = [f"{path}: {len(listed)} more recordings with the map that is there"]
    emit({"case": str(arguments.out), "notes": notes},
         "\n".join([*lines, *(f"note: {n}" for n in notes)]), as_json=arguments.json)  # fmt: skip
    return 0
