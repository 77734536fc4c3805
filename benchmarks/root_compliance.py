"""Calibrate the rod's root lengths against plane-stress finite elements, then validate them.

    python -m benchmarks.root_compliance

For every design one sector is solved for a small deflection. Its stiffness and the turn of one
cross-section half-way along the arm say how much rotation each root adds; the two root lengths
with which the rod gives both numbers are that design's measurement. Where the neck between the
slit's end and the arm's tip is narrow, its own length is measured, from the stiffness and with
the other two as fitted. The constants of `dftfs.spring.rod` are fits to these; the validation
sets are not used for fitting. About two minutes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares, root

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import sector_mesh
from dftfs.errors import DesignError
from dftfs.fem.constraints import clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.spring.outline import SpringOutline, build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import twist_rod, twist_stiffness
from dftfs.spring.rod import (
    HUB_ROOT,
    NECK,
    SLIT_ROOT,
    RootLengths,
    arm_rod,
    neck_turn,
    root_lengths,
    slit_neck_m,
)

WIDTH_M, YOUNGS_MODULUS_PA = 7.34e-3, 68e9  # both cancel in every ratio below
SMALL_RAD = 1e-3  # of finite elements and rod alike, so that what is not linear cancels
SIZING = MeshSizing().finer(2.0)  # stiffness within 0.002 % of a mesh twice as fine


@dataclass(frozen=True)
class Case:
    """One design, mm: radii of the centreline's ends, thickness, turns, arms, fillet; rings."""

    inner: float
    outer: float
    thickness: float
    turns: float
    arms: int
    fillet: float
    ring: float = 1.0  # width of hub and rim ring over the thickness
    gap: float = 0.5  # rim's inner radius beyond the centreline's end, over the thickness
    nu: float = 0.33

    def outline(self) -> SpringOutline:
        ring = self.ring * self.thickness
        rim = self.outer + self.gap * self.thickness
        return build_outline(
            SpiralParameters(
                inner_radius_m=self.inner * 1e-3,
                outer_radius_m=self.outer * 1e-3,
                turns=self.turns,
                n_arms=self.arms,
                thickness_m=self.thickness * 1e-3,
                fillet_radius_m=self.fillet * 1e-3,
                tip_radius_m=0.3e-3,
                bore_radius_m=(self.inner - ring) * 1e-3,
                hub_radius_m=self.inner * 1e-3,
                rim_inner_radius_m=rim * 1e-3,
                rim_outer_radius_m=(rim + ring) * 1e-3,
            )
        )

    def text(self) -> str:
        rings = "" if self.ring == 1.0 else f" ring {self.ring:g} t"
        gap = "" if self.gap == 0.5 else f" gap {self.gap:.4f} t"
        nu = "" if self.nu == 0.33 else f" nu {self.nu:g}"
        return (
            f"R {self.inner:g}-{self.outer:g}  t {self.thickness:g}  n {self.turns:g}"
            f"  arms {self.arms}  r {self.fillet:g}{rings}{gap}{nu}"
        )


CALIBRATION = (
    Case(18.38, 75.07, 7.7, 2.2, 2, 0.75),
    Case(18.38, 75.07, 7.7, 1.7, 2, 2.0),
    Case(18.38, 75.07, 5.0, 2.0, 2, 1.0),
    Case(18.38, 75.07, 4.0, 2.5, 2, 0.5),
    Case(18.38, 75.07, 9.0, 1.6, 2, 1.0),
    Case(18.38, 75.07, 10.0, 1.3, 2, 1.5),
    Case(18.38, 75.07, 5.0, 1.3, 3, 1.0),
    Case(18.38, 75.07, 4.0, 1.5, 3, 0.5),
    Case(30.0, 75.07, 5.0, 1.5, 2, 1.0),
    Case(25.0, 100.0, 8.0, 1.8, 2, 1.5),
    Case(12.0, 40.0, 3.0, 1.6, 2, 0.5),
    Case(40.0, 80.0, 5.0, 1.2, 2, 1.0),
)
VALIDATION = (
    Case(18.38, 75.07, 7.7, 2.0, 2, 2.0),
    Case(18.38, 75.07, 6.5, 2.2, 2, 1.2),
    Case(18.38, 75.07, 8.5, 1.4, 2, 0.5),
    Case(18.38, 75.07, 5.5, 1.2, 3, 1.5),
    Case(18.38, 75.07, 7.0, 1.0, 3, 1.0),
    Case(18.38, 75.07, 5.0, 1.2, 4, 0.75),
    Case(20.0, 90.0, 6.0, 2.4, 2, 1.0, nu=0.27),
    Case(12.0, 40.0, 4.0, 1.4, 2, 0.6),
    Case(30.0, 60.0, 3.0, 1.5, 2, 0.5),
    Case(15.0, 62.0, 6.0, 1.5, 2, 0.6, nu=0.4),
    Case(18.38, 75.07, 7.7, 2.1, 2, 1.0, ring=0.6),
    Case(18.38, 75.07, 5.0, 1.8, 2, 1.0, ring=2.0),
    Case(18.38, 75.07, 7.7, 2.1, 2, 1.0, gap=0.6),
)


