"""Port torques that the recordings show and the machine with fitted constants does not have.

The usual recipe of discrepancy learning: angles smoothed and differentiated (Savitzky and Golay
1964), the equations of motion solved for what they lack.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from dftfs.proof.baselines.simulator import NAMES, UNITS, dictionary
from dftfs.proof.machine import LOAD_MODES, Machine
from dftfs.proof.scoring import read_columns

WINDOW, ORDER = 41, 3
EVERY = 10  # samples between two used ones: neighbours say the same


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """One recording of a case as a baseline reads it."""

    role: str
    load: str
    columns: dict[str, np.ndarray]

    @property
    def interval_s(self) -> float:
        return float(np.diff(self.columns["time_s"]).mean())

    @property
    def start(self) -> np.ndarray:
        c = self.columns
        link = c["load_angle_rad"][0] if "load_angle_rad" in c else 0.0
        return np.array([c["motor_angle_rad"][0], link])

    @property
    def mode(self) -> int:
        return LOAD_MODES[self.load]


@dataclass(frozen=True, kw_only=True)
class Lacking:
    """States (samples, 4) scaled, motor angle, and the lacking torque per port; NaN: unknown."""

    states: np.ndarray
    motor_angle: np.ndarray
    torques: np.ndarray

    def features(self) -> np.ndarray:
        return dictionary(self.states, self.motor_angle, len(NAMES))


def read_case(folder: Path) -> list[Recorded]:
    rig = tomllib.loads((folder / "rig.toml").read_text(encoding="utf-8"))
    return [
        Recorded(role=r["role"], load=r["load"], columns=read_columns(folder / r["file"]))
        for r in rig["recording"]
    ]


def lacking(machine: Machine, recorded: Recorded) -> Lacking:
    """What each port lacks over one recording."""
    c, dt, n = recorded.columns, recorded.interval_s, machine.gear_ratio
    motor, wm, am = (
        savgol_filter(c["motor_angle_rad"], WINDOW, ORDER, deriv=d, delta=dt) for d in range(3)
    )
    if "load_angle_rad" in c and recorded.load != "locked":
        link, wl, al = (
            savgol_filter(c["load_angle_rad"], WINDOW, ORDER, deriv=d, delta=dt) for d in range(3)
        )
    else:
        link, wl, al = np.zeros((3, motor.size))
    current = c.get("current_A")
    if current is None:  # quasi-static winding
        volts = c["duty"] * machine.supply_voltage_V - machine.back_emf_constant_Vs_per_rad * wm
        current = volts / machine.terminal_resistance_ohm
        current = np.clip(current, -machine.current_limit_A, machine.current_limit_A)
    current = savgol_filter(current, WINDOW, ORDER)
    weight = 9.80665 * machine.load_mass_kg * machine.load_distance_m
    resisting = machine.load_inertia_kgm2 * al + machine.load_viscous_Nms_per_rad * wl
    if recorded.load != "free":
        resisting = resisting + weight * np.sin(link + machine.gravity_angle_offset_rad)
    if recorded.load == "contact":
        deep = link - machine.contact_angle_rad
        spring = machine.contact_stiffness_Nm_per_rad * deep
        resisting = resisting + np.where(
            deep > 0, spring + machine.contact_damping_Nms_per_rad * wl, 0.0
        )
    deflection = motor / n - link
    ideal = machine.spring_stiffness_Nm_per_rad * deflection
    unknown = np.full(motor.size, np.nan)
    locked = recorded.load == "locked"
    if "torque_Nm" in c:
        torque = savgol_filter(c["torque_Nm"], WINDOW, ORDER)
        at_spring, at_link = torque - ideal, unknown if locked else torque - resisting
    else:
        torque = ideal if locked else resisting
        at_spring, at_link = (unknown if locked else torque - ideal), unknown
    inertia = machine.motor_inertia_kgm2 + machine.output_inertia_kgm2 / n**2
    damping = machine.motor_viscous_Nms_per_rad + machine.output_viscous_Nms_per_rad / n**2
    at_wheel = n * (machine.torque_constant_Nm_per_A * current - inertia * am - damping * wm)
    inner = slice(WINDOW, -WINDOW, EVERY)
    return Lacking(
        states=np.column_stack([deflection, wm / n, wl, link])[inner] / UNITS,
        motor_angle=motor[inner],
        torques=np.column_stack([at_wheel - torque, at_spring, at_link])[inner],
    )


def together(parts: list[Lacking]) -> Lacking:
    return Lacking(
        states=np.concatenate([p.states for p in parts]),
        motor_angle=np.concatenate([p.motor_angle for p in parts]),
        torques=np.concatenate([p.torques for p in parts]),
    )
