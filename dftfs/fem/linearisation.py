"""One linearisation of a problem: trial displacements, their tangent, its factors, corrections."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.assembly import STATUS_OK, ElasticBody, Evaluation
from dftfs.fem.constraints import DofMap
from dftfs.fem.contacting_body import ContactingBody, TouchingEvaluation
from dftfs.fem.linear_solver import make_solver
from dftfs.fem.problem import StaticProblem
from dftfs.fem.sparse import dot, norm, preconditioned_cg

_OVERSHOOT = 0.5  # of the energy's slope along a correction in contact that may be left
_SEARCHES = 8  # lengths tried for it
_HALVINGS = 4  # of a correction that inverts an element


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure:
    """Why an increment was given up; the caller cuts it."""

    reason: str
    residual: float


SINGULAR = Failure(reason="the tangent is singular", residual=np.inf)
INVERTED = Failure(reason="an element is inverted", residual=np.inf)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """Where an increment's corrections stand.

    ``right`` is the free right-hand side: loads less internal forces. ``force`` (norm of the
    reactions and loads) and ``energy_J`` are its scales. ``gap`` is a part of the prescribed
    displacement that ``u`` does not have yet: applied through the tangent. ``pressed`` says that
    surfaces are in contact.
    """

    u: NDArray[np.float64]
    right: NDArray[np.float64]
    force: float
    energy_J: float
    gap: NDArray[np.float64] | None = None
    pressed: bool = False

    @property
    def norm(self) -> float:
        return norm(self.right)


class Linearisation:
    """The equations of a problem at trial displacements, with the factors of the last tangent."""

    def __init__(
        self,
        problem: StaticProblem,
        dofs: DofMap,
        body: ElasticBody | ContactingBody,
        *,
        tolerance: float,
        solver: str,
    ) -> None:
        self._problem, self._dofs, self._body = problem, dofs, body
        self._tolerance = tolerance
        self._prefer, self._pattern = solver, body.pattern
        self._solver = make_solver(self._pattern.indptr, self._pattern.indices, prefer=solver)
        self.solver_name = self._solver.name
        self.factorisations = 0
        self._force_scale = self._energy_scale = 0.0
        self._factored: NDArray | None = None  # the very array u whose tangent is factored
        if isinstance(body, ContactingBody):
            body.before_growth = self._release

    def close(self) -> None:
        """Free the factors."""
        if self._solver is not None:
            self._solver.close()

    def _release(self) -> None:
        """Let go of factors and pattern: the next tangent has another one."""
        self.close()
        self._solver = self._pattern = self._factored = None

    @property
    def negative_pivots(self) -> int:
        """Of the last tangent factored."""
        return self._solver.negative_pivots

    def is_factored(self, trial: Trial) -> bool:
        """Whether the factors are those of this trial's own tangent."""
        return self._factored is trial.u

    def discard_factors(self) -> None:
        """Keep the factors as a preconditioner only: the tangent is another one now."""
        self._factored = None

    def keep_scaling(self, trial: Trial) -> None:
        """Let a state of equilibrium set the scales of force and energy."""
        self._force_scale = max(self._force_scale, trial.force)
        self._energy_scale = max(self._energy_scale, trial.energy_J)

    def correction(self, trial: Trial) -> NDArray[np.float64]:
        """Change of the free displacements by the present factors, (n_free,) in m."""
        return self._solver.solve(trial.right)

    def linearised(self, t: float, u: NDArray, gap: NDArray | None) -> Trial | Failure:
        """A trial with its tangent factored and its gap in the right-hand side."""
        evaluation, product = self._body.tangent(u, np.zeros_like(u) if gap is None else gap)
        if evaluation.status != STATUS_OK:
            return INVERTED
        if self._factored is not u and not self._factor(u):
            return SINGULAR
        trial = self.trial(t, u, evaluation, gap)
        return replace(trial, right=trial.right - self._dofs.restrict(product))

    def _factor(self, u: NDArray) -> bool:
        self.factorisations += 1
        if self._pattern is not self._body.pattern:  # other facets have met: it has grown
            self._pattern = self._body.pattern
            self._solver = make_solver(
                self._pattern.indptr, self._pattern.indices, prefer=self._prefer
            )
        self._factored = u if self._solver.factorise(self._body.stiffness) else None
        return self._factored is not None

    def solved(self, u: NDArray, right: NDArray) -> NDArray | None:
        """K^-1 ``right`` with the tangent in the body, that of u; None if it is singular."""
        if self._factored is not None and self._factored is not u:
            solution = preconditioned_cg(
                self._body.multiply, self._solver.solve, right, tolerance=self._tolerance
            )
            if solution is not None:
                return solution
        if self._factored is not u and not self._factor(u):
            return None
        return self._solver.solve(right)

    def moved(self, t: float, trial: Trial, change: NDArray, *, cut: bool) -> Trial | None:
        """The trial after a correction, shortened (if ``cut``) until no element is inverted."""
        step = self._dofs.expand(change)
        step = step if trial.gap is None else step + trial.gap
        for halvings in range(_HALVINGS + 1 if cut else 1):
            part = 0.5**halvings
            u = trial.u + part * step
            evaluation = self._body.forces(u)
            if evaluation.status == STATUS_OK:
                gap = None if trial.gap is None or part == 1 else (1 - part) * trial.gap
                moved = self.trial(t, u, evaluation, gap)
                if trial.gap is None and (trial.pressed or moved.pressed):
                    return self._searched(t, trial, part * change, moved)
                return moved
        return None

    def _searched(self, t: float, trial: Trial, change: NDArray, moved: Trial) -> Trial:
        """A correction in contact, shortened where it overshoots along its own direction.

        The work of the residual on the correction is the slope of the energy along it: a zero
        that the full length has passed is bracketed and closed in on by Illinois' regula falsi.
        """
        start = dot(trial.right, change)
        low, low_slope, high, high_slope = 0.0, start, 1.0, dot(moved.right, change)
        best, side = moved, 0
        step = self._dofs.expand(change)
        for _ in range(_SEARCHES):
            if not high_slope < -_OVERSHOOT * start:
                break
            part = (low * high_slope - high * low_slope) / (high_slope - low_slope)
            evaluation = self._body.forces(trial.u + part * step)
            if evaluation.status != STATUS_OK:
                break
            best = self.trial(t, trial.u + part * step, evaluation)
            slope = dot(best.right, change)
            if abs(slope) <= _OVERSHOOT * start:
                break
            if slope < 0:
                high, high_slope = part, slope
                low_slope /= 2 if side < 0 else 1
                side = -1
            else:
                low, low_slope = part, slope
                high_slope /= 2 if side > 0 else 1
                side = 1
        return best

    def error(self, change: NDArray, trial: Trial) -> float:
        """Energy norm of a correction over that of the solution (inf with a gap to close)."""
        if trial.gap is not None:
            return np.inf
        scale = max(self._energy_scale, trial.energy_J)
        energy = abs(dot(change, trial.right)) / 2
        if energy == 0.0:
            return 0.0
        return float(np.sqrt(energy / scale)) if scale > 0 else np.inf

    def relative(self, trial: Trial) -> float:
        """Residual over the largest reactions and loads so far."""
        scale = max(self._force_scale, trial.force)
        return trial.norm / scale if scale > 0 else 0.0

    def trial(
        self, t: float, u: NDArray, evaluation: Evaluation, gap: NDArray | None = None
    ) -> Trial:
        """The right-hand side and the scales of an evaluation at u."""
        load = self._problem.load(t)[0]
        reaction = evaluation.force_N - load
        held = norm(reaction[self._dofs.prescribed])
        return Trial(
            u=u,
            right=-self._dofs.restrict(reaction),
            force=float(np.hypot(held, norm(load))),
            energy_J=evaluation.energy_J,
            gap=gap,
            pressed=isinstance(evaluation, TouchingEvaluation) and evaluation.contact_energy_J > 0,
        )
