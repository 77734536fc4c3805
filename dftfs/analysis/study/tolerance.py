"""Effect of manufacture on stiffness and first contact: sensitivities, spread, causes.

Four things scatter: the strip's thickness, the kerf (both edges of every cut shift alike: strips
thicken, gaps narrow, hub grows and rim closes in), the axial width and the modulus. Torque is
exactly proportional to the last two. The first two go through the rod model on a 3 x 3 grid, and
a full quadratic through the logarithms stands for it in the Monte Carlo; its error is measured at
points off the grid and reported. Three more causes act where a tolerance is given for them, see
`further_causes`. Tolerances are +-2 standard deviations of independent normals (JCGM 100:2008 for
the budget, JCGM 101:2008 for the Monte Carlo).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.study.further_causes import Further, Sensitivities, further_causes
from dftfs.analysis.torsion.result import UNWINDING, WINDING
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.process import Process
from dftfs.spring.outline import build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod
from dftfs.spring.rod_contact import contact_onset

RESPONSES = ("stiffness_Nm_per_rad", f"contact_{WINDING}_Nm", f"contact_{UNWINDING}_Nm")
_COVERAGE = 2.0  # standard deviations in a tolerance
MOST_INCLINATION_rad = np.radians(10.0)
_POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
_SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / np.pi, "deg")}  # by the ending of a field
_OFF_GRID = ((0.5, -0.5), (-0.5, 0.5), (0.6, 0.6))


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """How far each value may lie from its nominal one, either way (2 standard deviations).

    ``fillet_m``: the radius at an arm's roots beside the kerf's change of it. ``inclination_rad``:
    of the cut against the axis. ``arm_m``: thickness of each arm by itself. No table of a process
    states these three: they are 0 unless given.

    Raises
    ------
    DesignError
        If a tolerance is negative or not finite.
    """

    thickness_m: float
    kerf_m: float
    width_m: float
    modulus: float
    fillet_m: float = 0.0
    inclination_rad: float = 0.0
    arm_m: float = 0.0

    def __post_init__(self) -> None:
        if self.inclination_rad >= MOST_INCLINATION_rad:
            raise DesignError(
                f"inclination {np.degrees(self.inclination_rad):g} deg must be below"
                f" {np.degrees(MOST_INCLINATION_rad):g} deg, e.g. 0.5"
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value >= 0):
                name, _, unit = field.name.rpartition("_")
                factor, shown = _SHOWN.get(unit, (1e2, "%"))
                raise DesignError(
                    f"{name or unit} tolerance = {factor * value:g} {shown} must be 0 or more"
                )

    @classmethod
    def of_process(cls, process: Process, width_m: float) -> "Tolerances":
        """A process' edge tolerance, 0.1 mm of stock, 2 % of modulus.

        Half of an edge's variance is taken as common to all cuts (the kerf), half as its own: two
        edges of their own make a strip's thickness. The last two are assumptions: plate is held to
        a tenth, and tabulated moduli differ by so much between sources.
        """
        edge = process.edge_tolerance_at_m(width_m)
        return cls(thickness_m=edge, kerf_m=float(edge / np.sqrt(2)), width_m=1e-4, modulus=0.02)


@dataclass(frozen=True, kw_only=True)
class Share:
    """One cause of the spread of one response.

    sensitivity : relative change of the response over relative change of the cause (kerf: over a
    relative change of the thickness of twice the kerf). spread : relative standard deviation that
    it causes alone. share : of the variance. halved : relative standard deviation of the response
    if this tolerance is halved.
    """

    cause: str
    sensitivity: float
    spread: float
    share: float
    halved: float


@dataclass(frozen=True, kw_only=True)
class Spread:
    """A response of the Monte Carlo: nominal, mean, standard deviation, 95 % interval, causes.

    ``causes`` are sorted, the largest first. ``kept`` is the share of parts that keep the
    design's requirement, None where it states none.
    """

    response: str
    nominal: float
    mean: float
    standard_deviation: float
    low: float
    high: float
    causes: tuple[Share, ...]
    kept: float | None


@dataclass(frozen=True, kw_only=True)
class ToleranceResult:
    """Spreads of all responses; ``samples`` (n,) each, and the largest error of the fit."""

    tolerances: Tolerances
    spreads: tuple[Spread, ...]
    samples: Mapping[str, NDArray]
    fit_error: float
    untouched: tuple[str, ...] = ()


def tolerance_study(
    design: SpringDesign,
    tolerances: Tolerances,
    *,
    samples: int = 100_000,
    seed: int = 0,
    on_progress: Callable[[str], None] = lambda message: None,
) -> ToleranceResult:
    """Sensitivities and Monte Carlo of a design.

    Parameters
    ----------
    samples : int
        Parts that are drawn, 1000 or more.

    Raises
    ------
    DesignError
        If a tolerance lets the coils touch or the outline fail, or there are too few samples.

    A direction in which the coils of some shape do not touch has no first contact to scatter: it
    is left out of the spreads and named in ``untouched``.
    """
    require_samples(samples)
    sigma = {f.name: getattr(tolerances, f.name) / _COVERAGE for f in fields(tolerances)}
    # the grid reaches three standard deviations, or far enough to give a slope
    least = 1e-3 * design.spiral.thickness_m
    reach = np.array([max(3 * sigma[name], least) for name in ("thickness_m", "kerf_m")])
    grid = np.array(list(product((-1.0, 0.0, 1.0), repeat=2)))
    values = []
    for step in grid:
        values.append(_solved(design, *(step * reach)))
        on_progress(f"{len(values)} of {len(grid)} shapes")
    off = np.array(_OFF_GRID)
    solved = np.array([*values, *(_solved(design, *(step * reach)) for step in off)])
    there = np.flatnonzero(np.isfinite(solved).all(axis=0))
    names = [RESPONSES[k] for k in there]
    logarithms, checked = np.split(np.log(solved[:, there]), [len(grid)])
    fit = np.linalg.lstsq(_terms(grid), logarithms, rcond=None)[0]
    error = float(np.max(np.abs(_terms(off) @ fit - checked)))
    rng = np.random.default_rng(seed)
    drawn = _drawn(design, fit, sigma, reach, rng, samples)
    further = _further(design, fit, sigma, reach, there, rng, samples)
    for cause in further.values():
        drawn *= np.exp(cause.logarithms)
    spreads = tuple(
        _spread(design, name, drawn[:, k], fit[:, k], _budget(design, fit[:, k], sigma, reach)
                | {cause: (own.sensitivity[k], own.size, np.std(own.logarithms[:, k]))
                   for cause, own in further.items()})
        for k, name in enumerate(names)
    )  # fmt: skip
    return ToleranceResult(
        tolerances=tolerances,
        spreads=spreads,
        samples={name: drawn[:, k] for k, name in enumerate(names)},
        fit_error=error,
        untouched=tuple(name for name in RESPONSES if name not in names),
    )


def require_samples(samples: int) -> None:
    """Refuse too few parts.

    Raises
    ------
    DesignError
        If there are fewer than 1000.
    """
    if samples < 1000:
        raise DesignError(f"samples = {samples} must be 1000 or more, e.g. 100000")


def _drawn(
    design: SpringDesign,
    fit: NDArray,
    sigma: Mapping[str, float],
    reach: NDArray,
    rng: np.random.Generator,
    samples: int,
) -> NDArray:
    """Responses (samples, k) of parts whose four causes are drawn."""
    normal = rng.standard_normal((4, samples))
    shape = np.stack(
        [normal[0] * sigma["thickness_m"] / reach[0], normal[1] * sigma["kerf_m"] / reach[1]], 1
    )
    width = 1 + normal[2] * sigma["width_m"] / design.width_m
    modulus = 1 + normal[3] * sigma["modulus"]
    return np.exp(_terms(shape) @ fit) * (width * modulus)[:, None]


def _further(
    design: SpringDesign,
    fit: NDArray,
    sigma: Mapping[str, float],
    reach: NDArray,
    there: NDArray,
    rng: np.random.Generator,
    samples: int,
) -> dict[str, Further]:
    """What the causes of `further_causes` do; the fillet's sensitivities from two more shapes."""
    fillet = np.zeros((2, there.size))
    if sigma["fillet_m"] > 0:
        step = min(3 * sigma["fillet_m"], 0.5 * design.spiral.fillet_radius_m)
        low, high = (
            np.log(np.array(_solved(design, 0.0, 0.0, fillet_m=s))[there]) for s in (-step, step)
        )
        curved = 0.5 * (high + low) - fit[0]
        if not np.isfinite(low + high).all():
            raise DesignError("fillet tolerance: the coils no longer touch at its ends; e.g. 2e-5")
        fillet = np.array([(high - low) / (2 * step), curved / step**2])
    return further_causes(
        Sensitivities(
            thickness=fit[1] / reach[0],
            thickness_2=fit[3] / reach[0] ** 2,
            fillet=fillet[0],
            fillet_2=fillet[1],
        ),
        dict(sigma),
        thickness_m=design.spiral.thickness_m,
        fillet_m=design.spiral.fillet_radius_m,
        width_m=design.width_m,
        n_arms=design.n_arms,
        rng=rng,
        samples=samples,
    )


