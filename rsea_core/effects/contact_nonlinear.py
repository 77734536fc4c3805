"""An environment that is not a linear spring and damper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values

EXPONENT, DEPTH, LOSS_FACTOR = slots(
    "contact_exponent", "contact_reference_depth", "contact_loss_factor"
)
BENCH_DEPTH_rad = 0.05  # at which the stiffness of the bench's contact holds
DEEP_rad = 0.3  # depth of a nonlinear contact that the default step is made for


@njit(error_model="numpy", inline="always")
def contact_torque(fx, stiffness, depth, speed):
    """Elastic and lossy torque [Nm] of a contact by power law and Hunt-Crossley damping."""
    if depth <= 0.0:
        return 0.0, 0.0
    reference = fx[DEPTH]
    elastic = stiffness * reference * (depth / reference) ** fx[EXPONENT]
    return elastic, elastic * max(fx[LOSS_FACTOR] * speed, -1.0)


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """A contact by power law; the stiffness of the load is its secant at the reference depth."""
    if w.kind != "contact":
        return
    d.put(EXPONENT, v["exponent"])
    d.put(DEPTH, v.get("reference_depth_rad", BENCH_DEPTH_rad))
    d.put(LOSS_FACTOR, v.get("loss_factor_s_per_rad", 0.0))


@njit(cache=True, error_model="numpy")
def _torques(fx, stiffness, depths):
    """Torques (n,) of a nonlinear contact at rest."""
    return np.array([contact_torque(fx, stiffness, z, 0.0)[0] for z in depths])


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    plant = d.machine_numbers
    if d.fx[EXPONENT] == 0.0:
        return plant.contact_stiffness * x
    return _torques(d.fx, plant.contact_stiffness, x)


@dataclass(frozen=True, kw_only=True)
class ContactNonlinear(Term):
    """A contact by a power law, with Hunt-Crossley damping; it replaces the load's K_e depth.

    tau = K_e d_r (d/d_r)^n (1 + lambda w_l) at depth d, never pulling; the load's own contact
    damping is added as it is. The default step is made for depths up to 0.3 rad.

    Source
    ------
    Hunt & Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl.
    Mech. 42 (1975) 440; Hertz: n = 1.5.
    """

    effect: ClassVar[str] = "contact-nonlinear"
    law: ClassVar[str] = "power-law"
    port: ClassVar[Port] = Port.ENVIRONMENT
    headline: ClassVar[str] = "The contact is nonlinear."
    figure_units: ClassVar[Mapping[str, str]] = {"exponent": "-"}
    curve: ClassVar = EffectCurve(
        title="Torque of the contact", x_label="depth (rad)", y_label="torque (Nm)", over="depth",
        evaluate=_drawn,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="power", part="contact", size=lambda m: ((1.3,), "a contact of exponent 1.3")
    )

    exponent: float = parameter(
        unit="-",
        bounds=(0.5, 3.0),
        source="1 linear, 1.5 Hertz; below 1 softening, as of foam",
        meaning="Power of the depth with which the contact torque grows.",
    )
    reference_depth_rad: float = parameter(
        0.05,
        unit="rad",
        bounds=(1e-12, 1e9),
        source="where K_e is the secant",
        free=False,
        meaning="Depth at which the power law has the torque of the linear contact.",
    )
    loss_factor_s_per_rad: float = parameter(
        0.0,
        unit="s/rad",
        bounds=(0.0, 5.0),
        source="0: no Hunt-Crossley damping",
        meaning="Share of the elastic torque lost per unit of approach speed.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        return {
            "contact_exponent": self.exponent,
            "contact_reference_depth": self.reference_depth_rad,
            "contact_loss_factor": self.loss_factor_s_per_rad,
        }

    def equation(self) -> str:
        d_r = self.reference_depth_rad
        return (
            f"tau_contact = K_e {d_r:g} (d/{d_r:g})^{self.exponent:g}"
            f" (1 + {self.loss_factor_s_per_rad:g} w_l), d = theta_l - theta_e > 0, not below 0"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A power, without and with losses."""
        if "contact" not in typical.loads:
            return ()
        softest = 0.5 if typical.relative else 1.0
        power = Unknown(name="exponent", unit="-", low=softest, high=3.0, scale=0.05)
        loss = Unknown(name="loss_factor_s_per_rad", unit="s/rad", low=0.0, high=5.0, scale=0.1,
                       prior=1.0)  # fmt: skip
        common = {"effect": cls.effect, "subsystem": "environment", "write": _write, "kind": cls}
        unknowns: tuple[Unknown, ...] = (power,)
        starts: tuple[tuple[float, ...], ...] = ((1.2,), (1.5,))
        if typical.relative:  # the file does not state at which depth its stiffness holds
            depth = typical.like_angle(BENCH_DEPTH_rad)
            unknowns += (
                Unknown(name="reference_depth_rad", unit="rad", low=0.02 * depth, high=50 * depth,
                        scale=0.2, log=True, prior=1.0),
            )  # fmt: skip
            starts = tuple((n, depth) for (n,) in (*starts, (2.0,), (0.8,)))
        return (
            Law(law="power", unknowns=unknowns, starts=starts, richer=("hunt-crossley",), **common),
            Law(law="hunt-crossley", unknowns=(*unknowns, loss), starts=((*starts[0], 0.2),),
                **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The power."""
        power = f.figures["exponent"]
        return f"a contact whose force grows with its depth to the power {power:.3g}"
