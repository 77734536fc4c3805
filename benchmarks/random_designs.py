"""Random designs against CalculiX, each on a mesh of its own exported STEP file.

    python benchmarks/random_designs.py --seed 0 --count 4 --against ccx

A design has 2 to 4 arms, a strip that may taper, a material of the table. Ours is the 3D model on
the default mesh, one sector and half the width; CalculiX solves the whole ring (half the width) on
`calculix_step_mesh`. Compared in the direction that touches first: torque at 0.6, 0.97 and 0.995 of
the first contact's deflection; the first contact itself, where CalculiX' gap is zero by the line
through the last two; the peak von Mises stress of notch, slit and arm at 0.6, against the error
bar that `mesh_series` states. Every fourth design goes on with contact, to 1.06 and 1.12 of the
first contact's deflection; CalculiX is given the neighbourhood of the place where ours touches.

Each design is filed when it is done and not solved again; one that failed is tried again. About two
minutes of CPU a design without contact, five and more with it, of which the steps that CalculiX
reaches within its limit count. Exit status 1 if a design failed, 2 without ccx.
"""

import argparse
import json
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from calculix import write_json
from calculix_contact import limited_calculix
from calculix_contact_runs import HALVES, paired_deck
from calculix_deck import torques_Nm, von_mises
from calculix_fields import frd_fields, regional_peaks_Pa, smallest_gap_m
from calculix_runs import ROOT, progress
from calculix_step_mesh import StepMeshSizing, step_ring
from near_designs import random_design
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.analysis.strength.mesh_series import mesh_series, nominal_stiffness
from dftfs.analysis.torsion.contact_path import (
    ContactPath,
    continued_in_contact,
    estimated_onset,
    path_to_contact,
)
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import SIGN
from dftfs.analysis.torsion.ring_fields import bare_model
from dftfs.cad.export import export_design
from dftfs.design import SpringDesign
from dftfs.errors import DftfsError
from dftfs.fem.mesh import TaggedMesh, rotation_about_z
from dftfs.material import lookup

MATERIALS = (
    "al-7075-t6",
    "stainless-17-4ph-h900",
    "titanium-grade-2",
    "titanium-6al-4v",
    "spring-steel-1095",
)
FREE, TOUCHING = (0.6, 0.97, 0.995), (1.06, 1.12)  # of the first contact's deflection
CONTACT_EVERY = 4
LIMIT_S = 1800.0  # of CPU time for one run of CalculiX
REACHES = (1.0, 2.0)  # of the strip: how far the slave and the master go beyond the touch


def drawn(seed: int, number: int) -> SpringDesign:
    """Design ``number`` of a seed, the same whatever came before it."""
    rng = np.random.default_rng([seed, number])
    while True:
        design = random_design(rng, number)
        material = lookup(MATERIALS[rng.integers(len(MATERIALS))])
        width_m = 1e-3 * rng.uniform(5, 12)
        at_rim = design.spiral.thickness_m * (rng.uniform(0.75, 1.0) if rng.random() < 0.5 else 1)
        spiral = design.spiral
        if at_rim < spiral.thickness_m:
            spiral = replace(spiral, rim_thickness_m=at_rim)
        try:
            return replace(design, spiral=spiral, material=material, width_m=width_m)
        except DftfsError:
            continue


def first_direction(problem: TorsionProblem) -> tuple[float, float]:
    """Sign and deflection of the direction whose coils touch first: by plane stress, then in 3D."""
    planar = replace(problem, dimension=2)
    static = planar.static_problem()
    found = {sign: estimated_onset(planar, static, sign, "auto") for sign in SIGN.values()}
    sign = min(found, key=found.__getitem__)
    near = found[sign]
    for model in (planar, problem):
        onset = path_to_contact(model, model.static_problem(), sign, near, 2, [], "auto").onset
        near = near if onset is None else abs(onset.deflection_rad)
    return sign, near


