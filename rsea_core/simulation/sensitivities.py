"""Exact derivatives of a run by parameters, gains and start, through stick, slip and contact.

Between events the machine is linear, and its states and their derivatives go on by exponentials of
one block matrix. At an event the derivative jumps, because the event's own time depends on the
parameter: S+ = S- + (f- - f+) dt/dp with dt/dp = -(g S + g_p z) / (g f-), the saltation matrix.
A controller acts at fixed times; its law is differentiated in the direction in which everything
that it reads changes. Encoders are exact here: counts have no derivative.

Source: Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004),
chapter 7; Van Loan 1978, IEEE TAC 23(3), for the integrals.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

import rsea_core.engines.event_driven.states as k
from rsea_core.engines.linear.hybrid import COMMAND, ONE, SIZE, HybridMachine, Mode
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only

STEP = 1e-5  # of a parameter, relative, for the matrices' own differences
LAW_STEP = 1e-4  # of what a law reads
SLIGHT = 1e-12  # a guard that is below zero by round-off only
SMALLEST = 1e-6  # of a state in SI units that round-off is measured by
SLIGHT_RATE = 1e-9  # the same of its rate, where the guard is at zero
MOST_EVENTS = 200  # within a row
STARTS = ("initial_motor_angle_rad", "initial_load_angle_rad")


@dataclass(frozen=True, kw_only=True)
class Sensitivities:
    """A run and its derivatives; arrays are read-only.

    Attributes
    ----------
    names : tuple of str
        Parameters, gains and starts, in the order of the last axis.
    time_s : (n,) array
    states, torque_Nm, command : (n, 5), (n,), (n,) arrays
        States of `linearise.STATE_NAMES`.
    states_by, torque_by, command_by : (n, 5, p), (n, p), (n, p) arrays
        Their derivatives, per unit of each name.
    events : tuple of (float, str)
        Time and name of everything that switched.
    """

    names: tuple[str, ...]
    time_s: NDArray
    states: NDArray
    torque_Nm: NDArray
    command: NDArray
    states_by: NDArray
    torque_by: NDArray
    command_by: NDArray
    events: tuple[tuple[float, str], ...]


@njit(cache=True)
def _act(function, parameters, state, signals, command):
    function(parameters, state, signals, command)


class _Law:
    """A compiled law with the derivatives of its numbers, and of its state as it runs."""

    def __init__(self, compiled: Any, numbers_by: NDArray):
        self.function, self.numbers = compiled.function, np.array(compiled.parameters, float)
        self.numbers_by = numbers_by  # (numbers, p)
        self.state = np.array(compiled.state, float)
        self.state_by = np.zeros((self.state.size, numbers_by.shape[1]))

    def act(self, signals: NDArray, signals_by: NDArray) -> tuple[float, NDArray]:
        """Command and its derivatives for these signals and theirs (N_SIGNALS, p)."""
        n, m = self.numbers.size, self.state.size
        base = np.concatenate((self.numbers, self.state, signals))
        along = np.vstack((self.numbers_by, self.state_by, signals_by))
        command_by = np.zeros(along.shape[1])
        after_by = np.zeros_like(self.state_by)
        for j, direction in enumerate(along.T):
            largest = np.abs(direction).max()
            if largest == 0.0:
                continue
            h, differences = LAW_STEP / largest, []
            for x in (h, 0.5 * h):
                (up, above), (down, below) = (
                    self._call(base + side * x * direction, n, m) for side in (1.0, -1.0)
                )
                differences.append(np.append(above - below, up - down) / (2.0 * x))
            slope = (4.0 * differences[1] - differences[0]) / 3.0  # Richardson
            after_by[:, j], command_by[j] = slope[:-1], slope[-1]
        command, self.state = self._call(base, n, m)
        self.state_by = after_by
        return command, command_by

    def _call(self, everything: NDArray, n: int, m: int) -> tuple[float, NDArray]:
        state, answer = everything[n : n + m].copy(), np.zeros(k.N_COMMANDS)
        _act(self.function, everything[:n].copy(), state, everything[n + m :].copy(), answer)
        return float(answer[k.COMMAND]), state


class _Machine:
    """A hybrid machine, and its matrices' derivatives by the model's parameters."""

    def __init__(self, model, command_name: str, load: Load, names: Sequence[str], count: int):
        def made(changed: ActuatorModel) -> HybridMachine:
            return HybridMachine(changed, command_name, load)

        self.here, self.count = made(model), count
        self.pairs = []
        for name in names:
            h = STEP * (abs(value_of(model, name)) or 1.0)
            up, down = (made(with_value(model, name, value_of(model, name) + x)) for x in (h, -h))
            self.pairs.append((up, down, h))
        self._matrices: dict[Mode, tuple[NDArray, NDArray]] = {}
        self._guards: dict[Mode, tuple[list[str], NDArray, NDArray]] = {}
        self._rows: dict[tuple[Mode, float], tuple[NDArray, NDArray]] = {}
        self._lines: dict[int, tuple[NDArray, NDArray]] = {}
        self.gear = self.here.plant.gear_ratio
        self.gear_by = self.by(lambda m: np.array(m.plant.gear_ratio))

    def torque(self, region: int, z: NDArray, S: NDArray) -> tuple[float, NDArray]:
        """Spring torque at z, and its derivatives (p,)."""
        if region not in self._lines:
            line_by = self.by(lambda m: m.torque_row(region))
            self._lines[region] = self.here.torque_row(region), line_by
        line, line_by = self._lines[region]
        return float(line @ z), line @ S + z @ line_by

    def by(self, of: Callable[[HybridMachine], NDArray]) -> NDArray:
        """(..., p) derivative of an array that belongs to a machine."""
        value = of(self.here)
        found = np.zeros((*value.shape, self.count))
        for j, (up, down, h) in enumerate(self.pairs):
            found[..., j] = (of(up) - of(down)) / (2.0 * h)
        return found

    def matrices(self, mode: Mode) -> tuple[NDArray, NDArray]:
        """M and its derivatives (SIZE, SIZE, p)."""
        if mode not in self._matrices:
            self._matrices[mode] = self.here.matrix(mode), self.by(lambda m: m.matrix(mode))
        return self._matrices[mode]

    def guards(self, mode: Mode) -> tuple[list[str], NDArray, NDArray]:
        """Names, rows (g, SIZE), and derivatives (g, SIZE, p)."""
        if mode not in self._guards:
            names = list(self.here.guards(mode))

            def rows(machine: HybridMachine) -> NDArray:
                return np.array(list(machine.guards(mode).values())).reshape(len(names), SIZE)

            self._guards[mode] = names, rows(self.here), self.by(rows)
        return self._guards[mode]

    def over(self, mode: Mode, time: float, keep: bool) -> tuple[NDArray, NDArray]:
        """exp(M t), and what a parameter adds: (SIZE, SIZE, p)."""
        if (mode, time) in self._rows:
            return self._rows[mode, time]
        M, by = self.matrices(mode)
        whole, added = None, np.zeros_like(by)
        for j in range(len(self.pairs)):
            block = np.block([[M, np.zeros_like(M)], [by[..., j], M]])
            found = expm(block * time)
            whole, added[..., j] = found[:SIZE, :SIZE], found[SIZE:, :SIZE]
        found = (expm(M * time) if whole is None else whole), added
        if keep:
            self._rows[mode, time] = found
        return found


def value_of(model: ActuatorModel, name: str) -> float:
    """A parameter of `ActuatorModel.parameters` by its name.

    Raises
    ------
    InputError
        If the model has none of that name.
    """
    known = model.parameters()
    if name not in known:
        raise InputError(f"no parameter {name!r}; the model has {', '.join(known)}")
    return float(known[name].value)


def with_value(model: ActuatorModel, name: str, value: float) -> ActuatorModel:
    """The model with another value of a parameter (`value_of`)."""
    key, _, own = name.rpartition(".")
    if not key:
        return replace(model, rig=replace(model.rig, **{name: value}))
    terms = tuple(replace(t, **{own: value}) if t.key == key else t for t in model.terms)
    return replace(model, terms=terms)


def sensitivities(
    model: ActuatorModel,
    command_name: str,
    load: Load,
    *,
    time_s: NDArray,
    reference: NDArray,
    controller: Callable[[Mapping[str, float]], Any] | None = None,
    gains: Mapping[str, float] | None = None,
    parameters: Sequence[str] = (),
    starts: Mapping[str, float] | None = None,
    rows_per_sample: int = 1,
    delay_samples: int = 0,
) -> Sensitivities:
    """Run a model and differentiate the run.

    Parameters
    ----------
    time_s : (n,) array
        Evenly spaced.
    reference : (n, 3) array
        With two derivatives; without a controller its first column is the command.
    controller : callable or None
        A compiled controller for given gains.
    gains, starts : mapping or None
        Values by name; runs are differentiated by each. Starts are of STARTS, zero where absent.
    parameters : sequence of str
        Names of the model's parameters (`value_of`) to differentiate by; the controller stays as
        it is.

    Raises
    ------
    InputError
        If a name is unknown.
    SimulationError
        If the machine has what `HybridMachine` cannot carry, or switches without end.
    """
    gains, starts = dict(gains or {}), dict(starts or {})
    for name in starts:
        if name not in STARTS:
            raise InputError(f"starts: {name!r} must be one of {', '.join(STARTS)}")
    names = (*parameters, *gains, *starts)
    machine = _Machine(model, command_name, load, parameters, len(names))
    law = None
    if controller is not None:
        law = _Law(controller(gains), _numbers_by(controller, gains, len(parameters), len(names)))
    gear = machine.gear
    z, S = np.zeros(SIZE), np.zeros((SIZE, len(names)))
    z[ONE], z[k.TW] = 1.0, starts.get(STARTS[0], 0.0) / gear
    z[k.TL] = starts.get(STARTS[1], 0.0)
    for j, name in enumerate(starts, len(parameters) + len(gains)):
        S[k.TW if name == STARTS[0] else k.TL, j] = 1.0 / gear if name == STARTS[0] else 1.0
    S[k.TW] += machine.by(lambda m: np.array(starts.get(STARTS[0], 0.0) / m.plant.gear_ratio))
    return _march(machine, law, np.asarray(time_s, float), reference, (z, S), names,
                  (rows_per_sample, delay_samples))  # fmt: skip


def _numbers_by(controller, gains: Mapping[str, float], first: int, count: int) -> NDArray:
    base = controller(gains).parameters
    found = np.zeros((base.size, count))
    for j, (name, value) in enumerate(gains.items(), first):
        h = STEP * max(abs(value), 1e-3)
        high, low = (controller({**gains, name: value + x}).parameters for x in (h, -h))
        moves = high != low  # ends of the spring's regions are infinite
        found[moves, j] = (high[moves] - low[moves]) / (2.0 * h)
    return found


def _march(machine: _Machine, law, time, reference, start, names, sampling) -> Sensitivities:
    per_sample, delay = sampling
    (z, S), rows = start, time.size
    mode, events = machine.here.start(z), []
    states, states_by = np.zeros((rows, SIZE)), np.zeros((rows, SIZE, len(names)))
    torque, torque_by = np.zeros(rows), np.zeros((rows, len(names)))
    waiting = (0.0, np.zeros(len(names)))
    row_s = (time[-1] - time[0]) / (rows - 1)
    for row in range(rows):
        if law is None:
            z[COMMAND], S[COMMAND] = reference[row, 0], 0.0
        elif row % per_sample == 0:
            asked = law.act(*_signals(machine, mode, z, S, reference[row]))
            z[COMMAND], S[COMMAND] = waiting if delay else asked
            waiting = asked
        states[row], states_by[row] = z, S
        torque[row], torque_by[row] = machine.torque(mode.region, z, S)
        if row + 1 < rows:
            mode, z, S = _row(machine, mode, z, S, row_s, time[row], events)
    n = k.N_STATES
    return Sensitivities(
        names=names, time_s=read_only(time.copy()), states=read_only(states[:, :n].copy()),
        torque_Nm=read_only(torque), command=read_only(states[:, COMMAND].copy()),
        states_by=read_only(states_by[:, :n].copy()), torque_by=read_only(torque_by),
        command_by=read_only(states_by[:, COMMAND].copy()), events=tuple(events),
    )  # fmt: skip


def _signals(machine: _Machine, mode: Mode, z, S, reference) -> tuple[NDArray, NDArray]:
    """What a controller reads, and its derivatives (N_SIGNALS, p)."""
    gear, gear_by = machine.gear, machine.gear_by
    signals, by = np.zeros(k.N_SIGNALS), np.zeros((k.N_SIGNALS, S.shape[1]))
    signals[:3] = reference
    for place, state in (
        (k.READ_MOTOR_ANGLE, k.TW), (k.TRUE_MOTOR_ANGLE, k.TW), (k.TRUE_MOTOR_VELOCITY, k.WW)
    ):  # fmt: skip
        signals[place], by[place] = gear * z[state], gear * S[state] + gear_by * z[state]
    for place, state in (
        (k.READ_LOAD_ANGLE, k.TL), (k.TRUE_LOAD_ANGLE, k.TL), (k.TRUE_LOAD_VELOCITY, k.WL),
        (k.READ_CURRENT, k.IM),
    ):  # fmt: skip
        signals[place], by[place] = z[state], S[state]
    signals[k.TRUE_TORQUE], by[k.TRUE_TORQUE] = machine.torque(mode.region, z, S)
    return signals, by


def _row(machine: _Machine, mode: Mode, z, S, row_s, start_s, events):
    """Mode, z and S after a row, every event in it located."""
    done = 0.0
    for _ in range(MOST_EVENTS):
        left = row_s - done
        found = _first_event(machine, mode, z, left)
        if found is None:
            flow, added = machine.over(mode, left, keep=done == 0.0)
            return mode, flow @ z, flow @ S + np.einsum("ijp,j->ip", added, z)
        after, which = found
        if after > 0.0:
            flow, added = machine.over(mode, after, keep=False)
            z, S = flow @ z, flow @ S + np.einsum("ijp,j->ip", added, z)
        names, rows, rows_by = machine.guards(mode)
        event = names[which]
        events.append((start_s + done + after, event))
        new = machine.here.after(mode, event, z)
        before_rate, after_rate = machine.matrices(mode)[0] @ z, machine.matrices(new)[0] @ z
        speed = rows[which] @ before_rate
        if after > 0.0 and speed != 0.0:  # else the event is a row's own, at a fixed time
            shift = -(rows[which] @ S + z @ rows_by[which]) / speed
            S = S + np.outer(before_rate - after_rate, shift)
        for state, event_name in ((k.WW, "wheel stops"), (k.WL, "load stops")):
            if event == event_name:
                z[state] = 0.0
        mode, done = new, done + after
    raise SimulationError(f"more than {MOST_EVENTS} events within the row at {start_s:.6g} s")


def _first_event(machine: _Machine, mode: Mode, z, left: float) -> tuple[float, int] | None:
    """Time and number of the first guard that falls below zero, None where none does."""
    _, rows, _ = machine.guards(mode)
    if not len(rows):
        return None
    scale = SLIGHT * (np.abs(rows) @ (np.abs(z) + SMALLEST))
    at_start = rows @ z
    M = machine.matrices(mode)[0]
    falls = rows @ (M @ z) < -SLIGHT_RATE * (np.abs(rows) @ (np.abs(M) @ np.abs(z)))
    at_once = (at_start < -scale) | ((at_start <= scale) & falls)
    if at_once.any():
        return 0.0, int(np.argmax(at_once))
    half, _ = machine.over(mode, 0.5 * left, keep=left > 0.999 * left)
    low = 0.0
    for high, at in ((0.5 * left, rows @ half @ z), (left, rows @ half @ half @ z)):
        crossed = np.flatnonzero(at < -scale)
        if crossed.size:
            times = [_crossing(M, rows[j], z, (low, high)) for j in crossed]
            first = int(np.argmin(times))
            return float(times[first]), int(crossed[first])
        low = high
    return None


def _crossing(M: NDArray, row: NDArray, z: NDArray, between: tuple[float, float]) -> float:
    return brentq(lambda t: row @ expm(M * t) @ z, *between, xtol=1e-17, rtol=1e-15)
