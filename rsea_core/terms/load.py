"""What acts on the load's joint and link beyond the nominal viscous friction and gravity."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import Gear, Port, Term, parameter, require_bounds

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Term):
    """Coulomb and Stribeck friction of the load's joint.

    F = coulomb (1 + rise exp(-(w_l/w_s)^2)) against the motion; at rest it holds, exactly, up to
    coulomb (1 + rise).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-friction"
    port: ClassVar[Port] = Port.LOAD

    coulomb_Nm: float = parameter(unit="Nm", bounds=(0.0, 50.0), source="a fit")
    stribeck_rise: float = parameter(
        0.0, unit="-", bounds=(0.0, 3.0), source=f"0: no Stribeck peak; {ARMSTRONG}"
    )
    stribeck_velocity_rad_per_s: float = parameter(
        0.1, unit="rad/s", bounds=(5e-3, 10.0), source=ARMSTRONG
    )

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        if self.coulomb_Nm == 0.0:
            return {}
        return {
            "load_dry": 1.0,
            "load_coulomb": self.coulomb_Nm,
            "load_stribeck_rise": self.stribeck_rise,
            "load_stribeck_velocity": self.stribeck_velocity_rad_per_s,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the gear is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"{self.coulomb_Nm:g} (1 + {self.stribeck_rise:g}"
            f" exp(-(w_l/{self.stribeck_velocity_rad_per_s:g})^2)) against w_l; holds exactly at"
            " rest"
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
    port: ClassVar[Port] = Port.LOAD

    torque_at_5_rad_per_s_Nm: float = parameter(
        unit="Nm", bounds=(0.0, 50.0), source="quadratic drag of a bluff body; a fit"
    )

    def __post_init__(self):
        require_bounds(self)

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
    port: ClassVar[Port] = Port.LOAD

    torque_amplitude_Nm: float = parameter(
        unit="Nm", bounds=(0.0, 50.0), source="m g d of the eccentric mass; a fit"
    )
    angle_rad: float = parameter(
        0.0, unit="rad", bounds=(-7.0, 7.0), source="0: it hangs where the link hangs"
    )

    def __post_init__(self):
        require_bounds(self)

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
    port: ClassVar[Port] = Port.LOAD

    start_s: float = parameter(unit="s", bounds=(-1e6, 1e6), source="a fit")
    end_s: float = parameter(unit="s", bounds=(-1e6, 1e6), source="a fit")
    peak_Nm: float = parameter(unit="Nm", bounds=(-100.0, 100.0), source="a fit")

    def __post_init__(self):
        require_bounds(self)
        if not self.end_s > self.start_s:
            raise TermError(
                f"{self.effect}: end_s = {self.end_s} must come after start_s = {self.start_s}"
            )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque and times."""
        return {
            "pulse_torque": self.peak_Nm,
            "pulse_start": self.start_s,
            "pulse_end": self.end_s,
        }

    def equation(self) -> str:
        """The law in one line."""
        return f"{self.peak_Nm:g} Nm on the load where {self.start_s:g} s <= t < {self.end_s:g} s"


@dataclass(frozen=True, kw_only=True)
class SpringParallel(Term):
    """A second spring between the load and the ground.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "spring-parallel"
    port: ClassVar[Port] = Port.LOAD

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad", bounds=(0.0, 1000.0), source="cables, a balancing spring; a fit"
    )
    rest_angle_rad: float = parameter(
        0.0, unit="rad", bounds=(-7.0, 7.0), source="0: it rests where the load does"
    )

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and rest angle."""
        return {
            "parallel_stiffness": self.stiffness_Nm_per_rad,
            "parallel_rest_angle": self.rest_angle_rad,
        }

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.stiffness_Nm_per_rad:g} (theta_l - {self.rest_angle_rad:g}) on the load"
