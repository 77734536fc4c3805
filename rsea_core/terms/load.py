"""What acts on the load's joint and link beyond the nominal viscous friction and gravity."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import (
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    SHORTEST_PRESLIDING_rad,
    Term,
    parameter,
    require_bounds,
)

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Term):
    """Coulomb and Stribeck friction of the load's joint.

    F = coulomb (1 + rise exp(-(w_l/w_s)^2)) against the motion; at rest it holds, exactly, up to
    coulomb (1 + rise), or, with a presliding stretch, is elastic until it slides. Bearing load
    adds lever |N|, N = hypot(m d w^2 + m g cos, m g sin), without elasticity.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-friction"
    law: ClassVar[str] = "coulomb-stribeck"
    port: ClassVar[Port] = Port.LOAD

    coulomb_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="a fit",
        meaning="Friction torque of the load joint at speed.",
    )
    stribeck_rise: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 3.0),
        source=f"0: no Stribeck peak; {ARMSTRONG}",
        meaning="Share by which friction at rest exceeds that at speed.",
    )
    stribeck_velocity_rad_per_s: float = parameter(
        0.1,
        unit="rad/s",
        bounds=(5e-3, 10.0),
        source=ARMSTRONG,
        meaning="Speed at which the rise has fallen to 1/e.",
    )
    presliding_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, 0.05),
        source="0: rigid until it slides; Dahl 1968, Jenkins element; a fit",
        meaning="Elastic turn of the joint over which friction builds up after a reversal; rigid"
        " where it is below 1e-6 rad.",
    )
    normal_lever_m: float = parameter(
        0.0,
        unit="m",
        bounds=(0.0, 0.1),
        source="friction coefficient times bearing radius; thesis eq. 3.6, corrected",
        meaning="Friction torque per bearing load of weight and centrifugal force.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Coulomb friction."""
        return {"coulomb_Nm": self.coulomb_Nm}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        found = {}
        if self.coulomb_Nm > 0.0:
            found = {
                "load_coulomb": self.coulomb_Nm,
                "load_stribeck_rise": self.stribeck_rise,
                "load_stribeck_velocity": self.stribeck_velocity_rad_per_s,
            }
            if self.presliding_rad >= SHORTEST_PRESLIDING_rad:
                found |= {"load_presliding": self.presliding_rad, "memory": 1.0}
            else:
                found["load_dry"] = 1.0
        if self.normal_lever_m > 0.0:
            found |= {"load_normal_friction": self.normal_lever_m, "load_dry": 1.0}
        return found

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """Weight and mass moment of the link that the bearing carries."""
        if self.normal_lever_m == 0.0:
            return {}
        rig.need("the bearing's load", "load_mass_kg", "load_distance_m")
        return {
            "load_weight": rig.load_mass_kg * gravity,
            "load_mass_lever": rig.load_mass_kg * rig.load_distance_m,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the gear is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        rest = "; holds exactly at rest"
        if self.presliding_rad > 0.0:
            rest = f", reached after {self.presliding_rad:g} rad of elastic presliding"
        normal = ""
        if self.normal_lever_m > 0.0:
            normal = f"; {self.normal_lever_m:g} |N| more, N = bearing load, holds exactly"
        return (
            f"{self.coulomb_Nm:g} (1 + {self.stribeck_rise:g}"
            f" exp(-(w_l/{self.stribeck_velocity_rad_per_s:g})^2)) against w_l{rest}{normal}"
        )


@dataclass(frozen=True, kw_only=True)
class LoadDrag(Term):
    """Drag of the link that grows with the square of its speed (air, a paddle).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-drag"
    law: ClassVar[str] = "quadratic"
    port: ClassVar[Port] = Port.LOAD

    torque_at_5_rad_per_s_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="quadratic drag of a bluff body; a fit",
        meaning="Drag torque of the link at 5 rad/s.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Drag at 5 rad/s."""
        return {"torque_at_5_rad_per_s_Nm": self.torque_at_5_rad_per_s_Nm}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque over speed squared."""
        return {"load_drag": self.torque_at_5_rad_per_s_Nm / 25.0}

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.torque_at_5_rad_per_s_Nm / 25.0:.5g} w_l |w_l| on the load"


@dataclass(frozen=True, kw_only=True)
class LoadUnbalance(Term):
    """Gravity on an eccentric mass that the rig does not name; acts on every moving load.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-unbalance"
    law: ClassVar[str] = "eccentric-mass"
    port: ClassVar[Port] = Port.LOAD

    torque_amplitude_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="m g d of the eccentric mass; a fit",
        meaning="Largest gravity torque of the mass that the rig does not name.",
    )
    angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it hangs where the link hangs",
        meaning="Load angle, negative, at which that mass hangs.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Amplitude and angle."""
        return {"torque_amplitude_Nm": self.torque_amplitude_Nm, "angle_rad": self.angle_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitude and angle."""
        return {"unbalance_torque": self.torque_amplitude_Nm, "unbalance_angle": self.angle_rad}

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.torque_amplitude_Nm:g} sin(theta_l + {self.angle_rad:g}) on the load"


@dataclass(frozen=True, kw_only=True)
class LoadDisturbance(Term):
    """An outside torque on the load between two times of the recording.

    Raises
    ------
    TermError
        If a parameter is outside its bounds or the end is not after the start.
    """

    effect: ClassVar[str] = "load-disturbance"
    law: ClassVar[str] = "pulse"
    port: ClassVar[Port] = Port.LOAD

    start_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the outside torque begins.",
    )
    end_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the outside torque ends.",
    )
    peak_Nm: float = parameter(
        unit="Nm",
        bounds=(-100.0, 100.0),
        source="a fit",
        meaning="The outside torque, positive where it helps positive motion.",
    )
    rise_s: float = parameter(
        0.0,
        unit="s",
        bounds=(0.0, 1e6),
        source="0: a pulse",
        free=False,
        meaning="Time within which it rises in proportion to time.",
    )

    def __post_init__(self):
        require_bounds(self)
        if not self.end_s > self.start_s:
            raise TermError(
                f"{self.effect}: end_s = {self.end_s} must come after start_s = {self.start_s}"
            )
        if self.rise_s > self.end_s - self.start_s:
            raise TermError(
                f"{self.effect}: rise_s = {self.rise_s} is longer than it lasts,"
                f" {self.end_s - self.start_s:g} s"
            )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Where in which recording, and how much."""
        return {
            "recording": context.need(self.effect, "recording"),
            "start_s": self.start_s,
            "end_s": self.end_s,
            "peak_Nm": self.peak_Nm,
        }

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque and times."""
        found = {
            "pulse_torque": self.peak_Nm,
            "pulse_start": self.start_s,
            "pulse_end": self.end_s,
        }
        if self.rise_s > 0.0:
            found |= {"pulse_rise": self.rise_s, "memory": 1.0}
        return found

    def equation(self) -> str:
        """The law in one line."""
        text = f"{self.peak_Nm:g} Nm on the load where {self.start_s:g} s <= t < {self.end_s:g} s"
        return text + (f", rising for {self.rise_s:g} s" if self.rise_s > 0.0 else "")


@dataclass(frozen=True, kw_only=True)
class SpringParallel(Term):
    """A second spring between the load and the ground.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "spring-parallel"
    law: ClassVar[str] = "linear"
    port: ClassVar[Port] = Port.LOAD

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(0.0, 1000.0),
        source="cables, a balancing spring; a fit",
        meaning="Stiffness of the second spring between load and ground.",
    )
    rest_angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it rests where the load does",
        meaning="Load angle at which the second spring is unloaded.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Its stiffness."""
        return {"stiffness_Nm_per_rad": self.stiffness_Nm_per_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and rest angle."""
        return {
            "parallel_stiffness": self.stiffness_Nm_per_rad,
            "parallel_rest_angle": self.rest_angle_rad,
        }

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.stiffness_Nm_per_rad:g} (theta_l - {self.rest_angle_rad:g}) on the load"


@dataclass(frozen=True, kw_only=True)
class LoadFlexibility(Term):
    """A flexible link: part of the load's inertia sits behind a spring and a damper.

    The joint side keeps the rest of the inertia, friction, contact and the whole gravity
    torque: the encoder and the weight belong to the joint's angle. What the outer part adds is
    its inertia alone.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-flexibility"
    law: ClassVar[str] = "one-mode"
    port: ClassVar[Port] = Port.LOAD

    link_stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(1.0, 1e5),
        source="a beam's 3 E I / l; a fit",
        meaning="Stiffness between the joint side and the outer part of the link.",
    )
    outer_fraction: float = parameter(
        unit="-",
        bounds=(0.01, 0.99),
        source="from the mass's place along the link; a fit",
        meaning="Share of the load's inertia that sits beyond the flexibility.",
    )
    link_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 100.0),
        source="0: none; a fit",
        meaning="Damping between the joint side and the outer part of the link.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Frequency of both parts against each other, joint free."""
        inertia = context.need(self.effect, "load_inertia_kgm2")
        reduced = inertia * self.outer_fraction * (1.0 - self.outer_fraction)
        frequency = math.sqrt(self.link_stiffness_Nm_per_rad / reduced) / (2.0 * math.pi)
        return {"free_link_frequency_Hz": frequency}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness, outer inertia, damping."""
        return {
            "link_stiffness": self.link_stiffness_Nm_per_rad,
            "link_damping": self.link_damping_Nms_per_rad,
            "memory": 1.0,
        }

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """Inertia of the outer part."""
        rig.need("a flexible link", "load_inertia_kgm2")
        return {"link_inertia": self.outer_fraction * rig.load_inertia_kgm2}

    def on_plant(self, plant):
        """The machine with the joint side's inertia."""
        return plant._replace(load_inertia=(1.0 - self.outer_fraction) * plant.load_inertia)

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"tau_link = {self.link_stiffness_Nm_per_rad:g} (theta_l - theta_o)"
            f" + {self.link_damping_Nms_per_rad:g} (w_l - w_o),"
            f"  {self.outer_fraction:g} J_l w_o' = tau_link,"
            f"  {1.0 - self.outer_fraction:g} J_l w_l' = ... - tau_link"
        )
