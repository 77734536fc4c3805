"""A recording for the smoother: its machine, known inputs and readings (`smoother_setup`)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.errors import InputError
from rsea_core.identify.smoothing.linear_system import (
    Machine,
    command_of,
    machine,
)
from rsea_core.identify.smoothing.measurement_model import Channel, channels_of
from rsea_core.identify.smoothing.separability import Separability
from rsea_core.identify.smoothing.separability import separability as find_separability
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig

NEAR_LIMIT = 4.0  # standard deviations of the current's reading
UNEVEN = 1e-3  # of a row: more than rounding of a time column


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A recording to be smoothed; `angle` and `speed` are estimates of a first pass."""

    rig: Rig
    load: Load
    columns: Mapping[str, NDArray]
    channels: Mapping[str, Channel]
    command: str | None
    machine: Machine
    row_s: float
    angle: NDArray | None = None
    speed: NDArray | None = None

    @classmethod
    def of(
        cls, rig: Rig, load: Load, columns: Mapping[str, NDArray], ignore: tuple[str, ...]
    ) -> "Recorded":
        """Check the rows and find machine, command and readings.

        Raises
        ------
        InputError
            If rows are not even, or there is nothing to read.
        """
        time = np.asarray(columns["time_s"], dtype=float)
        if time.size < 8:
            raise InputError(f"{time.size} rows are too few to smooth")
        row_s = float(time[-1] - time[0]) / (time.size - 1)
        if not row_s > 0.0 or np.abs(np.diff(time) - row_s).max() > UNEVEN * row_s + 1e-9:
            raise InputError("rows must be evenly sampled to be smoothed: resample first")
        command = command_of(columns, rig)
        found = machine(rig, load, command)
        channels = {
            name: channel
            for name, channel in channels_of(rig, columns, ignore).items()
            if name in found.rows
            and name != command
            and not (load.is_held and name == "load_angle_rad")
        }
        if not channels:
            raise InputError("nothing is read: a response of the machine is needed")
        return cls(
            rig=rig, load=load, columns=columns, channels=channels, command=command,
            machine=found, row_s=row_s,
        )  # fmt: skip

    def needs_second_pass(self) -> bool:
        """Whether the first pass had to guess the load angle or the current limit."""
        limited = self._may_be_limited() and "current_A" not in self.channels
        return self._guesses_gravity() or limited

    def refined(self, angle: NDArray | None, speed: NDArray | None) -> "Recorded":
        """This recording with a first pass' load angle and wheel speed."""
        return replace(self, angle=angle, speed=speed)

    def has_signal(self, name: str) -> bool:
        if self.machine.plant.structure == mp.RIGID_FREE:
            return not (name.startswith("load") and self.rig.has("gear"))
        return not (self.load.is_held and name.startswith("load"))

    def separability(self) -> Separability:
        return find_separability(
            parts=self.rig.parts,
            load=self.load.kind,
            command="current_command_A" if self.command == "current_A" else self.command,
            sensors=tuple(self.channels),
        )

    def commanded(self) -> NDArray:
        n = self.columns["time_s"].size
        given = np.zeros(n) if self.command is None else self.columns[self.command]
        return np.asarray(given, dtype=float)

    def pinned_rows(self) -> tuple[NDArray, NDArray]:
        """Rows in which the current is given, and its value there."""
        n = self.columns["time_s"].size
        pinned, current = np.zeros(n, dtype=bool), np.zeros(n)
        if "drive_enabled" in self.columns:
            pinned = np.asarray(self.columns["drive_enabled"]) < 0.5
        plant, command = self.machine.plant, self.commanded()
        if plant.drive == mp.CURRENT:
            limited = np.abs(command) > plant.current_limit
            current = np.where(limited, np.copysign(plant.current_limit, command), 0.0)
            return pinned | limited, np.where(pinned, 0.0, current)
        if not self._may_be_limited():
            return pinned, current
        if "current_A" in self.channels:
            read = self.channels["current_A"]
            edge = plant.current_limit - NEAR_LIMIT * read.floor
            limited = (np.abs(read.value) > edge) & (command * read.value > 0.0) & ~pinned
            return pinned | limited, limited * np.sign(command) * plant.current_limit
        if self.speed is None:
            return pinned, current
        volts = command * plant.volts_per_command - plant.volts_per_speed * self.speed
        decay = np.exp(-self.row_s * plant.resistance / plant.inductance) if plant.inductance else 0
        flowing = 0.0
        for row in range(n):
            flowing = decay * flowing + (1.0 - decay) * volts[row] / plant.resistance
            if pinned[row]:
                flowing = 0.0
            elif abs(flowing) > plant.current_limit:
                flowing = np.copysign(plant.current_limit, flowing)
                pinned[row], current[row] = True, flowing
        return pinned, current

    def _may_be_limited(self) -> bool:
        plant = self.machine.plant
        if plant.drive not in (mp.DUTY, mp.VOLTAGE) or not np.isfinite(plant.current_limit):
            return False
        most = np.abs(self.commanded()).max() * plant.volts_per_command
        return bool(most > 0.5 * plant.current_limit * plant.resistance)

    def load_angle(self) -> NDArray:
        """The load's angle as read, estimated before, or the wheel's."""
        if self.load.is_held:
            return self.held_angle()
        if "load_angle_rad" in self.channels:
            return self.channels["load_angle_rad"].value
        if self.angle is not None:
            return self.angle
        if "motor_angle_rad" in self.channels:
            return self.channels["motor_angle_rad"].value / self.machine.plant.gear_ratio
        return np.zeros(self.columns["time_s"].size)

    def _guesses_gravity(self) -> bool:
        acts = self.machine.plant.gravity > 0.0 or self.load.kind == "contact"
        read = "load_angle_rad" in self.channels
        rigid = self.machine.plant.structure == mp.RIGID_FREE and "motor_angle_rad" in self.channels
        return acts and not (read or rigid)

    def touching(self) -> NDArray:
        return self.load_angle() > self.machine.plant.contact_angle

    def known_torque(self, touching: NDArray) -> NDArray:
        plant = self.machine.plant
        torque = -plant.gravity * np.sin(self.load_angle() + plant.gravity_offset)
        torque = torque + plant.load_torque
        if touching.any():
            torque = torque + np.where(touching, plant.contact_stiffness * plant.contact_angle, 0.0)
        return torque

    def held_angle(self) -> NDArray:
        n = self.columns["time_s"].size
        if not self.load.is_held or "load_angle_rad" not in self.columns:
            return np.zeros(n)
        given = np.asarray(self.columns["load_angle_rad"], dtype=float)
        return given if self.load.kind == "imposed" else np.full(n, given[0])
