"""The search finds the best design of its grid, judged as the rod model does, or says why none."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.notch_factor import measured
from dftfs.analysis.sizing.comparison import compare
from dftfs.analysis.sizing.fe_confirmation import confirm, judge_2d
from dftfs.analysis.sizing.limits import RANGE, STAGES, Limit, staged_violation
from dftfs.analysis.sizing.pool import judge_pool
from dftfs.analysis.sizing.relaxation import relaxations
from dftfs.analysis.sizing.rod_candidate import Candidate, as_design, assess, assess_values
from dftfs.analysis.sizing.search import pareto_front, size
from dftfs.analysis.sizing.task import Grid, load_task
from dftfs.analysis.strength.fatigue_lives import rated_line
from dftfs.analysis.strength.fkm import ALLOWED_DAMAGE, gradients_per_mm
from dftfs.analysis.structure.lateral import softest_lateral_stiffness
from dftfs.analysis.study.closed_form_design import closed_form_design
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.cli.main import main
from dftfs.design import design_toml, load_design
from dftfs.errors import DesignError
from dftfs.fem.linear_model import mass_matrix, rigid_motions
from dftfs.process import builtin_processes, find_process
from dftfs.spring.notch import notch_factor
from dftfs.spring.rod import arm_rod, wide_over_plane
from tests.cases import round_off

AL1 = {
    "thickness_mm": 7.7,
    "inner_radius_mm": 18.38,
    "outer_radius_mm": 75.07,
    "turns": 1.9,
    "fillet_radius_mm": 0.5,
}
SMALL = {
    "thickness_mm": "6.6:7.2:0.3",
    "inner_radius_mm": "16",
    "outer_radius_mm": "60:62:1",
    "turns": "1.4:1.5:0.05",
    "fillet_radius_mm": "2.1",
}
ONE = {"thickness_mm": "6.9", "outer_radius_mm": "61", "turns": "1.45"}  # of them, feasible


def small(**changes):
    return load_task("default", {**SMALL, **changes})


def test_a_grid_counts_from_its_minimum_and_knows_what_it_holds():
    grid = Grid(name="x", low=16, high=23.5, increment=0.05)
    assert (grid.steps, grid.value(3)) == (150, 16.15)
    assert grid.holds(18.4)
    assert not grid.holds(18.38)
    assert grid.nearest(99) == 150


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"turn": "2"}, "nearest known one is 'turns'"),
        ({"turns": "2:1:0.1"}, "turns"),
        ({"turns": "1:2"}, "one value or minimum"),
        ({"turns": "a"}, "must be a number"),
        ({"turns": "1:2:0"}, "increment"),
        ({"stiffness_Nm_per_rad": "-4"}, "must be positive"),
        ({"objective": "beauty"}, "known are mass"),
        ({"process": "wire"}, "did you mean wire-edm"),
        ({"material": "tungsten-generic"}, "no yield strength"),
        ({"n_arms": "2.5"}, "whole number"),
        ({"turns": "1:2"}, "for example turns = "),
        ({"envelope_mm": "30", "inner_radius_mm": "16:20:0.1"}, "smaller than the hub"),
        ({"envelope_mm": "110", "outer_radius_mm": "60:80:0.1"}, "without outer_radius_mm"),
        ({"life_cycles": "0"}, "life_cycles = 0.0 must be positive"),
        ({"life_cycles": "1e6", "survival_percent": "100"}, "survival_percent = 100 must be 50"),
        ({"life_cycles": "1e6", "material": "pla"}, "no life can be stated"),
        ({"lateral_stiffness_N_per_m": "1e6"}, "unknown field"),
        ({"equal_range_percent": "0"}, "equal_range = 0.0 must be positive"),
        ({"envelope_mm": "20"}, "no room for hub, strip and rim .* for example envelope_mm = 43"),
        ({"min_bore_mm": "200"}, "must be smaller than envelope_mm = 175"),
    ],
)
def test_a_task_that_cannot_be_used_says_which_field(changes, message):
    with pytest.raises(DesignError, match=message):
        load_task("default", changes)


def test_every_process_limit_has_a_source():
    assert {p.name for p in builtin_processes()} >= {"wire-edm", "water-jet", "laser", "milling"}
    for process in builtin_processes():
        assert {"gap_mm", "wall_mm", "inside_radius_mm"} <= dict(process.sources).keys()
    laser = find_process("laser")
    assert laser.smallest_gap_m(10e-3) == pytest.approx(7e-3)
    assert laser.smallest_gap_m(0.1e-3) == pytest.approx(0.4e-3)


def rounding() -> float:
    """Relative rounding of the stiffness of al1 as a rod."""
    design = load_design("al1")
    elastic = design.material.youngs_modulus_Pa, design.material.poisson_ratio
    return round_off.of_rod_stiffness(arm_rod(design.outline, design.width_m, *elastic).rod)


def test_the_judge_finds_what_the_rod_model_finds():
    design = load_design("al1")
    closed_form = closed_form_design(design)
    elastic = design.material.youngs_modulus_Pa, design.material.poisson_ratio
    wide = wide_over_plane(design.outline, design.width_m, *elastic)  # not in the search's rod
    touch = abs(closed_form.contact_onset["unwinding"].torque_Nm)
    # the judge keeps 2 % in reserve: at the asked torque the gap is just gone
    task = load_task("table-2.5", {"contact_free_torque_Nm": f"{touch / 1.02}"})
    found = assess_values(task, AL1, width_mm=7.34)
    assert found.stiffness_Nm_per_rad == pytest.approx(
        closed_form.stiffness_Nm_per_rad / wide, rel=rounding()
    )
    assert found.mass_kg == pytest.approx(closed_form.mass_kg, rel=1e-9)
    unwinding = next(limit for limit in found.limits if limit.name.endswith("unwinding"))
    assert unwinding.found == pytest.approx(unwinding.asked, rel=2e-3)


def test_a_shape_scaled_as_a_whole_keeps_mass_stress_and_travel():
    task = load_task("default", {"tip_radius_mm": "0.3"})
    scale = 1.1
    bigger = replace(task, tip_radius_m=scale * task.tip_radius_m)
    lengths = {k: v if k == "turns" else scale * v for k, v in AL1.items()}
    one = assess_values(task, AL1, width_mm=7.34)
    two = assess_values(bigger, lengths, width_mm=7.34 / scale**2)
    assert two.stiffness_Nm_per_rad == pytest.approx(one.stiffness_Nm_per_rad, rel=rounding())
    assert two.mass_kg == pytest.approx(one.mass_kg, rel=1e-9)
    assert two.stress_Pa == pytest.approx(one.stress_Pa, rel=1e-6)
    assert two.gap_left_m == pytest.approx(scale * one.gap_left_m, rel=1e-3)


def test_a_stage_that_is_broken_early_ranks_behind_one_that_is_broken_late():
    task = load_task("table-2.5", {})
    overlapping = assess_values(task, {**AL1, "turns": 3.0})
    breaking = assess_values(task, AL1, width_mm=7.34)
    unloaded = assess_values(task, {**AL1, "outer_radius_mm": 80.0}, whole=False)
    overloaded = assess_values(replace(task, contact_free_torque_Nm=10.0), AL1, width_mm=7.34)
    place = {stage: len(STAGES) - 1 - rank for rank, stage in enumerate(STAGES)}
    assert overlapping.violation > place["built"]
    assert unloaded.stress_Pa is None
    assert int(unloaded.violation) == place["made"]
    assert int(breaking.violation) == place["contact"]  # its coils touch before 15.2 Nm
    assert (
        int(overloaded.violation) == place["stress"]
    )  # they do not before 10 Nm, but it yields at 15.2
    assert breaking.merit("mass") > 1e9


def limit(stage, margin):
    return Limit(name=stage, asked=1.0, found=1.0 + margin, unit="", margin=margin, stage=stage)


@given(st.floats(1e-6, 1e3), st.floats(1e-6, 1e3), st.integers(0, 3))
def test_how_much_is_broken_never_outweighs_what_is_broken_first(little, much, first):
    early, late = limit(STAGES[first], -little), limit(STAGES[first + 1], -much)
    assert staged_violation([early]) > staged_violation([late])
    assert staged_violation([early, late]) == staged_violation([early])
    assert staged_violation([early, late], without=(STAGES[first],)) == staged_violation([late])
    assert staged_violation([limit("stress", little)]) == 0


@pytest.mark.parametrize("name", ["wire-edm", "water-jet", "laser", "milling"])
@pytest.mark.parametrize("envelope", [54.0, 110.0, 400.0])
def test_ranges_follow_from_envelope_and_process(name, envelope):
    task = load_task("default", {"envelope_mm": str(envelope), "process": name})
    made = task.process
    assert task.by_name["outer_diameter_mm"].high == pytest.approx(envelope)
    assert task.by_name["thickness_mm"].low >= 1e3 * made.wall_m - 1e-9
    assert task.by_name["fillet_radius_mm"].low >= 1e3 * made.inside_radius_m - 1e-9
    widest = {grid.name: grid.value(grid.steps) for grid in task.searched}
    widest |= {"thickness_mm": task.by_name["thickness_mm"].low, "turns": 1.0}
    assert 2e3 * task.spiral(widest).rim_outer_radius_m <= envelope * (1 + 1e-9)


def test_arms_taper_and_material_are_free_where_the_task_says_so():
    task = load_task(
        "default", {"n_arms": "1:6:1", "taper": "0.8:1.2:0.1", "material": "6061-T6, Ti-6Al-4V"}
    )
    assert [grid.steps for grid in task.searched[-3:]] == [5, 4, 1]
    values = AL1 | {"n_arms": 3.0, "taper": 0.8, "material_number": 2.0}
    found = assess_values(task, values)
    spiral = task.spiral(values)
    assert (spiral.n_arms, spiral.rim_thickness_m) == (3, pytest.approx(0.8 * 7.7e-3))
    assert found.material == "titanium-6al-4v"
    assert as_design(task, found, "x").material.family == "titanium"


def test_the_search_finds_the_best_of_a_small_grid_by_any_number_of_processes():
    task = small()
    every = [
        assess(task, index)
        for index in itertools.product(*(range(g.steps + 1) for g in task.searched))
    ]
    best = min(every, key=lambda c: (c.merit("mass"), c.index))
    assert best.feasible
    found = size(task, seed=3)
    assert found.best.index == best.index
    assert found.judged <= len(every)
    with judge_pool(task, 2) as judge:
        assert size(task, seed=3, judge=judge).front == found.front
    assert {stop.limit for stop in found.stops} & {"stress at 20 Nm", "outer_radius_mm's minimum"}


def test_a_task_that_nothing_meets_says_how_far_each_requirement_must_go():
    task = small(contact_free_torque_Nm="26")
    archive = size(task)
    assert not archive.best.feasible

    def pool(other):
        return judge_pool(other, 1)

    found = {one.requirement: one for one in relaxations(archive, pool)}
    torque = found["torque, before contact and in operation"]
    assert 18 < torque.works < 26
    weaker = small(contact_free_torque_Nm=repr(torque.works))
    assert assess_values(weaker, dict(torque.candidate.values_mm)).feasible
    stiffness = found["stiffness"]
    # of one shape the torque before contact and at the allowed stress go with the stiffness
    assert stiffness.works / 65 == pytest.approx(26 / torque.works, rel=0.02)


def test_a_life_is_a_limit_of_its_own_with_the_amplitude_that_the_rated_line_leaves():
    values = AL1 | {"thickness_mm": 5.0}
    asked = {limit.name: limit for limit in assess_values(small(), values).limits}
    task = small(life_cycles="1e5", survival_percent="99.9")
    found = {limit.name: limit for limit in assess_values(task, values).limits}
    extra = [limit for name, limit in found.items() if name not in asked]
    assert [limit.stage for limit in extra] == ["life", "life"]
    p, material = task.spiral(values), task.material
    for limit, gradient in zip(extra, gradients_per_mm(p.thickness_range_m[1], p.fillet_radius_m)):
        line, _ = rated_line(material, gradient_per_mm=gradient, surface="wire-edm", survival=0.999)
        assert line.cycles(1e6 * limit.asked) == pytest.approx(1e5 / ALLOWED_DAMAGE)
    assert max(limit.found for limit in extra) == pytest.approx(found["stress at 20 Nm"].found)
    # at the limit the spring of the task without a life does not live so long
    assert min(limit.margin for limit in extra) < found["stress at 20 Nm"].margin


def test_a_life_that_nothing_reaches_says_how_many_cycles_work():
    archive = size(small(**ONE, life_cycles="1e6"))
    assert not archive.best.feasible
    found = {
        one.requirement: one for one in relaxations(archive, lambda other: judge_pool(other, 1))
    }
    fewer = found["cycles in either direction"]
    assert fewer.works < 1e6
    kept = small(**ONE, life_cycles=repr(fewer.works))
    assert assess_values(kept, dict(fewer.candidate.values_mm)).feasible
    more = assess_values(
        small(**ONE, life_cycles=repr(1.2 * fewer.works)), dict(fewer.candidate.values_mm)
    )
    assert not more.feasible


def test_a_bore_that_no_spring_leaves_is_named_with_the_largest_that_works():
    archive = size(small(**ONE, min_bore_mm="24"))
    assert archive.best.why == "bore"
    found = relaxations(archive, lambda other: judge_pool(other, 1))
    assert found[0].requirement == "bore"
    kept = small(**ONE, min_bore_mm=repr(found[0].works))
    assert assess_values(kept, dict(found[0].candidate.values_mm)).feasible
    assert found[0].works == pytest.approx(2 * (16 - 6.9))


def candidate(numbers, index):
    mass, stress, gap = numbers
    return Candidate(
        index=(index,),
        values_mm=(),
        violation=0.0,
        limits=(),
        mass_kg=mass,
        stress_Pa=stress,
        gap_left_m=gap,
    )


@given(st.lists(st.tuples(*[st.integers(0, 6).map(float)] * 3), min_size=1, max_size=25))
def test_the_front_is_what_nothing_beats_and_beats_all_the_rest(points):
    made = [candidate(p, k) for k, p in enumerate(points)]
    front = pareto_front(made)

    def beats(a, b):
        x = np.array([a.mass_kg, a.stress_Pa, -a.gap_left_m])
        y = np.array([b.mass_kg, b.stress_Pa, -b.gap_left_m])
        return bool(np.all(x <= y) and np.any(x < y))

    assert not any(beats(a, b) for a in made for b in front)
    for left_out in (c for c in made if c not in front):
        assert any(beats(a, left_out) for a in front)


def test_table_2_5_is_off_its_own_grids_and_short_of_its_torque():
    task = load_task("table-2.5", {})
    assert task.name == "table-2.5"
    al1 = next(one for one in compare(task) if one.name == "al1")
    assert al1.off_grid == ("inner_radius_mm 18.38", "outer_radius_mm 75.07", "width_mm 7.34")
    broken = {limit.name for limit in al1.candidate.limits if limit.margin < 0}
    assert "torque before contact, unwinding" in broken
    assert any("errata S19" in line for line in al1.lines())


def test_notch_factor_is_what_plane_stress_elements_find():
    """REF, r_f 1 mm, and the fit's own error band of -4.2 to +6.3 %."""
    for relative, factor in measured(load_design("ref")):
        assert float(notch_factor(1 / relative)) == pytest.approx(factor, rel=0.063)


