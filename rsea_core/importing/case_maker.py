"""From logs to the rig file of a case: groups of files, columns, questions, recordings."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.importing import log_columns as lc
from rsea_core.importing.answers import parse_answer, quoted
from rsea_core.importing.case_text import ListedRecording, columns_text, parts_of, rig_text
from rsea_core.importing.proposal import Proposal, answered, propose, why_no_time
from rsea_core.importing.rest import HELD_SPAN, usual_load, with_rest_as_zero
from rsea_core.importing.stated_map import stated_answers, with_overrides
from rsea_core.importing.streams.common_clock import clock_name, clock_notes
from rsea_core.importing.streams.wraps import without_wraps, wraps_of
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig, is_linear
from rsea_core.recordings.column_map import ColumnSource
from rsea_core.recordings.log_clock import unwrapped
from rsea_core.recordings.readers.log import Log
from rsea_core.recordings.readers.open_log import is_folder_of_logs, logs_of_folder, open_log
from rsea_core.recordings.units import factor_and_offset
from rsea_core.terms.known import KnownTerm

ROW_TIME = "row time [s]"


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """What the user states about a log.

    Attributes
    ----------
    out : Path
        The case folder, from which files are named.
    joint : str or None
    rate_Hz : float or None
    split : str or None
        "" at gaps, else the name of a flag's column.
    load : str or None
        None: guessed from what moves.
    role : str
    parts : tuple of (start_s, end_s, role or None)
        Windows of a log [s since its first row] that are the recordings.
    answers : tuple of str
        As `parse_answer` reads them.
    terms : tuple of KnownTerm
        Those of the rig's file.
    columns : mapping or None
        Its table `[columns]`.
    notes : tuple of str
        What the import says of these.
    """

    out: Path
    joint: str | None = None
    rate_Hz: float | None = None
    split: str | None = None
    load: str | None = None
    role: str = "identification"
    parts: tuple[tuple[float, float, str | None], ...] = ()
    answers: tuple[str, ...] = ()
    terms: tuple[KnownTerm, ...] = ()
    columns: Mapping | None = None
    notes: tuple[str, ...] = ()


def groups_of_paths(
    paths: Sequence[Path], report: Callable[[str], None] | None = None
) -> list[list[Log]]:
    """Logs that are one recording together; the files of a folder are looked at together.

    Raises
    ------
    RecordingError
        If a log cannot be read, or a folder holds none.
    """
    plain = [p for p in paths if is_folder_of_logs(p)]
    groups = [_groups_of([open_log(f, report) for f in logs_of_folder(p)]) for p in plain]
    others = [open_log(p, report) for p in paths if p not in plain]
    return [g for own in groups for g in own] + (_groups_of(others) if others else [])


def _groups_of(logs: Sequence[Log]) -> list[list[Log]]:
    """Logs with the same columns are recordings; others are files of one recording."""
    names = [sorted(n for s in log.streams for n in s.columns) for log in logs]
    return [[log] for log in logs] if all(n == names[0] for n in names) else [list(logs)]


def with_rate(groups: Sequence[Sequence[Log]], options: ImportOptions) -> ImportOptions:
    """The options with the rate that the files hold as a number, where they have no times.

    Raises
    ------
    RecordingError
        If the files hold different rates.
    """
    logs = [log for group in groups for log in group]
    rates = {log.rate[1] for log in logs if log.rate is not None}
    has_time = any(clock_name(s) for log in logs for s in log.streams)
    has_time |= any(text.startswith("time_s") for text in options.answers)
    has_time |= "time_s" in (options.columns or {})
    if options.rate_Hz is not None:
        longest = max(logs[0].streams, key=lambda s: s.rows)
        notes = clock_notes(longest, options.rate_Hz)
        notes += tuple(
            f"{log.path.name}: {log.rate[0]} is {log.rate[1]:g} rows per second, not"
            f" {options.rate_Hz:g}"
            for log in logs if log.rate is not None and log.rate[1] != options.rate_Hz
        )  # fmt: skip
        return replace(options, notes=(*options.notes, *notes))
    if has_time or not rates:
        return options
    if len(rates) > 1:
        listed = ", ".join(f"{log.path.name} {log.rate[1]:g} Hz" for log in logs if log.rate)
        raise RecordingError(f"different rates: {listed}; import them into cases of their own")
    name, rate = next(log.rate for log in logs if log.rate is not None)
    note = f"no column is a time: {name} of the file gives {rate:g} rows per second"
    return replace(options, rate_Hz=rate, notes=(*options.notes, note))


def labelled_columns(group: Sequence[Log], options: ImportOptions) -> dict[str, lc.Column]:
    """The columns of one recording by what their names tell, without the joint."""
    channels = lc.channels_of(group)
    if channels is not None:
        group = lc.by_channels(group, channels)
    clock = None if channels is None else channels["time"]
    columns, labels = lc.columns_on_one_clock(group, options.joint, clock)
    if clock is not None:
        labels[clock] = "time"
    once = {n: list(labels.values()).count(labels[n]) == 1 and labels[n] for n in columns}
    found = {labels[n] if once[n] else n: c for n, c in columns.items()}
    if options.rate_Hz is not None:
        rows = next(iter(found.values())).values.size
        clock = np.arange(rows) / options.rate_Hz
        found = {ROW_TIME: lc.Column(name="", topic=None, values=clock, unit="s"), **found}
    return found


def decided(
    columns: Mapping[str, lc.Column],
    rig: Rig | None,
    options: ImportOptions,
    path: Path,
    ask: Callable[[str], str] | None,
) -> Proposal:
    """The proposal, with every question answered, or taken as proposed.

    Parameters
    ----------
    ask : callable or None
        Returns an answer to a question, "" to take the proposal; None takes them all.

    Raises
    ------
    RecordingError
        If nothing is recognised, the log has no time, or an answer cannot be used.
    """
    raw = {n: c.values for n, c in columns.items()}
    answers = [parse_answer(text, raw, rig) for text in options.answers]
    if options.columns is not None:
        own = stated_answers(options.columns, columns, rig, options.joint)
        if options.rate_Hz is not None:
            own = [a for a in own if a.source is None or a.source.target != "time_s"]
        answers = with_overrides(own, answers)
    raw = {n: v for n, v in raw.items() if n not in {a.name for a in answers if a.is_left_out}}
    parts = {n for a in answers if a.source and a.source.formula for n in quoted(a.source.formula)}
    stated = {**dict.fromkeys(parts & set(raw)), **{a.name: a.source for a in answers if a.name}}
    if options.split in raw:
        stated.setdefault(options.split, None)
    units = lc.stated_units(columns)
    wraps = wraps_of({n: v for n, v in raw.items() if n not in stated}, units, rig)
    raw = without_wraps(raw, wraps)
    try:
        scaled = {n: _as_stated(v, stated.get(n)) for n, v in raw.items()}
        with np.errstate(over="ignore", invalid="ignore"):  # absurd cells are refused later
            proposal = propose(scaled, units, rig, stated, options.terms)
    except RecordingError as problem:
        raise RecordingError(f"{path}: {problem}") from problem
    if proposal.rate_needed:
        why = why_no_time(raw, units)
        raise RecordingError(
            f"{path}: {why}; name it, as --column time_s=COLUMN:ms, or say how fast it was logged"
            " with --rate-hz"
        )
    proposal = _with_wraps(proposal, wraps)
    kept = tuple(n for n in proposal.references if n not in parts)
    proposal = replace(proposal, references=kept)
    proposal = with_rest_as_zero(proposal, raw, rig)
    for answer in answers:
        proposal = answered(proposal, answer)
    for question in proposal.questions if ask is not None else ():
        reply = ask(question).strip()
        proposal = answered(proposal, parse_answer(reply, raw, rig)) if reply else proposal
    return proposal


def _as_stated(values: NDArray, source: ColumnSource | None) -> NDArray:
    """A column with the scale and zero that its owner states, still in its own unit."""
    if source is not None and source.wrap is not None:
        values = unwrapped(values, source.wrap)
    return values if source is None else source.sign * source.scale * (values - source.zero)


def _with_wraps(proposal: Proposal, wraps: Mapping[str, float]) -> Proposal:
    columns = tuple(
        replace(c, wrap=wraps[c.name], reason=f"{c.reason}; it starts again at {wraps[c.name]:g}")
        if c.name in wraps else c
        for c in proposal.columns
    )  # fmt: skip
    return replace(proposal, columns=columns)


def unread_text(group: Sequence[Log]) -> tuple[str, ...]:
    """A note on the columns of text of a log, which are not read."""
    names = list(dict.fromkeys(n for log in group for s in log.streams for n in s.text))
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return (f"text, not read: {', '.join(names[:8])}{more}",) if names else ()


def listed_recordings(
    group: Sequence[Log], proposal: Proposal, rig: Rig | None, options: ImportOptions
) -> list[ListedRecording]:
    """The `[[recording]]` entries of the files of one recording.

    Raises
    ------
    RecordingError
        If the column to split at is not there.
    """
    columns = labelled_columns(group, options)
    raw = {n: c.values for n, c in columns.items()}
    base = file_entry(group, options)
    base["load"] = options.load or _load(raw, proposal, rig)
    if options.split is None:
        return windows_of(base, options)
    time = proposal.column("time_s")
    time_s = time.scale * factor_and_offset(time.unit, "s", None)[0] * raw[time.name]
    if not options.split:
        parts = lc.parts_at_gaps(time_s)
    elif options.split in raw:
        parts = lc.parts_at_flag(time_s, raw[options.split])
    else:
        raise RecordingError(f"--split {options.split}: no such column; {', '.join(raw)}")
    return [ListedRecording(**base, start_s=a, end_s=b) for a, b in parts]


def file_entry(group: Sequence[Log], options: ImportOptions) -> dict:
    """File, further files and description of a recording's entry."""
    here = [_relative(log.path, options.out) for log in group]
    return {
        "file": here[0],
        "with_files": tuple(here[1:]),
        "load": options.load or "pendulum",
        "role": options.role,
        "description": f"imported from {group[0].path.name}",
    }


