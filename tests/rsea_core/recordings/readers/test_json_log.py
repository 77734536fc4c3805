"""JSON logs in their three forms give the same columns; what is none is refused with its line."""

import json

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.open_log import open_log

ROWS = [{"t": 0.5 * k, "joint": {"pos": k * k, "ok": True}, "text": "a"} for k in range(6)]


def written(folder, text, name="log.jsonl"):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(json.dumps(row) for row in ROWS) + "\n",
        json.dumps(ROWS, indent=1),
        json.dumps({"t": [r["t"] for r in ROWS], "joint.pos": [r["joint"]["pos"] for r in ROWS],
                    "joint.ok": [True] * 6, "note": ["a"] * 6, "rate": 2.0}),
    ],
    ids=["lines", "list", "columns"],
)  # fmt: skip
def test_rows_lists_and_columns_are_one_log(text, tmp_path):
    (stream,) = open_log(written(tmp_path, text)).streams
    assert set(stream.columns) == {"t", "joint.pos", "joint.ok"}
    assert np.array_equal(stream.columns["joint.pos"], [k * k for k in range(6)])


def test_a_number_that_a_row_lacks_is_missing_and_not_zero(tmp_path):
    rows = [dict(row) for row in ROWS]
    del rows[2]["t"]
    (stream,) = open_log(written(tmp_path, "\n".join(map(json.dumps, rows)))).streams
    assert np.flatnonzero(np.isnan(stream.columns["t"])).tolist() == [2]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"t": 0}\n{"t": 1\n{"t": 2}\n', "line 2 is not JSON"),
        ('{"version": 3}', "without rows of numbers"),
        ('[{"a": "x"}, {"a": "y"}, {"a": "z"}]', "without rows of numbers"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(text, says, tmp_path):
    with pytest.raises(RecordingError, match=says) as refused:
        open_log(written(tmp_path, text))
    assert "\n" not in str(refused.value)