def ours(problem: TorsionProblem, sign: float, near: float, touching: bool) -> ContactPath:
    """Our path through the deflections that are compared."""
    static = problem.static_problem()
    path = path_to_contact(problem, static, sign, near, 3, [part * near for part in FREE], "auto")
    if touching:
        extra = [part * near for part in TOUCHING]
        path = continued_in_contact(problem, path, sign * extra[-1], 1, extra)
    return path


def touching_pairs(
    problem: TorsionProblem, path: ContactPath, ring: TaggedMesh
) -> list[tuple[NDArray[np.int32], NDArray[np.int32]]]:
    """Facets of CalculiX' mesh near where ours is pressed at the end: (slave, master) per arm."""
    touch, surfaces, mesh = path.states[-1].touch, problem.contact, problem.mesh
    slave, point = np.nonzero(touch.pressure_Pa > 0)
    turn, master = np.divmod(touch.found[slave, point], len(surfaces.master))
    below = mesh.nodes[surfaces.slave[slave]].mean(axis=1)[:, :2]
    facing = mesh.nodes[surfaces.master[master]].mean(axis=1)
    above = np.array([(surfaces.turns[k] @ x)[:2] for k, x in zip(turn, facing)])
    reaches = [part * problem.design.spiral.thickness_m for part in REACHES]
    pairs = []
    for arm in range(problem.design.n_arms):
        turned = rotation_about_z(2 * np.pi * arm / problem.design.n_arms, 2)
        pair = []
        for name, places, reach in zip(("ceiling", "floor"), (below, above), reaches):
            facets = ring.facets(name)
            middle = ring.nodes[facets].mean(axis=1)[:, :2]
            pair.append(facets[cKDTree(places @ turned.T).query(middle)[0] < reach])
        pairs.append((pair[0], pair[1]))
    return pairs


def theirs(
    folder: Path,
    problem: TorsionProblem,
    ring: TaggedMesh,
    deflections_rad: NDArray[np.float64],
    pairs: list[tuple[NDArray[np.int32], NDArray[np.int32]]],
) -> dict:
    """Torques of every step reached, gaps of mid-plane and stresses of those without contact.

    Raises
    ------
    DftfsError
        If CalculiX does not come to the steps in contact, or to its end without them.
    """
    design = problem.design
    model = bare_model(ring, design.material)
    text = paired_deck(
        model,
        ring.facets("bottom"),
        pairs,
        deflections_rad,
        stiffness=problem.contact.law.stiffness_Pa_per_m,
        from_rad=float(np.max(np.abs(deflections_rad[: len(FREE)]))),
        tight=True,
    )
    text = text.replace("*EL PRINT, ELSET=SPRING\nS\n*EL FILE\nS\n", "")
    fields = "*NODE FILE, FREQUENCY=1000\nU\n*EL FILE, FREQUENCY=1000\nS\n*END STEP"
    text = text.replace("*STATIC, DIRECT", "*STATIC").replace("*END STEP", fields)
    (folder / "ring.inp").write_text(text)
    cpu_s, finished = limited_calculix(folder, "ring", LIMIT_S)
    dat = (folder / "ring.dat").read_text()
    reached = dat.count("forces (fx,fy,fz)")  # one a step; contact may be cut short by the limit
    if not finished and reached <= len(FREE):
        steps = (folder / "ring.sta").read_text().splitlines()
        raise DftfsError(f"CalculiX ended after {cpu_s:.0f} s of CPU; its last step: {steps[-1]}")
    frd = (folder / "ring.frd").read_text()
    spiral = design.spiral
    stress = von_mises(frd_fields(frd, "STRESS", 6)[0])
    return {
        "cpu_s": cpu_s,
        "torque_Nm": HALVES * torques_Nm(dat, model, len(deflections_rad) if finished else reached),
        "gap_m": [
            smallest_gap_m(ring, moved, design.outline)
            for moved in frd_fields(frd, "DISP", 3)[: len(FREE)]
        ],
        "stress_Pa": regional_peaks_Pa(
            ring,
            stress,
            max(2 * spiral.fillet_radius_m, spiral.thickness_m / 4),
            (spiral.hub_radius_m, spiral.rim_inner_radius_m),
        ),
    }


