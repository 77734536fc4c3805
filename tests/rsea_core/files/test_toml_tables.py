"""A TOML file is bounded before a reader sees it: whatever is in it, one line and no traceback."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsea_core.files.toml_tables import (
    DEEPEST,
    file_name,
    number,
    parse_toml,
    read_toml,
    toml_string,
)


class RefusedError(Exception):
    pass


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = " + "9" * 5000, "a value cannot be used"),
        ("x = 1" + "0" * 400, "x: a whole number of 401 digits"),
        ("x = " + "[" * 3000, "nested more than"),
        ("x = " + "[" * 40 + "]" * 40, "nested more than"),
        (".".join("a" * 3000) + " = 1", "nested more than"),
        ("[" + ".".join("a" * (DEEPEST + 2)) + "]", "nested more than"),
        ('x = "a\\u0000b"', "x.* NUL"),
        ("x = 2020-99-99", "not TOML|cannot be used"),
        ("x =", "is not TOML"),
    ],
)
def test_what_no_reader_could_use_is_refused_in_one_line(text, message):
    with pytest.raises(RefusedError, match=message) as refused:
        parse_toml(text, "f.toml", RefusedError)
    assert str(refused.value).startswith("f.toml")
    assert "\n" not in str(refused.value)


def test_devices_pipes_folders_and_large_files_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    large = tmp_path / "large"
    with large.open("wb") as file:
        file.truncate(10_000_000)
    for path, message in (
        ("/dev/zero", "device or a pipe"),
        (tmp_path / "pipe", "device or a pipe"),
        (tmp_path, "is a folder"),
        (large, "10.0 MB"),
        (tmp_path / "none", "No such file"),
        (tmp_path / ("n" * 300), "too long"),
    ):
        with pytest.raises(RefusedError, match=message):
            read_toml(path, RefusedError)


@pytest.mark.parametrize("name", ["../a", "a/b", "a\\b", "", ".a", "a\n", "n" * 101, 'a"b', 5, []])
def test_a_name_is_never_a_path(name):
    with pytest.raises(RefusedError, match="name"):
        file_name(name, "name", RefusedError)


@pytest.mark.parametrize("value", [True, "1", [], {}, None, float("nan"), 10**400])
def test_a_number_is_a_finite_number(value):
    with pytest.raises(RefusedError, match="x"):
        number(value, "x", RefusedError)


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
def test_any_text_is_written_so_that_it_reads_back(text):
    assert parse_toml(f"x = {toml_string(text)}", "f", RefusedError) == {"x": text}
