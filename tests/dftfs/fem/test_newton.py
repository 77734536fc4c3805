"""The path solver reaches the same states by any increments, and says where it stopped and why."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from dftfs.errors import SolveError
from dftfs.fem.constraints import CyclicSymmetry, clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.loads import proportional, traction_forces
from dftfs.fem.mesh import extruded, replicated
from dftfs.fem.newton import StaticProblem, linear_tangent, solve_path
from dftfs.fem.recover import recover_stress
from tests.cases.fem import ring_part, slotted_sector, straight_bar

YOUNG, POISSON, THICKNESS = 68e9, 0.33, 0.007
CUTS = {"cut_low": "low2", "cut_high": "high2"}


def spring(mesh, **changes):
    """Bore held, rim turned about the centre."""
    given = {
        "mesh": mesh,
        "youngs_modulus_Pa": YOUNG,
        "poisson_ratio": POISSON,
        "thickness_m": THICKNESS if mesh.dim == 2 else None,
        "supports": (clamped(mesh.boundary_nodes("low1")),),
        "drive": rigid_rotation(mesh, mesh.boundary_nodes("high1")),
    }
    return StaticProblem(**{**given, **changes})


@pytest.fixture(scope="module")
def ring():
    return replicated(slotted_sector(3), 3, **CUTS)


@pytest.fixture(scope="module")
def path(ring):
    return solve_path(spring(ring), np.linspace(0.02, 0.2, 10))


def test_one_increment_many_and_adaptive_ones_reach_the_same_state(ring, path):
    many = path.states[-1]
    one = solve_path(spring(ring), [0.2])
    few = solve_path(spring(ring), [0.2], initial_step=0.03, max_step=0.1)
    assert len(one.states) == 2
    assert 3 < len(few.states) < 8
    for state in (one.states[-1], few.states[-1]):
        assert state.drive_force == pytest.approx(many.drive_force, rel=1e-9)
        assert state.drive_stiffness == pytest.approx(many.drive_stiffness, rel=1e-8)
        np.testing.assert_allclose(state.displacement_m, many.displacement_m, atol=1e-11)


def test_fixed_increments_need_about_one_factorisation_each(path):
    assert [s.t for s in path.states] == pytest.approx(np.linspace(0, 0.2, 11))
    assert max(s.factorisations for s in path.states[3:]) == 1
    assert max(s.iterations for s in path.states[3:]) <= 4


def test_work_of_the_drive_is_the_strain_energy(ring):
    """Cubic Hermite quadrature of T and dT/dt over the increments, exact to the fourth order."""
    work, states = 0.0, solve_path(spring(ring), np.linspace(0.01, 0.2, 20)).states
    for a, b in pairwise(states):
        h = b.t - a.t
        work += h * (a.drive_force + b.drive_force) / 2
        work += h**2 * (a.drive_stiffness - b.drive_stiffness) / 12
        assert b.energy_J == pytest.approx(work, rel=1e-7)


def test_stiffness_is_the_slope_of_the_torque(ring):
    step = 1e-4
    path = solve_path(spring(ring), [0.15 - step, 0.15, 0.15 + step], tolerance=1e-11)
    before, here, after = path.states[1:]
    slope = (after.drive_force - before.drive_force) / (2 * step)
    assert here.drive_stiffness == pytest.approx(slope, rel=1e-7)
    rate = (after.displacement_m - before.displacement_m) / (2 * step)
    np.testing.assert_allclose(here.rate_m, rate, atol=1e-6 * np.abs(rate).max())


def test_linear_tangent_is_the_stiffness_at_rest(ring, path):
    assert linear_tangent(spring(ring)) == path.states[0].drive_stiffness
    small = solve_path(spring(ring), [1e-6]).states[-1]
    assert small.drive_force / 1e-6 == pytest.approx(linear_tangent(spring(ring)), rel=1e-5)


def test_reactions_balance_in_the_deformed_shape(ring, path):
    """The bore's moment is minus the rim's, about any point, and the forces cancel."""
    state = path.states[-1]
    here, force = ring.nodes + state.displacement_m, state.reaction_N
    held = np.zeros(len(here), dtype=bool)
    held[ring.boundary_nodes("low1")] = held[ring.boundary_nodes("high1")] = True
    scale = np.abs(force).max()
    assert np.abs(force[~held]).max() < 1e-8 * scale
    assert np.abs(force.sum(axis=0)).max() < 1e-8 * scale
    moment = here[:, 0] * force[:, 1] - here[:, 1] * force[:, 0]
    bore, rim = (moment[ring.boundary_nodes(name)].sum() for name in ("low1", "high1"))
    assert rim == pytest.approx(state.drive_force, rel=1e-12)
    assert bore == pytest.approx(-rim, rel=1e-8)


@pytest.mark.parametrize("solid", [False, True], ids=["plane", "solid"])
def test_a_cyclic_sector_is_the_whole_ring(solid):
    sector = slotted_sector(3)
    if solid:
        sector = extruded(sector, np.array([0.0, 0.004]))
    whole = replicated(sector, 3, **CUTS)
    parts, rings = (
        solve_path(p, [0.1, 0.2]).states
        for p in (spring(sector, cyclic=cyclic_symmetry(sector, 3, **CUTS)), spring(whole))
    )
    for part, ring in zip(parts, rings):
        assert 3 * part.drive_force == pytest.approx(ring.drive_force, rel=1e-8, abs=1e-12)
        assert 3 * part.drive_stiffness == pytest.approx(ring.drive_stiffness, rel=1e-8)
        assert 3 * part.energy_J == pytest.approx(ring.energy_J, rel=1e-8, abs=1e-15)
    # nodes of the first copy come first in the ring, but for the cut that belongs to the second
    own = np.setdiff1d(np.arange(len(sector.nodes)), sector.boundary_nodes("high2"))
    np.testing.assert_allclose(
        parts[-1].displacement_m[own], rings[-1].displacement_m[: len(own)], atol=1e-11
    )


def test_many_steps_do_not_part_a_cut_or_a_free_rim(ring):
    """Extrapolation multiplies round-off by some twenty a step: constraints are kept exactly."""
    steps = np.linspace(0.005, 0.1, 20)
    sector = slotted_sector(3)
    cyclic = cyclic_symmetry(sector, 3, **CUTS)
    rim = ring.boundary_nodes("high1")
    free = rigid_rotation(ring, rim, free_translation=True)
    tied = solve_path(spring(sector, cyclic=cyclic), steps).states[-1]
    loose = solve_path(spring(ring, drive=free), steps).states[-1]
    u = tied.displacement_m
    np.testing.assert_allclose(
        u[cyclic.slave_nodes], u[cyclic.master_nodes] @ cyclic.rotation.T, rtol=0, atol=1e-15
    )
    shift = (loose.displacement_m - solve_path(spring(ring), [0.1]).states[-1].displacement_m)[rim]
    np.testing.assert_allclose(shift, np.tile(shift[0], (len(rim), 1)), rtol=0, atol=1e-15)
    assert 3 * tied.drive_force == pytest.approx(loose.drive_force, rel=1e-8)


def test_stress_at_the_cuts_of_a_sector_is_that_of_the_whole_ring():
    sector = slotted_sector(3)
    whole = replicated(sector, 3, **CUTS)
    part, ring = spring(sector, cyclic=cyclic_symmetry(sector, 3, **CUTS)), spring(whole)
    found, exact = (
        recover_stress(p, solve_path(p, [0.1]).states[-1].displacement_m) for p in (part, ring)
    )
    low, high = part.cyclic.master_nodes, part.cyclic.slave_nodes
    np.testing.assert_array_equal(found.von_mises_Pa[low], found.von_mises_Pa[high])
    own = np.setdiff1d(np.arange(len(sector.nodes)), high)
    scale = exact.von_mises_Pa.max()
    np.testing.assert_allclose(
        found.von_mises_Pa[own], exact.von_mises_Pa[: len(own)], atol=1e-7 * scale
    )


def test_a_mirror_at_mid_plane_halves_the_body():
    planar = slotted_sector(3)
    full = extruded(planar, np.array([-0.004, 0.0, 0.004]))
    half = extruded(planar, np.array([0.0, 0.004]))
    rim, bore = half.boundary_nodes("high1"), half.boundary_nodes("low1")
    mid = np.setdiff1d(half.boundary_nodes("bottom"), np.union1d(rim, bore))
    sides = []
    for mesh, mirror in ((full, ()), (half, (clamped(mid, (2,)),))):
        problem = spring(mesh, supports=(clamped(mesh.boundary_nodes("low1")), *mirror))
        cyclic = cyclic_symmetry(mesh, 3, **CUTS)
        sides.append(solve_path(replace(problem, cyclic=cyclic), [0.1]).states[-1])
    assert 2 * sides[1].drive_force == pytest.approx(sides[0].drive_force, rel=1e-8)


def test_a_free_centre_stays_put_in_a_ring_of_equal_arms(ring, path):
    rim = ring.boundary_nodes("high1")
    free = spring(ring, drive=rigid_rotation(ring, rim, free_translation=True))
    state = solve_path(free, [0.2]).states[-1]
    assert state.drive_force == pytest.approx(path.states[-1].drive_force, rel=1e-8)
    assert state.drive_stiffness == pytest.approx(path.states[-1].drive_stiffness, rel=1e-7)
    assert np.abs(state.reaction_N[rim].sum(axis=0)).max() < 1e-6


def test_a_free_centre_moves_where_the_arms_are_not_equal():
    """Half a ring: no net force on the rim, whatever the centre it is turned about."""
    mesh = ring_part(0.03, 0.04, np.pi, 12, 2)
    ends = []
    for centre in ((0.0, 0.0), (-0.02, 0.013)):
        drive = rigid_rotation(
            mesh, mesh.boundary_nodes("high2"), centre_m=centre, free_translation=True
        )
        held = (clamped(mesh.boundary_nodes("low2")),)
        ends.append(solve_path(spring(mesh, supports=held, drive=drive), [0.4]).states[-1])
    assert ends[0].drive_force == pytest.approx(ends[1].drive_force, rel=1e-8)
    assert ends[0].drive_stiffness == pytest.approx(ends[1].drive_stiffness, rel=1e-7)
    np.testing.assert_allclose(ends[0].displacement_m, ends[1].displacement_m, atol=1e-10)


def test_solvers_agree_on_the_whole_path(ring, path):
    pytest.importorskip("pypardiso")
    other = solve_path(spring(ring), [0.1, 0.2], solver="superlu")
    assert (path.solver, other.solver) == ("pardiso", "superlu")
    for t in (0.1, 0.2):
        assert other.at(t).drive_force == pytest.approx(path.at(t).drive_force, rel=1e-9)


def test_targets_may_turn_back_and_lead_to_the_same_states(ring, path):
    loop = solve_path(spring(ring), [0.1, 0.2, 0.1, 0.0, -0.1])
    there, back = loop.states[1], loop.states[3]
    assert back.drive_force == pytest.approx(there.drive_force, rel=1e-9)
    assert abs(loop.at(0.0).drive_force) < 1e-7 * there.drive_force
    assert loop.states[-1].drive_force < 0


def test_a_load_that_acts_from_the_start_is_balanced_at_rest():
    """The same forces, grown from zero or there at t = 0, bend a bar alike."""
    bar = straight_bar(0.2, 0.01, 12, 1)
    load = traction_forces(bar, "high1", np.array([0.0, 3e6]), thickness_m=THICKNESS)
    held = (clamped(bar.boundary_nodes("low1")),)
    grown = solve_path(
        spring(bar, supports=held, drive=None, dead_load_N=proportional(load)), [2.0]
    )
    present = solve_path(
        spring(bar, supports=held, drive=None, dead_load_N=lambda t: ((1 + t) * load, load)),
        [1.0],
    )
    np.testing.assert_allclose(
        present.states[-1].displacement_m, grown.states[-1].displacement_m, atol=1e-10
    )
    assert present.states[0].energy_J > 0


def test_work_of_a_dead_load_is_the_strain_energy():
    bar = straight_bar(0.2, 0.01, 12, 1)
    load = traction_forces(bar, "high1", np.array([0.0, 8e6]), thickness_m=THICKNESS)
    held = (clamped(bar.boundary_nodes("low1")),)
    problem = spring(bar, supports=held, drive=None, dead_load_N=proportional(load))
    states = solve_path(problem, np.linspace(0.05, 1, 20)).states
    # integral of t F . du = t F . u - integral of F . u dt, the latter by Hermite quadrature
    area = 0.0
    for a, b in pairwise(states):
        h = b.t - a.t
        area += h * np.vdot(load, a.displacement_m + b.displacement_m) / 2
        area += h**2 * np.vdot(load, a.rate_m - b.rate_m) / 12
    work = states[-1].t * np.vdot(load, states[-1].displacement_m) - area
    assert work == pytest.approx(states[-1].energy_J, rel=1e-6)
    assert np.abs(states[-1].displacement_m).max() > 0.02  # a tenth of the bar: not linear


def test_the_caller_can_stop_the_path_and_hears_of_every_state(ring):
    heard = []
    path = solve_path(
        spring(ring),
        np.linspace(0.02, 0.2, 10),
        on_progress=heard.append,
        step_callback=lambda state: state.t > 0.05,
    )
    assert path.stopped
    assert path.states[-1].t == pytest.approx(0.06)
    assert [s.t for s in heard] == [s.t for s in path.states[1:]]


def test_an_interruption_passes(ring):
    def interrupt(state):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_path(spring(ring), [0.1], on_progress=interrupt)


def test_a_body_that_can_move_freely_is_refused():
    bar = straight_bar(0.2, 0.01, 6, 1)
    load = traction_forces(bar, "high1", np.array([0.0, 1e6]), thickness_m=THICKNESS)
    pinned = (clamped(bar.nodes[:, 0].argmin()[None]),)
    for solver in ("auto", "superlu"):
        with pytest.raises(SolveError, match="no equilibrium at t=0: the tangent is singular"):
            solve_path(
                spring(bar, supports=pinned, drive=None, dead_load_N=proportional(load)),
                [1.0],
                solver=solver,
            )


def test_a_path_without_an_end_says_where_it_got_and_what_would_help():
    """A bar pushed to less than no length: only a part of the way has an equilibrium."""
    bar = straight_bar(0.02, 0.01, 2, 1)
    end = bar.boundary_nodes("high1")
    moved_by = np.tile([-0.02, 0.0], (len(end), 1))
    drive = replace(
        rigid_rotation(bar, end), motion=lambda t: (t * moved_by, moved_by, 0 * moved_by)
    )
    with pytest.raises(SolveError) as caught:
        solve_path(spring(bar, drive=drive), [1.5])
    message = str(caught.value)
    assert message.startswith("no equilibrium beyond t=0.")
    assert "towards 1.5" in message
    assert "would help" in message
    assert "\n" not in message


def test_an_increment_too_large_is_cut_not_refused():
    """A quarter turn of a stubby bar in one increment."""
    bar = straight_bar(0.04, 0.01, 8, 2)
    end = bar.boundary_nodes("high1")
    drive = rigid_rotation(bar, end, centre_m=(0.04, 0.0), free_translation=True)
    problem = spring(bar, drive=drive)
    one = solve_path(problem, [2.5]).states[-1]
    many = solve_path(problem, [2.5], max_step=0.1).states[-1]
    assert one.drive_force == pytest.approx(many.drive_force, rel=1e-8)


def test_instability_shows_in_the_pivots():
    """Euler's column, E I pi^2 / (4 L^2): stable below, unstable above if nothing disturbs it."""
    bar = straight_bar(0.2, 0.004, 16, 1)
    critical = YOUNG * THICKNESS * 0.004**3 / 12 * np.pi**2 / (4 * 0.2**2)
    unit = np.array([-1.0, 0.0]) / (0.004 * THICKNESS)
    load = traction_forces(bar, "high1", unit, thickness_m=THICKNESS)
    start, corner = bar.boundary_nodes("low1"), bar.nodes.sum(axis=1).argmin()[None]
    problem = spring(
        bar,
        poisson_ratio=0.0,
        supports=(clamped(start, (0,)), clamped(corner, (1,))),
        drive=None,
        dead_load_N=proportional(load),
    )
    path = solve_path(problem, [0.995 * critical, 1.005 * critical])
    assert [s.negative_pivots for s in path.states] == [0, 0, 1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"youngs_modulus_Pa": 0.0}, "youngs_modulus_Pa=0.0 must be above 0"),
        ({"poisson_ratio": 0.5}, r"poisson_ratio=0.5 must be in \(-1, 0.5\)"),
        ({"thickness_m": None}, "thickness_m=None must be above 0 for a planar mesh"),
        ({"drive": None}, "nothing depends on t"),
    ],
)
def test_numbers_out_of_range_are_refused_by_name(ring, changes, message):
    with pytest.raises(SolveError, match=message):
        spring(ring, **changes)


