"""What a prediction errs by, as a linear stochastic machine: innovations, likelihood, smoothing.

The difference of a recording and a simulation of it follows, as far as both stay near each other,
the linear machine driven by what neither knows: a white torque at the gear and at the load, a
white voltage at the winding. Their densities are estimated from the data by maximum likelihood
(grey-box models with diffusion: Kristensen, Madsen & Jorgensen, Automatica 40 (2004) 225), so that
a torque that no log holds does not pass for physics, and the readings' noise with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.identify.smoothing.error_model import moving_states, one_body, reading_row

GRAVITY_LEVELS = 5  # levels of cos(load angle) between which gravity's stiffness is told apart
SLOW = 10.0  # time scales of the motion in which a slow torque forgets itself
COMMAND_LEVELS = (0.02, 0.1, 0.4)  # of the largest change of a command over a row
LONGEST_PART = 0.5  # of a row, in times of the fastest mode


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Densities of the unknown inputs and deviations of the readings.

    Attributes
    ----------
    inputs : (5,) array
        Standard deviations of torque at the gear, at the load, and of the voltage, each over
        `Scale.time_s`, of a torque at the gear that changes slowly (`SLOW`), and of the command's
        mean over a row as a share of its change to the next one: a loop that runs faster than its
        log, a command that acts late.
    readings : (p,) array
        Standard deviation of one reading, of what is independent from row to row.
    colours : (p,) array
        Of what each reading errs by over `colour_time_s`, an autoregression of first order; empty
        where readings have white noise.
    """

    inputs: NDArray
    readings: NDArray
    colours: NDArray = field(default_factory=lambda: np.zeros(0))
    colour_time_s: float = 0.0

    @property
    def of_readings(self) -> NDArray:
        """(p,) deviations of the readings, coloured part included."""
        return np.hypot(self.readings, self.colours) if self.colours.size else self.readings

    @property
    def sizes(self) -> NDArray:
        """(5 or 5 + p,) deviations of all that drives the errors."""
        return np.concatenate([self.inputs, self.colours])


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Typical magnitudes of one recording on its machine.

    Attributes
    ----------
    torque_Nm : (2,) array
        At the gear's output and at the load.
    voltage_V, speed_rad_per_s, angle_rad, time_s : float
        Angle and speed at the output; the time is their quotient.
    """

    torque_Nm: NDArray
    voltage_V: float
    speed_rad_per_s: float
    angle_rad: float
    time_s: float


class Readings(NamedTuple):
    """Columns of a recording, and indices of those whose zero differs in this recording alone."""

    channels: tuple[str, ...]
    zeros: tuple[int, ...] = ()

    def with_zeros(self, plant: mp.Plant) -> list[int]:
        """Readings whose zero is a state: those, and others that may err by a count.

        The first angle or speed is the reference for the angle of a rigid body, or for its speed. A
        free zero of a current or a torque would absorb the offset of a sensor.
        """
        elastic = plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
        moving = [
            j for j, name in enumerate(self.channels) if name not in ("current_A", "torque_Nm")
        ]
        found = set(self.zeros) | set(moving[1:])
        if moving and elastic and self.channels[moving[0]].endswith("angle_rad"):
            found.add(moving[0])
        return sorted(found)


class LinearErrors(NamedTuple):
    """A (modes, d, d), Q (modes, d, d), mode (n,), C (p, d), start (d,) of standard deviations.

    After the machine's states comes a slow torque at the gear, where there is a wheel, then
    constants of the readings; the last states are their coloured noise.
    """

    A: NDArray
    Q: NDArray
    mode: NDArray
    C: NDArray
    states: tuple[int, ...]
    constants: NDArray  # (p,) index of each reading's constant, -1: none
    unit: NDArray  # (5 or 5 + p, modes, d, d): Q of an unknown input of size one
    slow: int  # index of the slow torque, -1: none
    colours: NDArray  # (p or 0,) index of each reading's coloured noise


def linear_errors(
    plant: mp.Plant,
    stiffness: float,
    readings: Readings,
    load_angle: NDArray,
    command_change: NDArray,
    row_s: float,
    noise: Noise,
    time_s: float,
) -> LinearErrors:
    """The errors' machine on the rows of one recording.

    Parameters
    ----------
    load_angle : (n,) array
        By which gravity's stiffness changes along the rows.
    command_change : (n,) array
        Of the command over each row.
    """
    states = moving_states(plant)
    n, p = len(states), len(readings.channels)
    constants = np.full(p, -1)
    later = readings.with_zeros(plant)
    slow = n if k.WW in states else -1
    constants[later] = n + (slow >= 0) + np.arange(len(later))
    d = n + (slow >= 0) + len(later)
    colours = d + np.arange(noise.colours.size)
    d += colours.size
    mode = _modes(plant, load_angle)
    A = np.zeros((2 * GRAVITY_LEVELS, d, d))
    unit = np.zeros((5 + colours.size, 2 * GRAVITY_LEVELS, d, d))
    densities = [_inputs(plant, states, size, time_s, d) for size in np.eye(3)]
    densities += [np.zeros((d, d)), _command(plant, states, row_s, d)]
    own = np.zeros((d, d))  # of the Gauss-Markov states
    if slow >= 0:
        own[states.index(k.WW), slow] = 1.0 / _wheel(plant)
        densities[3][slow, slow] = _markov(own, slow, SLOW * time_s)
    for at in colours:
        densities.append(np.zeros((d, d)))
        densities[-1][at, at] = _markov(own, at, noise.colour_time_s)
    for j in np.unique(mode):
        level = -1.0 + 2.0 * (j % GRAVITY_LEVELS) / (GRAVITY_LEVELS - 1)
        full = linear_plant(
            plant, tangent=stiffness, gravity_stiffness=plant.gravity * level,
            in_contact=bool(j >= GRAVITY_LEVELS),
        ).A  # fmt: skip
        if plant.structure == mp.RIGID_FREE:
            full = one_body(full)
        M = own.copy()
        M[:n, :n] = full[np.ix_(states, states)]
        for m, density in enumerate(densities):
            A[j], unit[m, j] = discretised(M, density, row_s)
    A, unit, mode = _with_levels(A, unit, mode, command_change)
    C = np.array([_reading(plant, stiffness, name, states, d) for name in readings.channels])
    for j in later:
        C[j, constants[j]] = 1.0
    C[np.arange(colours.size), colours] = 1.0
    Q = np.tensordot(noise.sizes**2, unit, axes=1)
    return LinearErrors(A, Q, mode, C, tuple(states), constants, unit, slow, colours)


def _modes(plant: mp.Plant, load_angle: NDArray) -> NDArray:
    """(n,) level of gravity's stiffness in each row, and whether it is in contact."""
    slope = np.cos(load_angle + plant.gravity_offset)
    level = np.clip(
        np.round((slope + 1.0) * 0.5 * (GRAVITY_LEVELS - 1)), 0, GRAVITY_LEVELS - 1
    ).astype(np.int64)
    return level + GRAVITY_LEVELS * (load_angle > plant.contact_angle)


