"""Calibrate the rod's root lengths against plane-stress finite elements, then validate them.

    python -m benchmarks.root_compliance

For every design of the calibration set one sector is solved linearly. Its torque and the turn of
one cross-section half-way along the arm say how much rotation each root adds; the two root
lengths with which the rod gives both numbers are that design's measurement. The constants of
`dftfs.spring.rod` are least-squares fits to these; the validation set is not used for fitting.
About a minute.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from dftfs.analysis.blocks import MeshSizing
from dftfs.analysis.meshing import sector_mesh
from dftfs.fem.constraints import clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.spring.outline import SpringOutline, build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import twist_rod, twist_stiffness
from dftfs.spring.rod import HUB_ROOT, SLIT_ROOT, RootLengths, arm_rod, root_lengths

WIDTH_M, YOUNGS_MODULUS_PA = 7.34e-3, 68e9  # both cancel in every ratio below
SMALL_RAD = 1e-3  # of finite elements and rod alike, so that what is not linear cancels
SIZING = MeshSizing().finer(2.0)  # stiffness within 0.002 % of a mesh twice as fine


@dataclass(frozen=True, kw_only=True)
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
        gap = "" if self.gap == 0.5 else f" gap {self.gap:g} t"
        nu = "" if self.nu == 0.33 else f" nu {self.nu:g}"
        return (
            f"R {self.inner:g}-{self.outer:g}  t {self.thickness:g}  n {self.turns:g}"
            f"  arms {self.arms}  r {self.fillet:g}{rings}{gap}{nu}"
        )


def case(inner, outer, thickness, turns, arms, fillet, **other) -> Case:
    """A case from its six main numbers."""
    return Case(
        inner=inner,
        outer=outer,
        thickness=thickness,
        turns=turns,
        arms=arms,
        fillet=fillet,
        **other,
    )


CALIBRATION = (
    case(18.38, 75.07, 7.7, 2.2, 2, 0.75),
    case(18.38, 75.07, 7.7, 1.7, 2, 2.0),
    case(18.38, 75.07, 5.0, 2.0, 2, 1.0),
    case(18.38, 75.07, 4.0, 2.5, 2, 0.5),
    case(18.38, 75.07, 9.0, 1.6, 2, 1.0),
    case(18.38, 75.07, 10.0, 1.3, 2, 1.5),
    case(18.38, 75.07, 5.0, 1.3, 3, 1.0),
    case(18.38, 75.07, 4.0, 1.5, 3, 0.5),
    case(30.0, 75.07, 5.0, 1.5, 2, 1.0),
    case(25.0, 100.0, 8.0, 1.8, 2, 1.5),
    case(12.0, 40.0, 3.0, 1.6, 2, 0.5),
    case(40.0, 80.0, 5.0, 1.2, 2, 1.0),
)
VALIDATION = (
    case(18.38, 75.07, 7.7, 2.0, 2, 2.0),
    case(18.38, 75.07, 6.5, 2.2, 2, 1.2),
    case(18.38, 75.07, 8.5, 1.4, 2, 0.5),
    case(18.38, 75.07, 5.5, 1.2, 3, 1.5),
    case(18.38, 75.07, 7.0, 1.0, 3, 1.0),
    case(18.38, 75.07, 5.0, 1.2, 4, 0.75),
    case(20.0, 90.0, 6.0, 2.4, 2, 1.0, nu=0.27),
    case(12.0, 40.0, 4.0, 1.4, 2, 0.6),
    case(30.0, 60.0, 3.0, 1.5, 2, 0.5),
    case(15.0, 62.0, 6.0, 1.5, 2, 0.6, nu=0.4),
    case(18.38, 75.07, 7.7, 2.1, 2, 1.0, ring=0.6),
    case(18.38, 75.07, 5.0, 1.8, 2, 1.0, ring=2.0),
    case(18.38, 75.07, 7.7, 2.1, 2, 1.0, gap=0.6),
)


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """A case by finite elements and by the rod; lengths over the strip's thickness."""

    case: Case
    fe_Nm_per_rad: float
    clamped_error: float
    corrected_error: float
    hub: float
    slit: float
    fillet: float
    curved: float


def measure(each: Case) -> Measurement:
    """Solve a case and find the root lengths with which the rod reproduces it."""
    outline = each.outline()
    p = outline.parameters
    stiffness, theta, turn = finite_elements(outline, each.nu)

    def rod(roots: RootLengths) -> tuple[float, float]:
        arm = arm_rod(outline, WIDTH_M, YOUNGS_MODULUS_PA, each.nu, roots=roots)
        state = twist_rod(arm.rod, SMALL_RAD)
        rotation = np.interp(theta, arm.theta, state.rotation_rad[2:-2]) / SMALL_RAD
        return p.n_arms * twist_stiffness(arm.rod) / stiffness - 1, rotation - turn

    def residual(lengths: NDArray) -> tuple[float, float]:
        hub, slit = lengths * p.thickness_m
        return rod(RootLengths(hub_m=hub, slit_m=slit))

    found = root(residual, [0.8, 0.7], tol=1e-6, options={"eps": 1e-4})
    if not found.success:
        raise RuntimeError(f"{each.text()}: {found.message}")
    return Measurement(
        case=each,
        fe_Nm_per_rad=stiffness,
        clamped_error=rod(RootLengths(hub_m=0.0, slit_m=0.0))[0],
        corrected_error=rod(root_lengths(outline))[0],
        hub=found.x[0],
        slit=found.x[1],
        fillet=p.fillet_radius_m / p.thickness_m,
        curved=p.thickness_m * float(p.centreline.curvature(outline.feet.notch_theta)),
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


def fitted(rows: list[Measurement]) -> tuple[NDArray, NDArray]:
    """Least-squares constants of the hub's and the slit's root length."""
    fillet, curved, hub, slit = (
        np.array([getattr(row, name) for row in rows])
        for name in ("fillet", "curved", "hub", "slit")
    )
    one = np.ones(len(rows))
    by_hub = np.linalg.lstsq(np.stack([one, fillet, curved], axis=1), hub)[0]
    by_slit = np.linalg.lstsq(np.stack([one, fillet], axis=1), slit)[0]
    return by_hub, by_slit


def table(title: str, rows: list[Measurement]) -> None:
    """Print the measurements of one set."""
    print(f"\n{title}")
    print(
        f"{'design (mm)':<60} {'K FE':>9} {'clamped':>8} {'roots':>7}"
        f" {'hub/t':>6} {'slit/t':>6} {'r/t':>6} {'t/R':>6}"
    )
    for row in rows:
        print(
            f"{row.case.text():<60} {row.fe_Nm_per_rad:9.3f} {row.clamped_error:+8.2%}"
            f" {row.corrected_error:+7.2%} {row.hub:6.3f} {row.slit:6.3f}"
            f" {row.fillet:6.3f} {row.curved:6.3f}"
        )
    errors = [abs(row.corrected_error) for row in rows]
    print(f"largest error with roots {max(errors):.2%}, mean {np.mean(errors):.2%}")


def main() -> None:
    """Calibrate, compare with the constants in use, validate."""
    calibration = [measure(each) for each in CALIBRATION]
    table("calibration", calibration)
    hub, slit = fitted(calibration)
    print("\nfitted: HUB_ROOT", np.round(hub, 3), " SLIT_ROOT", np.round(slit, 3))
    print("in use: HUB_ROOT", np.array(HUB_ROOT), " SLIT_ROOT", np.array(SLIT_ROOT))
    table("validation", [measure(each) for each in VALIDATION])


if __name__ == "__main__":
    main()
