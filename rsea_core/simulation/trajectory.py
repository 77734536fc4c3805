"""The result of a simulation: signals by row, energies, and where limits were met."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.sensor_reading import readings
from rsea_core.engines.event_driven.energy_ledger import EnergyLedger
from rsea_core.files.column_views import ColumnViews, library
from rsea_core.files.csv_columns import write_columns
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.brief_repr import BriefRepr

PIECEWISE_LINEAR, EVENT_DRIVEN, FIXED_STEP = "piecewise-linear", "event-driven", "fixed-step"
"""Exact exponentials between located events; order 8 with located events; fixed steps."""

OF_TERMS = (
    "link_angle_rad",
    "link_velocity_rad_per_s",
    "winding_temperature_C",
    "case_temperature_C",
)


COUNTED = {"motor_angle_rad", "load_angle_rad"}  # whose readings are columns of their own


@dataclass(frozen=True, kw_only=True, repr=False)
class Trajectory(ColumnViews, BriefRepr):
    """What a simulated machine does, row by row; arrays are (n,) and read-only.

    Names are those of a recording's columns, and the values are the machine's own: exact
    angles, no sensor noise. What the encoders show is beside them.

    Attributes
    ----------
    model : ActuatorModel
    load : Load
    command_name : str or None
        The column that drove the machine; `command` holds what acted from each row on.
    unsaturated_command : array
        What the controller asked for before it was limited.
    torque_Nm : array
        tau_s, what a sensor between spring and load reads.
    encoder_motor_angle_rad, encoder_load_angle_rad : array
        Readings in whole encoder counts, sensor terms included; `sensing.readings` has all.
    reference : array or None
        What a controller was to follow; `reference_name` is its column, with the unit.
    current_limited_s, contact_s : array
        Time spent so far at the current limit and in contact; switches are located, so these
        are not multiples of the row.
    wheel_stuck_s, load_stuck_s : array
        Time so far in which dry friction held the wheel or the load; zero without a dry joint.
    wheel_angle_rad, wheel_velocity_rad_per_s : array
        The gear's slow shaft, behind its play where it has some.
    link_angle_rad, link_velocity_rad_per_s : array or None
        The outer part of a flexible link.
    winding_temperature_C, case_temperature_C : array or None
        Where the model has a `DriveThermal`.
    engine : str
        What solved the equations: PIECEWISE_LINEAR, EVENT_DRIVEN or FIXED_STEP.
    engine_reason : str or None
        Why it was not the piecewise linear one, None where it was.
    ledger : EnergyLedger, function that makes it, or None
        See `energy`.
    """

    model: ActuatorModel
    load: Load
    command_name: str | None
    time_s: NDArray
    command: NDArray
    unsaturated_command: NDArray
    motor_angle_rad: NDArray
    motor_velocity_rad_per_s: NDArray
    load_angle_rad: NDArray
    load_velocity_rad_per_s: NDArray
    current_A: NDArray
    torque_Nm: NDArray
    encoder_motor_angle_rad: NDArray
    encoder_load_angle_rad: NDArray
    reference: NDArray | None
    reference_name: str | None
    current_limited_s: NDArray
    contact_s: NDArray
    wheel_stuck_s: NDArray
    load_stuck_s: NDArray
    engine: str
    engine_reason: str | None
    ledger: EnergyLedger | Callable[[], EnergyLedger] | None
    wheel_angle_rad: NDArray
    wheel_velocity_rad_per_s: NDArray
    spring_valid_range_rad: tuple[float, float]
    link_angle_rad: NDArray | None = None
    link_velocity_rad_per_s: NDArray | None = None
    winding_temperature_C: NDArray | None = None
    case_temperature_C: NDArray | None = None

    @cached_property
    def energy(self) -> EnergyLedger | None:
        """Where the energy went, by row.

        The piecewise linear engine does not add powers up: the event-driven one then makes the
        account when it is first asked for, with the commands of this trajectory from the same
        start. None from the fixed-step engine, which keeps none and counts times by rows.
        """
        return self.ledger() if callable(self.ledger) else self.ledger

    @property
    def spring_deflection_rad(self) -> NDArray:
        """Wheel angle less load angle."""
        return self.wheel_angle_rad - self.load_angle_rad

    @property
    def command_limited(self) -> NDArray:
        """(n,) bool: the command acting from this row on is less than was asked for."""
        return self.unsaturated_command != self.command

    @property
    def outside_valid_range(self) -> NDArray:
        """(n,) bool: the spring is deflected further than its curve is known to hold."""
        low, high = self.spring_valid_range_rad
        return (self.spring_deflection_rad < low) | (self.spring_deflection_rad > high)

    @property
    def left_valid_range_s(self) -> float | None:
        """Time of the first row outside the spring's valid range, None if there is none."""
        outside = self.outside_valid_range
        return float(self.time_s[np.argmax(outside)]) if outside.any() else None

    @property
    def share_outside_valid_range(self) -> float:
        """Share of the rows outside the spring's valid range."""
        return float(self.outside_valid_range.mean())

    def columns(self) -> Mapping[str, NDArray]:
        """Every column by name: those of a recording, then what only a simulation knows."""
        found = {"time_s": self.time_s}
        if self.command_name is not None:
            found[self.command_name] = self.command
        if self.reference is not None:
            found[self.reference_name] = self.reference
        for name in ("motor_angle_rad", "motor_velocity_rad_per_s", "load_angle_rad"):
            found[name] = getattr(self, name)
        found["load_velocity_rad_per_s"] = self.load_velocity_rad_per_s
        found["spring_deflection_rad"] = self.spring_deflection_rad
        found["current_A"] = self.current_A
        found["torque_Nm"] = self.torque_Nm
        found["encoder_motor_angle_rad"] = self.encoder_motor_angle_rad
        found["encoder_load_angle_rad"] = self.encoder_load_angle_rad
        found["command_limited"] = self.command_limited.astype(int)
        found["outside_valid_range"] = self.outside_valid_range.astype(int)
        found["current_limited_s"] = self.current_limited_s
        found["contact_s"] = self.contact_s
        for name in OF_TERMS:
            if getattr(self, name) is not None:
                found[name] = getattr(self, name)
        found |= self._misread()
        found["wheel_stuck_s"] = self.wheel_stuck_s
        found["load_stuck_s"] = self.load_stuck_s
        if self.energy is None:
            return found
        return found | {f.name: getattr(self.energy, f.name) for f in fields(self.energy)}

    def _misread(self) -> Mapping[str, NDArray]:
        """`read_...`: what sensors show of all that no encoder counts, where a term says how."""
        columns = {getattr(term, "column", None) for term in self.model.terms} - COUNTED
        if columns <= {None}:
            return {}
        return {f"read_{name}": read for name, read in readings(self).items() if name in columns}

    def to_csv(self, path: str | Path) -> Path:
        """Write all columns; the file appears whole or not at all."""
        return write_columns(path, self.columns())

    def named_columns(self) -> Mapping[str, NDArray]:
        """`columns`, for tables and data sets."""
        return self.columns()

    def plot(self):
        """Torque, load angle, command and current against time: a matplotlib figure.

        Raises
        ------
        InputError
            If matplotlib is not installed.
        """
        figure, axes = library("matplotlib.pyplot").subplots(
            4, 1, sharex=True, figsize=(8, 8), layout="constrained"
        )
        drawn = ("torque_Nm", "load_angle_rad", "command", "current_A")
        for own, name in zip(axes, drawn, strict=True):
            if self.reference_name == f"reference_{name.removeprefix('load_')}":
                own.plot(self.time_s, self.reference, lw=2.5, alpha=0.5, label="reference")
            own.plot(self.time_s, getattr(self, name), lw=1.0, label=name)
            own.set_ylabel(self.command_name if name == "command" else name)
            own.legend(loc="upper right")
        axes[-1].set_xlabel("time_s")
        return figure
