"""The schemas take every file that the package ships or writes, and no misspelt key."""

import json
import tomllib

import pytest
from jsonschema.validators import validator_for

from dftfs.cli.file_schemas import SCHEMAS, schema
from dftfs.cli.main import main
from rsea_core import ActuatorModel, Rig
from rsea_core.model.model_file import model_to_toml
from tests.cases.places import ROOT
from tests.dftfs.cli.test_diagnose_spring_bench import slipping, write_case

VALIDATOR = validator_for({})
SHIPPED = {
    "rig": ["rsea_core/data/rsea-bench.toml"],
    "design": sorted((ROOT / "dftfs" / "data" / "designs").glob("*.toml")),
    "scenario": ["dftfs/examples/torque-1hz.toml"],
    "comparison": sorted((ROOT / "dftfs" / "examples").glob("compare-*.toml")),
    "task": sorted((ROOT / "dftfs" / "data" / "sizing").glob("*.toml")),
}


def errors(name: str, tables: dict) -> list[str]:
    return [e.message for e in VALIDATOR(schema(name)).iter_errors(tables)]


@pytest.mark.parametrize(
    ("name", "path"), [(name, path) for name, paths in SHIPPED.items() for path in paths]
)
def test_shipped_files_validate_and_a_wrong_key_does_not(name, path):
    tables = tomllib.loads((ROOT / path).read_text(encoding="utf-8"))
    assert errors(name, tables) == []
    for key, table in tables.items():
        if isinstance(table, dict) and key not in ("controller", "reference", "tolerances"):
            assert errors(name, tables | {key: table | {"wrong_key": 1}})
    assert errors(name, tables | {"wrong_table": {}})


def test_a_model_file_validates():
    written = model_to_toml(ActuatorModel(Rig.preset("rsea-bench")))
    assert errors("model", tomllib.loads(written)) == []


def test_a_recording_with_a_misspelt_key_is_an_error():
    tables = tomllib.loads((ROOT / SHIPPED["rig"][0]).read_text(encoding="utf-8"))
    entry = {"file": "a.csv", "role": "identification", "load": "locked"}
    assert errors("rig", tables | {"recording": [entry]}) == []
    assert errors("rig", tables | {"recording": [entry | {"rolle": "x"}]})


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_schema_is_one_and_is_printed(name, capsys, tmp_path):
    VALIDATOR.check_schema(schema(name))
    assert main(["schema", name]) == 0
    assert json.loads(capsys.readouterr().out) == schema(name)
    assert main(["schema", name, "--out", str(tmp_path / "s.json")]) == 0
    assert json.loads((tmp_path / "s.json").read_text()) == schema(name)


SCENARIO = """
name = "s"
rig = "rsea-bench"
load = {kind = "locked"}
reference = {kind = "sine", amplitude_Nm = 1.0, frequency_Hz = 2.0}
controller = {kind = "pid-torque", kp = 6.0, ki = 10.0}
simulation = {duration_s = 1.0}
"""
COMPARISON = """
name = "c"
rig = "rsea-bench"
load = {kind = "locked"}
reference = {kind = "sine", amplitude_Nm = 1.0, frequency_Hz = 2.0}
task = {duration_s = 1.0, from_s = 0.1}
budget = {seeds = 1, population = 4, generations = 2}
[[controller]]
name = "PID"
kind = "pid-torque"
tune = {kp = [5.0, 150.0], ki = [0.0, 500.0]}
"""
RUNS = {
    "simulation": ("simulate given.toml --out out", "s.json"),
    "tuned": ("tune given.toml --out out", "PID.json"),
    "comparison": ("compare given.toml --out out", "c.json"),
    "tolerance": ("tolerance ref --samples 1000 --out out", "tolerance-ref.json"),
    "verify": ("verify ref --plane --states 1 --no-mesh-error --out out", "verify-ref.json"),
}


def assert_described(name: str, written: dict) -> None:
    assert errors(f"{name}-result", written) == []
    assert errors(f"{name}-result", written | {"wrong_key": 1})
    for key in list(written)[:3]:
        assert errors(f"{name}-result", {k: v for k, v in written.items() if k != key})


@pytest.mark.parametrize("name", RUNS)
def test_what_a_command_writes_is_what_its_schema_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = SCENARIO if name == "simulation" else COMPARISON
    (tmp_path / "given.toml").write_text(given, encoding="utf-8")
    line, file = RUNS[name]
    assert main([*line.split(), "-q"]) == 0
    assert_described(name, json.loads((tmp_path / "out" / file).read_text()))


def test_what_a_diagnosis_writes_is_what_its_schema_says(tmp_path):
    write_case(tmp_path / "case", slipping)
    assert main(["diagnose", str(tmp_path / "case"), "--out", str(tmp_path / "out"), "-q"]) == 0
    assert_described("diagnosis", json.loads((tmp_path / "out" / "diagnosis.json").read_text()))
