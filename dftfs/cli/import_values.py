"""What the user states to `dftfs import`: windows, known parts; its questions."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from dftfs.errors import DftfsError
from rsea_core.errors import RigError
from rsea_core.files.toml_tables import read_toml
from rsea_core.importing.case_maker import ImportOptions
from rsea_core.importing.robot_model import rig_values
from rsea_core.importing.stated_map import is_proposed
from rsea_core.machine.rig import Rig
from rsea_core.recordings.column_map import column_map
from rsea_core.recordings.recording import COLUMNS, ROLES
from rsea_core.terms.known import known_terms

MOST_ASKED = 8
PROPOSAL = (
    "[columns] of {} was proposed without values of the machine and is decided anew; delete its"
    " line proposed = true if it is right"
)


def refuse(questions: Sequence[str], notes: Sequence[str] = ()) -> NoReturn:
    """Print notes and the first questions, a line each, and end: nobody is there to answer them.

    Raises
    ------
    DftfsError
        With their number.
    """
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    for question in questions[:MOST_ASKED]:
        print(f"question: {question}", file=sys.stderr)
    if len(questions) > MOST_ASKED:
        more = len(questions) - MOST_ASKED
        print(f"question: and {more} more (--json --yes lists them)", file=sys.stderr)
    raise DftfsError(
        f"{len(questions)} question{'s' if len(questions) > 1 else ''}: answer each with --column,"
        " or accept the proposals with --yes; nothing was written"
    )


def window_of(text: str) -> tuple[float, float, str | None]:
    """START:END[:ROLE] of an option: seconds of a log that are one recording."""
    start, _, rest = text.partition(":")
    end, _, role = rest.partition(":")
    try:
        window = float(start), float(end)
    except ValueError:
        window = (0.0, 0.0)
    if not window[0] < window[1] or role not in ("", *ROLES):
        raise DftfsError(f"--part {text}: write START:END or START:END:ROLE, END above START")
    return *window, role or None


def known_values(
    model: Path | None, joint: str | None, spring: str | None
) -> dict[str, tuple[float, str]]:
    """Values of `[rig]` from a robot model and a spring design, each with where it comes from."""
    known = {} if model is None else rig_values(model, joint)
    if spring is not None:
        from dftfs.analysis.study.closed_form_design import closed_form_design
        from dftfs.design import load_design

        stiffness = closed_form_design(load_design(spring)).stiffness_Nm_per_rad
        known |= {"spring_stiffness_Nm_per_rad": (stiffness, f"design {spring}, rod model")}
    return known


def stated_rig(given: str | None, options: ImportOptions) -> tuple[Rig | None, ImportOptions]:
    """The rig of a preset's name or a file, and the options with what the file states beside it."""
    if given is None:
        return None, options
    if not given.endswith(".toml"):
        return Rig.preset(given), options
    rig, tables = Rig.from_toml(given), read_toml(given, RigError)
    options = replace(options, terms=known_terms(tables, rig, given))
    columns = tables.get("columns")
    if not isinstance(columns, Mapping):
        return rig, options
    if is_proposed(columns):
        return rig, replace(options, notes=(PROPOSAL.format(given),))
    stated = column_map(columns, COLUMNS, f"{given}: [columns]")
    return rig, replace(
        options, columns=columns, joint=options.joint or stated.joint,
        rate_Hz=options.rate_Hz or stated.rate_Hz,
    )  # fmt: skip
