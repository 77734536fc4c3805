"""What `docs/new-user.md` says that a new user types runs and prints what the page shows."""

import re
import shlex

import pytest

from dftfs.cli.main import main
from tests.cases.places import ROOT

TEXT = (ROOT / "docs" / "new-user.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## (\d)\..*?\n(.*?)(?=^## |\Z)", TEXT, re.M | re.S))


@pytest.mark.parametrize("section", ["3", "4", "5"])
def test_the_commands_of_a_section_print_what_it_shows(section, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    text, printed, typed = SECTIONS[section], "", 0
    for kind, block in re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S):
        if kind == "python" and section == "4":
            exec(compile(block, "new-user.md", "exec"), {})
        elif kind == "python":
            (tmp_path / "my_law.py").write_text(block, encoding="utf-8")
        elif kind == "toml":
            (tmp_path / "own.toml").write_text(block, encoding="utf-8")
        elif block.startswith("dftfs "):
            for line in block.splitlines():
                assert main(shlex.split(line)[1:]) in (0, 1), line  # 1: a requirement failed
                typed += 1
            printed = capsys.readouterr().out
        else:
            missing = [line for line in block.splitlines() if line != "..." and line not in printed]
            assert not missing
    assert typed
    assert printed
