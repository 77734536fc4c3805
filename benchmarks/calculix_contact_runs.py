"""The processes of `benchmarks/calculix_contact.py`: CalculiX' decks, and ours on the same mesh."""

from pathlib import Path

import numpy as np
from calculix_deck import load_model, save_model
from numpy.typing import NDArray

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import full_mesh, solid_mesh
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.ring_fields import bare_model
from dftfs.design import load_design
from dftfs.fem.constraints import clamped, rigid_rotation
from dftfs.fem.contact import ContactLaw, ContactSurfaces
from dftfs.fem.deck import TIGHT_RESIDUAL, Model, deck, element_faces
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem

# to 0.3 rad only the tip meets a coil; all along the coils CalculiX finds contact where there is
# none (springs by the ten thousand, torque twice too large), so both are given this neighbourhood
CEILING = ("tip_round", "arm_inner")
SIZING = MeshSizing()  # the mesh of `dftfs study`
HALVES = 2  # half the width is solved on, by both: the mid-plane is a mirror
SLAVE_REACH_M, MASTER_REACH_M = 8e-3, 16e-3
CONTACT_FROM_RAD = 0.18  # before, no coil is near another: CalculiX is spared the search
DEFLECTIONS_RAD = tuple(np.round(0.03 * np.arange(1, 11), 3).tolist())
LIMIT = f"*CONTROLS, PARAMETERS=FIELD\n{TIGHT_RESIDUAL}\n"  # as `deck` writes it with `tight`


def torsion_problem() -> TorsionProblem:
    """The design ``al1``, one layer through half the width."""
    return TorsionProblem(design=load_design("al1"), sizing=SIZING)


def make_mesh(folder: Path) -> None:
    """The whole ring of both arms, half the width, and the surfaces that may touch."""
    problem = torsion_problem()
    design = problem.design
    levels_m = np.array([0.0, design.width_m / 2])
    ring = full_mesh(solid_mesh(problem.sector, levels_m), design.n_arms)
    save_model(folder / "model.npz", bare_model(ring, design.material))
    law = problem.contact.law
    arms = design.n_arms
    # a ring's boundary holds one copy of the sector's after the other; the outer edge of the
    # next arm faces the inner edge and the tip of this one
    ceiling = np.concatenate([ring.facets(n).reshape(arms, -1, 8) for n in CEILING], axis=1)
    floor = np.roll(ring.facets("arm_outer").reshape(arms, -1, 8), -1, axis=0)
    tip = ring.nodes[ring.facets("tip_round").reshape(arms, -1)].mean(axis=1)
    np.savez(
        folder / "contact.npz",
        ceiling=[_near(ring, *pair, SLAVE_REACH_M) for pair in zip(ceiling, tip)],
        floor=[_near(ring, *pair, MASTER_REACH_M) for pair in zip(floor, tip)],
        mirror=ring.facets("bottom"),
        law=[law.stiffness_Pa_per_m, law.smoothing_m, law.reach_m, law.deepest_m],
    )


def _near(
    ring: TaggedMesh, facets: NDArray[np.int32], place_m: NDArray[np.float64], reach_m: float
) -> NDArray[np.int32]:
    """Facets whose middle is near a place in the plane."""
    away = ring.nodes[facets].mean(axis=1)[:, :2] - place_m[:2]
    return facets[np.hypot(*away.T) < reach_m]


def contact_deck(folder: Path, deflections_rad: NDArray[np.float64]) -> str:
    """The deck of the model and the contact that `make_mesh` wrote."""
    model = load_model(folder / "model.npz")
    with np.load(folder / "contact.npz") as stored:
        pairs = list(zip(stored["ceiling"], stored["floor"]))
        stiffness, mirror = float(stored["law"][0]), stored["mirror"]
    return paired_deck(
        model, mirror, pairs, deflections_rad, stiffness=stiffness, from_rad=CONTACT_FROM_RAD
    )


