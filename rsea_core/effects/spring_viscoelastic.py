"""A spring that relaxes: Maxwell branches beside the elastic law, and a damper."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds
from rsea_core.effects.spring_base import N_BRANCHES, NEEDS_SPRING
from rsea_core.errors import TermError


@dataclass(frozen=True, kw_only=True)
class SpringViscoelastic(Term):
    """Damping and relaxation by a generalised Maxwell model.

    tau_s = f(d) + c d' + sum k_i q_i, q_i' = d' - q_i / T_i. The spring's own f is the relaxed
    one; at once it is stiffer by the sum of the branches.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, ch. 3 (Springer 1989).
    """

    effect: ClassVar[str] = "spring-viscoelastic"
    law: ClassVar[str] = "maxwell-branches"
    port: ClassVar[Port] = Port.SPRING

    damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 20.0),
        source="0: none; a fit",
        meaning="Torque in proportion to the rate of deflection (Kelvin).",
    )
    branch_stiffness_1_Nm_per_rad: float = parameter(
        0.0,
        unit="Nm/rad",
        bounds=(0.0, 1e5),
        source="0: branch absent; a fit",
        meaning="Stiffness that branch 1 adds at once and loses with time.",
    )
    branch_time_1_s: float = parameter(
        0.01,
        unit="s",
        bounds=(1e-3, 1e4),
        source="a fit",
        meaning="Time in which branch 1 relaxes to 1/e.",
    )
    branch_stiffness_2_Nm_per_rad: float = parameter(
        0.0,
        unit="Nm/rad",
        bounds=(0.0, 1e5),
        source="0: branch absent; a fit",
        meaning="Stiffness that branch 2 adds at once and loses with time.",
    )
    branch_time_2_s: float = parameter(
        0.1,
        unit="s",
        bounds=(1e-3, 1e4),
        source="a fit",
        meaning="Time in which branch 2 relaxes to 1/e.",
    )
    branch_stiffness_3_Nm_per_rad: float = parameter(
        0.0,
        unit="Nm/rad",
        bounds=(0.0, 1e5),
        source="0: branch absent; a fit",
        meaning="Stiffness that branch 3 adds at once and loses with time.",
    )
    branch_time_3_s: float = parameter(
        1.0,
        unit="s",
        bounds=(1e-3, 1e4),
        source="a fit",
        meaning="Time in which branch 3 relaxes to 1/e.",
    )

    def __post_init__(self):
        require_bounds(self)

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:
        """Stiffness [Nm/rad] and time [s] of the branches that are there."""
        pairs = [
            (getattr(self, f"branch_stiffness_{i}_Nm_per_rad"), getattr(self, f"branch_time_{i}_s"))
            for i in range(1, N_BRANCHES + 1)
        ]
        return tuple(pair for pair in pairs if pair[0] > 0.0)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Instantaneous over relaxed stiffness, dashpot left out."""
        relaxed = context.need(self.effect, "spring_stiffness_Nm_per_rad")
        if not relaxed > 0.0:
            raise TermError(
                f"{self.effect}: spring_stiffness_Nm_per_rad = {relaxed} must be above 0"
            )
        fast = sum(stiffness for stiffness, _ in self.branches)
        return {"stiffness_rise_fast_over_static": 1.0 + fast / relaxed}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        found = {}
        for i, (stiffness, time) in enumerate(self.branches, start=1):
            found |= {f"branch_stiffness_{i}": stiffness, f"branch_time_{i}": time}
        if self.damping_Nms_per_rad > 0.0:
            found["spring_damping"] = self.damping_Nms_per_rad
        return found | {"memory": 1.0} if found else found

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It needs a deflection."""
        return NEEDS_SPRING if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        branches = ", ".join(f"{k:g} Nm/rad in {t:g} s" for k, t in self.branches)
        return (
            f"tau_s = f(d) + {self.damping_Nms_per_rad:g} d' + sum k_i q_i,"
            f" q_i' = d' - q_i/T_i: {branches or 'no branch'}"
        )
