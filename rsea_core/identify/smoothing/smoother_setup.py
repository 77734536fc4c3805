"""The arrays of a smoother for one recording: dynamics, readings, start, errors that stay."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.identify.smoothing.linear_system import (
    IN,
    PINNED,
    discretise,
)
from rsea_core.identify.smoothing.measurement_model import channels_of
from rsea_core.identify.smoothing.separability import Separability
from rsea_core.identify.smoothing.smoother_input import Recorded

AT_LIMIT = 0.02  # of a pinned current: what a limiter may differ and a row be cut through
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
    magnitudes : mapping of str to float
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
    magnitudes: Mapping[str, float]
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

    def block(self, rows: slice) -> "Setup":
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


def setup_of(recorded: Recorded, at_rest: bool, *, latent: bool = True) -> Setup:
    """The arrays that the smoother runs on; without `latent` ports carry no torques."""
    m, n = recorded.machine, recorded.columns["time_s"].size
    pinned, current = recorded.pinned_rows()
    touching = recorded.touching()
    mode = np.where(pinned, PINNED, 0) + np.where(touching, IN, 0)
    split = recorded.separability()
    latents = split.latents if latent else ()
    T, held = discretise(m, recorded.row_s)
    base, d = len(m.states), len(m.states) + len(latents)
    A = np.zeros((len(T), d, d))
    A[:, :base, :base] = T
    for j, port in enumerate(latents):
        A[:, :base, base + j] = held[port]
        A[:, base + j, base + j] = 1.0
    command = np.where(pinned, current, recorded.commanded())
    angle = recorded.held_angle()
    drift = np.zeros((n, d))
    drift[:, :base] = held["command"][mode] * command[:, None]
    drift[:, :base] += held["load_torque"][mode] * _between(recorded.known_torque(touching))
    drift[:, :base] += held["held_angle"][mode] * _between(angle)
    if m.states[0] == "current_A":
        drift[pinned, 0] = current[pinned]
    names = tuple(recorded.channels)
    before = np.concatenate(([0.0], command[:-1]))
    H = np.array([_row(recorded, name, latents) for name in names])
    readings, variance = _readings(recorded, before, angle, pinned, current)
    magnitudes = _magnitudes(recorded, command)
    x0, P0 = _start(recorded, latents, magnitudes, at_rest)
    outputs = [name for name in SIGNALS if name in m.rows and recorded.has_signal(name)]
    rows = [_row(recorded, name, latents) for name in outputs] + list(np.eye(d)[base:])
    return Setup(
        row_s=recorded.row_s,
        latents=latents,
        separability=split,
        magnitudes=magnitudes,
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
        offsets=_offsets(recorded, outputs, before, angle, len(rows)),
        biases=_biases(
            recorded, held["held_angle"][mode], held["load_torque"][mode], drift.shape, H, x0
        ),
    )


def _readings(
    recorded: Recorded, before: NDArray, angle: NDArray, pinned: NDArray, current: NDArray
) -> tuple[NDArray, NDArray]:
    """Readings less what they read directly of given inputs, and their variances: (n, p) each."""
    m, names = recorded.machine, tuple(recorded.channels)
    readings = np.column_stack([c.value for c in recorded.channels.values()])
    variance = np.column_stack([c.variance for c in recorded.channels.values()])
    for j, name in enumerate(names):
        direct = m.direct.get(name, {})
        readings[:, j] -= direct.get("command", 0.0) * before
        readings[:, j] -= direct.get("held_angle", 0.0) * angle
        if "command" in direct and m.plant.drive != mp.CURRENT:
            variance[np.concatenate(([True], pinned[:-1])), j] = np.inf
    if "current_A" in names and pinned.any():
        near = np.convolve(pinned, np.ones(5), mode="same") > 0.5
        variance[near, names.index("current_A")] += (AT_LIMIT * np.abs(current).max()) ** 2
    return readings, variance


def _offsets(
    recorded: Recorded, outputs: list[str], before: NDArray, angle: NDArray, count: int
) -> NDArray:
    """(n, count): what given inputs add to the outputs."""
    offsets = np.zeros((angle.size, count))
    for j, name in enumerate(outputs):
        direct = recorded.machine.direct.get(name, {})
        offsets[:, j] += direct.get("held_angle", 0.0) * angle
        offsets[:, j] += direct.get("command", 0.0) * before
    return offsets


def _row(recorded: Recorded, name: str, latents: tuple[str, ...]) -> NDArray:
    direct = recorded.machine.direct.get(name, {})
    return np.concatenate(
        (recorded.machine.rows[name], [direct.get(port, 0.0) for port in latents])
    )


def _magnitudes(recorded: Recorded, command: NDArray) -> dict[str, float]:
    """Typical sizes of volts (or amperes) and torques in this recording."""
    plant, rms = recorded.machine.plant, float(np.sqrt(np.mean(command**2)))
    volts = rms * plant.volts_per_command
    amperes = volts / plant.resistance if plant.drive in (mp.DUTY, mp.VOLTAGE) else rms
    torque = amperes * plant.torque_per_ampere
    if plant.drive == mp.MOTOR_TORQUE:
        torque = rms * plant.torque_per_motor_torque
    known = [0.1 * torque, plant.gravity, abs(plant.load_torque)]
    if "torque_Nm" in recorded.channels:
        known.append(float(np.std(recorded.channels["torque_Nm"].value)))
    scale = max(*known, 1e-9)
    drive = volts if plant.drive in (mp.DUTY, mp.VOLTAGE) else amperes
    return {"V": max(0.1 * drive, 1e-6), "G": scale, "S": scale, "L": scale}


def _start(
    recorded: Recorded, latents: tuple[str, ...], magnitudes: Mapping[str, float], at_rest: bool
) -> tuple[NDArray, NDArray]:
    """Mean and covariance of the first row's states."""
    m, plant = recorded.machine, recorded.machine.plant
    x0, std = np.zeros(len(m.states)), np.zeros(len(m.states))
    for j, state in enumerate(m.states):
        if state == "current_A":
            volts = np.abs(recorded.commanded()).max() * plant.volts_per_command
            std[j] = 0.0 if at_rest else volts / plant.resistance
        elif state.endswith("angle_rad"):
            x0[j], std[j] = _first_angle(recorded, state)
        else:
            std[j] = 0.0 if at_rest else _fastest(recorded, state)
    wide = [WIDE * magnitudes[port] for port in latents]
    return np.concatenate((x0, np.zeros(len(latents)))), np.diag(np.square([*std, *wide]))


