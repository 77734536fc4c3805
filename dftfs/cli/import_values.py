"""What the user states to `dftfs import`: windows, known parts; its questions."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from dftfs.errors import DftfsError
from rsea_core.errors import RigError
from rsea_core.files.toml_tables import read_toml
from rsea_core.importing.robot_model import rig_values
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import ROLES
from rsea_core.terms.known import KnownTerm, known_terms

MOST_ASKED = 8


def refuse(questions: Sequence[str]) -> NoReturn:
    """Print the first questions, a line each, and end: nobody is there to answer them.

    Raises
    ------
    DftfsError
        With their number.
    """
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


def stated_rig(given: str | None) -> tuple[Rig | None, tuple[KnownTerm, ...]]:
    """The rig of a preset's name or a file, and the physics that the file states beside it."""
    if given is None:
        return None, ()
    if not given.endswith(".toml"):
        return Rig.preset(given), ()
    rig = Rig.from_toml(given)
    return rig, known_terms(read_toml(given, RigError), rig, given)