def test_a_solid_has_no_thickness(ring):
    solid = extruded(slotted_sector(3), np.array([0.0, 0.004]))
    with pytest.raises(SolveError, match=r"thickness_m=0\.007 has no meaning for a solid"):
        spring(solid, thickness_m=THICKNESS)


SECTOR = slotted_sector(3)
RIM, BORE = SECTOR.boundary_nodes("high1"), SECTOR.boundary_nodes("low1")
CYCLIC = cyclic_symmetry(SECTOR, 3, **CUTS)
FREE_CENTRE = rigid_rotation(SECTOR, RIM, free_translation=True)
SWAPPED = CyclicSymmetry(
    slave_nodes=CYCLIC.slave_nodes, master_nodes=CYCLIC.slave_nodes, rotation=np.eye(2)
)
NO_LOAD = proportional(np.zeros(SECTOR.nodes.shape))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"supports": (clamped(BORE), clamped(RIM[:2]))}, "a driven node is also held"),
        ({"supports": (clamped(np.array([-1])),)}, "support: needs node numbers in 0"),
        ({"drive": FREE_CENTRE, "cyclic": CYCLIC}, "no meaning in a cyclic sector"),
        ({"drive": replace(FREE_CENTRE, components=(1,))}, "needs every direction"),
        (
            {"supports": (clamped(np.setdiff1d(BORE, CYCLIC.slave_nodes)),), "cyclic": CYCLIC},
            "not held in the same directions",
        ),
        ({"supports": (clamped(BORE, (0,)),), "cyclic": CYCLIC}, "some of the directions"),
        ({"cyclic": SWAPPED}, "partners, none of them both"),
        (
            {
                "supports": (clamped(np.arange(len(SECTOR.nodes))),),
                "drive": None,
                "dead_load_N": NO_LOAD,
            },
            "nothing to solve for",
        ),
    ],
)
def test_contradicting_constraints_are_refused(changes, message):
    problem = spring(SECTOR, **changes)
    with pytest.raises(SolveError, match=message):
        linear_tangent(problem)


