"""The page of a command whose result is lines and tables: what it printed, with its figures.

The text is the command's own, so that page and terminal cannot differ; its tables are those that
`dftfs.cli.common.table` sets, known by their second line.
"""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.provenance import provenance
from dftfs.report.study.tables import Table
from dftfs.report.style import ReportFigure

_RULE = re.compile(r"-+(  -+)*\s*")
_NUMBER = re.compile(r"[-+]?\d[\d.,]*(e[-+]\d+)?( ?%)?|-|")
_AT_THE_END = re.compile(r"\S+\.\w{1,7}|\d+(\.\d+)? s in all")  # names of files, time


def write_result_page(
    path: Path,
    *,
    title: str,
    kicker: str,
    text: str,
    pictures: Iterable[Path] = (),
    inputs: Iterable[Path] = (),
) -> Path:
    """Write the page, and its data beside it.

    Parameters
    ----------
    pictures : iterable of Path
        PNG files.
    inputs : iterable of Path
        Those of them that are files are stated with their hashes.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    drawn = [(picture.stem, np.frombuffer(picture.read_bytes(), np.uint8)) for picture in pictures]
    facts = provenance(inputs)
    values = {"title": title, "kicker": kicker, "text": text, "pictures": drawn, "facts": facts}
    return write_page(path, "result", **values)


def result_page(
    title: str,
    kicker: str,
    text: str,
    pictures: Sequence[tuple[str, NDArray]],
    facts: Sequence[tuple[str, str]],
) -> str:
    """The page as HTML text, complete in itself."""
    lead, tables = parts(text)
    figures = [
        ReportFigure(name=name, alt=f"{title}: the figure {name}.", caption="", png=c.tobytes())
        for name, c in pictures
    ]
    return render_page(
        page_environment(),
        "plain.html",
        figures,
        title=title,
        kicker=kicker,
        lead=lead[:1],
        tables=tables or [Table(caption="", head=(), rows=())],
        first_figures=figures,
        notes=lead[1:] or None,
        figures=(),
        facts=facts,
    )


def parts(text: str) -> tuple[list[str], list[Table]]:
    """Lines and tables of a command's text; a line that introduces a table is its caption."""
    lines, tables, row = text.splitlines(), [], 0
    kept: list[str] = []
    while row < len(lines):
        if row + 1 < len(lines) and _RULE.fullmatch(lines[row + 1]):
            ends = row + 2
            while (
                ends < len(lines) and lines[ends].strip() and _is_row(lines[ends], lines[row + 1])
            ):
                ends += 1
            caption = kept.pop() if len(kept) > 1 else ""
            tables.append(_table(lines[row:ends], caption))
            row = ends
        else:
            kept += [lines[row]] if lines[row].strip() else []
            row += 1
    return [line for line in kept if not _AT_THE_END.fullmatch(line.strip())], tables


def _is_row(line: str, rule: str) -> bool:
    """Whether a line has blanks where the columns of a table part."""
    gaps = [m.start() for m in re.finditer("  ", rule.rstrip())]
    return len(line) > (gaps or [0])[0] and all(not line[g : g + 2].strip() for g in gaps)


def _table(lines: Sequence[str], caption: str) -> Table:
    spans = [(m.start(), m.end()) for m in re.finditer("-+", lines[1])]
    last = len(spans) - 1
    cells = [
        tuple(line[a : None if k == last else b].strip() for k, (a, b) in enumerate(spans))
        for line in (lines[0], *lines[2:])
    ]
    columns = range(len(spans))
    numeric = tuple(k for k in columns if all(_NUMBER.fullmatch(row[k]) for row in cells[1:]))
    return Table(caption=caption, head=cells[0], rows=tuple(cells[1:]), numeric=numeric)
