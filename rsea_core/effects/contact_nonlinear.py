"""An environment that is not a linear spring and damper."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds


@dataclass(frozen=True, kw_only=True)
class ContactNonlinear(Term):
    """A contact by a power law, with Hunt-Crossley damping; it replaces the load's K_e depth.

    tau = K_e d_r (d/d_r)^n (1 + lambda w_l) at depth d, never pulling; the load's own contact
    damping is added as it is. The default step is made for depths up to 0.3 rad.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Hunt & Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl.
    Mech. 42 (1975) 440; Hertz: n = 1.5.
    """

    effect: ClassVar[str] = "contact-nonlinear"
    law: ClassVar[str] = "power-law"
    port: ClassVar[Port] = Port.ENVIRONMENT

    exponent: float = parameter(
        unit="-",
        bounds=(1.0, 3.0),
        source="1 linear, 1.5 Hertz",
        meaning="Power of the depth with which the contact torque grows.",
    )
    reference_depth_rad: float = parameter(
        0.05,
        unit="rad",
        bounds=(0.01, 1.0),
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

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The power."""
        return {"exponent": self.exponent}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        return {
            "contact_exponent": self.exponent,
            "contact_reference_depth": self.reference_depth_rad,
            "contact_loss_factor": self.loss_factor_s_per_rad,
        }

    def equation(self) -> str:
        """The law in one line."""
        d_r = self.reference_depth_rad
        return (
            f"tau_contact = K_e {d_r:g} (d/{d_r:g})^{self.exponent:g}"
            f" (1 + {self.loss_factor_s_per_rad:g} w_l), d = theta_l - theta_e > 0, not below 0"
        )
