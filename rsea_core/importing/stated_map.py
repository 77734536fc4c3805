"""A table `[columns]` of the rig file that an import is given: what it says of a log's columns."""

from collections.abc import Mapping

from rsea_core.errors import RecordingError
from rsea_core.files.toml_tables import nearest
from rsea_core.importing.answers import Answer
from rsea_core.importing.log_columns import Column
from rsea_core.machine.rig import Rig
from rsea_core.recordings.column_map import PROPOSED, column_map, for_rig
from rsea_core.recordings.recording import COLUMNS

WHERE = "[columns] of the rig file"


def is_proposed(table: Mapping) -> bool:
    """Whether a first import, which knew no values of the machine, wrote the table."""
    return table.get(PROPOSED) is True


def stated_answers(
    table: Mapping, columns: Mapping[str, Column], rig: Rig | None, joint: str | None
) -> list[Answer]:
    """What a map says of the columns of a log, as if each were an answer.

    Parameters
    ----------
    columns : mapping of label to Column
        Of the log.
    joint : str or None
        What `{joint}` in names stands for.

    Raises
    ------
    RecordingError
        If the table cannot be used or names a column for a reading that is not there.
    """
    stated = column_map(table, COLUMNS, WHERE)
    stated = stated if rig is None else for_rig(stated, rig)

    def label(name: str, topic: str | None) -> str | None:
        own = name.replace("{joint}", joint or stated.joint or "{joint}")
        known = (k for k, c in columns.items() if c.name == own and topic in (None, c.topic))
        return own if own in columns else next(known, None)

    found = []
    for source in stated.sources:
        name = "" if source.formula is not None else label(source.name, source.topic)
        if name is None:
            near = nearest(source.name, [c.name for c in columns.values()])
            raise RecordingError(f"{WHERE}: {source.target}: no column {source.name!r}; {near}")
        found.append(Answer(source=source, name=name))
    for names, is_left_out in ((stated.references, False), (stated.ignored, True)):
        for given in names:
            topic, _, bare = given.rpartition(": ")
            name = label(given, None) or label(bare, topic or None)
            if name is not None:
                found.append(Answer(source=None, name=name, is_left_out=is_left_out))
    return found


def with_overrides(stated: list[Answer], given: list[Answer]) -> list[Answer]:
    """The statements of a map, but for what those of the command line say otherwise; then these."""
    names = {a.name for a in given if a.name}
    targets = {a.source.target for a in given if a.source is not None}
    kept = [
        a for a in stated
        if a.name not in names and (a.source is None or a.source.target not in targets)
    ]  # fmt: skip
    return [*kept, *given]
