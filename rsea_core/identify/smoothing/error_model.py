"""The linear machine as a model of a replay's errors, with room for an unknown signal.

The errors of the nominal machine's states, constants of the readings, the bridge's wandering zero
and gain, the sensors: what the whitener filters with (`whitening`), and, with an unknown signal
before all other states, what tells where a mismatch enters (`unknown_input`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant

READING = "Y:"
SLOW_COUNTS = 4.0  # wandering zero of a bridge: motion, rms, in motor encoder counts
SLOW_SHARE = 1e-4  # the same of the motor's motion, where counts are finer than that
GAIN_SHARE = 7e-4  # wandering gain of a bridge, rms: some tens of counts where the motor turns far
SLOW_TIME_s = 0.7  # its correlation time at the drive
START_COUNTS = 0.5  # uncertainty of a start, counts
# an incremental encoder counts from a random place between two counts: half a count, uniform, is a
# constant error of a recording's readings (the floor itself, rms). The motor's is nothing behind
# the gear; the load's would be taken for gravity, mass and stiffness
COUNTED = ("load_angle_rad",)


@dataclass(frozen=True, kw_only=True)
class ErrorModel:
    """One recording's errors, without the unknown signal.

    Attributes
    ----------
    rates : (2, d, d) array
        Continuous, out of contact and in it: the machine's states, constants of the readings, the
        bridge's zero and gain.
    C, R, P, Q : arrays
        Readings, their noise, the start's covariance and what a block adds.
    modes, drive : (blocks,) arrays
    """

    plant: mp.Plant
    states: tuple[int, ...]
    channels: tuple[str, ...]
    block: int
    step_s: float
    rates: NDArray
    C: NDArray
    R: NDArray
    P: NDArray
    Q: NDArray
    modes: NDArray
    drive: NDArray

    @property
    def ports(self) -> tuple[str, ...]:
        """Ports of this machine, readings left out."""
        plant = self.plant
        if plant.structure == mp.RIGID_HELD:
            return ()
        found = ["V"] if plant.drive in (mp.DUTY, mp.VOLTAGE) else []
        found.append("G")
        if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
            found.append("S")
        if plant.structure in (mp.ELASTIC_FREE, mp.RIGID_FREE):
            found.append("L")
            if np.isfinite(plant.contact_angle):
                found.append("E")
        return tuple(found)

    def with_input(self, port: str, pace_s: float) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Transitions, readings, noise and start with an unknown signal of size one at a port.

        Parameters
        ----------
        port : str
            "V", "G", "S", "L", "E" or "Y:<column>"; one that the machine does not have is nowhere.
        pace_s : float
            Correlation time of the signal.
        """
        d = self.rates.shape[1] + 1
        M = np.zeros((2, d, d))
        M[:, 1:, 1:] = self.rates
        M[:, 0, 0] = -1.0 / pace_s
        C = np.zeros((len(self.channels), d))
        C[:, 1:] = self.C
        column = port.removeprefix(READING)
        if column in self.channels:
            C[self.channels.index(column), 0] = 1.0
        elif port in self.ports:
            for state, value in self._enters(port):
                M[:, 1 + self.states.index(state), 0] = value
            if port == "E":
                M[0, 1:, 0] = 0.0
            if port == "S" and "torque_Nm" in self.channels:
                C[self.channels.index("torque_Nm"), 0] = 1.0
        A = np.array([expm(m * self.step_s) for m in M])
        P, Q = np.zeros((d, d)), np.zeros((d, d))
        P[1:, 1:], Q[1:, 1:] = self.P, self.Q
        P[0, 0] = 1.0
        Q[0, 0] = 1.0 - np.exp(-2.0 * self.step_s / pace_s)
        return A, C, Q, P

    def transitions(self, A: NDArray) -> NDArray:
        """(blocks, d, d): what takes each block to the next, the bridge's gain as driven."""
        found = A[self.modes].copy()
        found[:, :-1, -1] *= self.drive[:, None]
        return found

    def _enters(self, port: str) -> list[tuple[int, float]]:
        """Rates of states per unit of a signal at a port."""
        plant = self.plant
        wheel = plant.inertia
        if plant.structure == mp.RIGID_FREE:
            wheel += plant.load_inertia
        if port == "V":
            if k.IM in self.states:
                return [(k.IM, 1.0 / plant.inductance)]
            return [(k.WW, plant.torque_per_ampere / plant.resistance / wheel)]
        if port == "G":
            return [(k.WW, 1.0 / wheel)]
        load = k.WL if k.WL in self.states else k.WW
        inertia = plant.load_inertia if load == k.WL else wheel
        if port in ("L", "E"):
            return [(load, 1.0 / inertia)]
        found = [(k.WW, -1.0 / plant.inertia)]
        if k.WL in self.states:
            found.append((k.WL, 1.0 / plant.load_inertia))
        return found