def shifted(
    p: SpiralParameters, thickness_m: float, kerf_m: float, fillet_m: float = 0.0
) -> SpiralParameters:
    """The outline as cut: strip thicker by the first, every cut edge out of the part by the second,
    fillets at the roots larger by the third.

    Raises
    ------
    DesignError
        If nothing is left of a fillet or a gap.
    """
    return replace(
        p,
        thickness_m=p.thickness_m + thickness_m + 2 * kerf_m,
        rim_thickness_m=None
        if p.rim_thickness_m is None
        else p.rim_thickness_m + thickness_m + 2 * kerf_m,
        hub_radius_m=p.hub_radius_m + kerf_m,
        rim_inner_radius_m=p.rim_inner_radius_m - kerf_m,
        bore_radius_m=p.bore_radius_m - kerf_m,
        rim_outer_radius_m=p.rim_outer_radius_m + kerf_m,
        fillet_radius_m=p.fillet_radius_m - kerf_m + fillet_m,
        tip_radius_m=max(p.tip_radius_m + kerf_m, 0.0) if p.tip_radius_m else 0.0,
    )


def _solved(
    design: SpringDesign, thickness_m: float, kerf_m: float, fillet_m: float = 0.0
) -> tuple[float, float, float]:
    """Stiffness and magnitudes of the contact torques of a shape (nan where coils do not touch)."""
    outline = build_outline(shifted(design.spiral, thickness_m, kerf_m, fillet_m))
    material = design.material
    elastic = (design.width_m, material.youngs_modulus_Pa, material.poisson_ratio)
    arm = arm_rod(outline, *elastic, wide=True)
    onset = contact_onset(outline, *elastic, wide=True)
    stiffness = design.n_arms * twist_stiffness(arm.rod)
    torques = [np.nan if t is None else abs(t.torque_Nm) for t in (onset.winding, onset.unwinding)]
    return stiffness, torques[0], torques[1]


