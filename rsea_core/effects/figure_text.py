"""Reported figures as text: values with units that somebody of the field reads at once."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

Figure = float | str

READINGS = {
    "motor_angle_rad": "motor angle",
    "load_angle_rad": "load angle",
    "motor_velocity_rad_per_s": "motor speed",
    "load_velocity_rad_per_s": "load speed",
    "spring_deflection_rad": "spring deflection",
    "current_A": "current",
    "torque_Nm": "torque",
    "temperature_C": "temperature",
    "supply_V": "supply voltage",
}
SCALED = ((1e-9, 1e-4, 1e6, "µ"), (1e-4, 0.1, 1e3, "m"))
PREFIXED = ("Nm", "rad", "N", "m", "s", "A", "J")
LINEAR = {"Nm": "N", "Nms": "Ns", "rad": "m", "kgm2": "kg", "kg m2": "kg", "kg m^2": "kg"}
_ANGULAR = re.compile(r"\b(?:Nms?|rad|kg ?m\^?2)\b")


def linear_units(text: str) -> str:
    """A text with the units of a linear machine, which is written with 1 m as 1 rad.

    >>> linear_units("torque (Nm), stiffness (Nm/rad)")
    'torque (N), stiffness (N/m)'
    """
    return _ANGULAR.sub(lambda found: LINEAR[found[0]], text)


def amount(value: float, unit: str, *, linear: bool = False) -> str:
    """A value with its unit, small ones in thousandths or millionths.

    Parameters
    ----------
    linear : bool
        Whether the machine is written with 1 m as 1 rad and 1 N as 1 Nm.
    """
    unit = linear_units(unit) if linear else unit
    if unit in PREFIXED:
        for least, below, factor, prefix in SCALED:
            if least <= abs(value) < below * (1.0 - 1e-9):
                return f"{value * factor:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"


@dataclass(frozen=True)
class FigureText:
    """Figures of an effect as text.

    Attributes
    ----------
    figures : mapping
        By name, in SI units and radians (`Term.comparable`).
    column : str
        The column of a sensor's effect, else empty.
    linear : bool
        As in `amount`.
    command_unit : str
        Of a figure that is a command; empty: it is a share of the drive's largest command.
    """

    figures: Mapping[str, Figure]
    column: str
    linear: bool
    command_unit: str = ""

    def __call__(self, name: str, unit: str) -> str:
        return self.of(self.figures[name], unit)

    def of(self, value: float, unit: str) -> str:
        """A value with its unit."""
        return amount(value, unit, linear=self.linear)

    def of_command(self, name: str) -> str:
        """A command with its unit, or as a share of the largest one."""
        return f"{self.figures[name]:.3g} {self.command_unit or 'of the largest command'}"

    def percent(self, value: float) -> str:
        """A share in percent."""
        return f"{100.0 * value:.3g} %"

    @property
    def reading(self) -> str:
        """The sensor's column in words."""
        return READINGS.get(self.column, self.column)

    @property
    def unit(self) -> str:
        """Of the reading; a difference of temperatures is one in K."""
        unit = self.column.rpartition("_")[2]
        return {"s": "rad/s", "C": "K"}.get(unit, unit)
