"""Published parts: every one has a source and fields of a rig; a rig made with them reads back."""

import dataclasses

import pytest

from dftfs.cli.main import main
from dftfs.errors import DesignError
from dftfs.part_library import find, parts, rig_values
from rsea_core.machine.rig import Rig


def test_every_part_has_a_source_and_fields_of_a_rig():
    fields = {field.name for field in dataclasses.fields(Rig)}
    assert len(parts()) > 15
    for part in parts():
        assert part.source
        assert part.values
        assert {key for key, _ in part.values} <= fields


def test_a_rig_with_parts_has_their_values_and_not_those_that_they_do_not_state(tmp_path):
    assert main(["new", "rig", str(tmp_path / "r.toml"), "--with", "muir-sea"]) == 0
    rig = Rig.from_toml(tmp_path / "r.toml")
    assert rig.gear_ratio == 16.0
    assert rig.motor_inertia_kgm2 == pytest.approx(2.14e-6 + 1.31e-7)  # Muir et al.: 2.271e-6
    assert rig.terminal_resistance_ohm is None
    assert dict(rig.tolerances)["spring_stiffness_Nm_per_rad"] == 0.1
    assert rig_values(find(["gear.muir-sea"])).get("motor_inertia_kgm2") is None


@pytest.mark.parametrize("words", [["quanser-srv2"], ["motor", "nonsense"]])
def test_an_unknown_part_is_refused_by_name(words):
    with pytest.raises(DesignError, match="no part"):
        find(words)


def test_a_rig_has_one_part_of_a_kind_and_nothing_else_has_parts(tmp_path, capsys):
    assert main(["new", "rig", str(tmp_path / "r.toml"), "--with", "al1", "al2"]) == 2
    assert main(["new", "scenario", str(tmp_path / "s.toml"), "--with", "al1"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
    assert not list(tmp_path.iterdir())


def test_the_library_is_listed_and_a_part_shown_with_its_source(capsys):
    assert main(["parts", "list"]) == 0
    assert main(["parts", "list", "quanser-srv02"]) == 0
    assert "Table 3.1" in capsys.readouterr().out
