"""`dftfs diagnose` turns a map of steady speeds into a diagnosis, a model and a report."""

import json

import numpy as np

import rsea_core
from dftfs.cli.main import main
from rsea_core.identify.result.corrected_model import FoundModel
from tests.cases.recorded import map_case


def friction(speed, load):
    loss = 1.0 if np.sign(speed) * load > 0.0 else 0.6
    return np.sign(speed) * (3e-4 + loss * abs(load)) + 5e-6 * speed


def test_a_steady_map_gets_a_diagnosis_a_model_and_a_report(tmp_path, capsys):
    case, out = tmp_path / "case", tmp_path / "out"
    case.mkdir()
    map_case(case, friction)
    assert main(["diagnose", str(case), "--out", str(out)]) == 0
    assert capsys.readouterr().out.startswith("missing-physics: ")
    document = json.loads((out / "diagnosis.json").read_text())
    names = {e["name"] for e in document["effects"]}
    assert names == {"gear-friction", "gear-load-friction"}
    model = FoundModel.from_toml(out / "model.toml")
    assert {law.effect for law, _ in model.laws} == names
    assert "steady speeds" in (out / "report.html").read_text()
    speeds = np.loadtxt(out / "next.csv", delimiter=",", skiprows=1)[:, 1]
    assert speeds.min() < 0.0 < speeds.max()
    saved = rsea_core.diagnose(case).save(tmp_path / "saved")  # the library writes the same files
    assert set(saved) == {"diagnosis.json", "model.toml", "next.csv"}
    assert all(path.read_bytes() == (out / name).read_bytes() for name, path in saved.items())


def test_a_map_of_two_speeds_is_refused_in_one_line(tmp_path, capsys):
    map_case(tmp_path, friction, speeds=np.array([1.0, 2.0]))
    assert main(["diagnose", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "steady speeds to fit are fewer than 6" in error
    assert error.count("\n") == 1