def _markov(M: NDArray, at: int, time_s: float) -> float:
    """Make a state a first-order Gauss-Markov process; its density for a variance of one."""
    M[at, at] = -1.0 / time_s
    return 2.0 / time_s


def _with_levels(A: NDArray, unit: NDArray, mode: NDArray, change: NDArray):
    """The modes once for each level of the command's change, and the mode of each row."""
    level, changes = _levels(change)
    whole = np.tile(unit, (1, changes.size, 1, 1))
    whole[4] *= np.repeat(changes**2, len(A))[:, None, None]
    return np.tile(A, (changes.size, 1, 1)), whole, mode + len(A) * level


def _levels(change: NDArray) -> tuple[NDArray, NDArray]:
    """Level (n,) of the change of the command over each row, and what each level stands for.

    Few levels: gains are computed anew where a row has another level than the row before.
    """
    largest = float(np.max(change, initial=0.0))
    if largest <= 0.0:
        return np.zeros(change.size, np.int64), np.zeros(1)
    level = np.searchsorted(largest * np.array(COMMAND_LEVELS), change, side="right")
    mean = [np.sqrt(np.mean(change[level == j] ** 2)) if np.any(level == j) else 0.0
            for j in range(len(COMMAND_LEVELS) + 1)]  # fmt: skip
    return level.astype(np.int64), np.array(mean)


