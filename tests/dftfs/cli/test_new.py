"""What `dftfs new` writes is read by the reader of its kind, under the file's own name."""

import pytest

from dftfs.analysis.sizing.task import load_task
from dftfs.cli.main import main
from dftfs.cli.new import STARTS
from dftfs.design import load_design
from rsea_core.machine.rig import Rig
from rsea_core.scenarios.comparison_file import read_comparison
from rsea_core.scenarios.scenario import Scenario

READERS = {
    "design": lambda path: load_design(str(path)),
    "rig": Rig.from_toml,
    "scenario": Scenario.from_toml,
    "comparison": read_comparison,
    "task": lambda path: load_task(str(path), {}),
}


@pytest.mark.parametrize("kind", STARTS)
def test_a_new_file_is_commented_named_and_read_by_its_command(kind, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert main(["new", kind, str(path)]) == 0
    assert READERS[kind](path).name == "mine"
    assert sum(line.startswith("#") for line in path.read_text().splitlines()) >= 2
    assert main(["new", kind, str(path)]) == 2
    assert "exists; use --force" in capsys.readouterr().err