def windows_of(base: Mapping, options: ImportOptions) -> list[ListedRecording]:
    """One entry for each window that the user states; one for the whole log without."""
    return [
        ListedRecording(**{**base, "role": role or options.role}, start_s=start, end_s=end)
        for start, end, role in options.parts
    ] or [ListedRecording(**base)]


def _relative(path: Path, out: Path) -> str:
    return Path(os.path.relpath(path.resolve(), out.resolve())).as_posix()


def _load(raw: Mapping[str, NDArray], proposal: Proposal, rig: Rig | None) -> str:
    """How the load was held, from what moves."""
    motor, load = (proposal.column(f"{s}_angle_rad") for s in ("motor", "load"))
    if motor is None or load is None or rig is None:
        return usual_load(rig)
    spans = [
        factor_and_offset(c.unit, "rad", c.counts_per_rev, linear=is_linear(rig))[0]
        * float(np.ptp(raw[c.name] if c.wrap is None else unwrapped(raw[c.name], c.wrap)))
        for c in (motor, load)
    ]
    behind = spans[0] / (1.0 if motor.side == "load" else rig.gear_ratio or 1.0)
    return "locked" if spans[1] < HELD_SPAN * behind else usual_load(rig)


def common_load(tables: Mapping) -> str | None:
    """The load of all recordings of a rig file; None where they differ."""
    listed = tables.get("recording")
    loads = {r.get("load") for r in listed} if isinstance(listed, list) else set()
    return loads.pop() if len(loads) == 1 else None


