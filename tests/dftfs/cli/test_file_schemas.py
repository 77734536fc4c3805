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