def onset_by_gap(deflection: NDArray, torque: NDArray, gap: list[float]) -> tuple[float, float]:
    """Deflection and torque at which the line through the last two gaps is zero."""
    part = gap[-1] / (gap[-2] - gap[-1])
    return (
        float(deflection[-1] + part * (deflection[-1] - deflection[-2])),
        float(torque[-1] + part * (torque[-1] - torque[-2])),
    )


def compared(design: SpringDesign, touching: bool, folder: Path) -> dict:
    """One design by both, as a record."""
    begun = time.process_time()
    problem = TorsionProblem(design=design)
    sign, near = first_direction(problem)
    path = ours(problem, sign, near, touching)
    if path.onset is None:
        raise DftfsError("no coils touch within 1 rad")
    parts = FREE + (TOUCHING if touching else ())
    wanted = sign * near * np.array(parts)
    at = {state.t: problem.copies * state.drive_force for state in path.states}
    own = np.array([at[float(t)] for t in wanted])  # CalculiX may reach fewer
    judged_Nm = wanted[0] * nominal_stiffness(problem)  # so that the bars are of this angle
    series = mesh_series(problem, judged_Nm, contact=False)
    own_s = time.process_time() - begun
    exported = export_design(design, folder, formats=("step",))
    ring = step_ring(exported.files["step"], design, StepMeshSizing())
    pairs = touching_pairs(problem, path, ring) if touching else []
    found = theirs(folder, problem, ring, wanted, pairs)
    torque, free = found["torque_Nm"], slice(0, len(FREE))
    own, wanted = own[: len(torque)], wanted[: len(torque)]
    turned, touched = onset_by_gap(wanted[free], torque[free], found["gap_m"])
    stresses = []
    for bar in series:
        region = bar.quantity.split(", ")[1] if bar.quantity.startswith("stress") else ""
        if region in found["stress_Pa"]:
            value = 1e-6 * found["stress_Pa"][region] * abs(judged_Nm / torque[0])
            stresses.append(
                {
                    "region": region,
                    "ours_MPa": bar.value,
                    "calculix_MPa": value,
                    "error": value / abs(bar.value) - 1,
                    "bar": bar.relative_error,
                    "verdict": bar.verdict,
                    "within": bool(abs(value / abs(bar.value) - 1) <= bar.relative_error),
                }
            )
    return {
        "nodes_calculix": len(ring.nodes),
        "cpu_s": {"ours": own_s, "calculix": found["cpu_s"]},
        "deflection_rad": wanted.tolist(),
        "torque_Nm": {"ours": own.tolist(), "calculix": torque.tolist()},
        "torque_error": np.abs(own / torque - 1)[free].tolist(),
        "contact_torque_error": np.abs(own / torque - 1)[len(FREE) :].tolist(),
        "onset": {
            "ours_rad": path.onset.deflection_rad,
            "calculix_rad": turned,
            "ours_Nm": path.onset.torque_Nm,
            "calculix_Nm": touched,
            "error": abs(path.onset.torque_Nm / touched - 1),
        },
        "stress": stresses,
    }


def described(design: SpringDesign) -> dict:
    """What was drawn."""
    p = design.spiral
    return {
        "name": design.name,
        "arms": design.n_arms,
        "material": design.material.name,
        "width_mm": 1e3 * design.width_m,
        "thickness_mm": 1e3 * p.thickness_m,
        "rim_thickness_mm": None if p.rim_thickness_m is None else 1e3 * p.rim_thickness_m,
        "outer_radius_mm": 1e3 * p.outer_radius_m,
        "turns": p.turns,
        "fillet_radius_mm": 1e3 * p.fillet_radius_m,
    }


