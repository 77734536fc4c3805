"""A sweep has a row for every point, solves nothing twice and outlives a task that crashes."""

import csv
import io
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dftfs.analysis.jobs.store import ContentStore, content_key
from dftfs.analysis.jobs.worker_pool import run_in_processes
from dftfs.analysis.sweep.export import export_points
from dftfs.analysis.sweep.points import SweepPoint, grid_points, list_points, parse_vary
from dftfs.analysis.sweep.run import run_sweep, stress_at
from dftfs.analysis.sweep.table import csv_text, parquet_bytes, unit_of
from dftfs.analysis.torsion.batch_solve import SharedProblem, solve_shared
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.material import lookup
from dftfs.spring.notch import peak_stress
from dftfs.spring.rod import arm_rod, rod_curve, wide_over_plane
from tests.cases import round_off


def here(function, tasks):
    """A runner without processes."""
    for key, task in tasks.items():
        yield key, function(task)


def sweep(points, folder, model="rod", source="al1", runner=here):
    store = ContentStore(folder=folder)
    return run_sweep(source, {}, points, model=model, states=3, store=store, runner=runner)


def test_a_grid_holds_every_combination_with_the_last_field_fastest():
    varies = [parse_vary("material=a,b"), parse_vary("width_mm=4:6:3")]
    points = grid_points(varies)
    assert [p.index for p in points] == list(range(6))
    assert [dict(p.changes)["width_mm"] for p in points] == ["4", "5", "6"] * 2
    assert [dict(p.changes)["material"] for p in points] == ["a"] * 3 + ["b"] * 3


@pytest.mark.parametrize(
    "text",
    [
        "width_mm",
        "=4,5",
        "width_mm=",
        "width_mm=4,,5",
        "turns=1:2",
        "turns=1:2:1",
        "a=1:x:3",
        "a=4-13",
    ],
)
def test_a_vary_that_cannot_be_read_names_itself(text):
    with pytest.raises(DesignError, match="--vary"):
        parse_vary(text)


def test_a_field_may_be_varied_once():
    with pytest.raises(DesignError, match="named twice"):
        grid_points([parse_vary("turns=1,2"), parse_vary("turns=3,4")])


