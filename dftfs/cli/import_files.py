"""What `dftfs import` writes: the case, read back before it appears, and its preview."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from dftfs.cli.common import emit, table
from dftfs.cli.import_preview import HEADER, PREVIEW, notes_of, write_preview
from dftfs.files import OutputError, write_text
from rsea_core.errors import RecordingError, RigError, RseaError
from rsea_core.importing.case_text import NEEDED, ListedRecording, missing_values
from rsea_core.importing.proposal import Proposal
from rsea_core.importing.rest import load_of, starts_in_motion
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, read_case

RIG = "rig.toml"


def read_back(out: Path, text: str) -> tuple[Case | None, str | None]:
    """The case that a rig file makes; None with the reason where [rig] is not complete yet.

    Raises
    ------
    RecordingError
        If a recording cannot be read through the map.
    """
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".unfinished-") as made:
            write_text(Path(made) / RIG, text)
            try:
                return read_case(made), None
            except RigError as found:
                return None, str(found).replace(str(Path(made)), str(out))
            except RseaError as found:
                raise RecordingError(str(found).replace(str(Path(made)), str(out))) from found
    except OSError as error:
        raise OutputError(f"output folder {out}: cannot be written: {error.strerror}") from None


def read_with_starts(
    out: Path,
    listed: Sequence[ListedRecording],
    text_of: Callable[[Sequence], str],
    *,
    guess_load: bool = False,
) -> tuple[str, Case | None, str | None]:
    """The rig file in which recordings that begin in motion say so; else as `read_back`.

    Parameters
    ----------
    listed : sequence of ListedRecording
        The last recordings of the case.
    text_of : callable
        The rig file of such a sequence.
    guess_load : bool
        A load that hardly moves was held, and one that moves was not.
    """
    text = text_of(listed)
    case, problem = read_back(out, text)
    if case is None:
        return text, case, problem
    others = case.recordings[: -len(listed)]
    own = case.recordings[-len(listed) :]
    loads = [load_of(case.rig, r) for r in own]
    if guess_load and loads != [r.load.kind for r in own]:
        listed = [replace(x, load=load) for x, load in zip(listed, loads)]
        return read_with_starts(out, listed, text_of)
    rest = [r.initial_rest and not starts_in_motion(case.rig, r) for r in own]
    text = text_of([replace(x, initial_rest=at_rest) for x, at_rest in zip(listed, rest)])
    own = tuple(replace(r, initial_rest=at_rest) for r, at_rest in zip(own, rest))
    return text, replace(case, recordings=(*others, *own)), None


def write_case(
    out: Path,
    made: tuple[str, Case | None, str | None],
    proposal: Proposal,
    rig: Rig | None,
    *,
    as_json: bool,
) -> int:
    """Write rig file and preview; print the columns, what is taken, noted and missing."""
    text, case, problem = made
    notes = [] if case is None else notes_of(case)
    rows = [
        (c.target, c.name, f"{'-' if c.sign < 0 else ''}{c.unit}", f"{c.confidence:.0%}", c.reason)
        for c in proposal.columns
    ]
    out.mkdir(exist_ok=True)
    if case is not None:
        write_preview(out, case, rows, notes)
    write_text(out / RIG, text)
    loads = None if case is None else {r.load.kind for r in case.recordings}
    missing = missing_values(rig, [c.target for c in proposal.columns], loads)
    state = "taken without asking" if rig is not None else "not decided yet"
    lines = [table(HEADER, rows), *(f"{state}: {q}" for q in proposal.questions)]
    lines += [f"reference, not fitted: {', '.join(proposal.references or ('none',))}"]
    notes = [*proposal.notes, *notes]
    lines += [f"note: {note}" for note in notes]
    listed = "; ".join(f"{key} ({NEEDED[key]})" for key in missing)
    lines += [f"missing in [rig]: {listed}"] if missing else []
    lines += [f"not complete yet: {problem}"] if problem else []
    lines += [str(out / RIG), *([str(out / PREVIEW)] if case is not None else [])]
    value = {"case": out, "columns": rows, "questions": proposal.questions, "notes": notes,
             "missing": missing}  # fmt: skip
    emit(value, "\n".join(lines), as_json=as_json)
    return 0