def _terms(shape: NDArray) -> NDArray:
    return np.stack([shape[:, 0] ** a * shape[:, 1] ** b for a, b in _POWERS], axis=1)


def _budget(
    design: SpringDesign, fit: NDArray, sigma: Mapping[str, float], reach: NDArray
) -> dict[str, tuple[float, float, float]]:
    """Sensitivity at the nominal, relative size and spread of the four causes."""
    thickness = design.spiral.thickness_m
    causes = {
        "thickness": (fit[1] / reach[0] * thickness, sigma["thickness_m"] / thickness),
        "kerf": (fit[2] / reach[1] * thickness / 2, 2 * sigma["kerf_m"] / thickness),
        "width": (1.0, sigma["width_m"] / design.width_m),
        "modulus": (1.0, sigma["modulus"]),
    }
    return {cause: (slope, size, abs(slope * size)) for cause, (slope, size) in causes.items()}


def _spread(
    design: SpringDesign,
    name: str,
    drawn: NDArray,
    fit: NDArray,
    budget: Mapping[str, tuple[float, float, float]],
) -> Spread:
    """Causes by the budget; interval and yield by the samples."""
    parts = {cause: float(spread) ** 2 for cause, (_, _, spread) in budget.items()}
    whole = sum(parts.values())
    causes = tuple(
        Share(
            cause=cause,
            sensitivity=float(budget[cause][0]),
            spread=float(np.sqrt(part)),
            share=float(part / whole) if whole > 0 else 0.0,
            halved=float(np.sqrt(whole - 0.75 * part)),
        )
        for cause, part in sorted(parts.items(), key=lambda item: -item[1])
    )
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Spread(
        response=name,
        nominal=float(np.exp(fit[0])),
        mean=float(np.mean(drawn)),
        standard_deviation=float(np.std(drawn)),
        low=float(low),
        high=float(high),
        causes=causes,
        kept=_kept(design, name, drawn),
    )


def _kept(design: SpringDesign, name: str, drawn: NDArray) -> float | None:
    asked = design.requirements
    if name == RESPONSES[0]:
        if asked.stiffness_Nm_per_rad is None:
            return None
        off = np.abs(drawn / asked.stiffness_Nm_per_rad - 1)
        return float(np.mean(off <= asked.stiffness_tolerance))
    if asked.contact_free_torque_Nm is None:
        return None
    return float(np.mean(drawn >= asked.contact_free_torque_Nm))