def error_model(
    plant: mp.Plant,
    stiffness: float,
    *,
    channels: tuple[str, ...],
    floors: Mapping[str, float],
    row_s: float,
    rows: int,
    block: int,
    in_contact: NDArray,
    motion: float,
    drive: NDArray,
) -> ErrorModel:
    """The errors' model of a recording.

    Parameters
    ----------
    floors : column -> standard deviation of one reading
    block : int
        Rows averaged to one.
    in_contact : (rows,) bool array
    motion : float
        Standard deviation of the motor's angle (or what stands for it) over the recording.
    drive : (rows,) array
        What the bridge gives: volts at the winding, or torque on the wheel.
    """
    n = max(rows // block, 1)
    h = row_s * block
    states = moving_states(plant)
    counted = [name for name in channels if name in COUNTED]
    rates = _rates(plant, stiffness, states, len(counted))
    d = rates.shape[1]
    Q, scale = _slow_noise(plant, rates[0], states, h, n, motion)
    P = np.diag(_start_variances(plant, states, floors, d))
    P[-2, -2], P[-1, -1] = scale, GAIN_SHARE**2
    C = np.array([reading_row(plant, stiffness, name, states, d) for name in channels])
    held = {"torque_Nm": stiffness, "spring_deflection_rad": 1.0}
    for j, name in enumerate(counted, start=len(states)):
        C[channels.index(name), j] = 1.0
        P[j, j] = floors[name] ** 2
        if plant.structure == mp.ELASTIC_HELD and name == "load_angle_rad":
            # held where the reading says: what that errs by bends the spring, and reads as nothing
            C[:, j] = [held.get(channel, 0.0) for channel in channels]
            rates[:, states.index(k.WW), j] = -stiffness / plant.inertia
    return ErrorModel(
        plant=plant,
        states=tuple(states),
        channels=channels,
        block=block,
        step_s=h,
        rates=rates,
        C=C,
        R=np.diag([floors[name] ** 2 / averaged(name, block) for name in channels]),
        P=P,
        Q=Q,
        modes=in_contact[: n * block].reshape(n, block).any(axis=1).astype(np.int64),
        drive=drive[: n * block].reshape(n, block).mean(axis=1),
    )


def _rates(plant: mp.Plant, stiffness: float, states: Sequence[int], constants: int) -> NDArray:
    """(2, d, d): rates of the errors out of contact and in it."""
    return np.array(
        [
            augmented(
                plant,
                linear_plant(
                    plant, tangent=stiffness, gravity_stiffness=plant.gravity, in_contact=contact
                ).A,
                states,
                constants,
            )
            for contact in (False, True)
        ]
    )


def _start_variances(
    plant: mp.Plant, states: Sequence[int], floors: Mapping[str, float], size: int
) -> NDArray:
    """(size,) of a start within some counts of the angles that are read."""
    variances = np.zeros(size)
    for name, state, per in (
        ("motor_angle_rad", k.TW, plant.gear_ratio),
        ("load_angle_rad", k.TL, 1.0),
    ):
        if state in states and name in floors:
            variances[states.index(state)] = (START_COUNTS * 3.46 * floors[name] / per) ** 2
    return variances


def _slow_noise(
    plant: mp.Plant,
    rates: NDArray,
    states: Sequence[int],
    step_s: float,
    blocks: int,
    motion: float,
) -> tuple[NDArray, float]:
    """(d, d) noise of the bridge's wandering zero and gain, and the zero's variance."""
    d = len(rates)
    Q = np.zeros((d, d))
    Q[-2, -2] = 1.0 - np.exp(-2.0 * step_s / SLOW_TIME_s)
    level = np.hypot(SLOW_COUNTS * (plant.motor_count or 0.0), SLOW_SHARE * motion) or SLOW_SHARE
    unit = slow_motion(expm(rates * step_s), Q, blocks, motor_row(plant, states, d))
    scale = (level / unit) ** 2 if unit > 0.0 else 0.0
    Q[-1, -1] = Q[-2, -2] * GAIN_SHARE**2
    Q[-2, -2] *= scale
    return Q, scale


def averaged(name: str, block: int) -> float:
    """By how much the mean over a block of rows lowers the variance of a reading's noise."""
    # counts of a slow motion stay the same over a block: no gain from averaging those of a load
    return 1.0 if name.startswith("load") else float(block)


def moving_states(plant: mp.Plant) -> list[int]:
    """Indices of the states that this machine has."""
    winding = plant.drive in (mp.DUTY, mp.VOLTAGE) and plant.inductance > 0.0
    states = [k.IM] if winding else []
    if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD, mp.RIGID_FREE):
        states += [k.TW, k.WW]
    if plant.structure == mp.ELASTIC_FREE:
        states += [k.TL, k.WL]
    return states