def test_the_winner_of_the_default_task_is_confirmed_by_plane_stress_elements():
    """The committed answer of `dftfs size`: within 1 % in stiffness, 3 % in stress."""
    task = load_task("default", {})
    values = {"thickness_mm": 7.4, "inner_radius_mm": 16.45, "outer_diameter_mm": 146.7}
    rod = assess_values(task, {**values, "turns": 1.5, "fillet_radius_mm": 2.45})
    found = judge_2d(task, as_design(task, rod, "winner"), rod, None)
    assert rod.feasible
    assert found.kept
    assert found.stiffness_2d_Nm_per_rad == pytest.approx(rod.stiffness_Nm_per_rad, rel=0.01)
    assert found.stress_Pa == pytest.approx(rod.stress_Pa, rel=0.03)


def test_a_wide_strip_gets_the_width_at_which_3d_elements_have_the_asked_stiffness():
    """0.9 mm thick, 13.6 mm wide: 3D elements stiffer by 9 % than plane stress; 1 % is allowed."""
    asked = {"material": "Ti-6Al-4V", "stiffness_Nm_per_rad": "2", "contact_free_torque_Nm": "1.6"}
    task = load_task("default", asked | {"envelope_mm": "70", "min_bore_mm": "6"})
    values = {"thickness_mm": 0.9, "inner_radius_mm": 6, "outer_diameter_mm": 49}
    rod = assess_values(task, {**values, "turns": 1.2, "fillet_radius_mm": 0.6})
    (found,) = confirm(task, [rod], most=1)
    solid = found.stiffness_3d_Nm_per_rad
    assert solid / found.stiffness_2d_Nm_per_rad > 1.05
    assert found.checks[0].value == solid
    assert solid == pytest.approx(task.stiffness_Nm_per_rad, rel=task.stiffness_tolerance)
    assert found.accepted
    plane = judge_2d(task, found.design, rod, None)
    assert found.design.width_m < 0.95 * plane.design.width_m
    assert found.contact_Nm["unwinding"] >= task.contact_free_torque_Nm


