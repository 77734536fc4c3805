"""The `model.toml` of a diagnosis works in `dftfs simulate`, `tune` and `predict`."""

import json

import numpy as np
import pytest

from dftfs.cli.main import main
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.errors import RseaError
from rsea_core.files.csv_columns import read_columns
from rsea_core.identify.result.corrected_model import PREDICTED, FoundModel
from rsea_core.identify.result.predict import predict
from rsea_core.machine.rig import Rig
from rsea_core.model.model_file import read_model

FOUND = {
    "gear-friction/coulomb": {"coulomb_Nm": 0.03},
    "spring-hysteresis/one slip": {"stiffness_1_Nm_per_rad": 12.0, "yield_1_rad": 0.01},
    "drive-dead-zone/half-width": {"width_duty": 0.01},
    "unexplained/over its turn@motor_angle_rad": {
        "first": 0.0, "last": 6.283, "at_1": 0.1, "at_2": -0.1, "at_3": 0.0,
    },
    "load-disturbance/pulse": {"start_s": 1.0, "width_s": 0.2, "peak_Nm": 4.0},
}  # fmt: skip
TAIL = """
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 2.0
"""
SCENARIO = TAIL + '[controller]\nkind = "pid-torque"\n[simulation]\nduration_s = 0.5\n'
TUNING = (
    TAIL
    + """
[task]
duration_s = 0.5
[budget]
population = 4
generations = 2
[[controller]]
name = "PID"
kind = "pid-torque"
tune = { kp = [5.0, 90.0] }
"""
)


@pytest.fixture
def folder(tmp_path):
    """What `dftfs diagnose CASE --out D` leaves in D, with files that use it."""
    known = laws_by_key()
    model = FoundModel(
        rig=Rig.preset("rsea-bench"), contact={},
        laws=tuple((known[key], values) for key, values in FOUND.items()),
    )  # fmt: skip
    (tmp_path / "model.toml").write_text(model.to_toml(), encoding="utf-8")
    for name, text in (("diagnosed", SCENARIO), ("tuning", TUNING)):
        (tmp_path / f"{name}.toml").write_text(f'rig = "model.toml"\n{text}', encoding="utf-8")
    (tmp_path / "nominal.toml").write_text(f'rig = "rsea-bench"\n{SCENARIO}', encoding="utf-8")
    return tmp_path


def test_a_diagnosed_machine_is_simulated_with_its_physics(folder, capsys):
    assert main(["simulate", str(folder / "diagnosed.toml"), "--json"]) == 0
    captured = capsys.readouterr()
    assert "load-disturbance (pulse) acted in one recording alone" in captured.err
    diagnosed = json.loads(captured.out)["metrics"]["rmse_Nm"]
    assert main(["simulate", str(folder / "nominal.toml"), "--json"]) == 0
    captured = capsys.readouterr()
    assert "acted in" not in captured.err
    assert diagnosed > 1.2 * json.loads(captured.out)["metrics"]["rmse_Nm"]


def test_a_controller_is_tuned_on_a_diagnosed_machine(folder, capsys):
    out = folder / "tuned"
    assert main(["tune", str(folder / "tuning.toml"), "--out", str(out)]) == 0
    assert "load-disturbance" in capsys.readouterr().err
    assert {path.name for path in out.iterdir()} >= {"PID.toml", "PID.h", "PID.json"}
    keys = [term.key for term in read_model(folder / "model.toml").terms]
    assert keys[-1] == "sensor-table:motor_angle_rad"
    assert len(keys) == 4


def test_a_prediction_reads_the_same_file(folder):
    test = folder / "test"
    test.mkdir()
    time = np.arange(100) / 500.0
    rows = np.column_stack([time, 0.2 * np.sin(20.0 * time)])
    np.savetxt(test / "input.csv", rows, delimiter=",", header="time_s,duty", comments="")
    (test / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "locked"\n')
    out = folder / "prediction.csv"
    assert main(["predict", str(folder / "model.toml"), str(test), "--out", str(out)]) == 0
    assert out.read_text(encoding="utf-8").startswith("time_s,motor_angle_rad,load_angle_rad")
    written = read_columns(out, RseaError, required=("time_s",), optional=PREDICTED)
    predicted = predict(str(folder / "model.toml"), test)["input.csv"].columns
    assert written.keys() == predicted.keys()
    assert all(np.array_equal(written[name], predicted[name]) for name in written)


def test_a_prediction_into_a_folder_is_refused_in_one_line(folder, capsys):
    assert main(["predict", str(folder / "model.toml"), str(folder), "--out", str(folder)]) == 2
    assert "is a folder; name a CSV file" in capsys.readouterr().err


def test_a_law_that_is_not_known_is_refused_in_one_line(folder, capsys):
    path = folder / "model.toml"
    text = path.read_text(encoding="utf-8").replace('"gear-friction"', '"gear-fiction"')
    path.write_text(text, encoding="utf-8")
    assert main(["simulate", str(folder / "diagnosed.toml")]) == 2
    error = capsys.readouterr().err
    assert "unknown law 'gear-fiction/coulomb'" in error
    assert error.count("\n") == 1