def augmented(plant: mp.Plant, full: NDArray, states: list[int], constants: int) -> NDArray:
    """The error's dynamics with constants of the readings, then the bridge's zero and gain.

    Zero and gain wander; the gain's column is for a drive of one unit.
    """
    n = len(states)
    d = n + constants + 2
    M = np.zeros((d, d))
    M[:n, :n] = full[np.ix_(states, states)]
    if plant.structure == mp.RIGID_FREE:
        M[:n, :n] = one_body(full)[np.ix_(states, states)]
    if k.IM in states:
        M[states.index(k.IM), -2:] = 1.0 / plant.inductance
    elif k.WW in states:
        inertia = plant.inertia
        if plant.structure == mp.RIGID_FREE:
            inertia += plant.load_inertia
        per = 1.0
        if plant.drive in (mp.DUTY, mp.VOLTAGE):
            per = plant.torque_per_ampere / plant.resistance
        M[states.index(k.WW), -2:] = per / inertia
    M[-2, -2] = M[-1, -1] = -1.0 / SLOW_TIME_s
    return M


def one_body(full: NDArray) -> NDArray:
    """Dynamics of wheel and load as one: columns of the load added to the wheel's."""
    moved = np.zeros_like(full)
    moved[:, k.TW], moved[:, k.WW] = full[:, k.TL], full[:, k.WL]
    moved[k.TL], moved[k.WL] = 0.0, 0.0
    return full + moved * (np.arange(k.N_STATES) == k.WW)[:, None]


def reading_row(plant: mp.Plant, stiffness: float, name: str, states: list[int], d: int) -> NDArray:
    """What a column reads of the states."""
    row = np.zeros(d)

    def put(state: int, value: float) -> None:
        if state in states:
            row[states.index(state)] += value
        elif plant.structure == mp.RIGID_FREE and state == k.TL:
            row[states.index(k.TW)] += value

    if name == "motor_angle_rad":
        put(k.TW, plant.gear_ratio)
    elif name == "load_angle_rad":
        put(k.TL, 1.0)
    elif name in ("torque_Nm", "spring_deflection_rad"):
        factor = stiffness if name == "torque_Nm" else 1.0
        if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
            put(k.TW, factor)
            put(k.TL, -factor)
    elif name == "current_A":
        if k.IM in states:
            put(k.IM, 1.0)
        elif plant.drive in (mp.DUTY, mp.VOLTAGE):
            put(k.WW, -plant.volts_per_speed / plant.resistance)
    return row


def motor_row(plant: mp.Plant, states: list[int], d: int) -> NDArray:
    """The row that reads the motor's angle."""
    return reading_row(plant, 0.0, "motor_angle_rad", states, d)


def slow_motion(A: NDArray, Q: NDArray, n: int, row: NDArray) -> float:
    """Standard deviation of the motor's angle half way, for a disturbance of variance 1."""
    P = np.zeros_like(Q)
    P[-2, -2] = 1.0
    for _ in range(max(n // 2, 1)):
        P = A @ P @ A.T + Q
    return float(np.sqrt(max(row @ P @ row, 0.0)))
