"""The motor that warms up: winding and case, acting on resistance and torque constant."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds

COPPER_per_K = 3.93e-3  # IEC 60028, of the resistance at 20 C


@dataclass(frozen=True, kw_only=True)
class DriveThermal(Term):
    """Two heat capacities warmed by R i^2: the winding, and the case with the magnets.

    C_w h_w' = R i^2 - G_wc (h_w - h_c),  C_c h_c' = G_wc (h_w - h_c) - G_ca h_c, rises h over the
    ambient; R = R_0 (1 + alpha h_w), and k_t and k_e fall by beta_c h_c + beta_w h_w alike: magnets
    at the case, or on a rotor that the winding warms. The rig's values are those at ambient
    temperature.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Two-body model of motor data sheets: Maxon, Key information on DC motors; copper: IEC 60028.
    """

    effect: ClassVar[str] = "drive-thermal"
    law: ClassVar[str] = "winding-and-case"
    port: ClassVar[Port] = Port.DRIVE

    winding_heat_capacity_J_per_K: float = parameter(
        unit="J/K",
        bounds=(0.1, 1e4),
        source="385 J/(kg K) times the copper's mass; a fit",
        meaning="Heat that warms the winding by 1 K.",
    )
    winding_to_case_W_per_K: float = parameter(
        unit="W/K",
        bounds=(1e-3, 100.0),
        source="inverse of the thermal resistance in the data sheet; a fit",
        meaning="Heat flow from winding to case per difference of temperature.",
    )
    case_heat_capacity_J_per_K: float = parameter(
        500.0,
        unit="J/K",
        bounds=(1.0, 1e5),
        source="460-900 J/(kg K) times the motor's mass",
        meaning="Heat that warms the case by 1 K.",
    )
    case_to_ambient_W_per_K: float = parameter(
        0.5,
        unit="W/K",
        bounds=(1e-3, 100.0),
        source="inverse of the thermal resistance in the data sheet",
        meaning="Heat flow from the case to the air per difference of temperature.",
    )
    resistance_rise_per_K: float = parameter(
        COPPER_per_K,
        unit="1/K",
        bounds=(0.0, 0.01),
        source="copper, IEC 60028",
        meaning="Relative growth of the winding's resistance per kelvin.",
        free=False,
    )
    torque_constant_fall_per_K: float = parameter(
        0.0,
        unit="1/K",
        bounds=(0.0, 0.003),
        source="0: none; 0.0011 NdFeB, 0.002 ferrite",
        meaning="Relative fall of k_t and k_e per kelvin of the case, where the magnets are.",
    )
    torque_constant_fall_per_winding_K: float = parameter(
        0.0,
        unit="1/K",
        bounds=(0.0, 0.005),
        source="0: none; up to 0.0011 NdFeB, 0.002 ferrite where the magnets are as warm",
        meaning="The same per kelvin of the winding, for magnets that it warms.",
    )
    start_winding_rise_K: float = parameter(
        0.0,
        unit="K",
        bounds=(-60.0, 200.0),
        source="0: cold; an earlier recording warms it",
        meaning="Winding over ambient temperature at the start.",
    )
    start_case_rise_K: float = parameter(
        0.0,
        unit="K",
        bounds=(-60.0, 150.0),
        source="0: cold; measured at the case",
        meaning="Case over ambient temperature at the start.",
    )
    ambient_C: float = parameter(
        25.0,
        unit="C",
        bounds=(-40.0, 80.0),
        source="room",
        meaning="Air temperature, at which the rig's values hold.",
        free=False,
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Largest growth of the resistance, by the hottest winding that the context names."""
        peak = context.need(self.effect, "peak_winding_C")
        rise = self.resistance_rise_per_K * (peak - self.ambient_C)
        return {"resistance_rise_fraction": rise, "peak_winding_C": peak}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The network, and what it acts on."""
        return {
            "winding_heat_capacity": self.winding_heat_capacity_J_per_K,
            "winding_to_case": self.winding_to_case_W_per_K,
            "case_heat_capacity": self.case_heat_capacity_J_per_K,
            "case_to_ambient": self.case_to_ambient_W_per_K,
            "resistance_rise": self.resistance_rise_per_K,
            "torque_constant_fall": self.torque_constant_fall_per_K,
            "torque_constant_fall_by_winding": self.torque_constant_fall_per_winding_K,
            "start_winding_rise": self.start_winding_rise_K,
            "start_case_rise": self.start_case_rise_K,
            "memory": 1.0,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """A current warms it."""
        electric = command_name in ("duty", "voltage_V", "current_command_A")
        return None if electric else "needs a drive by duty, voltage or current"

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """The resistance that warms it."""
        rig.need("heat in the winding", "terminal_resistance_ohm")
        return {}

    def equation(self) -> str:
        """The law in one line."""
        G_wc = f"{self.winding_to_case_W_per_K:g} (h_w - h_c)"
        return (
            f"{self.winding_heat_capacity_J_per_K:g} h_w' = R i^2 - {G_wc},"
            f"  {self.case_heat_capacity_J_per_K:g} h_c' = {G_wc}"
            f" - {self.case_to_ambient_W_per_K:g} h_c,"
            f"  R = R_0 (1 + {self.resistance_rise_per_K:g} h_w),"
            f"  k_t, k_e (1 - {self.torque_constant_fall_per_K:g} h_c"
            f" - {self.torque_constant_fall_per_winding_K:g} h_w)"
        )
