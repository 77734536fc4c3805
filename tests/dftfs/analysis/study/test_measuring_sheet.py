"""A filled measuring sheet gives the stiffness of the part that was measured."""

import csv
import io
from dataclasses import replace

import pytest

from dftfs.analysis.study.drawing_tolerance import drawing_tolerance
from dftfs.analysis.study.measuring_sheet import COLUMNS, first_article, measuring_sheet
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.process import find_process
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod


@pytest.fixture(scope="module")
def sheet():
    design = load_design("al1")
    return measuring_sheet(design, drawing_tolerance(design, find_process("wire-edm")))


def filled(sheet, path, **measured):
    """The sheet with values for the rows whose name begins with a key (_ for a space)."""
    rows = list(csv.DictReader(io.StringIO(sheet)))
    for row in rows:
        for key, value in measured.items():
            if row["characteristic"].startswith(key.replace("_", " ")):
                row["measured_mm"] = str(value)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    return path


def stiffness(**changes):
    design = load_design("al1", changes)
    elastic = design.material.youngs_modulus_Pa, design.material.poisson_ratio
    arm = arm_rod(design.outline, design.width_m, *elastic, wide=True)
    return design.n_arms * twist_stiffness(arm.rod)


def test_the_dimensions_of_a_part_give_its_stiffness(sheet, tmp_path):
    design, path = load_design("al1"), tmp_path / "sheet.csv"
    thick = stiffness(thickness_mm="7.75", width_mm="7.4")
    found = first_article(design, filled(sheet, path, strip=7.75, axial=7.4))
    assert found.nominal_Nm_per_rad == pytest.approx(stiffness(), rel=1e-9)
    assert found.predicted_Nm_per_rad == pytest.approx(thick, rel=1e-9)
    one = first_article(design, filled(sheet, path, axial=7.4))
    assert one.not_measured == found.not_measured + 6


def test_an_arm_that_is_thinner_alone_counts_once_and_the_bench_speaks_of_the_modulus(
    sheet, tmp_path, capsys
):
    design, path = load_design("al1"), tmp_path / "sheet.csv"
    thin = {f"strip thickness, arm 1, {place}": 7.6 for place in ("near", "in")}
    thin = {key.replace(" ", "_"): value for key, value in thin.items()}
    found = first_article(design, filled(sheet, path, **thin, stiffness=64.0))
    arms = (stiffness() + stiffness(thickness_mm="7.6")) / 2
    assert found.predicted_Nm_per_rad == pytest.approx(arms, rel=1e-9)
    assert found.arms_mm == (pytest.approx(7.6), pytest.approx(7.7))
    modulus = design.material.youngs_modulus_Pa * 64.0 / arms
    assert found.modulus_Pa == pytest.approx(modulus)
    assert len(found.outside) == 3  # the places of arm 1
    assert main(["article", "al1", str(path)]) == 1
    assert "arms 7.600, 7.700 mm" in capsys.readouterr().out


def test_the_bore_is_h7_and_one_below_it_is_reported(sheet, tmp_path):
    design, path = load_design("al1"), tmp_path / "sheet.csv"
    (row,) = (
        r for r in csv.DictReader(io.StringIO(sheet)) if r["characteristic"].startswith("bore")
    )
    assert (row["nominal_mm"], row["least_mm"], row["most_mm"]) == ("21.360", "21.360", "21.381")
    assert not first_article(design, filled(sheet, path, bore=21.37)).outside
    for wrong in (21.335, 21.39):
        (line,) = first_article(design, filled(sheet, path, bore=wrong)).outside
        assert line == f"bore diameter, H7 {wrong} is not 21.36 to 21.381"


def test_a_part_is_predicted_by_the_3d_stiffness_that_its_sheet_states(tmp_path):
    """1 mm thick, 30 mm wide: rod and plane stress are 10 % off what the sheet's 3D found."""
    design, path, solid = load_design("al1"), tmp_path / "sheet.csv", 1.1 * stiffness()
    free = replace(design.requirements, stiffness_Nm_per_rad=None)
    design = replace(design, requirements=free)
    wire = find_process("wire-edm")
    tolerance = drawing_tolerance(design, wire, solid_Nm_per_rad=solid)
    assert tolerance.nominal_Nm_per_rad == pytest.approx(solid, rel=1e-9)
    plain = drawing_tolerance(design, wire)
    assert tolerance.thickness_m == plain.thickness_m
    assert tolerance.kept == pytest.approx(plain.kept)
    sheet = measuring_sheet(design, tolerance, solid)
    asked = next(row for row in csv.reader(io.StringIO(sheet)) if row[0].startswith("stiffness"))
    assert float(asked[1]) == pytest.approx(solid, abs=1e-3)
    found = first_article(design, filled(sheet, path, axial=7.4))
    thick = stiffness(width_mm="7.4") / stiffness()
    assert found.predicted_Nm_per_rad == pytest.approx(solid * thick, rel=1e-4)
    path.write_text(path.read_text().replace(f"{solid:.5g},", "stiff,"))
    with pytest.raises(DesignError, match="'stiff' is no stiffness"):
        first_article(design, path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "no measuring sheet: its first line"),
        (",".join(COLUMNS) + "\nx,1,0.9,1.1,\n", "nothing is measured"),
        (",".join(COLUMNS) + "\nx,1,0.9,1.1,wide\n", "no number, e.g. 7.702"),
        (",".join(COLUMNS) + "\nx,7.7,7.6,7.8,0.0077\n", "in mm"),
    ],
)
def test_a_sheet_that_cannot_be_used_says_why(tmp_path, text, message):
    path = tmp_path / "sheet.csv"
    path.write_text(text)
    with pytest.raises(DesignError, match=message):
        first_article(load_design("al1"), path)