def solved(seed: int, number: int) -> dict:
    """The record of one design of a seed, with the reason where it could not be solved."""
    design = drawn(seed, number)
    record: dict = {"seed": seed, "design": described(design)}
    with tempfile.TemporaryDirectory(prefix="random-designs-") as name:
        try:
            touching = number % CONTACT_EVERY == CONTACT_EVERY - 1
            record |= compared(design, touching, Path(name))
        except (DftfsError, RuntimeError, ValueError) as error:
            record["failure"] = " ".join(str(error).split())
    return record


def line_of(record: dict) -> str:
    """A design's result in one line."""
    d = record["design"]
    head = f"{d['name']}: {d['arms']} arms, {d['thickness_mm']:.2f} mm, {d['material']}"
    if "failure" in record:
        return f"{head}: {record['failure']}"
    inside = sum(one["within"] for one in record["stress"])
    text = f"{head}: torque {max(record['torque_error']):.1e}, onset {record['onset']['error']:.1e}"
    if record["contact_torque_error"]:
        text += f", past the knee {max(record['contact_torque_error']):.1e}"
    return f"{text}, stress {inside} of {len(record['stress'])} within their bars"


def summary(records: list[dict]) -> dict:
    """Distribution of the errors over all designs that both solved."""
    solved = [record for record in records if "failure" not in record]
    values = {
        "torque": [max(r["torque_error"]) for r in solved],
        "first contact": [r["onset"]["error"] for r in solved],
        "torque past the knee": [
            max(r["contact_torque_error"]) for r in solved if r["contact_torque_error"]
        ],
        "peak stress": [abs(s["error"]) for r in solved for s in r["stress"]],
    }
    spread = {
        name: {
            "count": len(found),
            "median": float(np.median(found)),
            "p90": float(np.quantile(found, 0.9)),
            "worst": max(found),
        }
        for name, found in values.items()
        if found
    }
    within = [s["within"] for r in solved for s in r["stress"]]
    return {
        "designs": len(records),
        "failed": len(records) - len(solved),
        "errors": spread,
        "stress_within_stated_error": [sum(within), len(within)],
    }


def main() -> int:
    """Solve what is not filed yet, print the distribution, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of designs (default: all)")
    parser.add_argument("--against", choices=("ccx",), default="ccx")
    parser.add_argument("--again", action="store_true", help="solve filed designs once more")
    arguments = parser.parse_args()
    if arguments.count < 1 or min(arguments.only or [0]) < 0:
        parser.error("--count: 1 or more; --only: 0 or more")
    if shutil.which("ccx") is None:
        print("ccx is missing: apt-get install calculix-ccx (Debian)", file=sys.stderr)
        return 2
    filed = ROOT / "out" / "benchmarks" / f"random_designs-{arguments.seed}"
    records = []
    for number in arguments.only or range(arguments.count):
        path = filed / f"{number:04d}.json"
        filed_one = json.loads(path.read_text()) if path.exists() else {"failure": "not solved yet"}
        if "failure" not in filed_one and not arguments.again:
            records.append(filed_one)
        else:
            progress(f"design {number}")
            records.append(solved(arguments.seed, number))
            write_json(path, records[-1])
        print(line_of(records[-1]), flush=True)
    found = summary(records)
    for name, spread in found["errors"].items():
        print(
            f"{name}: median {spread['median']:.1e}, 90 % {spread['p90']:.1e}, worst"
            f" {spread['worst']:.1e} of {spread['count']}"
        )
    inside, count = found["stress_within_stated_error"]
    print(f"peak stress: {inside} of {count} within the stated bars")
    write_json(filed.with_suffix(".json"), found | {"seed": arguments.seed, "records": records})
    return 1 if found["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
