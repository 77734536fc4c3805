"""Loading and unloading past the knee with friction between the coils: the loop and its heat.

Without friction unloading retraces loading. With it the torque on unloading is smaller, and the
area between the two is the heat of sliding at the contacts.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import SIGN, ContactOnset, StiffnessResult
from dftfs.analysis.torsion.solve import Progress
from dftfs.errors import DesignError
from dftfs.fem.newton import PathState, solve_path

BALANCE = 0.02  # largest difference of heat and external work, over the larger one
LARGEST_COEFFICIENT = 2.0
_BEFORE = (0.5, 0.99)  # of the first contact's deflection: states before it
_STEPS = 24  # from first contact to the turning point, and as many back
_REFINEMENTS = 2
_GRADING = 1.5  # shorter steps near the touch, where pressure changes most
_NOTHING_J = 1e-9  # of the largest strain energy: work that is round-off


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionLoop:
    """One cycle from rest past the knee and back to rest.

    Parameters
    ----------
    coefficient : float
        Of Coulomb's law.
    deflection_rad, torque_Nm, frictionless_Nm : (2 n + 1,) array
        Loading, the turning point in the middle, unloading; torque with and without friction.
    dissipated_J, stored_J : (2 n + 1,) array
        Heat of all slips so far; elastic energy of what sticks.
    strain_energy_J : float
        At the turning point.
    onset : ContactOnset
    penetration_m : float
    """

    coefficient: float
    deflection_rad: NDArray[np.float64]
    torque_Nm: NDArray[np.float64]
    frictionless_Nm: NDArray[np.float64]
    dissipated_J: NDArray[np.float64]
    stored_J: NDArray[np.float64]
    strain_energy_J: float
    onset: ContactOnset
    penetration_m: float

    @property
    def loss_J(self) -> float:
        """Heat of the cycle."""
        return float(self.dissipated_J[-1])

    @property
    def external_work_J(self) -> float:
        """Work of the torque round the cycle: the loop's area.

        By trapezoids; both ways have the same states, so that the elastic part cancels.
        """
        steps = np.diff(self.deflection_rad)
        return float(np.sum(steps * (self.torque_Nm[1:] + self.torque_Nm[:-1]) / 2))

    @property
    def imbalance(self) -> float:
        """Heat less external work over the larger of the two; 0 where both are round-off."""
        work, heat = self.external_work_J, self.loss_J
        scale = max(abs(work), heat)
        return 0.0 if scale < _NOTHING_J * self.strain_energy_J else (heat - work) / scale

    @property
    def loss_factor(self) -> float:
        """Heat of the cycle over 2 pi times the largest strain energy."""
        return self.loss_J / (2 * np.pi * self.strain_energy_J)

    @property
    def width_Nm(self) -> NDArray[np.float64]:
        """(n + 1,) torque on loading less that on unloading, in the direction of load."""
        turn = len(self.torque_Nm) // 2
        out, back = self.torque_Nm[: turn + 1], self.torque_Nm[turn:][::-1]
        return np.sign(self.onset.deflection_rad) * (out - back)

    @property
    def widest(self) -> tuple[float, float]:
        """Largest width in Nm and the deflection where it is."""
        at = int(np.argmax(self.width_Nm))
        return float(self.width_Nm[at]), float(self.deflection_rad[at])

    @property
    def record(self) -> dict:
        """Everything, with what follows from it."""
        width, at = self.widest
        return {
            "coefficient": self.coefficient,
            "deflection_rad": self.deflection_rad,
            "torque_Nm": self.torque_Nm,
            "frictionless_Nm": self.frictionless_Nm,
            "dissipated_J": self.dissipated_J,
            "dissipated_per_cycle_J": self.loss_J,
            "external_work_J": self.external_work_J,
            "imbalance": self.imbalance,
            "loss_factor": self.loss_factor,
            "widest_Nm": width,
            "widest_at_rad": at,
            "penetration_m": self.penetration_m,
        }


def require_loop(coefficient: float, turn_rad: float) -> None:
    """DesignError unless coefficient and turning point are numbers in range."""
    if not 0 <= coefficient <= LARGEST_COEFFICIENT:
        raise DesignError(
            f"contact-friction = {coefficient} must be between 0 and {LARGEST_COEFFICIENT:g}"
        )
    if not 0 < abs(turn_rad) <= 2 * np.pi:
        raise DesignError(f"loop-rad = {turn_rad} must be between -6.28 and 6.28 rad and not 0")


def friction_loop(
    problem: TorsionProblem,
    free: StiffnessResult,
    coefficient: float,
    turn_rad: float,
    *,
    steps: int = _STEPS,
    on_progress: Progress = lambda message: None,
) -> FrictionLoop:
    """One cycle to ``turn_rad`` (signed) and back.

    Parameters
    ----------
    problem : TorsionProblem
    free : StiffnessResult
        Of the same design, for where first contact is.
    coefficient : float
        Of Coulomb's law; 0 is allowed and gives no loop.
    steps : int
        States from first contact to the turning point; twice as many, and again, where heat and
        work differ by more than half of what is allowed.

    Raises
    ------
    DesignError
        If the turning point does not lie beyond first contact, or a number is out of range.
    SolveError
        If an increment has no equilibrium.
    """
    require_loop(coefficient, turn_rad)
    direction = next(name for name, sign in SIGN.items() if sign * turn_rad > 0)
    onset = free.contact_onset.get(direction)
    if onset is None or abs(turn_rad) <= abs(onset.deflection_rad):
        where = "none within the curve" if onset is None else f"{onset.deflection_rad:+.4f} rad"
        raise DesignError(
            f"loop-rad = {turn_rad:+g} must lie beyond the first contact {direction} ({where}):"
            " before it nothing slides"
        )
    for refinement in range(_REFINEMENTS + 1):
        loop = _cycle(problem, onset, coefficient, turn_rad, steps * 2**refinement)
        on_progress(
            f"friction loop to {turn_rad:+g} rad, {len(loop.torque_Nm)} states: heat"
            f" {1e3 * loop.loss_J:.3f} mJ, work {1e3 * loop.external_work_J:.3f} mJ"
        )
        if abs(loop.imbalance) <= BALANCE / 2:
            break
    return loop


def _cycle(
    problem: TorsionProblem, onset: ContactOnset, coefficient: float, turn_rad: float, steps: int
) -> FrictionLoop:
    share = np.linspace(0, 1, steps + 1)[1:] ** _GRADING
    touch = onset.deflection_rad
    out = np.concatenate([[k * touch for k in _BEFORE], touch + share * (turn_rad - touch)])
    goals = [*out.tolist(), *out[-2::-1].tolist(), 0.0]
    frictional, smooth = (_states(problem, mu, goals) for mu in (coefficient, 0.0))
    copies = problem.copies
    friction = [state.friction for state in frictional]
    return FrictionLoop(
        coefficient=coefficient,
        deflection_rad=np.array([s.t for s in frictional]),
        torque_Nm=copies * np.array([s.drive_force for s in frictional]),
        frictionless_Nm=copies * np.array([s.drive_force for s in smooth]),
        dissipated_J=copies * np.array([0.0 if f is None else f.dissipated_J for f in friction]),
        stored_J=copies * np.array([0.0 if f is None else f.stored_J for f in friction]),
        strain_energy_J=copies * max(s.energy_J for s in frictional),
        onset=onset,
        penetration_m=max(s.touch.penetration_m for s in frictional),
    )


def _states(problem: TorsionProblem, coefficient: float, goals: list[float]) -> list[PathState]:
    """States at rest and at the goals; increments between them are not kept."""
    static = problem.static_problem(contact=True)
    law = replace(static.contact.law, friction_coefficient=coefficient)
    static = replace(static, contact=replace(static.contact, law=law))
    kept: list[PathState] = []

    def keep(state: PathState) -> bool:
        if state.t == goals[len(kept)]:
            kept.append(state)
        return False

    path = solve_path(static, goals, step_callback=keep)
    return [path.states[0], *kept]


def loop_checks(loop: FrictionLoop) -> tuple[Check, ...]:
    """The cycle's heat, and its balance with the work that was put in."""
    width, at = loop.widest
    turn = len(loop.torque_Nm) // 2
    return (
        Check(
            name=f"friction between the coils, mu {loop.coefficient:g}, heat per cycle",
            value=1e3 * loop.loss_J,
            unit="mJ",
            limit="-",
            passed=None,
            note=f"to {loop.torque_Nm[turn]:+.2f} Nm at {loop.deflection_rad[turn]:+.3f} rad and"
            f" back; loop at most {1e3 * width:.0f} mNm wide, at {at:+.3f} rad; loss factor"
            f" {loop.loss_factor:.1e}",
            source="Coulomb, return mapping; plane stress",
        ),
        Check(
            name="heat against external work round the cycle",
            value=100 * loop.imbalance,
            unit="%",
            limit=f"within +-{100 * BALANCE:g} %",
            passed=abs(loop.imbalance) <= BALANCE,
            note=f"{1e3 * loop.loss_J:.3f} mJ, {1e3 * loop.external_work_J:.3f} mJ",
            source="first law",
        ),
    )
