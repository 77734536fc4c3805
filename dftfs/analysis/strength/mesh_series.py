"""Error bars: every figure on a series of meshes, extrapolated, with a verdict of its own.

In the plane three meshes, each 1.5 times finer. For the solid model a fourth is finer in the plane
by 1.5 and has twice the layers at once: what it changes beyond the plane's own change is the
width's part, corners of fillet and face included. A series whose order is observed has Roache's
factor 1.25 on its error; one that alternates, or whose steps do not shrink, has no observed order:
its bar is the factor 3 of a pair of meshes on the largest difference, and it is never called
converged. A value that grows as the mesh gets finer, by steps that do not shrink, has no limit:
``singular``.

Source: Roache, Annu. Rev. Fluid Mech. 29 (1997): observed order, factors 1.25 and 3; Williams, J.
Appl. Mech. 19 (1952) 526: stress at a reentrant corner grows as a power of the distance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dftfs.analysis.strength.yield_and_set import STRUCTURAL
from dftfs.analysis.torsion.contact_path import estimated_onset, path_to_contact
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.regions import regional_peaks_Pa
from dftfs.analysis.torsion.result import SIGN
from dftfs.fem.newton import solve_path
from dftfs.fem.recover import recover_stress

RATIO = 1.5
SAFETY, UNOBSERVED_SAFETY = 1.25, 3.0
# on the width's part, of one pair of meshes at second order: with it the bar of al1's notch holds
# what CalculiX finds on its own finer meshes, 1.2 to 2.6 % more (issue 20)
_PAIR_SAFETY = 2.0
_LEAST_ORDER = 1.0  # below it the steps shrink too little to call the figure converged
_SINGULAR_BELOW, _LARGEST_ORDER = 0.5, 6.0
_STIFF, _ONSET, _STRESS = 1e-3, 5e-3, 2e-2  # relative errors that count as converged
_UNNESTED = 2e-3  # of a stress: meshes of hub and rim are not nested and differ by chance
_ROUNDING = 1e-4  # of the value: differences below are no series
_ACROSS = 4 / 3  # of the change from one to two layers, at second order


@dataclass(frozen=True, kw_only=True)
class SeriesEstimate:
    """A figure on meshes of relative ``sizes`` (1 is the default mesh, the first value).

    ``value`` is that of the default mesh of the solved model, ``extrapolated`` its limit,
    ``relative_error`` bounds the distance of the two, ``observed_order`` is nan where the values
    alternate. ``verdict``: ``converged``, ``converging``, ``not converging`` or ``singular``.
    """

    quantity: str
    unit: str
    sizes: tuple[float, ...]
    values: tuple[float, ...]
    value: float
    extrapolated: float
    observed_order: float
    relative_error: float
    verdict: str

    def line(self) -> str:
        """The figure with its error bar as one line of text."""
        if self.verdict == "singular":
            return (
                f"{self.quantity}: {self.value:.5g} {self.unit} on this mesh and growing with every"
                " finer one (singular): no value to quote"
            )
        bar = self.relative_error * abs(self.value)
        return (
            f"{self.quantity}: {self.value:.5g} +- {bar:.2g} {self.unit} ({self.verdict}; limit"
            f" {self.extrapolated:.5g}, order {self.observed_order:.1f})"
        )


def estimate(
    quantity: str,
    unit: str,
    values: Sequence[float],
    *,
    converged: float,
    least: float = 0.0,
    solid: tuple[float, float] | None = None,
) -> SeriesEstimate:
    """Richardson's limit of three values on meshes each `RATIO` times finer.

    Parameters
    ----------
    converged : float
        Relative error up to which the default mesh counts as converged.
    least : float
        What two meshes of one size differ by, by chance: added to the relative error.
    solid : (float, float) or None
        The solid model's values on the default mesh, and with 1.5 times finer elements and twice
        the layers: its value is the first, its error the plane's and that across the width.
    """
    first, second = values[0] - values[1], values[1] - values[2]
    same_sign = first * second > 0
    order = float(np.log(first / second) / np.log(RATIO)) if same_sign else float("nan")
    spread = max(values) - min(values)
    regular = same_sign and order >= _SINGULAR_BELOW
    steady = same_sign and order >= _LEAST_ORDER * (1 - 1e-6)
    if regular:
        limit = values[2] - second / (RATIO ** min(order, _LARGEST_ORDER) - 1)
        error = max(abs(values[0] - limit), spread)
    else:
        limit, error = values[2], spread
    relative = (SAFETY if regular else UNOBSERVED_SAFETY) * error / abs(limit) + least
    value, extrapolated = values[0], limit
    if solid is not None:
        across = _ACROSS * (solid[1] - solid[0] * values[1] / values[0])
        value, extrapolated = solid[0], solid[0] * limit / values[0] + across
        relative += _PAIR_SAFETY * abs(across / extrapolated)
    growing = same_sign and not regular and abs(values[2]) > abs(values[0])
    if growing and spread > converged * abs(limit):
        verdict = "singular"
    elif relative <= converged and (steady or spread <= _ROUNDING * abs(limit)):
        verdict = "converged"
    else:
        verdict = "converging" if regular or relative <= converged else "not converging"
    return SeriesEstimate(
        quantity=quantity,
        unit=unit,
        sizes=tuple(RATIO**-k for k in range(3)),
        values=tuple(float(v) for v in values),
        value=float(value),
        extrapolated=float(extrapolated),
        observed_order=order,
        relative_error=float(relative),
        verdict=verdict,
    )


def mesh_series(
    problem: TorsionProblem,
    torque_Nm: float,
    *,
    contact: bool = True,
    on_progress: Callable[[str], None] = lambda message: None,
) -> tuple[SeriesEstimate, ...]:
    """Error bars of stiffness, torque at an angle, first contact and regional stresses.

    Parameters
    ----------
    torque_Nm : float
        Signed, where torque and stresses are compared; should lie before the first contact.
    contact : bool
        Whether to look for the first contacts, the longer half of the work.

    Raises
    ------
    SolveError, MeshError
        From a mesh of the series.
    """
    planar = replace(problem, dimension=2)
    plane = []
    for k in range(3):
        finer = replace(planar, sizing=planar.sizing.finer(RATIO**k))
        plane.append(_figures(finer, torque_Nm) | (_onsets(finer) if contact else {}))
        on_progress(f"plane stress, element size x {RATIO**-k:.2f}: {len(finer.mesh.nodes)} nodes")
    solid: list[dict[str, float]] = []
    if problem.dimension == 3:
        finer = replace(problem, sizing=problem.sizing.finer(RATIO), layers=2 * problem.layers)
        for chosen in (problem, finer):
            solid.append(_figures(chosen, torque_Nm))
            layers, nodes = chosen.layers, len(chosen.mesh.nodes)
            on_progress(f"solid, {layers} layers through half the width: {nodes} nodes")
    found = []
    for name in plane[0]:
        if any(name not in figures for figures in plane):
            continue
        unit, converged = _kind(name)
        pair = (solid[0][name], solid[1][name]) if solid and name in solid[0] else None
        values = [figures[name] for figures in plane]
        least = _UNNESTED if unit == "MPa" else 0.0
        found.append(estimate(name, unit, values, converged=converged, least=least, solid=pair))
    return tuple(found)


def stress_errors(
    problem: TorsionProblem,
    torque_Nm: float,
    *,
    on_progress: Callable[[str], None] = lambda message: None,
) -> dict[str, float]:
    """Relative error bar of the stress of each structural region, by three plane-stress meshes.

    Infinite where the stress is singular. What the width adds in 3D is not in it.

    Raises
    ------
    SolveError, MeshError
        From a mesh of the series.
    """
    planar = replace(problem, dimension=2)
    series = mesh_series(planar, torque_Nm, contact=False, on_progress=on_progress)
    found = {}
    for region in STRUCTURAL:
        one = next(e for e in series if e.quantity.startswith(f"stress, {region},"))
        found[region] = float("inf") if one.verdict == "singular" else one.relative_error
    return found


def _kind(name: str) -> tuple[str, float]:
    if name.startswith("stress"):
        return "MPa", _STRESS
    if name.startswith("first contact"):
        return "Nm", _ONSET
    return ("Nm/rad" if name == "stiffness" else "Nm"), _STIFF


def _figures(problem: TorsionProblem, torque_Nm: float) -> dict[str, float]:
    """Stiffness, torque at the angle of the wanted torque by a nominal stiffness, stresses."""
    static = problem.static_problem()
    angle = torque_Nm / nominal_stiffness(problem)
    path = solve_path(static, [angle / 2, angle])
    state = path.states[-1]
    torque = problem.copies * state.drive_force
    stress = recover_stress(static, state.displacement_m).von_mises_Pa
    peaks = regional_peaks_Pa(problem, stress, None)
    scale = 1e-6 * torque_Nm / torque
    return {
        "stiffness": problem.copies * path.states[0].drive_stiffness,
        f"torque at {angle:+.4f} rad": torque,
        **{f"stress, {r}, at {torque_Nm:+.4g} Nm": scale * peaks[r] for r in STRUCTURAL},
    }


def nominal_stiffness(problem: TorsionProblem) -> float:
    """A round number near K that is the same for every mesh of a design."""
    design = problem.design
    strip = design.width_m * design.spiral.thickness_m**3 / 12
    arms = design.n_arms * design.material.youngs_modulus_Pa * strip
    line = design.spiral.centreline
    return float(f"{arms / line.length(line.start, line.end):.2g}")


def _onsets(problem: TorsionProblem) -> dict[str, float]:
    static = problem.static_problem()
    found = {}
    for direction, sign in SIGN.items():
        expected = estimated_onset(problem, static, sign, "auto")
        onset = path_to_contact(problem, static, sign, expected, 2, [], "auto").onset
        if onset is not None:
            found[f"first contact, {direction}"] = onset.torque_Nm
    return found
