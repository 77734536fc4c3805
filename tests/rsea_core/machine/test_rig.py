"""Rig files are read as the contract says, and what is unusable gets one line."""

import pickle
from dataclasses import replace

import pytest

from rsea_core import Rig
from rsea_core.errors import RigError

MINIMAL = """
[rig]
name = "x"
torque_constant_Nm_per_A = 0.31
gear_ratio = 55.0
"""


def from_text(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return Rig.from_toml(path)


def test_preset_is_the_bench_of_the_contract():
    rig = Rig.preset("rsea-bench")

    assert rig.parts == ("drive", "gear", "spring", "load")
    assert rig.torque_constant_Nm_per_A == rig.back_emf_constant_Vs_per_rad == 0.3056
    assert rig.terminal_inductance_H == 4.56e-3
    assert rig.tolerances == (("spring_stiffness_Nm_per_rad", 0.10),)
    assert rig.anchors == ("load_mass_kg",)
    assert rig.findings() == ()


def test_case_file_keeps_its_recordings_to_the_case_reader(tmp_path):
    rig = from_text(
        tmp_path,
        MINIMAL
        + '\n[tolerances]\ngear_ratio = 0.01\n[[recording]]\nfile = "a.csv"\nload = "locked"\n',
    )

    assert rig.gear_ratio == 55.0
    assert rig.tolerances == (("gear_ratio", 0.01),)
    assert rig.spring_stiffness_Nm_per_rad is None


def test_full_command_is_in_the_commands_own_unit():
    rig = Rig(name="drive", parts=("drive",), supply_voltage_V=24.0, current_limit_A=6.0)
    found = [rig.full_command(name) for name in ("duty", "voltage_V", "current_command_A", None)]
    assert found == [1.0, 24.0, 6.0, 1.0]
    assert Rig(name="none", parts=("drive",)).full_command("current_command_A") == 1.0


def test_a_command_has_its_unit_where_no_value_makes_it_a_share():
    bare = Rig(name="none", parts=("drive",))
    names = ("duty", "voltage_V", "current_command_A", "motor_torque_Nm", None)
    assert [bare.unit_of_command(name) for name in names] == ["", "V", "A", "Nm", ""]
    assert replace(bare, current_limit_A=2.0).unit_of_command("current_command_A") == ""


def test_rig_can_be_hashed_and_sent_to_another_process():
    rig = Rig.preset("rsea-bench")
    assert pickle.loads(pickle.dumps(rig)) == rig
    assert len({rig, Rig.preset("rsea-bench")}) == 1


def test_differing_constants_and_unused_values_are_findings(tmp_path):
    rig = from_text(
        tmp_path,
        MINIMAL
        + 'back_emf_constant_Vs_per_rad = 0.38\nload_mass_kg = 0.2\nparts = ["drive", "gear"]',
    )

    mixed, unused = rig.findings()

    assert "differ by 22.6%" in mixed
    assert "creates energy" not in mixed
    assert "load_mass_kg is given but not used" in unused
    two_percent = from_text(tmp_path, MINIMAL + "back_emf_constant_Vs_per_rad = 0.3045\n")
    assert two_percent.findings() == ()
    larger = from_text(tmp_path, MINIMAL + "back_emf_constant_Vs_per_rad = 0.25\n")
    assert "creates energy" in larger.findings()[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MINIMAL + "spring_stifness_Nm_per_rad = 3\n", "nearest known one is 'spring_stiffness_Nm"),
        (
            MINIMAL + "motor_inertia_kgm2 = -1e-4\n",
            "motor_inertia_kgm2 = -0.0001 kg m^2 must not be",
        ),
        (MINIMAL + "supply_voltage_V = 0\n", "supply_voltage_V = 0 V must be above 0"),
        (MINIMAL + "supply_voltage_V = nan\n", "supply_voltage_V = nan must be finite"),
        (MINIMAL + 'supply_voltage_V = "48"\n', "supply_voltage_V = '48' must be a number"),
        (MINIMAL + "current_limit_A = true\n", "current_limit_A = True must be a number"),
        (MINIMAL + "load_encoder_counts_per_rev = 0.5\n", "whole number of counts"),
        (
            MINIMAL + 'parts = ["drive", "geer"]\n',
            "unknown part 'geer'; the nearest known one is 'ge",
        ),
        (MINIMAL + 'parts = ["gear", "gear"]\n', "each once"),
        (MINIMAL + "parts = []\n", "at least one part"),
        (MINIMAL + 'parts = "gear"\n', "must be a list of words"),
        (MINIMAL + 'axis = "lineal"\n', "must be one of rotary, linear"),
        ('[rig]\nname = "x"\nparts = ["gear"]\n', "needs gear_ratio in [rig] (1 where"),
        ("[rig]\ngear_ratio = 5\n", "has no name"),
        ("[rigg]\n", "unknown key 'rigg'; the nearest known one is 'rig'"),
        ("rig = 3\n", "rig = 3 must be a table"),
        ("[tolerances]\n", "has no [rig] table"),
        (MINIMAL + "[tolerances]\ngear = 0.1\n", "unknown quantity 'gear'; the nearest"),
        (MINIMAL + "[tolerances]\ngear_ratio = -0.1\n", "must be above 0"),
        (MINIMAL + '[anchor]\nquantity = ["gear_ratio"]\n', "unknown key 'quantity'"),
        (
            MINIMAL + "motor_coulomb_Nm = 0.009\n",
            "motor_coulomb_Nm: dry friction that is known is a term: write [[term]]",
        ),
        (MINIMAL + '[anchor]\nquantities = ["mass"]\n', "unknown quantity 'mass'"),
        ("[rig\n", "is not TOML"),
    ],
)
def test_unusable_rig_file_gets_one_line_with_field_and_file(tmp_path, text, message):
    with pytest.raises(RigError) as caught:
        from_text(tmp_path, text)

    assert message in str(caught.value)
    assert "rig.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 2


def test_missing_file_and_preset_are_named(tmp_path):
    with pytest.raises(RigError, match=r"nowhere\.toml: cannot be read: No such file"):
        Rig.from_toml(tmp_path / "nowhere.toml")
    (tmp_path / "bytes.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(RigError, match="is not UTF-8"):
        Rig.from_toml(tmp_path / "bytes.toml")
    with pytest.raises(
        RigError, match="no rig preset 'rsea'; the nearest known one is 'rsea-bench'"
    ):
        Rig.preset("rsea")


def test_a_tolerance_above_1_is_a_finding():
    rig = replace(Rig.preset("rsea-bench"), tolerances=(("load_inertia_kgm2", 6.0),))
    assert any("standard deviation of 600%: 6 % is 0.06" in text for text in rig.findings())
