"""Open-loop replays of a recording's inputs by the fast engine, one or thousands.

A `Replay` is prepared once per recording. It then runs models, or bare numbers where a fit
changes them, over all rows or over windows that start anywhere:

    replay = Replay.of(Inputs(time_s=t, duty=u, load=Load(kind="pendulum")))
    rows = replay.run(model)                          # (n, 7) array, columns CHANNELS
    rows = replay.run_many([numbers_1, numbers_2])    # (2, n, 7), in parallel
    states = replay.warm(numbers, ...)                # (n, 21) full states along a given motion
    rows = replay.run_windows([numbers], [(0, 500), (500, 1000)], states[[0, 500]])
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.engines.fixed_step.rows as rows
import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.body_moves import (
    LINK_SPEED,
    LOAD_SPEED,
    N_STEP_STATES,
    OUTPUT_SPEED,
    STATE_NAMES,
    WHEEL_SPEED,
)
from rsea_core.engines.fixed_step.compile_kernel import DONE, engine
from rsea_core.engines.fixed_step.packed_models import (
    Grid,
    Numbers,
    Packed,
    bench_numbers,
    model_numbers,
)
from rsea_core.engines.fixed_step.replay_inputs import column, known_command, start_states
from rsea_core.engines.fixed_step.step_inputs import CHANNELS, N_CHANNELS
from rsea_core.engines.fixed_step.windows import Plan, cover, covering, windows_of
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.threads import share_out

__all__ = ("CHANNELS", "STATE_NAMES", "Numbers", "Replay")

GEAR_RATIO = mp.Plant._fields.index("gear_ratio")
WHEEL_SPEEDS = [WHEEL_SPEED, OUTPUT_SPEED]
LOAD_SPEEDS = [LOAD_SPEED, LINK_SPEED]


class Replay:
    """The inputs of one recording, ready for the fast engine.

    Parameters
    ----------
    time_s : (n,) array
        Increasing; rows need not be even.
    command_name : str or None
        "duty", "voltage_V", "current_command_A", "motor_torque_Nm"; None without a drive.
    command : (n,) array or None
        Held from each row to the next.
    load : Load
    load_angle_rad : (n,) array or None
        Motion of an imposed load: a cubic between rows through central differences.
    spring_deflection_rad : (n,) array or None
        A spring bench: the deflection is given and `torque_Nm` is the response; `load` and
        `command` are left out.
    supply_V : (n,) array or None
        Measured supply, in place of the rig's where the command is a duty.
    drive_enabled : (n,) array or None
        1, or 0 while the bridge is open and no current flows.
    initial_angles_rad : (float, float)
        Motor and load angle at the start; a locked load stays at its own.
    initial_speeds_rad_per_s : (float, float)
        Motor and load speed at the start; a held load has none of its own.
    step_s : float or None
        Longest step; None takes `step_size.DEFAULT_STEP_s` or less where a fast mode needs it
        (then the largest number of steps that the models of a call need).

    Raises
    ------
    InputError
        If a column has another length than the time, or is not finite.
    """

    def __init__(
        self,
        *,
        time_s: ArrayLike,
        command_name: str | None = None,
        command: ArrayLike | None = None,
        load: Load = Load(),  # noqa: B008
        load_angle_rad: ArrayLike | None = None,
        spring_deflection_rad: ArrayLike | None = None,
        supply_V: ArrayLike | None = None,
        drive_enabled: ArrayLike | None = None,
        initial_angles_rad: tuple[float, float] = (0.0, 0.0),
        initial_speeds_rad_per_s: tuple[float, float] = (0.0, 0.0),
        step_s: float | None = None,
    ):
        self.is_bench = spring_deflection_rad is not None
        if self.is_bench:
            if command_name is not None or load_angle_rad is not None:
                raise InputError("spring_deflection_rad is given alone: no command, no load angle")
            load = Load(kind="locked")
        if (command_name is None) != (command is None):
            raise InputError("give command_name and command together")
        self._inputs = Inputs(
            time_s=time_s,
            load=load,
            load_angle_rad=load_angle_rad,
            initial_motor_angle_rad=initial_angles_rad[0],
            initial_load_angle_rad=initial_angles_rad[1],
            **({} if command_name is None else {known_command(command_name): command}),
        )
        self.load, self.command_name = load, command_name
        if not np.all(np.isfinite(initial_speeds_rad_per_s)):
            raise InputError(f"initial speeds {initial_speeds_rad_per_s} must be finite")
        self._speeds = initial_speeds_rad_per_s
        self.time_s = self._inputs.time_s
        n, empty = self.time_s.size, np.zeros(0)
        self._grid = Grid(self.time_s, step_s)
        supply = column("supply_V", supply_V, n)
        if supply.size and command_name != "duty":
            raise InputError("supply_V acts on a drive by duty only")
        wheel = column("spring_deflection_rad", spring_deflection_rad, n)
        held = column("load_angle_rad", load_angle_rad, n)
        if self.is_bench:
            held = np.zeros(n)
        self._columns = rows.Columns(
            time=np.array(self.time_s),
            steps=np.ones(n, np.int64),
            command=np.zeros(n) if command is None else np.array(command, dtype=float),
            supply=supply,
            enabled=column("drive_enabled", drive_enabled, n),
            load_angle=held,
            load_speed=self._rate(held),
            wheel_angle=wheel,
            wheel_speed=self._rate(wheel) if wheel.size else empty,
        )

    @classmethod
    def of(cls, inputs: Inputs, **more) -> "Replay":
        """The replay of an `Inputs`; `more` are what they do not hold."""
        name = inputs.command_name
        return cls(
            time_s=inputs.time_s,
            command_name=name,
            command=None if name is None else getattr(inputs, name),
            load=inputs.load,
            load_angle_rad=inputs.load_angle_rad,
            initial_angles_rad=(inputs.initial_motor_angle_rad, inputs.initial_load_angle_rad),
            **more,
        )

    @property
    def rows(self) -> int:
        """How many rows the recording has."""
        return self.time_s.size

    def numbers(self, model: ActuatorModel) -> Numbers:
        """What the engine reads of a model under this recording's command and load.

        Raises
        ------
        RigError, TermError, InputError
            As `ActuatorModel.plant` and `ActuatorModel.effects`.
        """
        if self.is_bench:
            return bench_numbers(model, self.load)
        return model_numbers(model, self.command_name, self.load)

    def start_state(self, numbers: Numbers | ActuatorModel) -> NDArray:
        """The full state (N_STEP_STATES,) of the machine at its initial angles and speeds."""
        return self.start_states([numbers])[0]

    def start_states(self, numbers: Sequence[Numbers | ActuatorModel]) -> NDArray:
        """The full states (m, N_STEP_STATES) of machines at their initial angles and speeds."""
        return self._starts(Packed([self._as_numbers(each) for each in numbers]))

    def run(
        self,
        numbers: Numbers | ActuatorModel,
        *,
        start: NDArray | None = None,
        with_states: bool = False,
    ) -> NDArray | tuple[NDArray, NDArray]:
        """One model over all rows.

        Parameters
        ----------
        start : (N_STEP_STATES,) array or None
            Full state at the first row (`STATE_NAMES`); None: `start_state`.
        with_states : bool
            Also return the full states by row, from any of which a window can start.

        Returns
        -------
        (n, 7) array, columns CHANNELS, and (n, N_STEP_STATES) with `with_states`. Row k is
        read at time_s[k], before row k's command acts; `case_rise_K` is above ambient.

        Raises
        ------
        SimulationError
            If the states leave the range of numbers.
        """
        packed = Packed([self._as_numbers(numbers)])
        starts = self._starts(packed) if start is None else start_states(start, (1,))
        jobs = np.array([[0, 0, self.rows - 1, 0]])
        out, states = self._run(packed, jobs, starts, with_states, parallel=False)
        return (out, states) if with_states else out

    def run_many(
        self,
        numbers: Sequence[Numbers | ActuatorModel],
        *,
        starts: NDArray | None = None,
        failures: str = "raise",
    ) -> NDArray:
        """Many models over all rows, in parallel over models; the same to the bit on any
        number of threads.

        Parameters
        ----------
        starts : (m, N_STEP_STATES) array or None
        failures : str
            "raise", or "nan": rows from a failure on are NaN and nothing is raised.

        Returns
        -------
        (m, n, 7) array

        Raises
        ------
        SimulationError
            Naming the first model whose states leave the range of numbers.
        """
        packed = Packed([self._as_numbers(each) for each in numbers])
        m = len(packed.plants)
        starts = self._starts(packed) if starts is None else start_states(starts, (m,))
        jobs = cover(m, np.array([[0], [self.rows - 1]]), self.rows)
        out, _ = self._run(packed, jobs, starts, False, parallel=m > 1, failures=failures)
        return out.reshape(m, self.rows, N_CHANNELS)

    def run_windows(
        self,
        numbers: Sequence[Numbers | ActuatorModel],
        windows: ArrayLike,
        starts: NDArray,
        *,
        failures: str = "raise",
        parallel: bool = True,
    ) -> list[NDArray]:
        """Windows of the recording for many models, each from its own start state, in parallel.

        Parameters
        ----------
        windows : (w, 2) array of int
            First and last row (included) of each.
        starts : (w, N_STEP_STATES) or (m, w, N_STEP_STATES) array
            Full state at each window's first row, the same for all models or of each.
        failures : str
            As `run_many`.

        Returns
        -------
        list of w arrays (m, rows of the window, 7)

        Raises
        ------
        InputError
            If a window is not within the recording or a start has another shape.
        SimulationError
            As `run_many`.
        """
        packed = Packed([self._as_numbers(each) for each in numbers])
        m, (first, last) = len(packed.plants), windows_of(windows, self.rows)
        starts = np.asarray(starts, dtype=float)
        if starts.ndim == 2:
            starts = np.broadcast_to(starts, (m, *starts.shape))
        starts = start_states(starts, (m, first.size))
        lengths = np.repeat(last - first + 1, m)
        offsets = np.concatenate(([0], np.cumsum(lengths)))
        model = np.tile(np.arange(m), first.size)
        jobs = np.stack([model, np.repeat(first, m), np.repeat(last, m), offsets[:-1]], axis=1)
        ordered = np.ascontiguousarray(starts.transpose(1, 0, 2)).reshape(-1, N_STEP_STATES)
        out, _ = self._run(packed, jobs, ordered, False, parallel=parallel, failures=failures)
        return [
            out[offsets[w * m] : offsets[(w + 1) * m]].reshape(m, -1, N_CHANNELS)
            for w in range(first.size)
        ]

    def run_cover(
        self,
        numbers: Sequence[Numbers | ActuatorModel],
        windows: ArrayLike,
        starts: NDArray,
        *,
        failures: str = "raise",
    ) -> NDArray:
        """As `run_windows` for windows that cover all rows side by side, as one array.

        Parameters
        ----------
        starts : (m, w, N_STEP_STATES) array

        Returns
        -------
        (m, n, 7) array

        Raises
        ------
        InputError
            As `run_windows`, and if a row is left out or covered twice.
        SimulationError
            As `run_many`.
        """
        packed = Packed([self._as_numbers(each) for each in numbers])
        m, ends = len(packed.plants), covering(windows, self.rows)
        states = start_states(starts, (m, ends.shape[1])).reshape(-1, N_STEP_STATES)
        jobs = cover(m, ends, self.rows)
        out, _ = self._run(packed, jobs, states, False, parallel=True, failures=failures)
        return out.reshape(m, self.rows, N_CHANNELS)

    def plan(self, numbers: Sequence[Numbers], windows: ArrayLike | None, starts: NDArray) -> Plan:
        """What `run_many` or, with windows, `run_cover` would run, for compiled code to run.

        Parameters
        ----------
        starts : (m, N_STEP_STATES) or (m, w, N_STEP_STATES) array

        Raises
        ------
        InputError
            As `run_cover`.
        """
        packed, m = Packed(numbers), len(numbers)
        whole = np.array([[0, self.rows - 1]])
        ends = covering(whole if windows is None else windows, self.rows)
        states = start_states(starts, (m,) if windows is None else (m, ends.shape[1]))
        jobs = cover(m, ends, self.rows)
        jobs[:, 3] = jobs[:, 1]
        return Plan(
            packed.plants, packed.springs, packed.ends, packed.fx,
            self._columns._replace(steps=self._grid.steps(packed)), jobs,
            states.reshape(-1, N_STEP_STATES), np.empty(len(jobs), np.int64),
        )  # fmt: skip

    def warm(
        self,
        numbers: Numbers | ActuatorModel,
        *,
        wheel_angle_rad: ArrayLike,
        load_angle_rad: ArrayLike,
        wheel_velocity_rad_per_s: ArrayLike,
        load_velocity_rad_per_s: ArrayLike,
        current_A: ArrayLike | None = None,
        start: NDArray | None = None,
    ) -> NDArray:
        """Full states along a given (smoothed) motion, for windows to start from.

        What the motion does not show - spring memory, presliding, play, temperatures - is
        carried along it by the model's laws.

        Returns
        -------
        (n, N_STEP_STATES) array
        """
        bare = self._as_numbers(numbers)
        none = np.zeros(self.rows)
        given = (current_A, wheel_angle_rad, wheel_velocity_rad_per_s, load_angle_rad)
        given = (*given, load_velocity_rad_per_s)
        names = STATE_NAMES[:5]
        path = [
            none if values is None else column(name, values, self.rows)
            for name, values in zip(names, given, strict=True)
        ]
        starts = None if start is None else start_states(start, (1,))
        return self.warm_at([bare], np.stack(path, axis=1), np.arange(self.rows), starts)[0]

    def warm_at(
        self,
        numbers: Sequence[Numbers],
        path: NDArray,
        kept: NDArray,
        starts: NDArray | None = None,
    ) -> NDArray:
        """As `warm` of many models, in parallel, at some rows only.

        Parameters
        ----------
        path : (n, 5) array
            Current, wheel angle and speed, load angle and speed.
        kept : (w,) array of int
            Rows, increasing.
        starts : (m, N_STEP_STATES) array or None

        Returns
        -------
        (m, w, N_STEP_STATES) array
        """
        packed = Packed(numbers)
        starts = self._starts(packed) if starts is None else starts
        kept = np.asarray(kept, dtype=np.int64)
        states = np.empty((len(numbers), kept.size, N_STEP_STATES))
        given = packed.plants, packed.fx, self._columns.time, np.ascontiguousarray(path), kept

        def run(begin: int, end: int) -> None:
            rows.warm(*given, starts, states, begin, end)

        share_out(run, len(numbers))
        return states

    def _as_numbers(self, given: Numbers | ActuatorModel) -> Numbers:
        return given if isinstance(given, Numbers) else self.numbers(given)

    def _starts(self, packed: Packed) -> NDArray:
        starts = np.empty((len(packed.plants), N_STEP_STATES))
        angles = self._inputs.initial_motor_angle_rad, self._inputs.initial_load_angle_rad
        rows.starts_at_rest(packed.plants, packed.fx, angles[0], angles[1], starts)
        motor, load = self._speeds
        if motor != 0.0:
            starts[:, WHEEL_SPEEDS] = motor / packed.plants[:, [GEAR_RATIO]]
        if load != 0.0 and not self.load.is_held:
            starts[:, LOAD_SPEEDS] = load
        return starts

    def _rate(self, angle: NDArray) -> NDArray:
        if angle.size == 0:
            return angle
        return np.gradient(angle, self.time_s, edge_order=2 if angle.size > 2 else 1)

    def _run(self, packed, jobs, starts, with_states, *, parallel, failures="raise"):
        if failures not in ("raise", "nan"):
            raise InputError(f'failures = {failures!r} must be "raise" or "nan"')
        total = int(jobs[-1, 3] + jobs[-1, 2] - jobs[-1, 1] + 1)
        out = np.empty((total, N_CHANNELS))
        states = np.empty((total if with_states else 0, N_STEP_STATES))
        status = np.empty(len(jobs), np.int64)
        columns = self._columns._replace(steps=self._grid.steps(packed))
        plain, full = engine(False), engine(True)

        def run(begin: int, end: int) -> None:
            rows.run_jobs(
                plain, full, packed.plants, packed.springs, packed.ends, packed.fx, columns, jobs,
                starts, out, states, status, rows.no_controller, begin, end,
            )  # fmt: skip

        share_out(run, len(jobs), parallel=parallel)
        if failures == "raise" and np.any(status != DONE):
            job = int(np.argmax(status != DONE))
            raise SimulationError(
                f"model {jobs[job, 0]}: the states left the range of numbers at"
                f" t = {self.time_s[status[job]]:.6g} s: is a value out by orders of magnitude?"
            )
        return out, states