def test_a_design_written_as_a_file_is_read_back_the_same(tmp_path):
    design = load_design("al1")
    path = tmp_path / "al1.toml"
    path.write_text(design_toml(design))
    assert load_design(str(path)) == design


def test_size_writes_a_design_that_the_other_commands_read(tmp_path, capsys):
    arguments = [word for name, value in SMALL.items() for word in ("--set", f"{name}={value}")]
    arguments += ["--no-fe", "--jobs", "1", "--cache", str(tmp_path / "c"), "--out", str(tmp_path)]
    assert main(["size", *arguments]) == 0
    reported = capsys.readouterr().out
    assert "binding limits: " in reported
    best = load_design(str(tmp_path / "best.toml"))
    assert closed_form_design(best).stiffness_Nm_per_rad == pytest.approx(65, rel=0.01)
    assert (tmp_path / "front.png").stat().st_size > 10_000
    assert main(["size", *arguments]) == 2
    assert main(["size", "nowhere"]) == 2
    assert main(["size", "--jobs", "0", "--out", str(tmp_path / "x")]) == 2


def test_range_lateral_stiffness_and_inertia_are_the_finite_elements_where_asked():
    asked = {"equal_range_percent": "50", "min_lateral_N_per_mm": "30", "max_inertia_kg_mm2": "1e4"}
    asked |= {"contact_free_torque_Nm": "12", "operating_torque_Nm": "8"}
    found = assess_values(load_task("table-2.5", asked), AL1, width_mm=7.34)
    by_name = {limit.name: limit.found for limit in found.limits}
    assert by_name[RANGE] == pytest.approx(100 * (1 - 13.38 / 24.24), rel=0.01)  # `verify al1`
    design = load_design("al1")
    problem = TorsionProblem(design=design, dimension=2)
    lateral = 1e-3 * softest_lateral_stiffness(problem)
    assert by_name["lateral stiffness"] == pytest.approx(lateral, rel=5e-3)
    mesh = problem.sector
    mass = mass_matrix(mesh, density_kg_per_m3=design.material.density_kg_per_m3)
    turn = rigid_motions(mesh, np.arange(len(mesh.nodes)), ("rz",))
    inertia = 1e6 * design.n_arms * design.width_m * (turn.T @ mass @ turn).toarray()[0, 0]
    assert by_name["inertia"] == pytest.approx(inertia, rel=1e-5)
