"""Derivatives of a twisted rod's state in the variables of its shape, by implicit differentiation.

A state is in equilibrium where the residual R(x, v) of the free degrees of freedom vanishes; v is
their difference from the unloaded arm, in units of the rod's length and in the frame of the
unloaded section (a variable that turns the arm does not stretch it). With the exact tangent
K = dR/dv, the state follows a variable by

    dv/dx_j = - K^-1 dR/dx_j,      dJ/dx_j = d/dh J(x + h e_j, v + h dv/dx_j) at h = 0

for any function J of shape and state, d/dh by central differences of fourth order. Only explicit
functions are differenced, never a converged solve; one factorisation serves all variables.
Source: D. A. Tortorelli & P. Michaleris, "Design sensitivity analysis: overview and review",
Inverse Problems in Engineering 1 (1994) 71-105.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.shape.space import ShapeSpace
from dftfs.spring.outline import SpringOutline, build_outline
from dftfs.spring.planar_rod import RodState, rod_state
from dftfs.spring.rod import ArmRod, arm_rod
from dftfs.spring.rod_kernel import band_solve, evaluate

STEP = 1e-4  # of a variable of order one, and twice that: round-off and truncation are alike
STENCIL = ((1.0, 8 / 12), (-1.0, -8 / 12), (2.0, -1 / 12), (-2.0, 1 / 12))

_ELEMENTS = 48


@dataclass(frozen=True, kw_only=True)
class ShapedArm:
    """The arm that belongs to variables (n,)."""

    variables: NDArray
    arm: ArmRod

    @property
    def outline(self) -> SpringOutline:
        """The outline of the whole spring."""
        return self.arm.outline


def shaped_arm(space: ShapeSpace, variables: NDArray) -> ShapedArm:
    """The rod of a shape, with the starting design's width and material.

    Raises
    ------
    DesignError
        If the variables make no solid.
    """
    design = space.start
    outline = build_outline(space.spiral(variables))
    material = design.material
    sweep = outline.feet.slit_theta - outline.feet.notch_theta
    arm = arm_rod(
        outline,
        design.width_m,
        material.youngs_modulus_Pa,
        material.poisson_ratio,
        # the same number for every shape: neighbours must have the same unknowns
        elements_per_turn=(_ELEMENTS - 0.5) * 2 * np.pi / sweep,
    )
    return ShapedArm(variables=np.asarray(variables, dtype=float), arm=arm)


Stencil = tuple[ShapedArm, ...]  # the arms of `STENCIL` in one variable


def neighbours(space: ShapeSpace, variables: NDArray) -> list[Stencil]:
    """The arms beside a shape in every variable."""
    return [
        tuple(shaped_arm(space, variables + STEP * times * unit) for times, _ in STENCIL)
        for unit in np.eye(len(variables))
    ]


def difference(values: Sequence[NDArray | float]) -> NDArray:
    """Derivative from the values at the places of `STENCIL`."""
    return sum(w * np.asarray(v) for (_, w), v in zip(STENCIL, values, strict=True)) / STEP


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """A converged state with its changes: dv (n, 3 k) per variable, dv_angle (3 k,) per radian."""

    shaped: ShapedArm
    stencil: list[Stencil]
    state: RodState
    dv: NDArray
    dv_angle: NDArray

    @property
    def angle_rad(self) -> float:
        """Turn of the rim."""
        return float(self.state.dofs[-1, 2])

    def gradient(self, function: Callable[[ShapedArm, RodState], NDArray]) -> NDArray:
        """Derivatives of a function of shape and state at a fixed angle, shape (n, *values)."""
        free = _free(self.shaped, self.state)
        rows = []
        for arms, change in zip(self.stencil, self.dv, strict=True):
            moved = [free + STEP * times * change for times, _ in STENCIL]
            states = [_state(arm, v, self.angle_rad) for arm, v in zip(arms, moved, strict=True)]
            rows.append(difference([function(*pair) for pair in zip(arms, states, strict=True)]))
        return np.array(rows)

    def by_angle(self, function: Callable[[ShapedArm, RodState], NDArray]) -> NDArray:
        """Derivative of a function over the rim's angle."""
        free = _free(self.shaped, self.state)
        steps = [STEP * times for times, _ in STENCIL]
        states = [
            _state(self.shaped, free + step * self.dv_angle, self.angle_rad + step)
            for step in steps
        ]
        return difference([function(self.shaped, state) for state in states])


def sensitivity(shaped: ShapedArm, stencil: list[Stencil], state: RodState) -> Sensitivity:
    """Differentiate a converged state of an arm."""
    free, angle = _free(shaped, state), float(state.dofs[-1, 2])
    _, _, band = evaluate(shaped.arm.rod.tables, state.dofs)

    def unbalanced(arm: ShapedArm, turn: float) -> NDArray:
        return evaluate(arm.arm.rod.tables, _dofs(arm, free, turn))[1][3:-3]

    rates = [difference([unbalanced(arm, angle) for arm in arms]) for arms in stencil]
    rates.append(difference([unbalanced(shaped, angle + STEP * t) for t, _ in STENCIL]))
    moved = -band_solve(band[:, 3:-3], np.array(rates).T).T
    moved = np.array([_in_sections(shaped, change, -1.0) for change in moved])
    return Sensitivity(
        shaped=shaped, stencil=stencil, state=state, dv=moved[:-1], dv_angle=moved[-1]
    )


def _free(shaped: ShapedArm, state: RodState) -> NDArray:
    moved = (state.dofs - shaped.arm.rod.tables.start).reshape(-1)[3:-3]
    return _in_sections(shaped, moved, -1.0)


def _in_sections(shaped: ShapedArm, free: NDArray, sense: float) -> NDArray:
    """Free displacements (3 k,) turned out of (+1) or into (-1) the unloaded sections' frames."""
    rows = free.reshape(-1, 3).copy()
    angle = sense * shaped.arm.rod.angles_rad[1:-1]
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = rows[:, 0].copy(), rows[:, 1].copy()
    rows[:, 0], rows[:, 1] = cosine * x - sine * y, sine * x + cosine * y
    return rows.reshape(-1)


def _dofs(shaped: ShapedArm, free: NDArray, angle_rad: float) -> NDArray:
    """Degrees of freedom (k, 3) of an arm, its hub end clamped and its rim end carried round."""
    start = shaped.arm.rod.tables.start
    dofs = start.copy()
    dofs.reshape(-1)[3:-3] += _in_sections(shaped, free, 1.0)
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    x, y, _ = start[-1]
    dofs[-1] = cosine * x - sine * y, sine * x + cosine * y, angle_rad
    return dofs


def _state(shaped: ShapedArm, free: NDArray, angle_rad: float) -> RodState:
    return rod_state(shaped.arm.rod, _dofs(shaped, free, angle_rad))