@pytest.mark.parametrize(
    ("targets", "options", "message"),
    [
        ([], {}, "targets must be finite numbers, at least one"),
        ([np.nan], {}, "targets must be finite numbers"),
        ([0.1], {"max_step": 0.0}, "max_step=0.0 must be above 0"),
        ([0.1], {"initial_step": -1.0}, "initial_step=-1.0 must be above 0"),
        ([0.1], {"solver": "gauss"}, "solver 'gauss' is unknown"),
    ],
)
def test_arguments_out_of_range_are_refused(ring, targets, options, message):
    with pytest.raises(SolveError, match=message):
        solve_path(spring(ring), targets, **options)


def test_a_state_never_reached_is_not_invented(path):
    with pytest.raises(SolveError, match=r"no state at t=0.123; the path has"):
        path.at(0.123)


def test_traction_needs_a_component_per_dimension_and_sums_to_the_force():
    solid = extruded(straight_bar(0.2, 0.01, 3, 2), np.array([0.0, 0.003]))
    traction = np.array([1e5, -2e5, 4e5])
    forces = traction_forces(solid, "high1", traction)
    np.testing.assert_allclose(forces.sum(axis=0), traction * 0.01 * 0.003)
    moment = np.cross(solid.nodes - [0.2, 0.0, 0.0015], forces).sum(axis=0)
    np.testing.assert_allclose(moment, 0, atol=1e-12)
    with pytest.raises(SolveError, match="needs 3 components"):
        traction_forces(solid, "high1", traction[:2])


def test_stress_of_a_displacement_of_the_wrong_shape_is_refused(ring):
    with pytest.raises(SolveError, match=r"displacement_m has shape \(4, 2\); the mesh needs"):
        recover_stress(spring(ring), np.zeros((4, 2)))
