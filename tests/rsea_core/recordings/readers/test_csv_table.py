"""Strange tables: each is read as it was meant, or refused in one line that says where."""

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.open_log import open_log

T = [0.5 * k for k in range(12)]
X = [-1.5 + k * k for k in range(12)]
PLAIN = [f"{t},{x}" for t, x in zip(T, X)]


def read(folder, lines, encoding="utf-8", end="\n"):
    path = folder / "log.csv"
    path.write_bytes((end.join(lines) + end).encode(encoding))
    return open_log(path).streams


@pytest.mark.parametrize(
    "lines",
    [
        ["t,x", *PLAIN],
        ["t,x", "[s],[A]", *PLAIN],
        ["Device: A", "Serial;1,2", "Gain = 1.0, 2.0", "", "t,x", *PLAIN],
        ["t,x", *(f"{row}," for row in PLAIN)],
        ["t,x", *PLAIN[:5], "# touched", *PLAIN[5:]],
        ["t,x", *PLAIN[:5], "t,x", *PLAIN[5:]],
        ["t,x", *PLAIN, "End of the log"],
        ["t,x", *(row.replace("-", "\u2212") for row in PLAIN)],
        ["t,x", *(f"{t:.6E},{x:.6E}".replace("E", "D") for t, x in zip(T, X))],
        ["t,x", *(f"{t} s,{x} A" for t, x in zip(T, X))],
        ["t;x", *(f"{t};{1e3 * x:,.1f}".replace(",", "'") for t, x in zip(T, X))],
        ["t,x", *(f'{t},"{1e3 * x:,.1f}"' for t, x in zip(T, X))],
        ["t;x", *(f"{t};{1e3 * x:,.1f}".translate(str.maketrans(",.", ".,")) for t, x in
                  zip(T, X))],
        ['t,"x\n[A]"', *PLAIN],
    ],
)  # fmt: skip
def test_a_strange_table_gives_its_numbers(lines, tmp_path):
    columns = list(read(tmp_path, lines)[0].columns.values())
    scale = 1e3 if columns[1][1] < -100.0 else 1.0
    assert np.array_equal(columns[0], T)
    assert np.allclose(columns[1] / scale, X, rtol=1e-12)


def test_names_are_those_of_the_last_comment_before_the_rows(tmp_path):
    lines = ["# wheel one", "# created by a logger, 200 Hz", "# t  x", *(r.replace(",", "  ")
             for r in PLAIN)]  # fmt: skip
    assert list(read(tmp_path, lines)[0].columns) == ["t", "x"]


def test_text_behind_the_last_row_may_have_delimiters_and_half_a_row_is_no_text(tmp_path):
    rows = [f"{row},1" for row in PLAIN]
    assert read(tmp_path, ["t,x,y", *rows, "End, 12 rows"])[0].rows == 12
    with pytest.raises(RecordingError, match="the last row has 2 of 3 values"):
        read(tmp_path, ["t,x,y", *rows, "9.5,1"])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_is_read_with_and_without_its_mark(encoding, tmp_path):
    assert np.array_equal(read(tmp_path, ["t,x", *PLAIN], encoding)[0].columns["x"], X)


def test_a_counter_of_rows_may_have_no_name(tmp_path):
    stream = read(tmp_path, ["t,x", *(f"{k},{row}" for k, row in enumerate(PLAIN))])[0]
    assert list(stream.columns) == ["row", "t", "x"]


@pytest.mark.parametrize("mark", ["-", "---", "?", "OVER", "1.#QNAN", "#N/A", "n/a"])
def test_a_sign_for_no_reading_takes_no_other_cell_with_it(mark, tmp_path):
    rows = [f"{t},{mark if k % 4 else x},{x}" for k, (t, x) in enumerate(zip(T, X))]
    columns = read(tmp_path, ["t,y,x", *rows])[0].columns
    assert np.array_equal(columns["x"], X)
    assert np.array_equal(np.flatnonzero(np.isfinite(columns["y"])), [0, 4, 8])


@pytest.mark.parametrize(
    "form",
    [
        "2026-11-24T23:59:{}", "2026-11-24 23:59:{}+01:00", "24.11.2026 23:59:{}",
        "11/24/2026 11:59:{} PM", "23:59:{}", "59:{}", "20261124T2359{}", "24-Nov-2026 23:59:{}",
    ],
)  # fmt: skip
def test_stamps_of_every_form_are_seconds_since_the_first(form, tmp_path):
    rows = [f"{form.format(f'{t:09.6f}')},{x}" for t, x in zip(T, X)]
    stream = read(tmp_path, ["when,x", *rows])[0]
    assert np.allclose(stream.columns["when"], T, atol=1e-9)
    assert stream.units["when"] == "s"


def test_a_clock_of_the_day_goes_on_after_midnight(tmp_path):
    rows = [f"23:59:59.{k},{k}" for k in range(10)] + [f"00:00:00.{k},{k}" for k in range(10)]
    assert np.allclose(np.diff(read(tmp_path, ["t,x", *rows])[0].columns["t"]), 0.1)


def test_one_reading_a_row_with_the_name_of_its_signal_is_a_stream_for_each(tmp_path):
    rows = [f"{t},{name},{x}" for t, x in zip(T, X) for name in ("iq", "pos")]
    streams = read(tmp_path, ["time,signal,value", *rows])
    assert [s.name for s in streams] == ["iq", "pos"]
    assert np.array_equal(streams[1].columns["pos"], X)


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["t,x", *PLAIN[:5], "9,9,9", *PLAIN[5:]], "data row 6 has more than 2 values"),
        (["t,x,y,z", *(f"{r},1,2,3" for r in PLAIN)], "4 names above rows of 5 values"),
        (["<html>", "<p>1, 2</p>", "</html>"], "is XML or HTML"),
        ([",".join(["1"] * 20_000)] * 4, "has 20000 columns in a row"),
    ],
)
def test_a_table_that_cannot_be_read_says_where(lines, says, tmp_path):
    with pytest.raises(RecordingError, match=says):
        read(tmp_path, lines)
