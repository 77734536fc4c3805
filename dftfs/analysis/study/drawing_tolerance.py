"""The tolerances of a drawing, from the spread of the stiffness that they leave.

The strip's thickness may lie anywhere in its zone, all arms alike (cut edges shift together), the
width anywhere in its own; the modulus is normal, 2 % at two standard deviations. The nominal
stiffness comes from 3D elements where they were solved, its change from the rod model at five
thicknesses. The widest thickness zone in a shop's steps
is chosen at which so many parts keep the stiffness; half of it goes to either edge, so that the
profile's zone is as wide as the thickness tolerance.
"""

from dataclasses import dataclass

import numpy as np

from dftfs.analysis.study.tolerance import shifted
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.process import Process
from dftfs.spring.outline import build_outline
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod

STEPS_MM = (0.3, 0.2, 0.15, 0.1, 0.08, 0.06, 0.05, 0.04, 0.03, 0.025, 0.02, 0.015, 0.01, 0.005)
_MODULUS = 0.01  # one standard deviation
_WIDTH_M = 5e-5
_REACH = 0.02  # of the thickness: how far the rod's fit goes


@dataclass(frozen=True, kw_only=True)
class DrawingTolerance:
    """Tolerances that keep the stiffness, and the share of parts that do (``kept``).

    ``met``: whether that is the asked share. ``held``: whether the process cuts as exactly, both
    edges of a strip off by its edge tolerance.
    """

    thickness_m: float
    width_m: float
    profile_m: float
    stiffness_Nm_per_rad: float
    nominal_Nm_per_rad: float
    stiffness_tolerance: float
    kept: float
    met: bool
    held: bool

    @property
    def missed(self) -> bool:
        """Whether the nominal stiffness already misses what is required."""
        off = abs(self.nominal_Nm_per_rad / self.stiffness_Nm_per_rad - 1)
        return off > self.stiffness_tolerance

    def line(self) -> str:
        """The sentence of the drawing's notes."""
        if self.missed:
            return (
                f"K {self.nominal_Nm_per_rad:.4g} Nm/rad nominal misses the required"
                f" {self.stiffness_Nm_per_rad:.4g} +- {100 * self.stiffness_tolerance:g} %: no"
                " tolerance can keep it."
            )
        text = (
            f"K {self.stiffness_Nm_per_rad:.4g} Nm/rad +- {100 * self.stiffness_tolerance:g} % in"
            f" {100 * self.kept:.1f} % of parts by these tolerances"
        )
        return text + ("." if self.held else "; finer than the process cuts: measure and select.")


def drawing_tolerance(
    design: SpringDesign,
    process: Process,
    *,
    share: float = 0.99,
    samples: int = 2000,
    seed: int = 0,
    solid_Nm_per_rad: float | None = None,
) -> DrawingTolerance:
    """The widest tolerances that keep the design's stiffness requirement in a share of parts.

    Without a requirement the nominal stiffness +- 5 % is kept; where the nominal itself misses the
    requirement, the tolerances keep the nominal and ``met`` is False. The nominal is
    ``solid_Nm_per_rad``, the stiffness by 3D elements, or without it the rod model's; how it
    changes with the thickness is always the rod's.

    Raises
    ------
    DesignError
        If the share is not from 0.5 to below 1, or the outline cannot be built a little thicker.
    """
    if not 0.5 <= share < 1:
        raise DesignError(f"--yield-percent {100 * share:g} must be 50 to below 100")
    fit, thickness = stiffness_fit(design), design.spiral.thickness_m
    if solid_Nm_per_rad is not None:
        fit = [*fit[:-1], np.log(solid_Nm_per_rad)]
    asked, nominal = design.requirements.stiffness_Nm_per_rad, float(np.exp(fit[-1]))
    target = nominal if asked is None else asked
    allowed = design.requirements.stiffness_tolerance
    rng = np.random.default_rng(seed)
    zone, width = rng.uniform(-1, 1, (2, samples))
    rest = (1 + _MODULUS * rng.standard_normal(samples)) * (1 + width * _WIDTH_M / design.width_m)
    kept, chosen = 0.0, STEPS_MM[-1]
    for step in STEPS_MM:
        if 1e-3 * step > _REACH * thickness:
            continue
        drawn = np.exp(np.polyval(fit, zone * 1e-3 * step / thickness)) * rest
        kept, chosen = float(np.mean(np.abs(drawn / target - 1) <= allowed)), step
        around = nominal if abs(nominal / target - 1) > allowed else target
        if np.mean(np.abs(drawn / around - 1) <= allowed) >= share:
            break
    return DrawingTolerance(
        thickness_m=1e-3 * chosen,
        width_m=_WIDTH_M,
        profile_m=1e-3 * chosen,
        stiffness_Nm_per_rad=target,
        nominal_Nm_per_rad=nominal,
        stiffness_tolerance=allowed,
        kept=kept,
        met=kept >= share,
        held=2 * process.edge_tolerance_at_m(design.width_m) <= 1e-3 * chosen * (1 + 1e-9),
    )


def stiffness_fit(design: SpringDesign) -> np.ndarray:
    """Quadratic (highest power first) of log K over the relative change of the thickness.

    Both edges of every cut move alike, hub and rim with them.

    Raises
    ------
    DesignError
        If an outline cannot be built.
    """
    material, p = design.material, design.spiral
    changes = _REACH * np.linspace(-1, 1, 5)
    logs = []
    for change in changes:
        outline = build_outline(shifted(p, 0.0, change * p.thickness_m / 2))
        elastic = material.youngs_modulus_Pa, material.poisson_ratio
        arm = arm_rod(outline, design.width_m, *elastic, wide=True)
        logs.append(np.log(design.n_arms * twist_stiffness(arm.rod)))
    return np.polyfit(changes, logs, 2)
