"""`dftfs prove` makes cases by the contract, runs tools blind, resumes and scores them."""

import json
import os
import signal
import subprocess
import sys
import time
import tomllib

import numpy as np
import pytest

from dftfs.cli.main import main
from dftfs.proof.cases import make_case
from dftfs.proof.labels import digest
from dftfs.proof.making import composition
from dftfs.proof.scoring import read_columns
from tests.cases.places import ROOT

# A tool that names what it is told to, and predicts by holding the first row.
FAKE = """
import json, os, pathlib, sys, time
case, out = map(pathlib.Path, sys.argv[1:3])
assert sorted(p.name for p in case.parent.iterdir()) == ["case", "out"], "sees more than the case"
assert not any("label" in p.name or "hidden" in p.name for p in case.rglob("*"))
time.sleep(float(os.environ.get("SLOW", "0")))
effect = {"name": "gear-friction", "subsystem": "gear", "confidence": 0.9,
          "parameters": {"coulomb_Nm": {"value": 0.01, "std": 0.01}}}
document = {"schema": 1, "verdict": "missing-physics", "location": {"subsystem": "gear"},
            "effects": [effect]}
(out / "diagnosis.json").write_text(json.dumps(document))
"""
FAKE_PREDICT = """
import pathlib, sys
case, out = map(pathlib.Path, sys.argv[1:3])
rows = (case / "test" / "input.csv").read_text().splitlines()[1:]
head = "time_s,motor_angle_rad,load_angle_rad,torque_Nm"
lines = [r.split(",")[0] + ",0.0,0.0,0.0" for r in rows]
(out / "prediction.csv").write_text("\\n".join([head, *lines]))
"""


