"""Newton's method on one problem: from a trial displacement to a state of equilibrium.

States and their rates du/dt make a Hermite predictor, so close that the tangent factored there
serves for all corrections and, as preconditioner, for the rate at the corrected state (and so
for the tangent stiffness dT/dt): one factorisation an increment. Without a history an increment
starts at the last state and what is prescribed enters through the tangent, so that a large
rotation does not fold the first row of elements. The residual may rise on the way (a slender
part bends, then shortens), so no line search asks for descent; a correction is cut only where
it would invert an element.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.assembly import STATUS_OK, ElasticBody
from dftfs.fem.constraints import DofMap, dof_map
from dftfs.fem.contact import ContactBody
from dftfs.fem.contacting_body import ContactingBody
from dftfs.fem.linearisation import INVERTED, SINGULAR, Failure, Linearisation
from dftfs.fem.path_state import PathState
from dftfs.fem.plastic_body import PlasticBody
from dftfs.fem.predictor import extrapolated
from dftfs.fem.problem import StaticProblem
from dftfs.fem.sparse import dot

_REUSE_BELOW = 0.1  # factors are kept while a correction leaves less of residual and error
_QUADRATIC = 1e-6  # a correction this small by its own tangent leaves but its square
_PATIENCE = 6  # corrections without a new smallest residual before an increment is given up
_PROGRESS = 0.99  # of the smallest residual that counts as a new one
_FRICTION_SOLVES = 40  # equilibria tried with friction bounds from the pressures before
_BOUND_CHANGE = 1e-6  # of the friction bounds that may be left


class Equilibrium:
    """States of equilibrium of a problem, one increment of t after the other."""

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
        self._linear = Linearisation(
            problem, self._dofs, self._body, tolerance=tolerance, solver=solver
        )
        self.solver_name = self._linear.solver_name
        self._tolerance, self._max_iterations = tolerance, max_iterations
        self._iterations = 0

    def close(self) -> None:
        """Free the factors."""
        self._linear.close()

    def resume(self, state: PathState) -> None:
        """Continue from a state that another path has left."""
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
        end = self._corrected(0.0, u) if self._problem.load(0.0)[0].any() else u
        state = end if isinstance(end, Failure) else self._state(0.0, end)
        if isinstance(state, Failure):
            raise SolveError(f"no equilibrium at t=0: {state.reason}; is the body supported?")
        return state

    def advance(
        self, states: Sequence[PathState], t: float, guess: NDArray | None = None
    ) -> PathState | Failure:
        """The state at t, from a guess of it or the states before (the last few are used)."""
        self._iterations = self._linear.factorisations = 0
        target = self._problem.prescribed(t)[0]
        last, pressed = states[-1].displacement_m, states[-1].pressed  # no smooth path over a knee
        end: NDArray | Failure | None = None
        if guess is not None:
            end = self._corrected(t, self._dofs.satisfied(guess, target))
        if end is None or isinstance(end, Failure):
            predicted = extrapolated(
                [(s.t, s.displacement_m, s.rate_m) for s in states[-3:] if s.pressed == pressed], t
            )
            if predicted is not None:
                end = self._corrected(t, self._dofs.satisfied(predicted, target))
        if end is None or isinstance(end, Failure):
            gap = target - self._problem.prescribed(states[-1].t)[0]
            end = self._corrected(t, last, gap)
        if self._contact is not None:
            end = self._with_friction(t, self._augmented(t, end))
        return end if isinstance(end, Failure) else self._state(t, end)

    def _augmented(self, t: float, end: NDArray | Failure) -> NDArray | Failure:
        """Equilibrium again after each augmentation of the contact pressures, if any are asked."""
        before = self._contact.multiplier_Pa
        for _ in range(self._contact.law.augmentations):
            if isinstance(end, Failure):
                self._contact.multiplier_Pa = before
                return end
            self._contact.augment(end)
            end = self._corrected(t, end)
        return end

    def _with_friction(self, t: float, end: NDArray | Failure) -> NDArray | Failure:
        """Equilibrium whose friction is limited by its own pressures, see `friction`."""
        friction = self._contact.friction
        if friction is None:
            return end
        before = friction.state.limit_Pa
        for attempt in range(_FRICTION_SOLVES):
            if isinstance(end, Failure):
                friction.limit_Pa = before
                return end
            limit, pressure = friction.limit_Pa, self._contact.touch(end).pressure_Pa
            if friction.update_bounds(pressure, first=attempt == 0) <= _BOUND_CHANGE:
                friction.limit_Pa = limit  # those of this equilibrium
                return end
            end = self._corrected(t, end)
        friction.limit_Pa = before
        return Failure(reason="pressure and friction do not settle", residual=np.inf)

    def _corrected(
        self, t: float, u: NDArray, gap: NDArray | None = None
    ) -> NDArray[np.float64] | Failure:
        """Newton's corrections of u until the last one was, in the energy norm, small enough.

        Not until the residual is: in a slender part that is mostly the residual of stiff
        directions, small long before the soft ones are right, and never below its round-off.
        """
        trial, renew = self._linear.linearised(t, u, gap), True
        error, best, waited = np.inf, np.inf, 0
        for iteration in range(self._max_iterations):
            if renew and iteration:
                trial = self._linear.linearised(t, trial.u, trial.gap)
            if isinstance(trial, Failure):
                return trial
            fresh = self._linear.is_factored(trial)
            self._iterations += 1
            change = self._linear.correction(trial)
            previous, error = error, self._linear.error(change, trial)
            if error <= (_QUADRATIC if fresh else self._tolerance):
                return trial.u + self._dofs.expand(change)
            if not fresh and error > _REUSE_BELOW * previous:
                renew = True
                continue
            moved = self._linear.moved(t, trial, change, cut=fresh)
            if fresh and moved is None:
                return INVERTED
            after = np.inf if moved is None else moved.norm
            renew = trial.gap is not None or after > _REUSE_BELOW * trial.norm
            if fresh or after < trial.norm:
                trial = moved  # else back: old factors have misled
                waited = 0 if after < _PROGRESS * best else waited + 1
                best = min(best, after)
            if waited > _PATIENCE:
                break
        return Failure(reason="Newton's method diverges", residual=self._linear.relative(trial))

    def _state(self, t: float, u: NDArray) -> PathState | Failure:
        """Everything known at equilibrium, its tangent factored for the next increment."""
        _, rate, curvature = self._problem.prescribed(t)
        load, load_rate = self._problem.load(t)
        evaluation, product = self._body.tangent(u, rate)
        if evaluation.status != STATUS_OK:
            return INVERTED
        trial = self._linear.trial(t, u, evaluation)
        self._linear.keep_scaling(trial)
        internal_rate = self._dofs.restrict(product)
        change = self._linear.solved(u, self._dofs.restrict(load_rate) - internal_rate)
        if change is None:
            return SINGULAR
        history = self._body.commit(u)
        friction = None if self._contact is None else self._contact.commit(u)
        if history is not None or (friction is not None and friction.traction_Pa.any()):
            self._linear.discard_factors()  # the next tangent starts from another history
        reaction = evaluation.force_N - load
        stiffness = dot(rate, product) + dot(internal_rate, change)
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
            factorisations=self._linear.factorisations,
            residual=self._linear.relative(trial),
            det_F_min=evaluation.det_F_min,
            negative_pivots=self._linear.negative_pivots,
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
