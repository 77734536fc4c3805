"""check-report runs a page's command again and names what differs; times and paths do not count."""

from pathlib import Path

import numpy as np
import pytest

from dftfs.cli.check_report import elsewhere
from dftfs.cli.main import main
from dftfs.report.page_compare import compare
from dftfs.report.provenance import record_command
from dftfs.report.result_page import write_result_page


def test_values_are_compared_by_place_and_times_and_paths_are_not():
    first = {"a": [1.0, np.arange(3.0)], "text": "K = 66\nin out/a.json", "wall_s": 3.0}
    second = {"a": [1.0 + 1e-12, np.arange(3.0)], "text": "K = 66\nin b/a.json", "wall_s": 9.0}
    found = compare(first, second, 1e-9)
    assert found.differing == ()
    assert 0.0 < found.largest < 2e-12
    second["a"][1] = np.arange(4.0)
    second["text"] = "K = 67"
    places = [place for place, *_ in compare(first, second, 1e-9).differing]
    assert places == ["a.1", "text"]


def test_an_input_that_has_changed_is_named():
    first, second = ({"facts": (("SHA-256 of r.csv", x), ("Made", x))} for x in ("1", "2"))
    assert compare(first, second, 0.0).changed_inputs == ("r.csv",)


def test_a_command_is_run_again_into_another_folder():
    words = ["simulate", "s.toml", "--out", "o", "--force", "--pdf", "--set", "a=1"]
    assert elsewhere(words, Path("x")) == [
        *("simulate", "s.toml", "--set", "a=1"), "--out", "x", "--force"]  # fmt: skip


@pytest.mark.parametrize("words", [["nonsense"], None])
def test_a_page_without_a_command_that_runs_is_one_line(words, tmp_path, capsys):
    record_command(words)
    page = write_result_page(tmp_path / "p.html", title="t", kicker="k", text="K = 66")
    record_command(None)
    assert main(["check-report", str(page)]) == 2
    messages = capsys.readouterr().err.splitlines()
    assert ("names no command" if words is None else "status 2") in messages[-1]
    assert main(["check-report", str(tmp_path / "none.html")]) == 2
