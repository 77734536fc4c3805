"""A controller on a machine over given rows, by either event-driven engine."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.integrator as integrator
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.kernel as pk
import rsea_core.machine.plant as mp
import rsea_core.machine.quantities as q
from rsea_core.effects.sensor_reading import controller_sensors
from rsea_core.engines.event_driven.energy_balance import energy_ledger, internal_signals
from rsea_core.engines.event_driven.energy_ledger import EnergyLedger
from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.engines.linear.linearise import fastest_per_s, step_length_s
from rsea_core.engines.piecewise_linear.machine import LinearMachine, obstacle_of, require_done
from rsea_core.engines.piecewise_linear.run import NOT_HERE, Runner, rows_of
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import SpringTable
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.simulation.trajectory import EVENT_DRIVEN, PIECEWISE_LINEAR, Trajectory

MAX_STEPS = 2_000_000_000
TIMES = ("current_limited_s", "contact_s", "wheel_stuck_s", "load_stuck_s")
BEHIND = {
    k.TB: "wheel_angle_rad",
    k.WB: "wheel_velocity_rad_per_s",
    k.TO: "link_angle_rad",
    k.WO: "link_velocity_rad_per_s",
}


class MachineNumbers(NamedTuple):
    """What all runs of a model with one command and load have in common.

    Attributes
    ----------
    plant, spring, fx
        As `ActuatorModel.plant`, `spring_table`, `effects`.
    fastest_per_s : float
        See `linearise.fastest_per_s`.
    longest_s : float
        The step that it allows.
    obstacle : str or None
        Why the piecewise linear engine cannot run this, None where it can.
    linear : LinearMachine or None
        Then for that engine.
    """

    plant: mp.Plant
    spring: SpringTable
    fx: NDArray
    fastest_per_s: float
    longest_s: float
    obstacle: str | None
    linear: LinearMachine | None

    @classmethod
    def of(cls, model: ActuatorModel, command_name: str | None, load: Load) -> "MachineNumbers":
        """Computed once and kept with the model, which does not change.

        Not kept where a user's effect acts: it may have another compiled function in the next run.

        Raises
        ------
        InputError
            If the model is none.
        """
        if not isinstance(model, ActuatorModel):
            raise InputError(
                f"{type(model).__name__} cannot be simulated: give an ActuatorModel, as a"
                " diagnosis' actuator_model() or read_model makes it"
            )
        key = ("sampled run", command_name, load)
        if key not in model.kept:
            plant = model.plant(command_name, load)
            spring, fx = model.spring_table(load), model.effects(command_name, load)
            obstacle = obstacle_of(plant, spring.regions, fx)
            linear = LinearMachine.of(plant, spring.regions, fx) if obstacle is None else None
            fastest = fastest_per_s(plant, spring, fx)
            longest = step_length_s(plant, fastest, None)
            made = cls(plant, spring, fx, fastest, longest, obstacle, linear)
            if fx[e.OUTSIDE] != 0.0:
                return made
            model.kept[key] = made
        return model.kept[key]


@dataclass(frozen=True, kw_only=True)
class SampledRun:
    """What is run: a machine, its controller, and the rows.

    Attributes
    ----------
    controller : compiled function of the signature `states.CONTROLLER`
    parameters, state : arrays
    reference : (n, 3) array
        What the controller is given each row, with its first two time derivatives.
    held : ((n,), (n,)) arrays or None
        Angle and speed of a load whose motion is given.
    initial_angles_rad : (float, float)
        Motor, on its own side, and load.
    rows_per_sample : int
        Rows between two actions of the controller; its command is held in between.
    delay_samples : int
        0, or 1 where a command acts one sample after the readings it was computed from.
    step_s : float or None
        Longest step of the event-driven engine, which runs where it is given.
    reference_name : str or None
        Column under which the trajectory keeps the reference; None: it does not.
    """

    model: ActuatorModel
    command_name: str | None
    load: Load
    time_s: NDArray
    controller: Any
    parameters: NDArray
    state: NDArray
    reference: NDArray
    held: tuple[NDArray, NDArray] | None
    initial_angles_rad: tuple[float, float] = (0.0, 0.0)
    rows_per_sample: int = 1
    delay_samples: int = 0
    command_limit: float = np.inf
    step_s: float | None = None
    reference_name: str | None = None

    @cached_property
    def numbers(self) -> MachineNumbers:
        """Plant, spring and effects, and what follows from them."""
        return MachineNumbers.of(self.model, self.command_name, self.load)

    def not_exact(self) -> str | None:
        """Why the piecewise linear engine cannot run this, None where it can."""
        return self.numbers.obstacle if self.step_s is None else "a step length was given"

    def trajectory(
        self,
        time_s: NDArray,
        columns: dict[str, NDArray],
        engine: str,
        reason: str | None,
        ledger: EnergyLedger | Callable[[], EnergyLedger],
    ) -> Trajectory:
        """The result, by its times, which it keeps, and its columns from the wheel on."""
        spring, followed = self.numbers.spring, None
        if self.reference_name is not None:
            followed = read_only(np.array(self.reference[:, 0]))
        return Trajectory(
            model=self.model,
            load=self.load,
            command_name=self.command_name,
            reference=followed,
            reference_name=self.reference_name,
            time_s=read_only(time_s),
            **columns,
            engine=engine,
            engine_reason=reason,
            ledger=ledger,
            spring_valid_range_rad=(spring.valid_low_rad, spring.valid_high_rad),
        )


def solve(run: SampledRun, engine: str | None) -> Trajectory:
    """Run by the piecewise linear engine where it can, else by the event-driven one.

    Raises
    ------
    InputError, SimulationError
        As `simulate.simulate`.
    """
    if engine not in (None, PIECEWISE_LINEAR, EVENT_DRIVEN):
        raise InputError(f"engine = {engine!r} must be {PIECEWISE_LINEAR!r} or {EVENT_DRIVEN!r}")
    longest = run.numbers.longest_s
    if run.step_s is not None:
        longest = step_length_s(run.numbers.plant, run.numbers.fastest_per_s, run.step_s)
    reason = "it was asked for" if engine == EVENT_DRIVEN else run.not_exact()
    if reason is None:
        found = _piecewise_linear(run)
        if not isinstance(found, str):
            return found
        reason = found
    if engine == PIECEWISE_LINEAR:
        raise SimulationError(f"the piecewise linear engine cannot run this: {reason}")
    return _event_driven(run, longest, reason)


def _piecewise_linear(run: SampledRun) -> Trajectory | str:
    """By exact exponentials, or why the rows do not allow it."""
    plant, machine, time = run.numbers.plant, run.numbers.linear, np.array(run.time_s, float)
    rows = rows_of(
        machine,
        time,
        run.reference,
        controller_sensors(run.model.terms, time.size),
        start_rad=run.initial_angles_rad,
        held=run.held,
        rows_per_sample=run.rows_per_sample,
        delay_samples=run.delay_samples,
        command_limit=run.command_limit,
    )
    runner = Runner(machine, rows)
    status, row = runner.run(rows, run.controller, run.parameters, run.state)
    if status in NOT_HERE:
        return NOT_HERE[status]
    require_done(status, float(run.time_s[row]))
    log = read_only(runner.log)
    columns = _signals(plant, log, pk.LOG_TORQUE, pk.LOG_COMMAND, pk.LOG_UNSATURATED)
    for part, sensed, count in (
        ("motor", pk.LOG_READ_MOTOR, plant.motor_count),
        ("load", pk.LOG_READ_LOAD, plant.load_count),
    ):
        angle, read = columns[f"{part}_angle_rad"], log[sensed]
        if rows.sensors.numbers.shape[0] == 0:
            read = read_only(np.floor(angle / count) * count) if count > 0.0 else angle
        columns[f"encoder_{part}_angle_rad"] = read
    never = read_only(np.zeros(time.size))
    columns |= {
        name: log[pk.LOG_TIMES + j] if machine.timed[j] else never for j, name in enumerate(TIMES)
    }
    columns |= {BEHIND[at]: log[pk.N_LOG + j] for j, at in enumerate(machine.behind)}
    ledger = partial(_played_back_ledger, run, columns["command"])
    return run.trajectory(time, columns, PIECEWISE_LINEAR, None, ledger)


def _played_back_ledger(run: SampledRun, command: NDArray) -> EnergyLedger:
    """The energies of a run whose commands are known, by the event-driven engine."""
    reference = np.zeros((command.size, 3))
    reference[:, 0] = command
    known = replace(
        run, controller=playback(), parameters=np.zeros(1), state=np.zeros(1),
        reference=reference, rows_per_sample=1, delay_samples=0, command_limit=np.inf,
    )  # fmt: skip
    plant, spring, fx = run.numbers[:3]
    log, internal = _integrated(known, run.numbers.longest_s)
    return energy_ledger(plant, spring, fx, log, internal)


def _event_driven(run: SampledRun, longest_s: float, reason: str) -> Trajectory:
    """By steps of order 8 and located events."""
    plant, spring, fx = run.numbers[:3]
    log, internal = _integrated(run, longest_s)
    columns = _signals(plant, log.T, k.LOG_TORQUE, k.LOG_COMMAND, k.LOG_UNSATURATED)
    columns |= {
        "encoder_motor_angle_rad": _column(log, k.LOG_READ_MOTOR),
        "encoder_load_angle_rad": _column(log, k.LOG_READ_LOAD),
        "current_limited_s": _column(log, k.LOG_INTEGRALS + k.LIMITED_TIME),
        "contact_s": _column(log, k.LOG_INTEGRALS + k.CONTACT_TIME),
        "wheel_stuck_s": _column(log, k.LOG_INTEGRALS + k.WHEEL_STUCK_TIME),
        "load_stuck_s": _column(log, k.LOG_INTEGRALS + k.LOAD_STUCK_TIME),
    }
    columns |= internal_signals(fx, internal, run.model.terms)
    ledger = energy_ledger(plant, spring, fx, log, internal)
    return run.trajectory(np.array(run.time_s), columns, EVENT_DRIVEN, reason, ledger)


def _integrated(run: SampledRun, longest_s: float) -> tuple[NDArray, NDArray]:
    """Log (n, N_LOG) and memory ((n or 0), N_Y) of the event-driven engine."""
    plant, spring, fx = run.numbers[:3]
    n = run.time_s.size
    held = run.held
    if held is None:
        held = np.full(n, run.initial_angles_rad[1]), np.zeros(n)
    schedule = integrator.Schedule(
        time=np.array(run.time_s),
        steps=_steps(run.time_s, longest_s),
        reference=np.ascontiguousarray(run.reference),
        load_angle=held[0],
        load_velocity=held[1],
        rows_per_sample=run.rows_per_sample,
        delay_samples=run.delay_samples,
        command_limit=float(run.command_limit),
    )
    y = np.zeros(k.N_Y)
    wheel = q.motion_to_output(run.initial_angles_rad[0], plant.gear_ratio)
    y[k.TW], y[k.TL] = wheel, held[0][0]
    log = np.zeros((n, k.N_LOG))
    internal = np.zeros((n if fx[e.INTERNAL_STATES] != 0.0 else 0, k.N_Y))
    control = integrator.Control(np.array(run.parameters), np.array(run.state))
    record = integrator.Record(y, log, internal)
    status, row = integrator.run(
        plant, spring.regions, fx, run.controller, control, schedule,
        controller_sensors(run.model.terms, n), record,
    )  # fmt: skip
    _require_done(status, float(run.time_s[row]))
    return log, internal


def _column(log: NDArray, index: int) -> NDArray:
    return read_only(np.ascontiguousarray(log[:, index]))


def _signals(
    plant: mp.Plant, log: NDArray, torque: int, command: int, unsaturated: int
) -> dict[str, NDArray]:
    """Columns that both engines log; the rows of `log` are signals."""

    def row(index: int) -> NDArray:
        return read_only(np.ascontiguousarray(log[index]))

    wheel, speed = row(k.TW), row(k.WW)
    return {
        "command": row(command),
        "unsaturated_command": row(unsaturated),
        "motor_angle_rad": read_only(q.motion_to_motor(wheel, plant.gear_ratio)),
        "motor_velocity_rad_per_s": read_only(q.motion_to_motor(speed, plant.gear_ratio)),
        "load_angle_rad": row(k.TL),
        "load_velocity_rad_per_s": row(k.WL),
        "current_A": row(k.IM) if plant.drive != mp.POSITION else read_only(0.0 * wheel),
        "torque_Nm": row(torque),
        "wheel_angle_rad": wheel,
        "wheel_velocity_rad_per_s": speed,
    }


def _steps(time_s: NDArray, longest_s: float) -> NDArray:
    """Integration steps within each row."""
    steps = np.maximum(np.ceil(np.diff(time_s) / longest_s - 1e-9), 1.0)
    if steps.sum() > MAX_STEPS:
        raise InputError(
            f"{steps.sum():.3g} integration steps of {longest_s:.3g} s are more than"
            f" {MAX_STEPS:.0e}: shorten the simulation or leave the fastest mode out of the rig"
        )
    return steps.astype(np.int64)


def _require_done(status: int, time_s: float) -> None:
    if status == integrator.NOT_FINITE:
        raise SimulationError(
            f"the states left the range of numbers at t = {time_s:.6g} s: is the loop unstable,"
            " or a value out by orders of magnitude?"
        )
    if status == integrator.TOO_MANY_EVENTS:
        raise SimulationError(
            f"more than {integrator.MAX_EVENTS_PER_ROW} switches of current limit, contact or"
            f" friction within the row at t = {time_s:.6g} s: shorten the rows or soften the"
            " contact"
        )
