"""A diagnosis writes all its files or none, and leaves none of an older diagnosis."""

import argparse
from types import SimpleNamespace

import numpy as np
import pytest

import dftfs.cli.diagnose as command
import dftfs.cli.main as program
from dftfs.cli.diagnose import write_files
from dftfs.cli.output import prepared
from dftfs.report.page_data import SUFFIX
from rsea_core.errors import RseaError
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.result.diagnosis import SOMETIMES, Diagnosis
from rsea_core.identify.spring_bench import next_loop


def test_the_names_of_the_files_are_those_that_their_makers_use():
    assert next_loop.FILE in SOMETIMES
    assert command.REPORT[-1] == f"report{SUFFIX}"


def interrupted():
    raise KeyboardInterrupt


def result(report_data, **more) -> Diagnosis:
    return Diagnosis(
        document={"verdict": "no-mismatch", "next_experiment": None},
        model=SimpleNamespace(to_toml=lambda: "[rig]\n"),
        conclusion=None,
        report_data=report_data,
        **more,
    )


def test_an_interrupted_report_leaves_the_older_files_and_nothing_else(tmp_path):
    (tmp_path / "model.toml").write_text("older")
    with pytest.raises(KeyboardInterrupt):
        write_files(result(interrupted), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["model.toml"]
    assert (tmp_path / "model.toml").read_text() == "older"


def test_files_of_an_older_diagnosis_that_this_one_has_not_are_taken_away(tmp_path, monkeypatch):
    monkeypatch.setattr("dftfs.report.diagnosis.page.page_from", lambda shown: shown)
    drawn = "dftfs.report.diagnosis.render.write_diagnosis_report"
    monkeypatch.setattr(drawn, lambda page, path: path.touch())
    (tmp_path / "remainder.csv").write_text("older")
    paths = write_files(result(dict, next_columns={"time_s": np.arange(3.0)}), tmp_path)
    names = {"diagnosis.json", "model.toml", "report.html", "next.csv"}
    assert set(paths) == names == {p.name for p in tmp_path.iterdir()}


def test_a_folder_where_a_file_has_to_be_is_one_line(tmp_path):
    (tmp_path / "out.csv").mkdir()
    with pytest.raises(RseaError, match=r"out\.csv is a folder"):
        write_columns(tmp_path / "out.csv", {"time_s": np.arange(3.0)})


@pytest.mark.parametrize("behind", [KeyboardInterrupt, ValueError])
def test_an_interrupt_inside_a_compiled_loop_is_an_interrupt(monkeypatch, behind, capsys):
    def run(arguments):
        try:
            raise behind
        except BaseException as first:
            raise SystemError("returned a result with an exception set") from first

    given_arguments = argparse.Namespace(run=run)
    known = argparse.Namespace(parse_known_args=lambda given: (given_arguments, []))
    monkeypatch.setattr(program, "parser", lambda given_arguments: known)
    if behind is ValueError:
        assert program.main(["diagnose"]) == 70
        assert "internal error, please report it: SystemError" in capsys.readouterr().err
    else:
        assert program.main(["diagnose"]) == 130
        assert "interrupted; nothing half-written" in capsys.readouterr().err


@pytest.mark.parametrize("there", [False, True])
def test_a_command_that_is_refused_during_its_work_removes_the_folder_that_it_made(
    tmp_path, monkeypatch, there
):
    folder = tmp_path / "found"
    if there:
        folder.mkdir()

    def run(arguments):
        assert prepared(arguments, folder).is_dir()
        raise RseaError("rec2.csv: too short")

    known = argparse.Namespace(parse_known_args=lambda given: (argparse.Namespace(run=run), []))
    monkeypatch.setattr(program, "parser", lambda given: known)
    assert program.main(["diagnose"]) == 2
    assert folder.exists() == there