def _first_angle(recorded: Recorded, state: str) -> tuple[float, float]:
    ratio = recorded.machine.plant.gear_ratio
    held = float(recorded.held_angle()[0])
    if state == "wheel_angle_rad" and "motor_angle_rad" in recorded.channels:
        motor = recorded.channels["motor_angle_rad"]
        return motor.value[0] / ratio, motor.floor / ratio
    rigid = recorded.machine.plant.structure == mp.RIGID_FREE
    if (state == "load_angle_rad" or rigid) and "load_angle_rad" in recorded.channels:
        load = recorded.channels["load_angle_rad"]
        return load.value[0], load.floor
    if state == "wheel_angle_rad" and "spring_deflection_rad" in recorded.channels:
        deflection = recorded.channels["spring_deflection_rad"]
        return deflection.value[0] + held, deflection.floor + UNKNOWN_ANGLE_rad * (
            not recorded.load.is_held
        )
    return float(recorded.load_angle()[0]), UNKNOWN_ANGLE_rad


def _fastest(recorded: Recorded, state: str) -> float:
    """Largest speed over a few rows of whatever reads this motion."""
    fastest = 0.0
    for name, share in (
        ("motor_angle_rad", 1.0 / recorded.machine.plant.gear_ratio),
        ("load_angle_rad", 1.0),
        ("spring_deflection_rad", 1.0),
    ):
        if name in recorded.channels:
            rows = min(SPEED_ROWS, recorded.channels[name].value.size - 1)
            moved = recorded.channels[name].value[rows:] - recorded.channels[name].value[:-rows]
            fastest = max(fastest, share * float(np.abs(moved).max()) / (rows * recorded.row_s))
    return fastest + UNKNOWN_ANGLE_rad * ("torque_Nm" in recorded.channels and fastest == 0.0)


def _biases(
    recorded: Recorded,
    held: NDArray,
    torque: NDArray,
    shape: tuple[int, int],
    H: NDArray,
    x0: NDArray,
):
    """Constant errors as unit disturbances: each encoder's phase, the held load's angle."""
    found, n, base = [], shape[0], len(recorded.machine.states)
    for j, (name, channel) in enumerate(recorded.channels.items()):
        if channel.bias > 0.0:
            readings, start = np.zeros((n, len(H))), np.zeros_like(x0)
            readings[:, j] = 1.0
            seen = np.flatnonzero(np.abs(H[j]) > 0.0)
            if name != "spring_deflection_rad" and seen.size == 1:
                start[seen[0]] = 1.0 / H[j, seen[0]]
            drift = np.zeros(shape)
            if name == "load_angle_rad":  # gravity is fed from it
                plant, angle = recorded.machine.plant, recorded.load_angle()
                slope = -plant.gravity * np.cos(angle + plant.gravity_offset)
                drift[:, :base] = torque * slope[:, None]
            found.append((channel.bias, drift, readings, start))
    floor = channels_of(recorded.rig, recorded.columns).get("load_angle_rad")
    if recorded.load.is_held and floor is not None and floor.bias > 0.0:
        drift = np.zeros(shape)
        drift[:, :base] = held
        readings = np.zeros((n, len(H)))
        for j, name in enumerate(recorded.channels):
            readings[:, j] = -recorded.machine.direct.get(name, {}).get("held_angle", 0.0)
        found.append((floor.bias, drift, readings, np.zeros_like(x0)))
    return tuple(found)


def _between(values: NDArray) -> NDArray:
    """(n, 1): the mean of each row and the next, what acts between them."""
    return (0.5 * (values + np.append(values[1:], values[-1])))[:, None]
