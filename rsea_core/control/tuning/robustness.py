"""What becomes of a tuned controller on other machines, with noise, wrong models, disturbances.

By the engine of the search where it agrees with the precise one to 5 %, with shorter steps where
it does not, else by the precise one; under one task's noise, with the controller still made for the
machine that is known: random machines, each with noise of its own; a friction compensator that is
wrong by 30 % on either side; pulses and ramps of an external torque on the load.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.laws.base import Controller
from rsea_core.control.tuning.tune_task import FOLLOWED, Task, precise_run, run_all
from rsea_core.effects.registry import LoadDisturbance
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.errors import InputError, RseaError, SimulationError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.perturbed import Tolerances, perturbed_models
from rsea_core.simulation.trajectory import PIECEWISE_LINEAR, Trajectory

WRONG = (0.7, 1.3)  # shares of the friction that a compensator wrong by 30 % takes out
NOISE_SEEDS = 5  # runs that an RMSE under noise is the mean of
AGREEING_percent = 5.0
RECOVERED = 0.05  # of the largest deviation


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """An external torque on the load.

    Attributes
    ----------
    peak_Nm : float
    start_s, end_s : float
    rise_s : float
        0 is a pulse; else a ramp up to the peak within this time.

    Raises
    ------
    InputError
        If it does not begin before it ends, or rises for longer than it lasts.
    """

    peak_Nm: float
    start_s: float
    end_s: float
    rise_s: float = 0.0

    def __post_init__(self):
        if not 0.0 <= self.start_s < self.end_s < np.inf:
            raise InputError(
                f"disturbance: end_s = {self.end_s:g} must come after start_s = {self.start_s:g}"
            )
        if not 0.0 <= self.rise_s <= self.end_s - self.start_s:
            raise InputError(
                f"disturbance: rise_s = {self.rise_s:g} must be within 0.."
                f"{self.end_s - self.start_s:g} s, which it lasts"
            )

    @property
    def name(self) -> str:
        """ "pulse 6 Nm" or "ramp 6 Nm"."""
        return f"{'ramp' if self.rise_s > 0.0 else 'pulse'} {self.peak_Nm:g} Nm"

    def on(self, model: ActuatorModel) -> ActuatorModel:
        """The model with this disturbance in place of its own."""
        kept = tuple(t for t in model.terms if not isinstance(t, LoadDisturbance))
        mine = LoadDisturbance(
            start_s=self.start_s, end_s=self.end_s, peak_Nm=self.peak_Nm, rise_s=self.rise_s
        )
        return replace(model, terms=(*kept, mine))


@dataclass(frozen=True, kw_only=True)
class Disturbed:
    """How a loop took a disturbance.

    Attributes
    ----------
    name : str
    rmse : float
        Over the judged rows, infinite where the loop ran away.
    peak_deviation : float
        Largest difference to the same loop without it.
    recovery_s : float or None
        From its end until the difference stays within 5 % of the largest; None: not in the run.
    """

    name: str
    rmse: float
    peak_deviation: float
    recovery_s: float | None


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """What `robustness` found, RMSE in the unit of what is followed.

    Attributes
    ----------
    noisy_rmse : float or None
        On the nominal machine under the task's noise, mean over NOISE_SEEDS runs; None where the
        task has no noise.
    engine : str
        What ran all of it.
    engine_error_percent : float
        Of its RMSE without noise on the nominal machine against the one with located events.
    nominal_rmse : float
        `noisy_rmse`, or the RMSE without noise.
    monte_carlo_rmse : (machines,) array
        One perturbed machine and one draw of noise each; inf where a loop runs away.
    wrong_compensator_rmse : float or None
        As `noisy_rmse` with the worse of WRONG; None where nothing is compensated.
    disturbed : tuple of Disturbed
        Empty where the load is held, which no external torque moves.
    """

    noisy_rmse: float | None
    engine: str
    engine_error_percent: float
    nominal_rmse: float
    monte_carlo_rmse: NDArray
    wrong_compensator_rmse: float | None
    disturbed: tuple[Disturbed, ...]

    @property
    def degradation_percent(self) -> float | None:
        """By how much the wrong compensator is worse; below 0 where it is better."""
        if self.wrong_compensator_rmse is None:
            return None
        return 100.0 * (self.wrong_compensator_rmse / self.nominal_rmse - 1.0)


def robustness(
    task: Task,
    controller: Controller,
    *,
    machines: int,
    seed: int,
    disturbances: Sequence[Disturbance] = (),
    tolerances: Tolerances | None = None,
) -> Robustness:
    """Judge a controller on the first load of a task.

    Parameters
    ----------
    machines : int
        Number of perturbed machines.
    seed : int
        Of their values.
    tolerances : see `perturbed_models`

    Raises
    ------
    RseaError
        If the controller cannot run on the task.
    """
    share = getattr(controller, "friction_compensation", 0.0)
    judge = agreeing_engine(task, controller)
    wrong = None
    if share > 0.0:
        tried = [replace(controller, friction_compensation=w * share) for w in WRONG]
        wrong = max(_noisy(judge, one) for one in tried)
    load, nominal = task.loads[0], _noisy(judge, controller)
    return Robustness(
        noisy_rmse=nominal if any(task.noise) else None,
        engine=judge.engine,
        engine_error_percent=judge.error_percent,
        nominal_rmse=nominal,
        monte_carlo_rmse=monte_carlo(
            judge, controller, perturbed_models(task.model, machines, seed, tolerances)
        ),
        wrong_compensator_rmse=wrong,
        disturbed=() if load.is_held else _disturbed(task, controller, disturbances),
    )


@dataclass(frozen=True, kw_only=True)
class Judge:
    """A task with the engine that runs it.

    Attributes
    ----------
    task : Task
        With the step length at which the engine agrees with the precise one.
    engine : str
    error_percent : float
        Of the RMSE against the one with located events, without noise.
    is_precise : bool
        Nothing else agreed: every run goes through the engine with located events.
    """

    task: Task
    engine: str
    error_percent: float
    is_precise: bool


def agreeing_engine(task: Task, controller: Controller) -> Judge:
    """The fastest engine whose RMSE is within AGREEING of the precise one's.

    Raises
    ------
    RseaError
        If the controller cannot run on the task.
    """
    still = replace(task, noise=(0.0, 0.0, 0.0))
    try:
        ran = precise_run(still, controller, task.loads[0])
    except SimulationError:
        return Judge(task=task, engine="fixed-step", error_percent=np.inf, is_precise=False)
    exact = rmse_of(still, ran)
    error = np.inf
    for steps in (None, 4, 8, 16):
        step_s = task.step_s if steps is None else controller.sample_time_s / steps
        found = run_all(replace(still, step_s=step_s), [controller], task.loads[0])
        error = 100.0 * (float(found.metric("rmse")[0]) / max(exact, 1e-300) - 1.0)
        if abs(error) <= AGREEING_percent:
            own = replace(task, step_s=step_s)
            return Judge(task=own, engine=found.engine, error_percent=error, is_precise=False)
        if found.engine == PIECEWISE_LINEAR:
            break
    return Judge(task=task, engine=ran.engine, error_percent=error, is_precise=True)


def rmse_of(task: Task, ran: Trajectory) -> float:
    """RMSE of a run over the judged rows, in the unit of what is followed."""
    rows = ran.time_s >= task.from_s
    wanted = task.reference.sample(ran.time_s[rows])[:, 0]
    response = getattr(ran, FOLLOWED[task.reference.unit])[rows]
    return float(np.sqrt(((wanted - response) ** 2).mean()))


def _rmse(
    judge: Judge, controllers: Sequence[Controller], models: Sequence[ActuatorModel] | None
) -> NDArray:
    """RMSE of runs, infinite where one fails."""
    task = judge.task
    if not judge.is_precise:
        ran = run_all(task, controllers, task.loads[0], models=models)
        return _finite(ran.metric("rmse"))
    found = []
    for j, controller in enumerate(controllers):
        own = replace(task, noise_seed=task.noise_seed + 3 * j)
        try:
            ran = precise_run(own, controller, task.loads[0], None if models is None else models[j])
            found.append(rmse_of(task, ran))
        except SimulationError:
            found.append(np.inf)
    return np.array(found)


def _finite(values: NDArray) -> NDArray:
    return np.where(np.isfinite(values), values, np.inf)


def _noisy(judge: Judge, controller: Controller) -> float:
    runs = NOISE_SEEDS if any(judge.task.noise) else 1
    return float(_rmse(judge, [controller] * runs, None).mean())


def monte_carlo(judge: Judge, controller: Controller, models: Sequence[ActuatorModel]) -> NDArray:
    """RMSE on machines, one draw of noise each, with the controller made for the known one."""
    if not models:
        return np.zeros(0)
    task = judge.task
    known = replace(judge, task=replace(task, known_model=task.known_model or task.model))
    try:
        return _rmse(known, [controller] * len(models), models)
    except RseaError:
        return np.full(len(models), np.inf)


def _disturbed(
    task: Task, controller: Controller, disturbances: Sequence[Disturbance]
) -> tuple[Disturbed, ...]:
    """Every disturbance against the same loop, with the same noise, without any."""
    if not disturbances:
        return ()
    calm = Disturbance(peak_Nm=0.0, start_s=0.0, end_s=task.duration_s)
    models = [each.on(task.model) for each in (calm, *disturbances)]
    known = replace(task, known_model=task.known_model or task.model)
    column, found = CHANNELS.index(FOLLOWED[task.reference.unit]), []
    for model, disturbance in zip(models[1:], disturbances, strict=True):
        pair = [
            run_all(replace(known, model=each), [controller], task.loads[0], with_rows=True)
            for each in (models[0], model)
        ]
        still, moved = (ran.rows[0, :, column] for ran in pair)
        time = np.linspace(0.0, task.duration_s, still.size)
        away = _finite(np.abs(moved - still))
        peak = float(away.max())
        after = np.flatnonzero((time > disturbance.end_s) & (away > RECOVERED * peak))
        last = after[-1] if after.size else int(np.searchsorted(time, disturbance.end_s))
        back = last + 1 < time.size and np.isfinite(peak)
        found.append(
            Disturbed(
                name=disturbance.name,
                rmse=float(_finite(pair[1].metric("rmse"))[0]),
                peak_deviation=peak,
                recovery_s=float(time[last] - disturbance.end_s) if back else None,
            )
        )
    return tuple(found)
