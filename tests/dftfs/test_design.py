"""A design file is read as it is meant, and what is wrong in it gets one line."""

import pytest

from dftfs.design import built_in_names, load_design
from dftfs.errors import DesignError

GOOD = """
[spring]
inner_radius_mm = 18.38
outer_radius_mm = 75.07
turns = 1.9
thickness_mm = 7.7
width_mm = 7.34
fillet_radius_mm = 0.5
material = "al-thesis"
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return str(path)

    return write


def test_built_in_designs_are_the_rows_of_table_2_6():
    assert built_in_names() == ("al1", "al2", "ref", "ss", "ti")
    widths = {name: load_design(name).width_m * 1e3 for name in built_in_names()}
    assert widths == pytest.approx({"al1": 7.34, "al2": 10, "ref": 7.34, "ss": 5.1, "ti": 4.2})


def test_al1_is_the_fit_geometry_of_the_specification():
    p = load_design("al1").spiral
    assert (p.turns, p.n_arms) == (1.9, 2)
    assert [p.inner_radius_m, p.outer_radius_m, p.thickness_m] == pytest.approx(
        [18.38e-3, 75.07e-3, 7.7e-3]
    )
    # R_ri = R_o + w1/2; bore and rim one strip thickness away
    assert p.rim_inner_radius_m == pytest.approx(p.outer_radius_m + p.thickness_m / 2)
    assert p.rim_outer_radius_m - p.rim_inner_radius_m == pytest.approx(7.7e-3)


def test_absent_hub_and_rim_follow_from_the_strip(write):
    p, al1 = load_design(write(GOOD)).spiral, load_design("al1").spiral
    for name in ("bore_radius_m", "hub_radius_m", "rim_inner_radius_m", "rim_outer_radius_m"):
        assert getattr(p, name) == pytest.approx(getattr(al1, name), rel=1e-12)


def test_mass_is_area_times_width_times_density():
    design = load_design("al1")
    expected = design.outline.area_m2 * 7.34e-3 * design.material.density_kg_per_m3
    assert design.mass_kg == pytest.approx(expected)
    assert 0.2 < design.mass_kg < 0.35


def test_set_changes_one_field_and_nothing_else():
    changed, plain = load_design("al1", {"width_mm": "10"}), load_design("al1")
    assert changed.width_m == pytest.approx(0.01)
    assert changed.spiral == plain.spiral
    assert load_design("al1", {"material": "7075-T6"}).material.name == "al-7075-t6"
    asked = load_design("al1", {"contact_free_torque_Nm": "12"}).requirements
    assert asked.contact_free_torque_Nm == 12


def test_user_material_file_stands_next_to_the_design(tmp_path):
    (tmp_path / "mats.toml").write_text(
        """
        [materials.my-steel]
        description = "a test heat"
        family = "steel"
        youngs_modulus_GPa = 205.0
        poisson_ratio = 0.29
        density_kg_per_m3 = 7850.0
        yield_strength_MPa = 900.0
        ultimate_strength_MPa = 1100.0
        creeps = false
        [materials.my-steel.source]
        youngs_modulus_GPa = "own tensile test"
        poisson_ratio = "own tensile test"
        density_kg_per_m3 = "weighed"
        yield_strength_MPa = "own tensile test"
        ultimate_strength_MPa = "own tensile test"
        """
    )
    text = GOOD.replace('"al-thesis"', '"my-steel"\nmaterials_file = "mats.toml"')
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert load_design(str(path)).material.youngs_modulus_Pa == 205e9


BAD = [
    ("[spring", r"mine.toml: is not TOML"),
    ("[arms]\nn = 2", r"unknown table 'arms'"),
    (GOOD.replace("turns = 1.9", ""), r"turns is missing"),
    (
        GOOD.replace("thickness_mm", "thicknes_mm"),
        r"'thicknes_mm'; .* 'thickness_mm'",
    ),
    (GOOD.replace("7.7", "-7.7"), r"thickness_mm = -7.7 must be positive"),
    (GOOD.replace("7.7", '"7.7"'), r"thickness_mm = '7.7' must be a number"),
    (GOOD.replace("18.38", "0.01838"), r"0.01838 looks like metres.* 18.38 would work"),
    (GOOD.replace("7.34", "0.00734"), r"width_mm = 0.00734 looks like metres.* 7.34 would work"),
    (GOOD.replace("1.9", "4.0"), r"neighbouring arms overlap .* would work"),
    (GOOD.replace("al-thesis", "al-thesys"), r"al-thesys.*al-thesis"),
    (GOOD.replace("1.9", "nan"), r"turns = nan must be finite"),
    (GOOD + "rim_inner_radius_mm = 85\n", r"slit .* does not close .* would work"),
    (
        GOOD + "[requirements]\nstiffness = 65\n",
        r"'stiffness'; .* 'stiffness_Nm_per_rad'",
    ),
    (GOOD + "n_arms = 2.5\n", r"n_arms = 2.5 must be a whole number"),
    (GOOD.replace("[spring]", '[spring]\nname = "a/b"'), r"name = 'a/b' names the result files"),
]


@pytest.mark.parametrize(("text", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_files_get_one_line_with_file_field_and_what_would_do(write, text, message):
    with pytest.raises(DesignError, match=message) as refusal:
        load_design(write(text))
    assert "\n" not in str(refusal.value)
    assert "mine.toml" in str(refusal.value)


def test_unknown_name_lists_the_built_in_ones():
    with pytest.raises(DesignError, match=r"'al3' is neither a file nor one of al1, al2, ref"):
        load_design("al3")


def test_unknown_set_field_names_the_nearest():
    with pytest.raises(
        DesignError, match=r"--set, --vary or --list: unknown field 'width'; .* 'width_mm'"
    ):
        load_design("al1", {"width": "10"})


def test_missing_and_binary_files_are_one_line(tmp_path):
    with pytest.raises(DesignError, match=r"gone.toml: cannot be read: No such file"):
        load_design(str(tmp_path / "gone.toml"))
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DesignError, match=r"b.toml: is not UTF-8"):
        load_design(str(tmp_path / "b.toml"))
