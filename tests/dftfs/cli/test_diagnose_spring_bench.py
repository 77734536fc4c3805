"""`dftfs diagnose` names what makes a spring on its bench differ from its design."""

import json

import numpy as np
import pytest

import rsea_core
from dftfs.cli.main import main
from rsea_core.effects.registry import SpringCurve, SpringHysteresis
from rsea_core.identify.spring_bench.history_columns import stop
from rsea_core.model.model_file import read_model

K = 65.0
RIG = """[rig]
name = "bench"
parts = ["spring"]
torque_sensor_noise_Nm = 0.01
{stiffness}
"""
RECORDING = """
[[recording]]
file = "loop{k}.csv"
role = "{role}"
load = "imposed"
quasi_static = true
"""


def slipping(deflection):
    return 5.0 * deflection + (K - 5.0) * stop(deflection, 0.07)


def write_case(folder, law, stiffness=K, turns=(0.0, 1.0, -1.0, 0.6)):
    folder.mkdir()
    rng = np.random.default_rng(3)
    known = "" if stiffness is None else f"spring_stiffness_Nm_per_rad = {stiffness}"
    text = RIG.format(stiffness=known)
    for k, size in enumerate((0.06, 0.12, 0.2, 0.16)):
        corners = size * np.array(turns)
        deflection = np.interp(np.linspace(0, len(turns) - 1, 400), range(len(turns)), corners)
        torque = law(deflection) + 0.01 * rng.standard_normal(deflection.size)
        rows = np.column_stack([np.arange(deflection.size), deflection, torque])
        header = "time_s,spring_deflection_rad,torque_Nm"
        np.savetxt(folder / f"loop{k}.csv", rows, delimiter=",", header=header, comments="")
        text += RECORDING.format(k=k, role="validation" if k == 3 else "identification")
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    return folder


def diagnosed(case, *more):
    out = case.parent / "out"
    assert main(["diagnose", str(case), "--out", str(out), *more]) == 0
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8")), out


def test_a_slipping_clamp_is_named_and_handed_back_as_a_model(tmp_path, capsys):
    document, out = diagnosed(write_case(tmp_path / "case", slipping))
    assert document["verdict"] == "missing-physics"
    (effect,) = document["effects"]
    assert (effect["name"], effect["subsystem"]) == ("spring-hysteresis", "spring")
    assert effect["confidence"] > 0.9
    slip = effect["parameters"]["slip_Nm"]
    assert slip["value"] == pytest.approx(60.0 * 0.07, rel=0.03)
    assert document["location"]["subsystem"] == "spring"
    row = next(r for r in document["fit"]["recordings"] if r["role"] == "validation")
    assert row["nrmse_after"] < 0.02 < 0.2 < row["nrmse_parameters_only"]
    model = read_model(out / "model.toml")
    (term,) = model.terms
    assert isinstance(term, SpringHysteresis)
    assert model.rig.spring_stiffness_Nm_per_rad == pytest.approx(5.0, rel=0.1)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Missing: spring hysteresis" in page
    assert page.count("<svg") >= 6
    assert capsys.readouterr().out.startswith("missing-physics: ")


def test_a_thick_strip_is_read_against_the_curve_of_its_design(tmp_path):
    curve = tmp_path / "design.csv"
    deflection = np.linspace(-0.3, 0.3, 31)
    torque = K * (deflection + 3.0 * deflection**3)
    rows = np.column_stack([deflection, torque])
    np.savetxt(curve, rows, delimiter=",", header="deflection_rad,torque_Nm", comments="")
    case = write_case(
        tmp_path / "case", lambda x: 1.02**3 * np.interp(x, deflection, torque), stiffness=None
    )
    document, out = diagnosed(case, "--fe", str(curve))
    assert document["verdict"] == "parameters-only"
    assert document["effects"] == []
    assert document["spring"]["thickness_ratio"] == pytest.approx(1.02, abs=2e-3)
    (term,) = read_model(out / "model.toml").terms
    assert isinstance(term, SpringCurve)


def test_a_spring_as_designed_has_no_mismatch(tmp_path):
    document, _ = diagnosed(write_case(tmp_path / "case", lambda x: K * x))
    assert document["verdict"] == "no-mismatch"
    assert document["location"] is None


def test_a_path_that_never_turns_back_asks_for_one_that_does(tmp_path, capsys):
    case = write_case(tmp_path / "case", slipping, turns=(0.0, 1.0))
    document, out = diagnosed(case)
    assert document["verdict"] == "insufficient-data"
    assert all(effect["confidence"] < 0.5 for effect in document["effects"])
    asked = document["next_experiment"]
    assert asked["predicted_separation"] > 3.0
    path = np.loadtxt(out / asked["file"], delimiter=",", skiprows=1)
    assert path[:, 1].min() < -0.19 < 0.19 < path[:, 1].max()
    assert "record next: turn the spring" in capsys.readouterr().out
    saved = rsea_core.diagnose(case).save(tmp_path / "saved")  # the library writes the same files
    assert set(saved) == {"diagnosis.json", "model.toml", "next.csv", "next.toml"}
    assert all(path.read_bytes() == (out / name).read_bytes() for name, path in saved.items())


def test_time_that_is_only_an_index_explains_nothing(tmp_path):
    law = lambda x: K * x + 40.0 * np.gradient(x)  # noqa: E731
    document, _ = diagnosed(write_case(tmp_path / "case", law))
    assert not {"sensor-delay", "spring-viscoelastic"} & {e["name"] for e in document["effects"]}


def test_what_cannot_be_compared_is_refused_in_one_line(tmp_path, capsys):
    case = write_case(tmp_path / "still", lambda x: 0.0 * x)
    for k in range(4):
        rows = np.loadtxt(case / f"loop{k}.csv", delimiter=",", skiprows=1)
        rows[:, 1:] = 0.25
        header = "time_s,spring_deflection_rad,torque_Nm"
        np.savetxt(case / f"loop{k}.csv", rows, delimiter=",", header=header, comments="")
    assert main(["diagnose", str(case)]) == 2
    error = capsys.readouterr().err
    assert "nothing moves" in error
    assert error.count("\n") == 1
    other = write_case(tmp_path / "case", slipping)
    assert main(["diagnose", str(other), "--fe", str(tmp_path / "no.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
