"""The preview of an imported case: a plot for each column, with what is worth knowing of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from dftfs.report.page_data import write_page
from dftfs.report.provenance import case_provenance
from rsea_core.importing.doctor.slip_catalogue import case_slips
from rsea_core.recordings.case import Case
from rsea_core.recordings.column_map import column_map
from rsea_core.recordings.finding import grouped_sentences
from rsea_core.recordings.quality_checks import data_warnings
from rsea_core.recordings.recording import COLUMNS

PREVIEW = "preview.html"
HEADER = ("reading", "column", "unit", "sure", "why")


def notes_of(case: Case) -> list[str]:
    """What is worth knowing of a case, a sentence each."""
    found = (*case.notes(), *data_warnings(case), *case_slips(case))
    return list(dict.fromkeys(grouped_sentences(found)))


def write_preview(out: Path, case: Case, rows: Sequence[Sequence[str]], notes: list[str]) -> None:
    """A plot for each column of each recording."""
    plots = [(r.file, r.time_s, {n: r[n] for n in r.columns if n != "time_s"} | _raw(r))
             for r in case.recordings]  # fmt: skip
    shown = {"head": HEADER, "rows": rows, "notes": notes, "facts": case_provenance(case)}
    title = f"{out.name}: imported"
    write_page(out / PREVIEW, "recordings", title=title, recordings=plots, **shown)


def mapped_rows(table: Mapping) -> list[tuple[str, ...]]:
    """The columns of a map, as a table shows them."""
    sources = column_map(table, COLUMNS, "[columns]").sources
    return [
        (s.target, s.formula or s.name, f"{'-' if s.sign < 0 else ''}{s.unit or ''}", "", "the map")
        for s in sources
    ]


def _raw(recording) -> dict:
    """References, as logged, where they have as many rows as the recording."""
    return {
        f"{name} (reference)": values
        for name, values in recording.references.items()
        if values.size == recording.rows
    }
