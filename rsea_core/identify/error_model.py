"""The linear machine as a model of a replay's errors, with room for an unknown signal.

The same equations as the whitener's (`whitening`): the errors of the nominal machine's states, the
bridge's wandering zero and gain, the sensors. An unknown signal comes first among the states.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.kernel as k
from rsea_core.identify.whitening import (
    GAIN_SHARE,
    SLOW_COUNTS,
    SLOW_SHARE,
    START_COUNTS,
    SLOW_TIME_s,
    augmented,
    averaged,
    motor_row,
    moving_states,
    reading_row,
    slow_motion,
)
from rsea_core.linearise import linear_plant

READING = "Y:"


@dataclass(frozen=True, kw_only=True)
class ErrorModel:
    """One recording's errors, without the unknown signal.

    Attributes
    ----------
    rates : (2, d, d) array
        Continuous, out of contact and in it; the bridge's zero and gain are the last states.
    C, R, P, Q : arrays
        Readings, their noise, the start's covariance and what a block adds.
    modes, drive : (blocks,) arrays
    """

    plant: k.Plant
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
        if plant.structure == k.RIGID_HELD:
            return ()
        found = ["V"] if plant.drive in (k.DUTY, k.VOLTAGE) else []
        found.append("G")
        if plant.structure in (k.ELASTIC_FREE, k.ELASTIC_HELD):
            found.append("S")
        if plant.structure in (k.ELASTIC_FREE, k.RIGID_FREE):
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
        if plant.structure == k.RIGID_FREE:
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
    plant: k.Plant,
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
    """The errors' model of a recording; parameters as `whitening.whitener`."""
    n = max(rows // block, 1)
    h = row_s * block
    states = moving_states(plant)
    rates = np.array(
        [
            augmented(
                plant,
                linear_plant(
                    plant, tangent=stiffness, gravity_stiffness=plant.gravity, in_contact=contact
                ).A,
                states,
            )
            for contact in (False, True)
        ]
    )
    d = rates.shape[1]
    Q = np.zeros((d, d))
    Q[-2, -2] = 1.0 - np.exp(-2.0 * h / SLOW_TIME_s)
    level = np.hypot(SLOW_COUNTS * (plant.motor_count or 0.0), SLOW_SHARE * motion) or SLOW_SHARE
    unit = slow_motion(expm(rates[0] * h), Q, n, motor_row(plant, states, d))
    scale = (level / unit) ** 2 if unit > 0.0 else 0.0
    Q[-1, -1] = Q[-2, -2] * GAIN_SHARE**2
    Q[-2, -2] *= scale
    P = np.zeros((d, d))
    P[-2, -2], P[-1, -1] = scale, GAIN_SHARE**2
    for name, state, per in (
        ("motor_angle_rad", k.TW, plant.gear_ratio),
        ("load_angle_rad", k.TL, 1.0),
    ):
        if state in states and name in floors:
            at = states.index(state)
            P[at, at] = (START_COUNTS * 3.46 * floors[name] / per) ** 2
    return ErrorModel(
        plant=plant,
        states=tuple(states),
        channels=channels,
        block=block,
        step_s=h,
        rates=rates,
        C=np.array([reading_row(plant, stiffness, name, states, d) for name in channels]),
        R=np.diag([floors[name] ** 2 / averaged(name, block) for name in channels]),
        P=P,
        Q=Q,
        modes=in_contact[: n * block].reshape(n, block).any(axis=1).astype(np.int64),
        drive=drive[: n * block].reshape(n, block).mean(axis=1),
    )
