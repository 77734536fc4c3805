"""A spring that relaxes: Maxwell branches beside the elastic law, and a damper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import block, slots
from rsea_core.effects.spring_base import NEEDS_SPRING
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError

N_BRANCHES = 3  # branches of a Maxwell model
RISE = "stiffness_rise_fast_over_static"
SPRING_DAMPING = slots("spring_damping")
BRANCH_STIFFNESS = block("branch_stiffness", N_BRANCHES, internal=True)
BRANCH_TIME = block("branch_time", N_BRANCHES)


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Damping and relaxing branches in parallel to the spring."""
    if "damping_Nms_per_rad" in v:
        d.put(SPRING_DAMPING, v["damping_Nms_per_rad"])
    for j in range(N_BRANCHES):
        if f"branch_stiffness_{j + 1}_Nm_per_rad" in v:
            d.put(BRANCH_STIFFNESS + j, v[f"branch_stiffness_{j + 1}_Nm_per_rad"])
            d.put(BRANCH_TIME + j, v[f"branch_time_{j + 1}_s"])


def _branch_stiffness(number: int):
    return parameter(
        0.0,
        unit="Nm/rad",
        bounds=(0.0, 1e9),
        source="0: branch absent; a fit",
        meaning=f"Stiffness that branch {number} adds at once and loses with time.",
    )


def _branch_time(number: int, default_s: float):
    return parameter(
        default_s,
        unit="s",
        bounds=(1e-12, 1e9),
        source="a fit",
        meaning=f"Time in which branch {number} relaxes to 1/e.",
    )


@dataclass(frozen=True, kw_only=True)
class SpringViscoelastic(Term):
    """Damping and relaxation by a generalised Maxwell model.

    tau_s = f(d) + c d' + sum k_i q_i, q_i' = d' - q_i / T_i. The spring's own f is the relaxed
    one; at once it is stiffer by the sum of the branches.

    Source
    ------
    Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, ch. 3 (Springer 1989).
    """

    effect: ClassVar[str] = "spring-viscoelastic"
    law: ClassVar[str] = "maxwell-branches"
    port: ClassVar[Port] = Port.SPRING
    headline: ClassVar[str] = "The spring is viscoelastic: its torque depends on the rate."
    figure_units: ClassVar[Mapping[str, str]] = {
        RISE: "-", "damping_Nms_per_rad": "Nms/rad",
    }  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="one branch", part="spring",
        size=lambda m: (
            (0.1 * m.rig.spring_stiffness_Nm_per_rad, 0.15), "10 % of viscoelastic stiffness",
        ),
    )  # fmt: skip

    damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 1e9),
        source="0: none; a fit",
        meaning="Torque in proportion to the rate of deflection (Kelvin).",
    )
    branch_stiffness_1_Nm_per_rad: float = _branch_stiffness(1)
    branch_time_1_s: float = _branch_time(1, 0.01)
    branch_stiffness_2_Nm_per_rad: float = _branch_stiffness(2)
    branch_time_2_s: float = _branch_time(2, 0.1)
    branch_stiffness_3_Nm_per_rad: float = _branch_stiffness(3)
    branch_time_3_s: float = _branch_time(3, 1.0)

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:
        """Stiffness [Nm/rad] and time [s] of the branches that are there."""
        pairs = [
            (getattr(self, f"branch_stiffness_{i}_Nm_per_rad"), getattr(self, f"branch_time_{i}_s"))
            for i in range(1, N_BRANCHES + 1)
        ]
        return tuple(pair for pair in pairs if pair[0] > 0.0)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Instantaneous over relaxed stiffness of branches; the damping of a damper.

        A damper alone has no stiffness at fast deflections: their ratio would say that there is no
        effect.
        """
        relaxed = context.need(self.effect, "spring_stiffness_Nm_per_rad")
        if not relaxed > 0.0:
            raise TermError(
                f"{self.effect}: spring_stiffness_Nm_per_rad = {relaxed} must be above 0"
            )
        damper = {"damping_Nms_per_rad": self.damping_Nms_per_rad}
        if self.damping_Nms_per_rad > 0.0 and not self.branches:
            return damper
        rise = {RISE: 1.0 + sum(stiffness for stiffness, _ in self.branches) / relaxed}
        return rise | damper if self.damping_Nms_per_rad > 0.0 else rise

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        found = {}
        for i, (stiffness, time) in enumerate(self.branches, start=1):
            found |= {f"branch_stiffness_{i}": stiffness, f"branch_time_{i}": time}
        if self.damping_Nms_per_rad > 0.0:
            found["spring_damping"] = self.damping_Nms_per_rad
        return found | {"internal_states": 1.0} if found else found

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It needs a deflection."""
        return NEEDS_SPRING if rigid else None

    def equation(self) -> str:
        branches = ", ".join(f"{k:g} Nm/rad in {t:g} s" for k, t in self.branches)
        return (
            f"tau_s = f(d) + {self.damping_Nms_per_rad:g} d' + sum k_i q_i,"
            f" q_i' = d' - q_i/T_i: {branches or 'no branch'}"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A damper, and one to three relaxing branches."""
        K, s = typical.stiffness, typical.like_time
        damping = Unknown(name="damping_Nms_per_rad", unit="Nms/rad", low=0.0, scale=s(0.001) * K,
                          high=s(0.5) * K)  # fmt: skip
        branch = [
            (
                Unknown(name=f"branch_stiffness_{j}_Nm_per_rad", unit="Nm/rad", low=0.0, high=3 * K,
                        scale=0.03 * K),
                Unknown(name=f"branch_time_{j}_s", unit="s", low=s(2e-3), high=s(100.0), scale=0.15,
                        log=True, prior=1.5),
            )
            for j in (1, 2, 3)
        ]  # fmt: skip
        common = {"effect": cls.effect, "subsystem": "spring", "write": _write, "kind": cls}
        return (
            Law(law="damper", unknowns=(damping,), starts=((s(0.0005) * K,), (s(0.004) * K,)),
                richer=("one branch", "two branches"), **common),
            Law(law="one branch", unknowns=branch[0],
                starts=tuple((0.1 * K, s(time)) for time in (0.02, 0.15, 1.0)),
                richer=("two branches", "three branches"), **common),
            Law(law="two branches", unknowns=(*branch[0], *branch[1]),
                starts=((0.06 * K, s(0.05), 0.06 * K, s(1.0)),), richer=("three branches",),
                **common),
            Law(law="three branches", unknowns=(*branch[0], *branch[1], *branch[2]),
                starts=((0.04 * K, s(0.03), 0.04 * K, s(0.3), 0.04 * K, s(3.0)),),
                **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """How much stiffer it is at once, or how strongly it is damped."""
        parts = []
        if RISE in f.figures:
            parts.append(f"{f.figures[RISE]:.4g} times as stiff at fast as at slow deflection")
        if "damping_Nms_per_rad" in f.figures:
            parts.append(f"damped by {f('damping_Nms_per_rad', 'Nms/rad')}")
        return f"a viscoelastic spring, {' and '.join(parts)}"
