"""`dftfs import`: a stranger's logs in, a case folder with a commented rig.toml out."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import progress
from dftfs.cli.import_files import RIG, read_with_starts, write_case
from dftfs.cli.import_preview import PREVIEW, mapped_rows, notes_of, write_preview
from dftfs.cli.import_values import known_values, refuse, stated_rig, window_of
from dftfs.errors import DftfsError
from dftfs.files import OutputError, write_text
from rsea_core.errors import RigError
from rsea_core.files.toml_tables import read_toml
from rsea_core.importing.case_maker import (
    ImportOptions,
    case_text,
    common_load,
    completed,
    decided,
    file_entry,
    groups_of_paths,
    labelled_columns,
    listed_recordings,
    unread_text,
    windows_of,
    with_rate,
)
from rsea_core.importing.case_text import recording_text
from rsea_core.importing.log_columns import channels_of
from rsea_core.recordings.recording import ROLES


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add = parser.add_argument
    add("logs", nargs="+", type=Path, metavar="LOG", help="file or folder")
    add("--out", type=Path, required=True, metavar="CASE", help="case folder")
    add("--rig", metavar="RIG", help="rig.toml with values, or rsea-bench")
    add("--model", type=Path, metavar="XML", help="values of a MJCF or URDF file")
    add("--spring", metavar="DESIGN", help="its stiffness: al1, al2, ss, ti or a design file")
    add("--joint", metavar="J", help="of a log, or a model, with several joints")
    add("--split", nargs="?", const="", metavar="FLAG", help="at gaps, or where column FLAG is 0")
    add("--rate-hz", type=float, metavar="HZ", help="of a log without times")
    add("--load", metavar="LOAD", help="pendulum, free, locked ... (default: guessed)")
    add("--role", default="identification", choices=ROLES, help="of the recordings")
    add("--part", action="append", default=[], metavar="START:END[:ROLE]",
        help="seconds of the log that are one recording (repeatable)")  # fmt: skip
    add("--column", action="append", default=[], metavar="NAME=COLUMN:UNIT[:SIGN]",
        help="set without asking: motor_angle_rad=enc1:deg:-1, or a table as in [columns]:"
        """ 'current_A={ name = "TRQ", unit = "A", scale = 0.08, zero = 50, sign = -1 }' (wrap of"""
        " an angle that starts again); reference=COLUMN keeps one, ignore=COLUMN leaves it out",
        )  # fmt: skip
    add("--yes", action="store_true", help="accept every proposal without asking")
    add("--force", action="store_true", help="write into a folder that is not empty")
    add("--json", action="store_true", help="print the proposal as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Look, propose, ask, write, read back."""
    out = arguments.out
    rate = arguments.rate_hz
    if rate is not None and not 0.0 < rate < 1e9:
        raise DftfsError(f"--rate-hz {rate} must be above 0")
    options = ImportOptions(
        out=out, joint=arguments.joint, rate_Hz=rate, split=arguments.split, load=arguments.load,
        role=arguments.role, parts=tuple(map(window_of, arguments.part)),
        answers=tuple(arguments.column),
    )  # fmt: skip
    groups = groups_of_paths(arguments.logs, progress())
    if (out / RIG).exists() and not arguments.force:
        return _add_to_case(groups, options)
    if out.exists() and not out.is_dir():
        raise OutputError(f"{out} is a file; a folder has to be written there")
    if out.exists() and any(out.iterdir()) and not arguments.force:
        raise OutputError(f"{out} exists and is not empty; --force writes into it")
    rig, options = stated_rig(arguments.rig, options)
    options = with_rate(groups, options)
    known = known_values(arguments.model, arguments.joint, arguments.spring)
    rig = completed(rig, known)
    columns = labelled_columns(groups[0], options)
    can_ask = sys.stdin.isatty() and not arguments.yes
    proposal = decided(columns, rig, options, arguments.logs[0], _ask if can_ask else None)
    if proposal.questions and rig is not None and not (can_ask or arguments.yes):
        refuse(proposal.questions, options.notes)
    notes = (*options.notes, *proposal.notes, *unread_text(groups[0]))
    proposal = replace(proposal, notes=notes)
    listed = [r for group in groups for r in listed_recordings(group, proposal, rig, options)]
    channels = channels_of(groups[0])
    made = read_with_starts(
        out,
        listed,
        lambda own: case_text(proposal, columns, own, rig, known, options, channels),
    )
    return write_case(out, made, proposal, rig, as_json=arguments.json)


def _ask(question: str) -> str:
    return input(f"{question} [Enter: as proposed, or NAME=COLUMN:UNIT[:SIGN]] ")


def _add_to_case(groups, options: ImportOptions) -> int:
    """Further logs for a case that has its map already: listed, read back, nothing asked."""
    path = options.out / RIG
    tables = read_toml(path, RigError)
    if "columns" not in tables:
        raise DftfsError(f"{path} exists without [columns]; import into another folder")
    before = replace(options, load=options.load or common_load(tables))
    listed = [r for g in groups for r in windows_of(file_entry(g, before), options)]
    head = path.read_text(encoding="utf-8").rstrip() + "\n\n"
    text, case, problem = read_with_starts(
        options.out,
        listed,
        lambda own: head + "\n".join(map(recording_text, own)),
        guess_load=options.load is None,
    )
    if case is None:
        raise DftfsError(f"{problem}")
    write_text(path, text)
    notes = notes_of(case)
    write_preview(options.out, case, mapped_rows(tables["columns"]), notes)
    print(f"{path}: {len(listed)} more recordings with the existing map")
    print("\n".join([*(f"note: {note}" for note in notes), str(options.out / PREVIEW)]))
    return 0
