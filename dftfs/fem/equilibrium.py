"""Newton's method on one problem: from a trial displacement to a state of equilibrium.

States and their rates du/dt make a Hermite predictor, so close that the tangent factored there
serves for all corrections and, as preconditioner, for the rate at the corrected state (and so
for the tangent stiffness dT/dt): one factorisation an increment. Without a history an increment
starts at the last state and what is prescribed enters through the tangent, so that a large
rotation does not fold the first row of elements. The residual may rise on the way (a slender
part bends, then shortens), so no line search asks for descent; a correction is cut only where
it turns a point inside out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.assembly import STATUS_OK, ElasticBody, Evaluation
from dftfs.fem.constraints import DofMap, dof_map
from dftfs.fem.contact import ContactBody
from dftfs.fem.contacting_body import ContactingBody, TouchingEvaluation
from dftfs.fem.linear_solver import make_solver
from dftfs.fem.path_state import PathState
from dftfs.fem.plastic_body import PlasticBody
from dftfs.fem.predictor import extrapolated
from dftfs.fem.problem import StaticProblem
from dftfs.fem.sparse import dot, norm, preconditioned_cg

_REUSE_BELOW = 0.1  # factors are kept while a correction leaves less of residual and error
_QUADRATIC = 1e-6  # a correction this small by its own tangent leaves but its square
_PATIENCE = 6  # corrections without a new smallest residual before an increment is given up
_PROGRESS = 0.99  # of the smallest residual that counts as a new one
_OVERSHOOT = 0.5  # of the energy's slope along a correction in contact that may be left
_SEARCHES = 8  # lengths tried for it
_CONES = 40  # equilibria tried with friction limited by the pressures of the one before
_CONE_CHANGE = 1e-6  # of the friction's limits that may be left
_HALVINGS = 4  # of a correction that turns a point inside out


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure:
    """Why an increment was given up; the caller cuts it."""

    reason: str
    residual: float


_SINGULAR = Failure(reason="the tangent is singular", residual=np.inf)
_INSIDE_OUT = Failure(reason="an element turns inside out", residual=np.inf)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Trial:
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


class Equilibrium:
    """The equations of a problem at any t, with the factors of the last tangent."""

    def __init__(
        self, problem: StaticProblem, *, tolerance: float, max_iterations: int, solver: str
    ) -> None:
        self._problem = problem
        self._dofs = dof_map(problem.mesh, problem.supports, problem.drive, problem.cyclic)
        thickness_m = 1.0 if problem.thickness_m is None else problem.thickness_m
        self._body: ElasticBody | ContactingBody = _body(problem, self._dofs, thickness_m)
        self._contact: ContactBody | None = None
        if problem.contact is not None:
            self._contact = ContactBody(problem.mesh, problem.contact, thickness_m)
            self._body = ContactingBody(self._body, self._contact)
        self._prefer, self._pattern = solver, self._body.pattern
        self._solver = make_solver(self._pattern.indptr, self._pattern.indices, prefer=solver)
        self.solver_name = self._solver.name
        self._tolerance, self._max_iterations = tolerance, max_iterations
        self._force_scale = self._energy_scale = 0.0
        self._iterations = self._factorisations = 0
        self._factored: NDArray | None = None  # the very array u whose tangent is factored

    def close(self) -> None:
        """Free the factors."""
        self._solver.close()

    def resume(self, state: PathState) -> None:
        """Go on from a state that another path has left."""
        self._body.restore(state.history)
        if self._contact is not None:
            self._contact.restore(state.displacement_m, state.friction)

    def start(self) -> PathState:
        """Equilibrium at t = 0: the undeformed body, unless a load acts there already.

        Raises
        ------
        SolveError
            If the body can move freely or finds no equilibrium.
        """
        u = self._problem.prescribed(0.0)[0]
        outcome = self._corrected(0.0, u) if self._problem.load(0.0)[0].any() else u
        state = outcome if isinstance(outcome, Failure) else self._state(0.0, outcome)
        if isinstance(state, Failure):
            raise SolveError(f"no equilibrium at t=0: {state.reason}; is the body supported?")
        return state

    def advance(self, states: Sequence[PathState], t: float) -> PathState | Failure:
        """The state at t, from the states before it (the last few are used)."""
        self._iterations = self._factorisations = 0
        target = self._problem.prescribed(t)[0]
        last, pressed = states[-1].displacement_m, states[-1].pressed  # no smooth path over a knee
        outcome: NDArray | Failure | None = None
        predicted = extrapolated(
            [(s.t, s.displacement_m, s.rate_m) for s in states[-3:] if s.pressed == pressed], t
        )
        if predicted is not None:
            outcome = self._corrected(t, self._dofs.satisfied(predicted, target))
        if outcome is None or isinstance(outcome, Failure):
            gap = target - self._problem.prescribed(states[-1].t)[0]
            outcome = self._corrected(t, last, gap)
        if self._contact is not None:
            outcome = self._rubbed(t, self._augmented(t, outcome))
        return outcome if isinstance(outcome, Failure) else self._state(t, outcome)

    def _augmented(self, t: float, outcome: NDArray | Failure) -> NDArray | Failure:
        """Equilibrium again after each augmentation of the contact pressures, if any are asked."""
        before = self._contact.multiplier_Pa
        for _ in range(self._contact.law.augmentations):
            if isinstance(outcome, Failure):
                self._contact.multiplier_Pa = before
                return outcome
            self._contact.augment(outcome)
            outcome = self._corrected(t, outcome)
        return outcome

    def _rubbed(self, t: float, outcome: NDArray | Failure) -> NDArray | Failure:
        """Equilibrium whose friction is limited by its own pressures, see `friction`."""
        friction = self._contact.friction
        if friction is None:
            return outcome
        before = friction.state.limit_Pa
        for attempt in range(_CONES):
            if isinstance(outcome, Failure):
                friction.limit_Pa = before
                return outcome
            limit, pressure = friction.limit_Pa, self._contact.touch(outcome).pressure_Pa
            if friction.renew_cones(pressure, first=attempt == 0) <= _CONE_CHANGE:
                friction.limit_Pa = limit  # those of this equilibrium
                return outcome
            outcome = self._corrected(t, outcome)
        friction.limit_Pa = before
        return Failure(reason="pressure and friction do not settle", residual=np.inf)

    def _corrected(
        self, t: float, u: NDArray, gap: NDArray | None = None
    ) -> NDArray[np.float64] | Failure:
        """Newton's corrections of u until the last one was, in the energy norm, small enough.

        Not until the residual is: in a slender part that is mostly the residual of stiff
        directions, small long before the soft ones are right, and never below its round-off.
        """
        trial, renew = self._linearised(t, u, gap), True
        error, best, waited = np.inf, np.inf, 0
        for iteration in range(self._max_iterations):
            if renew and iteration:
                trial = self._linearised(t, trial.u, trial.gap)
            if isinstance(trial, Failure):
                return trial
            fresh = self._factored is trial.u
            self._iterations += 1
            change = self._solver.solve(trial.right)
            previous, error = error, self._error(change, trial)
            if error <= (_QUADRATIC if fresh else self._tolerance):
                return trial.u + self._dofs.expand(change)
            if not fresh and error > _REUSE_BELOW * previous:
                renew = True
                continue
            moved = self._moved(t, trial, change, cut=fresh)
            if fresh and moved is None:
                return _INSIDE_OUT
            after = np.inf if moved is None else moved.norm
            renew = trial.gap is not None or after > _REUSE_BELOW * trial.norm
            if fresh or after < trial.norm:
                trial = moved  # else back: old factors have misled
                waited = 0 if after < _PROGRESS * best else waited + 1
                best = min(best, after)
            if waited > _PATIENCE:
                break
        return Failure(reason="Newton's method diverges", residual=self._relative(trial))

    def _linearised(self, t: float, u: NDArray, gap: NDArray | None) -> _Trial | Failure:
        """A trial with its tangent factored and its gap in the right-hand side."""
        evaluation, product = self._body.tangent(u, np.zeros_like(u) if gap is None else gap)
        if evaluation.status != STATUS_OK:
            return _INSIDE_OUT
        if self._factored is not u and not self._factor(u):
            return _SINGULAR
        trial = self._trial(t, u, evaluation, gap)
        return replace(trial, right=trial.right - self._dofs.restrict(product))

    def _factor(self, u: NDArray) -> bool:
        self._factorisations += 1
        if self._pattern is not self._body.pattern:  # other facets have met: it has grown
            self._pattern = self._body.pattern
            self._solver.close()
            self._solver = make_solver(
                self._pattern.indptr, self._pattern.indices, prefer=self._prefer
            )
        self._factored = u if self._solver.factorise(self._body.stiffness) else None
        return self._factored is not None

    def _solved(self, u: NDArray, right: NDArray) -> NDArray | None:
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

    def _moved(self, t: float, trial: _Trial, change: NDArray, *, cut: bool) -> _Trial | None:
        """The trial after a correction, shortened (if ``cut``) until no point is inside out."""
        step = self._dofs.expand(change)
        step = step if trial.gap is None else step + trial.gap
        for halvings in range(_HALVINGS + 1 if cut else 1):
            part = 0.5**halvings
            u = trial.u + part * step
            evaluation = self._body.forces(u)
            if evaluation.status == STATUS_OK:
                gap = None if trial.gap is None or part == 1 else (1 - part) * trial.gap
                moved = self._trial(t, u, evaluation, gap)
                if trial.gap is None and (trial.pressed or moved.pressed):
                    return self._searched(t, trial, part * change, moved)
                return moved
        return None

    def _searched(self, t: float, trial: _Trial, change: NDArray, moved: _Trial) -> _Trial:
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
            best = self._trial(t, trial.u + part * step, evaluation)
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

    def _error(self, change: NDArray, trial: _Trial) -> float:
        """Energy norm of a correction over that of the solution (inf with a gap to close)."""
        if trial.gap is not None:
            return np.inf
        scale = max(self._energy_scale, trial.energy_J)
        energy = abs(dot(change, trial.right)) / 2
        if energy == 0.0:
            return 0.0
        return float(np.sqrt(energy / scale)) if scale > 0 else np.inf

    def _relative(self, trial: _Trial) -> float:
        scale = max(self._force_scale, trial.force)
        return trial.norm / scale if scale > 0 else 0.0

    def _trial(
        self, t: float, u: NDArray, evaluation: Evaluation, gap: NDArray | None = None
    ) -> _Trial:
        load = self._problem.load(t)[0]
        reaction = evaluation.force_N - load
        held = norm(reaction[self._dofs.prescribed])
        return _Trial(
            u=u,
            right=-self._dofs.restrict(reaction),
            force=float(np.hypot(held, norm(load))),
            energy_J=evaluation.energy_J,
            gap=gap,
            pressed=isinstance(evaluation, TouchingEvaluation) and evaluation.contact_energy_J > 0,
        )

    def _state(self, t: float, u: NDArray) -> PathState | Failure:
        """Everything known at equilibrium, its tangent factored for the next increment."""
        _, rate, curvature = self._problem.prescribed(t)
        load, load_rate = self._problem.load(t)
        evaluation, product = self._body.tangent(u, rate)
        if evaluation.status != STATUS_OK:
            return _INSIDE_OUT
        trial = self._trial(t, u, evaluation)
        self._force_scale = max(self._force_scale, trial.force)
        self._energy_scale = max(self._energy_scale, trial.energy_J)
        pull = self._dofs.restrict(product)
        change = self._solved(u, self._dofs.restrict(load_rate) - pull)
        if change is None:
            return _SINGULAR
        history = self._body.commit(u)
        friction = None if self._contact is None else self._contact.commit(u)
        if history is not None or (friction is not None and friction.traction_Pa.any()):
            self._factored = None  # the next tangent starts from another history
        reaction = evaluation.force_N - load
        stiffness = dot(rate, product) + dot(pull, change)
        stiffness += dot(reaction, curvature) - dot(load_rate, rate)
        full_rate = self._dofs.expand(change) + rate
        for array in (u, full_rate, reaction):
            array.setflags(write=False)
        return PathState(
            t=t,
            displacement_m=u,
            rate_m=full_rate,
            reaction_N=reaction,
            drive_force=dot(reaction, rate),
            drive_stiffness=stiffness,
            energy_J=evaluation.energy_J,
            iterations=self._iterations,
            factorisations=self._factorisations,
            residual=self._relative(trial),
            det_F_min=evaluation.det_F_min,
            negative_pivots=self._solver.negative_pivots,
            touch=getattr(evaluation, "touch", None),
            contact_energy_J=getattr(evaluation, "contact_energy_J", 0.0),
            history=history,
            friction=friction,
        )


def _body(problem: StaticProblem, dofs: DofMap, thickness_m: float) -> ElasticBody:
    constants = {
        "youngs_modulus_Pa": problem.youngs_modulus_Pa,
        "poisson_ratio": problem.poisson_ratio,
        "thickness_m": thickness_m,
    }
    if problem.hardening is None:
        return ElasticBody(problem.mesh, dofs, **constants)
    return PlasticBody(problem.mesh, dofs, **constants, hardening=problem.hardening)
