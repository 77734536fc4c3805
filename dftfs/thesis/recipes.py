"""How each printed number is looked at again: small functions by name, for `data/thesis.toml`.

A recipe takes what the row prints, its own arguments and a `Springs`, and returns the recomputed
number, or None where there is nothing to compute.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from dftfs.analysis.jobs.store import ContentStore
from dftfs.analysis.sizing.task import Grid
from dftfs.analysis.torsion.batch_solve import SharedProblem, solve_shared
from dftfs.design import SpringDesign, load_design
from dftfs.errors import DesignError, SolveError
from dftfs.spring.closed_forms import stiffness_eq_2_1
from dftfs.spring.outline import build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod

_STATES = 3
TABLE_2_6_Nm_per_rad = (66.102, 65.771, 82.31, 80.46, 71.1, 85.2, 88.305)


@dataclass(frozen=True)
class Springs:
    """Solved springs for the recipes: by ``rod``, ``2d`` or ``3d``, kept in a store where given."""

    model: str
    store: ContentStore | None
    table_2_3: dict

    def curve(self, design: SpringDesign) -> tuple[dict, float]:
        """The shared curve of a design and the factor of its torques.

        Raises
        ------
        SolveError
            If the solve fails.
        """
        problem = SharedProblem.of(design, self.model, _STATES)
        solved = self.store.get(problem.key) if self.store else None
        if solved is None:
            solved = solve_shared(problem.content())
            if self.store:
                self.store.put(problem.key, solved)
        if "failure" in solved:
            raise SolveError(f"{design.name}: {solved['failure']}")
        return solved["curve"], problem.factors(design)[0]

    def stiffness(self, name: str) -> float:
        """Tangent stiffness at rest of a built-in design, in Nm/rad."""
        curve, factor = self.curve(load_design(name))
        return factor * curve["stiffness_Nm_per_rad"]

    @cached_property
    def table_2_3_spiral(self) -> SpiralParameters:
        """Table 2.3's numbers as two Fermat arms, rings as wide as the strip."""
        t = self.table_2_3
        inner, outer = t["inner_radius_mm"] * 1e-3, t["outer_radius_mm"] * 1e-3
        thick = t["thickness_mm"] * 1e-3
        return SpiralParameters(
            inner_radius_m=inner,
            outer_radius_m=outer,
            turns=float(t["turns"]),
            n_arms=2,
            thickness_m=thick,
            fillet_radius_m=1e-3,
            tip_radius_m=0.3e-3,
            bore_radius_m=inner - thick,
            hub_radius_m=inner,
            rim_inner_radius_m=outer + thick / 2,
            rim_outer_radius_m=outer + 1.5 * thick,
        )


def nothing(springs: Springs, printed: float | None) -> None:
    """Not checkable, or nothing to recompute."""


def value(springs: Springs, printed: float, *, value: float) -> float:
    """Another number of the thesis that should be the same."""
    return value


def ratio(springs: Springs, printed: float, *, over: float, under: float) -> float:
    """A quotient."""
    return over / under


def arm_over_thickness(springs: Springs, printed: float, *, design: str) -> float:
    """L / w1 of a design."""
    spring = load_design(design)
    return spring.outline.arm_length_m / spring.spiral.thickness_m


def on_grid(
    springs: Springs, printed: float, *, low: float, high: float, increment: float
) -> float:
    """The nearest value of a grid."""
    grid = Grid(name="printed", low=low, high=high, increment=increment)
    return grid.value(grid.nearest(printed))


def degrees_in_rad(springs: Springs, printed: float, *, degrees: float) -> float:
    """An angle in radians."""
    return math.radians(degrees)


def rpm(springs: Springs, printed: float, *, rad_per_s: float) -> float:
    """A speed in turns per minute."""
    return rad_per_s * 60 / (2 * math.pi)


def power_law(springs: Springs, printed: float, *, factor: float, power: float, at: float) -> float:
    """factor x^power."""
    return factor * at**power


def power_law_inverse(
    springs: Springs, printed: float, *, factor: float, power: float, value: float
) -> float:
    """The x at which factor x^power has a value."""
    return (value / factor) ** (1 / power)


def sine_speed(
    springs: Springs,
    printed: float,
    *,
    frequency_Hz: float,
    peak_to_peak_Nm: float,
    stiffness: float,
) -> float:
    """Largest speed across a spring whose torque is a sine, output locked, in rad/s."""
    return 2 * math.pi * frequency_Hz * peak_to_peak_Nm / 2 / stiffness


def force_lever_angle(
    springs: Springs, printed: float, *, force_N: float, lever_m: float, angle_deg: float
) -> float:
    """Stiffness from a force at a lever and an angle."""
    return force_N * lever_m / math.radians(angle_deg)


def stress_eq_2_5(
    springs: Springs, printed: float, *, torque: float, thickness_mm: float, width_mm: float
) -> float:
    """6 tau / (w1^2 w2) of one arm, K_b = 1, in MPa (eq. 2.5)."""
    return 6e3 * torque / (thickness_mm**2 * width_mm)


