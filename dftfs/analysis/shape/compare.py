"""A shaped arm against the best uniform one and the starting design, each by finite elements."""

from collections.abc import Callable
from dataclasses import dataclass

from dftfs.analysis.shape.confirm import ConfirmedShape, confirmed, corrected
from dftfs.analysis.shape.optimise import Aim, Shape, optimised, shape_of
from dftfs.analysis.shape.responses import DIRECTIONS, Correction, responses
from dftfs.analysis.shape.space import UNIFORM, ShapeSpace
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.process import Process
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod

_ANY_BALANCE = 100.0  # a uniform arm has no means to make both directions equal
_ROUNDS_AFTER_ELEMENTS = 4


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Start, best uniform arm and shaped arm; ``judged`` by the same model, in that order.

    before, after : stress over torque along the arm by the rod model, of start and shape.
    """

    aim: Aim
    start: SpringDesign
    uniform: SpringDesign
    shaped: SpringDesign
    judged: tuple[ConfirmedShape, ...]
    before: Shape
    after: Shape

    @property
    def gain(self) -> float:
        """Torque at yield per mass of the shape over the start's."""
        return self.judged[2].torque_per_mass / self.judged[0].torque_per_mass

    @property
    def kept(self) -> bool:
        """Whether the shape keeps contact-free torque, balance and torque at yield."""
        last, aim = self.judged[2], self.aim
        contact = [value for value in last.contact_Nm.values() if value is not None]
        if len(contact) < len(DIRECTIONS):
            return False
        balanced = max(contact) <= (1 + aim.balance) * min(contact)
        enough = min(contact) >= aim.contact_free_torque_Nm
        return balanced and enough and last.torque_at_yield_Nm >= aim.torque_at_yield_Nm


def compared(
    design: SpringDesign,
    process: Process,
    *,
    rounds: int,
    elements: bool = True,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Comparison:
    """Optimise a design's arms, correct the rod model by 2D elements once, confirm in 3D.

    Raises
    ------
    DesignError
        If the design states no torque to keep, or is no start for a search.
    SolveError
        If a solve fails.
    """
    aim, loose = _aim(design), _aim(design, _ANY_BALANCE)
    plain = ShapeSpace(start=design, process=process, kinds=UNIFORM)
    space = ShapeSpace(start=design, process=process)
    before = _judged(space, aim)
    uniform = optimised(plain, loose, rounds=rounds, on_progress=_named(on_progress, "uniform"))
    after = optimised(space, aim, rounds=rounds, on_progress=_named(on_progress, "shaped"))
    designs = {
        "uniform": plain.design(uniform.variables, uniform.width_m, f"{design.name}-uniform"),
        "shaped": space.design(after.variables, after.width_m, f"{design.name}-shaped"),
    }
    if elements:
        flat = confirmed(designs["shaped"], aim, dimension=2)
        fix = corrected(after, flat, aim, Correction())
        on_progress(f"2D elements: {flat.torque_per_mass:.2f} Nm/kg; the rod model is corrected")
        after = optimised(
            space,
            aim,
            correction=fix,
            start=after.variables,
            rounds=_ROUNDS_AFTER_ELEMENTS,
            on_progress=_named(on_progress, "shaped"),
        )
        designs["shaped"] = space.design(after.variables, after.width_m, f"{design.name}-shaped")
    judged = []
    for one, rod in ((design, before), (designs["uniform"], uniform), (designs["shaped"], after)):
        judged.append(confirmed(one, aim, dimension=3) if elements else _by_rod(one, rod, aim))
        on_progress(f"{judged[-1].model}, {one.name}: {judged[-1].torque_per_mass:.2f} Nm/kg")
    return Comparison(
        aim=aim,
        start=design,
        uniform=designs["uniform"],
        shaped=designs["shaped"],
        judged=tuple(judged),
        before=before,
        after=after,
    )


def _aim(design: SpringDesign, balance: float = 0.10) -> Aim:
    asked = design.requirements
    if asked.contact_free_torque_Nm is None:
        raise DesignError(
            f"{design.name}: contact_free_torque_Nm is missing under [requirements];"
            " for example --set contact_free_torque_Nm=15"
        )
    material = design.material
    arm = arm_rod(
        design.outline, design.width_m, material.youngs_modulus_Pa, material.poisson_ratio
    )
    operating = asked.operating_torque_Nm or asked.contact_free_torque_Nm
    return Aim(
        stiffness_Nm_per_rad=design.n_arms * twist_stiffness(arm.rod),
        contact_free_torque_Nm=asked.contact_free_torque_Nm,
        largest_width_m=design.width_m,
        torque_at_yield_Nm=asked.min_safety_factor_yield * operating,
        balance=balance,
    )


def _judged(space: ShapeSpace, aim: Aim) -> Shape:
    found = responses(space, space.origin, angle_rad=aim.angle_rad)
    return shape_of(space, aim, space.origin, found)


def _by_rod(design: SpringDesign, rod: Shape, aim: Aim) -> ConfirmedShape:
    return ConfirmedShape(
        name=design.name,
        model="rod",
        stiffness_Nm_per_rad=aim.stiffness_Nm_per_rad,
        mass_kg=rod.mass_kg,
        contact_Nm=dict(zip(DIRECTIONS, rod.contact_Nm, strict=True)),
        stress_Pa_per_Nm={},
        torque_at_yield_Nm=rod.torque_at_yield_Nm,
    )


def _named(say: Callable[[str], None], name: str) -> Callable[[str], None]:
    return lambda message: say(f"{name}, {message}")
