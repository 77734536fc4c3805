"""The rod model against 3D finite elements in stiffness, on designs it was not calibrated on.

    python benchmarks/rod_against_3d.py [PART_OF_A_NAME]

Acceptance: within 1 % over at least six designs, strips of w2 / w1 = 5, 10 and 30 among them
(only designs whose name has the word, if one is given). The root lengths of the rod come from
`benchmarks/root_compliance.py`, whose designs are others. Also printed: first contact unwinding.
"""

import sys
from dataclasses import replace

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import SpringDesign, load_design
from dftfs.fem.newton import linear_tangent
from dftfs.spring.rod import rod_curve
from dftfs.spring.rod_contact import contact_onset

LIMIT = 0.01


def variant(name: str, base: SpringDesign, **changes: float) -> SpringDesign:
    """A design with planar parameters changed and hub and rim following the strip."""
    spiral = replace(base.spiral, **changes)
    follows = {
        "hub_radius_m": spiral.inner_radius_m,
        "bore_radius_m": spiral.inner_radius_m - spiral.thickness_m,
        "rim_inner_radius_m": spiral.outer_radius_m + spiral.thickness_m / 2,
        "rim_outer_radius_m": spiral.outer_radius_m + 1.5 * spiral.thickness_m,
    }
    return replace(base, name=name, spiral=replace(spiral, **follows))


def designs() -> list[SpringDesign]:
    """The acceptance set."""
    al1, ref = load_design("al1"), load_design("ref")
    return [
        al1,
        ref,
        replace(al1, name="al1, w2 = 10 mm", width_m=10e-3),
        variant("ref, w1 = 6 mm", ref, thickness_m=6e-3),
        variant("al1, 1.5 turns", al1, turns=1.5),
        variant("al1, 3 arms, 1.2 turns, w1 = 6 mm", al1, n_arms=3, turns=1.2, thickness_m=6e-3),
        variant(
            "R 15..60 mm, w1 = 5 mm, 1.8 turns, r_f = 1.5 mm",
            ref,
            inner_radius_m=15e-3,
            outer_radius_m=60e-3,
            thickness_m=5e-3,
            turns=1.8,
            fillet_radius_m=1.5e-3,
        ),
        load_design("ti"),
        *(_wide(width_mm) for width_mm in (5, 10, 30)),
    ]


def _wide(width_mm: int) -> SpringDesign:
    """A titanium strip 1 mm thick between R 12 and 40 mm."""
    return variant(
        f"wide Ti, w2 = {width_mm} w1, R 12..40 mm, 1.5 turns",
        replace(load_design("ti"), width_m=1e-3 * width_mm),
        inner_radius_m=12e-3,
        outer_radius_m=40e-3,
        thickness_m=1e-3,
        turns=1.5,
        fillet_radius_m=0.5e-3,
        tip_radius_m=0.1e-3,
    )


def main() -> int:
    """Print the table; 1 if a design misses the limit."""
    worst, word = 0.0, sys.argv[1] if len(sys.argv) > 1 else ""
    print(f"{'design':50s} {'rod':>9s} {'3D':>9s} {'diff %':>7s}   first contact unwinding, Nm")
    for design in (each for each in designs() if word in each.name):
        material = design.material
        elastic = (design.width_m, material.youngs_modulus_Pa, material.poisson_ratio)
        rod = rod_curve(design.outline, *elastic, [0.0], wide=True).stiffness_Nm_per_rad
        problem = TorsionProblem(design=design, dimension=3)
        solid = problem.copies * linear_tangent(problem.static_problem())
        touch = contact_onset(design.outline, *elastic, wide=True).unwinding
        planar = solve_torsion(TorsionProblem(design=design, dimension=2), states_per_direction=4)
        fe = planar.contact_onset["unwinding"]
        contacts = f"rod {touch.torque_Nm:8.3f}, 2D {fe.torque_Nm:8.3f}" if touch and fe else "-"
        difference = rod / solid - 1
        worst = max(worst, abs(difference))
        print(
            f"{design.name:50s} {rod:9.3f} {solid:9.3f} {difference * 100:+7.2f}   {contacts}",
            flush=True,
        )
    print(
        f"worst {worst * 100:.2f} %, limit {LIMIT * 100:g} %:"
        f" {'ok' if worst <= LIMIT else 'MISSED'}"
    )
    return 0 if worst <= LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