NARROW_BASES = (
    Case(18.38, 75.07, 7.7, 2.1, 2, 0.4),
    Case(18.38, 75.07, 5.0, 2.0, 2, 1.0),
    Case(25.0, 100.0, 8.0, 1.8, 2, 1.5),
)
NARROW_NECKS = (0.2, 0.35, 0.6, 0.9, 1.4, 2.0)  # over the thickness
NARROW_VALIDATION = (
    (Case(18.38, 75.07, 6.5, 1.25, 3, 0.8), 0.25),
    (Case(18.38, 75.07, 6.5, 1.25, 3, 0.8), 0.7),
    (Case(18.38, 75.07, 9.0, 1.5, 2, 0.6), 0.45),
    (Case(12.0, 40.0, 3.5, 1.6, 2, 0.5), 1.1),
    (Case(15.0, 62.0, 5.0, 1.4, 3, 0.5), 1.7),
)


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """A case by finite elements and by the rod; lengths over the strip's thickness.

    ``rim`` is the slit's root length, or with a narrow neck the neck's.
    """

    case: Case
    fe_Nm_per_rad: float
    clamped_error: float
    neckless_error: float
    corrected_error: float
    hub: float
    rim: float
    fillet: float
    curved: float
    neck: float


def with_neck(each: Case, neck: float) -> Case:
    """The case with the rim moved until the neck is so wide (over the thickness)."""

    def excess(gap: float) -> float:
        try:
            outline = replace(each, gap=gap).outline()
        except DesignError:  # the slit no longer closes before the tip
            return -neck
        return slit_neck_m(outline) / outline.parameters.thickness_m - neck

    return replace(each, gap=brentq(excess, 0.45, 1.2, xtol=1e-7))


def measure(each: Case, *, narrow: bool = False) -> Measurement:
    """Solve a case and find the root lengths (or the neck's) with which the rod reproduces it."""
    outline = each.outline()
    p = outline.parameters
    stiffness, theta, turn = finite_elements(outline, each.nu)
    asked = root_lengths(outline)

    def rod(roots: RootLengths) -> tuple[float, float]:
        arm = arm_rod(outline, WIDTH_M, YOUNGS_MODULUS_PA, each.nu, roots=roots)
        state = twist_rod(arm.rod, SMALL_RAD)
        rotation = np.interp(theta, arm.theta, state.rotation_rad[2:-2]) / SMALL_RAD
        return p.n_arms * twist_stiffness(arm.rod) / stiffness - 1, rotation - turn

    def both(lengths: NDArray) -> tuple[float, float]:
        hub, slit = lengths * p.thickness_m
        return rod(RootLengths(hub_m=hub, slit_m=slit))

    def neck_alone(length: NDArray) -> float:
        return rod(replace(asked, neck_m=float(length[0]) * p.thickness_m))[0]

    start = np.array([asked.hub_m, asked.neck_m if narrow else asked.slit_m]) / p.thickness_m
    found = root(
        neck_alone if narrow else both,
        start[1:] if narrow else start,
        tol=1e-6,
        options={"eps": 1e-4},
    )
    if not found.success:
        raise RuntimeError(f"{each.text()}: {found.message}")
    return Measurement(
        case=each,
        fe_Nm_per_rad=stiffness,
        clamped_error=rod(RootLengths(hub_m=0.0, slit_m=0.0))[0],
        neckless_error=rod(replace(asked, neck_m=0.0))[0],
        corrected_error=rod(asked)[0],
        hub=start[0] if narrow else found.x[0],
        rim=found.x[-1],
        fillet=p.fillet_radius_m / p.thickness_m,
        curved=p.thickness_m * float(p.centreline.curvature(outline.feet.notch_theta)),
        neck=slit_neck_m(outline) / p.thickness_m,
    )


def finite_elements(outline: SpringOutline, poisson_ratio: float) -> tuple[float, float, float]:
    """Stiffness (Nm/rad), a parameter half-way along the arm, the section's turn there per rad."""
    p = outline.parameters
    mesh = sector_mesh(outline, SIZING)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNGS_MODULUS_PA,
        poisson_ratio=poisson_ratio,
        thickness_m=WIDTH_M,
        supports=(clamped(mesh.boundary_nodes("bore"), components=(0, 1)),),
        drive=rigid_rotation(mesh, mesh.boundary_nodes("rim_outer")),
        cyclic=cyclic_symmetry(mesh, p.n_arms),
    )
    path = solve_path(problem, [SMALL_RAD])
    theta, inner, outer = middle_section(outline, mesh)
    moved = mesh.nodes + path.states[-1].displacement_m
    before, after = (nodes[outer] - nodes[inner] for nodes in (mesh.nodes, moved))
    turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
    return p.n_arms * path.states[0].drive_stiffness, theta, turn / SMALL_RAD


