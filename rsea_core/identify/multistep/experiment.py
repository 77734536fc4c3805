"""A recording ready for predictions over windows, with its command as it moves between rows.

Beside the machine's own values every hypothesis has nuisances of the experiment: the amplifier's
offset and the command's delay are values of the fit (`log_nuisances.py`), and whether the command
is held or moves linearly between rows is decided before the search (docs/diagnosis-search.md 10.2).
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.effects.gear_transmission_error import array_angle_error
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers, Replay
from rsea_core.engines.fixed_step.step_length import STEP_PER_MODE, longest_step_s
from rsea_core.errors import RecordingError
from rsea_core.identify.candidates.motion_cycles import VELOCITIES, cycle_s, motion_rate
from rsea_core.identify.candidates.rig_parameters import DAMPINGS, Nominal
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from rsea_core.identify.fitting.predictions import Windows, readings_of, run_machines
from rsea_core.identify.fitting.problem import (
    READ,
    Hypothesis,
    Problem,
    machine_of,
    require_comparable,
)
from rsea_core.identify.multistep.command_timing import (
    AS_LOGGED,
    CommandTiming,
    RowTimes,
    current_is_commanded,
    even_times,
    mean_commands,
    runs_at,
    turns_often,
)
from rsea_core.identify.multistep.criteria import FIRST_STEPS
from rsea_core.machine.command_motion import FINER, between_rows
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.initial_speed import begins_at_rest, start_speeds
from rsea_core.recordings.recording import Recording

DELAY_STEP_ROWS = 0.1
LEAST_ROWS = 30  # of a recording
LEAST_STEP_s = 1e-4  # of the engine, before it is made finer
STATED_BOUND, FREE_BOUND = 5.0, 1e4  # tolerances that a value may move
SPRING_STIFFNESS, LARGEST_RATIO = "spring_stiffness_Nm_per_rad", 10.0
"""Key of the stated stiffness, and the largest ratio of it to the stiffness of the elastic part
where a law adds stiffness: one measured at small deflections is the sum of both."""
DAMPED = 0.3  # damping that takes this share of the motion in its own time, as a scale
ANGLES = ("motor_angle_rad", "load_angle_rad")
STATE_CHANNELS = ("current_A", "motor_angle_rad", "motor_velocity_rad_per_s", "load_angle_rad",
                  "load_velocity_rad_per_s")  # fmt: skip


class EngineSteps(NamedTuple):
    """How long the engine's steps are.

    Attributes
    ----------
    per_cycle : float
        Steps in the fastest cycle, at least; there is at least one in a row.
    fineness : float
        Factor on the step that this gives, for every recording.
    parts_of_row : int
        Into which a row is cut; a command that moves linearly is held at its mean in each.
    """

    per_cycle: float = FIRST_STEPS
    fineness: float = 1.0
    parts_of_row: int = FINER


FIRST = EngineSteps()


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One recording and the runs of machines under its inputs.

    Attributes
    ----------
    finer : int
        Rows of the replay for one of the recording.
    measured : (n, p) array
    floors : mapping of column to float
        Standard deviations of single readings by counts, the rig file or neighbouring rows.
    """

    recording: Recording
    replay: Replay
    where: RunConditions
    base: Numbers
    channels: tuple[str, ...]
    measured: NDArray
    floors: Mapping[str, float]
    finer: int
    stiffness: float  # of the rig's spring
    at_rest: bool = False  # at its first row
    ahead_s: NDArray | None = None  # (n,) readings after the rows of the replay; None: at them
    windows: None = None  # predictions of a whole recording begin at its first row

    @property
    def read_twice(self) -> bool:
        """Whether two sensors read the angle of one rigid body: the motor's says where it is."""
        rigid = machine_of(self.base).structure in (mp.RIGID_FREE, mp.RIGID_HELD)
        return rigid and set(ANGLES) <= set(self.channels)

    @cached_property
    def command_change(self) -> NDArray:
        """(n,) larger of the changes of the command to the next row and from the one before."""
        r = self.recording
        step = np.zeros(self.rows + 1)
        if r.command_name is not None:
            step[1:-1] = np.abs(np.diff(r[r.command_name]))
        return np.maximum(step[1:], step[:-1])

    @property
    def rows(self) -> int:
        """Rows of the recording."""
        return len(self.measured)

    def runs(self, machines: Sequence[TrialMachine], windows: Windows | None = None) -> NDArray:
        """Runs (m, n, 7) at the recording's rows, columns `CHANNELS`; NaN where they failed."""
        if windows is not None and self.finer > 1:
            windows = self._finer(windows)
        return run_machines(self.replay, machines, self.where, windows)[:, :: self.finer]

    @property
    def floor_of_each(self) -> NDArray:
        """(p,) standard deviations of single readings."""
        return np.array([self.floors[name] for name in self.channels])

    def readings(
        self, runs: NDArray, machines: Sequence[TrialMachine], windows: Windows | None = None
    ) -> NDArray:
        """Readings (m, n, p) of runs in windows, as the machines' sensors give them."""
        if self.ahead_s is not None:
            first = () if windows is None else windows.rows[:, 0]
            rows_s = self.recording.time_s - self.ahead_s
            plant = machine_of(self.base)
            lag = plant.inductance / plant.resistance if plant.resistance > 0.0 else 0.0
            runs = runs_at(runs, self.ahead_s, rows_s, first, lag)
        found = readings_of(runs, machines, self.channels, self.where)
        if self.read_twice:
            self._in_measured_phase(found, machines)
        return found

    def _in_measured_phase(self, found: NDArray, machines: Sequence[TrialMachine]) -> None:
        """Take the error of a rigid gear train at the motor's angle as read, in readings (m, n, p).

        The error repeats with that angle. At a simulated angle that differs by half a turn of the
        motor it would have the wrong sign.
        """
        motor, load = (self.channels.index(name) for name in ANGLES)
        ratio = self.where.ratio
        for y, d in zip(found, machines, strict=True):
            read, run = (
                array_angle_error(d.fx, angle / ratio, ratio)
                for angle in (self.measured[:, motor], y[:, motor])
            )
            y[:, load] += read - run

    def states(self, run: NDArray) -> NDArray:
        """Current, wheel angle and speed, load angle and speed (n, 5) of one run (n, 7)."""
        y = np.stack([run[:, CHANNELS.index(name)] for name in STATE_CHANNELS], axis=1)
        y[:, 1:3] /= self.where.ratio
        return y

    def _finer(self, windows: Windows) -> Windows:
        n, k = self.rows, self.finer
        first = windows.rows[:, 0] * k
        last = np.append(first[1:] - 1, (n - 1) * k)
        at = np.arange((n - 1) * k + 1) / k
        motion = np.stack([np.interp(at, np.arange(n), c) for c in windows.motion.T], axis=1)
        return replace(windows, rows=np.stack([first, last], axis=1), motion=motion)