def paired_deck(
    model: Model,
    mirror: NDArray[np.int32],
    pairs: list[tuple[NDArray[np.int32], NDArray[np.int32]]],
    deflections_rad: NDArray[np.float64],
    *,
    stiffness: float,
    from_rad: float,
    tight: bool = False,
) -> str:
    """`calculix_deck.deck` with a mirror plane, pairs of surfaces, increments of CalculiX' choice.

    Parameters
    ----------
    mirror : int array
        Nodes or facets of the plane that stays plane.
    pairs : list of (slave, master)
        Facets that may touch, added in the first step beyond ``from_rad``.
    stiffness : float
        Of the linear pressure-overclosure, Pa/m.
    tight : bool
        Lower the limit of the residual in steps without contact, as `deck` does.
    """
    lines = [
        "*NSET, NSET=MIRROR",
        *(f"{node + 1}," for node in np.setdiff1d(mirror, np.union1d(model.bore, model.rim))),
        "*BOUNDARY",
        "MIRROR, 3, 3",
        "*SURFACE INTERACTION, NAME=TOUCH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{stiffness!r}, 0., 1.e-5",  # springs from a clearance of 10 um on
    ]
    for arm, (slave, master) in enumerate(pairs):
        lines += [f"*SURFACE, NAME=CEILING{arm}", *element_faces(model.cells, slave)]
        lines += [f"*SURFACE, NAME=FLOOR{arm}", *element_faces(model.cells, master)]
        lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE"]
        lines += [f"CEILING{arm}, FLOOR{arm}"]
    head, *steps = deck(model, deflections_rad, tight=tight).split("*STEP, NLGEOM")
    names = [f"CEILING{arm}, FLOOR{arm}" for arm in range(len(pairs))]
    for k, deflection in enumerate(deflections_rad):
        if k == 0:
            steps[k] = _change(steps[k], "REMOVE", names)
        if abs(deflection) > from_rad:
            steps[k] = steps[k].replace("*STATIC, DIRECT\n1., 1.", "*STATIC\n0.1, 1.")
            steps[k] = steps[k].replace(LIMIT, "*CONTROLS, RESET\n")
            if abs(deflections_rad[k - 1]) <= from_rad:
                steps[k] = _change(steps[k], "ADD", names)
    steps = [f"*STEP, NLGEOM, INC=1000{step}" for step in steps]
    written = "\n".join([head.rstrip(), *lines, *steps])
    return written.replace("*NODE PRINT,", "*NODE PRINT, FREQUENCY=1000,")  # the last increment's


def _change(step: str, what: str, pairs: list[str]) -> str:
    changes = "".join(f"*MODEL CHANGE, TYPE=CONTACT PAIR, {what}\n{pair}\n" for pair in pairs)
    return step.replace("*STATIC", f"{changes}*STATIC", 1)


def solve_ring(folder: Path, name: str, deflections_rad: list[float]) -> None:
    """The whole ring through the deflections; torques go to ``name``.npz."""
    model = load_model(folder / "model.npz")
    with np.load(folder / "contact.npz") as stored:
        floor, ceiling = (stored[name].reshape(-1, 8) for name in ("floor", "ceiling"))
        law, mirror = stored["law"].tolist(), stored["mirror"]
    facets = {"bore": model.bore, "rim": model.rim, "floor": floor, "ceiling": ceiling}
    mesh = TaggedMesh(nodes=model.nodes_m, cells=model.cells, boundaries=facets)
    contact = ContactSurfaces(
        slave=mesh.facets("ceiling"),
        master=mesh.facets("floor"),
        turns=(np.eye(3),),
        law=ContactLaw(
            stiffness_Pa_per_m=law[0], smoothing_m=law[1], reach_m=law[2], deepest_m=law[3]
        ),
    )
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=model.youngs_modulus_Pa,
        poisson_ratio=model.poisson_ratio,
        supports=(
            clamped(mesh.boundary_nodes("bore")),
            clamped(np.setdiff1d(mirror, np.union1d(model.bore, model.rim)), components=(2,)),
        ),
        drive=rigid_rotation(mesh, mesh.boundary_nodes("rim")),
        contact=contact,
    )
    _solve(folder, name, problem, HALVES, deflections_rad)


def solve_sector(folder: Path, name: str, deflections_rad: list[float]) -> None:
    """Mesh and solve one sector, half its width: the same answer by symmetry."""
    problem = torsion_problem()
    _solve(folder, name, problem.static_problem(contact=True), problem.copies, deflections_rad)


def _solve(
    folder: Path, name: str, problem: StaticProblem, copies: int, deflections_rad: list[float]
) -> None:
    path = solve_path(problem, deflections_rad)
    np.savez(
        folder / f"{name}.npz",
        torque_Nm=[copies * path.at(t).drive_force for t in deflections_rad],
        penetration_m=max(s.touch.penetration_m for s in path.states[1:]),
        corrections=sum(s.iterations for s in path.states[1:]),
        factorisations=sum(s.factorisations for s in path.states[1:]),
        unknowns=problem.mesh.nodes.size,
    )