def length_eq_2_3(springs: Springs, printed: float) -> float:
    """pi n (R_o + R_i) of Table 2.3, in mm (eq. 2.3, first form)."""
    t = springs.table_2_3
    return math.pi * t["turns"] * (t["outer_radius_mm"] + t["inner_radius_mm"])


def gap_from_turns(springs: Springs, printed: float) -> float:
    """Gap of one strip of n turns between the radii of Table 2.3, in mm."""
    t = springs.table_2_3
    return (t["outer_radius_mm"] - t["inner_radius_mm"]) / t["turns"] - t["thickness_mm"]


def table_2_3_spring(springs: Springs, printed: float) -> float:
    """Stiffness of Table 2.3's first column as a spring of two arms, rod model."""
    t = springs.table_2_3
    modulus = 1e9 * t["youngs_modulus_GPa"][0]
    arm = arm_rod(build_outline(springs.table_2_3_spiral), t["width_mm"][0] * 1e-3, modulus, 0.33)
    return 2 * twist_stiffness(arm.rod)


def eq_2_1(springs: Springs, printed: float, *, column: int) -> float:
    """E w1^3 w2 / (12 L) of a column of Table 2.3, one strip, L as printed."""
    t = springs.table_2_3
    return stiffness_eq_2_1(
        1e9 * t["youngs_modulus_GPa"][column],
        1e-3 * t["thickness_mm"],
        1e-3 * t["width_mm"][column],
        1e-3 * t["length_mm"],
        n_arms=1,
    )


def torque_over_stiffness(springs: Springs, printed: float, *, column: int) -> float:
    """tau / k_s of a column of Table 2.3."""
    t = springs.table_2_3
    return t["torque_Nm"] / t["stiffness_Nm_per_rad"][column]


def stiffness(springs: Springs, printed: float, *, design: str) -> float:
    """Tangent stiffness of a built-in design, in Nm/rad."""
    return springs.stiffness(design)


def implied_modulus(springs: Springs, printed: float, *, design: str, stiffness: float) -> float:
    """The modulus (GPa) at which a design would have a stiffness: exact, torque being ~ E."""
    modulus = load_design(design).material.youngs_modulus_Pa / 1e9
    return modulus * stiffness / springs.stiffness(design)


def contact_torque(springs: Springs, printed: float, *, design: str, direction: str) -> float:
    """Torque at first contact in one direction, its magnitude in Nm."""
    curve, factor = springs.curve(load_design(design))
    return abs(factor * curve["contact_onset"][direction]["torque_Nm"])


def contact_angle_deg(springs: Springs, printed: float, *, design: str, direction: str) -> float:
    """Angle at first contact in one direction, its magnitude in degrees."""
    curve, _ = springs.curve(load_design(design))
    return math.degrees(abs(curve["contact_onset"][direction]["deflection_rad"]))


def nearest_of_table_2_6(springs: Springs, printed: float) -> float:
    """The stiffness of Table 2.6 that is nearest."""
    return min(TABLE_2_6_Nm_per_rad, key=lambda known: abs(known - printed))


def peak_stress_radius(springs: Springs, printed: float, *, design: str) -> float:
    """Radius (mm) of the notch with the larger root moment at first contact, rod model.

    Hub and rim carry the same notch factor, so the larger moment is the larger stress.
    """
    from dftfs.spring.rod import rod_curve
    from dftfs.spring.rod_contact import contact_onset

    spring = load_design(design)
    elastic = (
        spring.width_m,
        spring.material.youngs_modulus_Pa,
        spring.material.poisson_ratio,
    )
    onset = contact_onset(spring.outline, *elastic)
    if onset.unwinding is None:
        raise SolveError(f"{design}: no contact, unwinding")
    curve = rod_curve(spring.outline, *elastic, [onset.unwinding.deflection_rad])
    hub, rim = np.abs(curve.bending_moment_Nm[0][[0, -1]])
    fillet = spring.outline.edge("notch_fillet:0" if hub >= rim else "slit_fillet:0")
    return 1e3 * float(np.hypot(*fillet.point(0.5)))


def find(name: str) -> Callable:
    """A recipe by name.

    Raises
    ------
    DesignError
        If there is none of that name.
    """
    if name not in _RECIPES:
        raise DesignError(f"thesis.toml: recipe {name!r} is unknown")
    return _RECIPES[name]


_RECIPES: dict[str, Callable] = {
    function.__name__: function
    for function in (
        nothing,
        value,
        ratio,
        arm_over_thickness,
        on_grid,
        degrees_in_rad,
        rpm,
        power_law,
        power_law_inverse,
        sine_speed,
        force_lever_angle,
        stress_eq_2_5,
        length_eq_2_3,
        gap_from_turns,
        table_2_3_spring,
        eq_2_1,
        torque_over_stiffness,
        stiffness,
        implied_modulus,
        contact_torque,
        contact_angle_deg,
        nearest_of_table_2_6,
        peak_stress_radius,
    )
}


def bound(name: str, springs: Springs, arguments: dict) -> Callable[[float | None], float | None]:
    """A recipe with all but the printed number."""
    return partial(find(name), springs, **arguments)