def experiment(
    model: ActuatorModel, r: Recording, where: RunConditions, *,
    timing: CommandTiming = AS_LOGGED, steps: EngineSteps = FIRST, current_commanded: bool = False,
) -> Experiment:  # fmt: skip
    """A recording under a command that is held from row to row, or moves linearly.

    Parameters
    ----------
    current_commanded : bool
        Whether a current measured beside a current command is the commanded one
        (`current_is_commanded`), and therefore predicted.
    """
    inputs = r.inputs()
    even = None if timing.rows is RowTimes.LOGGED else even_times(r.time_s)
    if even is not None:
        inputs = replace(inputs, time_s=even - even[0])
    if "motor_angle_rad" not in r and "load_angle_rad" in r:
        ratio = model.rig.gear_ratio or 1.0
        inputs = replace(inputs, initial_motor_angle_rad=ratio * r.first("load_angle_rad"))
    # the noise of one reading would deflect the spring of a locked load
    inputs = replace(inputs, initial_load_angle_rad=r.held_angle_rad())
    floors = noise_floor(model.rig, r, order=4)
    more, of_rows = {}, _columns_of_rows(r)
    if not r.initial_rest:
        speeds = start_speeds(r, model.rig.gear_ratio or 1.0, floors)
        more["initial_speeds_rad_per_s"] = tuple(each.speed for each in speeds)
    replay = Replay.of(inputs, **of_rows, **more)
    numbers = replay.numbers(model)
    cycle = cycle_s(machine_of(numbers), model.rig.spring_stiffness_Nm_per_rad or 0.0, r)
    finer, name = 1, inputs.command_name
    if timing.smooth and name is not None and turns_often(getattr(inputs, name)):
        means = mean_commands(getattr(inputs, name), timing.fast_share)
        inputs = replace(inputs, **{name: means})
    if timing.linear and r.load.kind != "imposed" and r.command_name:
        finer = steps.parts_of_row
        inputs, of_rows = between_rows(inputs, of_rows, finer)
    step = float(np.clip(cycle / steps.per_cycle, LEAST_STEP_s, r.sample_time_s))
    step = min(step, longest_step_s(numbers.plant, numbers.spring, numbers.fx) / STEP_PER_MODE)
    replay = Replay.of(inputs, step_s=steps.fineness * step, **of_rows, **more)
    channels = tuple(
        name for name in READ
        if name in r.responses and _predicted(name, r, replay, current_commanded)
    )  # fmt: skip
    channels += tuple(v for a, v in VELOCITIES.items() if v in r.responses and a not in r)
    require_comparable(r, channels)
    if r.rows < LEAST_ROWS:
        raise RecordingError(f"{r.file}: too short: {r.rows} rows, {LEAST_ROWS} are the least")
    return Experiment(
        recording=r, replay=replay, where=where, base=numbers, channels=channels,
        measured=np.stack([r[name] for name in channels], axis=1),
        floors={name: floors[name] for name in channels}, finer=finer,
        stiffness=model.rig.spring_stiffness_Nm_per_rad or 0.0, at_rest=begins_at_rest(r, floors),
        ahead_s=r.time_s - even if even is not None and timing.rows is RowTimes.READINGS else None,
    )  # fmt: skip


