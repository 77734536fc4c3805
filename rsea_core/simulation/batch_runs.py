"""What a batch of closed loops runs and finds, whichever engine runs it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.engines.fixed_step.closed_loop import METRICS
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.engines.fixed_step.packed_models import Numbers, model_numbers
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load, checked_times
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.brief_repr import BriefRepr


@dataclass(frozen=True, kw_only=True)
class BatchRuns:
    """A batch of closed loops, from rest.

    Attributes
    ----------
    models : tuple of ActuatorModel or Numbers
        One for all runs, or one for each.
    controller : compiled function of the signature `equations.CONTROLLER`
    parameters : (runs, p) array
    state : (s,) or (runs, s) array
        The controller's state at the start.
    time_s : (n,) array
    reference : (n, 3) or (runs, n, 3) array
        What the controller follows, with its first two derivatives.
    follow : str
        The column of CHANNELS that the reference belongs to and metrics judge.
    rows_per_sample : int
        Rows between two actions of the controller.
    delay_samples : int
        0, or 1 where a command acts one sample after its readings.
    from_s : float
        Judged is from there on.
    noise : (float, float, float)
        Standard deviations of the readings of motor angle, load angle and current, before they
        are quantised in the rig's encoder counts; beside what the models' sensor terms do.
    seed : int
        Run j draws its noise from seed + j.
    step_s : float or None
        Longest step of the fixed-step engine, which runs where it is given.
    with_rows : bool
        Whether every row is kept.

    Raises
    ------
    InputError
        If shapes do not agree or a value is out of range.
    """

    models: tuple[ActuatorModel | Numbers, ...]
    controller: Any
    parameters: ArrayLike
    state: ArrayLike
    time_s: ArrayLike
    reference: ArrayLike
    command_name: str
    load: Load
    follow: str = "torque_Nm"
    rows_per_sample: int = 1
    delay_samples: int = 0
    command_limit: float = np.inf
    from_s: float = 0.0
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0
    initial_angles_rad: tuple[float, float] = (0.0, 0.0)
    step_s: float | None = None
    with_rows: bool = False

    def __post_init__(self):
        time = checked_times(self.time_s)
        parameters = np.array(self.parameters, dtype=float, ndmin=2)
        count = len(parameters)
        if self.load.kind == "imposed":
            raise InputError('a closed loop with the load "imposed" needs its motion: use "locked"')
        if self.follow not in CHANNELS:
            raise InputError(f"follow = {self.follow!r} is not one of {', '.join(CHANNELS)}")
        if self.rows_per_sample < 1 or self.delay_samples not in (0, 1):
            raise InputError("rows_per_sample must be at least 1 and delay_samples 0 or 1")
        if len(self.models) == 0:
            raise InputError("give at least one model")
        if len(self.models) not in (1, count):
            raise InputError(f"{len(self.models)} models for {count} rows of parameters")
        if time.size - int(np.searchsorted(time, self.from_s)) < 2:
            raise InputError(
                f"from_s = {self.from_s:g} s leaves less than 2 rows of {time[-1]:g} s"
            )
        states = np.asarray(self.state, dtype=float)
        for name, value in (
            ("time_s", time),
            ("parameters", parameters),
            ("state", np.array(np.broadcast_to(states, (count, states.shape[-1])), order="C")),
            ("reference", _references(self.reference, time.size, count)),
        ):
            object.__setattr__(self, name, value)

    @property
    def count(self) -> int:
        """Number of runs."""
        return len(self.parameters)

    @property
    def first(self) -> int:
        """First judged row."""
        return int(np.searchsorted(self.time_s, self.from_s))

    @property
    def followed(self) -> int:
        """Place of what is followed in CHANNELS."""
        return CHANNELS.index(self.follow)

    @cached_property
    def machines(self) -> list[Numbers]:
        """The numbers of each model."""
        return [
            each if isinstance(each, Numbers) else model_numbers(each, self.command_name, self.load)
            for each in self.models
        ]

    @property
    def terms(self) -> list[tuple]:
        """The terms of each model, of which some may be sensors."""
        return [each.terms if isinstance(each, ActuatorModel) else () for each in self.models]


@dataclass(frozen=True, kw_only=True, repr=False)
class BatchResult(BriefRepr):
    """What a batch found; arrays are read-only.

    Attributes
    ----------
    metrics : (runs, len(METRICS)) array
        Over the rows from `from_s` on. In the unit of what is followed: rmse, peak_error,
        mean_absolute_error, time_weighted_error (ITAE, times s), steady_state_error (mean of the
        last 20 %). Of the change from the first judged row to the last reference, NaN where that
        does not hold for the last 20 %: overshoot_percent and settling_s (into 2 %, NaN if
        outside at the end). In the command's unit: command_rms, command_peak, command_variation
        (sum of changes). limited_share (of the rows in which the command was limited),
        current_rms_A, current_peak_A, motor_speed_peak_rad_per_s.
    failed : (runs,) bool array
        Runs whose states left the range of numbers; their metrics are NaN.
    rows : (runs, n, 8) array or None
        `layout.CHANNELS` and the command, where they were asked for.
    engine : str
        "piecewise-linear" or "fixed-step", the same for every run.
    engine_reason : str or None
        Why it was not the first, None where it was.
    """

    metrics: NDArray
    failed: NDArray
    rows: NDArray | None
    engine: str
    engine_reason: str | None

    def metric(self, name: str) -> NDArray:
        """One column of the metrics by name, (runs,) array.

        Raises
        ------
        InputError
            If there is no such metric.
        """
        if name not in METRICS:
            raise InputError(f"metric {name!r} is not one of {', '.join(METRICS)}")
        return self.metrics[:, METRICS.index(name)]


def _references(values: ArrayLike, rows: int, count: int) -> NDArray:
    array, shape = np.array(values, dtype=float), (rows, 3)
    if array.shape == shape:
        array = array[None]
    if array.shape not in ((1, *shape), (count, *shape)) or not np.all(np.isfinite(array)):
        raise InputError(
            f"reference of shape {np.shape(values)} must be {shape} or {(count, *shape)}"
            " finite numbers"
        )
    return array
