"""How much the notches at an arm's roots raise the stress of the rod model: a fit to 2D elements.

Random designs are turned by 20 mrad both ways in plane stress. The peak von Mises stress in the
hub's and in the rim's region, over the straight strip's 6 M / (w2 t^2) with the rod's moment M at
that root's fillet foot, is the notch factor. Fitted: 1 + a (t/r)^b with fillet radius r and
thickness t. Every third design is left out of the fit and judges it.

    python -m benchmarks.notch_factor
"""

import numpy as np
from scipy.optimize import least_squares

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import SpringDesign
from dftfs.errors import DftfsError
from dftfs.fem.newton import solve_path
from dftfs.fem.recover import recover_stress
from dftfs.material import lookup
from dftfs.spring.notch import notch_factor
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.rod import rod_curve

DESIGNS, TURN_RAD, SEED = 36, 0.02, 1


def designs(count: int, seed: int):
    """Random designs whose coils do not overlap."""
    rng, made = np.random.default_rng(seed), 0
    while made < count:
        t, inner = rng.uniform(3.5, 9) * 1e-3, rng.uniform(15, 24) * 1e-3
        outer, fillet = rng.uniform(55, 82) * 1e-3, rng.uniform(0.35, 2.2) * 1e-3
        try:
            spiral = SpiralParameters(
                inner_radius_m=inner,
                outer_radius_m=outer,
                turns=rng.uniform(1.2, 2.6),
                n_arms=2,
                thickness_m=t,
                fillet_radius_m=fillet,
                tip_radius_m=0.3e-3,
                bore_radius_m=inner - t,
                hub_radius_m=inner,
                rim_inner_radius_m=outer + t / 2,
                rim_outer_radius_m=outer + 1.5 * t,
            )
            yield SpringDesign(name="n", spiral=spiral, width_m=7e-3, material=lookup("al-7075-t6"))
        except DftfsError:
            continue
        made += 1


def measured(design: SpringDesign) -> list[tuple[float, float]]:
    """(t/r, notch factor) at hub and rim, both directions."""
    problem = TorsionProblem(design=design, dimension=2)
    static, elastic, p = problem.static_problem(), design.material, design.spiral
    t, found = p.thickness_m, []
    radius = np.hypot(*problem.mesh.nodes.T)
    regions = radius < p.hub_radius_m + 1.5 * t, radius > p.rim_inner_radius_m - 1.5 * t
    for sign in (-1, 1):
        state = solve_path(static, np.array([sign * TURN_RAD])).states[-1]
        stress = recover_stress(static, state.displacement_m).von_mises_Pa
        rod = rod_curve(
            design.outline,
            design.width_m,
            elastic.youngs_modulus_Pa,
            elastic.poisson_ratio,
            [sign * TURN_RAD],
        )
        for region, moment in zip(regions, rod.bending_moment_Nm[0][[0, -1]]):
            straight = 6 * abs(moment) / (design.width_m * t**2)
            found.append((t / p.fillet_radius_m, float(np.max(stress[region])) / straight))
    return found


def main() -> None:
    data = np.array([measured(design) for design in designs(DESIGNS, SEED)])
    kept = np.arange(DESIGNS) % 3 == 2
    fit = data[~kept].reshape(-1, 2)

    def misfit(constants: np.ndarray) -> np.ndarray:
        a, b = constants
        return (1 + a * fit[:, 0] ** b) / fit[:, 1] - 1

    found = least_squares(misfit, [0.25, 0.75]).x
    print("constants", np.round(found, 3))
    for name, part in (("fitted", data[~kept]), ("left out", data[kept])):
        for root, index in (("hub", [0, 2]), ("rim", [1, 3])):
            values = part[:, index].reshape(-1, 2)
            error = 100 * (notch_factor(1 / values[:, 0]) / values[:, 1] - 1)
            print(
                f"{name}, {root}: {error.min():+.1f} to {error.max():+.1f} % (committed constants)"
            )
    print(f"t/r {data[..., 0].min():.2f}..{data[..., 0].max():.2f}")


if __name__ == "__main__":
    main()
