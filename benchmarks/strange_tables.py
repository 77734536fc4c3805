"""Tables of text as strange loggers, spreadsheets and accidents leave them.

Each writer takes the columns of a bench (`benchmarks.foreign_dialects.table`) and returns the bytes
of a file. `RIGHT` have to be imported with every reading as it was, `ASKED` may put a question
first, `REFUSED` have to be refused in one line.
"""

import datetime
from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.foreign_dialects import DEG

Table = dict[str, NDArray]
Writer = Callable[[Table], bytes]
START = datetime.datetime(2026, 11, 24, 23, 59, 58)
FACTORS = {"time": ("ms", 1e3), "pwm": ("%", 100.0), "theta_m": ("deg", DEG),
           "theta_l": ("deg", DEG), "iq": ("mA", 1e3), "loadcell": ("mNm", 1e3)}  # fmt: skip
MARKS = ("-", "--", "---", "?", "*", "nan", "N/A", "#N/A", "NULL", "1.#QNAN", "OVER", "inf")


def rows_of(t: Mapping[str, Iterable], sep: str = ",", cell: Callable = "{:.12g}".format):
    """Rows of cells; text is left as it is."""
    cells = (
        (cell(x) if isinstance(x, float) else str(x) for x in np.asarray(v).tolist())
        for v in t.values()
    )
    return [sep.join(row) for row in zip(*cells, strict=True)]


def table(t: Mapping[str, Iterable], sep: str = ",", **k) -> str:
    """Header and rows."""
    return "\n".join([sep.join(t), *rows_of(t, sep, **k)]) + "\n"


def _grouped(x: float, *, german: bool) -> str:
    text = f"{x:,.6f}"
    return text.translate(str.maketrans(",.", ".,")) if german else f'"{text}"'


def _in_units(t: Table) -> Table:
    return {n: FACTORS[n][1] * v for n, v in t.items()}


def _renamed(t: Table, **names: str) -> Table:
    return {names.get(n, n): v for n, v in t.items()}


def _stamped(form: str) -> Writer:
    def write(t: Table) -> bytes:
        at = [START + datetime.timedelta(microseconds=round(1e6 * x)) for x in t["time"]]
        return table({**t, "time": [x.strftime(form) for x in at]}).encode()

    return write


def _marked(mark: str) -> Writer:
    def write(t: Table) -> bytes:
        cells = [f"{x:.12g}" if k % 4 == 0 else mark for k, x in enumerate(t["loadcell"])]
        return table({**t, "loadcell": cells}).encode()

    return write


def _wrapped(label: str, scale: float, turn: float, zero: float) -> Writer:
    def write(t: Table) -> bytes:
        values = (scale * t["theta_m"] + zero) % turn - zero
        return table({label if n == "theta_m" else n: values if n == "theta_m" else v
                      for n, v in t.items()}).encode()  # fmt: skip

    return write


def _changed(change: Callable[[str], str], encoding: str = "utf-8", **k) -> Writer:
    return lambda t: change(table(t, **k)).encode(encoding)


def _lines(change: Callable[[list[str]], list[str]]) -> Writer:
    return _changed(lambda text: "\n".join(change(text.splitlines())) + "\n")


def _comma(x: float) -> str:
    return f"{x:.12g}".replace(".", ",")


def _german(t: Table) -> bytes:
    named = {f"{n} [{FACTORS[n][0]}]": v for n, v in _in_units(t).items()}
    return table(named, ";", cell=lambda x: _grouped(x, german=True)).encode()


def _english(t: Table) -> bytes:
    named = {f"{n} [{FACTORS[n][0]}]": v for n, v in _in_units(t).items()}
    return table(named, cell=lambda x: _grouped(x, german=False)).encode()


def _units_below(t: Table) -> bytes:
    units = ",".join(f"[{FACTORS[n][0]}]" for n in t)
    return "\n".join([",".join(t), units, *rows_of(_in_units(t))]).encode()


def _one_signal_a_row(t: Table) -> bytes:
    rows = ["time,signal,value"]
    for row in zip(*(v.tolist() for v in t.values())):
        rows += [f"{row[0]:.6f},{n},{x:.12g}" for n, x in zip([*t][1:], row[1:])]
    return "\n".join(rows).encode()