def test_a_list_reads_rows_and_leaves_empty_cells_to_the_design(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("width_mm,material\n5,\n\n6,al-7075-t6\n")
    first, second = list_points(path)
    assert first.changes == (("width_mm", "5"),)
    assert second.changes == (("width_mm", "6"), ("material", "al-7075-t6"))
    path.write_text("width_mm,material\n5\n")
    with pytest.raises(DesignError, match="row 1 has 1 cells"):
        list_points(path)
    path.write_text("width_mm\n")
    with pytest.raises(DesignError, match="one row or more"):
        list_points(path)


def test_rod_scaled_from_the_shared_solve_is_the_rod_solved_directly():
    design = replace(load_design("al1"), material=lookup("17-4PH"), width_m=4.3e-3)
    problem = SharedProblem.of(design, "rod", 3)
    curve = solve_shared(problem.content())["curve"]
    by_torque, by_stress = problem.factors(design)
    elastic = design.material.youngs_modulus_Pa, design.material.poisson_ratio
    direct = rod_curve(design.outline, design.width_m, *elastic, curve["deflection_rad"])
    arm = arm_rod(design.outline, design.width_m, *elastic)
    rounding_Nm = 2 * round_off.of_rod_torque_Nm(arm.rod)  # of two arms
    torque, largest = direct.torque_Nm, np.abs(direct.torque_Nm).max()
    assert by_torque * np.array(curve["torque_Nm"]) == pytest.approx(torque, abs=rounding_Nm)
    stress, wanted = by_stress * np.array(curve["peak_stress_Pa"]), peak_stress(direct)
    assert stress == pytest.approx(wanted, abs=rounding_Nm / largest * np.max(wanted))


def test_plane_stress_scaled_from_the_shared_solve_is_the_one_solved_directly():
    """Torque ~ E w2, stress ~ E at equal nu, in contact too: only round-off differs."""
    design = replace(load_design("al1"), material=lookup("17-4PH"), width_m=4.3e-3)
    problem = SharedProblem.of(design, "2d", 1, beyond=1.3)
    curve = solve_shared(problem.content())["curve"]
    direct = solve_torsion(
        TorsionProblem(design=design, dimension=2), states_per_direction=1, beyond=1.3
    )
    by_torque, by_stress = problem.factors(design)
    planar = TorsionProblem(design=design, dimension=2)
    rounding = round_off.of_planar_torsion(planar, direct.stiffness_Nm_per_rad)
    assert by_torque * curve["stiffness_Nm_per_rad"] == pytest.approx(
        direct.stiffness_Nm_per_rad, rel=rounding
    )
    assert curve["deflection_rad"] == pytest.approx(direct.deflection_rad, rel=1e-7, abs=1e-12)
    assert by_torque * np.array(curve["torque_Nm"]) == pytest.approx(direct.torque_Nm, rel=1e-6)
    stress = by_stress * np.array(curve["peak_stress_Pa"])
    assert stress == pytest.approx(direct.peak_von_mises_Pa, rel=1e-6)


def test_points_that_differ_by_factors_share_a_solve_and_3d_widths_do_not():
    design = load_design("al1")
    wider = replace(design, width_m=2 * design.width_m)
    other_nu = replace(design, material=lookup("17-4PH"))
    same_nu = replace(design, material=lookup("al-7075-t6"))

    def key(d, model):
        return SharedProblem.of(d, model, 8).key

    assert key(design, "2d") == key(wider, "2d") == key(same_nu, "2d")
    assert key(design, "2d") != key(other_nu, "2d")
    assert key(design, "3d") != key(wider, "3d")
    assert key(design, "2d") != SharedProblem.of(design, "2d", 9).key


def test_rows_are_the_design_asked_for_and_a_failing_point_is_a_row(tmp_path):
    points = grid_points([parse_vary("width_mm=5,10"), parse_vary("turns=1.9,4")])
    result = sweep(points, tmp_path)
    assert [row["status"] for row in result.rows] == ["ok", "failed"] * 2
    assert "overlap" in result.rows[1]["reason"]
    assert (result.shared_solves, result.failed) == (1, 2)
    five, ten = result.rows[0], result.rows[2]
    assert ten["mass_kg"] == pytest.approx(2 * five["mass_kg"], rel=1e-12)
    stiffer = [  # the wider one resists to curl a little more
        wide_over_plane(d.outline, d.width_m, d.material.youngs_modulus_Pa, 0.33)
        for d in (load_design("al1", {"width_mm": width}) for width in ("5", "10"))
    ]
    assert 1 < stiffer[0] < stiffer[1] < 1.001
    for name in ("stiffness_Nm_per_rad", "contact_winding_Nm", "contact_unwinding_Nm"):
        wanted = 2 * five[name] * stiffer[1] / stiffer[0]
        assert ten[name] == pytest.approx(wanted, rel=1e-12)
    assert ten["safety_factor_yield"] == pytest.approx(2 * five["safety_factor_yield"], rel=1e-2)
    assert ten["contact_unwinding_Nm"] < 0 < ten["contact_winding_Nm"]


def test_an_unknown_field_or_design_is_not_blamed_on_a_point(tmp_path):
    with pytest.raises(DesignError, match="nearest known one is 'width_mm'"):
        sweep([SweepPoint(index=0, changes=(("width", "5"),))], tmp_path)
    with pytest.raises(DesignError, match="neither a file"):
        sweep(grid_points([parse_vary("turns=2")]), tmp_path, source="al9")


def test_the_second_sweep_solves_nothing_and_gives_the_same_table(tmp_path):
    points = grid_points([parse_vary("turns=1.8,1.9")])
    first = sweep(points, tmp_path)

    def nobody(function, tasks):
        raise AssertionError("a kept solve was done again")

    second = sweep(points, tmp_path, runner=nobody)
    assert (first.from_cache, second.from_cache) == (0, 2)
    assert csv_text(first) == csv_text(second)


def test_a_damaged_entry_is_solved_again(tmp_path):
    points = grid_points([parse_vary("turns=1.8,1.9")])
    table = csv_text(sweep(points, tmp_path))
    damaged = sorted(tmp_path.glob("*/*.json"))[0]
    damaged.write_text(damaged.read_text()[:100])
    again = sweep(points, tmp_path)
    assert again.from_cache == 1
    assert csv_text(again) == table


def test_an_entry_under_another_key_is_not_taken(tmp_path):
    store = ContentStore(folder=tmp_path)
    one, other = content_key({"a": 1}), content_key({"a": 2})
    store.put(one, {"x": 0.1})
    store.path(other).parent.mkdir(exist_ok=True)
    store.path(one).rename(store.path(other))
    assert store.get(one) is None
    assert store.get(other) is None


def test_kept_bytes_are_made_once_and_again_when_cut_short(tmp_path):
    store, made = ContentStore(folder=tmp_path), []

    def make():
        made.append(1)
        return b"line\nline"

    assert store.made("ab12", make) == store.made("ab12", make) == b"line\nline"
    assert len(made) == 1
    path = store.path("ab12").with_suffix(".bin")
    path.write_bytes(path.read_bytes()[:-1])
    assert store.made("ab12", make) == b"line\nline"
    assert len(made) == 2


def test_csv_and_parquet_hold_the_same_table_with_units(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    result = sweep(grid_points([parse_vary("turns=1.9,4")]), tmp_path)
    table = parquet.read_table(io.BytesIO(parquet_bytes(result)))
    rows = list(csv.DictReader(io.StringIO(csv_text(result))))
    assert table.column_names == list(result.columns) == list(rows[0])
    for k, row in enumerate(table.to_pylist()):
        for name, value in row.items():
            text = rows[k][name]
            assert text == "" if value is None else value == type(value)(text)
    metadata = table.schema.field("contact_winding_Nm").metadata
    assert metadata[b"unit"] == b"Nm"
    assert unit_of("stiffness_Nm_per_rad") == "Nm/rad"


def test_stress_at_a_torque_keeps_the_last_ratio_beyond_the_curve():
    torque, stress = np.array([-1.0, 1.0, 2.0]), np.array([1.0, 10.0, 24.0])
    assert stress_at(1.5, torque, stress) == pytest.approx(1.5 * 11)
    assert stress_at(4.0, torque, stress) == pytest.approx(48)
    assert stress_at(0.5, -torque, stress) == pytest.approx(0.5)


def faulty(task):
    """Ends its process, raises, or answers: a worker's three ways."""
    if task == "die":
        os._exit(9)
    if task == "raise":
        raise RuntimeError("of its own making")
    return {"curve": task}


def test_a_task_that_kills_its_process_fails_alone():
    tasks = {"a": 1, "b": "die", "c": 2, "d": "raise", "e": 3}
    outcomes = dict(run_in_processes(faulty, tasks, 2))
    assert {k: outcomes[k]["curve"] for k in "ace"} == {"a": 1, "c": 2, "e": 3}
    assert "died twice" in outcomes["b"]["crash"]
    assert outcomes["d"]["crash"] == "RuntimeError: of its own making"


def test_a_crashed_solve_is_a_row_and_is_tried_again_next_time(tmp_path):
    points = grid_points([parse_vary("turns=1.9")])

    def crashing(function, tasks):
        return ((key, {"crash": "its process died"}) for key in tasks)

    result = sweep(points, tmp_path, runner=crashing)
    assert "its process died" in result.rows[0]["reason"]
    again = sweep(points, tmp_path)
    assert (again.from_cache, again.failed) == (0, 0)


@pytest.mark.needs_cad
def test_parts_of_points_are_written_once_and_again_when_changed(tmp_path):
    result = sweep(grid_points([parse_vary("width_mm=5,6")]), tmp_path / "cache")
    store, reported = ContentStore(folder=tmp_path / "cache"), []

    def export():
        return export_points(
            result,
            tmp_path / "parts",
            ["dxf"],
            store=store,
            runner=here,
            on_progress=reported.append,
        )

    assert export() == {}
    names = {path.name for path in (tmp_path / "parts").iterdir()}
    assert {"al1-0000.dxf", "al1-0001-polyline.dxf"} <= names
    changed: Path = tmp_path / "parts" / "al1-0001.dxf"
    changed.write_text("")
    export()
    assert reported[-2] == "CAD: 2 parts, 1 there, 1 to do"
    assert changed.stat().st_size > 1000