def _command(plant: mp.Plant, states: Sequence[int], row_s: float, d: int) -> NDArray:
    """(d, d) density of a command whose mean over a row errs by one."""
    density = np.zeros((d, d))
    gain = {mp.CURRENT: plant.torque_per_ampere, mp.POSITION: 0.0}.get(
        plant.drive, plant.torque_per_motor_torque
    )
    if plant.drive in (mp.DUTY, mp.VOLTAGE):
        volts = plant.volts_per_command if plant.drive == mp.DUTY else 1.0
        if k.IM in states:
            at = states.index(k.IM)
            density[at, at] = (volts / plant.inductance) ** 2 * row_s
            return density
        gain = volts * plant.torque_per_ampere / plant.resistance if plant.resistance > 0.0 else 0.0
    if k.WW in states:
        at = states.index(k.WW)
        density[at, at] = (gain / _wheel(plant)) ** 2 * row_s
    return density


def with_density(errors: LinearErrors, noise: Noise) -> LinearErrors:
    """The errors' machine under other unknown inputs."""
    return errors._replace(Q=np.tensordot(noise.sizes**2, errors.unit, axes=1))


def _reading(plant: mp.Plant, stiffness: float, name: str, states: Sequence[int], d: int):
    """What a column reads of the states; a velocity reads the one of its angle."""
    velocity = {"motor_velocity_rad_per_s": (k.WW, plant.gear_ratio),
                "load_velocity_rad_per_s": (k.WL, 1.0)}.get(name)  # fmt: skip
    if velocity is None:
        return reading_row(plant, stiffness, name, list(states), d)
    state, factor = velocity
    if state == k.WL and plant.structure == mp.RIGID_FREE:
        state = k.WW
    row = np.zeros(d)
    if state in states:
        row[states.index(state)] = factor
    return row


def _wheel(plant: mp.Plant) -> float:
    """Inertia at the gear [kg m2], that of the load with it where nothing bends between."""
    whole = plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0)
    return max(whole, 1e-300)


def _inputs(plant: mp.Plant, states: Sequence[int], size: NDArray, time_s: float, d: int):
    """(d, d) density of what the unknown inputs do to the states."""
    density = np.zeros((d, d))
    wheel = _wheel(plant)
    entries = [(k.WW, size[0] / wheel)]
    if k.WL in states:
        entries.append((k.WL, size[1] / plant.load_inertia))
    elif k.WW in states and plant.structure == mp.RIGID_FREE:
        entries[0] = (k.WW, float(np.hypot(size[0], size[1])) / wheel)
    if k.IM in states:
        entries.append((k.IM, size[2] / plant.inductance))
    elif plant.drive in (mp.DUTY, mp.VOLTAGE) and plant.resistance > 0.0:
        torque = size[2] * plant.torque_per_ampere / plant.resistance
        entries[0] = (k.WW, float(np.hypot(entries[0][1], torque / wheel)))
    for state, rate in entries:
        if state in states:
            density[states.index(state), states.index(state)] = rate**2 * time_s
    return density


def free_inputs(plant: mp.Plant, channels: Sequence[str]) -> list[tuple[int, str]]:
    """Which unknown inputs a machine has whose densities its readings can tell."""
    found = []
    if plant.structure != mp.RIGID_HELD:
        found.append((0, "torque at the gear"))
        if plant.drive != mp.POSITION:  # lasting errors of a servo show its friction
            found.append((3, "slow torque at the gear"))
    if plant.structure == mp.ELASTIC_FREE:
        found.append((1, "torque at the load"))
    if plant.drive in (mp.DUTY, mp.VOLTAGE) and "current_A" in channels:
        found.append((2, "voltage"))
    if plant.structure != mp.RIGID_HELD and plant.drive != mp.POSITION:
        found.append((4, "command within a row"))
    return found


def discretised(M: NDArray, density: NDArray, h: float) -> tuple[NDArray, NDArray]:
    """Transition and added covariance over a row (Van Loan, IEEE TAC 23 (1978) 395)."""
    # of a stiff machine over short times, doubled: over a whole row the exponential of -M overflows
    rate = float(np.max(np.abs(np.linalg.eigvals(M)), initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(max(rate * h / LONGEST_PART, 1.0)))))
    d, part = len(M), h / 2**halvings
    wide = np.zeros((2 * d, 2 * d))
    wide[:d, :d], wide[:d, d:], wide[d:, d:] = -M, density, M.T
    E = expm(wide * part)
    A = E[d:, d:].T
    Q = A @ E[:d, d:]
    for _ in range(halvings):
        A, Q = A @ A, A @ Q @ A.T + Q
    return A, 0.5 * (Q + Q.T)