PREAMBLE = "\n".join(["Device: A 3000", "Serial;12,34", "Gain = 1.0, 2.0", ""] * 4)
RIGHT: dict[str, Writer] = {
    "semicolons, decimal comma": _changed(str, sep=";", cell=_comma),
    "tabs, decimal comma, UTF-16": _changed(str, "utf-16", sep="\t", cell=_comma),
    "UTF-16 without its mark": _changed(str, "utf-16-le"),
    "blanks of any number": _changed(str, sep="   "),
    "thousands with points": _german,
    "thousands with commas, quoted": _english,
    "units in brackets below": _units_below,
    "sixteen lines before the header": _changed(lambda s: f"{PREAMBLE}\n{s}"),
    "header behind a comment sign": _changed(lambda s: f"# by hand\n# {s}"),
    "comments between rows": _lines(lambda x: [*x[:900], "# touched", *x[900:]]),
    "header again in the middle": _lines(lambda x: [*x[:900], x[0], *x[900:]]),
    "text behind the last row": _changed(lambda s: f"{s}End of log, 3000 rows\n"),
    "a delimiter at the end of rows": _lines(lambda x: [x[0], *(f"{r}," for r in x[1:])]),
    "a counter without a name": _lines(
        lambda x: [x[0], *(f"{k},{r}" for k, r in enumerate(x[1:]))]
    ),
    "an empty column": lambda t: table({**t, "spare": [""] * t["time"].size}).encode(),
    "line ends of old computers": _changed(lambda s: s.replace("\n", "\r")),
    "blank lines": _changed(lambda s: s.replace("\n", "\n\n")),
    "a name over two lines": _changed(lambda s: s.replace("theta_m", '"theta_m\n[rad]"', 1)),
    "names with quotes and delimiters": lambda t: table(
        _renamed(t, theta_m='"theta_m, ""fast"""', iq="iq \\ {x}")
    ).encode(),
    "the minus of printed text": _changed(lambda s: s.replace("-", "\u2212")),
    "exponents of Fortran": _changed(str, cell=lambda x: f"{x:.12E}".replace("E", "D")),
    "units in cells": lambda t: table({**t, "iq": [f"{x:.12g} A" for x in t["iq"]]}).encode(),
    "degrees in cp1252": lambda t: table(
        {**_renamed(t, theta_m="theta_m [°]"), "theta_m [°]": DEG * t["theta_m"]}
    ).encode("cp1252"),
    "German names": lambda t: table(
        _renamed(t, time="Zeit", pwm="Tastverhältnis", theta_m="Winkel Antrieb",
                 theta_l="Winkel Abtrieb", iq="Strom", loadcell="Drehmoment"), ";", cell=_comma
    ).encode(),
    "nanoseconds of the epoch": lambda t: table(
        {**t, "time": [1_764_000_000_000_000_000 + round(1e9 * x) for x in t["time"]]}
    ).encode(),
    "one signal a row": _one_signal_a_row,
    "stamps, ISO": _stamped("%Y-%m-%dT%H:%M:%S.%f+01:00"),
    "stamps, German": _stamped("%d.%m.%Y %H:%M:%S.%f"),
    "stamps, American": _stamped("%m/%d/%Y %I:%M:%S.%f %p"),
    "clock of the day over midnight": _stamped("%H:%M:%S.%f"),
    "minutes and seconds": _stamped("%M:%S.%f"),
    "degrees that wrap at 360": _wrapped("theta_m [deg]", DEG, 360.0, 0.0),
    "degrees that wrap at 180": _wrapped("theta_m", DEG, 360.0, 180.0),
    "radians that wrap": _wrapped("theta_m", 1.0, 2.0 * np.pi, np.pi),
    **{f"{mark!r} for no reading": _marked(mark) for mark in MARKS},
}  # fmt: skip
ASKED: dict[str, Writer] = {
    "no header": _lines(lambda x: x[1:]),
    "names that say nothing": _changed(lambda s: s.replace(s.split("\n")[0], "a,b,c,d,e,f", 1)),
    "one name for all": _changed(lambda s: s.replace(s.split("\n")[0], "x,x,x,x,x,x", 1)),
    "a name twice": lambda t: table({**t, "x": np.sin(t["time"])}).replace(",x", ",iq", 1).encode(),
    "milliseconds stated, seconds logged": lambda t: table(_renamed(t, time="time [ms]")).encode(),
}
REFUSED: dict[str, Writer] = {
    "no time": lambda t: table({n: v for n, v in t.items() if n != "time"}).encode(),
    "a counter, no time": lambda t: table({**t, "time": np.arange(t["time"].size)})
    .replace("time", "n", 1).encode(),
    "time that stands still": lambda t: table({**t, "time": 0.0 * t["time"]}).encode(),
    "time that falls": lambda t: table({**t, "time": t["time"][::-1]}).encode(),
    "one row out of order": _lines(lambda x: [*x[:900], x[500], *x[900:]]),
    "two runs, each from zero": _lines(lambda x: [*x, *x[1:]]),
    "half a row at the end": _changed(lambda s: s[: 3 * len(s) // 5].rsplit(",", 1)[0]),
    "a row too long": _lines(lambda x: [*x[:900], f"{x[900]},1", *x[901:]]),
    "a row too short": _lines(lambda x: [*x[:900], x[900].rsplit(",", 2)[0], *x[901:]]),
    "a word in one cell": _changed(lambda s: s.replace("\n0.5,", "\n0.5,ERR,", 1)),
    "a million columns": lambda t: "\n".join(
        f"{k},{','.join(['1'] * 1_000_000)}" for k in range(4)
    ).encode(),
    "empty": lambda t: b"",
    "header only": lambda t: ",".join(t).encode(),
    "a letter": lambda t: b"Dear colleague,\nthe log is elsewhere.\nSorry\n" * 30,
    "a page of the web": lambda t: b"<html><body>1,2</body></html>\n" * 9,
    "JSON": lambda t: b'{"t": [1, 2, 3], "x": [1, 2, 3]}',
    "a picture": lambda t: b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9,
}  # fmt: skip