def completed(rig: Rig | None, known: Mapping[str, tuple[float, str]]) -> Rig | None:
    """A rig with what a robot model knows besides; its own values stay."""
    if rig is None:
        return None
    return replace(rig, **{k: v for k, (v, _) in known.items() if getattr(rig, k) is None})


def case_text(
    proposal: Proposal,
    columns: Mapping[str, lc.Column],
    listed: Sequence[ListedRecording],
    rig: Rig | None,
    known: Mapping[str, tuple[float, str]],
    options: ImportOptions,
    channels: Mapping[str, str] | None = None,
) -> str:
    """The whole rig file of the case."""
    entries = [
        (c, columns[c.name].name, columns[c.name].topic) if c.name else (c, "", None)
        for c in proposal.columns
        if c.name != ROW_TIME
    ]
    kept = [columns[n] for n in proposal.references if n in columns]
    references = [f"{c.topic}: {c.name}" if c.topic else c.name for c in kept]
    text = columns_text(
        entries, references=references, rate_Hz=options.rate_Hz, channels=channels,
        proposed=rig is None,
    )  # fmt: skip
    shown = [c.target for c in proposal.columns]
    shown += ["torque_Nm"] if "spring_stiffness_Nm_per_rad" in known else []
    parts = rig.parts if rig else parts_of(shown)
    more = {"is_servo": proposal.column(POSITION_COMMAND) is not None, "terms": options.terms,
            "targets": shown}  # fmt: skip
    return rig_text(rig, options.out.name, parts, text, listed, known, **more)