def _columns_of_rows(r: Recording) -> dict[str, NDArray]:
    """Columns beside the command that act on the drive: its enable signal and its supply."""
    needed = {"drive_enabled": r.command_name, "supply_V": r.command_name == "duty"}
    return {name: r[name] for name, needs in needed.items() if needs and name in r}


def _predicted(name: str, r: Recording, replay: Replay, current_commanded: bool) -> bool:
    if name == "current_A":
        of_command = r.command_name == "current_command_A" and current_commanded
        return of_command or r.command_name in ("duty", "voltage_V")
    if name == "spring_deflection_rad":
        return not replay.is_bench
    return not (name == "load_angle_rad" and r.load.kind == "imposed")


def as_logged(case: Case) -> Case:
    """The case with every column at the times of its log: nothing resampled."""
    return replace(
        case,
        recordings=tuple(
            r if r.logged is None else replace(r, columns=r.logged, logged=None)
            for r in case.recordings
        ),
    )


def _free(n: Nominal) -> bool:
    """Whether it is a damping of which the rig file says none or nothing."""
    return n.additive and n.key.endswith("viscous_Nms_per_rad")


class MultistepProblem(Problem):
    """A case's experiments and what is free in them."""

    reach = STATED_BOUND  # tolerances that a value which the rig file states may move

    def __init__(
        self, case: Case, *, timing: CommandTiming = AS_LOGGED, steps: EngineSteps = FIRST
    ):
        self.timing, self.steps = timing, steps
        case = as_logged(case)
        self.current_commanded = current_is_commanded(case)
        super().__init__(case)
        self.nominals = tuple(self._scaled(n) for n in self.nominals)

    @property
    def stated(self) -> NDArray:
        """Which nominal values the rig file states, (n,) bool; the others are free dampings."""
        return np.array([not _free(n) for n in self.nominals], bool)

    def _scaled(self, n: Nominal) -> Nominal:
        """A damping that the rig file gives as none or leaves out, free upwards in its own scale.

        That of the machine: the inertia that it slows down, over the time that the motion shows,
        and the damping that the back-EMF gives to the body that the motor moves. Where the file
        states no damping at all, the one that balances the drive's torque, if larger.
        """
        if not _free(n):
            return n
        plant, ratio = machine_of(self.fitted[0].base), self.fitted[0].where.ratio
        of_load = n.key.startswith("load")
        inertia, electric = plant.load_inertia if of_load else plant.inertia, 0.0
        inertia = inertia or plant.inertia or plant.load_inertia
        one_body = plant.structure in (mp.RIGID_FREE, mp.RIGID_HELD)
        if of_load and one_body:
            inertia = plant.inertia + plant.load_inertia
        by_volts = plant.drive in (mp.DUTY, mp.VOLTAGE) and plant.resistance > 0.0
        if by_volts and (one_body or not of_load):
            electric = plant.torque_per_ampere * plant.volts_per_speed / plant.resistance
        side = ratio**2 if n.key.startswith("motor") else 1.0
        rate = max(motion_rate(e.recording) for e in self.fitted)
        scale = max(DAMPED * (inertia * rate + electric), self._damping_of_drive())
        return replace(n, tolerance=scale / side)

    def _damping_of_drive(self) -> float:
        """Damping at the output that balances the drive's torque at the usual speed.

        0 where the rig file states a damping above zero, or nothing drives the machine. A file
        whose dampings are all zero describes a model without damping, not a measurement: its
        dampings have the same prior as omitted ones.
        """
        rig = self.case.rig
        stated = any(getattr(rig, key) for key in DAMPINGS)
        if stated or all(r.command_name is None for r in self.case.identification):
            return 0.0
        usual = own_magnitudes(self.case)
        return usual.motor_torque_Nm * (rig.gear_ratio or 1.0) / usual.speed_rad_per_s

    def bounds(self, hypothesis: Hypothesis) -> tuple[NDArray, NDArray]:
        """Lowest and highest unknowns: what is stated stays near, no damping below zero.

        A stated stiffness may include that of a law which adds stiffness (`LARGEST_RATIO`).
        """
        low, high = super().bounds(hypothesis)
        stiffens = any(getattr(law.kind, "adds_stiffness", False) for law in hypothesis.laws)
        for j, n in enumerate(self.nominals):
            low[j], high[j] = (0.0, FREE_BOUND) if _free(n) else (-self.reach, self.reach)
            if stiffens and n.key == SPRING_STIFFNESS:
                low[j] = min(low[j], -np.log(LARGEST_RATIO) / n.tolerance)
        return low, high

    def within(self, tolerances: float) -> "MultistepProblem":
        """The same problem, the rig file's values held to so many of their tolerances."""
        found = copy(self)
        found.reach = tolerances
        return found

    def trial_machine(self, e: Experiment, hypothesis: Hypothesis, x: NDArray) -> TrialMachine:
        """A machine's numbers; starts are the motor sensor's where two read one body."""
        machine = super().trial_machine(e, hypothesis, x)
        if e.read_twice:
            machine.start_load_scale, machine.start_load_rad = 1.0, 0.0
        return machine

    def predict(self, e: Experiment, hypothesis: Hypothesis, X: NDArray) -> NDArray:
        """Readings (m, n, p) of whole runs of a recording for unknowns (m, u)."""
        machines = [self.trial_machine(e, hypothesis, x) for x in X]
        return e.readings(e.runs(machines, None), machines)

    def _prepared(self, r: Recording, where: RunConditions) -> Experiment:
        return experiment(
            self.model, r, where, timing=self.timing, steps=self.steps,
            current_commanded=self.current_commanded,
        )  # fmt: skip
