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


def answered(monkeypatch, *answers):
    """Standard input that answers the questions in turn, then ends."""
    left = list(answers)

    def say(prompt):
        if not left:
            raise EOFError
        return left.pop(0)

    monkeypatch.setattr("builtins.input", say)


def test_six_answers_make_a_task(tmp_path, monkeypatch, capsys):
    path = tmp_path / "mine.toml"
    answered(monkeypatch, "40", "10", "110", "", "17-4PH", "water-jet")
    assert main(["new", "task", str(path), "--ask"]) == 0
    task = load_task(str(path), {})
    assert (task.stiffness_Nm_per_rad, task.envelope_m) == (40.0, pytest.approx(0.110))
    assert (task.process.name, task.min_bore_m) == ("water-jet", pytest.approx(0.018))
    for answers, message in (
        (("40", "10"), "six answers are needed; the input ended at: largest outside diameter"),
        (("40", "10", "wide", "", "", ""), "envelope_mm = 'wide' must be a number"),
        (("40", "10", "110", "", "", "wire"), "did you mean wire-edm"),
    ):
        other = tmp_path / "other.toml"
        answered(monkeypatch, *answers)
        capsys.readouterr()
        assert main(["new", "task", str(other), "--ask"]) == 2
        assert message in capsys.readouterr().err
        assert not other.exists()
