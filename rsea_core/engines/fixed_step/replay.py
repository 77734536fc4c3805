"""Open-loop replays of a recording's inputs by the fixed-step engine, one or thousands.

A `Replay` is prepared once per recording. It then runs models, or bare numbers where a fit
changes them, over all rows or over windows that start anywhere:

    replay = Replay.of(Inputs(time_s=t, duty=u, load=Load(kind="pendulum")))
    rows = replay.run(model)                          # (n, 7) array, columns CHANNELS
    rows = replay.run_many([numbers_1, numbers_2])    # (2, n, 7), in parallel
    states = replay.warm(numbers, ...)                # (n, 23) full states along a given motion
    rows = replay.run_windows([numbers], [(0, 500), (500, 1000)], states[[0, 500]])
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.engines.fixed_step.rows as rows
from rsea_core.engines.fixed_step.kernel import engine
from rsea_core.engines.fixed_step.layout import (
    CHANNELS,
    DONE,
    N_CHANNELS,
    N_STEP_STATES,
    STATE_NAMES,
    Columns,
    Models,
    Record,
)
from rsea_core.engines.fixed_step.packed_models import Numbers, packed_models
from rsea_core.engines.fixed_step.replay_inputs import (
    ReplayInputs,
    column,
    cover,
    covering,
    start_states,
    windows_of,
)
from rsea_core.errors import InputError, SimulationError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.threads import share_out

__all__ = ("CHANNELS", "STATE_NAMES", "Numbers", "Replay")


class Plan(NamedTuple):
    """Runs of m models that compiled code may start, w jobs each, model by model.

    Arguments of `rows.run_jobs`; each job writes at its own first row, so that every model can
    have one array of all rows.
    """

    models: Models
    columns: Columns
    jobs: rows.Jobs  # m w of them


class Replay(ReplayInputs):
    """The inputs of one recording and the runs of machines under them.

    Takes what `ReplayInputs` takes.
    """

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
        models = self._packed([numbers])
        starts = self.at_rest(models) if start is None else start_states(start, (1,))
        jobs = np.array([[0, 0, self.rows - 1, 0]])
        out, states = _run(self, models, jobs, starts, with_states, parallel=False)
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
        models = self._packed(numbers)
        m = len(models.plants)
        starts = self.at_rest(models) if starts is None else start_states(starts, (m,))
        jobs = cover(m, np.array([[0], [self.rows - 1]]), self.rows)
        out, _ = _run(self, models, jobs, starts, False, parallel=m > 1, failures=failures)
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
        models = self._packed(numbers)
        m, (first, last) = len(models.plants), windows_of(windows, self.rows)
        starts = np.asarray(starts, dtype=float)
        if starts.ndim == 2:
            starts = np.broadcast_to(starts, (m, *starts.shape))
        starts = start_states(starts, (m, first.size))
        lengths = np.repeat(last - first + 1, m)
        offsets = np.concatenate(([0], np.cumsum(lengths)))
        model = np.tile(np.arange(m), first.size)
        jobs = np.stack([model, np.repeat(first, m), np.repeat(last, m), offsets[:-1]], axis=1)
        ordered = np.ascontiguousarray(starts.transpose(1, 0, 2)).reshape(-1, N_STEP_STATES)
        out, _ = _run(self, models, jobs, ordered, False, parallel=parallel, failures=failures)
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
        models = self._packed(numbers)
        m, ends = len(models.plants), covering(windows, self.rows)
        states = start_states(starts, (m, ends.shape[1])).reshape(-1, N_STEP_STATES)
        jobs = cover(m, ends, self.rows)
        out, _ = _run(self, models, jobs, states, False, parallel=True, failures=failures)
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
        models, m = packed_models(numbers), len(numbers)
        whole = np.array([[0, self.rows - 1]])
        ends = covering(whole if windows is None else windows, self.rows)
        states = start_states(starts, (m,) if windows is None else (m, ends.shape[1]))
        jobs = cover(m, ends, self.rows)
        jobs[:, 3] = jobs[:, 1]
        starts, status = states.reshape(-1, N_STEP_STATES), np.empty(len(jobs), np.int64)
        columns = self.columns._replace(steps=self.grid.steps(models))
        return Plan(models, columns, rows.Jobs(jobs, starts, status))

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

        What the motion does not show - spring memory, presliding, backlash, temperatures - is
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
            Current, gear angle and speed, load angle and speed.
        kept : (w,) array of int
            Rows, increasing.
        starts : (m, N_STEP_STATES) array or None

        Returns
        -------
        (m, w, N_STEP_STATES) array
        """
        models = packed_models(numbers)
        starts = self.at_rest(models) if starts is None else starts
        kept = np.asarray(kept, dtype=np.int64)
        states = np.empty((len(numbers), kept.size, N_STEP_STATES))
        given = rows.Path(self.columns.time, np.ascontiguousarray(path), kept)

        def run(begin: int, end: int) -> None:
            rows.warm(models, given, starts, states, begin, end)

        share_out(run, len(numbers))
        return states


def _run(
    given: ReplayInputs, models: Models, jobs: NDArray, starts: NDArray, with_states: bool, *,
    parallel: bool, failures: str = "raise",
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """Readings (rows of all jobs, N_CHANNELS) and, if asked for, states of jobs (n, 4)."""
    if failures not in ("raise", "nan"):
        raise InputError(f'failures = {failures!r} must be "raise" or "nan"')
    total = int(jobs[-1, 3] + jobs[-1, 2] - jobs[-1, 1] + 1)
    out = np.empty((total, N_CHANNELS))
    states = np.empty((total if with_states else 0, N_STEP_STATES))
    status = np.empty(len(jobs), np.int64)
    kernels = rows.Kernels(engine(False), engine(True))
    columns = given.columns._replace(steps=given.grid.steps(models))
    work, record = rows.Jobs(jobs, starts, status), Record(out, states)

    def run(begin: int, end: int) -> None:
        rows.run_jobs(kernels, models, columns, work, record, rows.no_controller, begin, end)

    share_out(run, len(jobs), parallel=parallel)
    if failures == "raise" and np.any(status != DONE):
        job = int(np.argmax(status != DONE))
        raise SimulationError(
            f"model {jobs[job, 0]}: the states left the range of numbers at"
            f" t = {given.time_s[status[job]]:.6g} s: is a value out by orders of magnitude?"
        )
    return out, states