@pytest.fixture(scope="module")
def sealed(tmp_path_factory):
    """Two cases: gear friction and a null."""
    folder = tmp_path_factory.mktemp("proof") / "set"
    arguments = [
        "--cases",
        "2",
        "--seed",
        "3",
        "--levels",
        "plain",
        "null",
        "--only",
        "gear-friction",
    ]
    assert main(["prove", "make", *arguments, "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def tools(tmp_path):
    out = []
    for name, code in (("diagnose", FAKE), ("predict", FAKE_PREDICT)):
        path = tmp_path / f"{name}.py"
        path.write_text(code)
        out += [f"--{name}", f"{{python}} {path} {{case}} {{out}}"]
    return out


def test_cases_follow_the_contract(sealed):
    labels = json.loads((sealed / "labels.json").read_text())
    assert sorted(label["level"] for label in labels.values()) == ["null", "plain"]
    for case in labels:
        place = sealed / "cases" / case
        rig = tomllib.loads((place / "rig.toml").read_text())
        assert {r["role"] for r in rig["recording"]} == {"identification", "validation"}
        for entry in rig["recording"]:
            table = read_columns(place / entry["file"])
            assert list(table)[:2] == ["time_s", "duty"]
            np.testing.assert_allclose(np.diff(table["time_s"]), 1e-3, atol=1e-9)
            assert np.abs(table["duty"]).max() <= 1.0
            assert np.isfinite(np.array(list(table.values()))).all()
        test = tomllib.loads((place / "test" / "test.toml").read_text())["recording"]
        assert [t["file"] for t in test] == ["input.csv"]
        assert list(read_columns(place / "test" / "input.csv")) == ["time_s", "duty"]
        written = " ".join(p.read_text() for p in place.rglob("*.toml"))
        assert "friction" not in written
        assert "null" not in written


def test_answers_kept_back_are_consistent(sealed):
    labels = json.loads((sealed / "labels.json").read_text())
    for case, label in labels.items():
        for channel, row in label["hidden_test"]["nrmse"].items():
            measured = read_columns(sealed / "hidden" / case / "output.csv")[channel]
            assert row["std"] == pytest.approx(measured.std(), rel=1e-9)
            assert row["floor"] < 0.1
            assert row["floor"] <= 1.2 * row["refit"]
            if label["level"] == "null":  # nothing but constants: the refit reaches the floor
                assert row["refit"] - row["floor"] < 0.1 * row["nominal"] + 1e-3
        if label["effects"]:
            assert label["strength"]["gear-friction"] > 1.5


def test_a_case_can_be_made_again_from_its_seed(sealed):
    recipes = composition(2, 3, ("plain", "null"), ("gear-friction",))
    index = next(k for k, r in enumerate(recipes) if r.level == "null")
    again = make_case(recipes[index], (3, index + 1))
    written = read_columns(sealed / "cases" / f"case-00{index + 1}" / "rec1.csv")
    for name, values in again.readings[0].items():
        np.testing.assert_allclose(values, written[name], atol=1e-5, err_msg=name)


def test_run_is_blind_scored_and_reported(sealed, tools, tmp_path, capsys):
    assert main(["prove", "run", str(sealed), "--name", "fake", *tools]) == 0
    out = tmp_path / "report"
    assert main(["prove", "score", str(sealed), "--name", "fake", "--out", str(out)]) == 0
    figures = json.loads((out / "proof.json").read_text())
    assert figures["top1"]["share"] == 1.0
    assert figures["false_alarm"]["share"] == 1.0
    assert figures["precision"]["share"] == 0.5
    assert digest(sealed / "labels.json") in capsys.readouterr().out
    page = (out / "proof.html").read_text()
    assert page.count("<img") >= 3
    assert "gear-friction" in (out / "proof.md").read_text()
    assert str(sealed) not in page


def test_killed_run_goes_on_where_it_stopped(sealed, tools):
    command = [sys.executable, "-m", "dftfs", "prove", "run", str(sealed)]
    command += ["--name", "killed", *tools]
    place = sealed / "runs" / "killed"
    environment = os.environ | {"SLOW": "1.0", "PYTHONPATH": str(ROOT)}
    first = subprocess.Popen(command, env=environment, start_new_session=True)
    end = time.monotonic() + 60
    while not (place / "case-001").is_dir() and time.monotonic() < end:
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    done = (place / "case-001" / "outcome.json").read_bytes()
    assert not (place / "case-002").exists()
    subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True)
    assert (place / "case-001" / "outcome.json").read_bytes() == done
    assert (place / "case-002" / "diagnosis.json").is_file()
    assert not list(place.glob(".case*"))


def test_changed_labels_are_refused_in_one_line(sealed, tools, capsys):
    labels = sealed / "labels.json"
    before = labels.read_bytes()
    try:
        labels.write_bytes(before.replace(b"gear-friction", b"load-friction"))
        for arguments in (["run", *tools], ["score"]):
            step, *rest = arguments
            assert main(["prove", step, str(sealed), *rest]) == 2
            error = capsys.readouterr().err
            assert "changed since it was sealed" in error
            assert error.count("\n") == 1
    finally:
        labels.write_bytes(before)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["make", "--cases", "0", "--seed", "1", "--out", "{tmp}/a"], "at least 1"),
        (
            ["make", "--cases", "1", "--seed", "1", "--only", "gravity", "--out", "{tmp}/a"],
            "not an effect",
        ),
        (["make", "--cases", "1", "--seed", "1", "--out", "{set}"], "never changed"),
        (["make", "--cases", "1", "--seed", "-1", "--out", "{tmp}/a"], "--seed -1: at least 0"),
        (["make", "--seed", "1", "--jobs", "0", "--out", "{tmp}/a"], "--jobs 0: at least 1"),
        (["run", "{tmp}/nothing"], "not there"),
        (["run", "{set}", "--jobs", "0"], "--jobs 0: at least 1"),
        (["run", "{set}", "--limit", "-3"], "--limit -3: at least 1"),
        (["run", "{set}", "--seconds", "nan"], "--seconds nan: at least 1"),
        (["run", "{set}", "--name", "../x"], "a name, not a path"),
        (["run", "{set}", "--diagnose", "true {place}"], "known: python, case, out"),
        (["score", "{set}", "--name", "nobody"], "no run"),
    ],
)
def test_bad_arguments_end_in_one_line(sealed, tmp_path, capsys, arguments, message):
    filled = [w.replace("{tmp}", str(tmp_path)).replace("{set}", str(sealed)) for w in arguments]
    assert main(["prove", *filled]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert message in error
    assert not (tmp_path / "a").exists(), "nothing is begun"