def middle_section(outline: SpringOutline, mesh: TaggedMesh) -> tuple[float, int, int]:
    """Parameter and the inner and outer edge's nodes of a section near the middle of the arm."""
    p, feet = outline.parameters, outline.feet
    line, half = p.centreline, p.thickness_m / 2
    outer_nodes, inner_nodes = (mesh.boundary_nodes(f"arm_{s}") for s in ("outer", "inner"))
    theta = (feet.notch_theta + feet.slit_theta) / 2
    outer = nearest(mesh, outer_nodes, line.point(theta) + half * line.normal(theta))
    for _ in range(50):
        ahead = (mesh.nodes[outer] - line.point(theta)) @ line.tangent(theta)
        theta += float(ahead / line.speed(theta))
    inner_point = line.point(theta) - half * line.normal(theta)
    inner = nearest(mesh, inner_nodes, inner_point)
    if np.linalg.norm(mesh.nodes[inner] - inner_point) > 1e-6 * p.thickness_m:
        raise RuntimeError("the arm's mesh has no cross-section where one was expected")
    return theta, inner, outer


def nearest(mesh: TaggedMesh, nodes: NDArray, point: NDArray) -> int:
    """The node of a set that is nearest to a point."""
    return int(nodes[np.argmin(np.linalg.norm(mesh.nodes[nodes] - point, axis=1))])


def fitted_roots(rows: list[Measurement]) -> tuple[NDArray, NDArray]:
    """Least-squares constants of the hub's and the slit's root length."""
    fillet, curved, hub, slit = columns(rows, "fillet", "curved", "hub", "rim")
    one = np.ones(len(rows))
    by_hub = np.linalg.lstsq(np.stack([one, fillet, curved], axis=1), hub)[0]
    by_slit = np.linalg.lstsq(np.stack([one, fillet], axis=1), slit)[0]
    return by_hub, by_slit


def fitted_neck(rows: list[Measurement]) -> NDArray:
    """Constants of the neck, each row weighed by what it does to the spring's stiffness."""
    fillet, neck, turn, effect = columns(rows, "fillet", "neck", "rim", "neckless_error")
    weight = effect / turn
    return least_squares(
        lambda constants: weight * (neck_turn(neck, fillet, tuple(constants)) - turn), NECK
    ).x


def columns(rows: list[Measurement], *names: str) -> list[NDArray]:
    """Fields of the rows as arrays."""
    return [np.array([getattr(row, name) for row in rows]) for name in names]


def table(title: str, rows: list[Measurement], rim: str) -> None:
    """Print the measurements of one set."""
    print(f"\n{title}")
    print(
        f"{'design (mm)':<58} {'K FE':>9} {'clamped':>8} {'roots':>7}"
        f" {'hub/t':>6} {rim:>7} {'r/t':>6} {'t/R':>6} {'neck w/t':>8}"
    )
    for row in rows:
        print(
            f"{row.case.text():<58} {row.fe_Nm_per_rad:9.3f} {row.clamped_error:+8.2%}"
            f" {row.corrected_error:+7.2%} {row.hub:6.3f} {row.rim:7.3f}"
            f" {row.fillet:6.3f} {row.curved:6.3f} {row.neck:8.3f}"
        )
    errors = [abs(row.corrected_error) for row in rows]
    print(f"largest error with roots {max(errors):.2%}, mean {np.mean(errors):.2%}")


def main() -> None:
    """Calibrate, compare with the constants in use, validate."""
    wide = [measure(each) for each in CALIBRATION]
    table("calibration of hub and slit", wide, "slit/t")
    narrow = [
        measure(with_neck(each, neck), narrow=True)
        for each in NARROW_BASES
        for neck in NARROW_NECKS
    ]
    table("calibration of the neck", narrow, "neck/t")
    hub, slit = fitted_roots(wide)
    for name, fit, in_use in (
        ("HUB_ROOT", hub, HUB_ROOT),
        ("SLIT_ROOT", slit, SLIT_ROOT),
        ("NECK", fitted_neck(narrow), NECK),
    ):
        print(f"{name:10s} fitted {np.round(fit, 3)}  in use {np.array(in_use)}")
    table("validation", [measure(each) for each in VALIDATION], "slit/t")
    necks = [measure(with_neck(each, neck), narrow=True) for each, neck in NARROW_VALIDATION]
    table("validation with narrow necks", necks, "neck/t")


if __name__ == "__main__":
    main()
