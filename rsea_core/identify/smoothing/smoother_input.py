"""A recording as the smoother's arrays: machine, known inputs, readings, start."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.errors import InputError
from rsea_core.identify.smoothing.linear_system import (
    IN,
    PINNED,
    Machine,
    command_of,
    discretise,
    machine,
)
from rsea_core.identify.smoothing.measurement_model import Channel, channels_of
from rsea_core.identify.smoothing.separability import Separability, separability
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig

NEAR_LIMIT = 4.0  # standard deviations of the current's reading
AT_LIMIT = 0.02  # of a pinned current: what a limiter may differ and a row be cut through
UNEVEN = 1e-3  # of a row: more than rounding of a time column
UNKNOWN_ANGLE_rad = 0.3  # standard deviation of a start that is not read
SPEED_ROWS = 20  # rows over which the largest speed of a start is bounded
WIDE = 10.0  # a port's unknown start, in its own scale
SIGNALS = (
    "wheel_angle_rad",
    "wheel_velocity_rad_per_s",
    "load_angle_rad",
    "load_velocity_rad_per_s",
    "current_A",
    "spring_deflection_rad",
    "torque_Nm",
)


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What the compiled recursions take, for one recording.

    Attributes
    ----------
    latents : tuple of str
        Ports that carry an unknown torque; the last states, in this order.
    scales : mapping of str to float
        A typical size of each port's nominal counterpart.
    A : (4, d, d) array
    mode : (n,) int array
    drift, H, readings, variance, x0, P0
        As `kalman.filter_rows`; readings less what they read directly.
    outputs : (q, d) array and output_names
    offsets : (n, q) array
        What known inputs add to the outputs.
    biases : tuple of (std, drift (n, d), readings (n, p), x0 (d,))
        Constant errors that no averaging removes, each as a unit disturbance of the inputs.
    """

    row_s: float
    latents: tuple[str, ...]
    separability: Separability
    scales: Mapping[str, float]
    A: NDArray
    mode: NDArray
    drift: NDArray
    H: NDArray
    channels: tuple[str, ...]
    readings: NDArray
    variance: NDArray
    x0: NDArray
    P0: NDArray
    outputs: NDArray
    output_names: tuple[str, ...]
    offsets: NDArray
    biases: tuple[tuple[float, NDArray, NDArray, NDArray], ...]

    def noise(self, rates: Mapping[str, float]) -> NDArray:
        """(d, d): what the random walks of the ports add from row to row."""
        Q = np.zeros_like(self.P0)
        first = len(self.x0) - len(self.latents)
        for j, name in enumerate(self.latents):
            Q[first + j, first + j] = rates[name] ** 2 * self.row_s
        return Q

    def stretch(self, rows: slice) -> "Setup":
        """This recording's rows of a slice, its start unknown."""
        if rows.start in (None, 0):
            start, P0 = self.x0, self.P0
        else:
            start, P0 = self._unknown_start(rows.start)
        return replace(
            self,
            mode=self.mode[rows],
            drift=self.drift[rows],
            readings=self.readings[rows],
            variance=self.variance[rows],
            x0=start,
            P0=P0,
            offsets=self.offsets[rows],
            biases=(),
        )

    def _unknown_start(self, row: int) -> tuple[NDArray, NDArray]:
        """Least squares of the readings of one row, the rest wide open."""
        P0 = np.diag(np.maximum(np.diag(self.P0), 1e4 * np.diag(self.P0)))
        wide = np.maximum(np.diag(P0), np.square(self.x0))
        seen = np.abs(self.H).max(axis=0) > 0.0
        wide[seen] = np.maximum(wide[seen], np.ptp(self.readings, axis=0).max() ** 2)
        return np.zeros_like(self.x0), np.diag(wide)


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A recording on its way to a `Setup`; `angle` and `speed` are estimates of a first pass."""

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

    def setup(self, at_rest: bool, *, latent: bool = True) -> Setup:
        """The arrays that the smoother runs on; without `latent` ports carry no torques."""
        m, n = self.machine, self.columns["time_s"].size
        pinned, current = self._pinned()
        touching = self._touching()
        mode = np.where(pinned, PINNED, 0) + np.where(touching, IN, 0)
        split = self._separability()
        latents = split.latents if latent else ()
        T, held = discretise(m, self.row_s)
        base, d = len(m.states), len(m.states) + len(latents)
        A = np.zeros((len(T), d, d))
        A[:, :base, :base] = T
        for j, port in enumerate(latents):
            A[:, :base, base + j] = held[port]
            A[:, base + j, base + j] = 1.0
        command = np.where(pinned, current, self.commanded())
        angle = self._held_angle()
        drift = np.zeros((n, d))
        drift[:, :base] = held["command"][mode] * command[:, None]
        drift[:, :base] += held["load_torque"][mode] * _between(self._known_torque(touching))
        drift[:, :base] += held["held_angle"][mode] * _between(angle)
        if m.states[0] == "current_A":
            drift[pinned, 0] = current[pinned]
        names = tuple(self.channels)
        before = np.concatenate(([0.0], command[:-1]))
        H = np.array([self._row(name, latents) for name in names])
        readings = np.column_stack([c.value for c in self.channels.values()])
        variance = np.column_stack([c.variance for c in self.channels.values()])
        for j, name in enumerate(names):
            direct = m.direct.get(name, {})
            readings[:, j] -= direct.get("command", 0.0) * before
            readings[:, j] -= direct.get("held_angle", 0.0) * angle
            if "command" in direct and m.plant.drive != mp.CURRENT:
                variance[np.concatenate(([True], pinned[:-1])), j] = np.inf
        if "current_A" in names and pinned.any():
            near = np.convolve(pinned, np.ones(5), mode="same") > 0.5
            variance[near, names.index("current_A")] += (AT_LIMIT * np.abs(current).max()) ** 2
        scales = self._scales(command)
        x0, P0 = self._start(latents, scales, at_rest)
        outputs = [name for name in SIGNALS if name in m.rows and self._has(name)]
        rows = [self._row(name, latents) for name in outputs] + list(np.eye(d)[base:])
        offsets = np.zeros((n, len(rows)))
        for j, name in enumerate(outputs):
            direct = m.direct.get(name, {})
            offsets[:, j] += direct.get("held_angle", 0.0) * angle
            offsets[:, j] += direct.get("command", 0.0) * before
        return Setup(
            row_s=self.row_s,
            latents=latents,
            separability=split,
            scales=scales,
            A=A,
            mode=mode,
            drift=drift,
            H=H,
            channels=names,
            readings=readings,
            variance=variance,
            x0=x0,
            P0=P0,
            outputs=np.array(rows),
            output_names=(*outputs, *latents),
            offsets=offsets,
            biases=self._biases(
                held["held_angle"][mode], held["load_torque"][mode], drift.shape, H, x0
            ),
        )

    def _has(self, name: str) -> bool:
        if self.machine.plant.structure == mp.RIGID_FREE:
            return not (name.startswith("load") and self.rig.has("gear"))
        return not (self.load.is_held and name.startswith("load"))

    def _row(self, name: str, latents: tuple[str, ...]) -> NDArray:
        direct = self.machine.direct.get(name, {})
        return np.concatenate(
            (self.machine.rows[name], [direct.get(port, 0.0) for port in latents])
        )

    def _separability(self) -> Separability:
        return separability(
            parts=self.rig.parts,
            load=self.load.kind,
            command="current_command_A" if self.command == "current_A" else self.command,
            sensors=tuple(self.channels),
        )

    def commanded(self) -> NDArray:
        n = self.columns["time_s"].size
        given = np.zeros(n) if self.command is None else self.columns[self.command]
        return np.asarray(given, dtype=float)

    def _pinned(self) -> tuple[NDArray, NDArray]:
        """Rows in which the current is given, and its value there."""
        n = self.columns["time_s"].size
        pinned, current = np.zeros(n, dtype=bool), np.zeros(n)
        if "drive_enabled" in self.columns:
            pinned = np.asarray(self.columns["drive_enabled"]) < 0.5
        plant, command = self.machine.plant, self.commanded()
        if plant.drive == mp.CURRENT:
            limited = np.abs(command) > plant.current_limit
            current = np.where(limited, np.sign(command) * plant.current_limit, 0.0)
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
            return self._held_angle()
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

    def _touching(self) -> NDArray:
        return self.load_angle() > self.machine.plant.contact_angle

    def _known_torque(self, touching: NDArray) -> NDArray:
        plant = self.machine.plant
        torque = -plant.gravity * np.sin(self.load_angle() + plant.gravity_offset)
        torque = torque + plant.load_torque
        if touching.any():
            torque = torque + np.where(touching, plant.contact_stiffness * plant.contact_angle, 0.0)
        return torque

    def _held_angle(self) -> NDArray:
        n = self.columns["time_s"].size
        if not self.load.is_held or "load_angle_rad" not in self.columns:
            return np.zeros(n)
        given = np.asarray(self.columns["load_angle_rad"], dtype=float)
        return given if self.load.kind == "imposed" else np.full(n, given[0])

    def _scales(self, command: NDArray) -> dict[str, float]:
        """Typical sizes of volts (or amperes) and torques in this recording."""
        plant, rms = self.machine.plant, float(np.sqrt(np.mean(command**2)))
        volts = rms * plant.volts_per_command
        amperes = volts / plant.resistance if plant.drive in (mp.DUTY, mp.VOLTAGE) else rms
        torque = amperes * plant.torque_per_ampere
        if plant.drive == mp.MOTOR_TORQUE:
            torque = rms * plant.torque_per_motor_torque
        known = [0.1 * torque, plant.gravity, abs(plant.load_torque)]
        if "torque_Nm" in self.channels:
            known.append(float(np.std(self.channels["torque_Nm"].value)))
        scale = max(*known, 1e-9)
        drive = volts if plant.drive in (mp.DUTY, mp.VOLTAGE) else amperes
        return {"V": max(0.1 * drive, 1e-6), "G": scale, "S": scale, "L": scale}

    def _start(self, latents: tuple[str, ...], scales: Mapping[str, float], at_rest: bool):
        m, plant = self.machine, self.machine.plant
        x0, std = np.zeros(len(m.states)), np.zeros(len(m.states))
        for j, state in enumerate(m.states):
            if state == "current_A":
                volts = np.abs(self.commanded()).max() * plant.volts_per_command
                std[j] = 0.0 if at_rest else volts / plant.resistance
            elif state.endswith("angle_rad"):
                x0[j], std[j] = self._first_angle(state)
            else:
                std[j] = 0.0 if at_rest else self._fastest(state)
        wide = [WIDE * scales[port] for port in latents]
        return np.concatenate((x0, np.zeros(len(latents)))), np.diag(np.square([*std, *wide]))

    def _first_angle(self, state: str) -> tuple[float, float]:
        ratio = self.machine.plant.gear_ratio
        held = float(self._held_angle()[0])
        if state == "wheel_angle_rad" and "motor_angle_rad" in self.channels:
            motor = self.channels["motor_angle_rad"]
            return motor.value[0] / ratio, motor.floor / ratio
        rigid = self.machine.plant.structure == mp.RIGID_FREE
        if (state == "load_angle_rad" or rigid) and "load_angle_rad" in self.channels:
            load = self.channels["load_angle_rad"]
            return load.value[0], load.floor
        if state == "wheel_angle_rad" and "spring_deflection_rad" in self.channels:
            deflection = self.channels["spring_deflection_rad"]
            return deflection.value[0] + held, deflection.floor + UNKNOWN_ANGLE_rad * (
                not self.load.is_held
            )
        return float(self.load_angle()[0]), UNKNOWN_ANGLE_rad

    def _fastest(self, state: str) -> float:
        """Largest speed over a few rows of whatever reads this motion."""
        fastest = 0.0
        for name, share in (
            ("motor_angle_rad", 1.0 / self.machine.plant.gear_ratio),
            ("load_angle_rad", 1.0),
            ("spring_deflection_rad", 1.0),
        ):
            if name in self.channels:
                rows = min(SPEED_ROWS, self.channels[name].value.size - 1)
                moved = self.channels[name].value[rows:] - self.channels[name].value[:-rows]
                fastest = max(fastest, share * float(np.abs(moved).max()) / (rows * self.row_s))
        return fastest + UNKNOWN_ANGLE_rad * ("torque_Nm" in self.channels and fastest == 0.0)

    def _biases(
        self, held: NDArray, torque: NDArray, shape: tuple[int, int], H: NDArray, x0: NDArray
    ):
        """Constant errors as unit disturbances: each encoder's phase, the held load's angle."""
        found, n, base = [], shape[0], len(self.machine.states)
        for j, (name, channel) in enumerate(self.channels.items()):
            if channel.bias > 0.0:
                readings, start = np.zeros((n, len(H))), np.zeros_like(x0)
                readings[:, j] = 1.0
                seen = np.flatnonzero(np.abs(H[j]) > 0.0)
                if name != "spring_deflection_rad" and seen.size == 1:
                    start[seen[0]] = 1.0 / H[j, seen[0]]
                drift = np.zeros(shape)
                if name == "load_angle_rad":  # gravity is fed from it
                    plant, angle = self.machine.plant, self.load_angle()
                    slope = -plant.gravity * np.cos(angle + plant.gravity_offset)
                    drift[:, :base] = torque * slope[:, None]
                found.append((channel.bias, drift, readings, start))
        floor = channels_of(self.rig, self.columns).get("load_angle_rad")
        if self.load.is_held and floor is not None and floor.bias > 0.0:
            drift = np.zeros(shape)
            drift[:, :base] = held
            readings = np.zeros((n, len(H)))
            for j, name in enumerate(self.channels):
                readings[:, j] = -self.machine.direct.get(name, {}).get("held_angle", 0.0)
            found.append((floor.bias, drift, readings, np.zeros_like(x0)))
        return tuple(found)


def _between(values: NDArray) -> NDArray:
    """(n, 1): the mean of each row and the next, what acts between them."""
    return (0.5 * (values + np.append(values[1:], values[-1])))[:, None]
