"""Controllers side by side: the same plant, reference, noise and tuning budget for each.

A comparison is a task, a list of controllers and a budget. Every controller is tuned from the same
seeds with the same number of evaluations (or taken as it is, where nothing of it is to be tuned),
and then judged on the engine with located events: errors, step figures, effort, margins,
oscillations; and by `robustness` on perturbed machines with noise, with a wrong compensator, under
disturbances.

Ranked are stable loops without a growing or sustained oscillation and without a value at the end
of what was searched (`standing`, `grown_bounds`); the others are listed with the reason.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

import rsea_core.control.tuning.figures_of_merit as merit
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.margins import LoopMargins, open_loop_response
from rsea_core.control.stability.oscillation import oscillation
from rsea_core.control.tuning.bootstrap import Paired, paired, pareto
from rsea_core.control.tuning.grown_bounds import AtBound
from rsea_core.control.tuning.optimisers import DEFAULT, Starts
from rsea_core.control.tuning.robustness import (
    Disturbance,
    Robustness,
    agreeing_engine,
    monte_carlo,
    robustness,
)
from rsea_core.control.tuning.search_record import Search
from rsea_core.control.tuning.standing import Standing, smallest_swing, standing
from rsea_core.control.tuning.tune import FOLLOWED, Task, Tuned, tune
from rsea_core.errors import ControllerError, InputError, SimulationError
from rsea_core.model.perturbed import Tolerances, perturbed_models, usual_tolerances
from rsea_core.simulation.step_response import StepShape, step_of
from rsea_core.simulation.trajectory import Trajectory

SLOWEST_Hz, PLOTTED = 0.1, 400  # of the loop that a page draws


@dataclass(frozen=True, kw_only=True)
class ComparedController:
    """A controller in a comparison.

    Attributes
    ----------
    name : str
    controller : Controller
    bounds : mapping
        Fields to tune with their lowest and highest value; empty: taken as it is.
    """

    name: str
    controller: Controller
    bounds: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What is compared, and the budget.

    Attributes
    ----------
    name : str
    task : Task
    controllers : tuple of ComparedController
    method : str
    seeds : tuple of int
    population, generations : int
    perturbed : int
        Number of perturbed machines; 0 leaves them out.
    disturbances : tuple of Disturbance
        On the load, where it is not held.
    notes : tuple of str
        What of a diagnosed rig's file the plant goes without, a sentence each.
    tolerances : mapping or None
        Standard deviations of the perturbed machines, see `perturbed_models`; None: the usual ones
        of the task's machine, which `moved` states.

    Raises
    ------
    InputError
        If there is no controller, or two have one name.
    """

    name: str
    task: Task
    controllers: tuple[ComparedController, ...]
    method: str = DEFAULT
    seeds: tuple[int, ...] = (0,)
    population: int = 10
    generations: int = 40
    perturbed: int = 20
    disturbances: tuple[Disturbance, ...] = ()
    notes: tuple[str, ...] = ()
    tolerances: Tolerances | None = None

    def __post_init__(self):
        names = [compared.name for compared in self.controllers]
        if not names:
            raise InputError("a comparison needs a controller")
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two controllers are called {name!r}")

    @property
    def moved(self) -> Tolerances:
        """What the perturbed machines differ in, and by how much."""
        return usual_tolerances(self.task.model) if self.tolerances is None else self.tolerances


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """How one controller did.

    Attributes
    ----------
    name : str
    controller : Controller
        As tuned.
    starts : Starts or None
        One search for each seed; None where nothing was tuned.
    trajectory : Trajectory
        On the first load.
    following : merit.Following
    step : StepShape or None
        For a step reference, from the step on.
    command_rms, command_change : float
        RMS, and mean absolute change from sample to sample.
    margins : LoopMargins or None
        None for a law without a gain at rest.
    cycle : merit.LimitCycle or None
        A steady oscillation about a reference at rest.
    robustness : Robustness
    standing : Standing
    at_bounds : tuple of AtBound
        Tuned values at a side of what was searched.
    oscillation : str or None
        What of the run about a reference at rest does not die out.
    limited_share : float
        Of the rows in which the command was limited.
    open_loop : ((f,), (f,)) arrays or None
        Frequencies [Hz] and the linear loop broken at the command, where there is one.
    by_seed : (seeds, machines) array
        RMSE on the perturbed machines of what each seed would have delivered (`Tuned.by_seed`).
    seeds_ranked : int or None
        Number of tuning seeds that found a point that may be ranked; None where nothing was tuned.
    """

    name: str
    controller: Controller
    starts: Starts | None
    trajectory: Trajectory
    following: merit.Following
    step: StepShape | None
    command_rms: float
    command_change: float
    margins: LoopMargins | None
    cycle: merit.LimitCycle | None
    robustness: Robustness
    standing: Standing
    at_bounds: tuple[AtBound, ...]
    oscillation: str | None
    limited_share: float
    open_loop: tuple[NDArray, NDArray] | None
    by_seed: NDArray
    seeds_ranked: int | None

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it has no rank; empty where it has one."""
        searched = tuple(str(b) for b in self.at_bounds if not b.is_physical)
        own = () if self.oscillation is None else (self.oscillation,)
        return (*self.standing.reasons, *own, *searched)

    @property
    def expected_rmse(self) -> float:
        """What the ranking goes by: mean over tuning seeds and perturbed machines, if there are."""
        return float(self.by_seed.mean()) if self.by_seed.size else self.following.rmse

    @property
    def objectives(self) -> tuple[float, float, float, float]:
        """What a Pareto front weighs: error, effort, chatter, spread over machines."""
        worst = _of(np.max, self.robustness.monte_carlo_rmse)
        return (
            self.following.rmse,
            self.command_rms,
            self.command_change,
            self.following.rmse if worst is None else worst,
        )

    def as_row(self) -> dict[str, float | str | list[str] | None]:
        """The figures as one flat row."""
        m, starts, r = self.margins, self.starts, self.robustness
        gain, phase = self.standing.gain_and_phase
        return {
            "controller": self.name,
            "kind": self.controller.kind,
            "rmse": self.following.rmse,
            "expected_rmse": self.expected_rmse,
            "peak_error": self.following.peak_error,
            "steady_state_error": self.following.steady_state_error,
            "overshoot_percent": None if self.step is None else self.step.overshoot_percent,
            "settling_s": None if self.step is None else self.step.settling_s,
            "command_rms": self.command_rms,
            "command_change": self.command_change,
            "gain_margin_dB": gain,
            "gain_reduction_dB": None if m is None else m.gain_fall_dB,
            "phase_margin_deg": phase,
            "delay_margin_s": None if m is None else m.delay_margin_s,
            "modulus_margin": None if m is None else m.modulus_margin,
            "pole_radius": None if m is None else m.pole_radius,
            "ranked": not self.reasons,
            "not_ranked_because": list(self.reasons),
            "at_bounds": [str(b) for b in self.at_bounds],
            "command_limited_share": self.limited_share,
            "evaluations": None if starts is None else starts.evaluations,
            "robustness_engine": r.engine,
            "engine_error_percent": r.engine_error_percent,
            "limit_cycle_Hz": None if self.cycle is None else self.cycle.frequency_Hz,
            "limit_cycle_amplitude": None if self.cycle is None else self.cycle.amplitude,
            "noisy_rmse": r.noisy_rmse,
            "monte_carlo_rmse_mean": _of(np.mean, r.monte_carlo_rmse),
            "monte_carlo_rmse_std": _of(np.std, r.monte_carlo_rmse),
            "monte_carlo_rmse_worst": _of(np.max, r.monte_carlo_rmse),
            "wrong_compensator_rmse": r.wrong_compensator_rmse,
            "wrong_compensator_percent": r.degradation_percent,
            "tuned_cost_best": None if starts is None else starts.best.cost,
            "tuned_cost_median": None if starts is None else starts.median,
            "seeds_failed_share": None if starts is None else starts.failed_share,
            "seeds_ranked": self.seeds_ranked,
            **{f"{d.name}: rmse": d.rmse for d in r.disturbed},
            **{f"{d.name}: peak": d.peak_deviation for d in r.disturbed},
            **{f"{d.name}: recovery_s": d.recovery_s for d in r.disturbed},
        }


def _of(what, values: NDArray) -> float | None:
    """A figure of values of which some may be infinite; None where there are none."""
    if not values.size:
        return None
    return float(what(values)) if np.isfinite(values).all() else np.inf


def compare(
    comparison: Comparison,
    *,
    done: Mapping[tuple[str, int], Search] | None = None,
    on_search: Callable[[str, Search], None] | None = None,
) -> list[Verdict]:
    """Tune and judge every controller, in their order.

    Parameters
    ----------
    done : mapping or None
        Searches of an interrupted run by controller and seed.
    on_search : callable or None
        Called with the controller's name and each finished search.

    Raises
    ------
    RseaError
        If a controller cannot run on the task.
    """
    verdicts = []
    for compared in comparison.controllers:
        tuned = None
        if compared.bounds:
            mine = {seed: s for (name, seed), s in (done or {}).items() if name == compared.name}
            tuned = tune(
                comparison.task,
                compared.controller,
                compared.bounds,
                method=comparison.method,
                seeds=comparison.seeds,
                population=comparison.population,
                generations=comparison.generations,
                done=mine,
                on_search=on_search and partial(on_search, compared.name),
            )
        verdicts.append(_judge(comparison, compared, tuned))
    return verdicts


def _judge(comparison: Comparison, compared: ComparedController, tuned: Tuned | None) -> Verdict:
    task, load, name = comparison.task, comparison.task.loads[0], compared.name
    controller = compared.controller if tuned is None else tuned.controller
    try:
        ran = simulate_closed_loop(
            task.model,
            controller,
            task.reference,
            load,
            duration_s=task.duration_s,
            refuse_unstable=False,
            known_model=task.known_model or task.model,
        )
    except SimulationError as problem:
        raise ControllerError(f"{name}: {problem}") from problem
    rows = ran.time_s >= task.from_s
    time = ran.time_s[rows]
    wanted = task.reference.sample(time)[:, 0]
    response = getattr(ran, FOLLOWED[task.reference.unit])[rows]
    command = ran.command[rows]
    every = max(round(controller.sample_time_s / (time[1] - time[0])), 1)
    at_rest = task.reference.kind in ("step", "ramp")
    least = smallest_swing(task, float(np.abs(wanted).max()))
    swing = oscillation(time, response, smallest=least) if at_rest else None
    found = standing(task, controller) if tuned is None else tuned.standing
    return Verdict(
        name=name,
        controller=controller,
        starts=None if tuned is None else tuned.starts,
        trajectory=ran,
        following=merit.following(time, wanted, response),
        step=_step(ran, task),
        command_rms=float(np.sqrt((command**2).mean())),
        command_change=float(np.abs(np.diff(command[::every])).mean()),
        margins=found.margins,
        cycle=merit.limit_cycle(time, response, smallest=least) if at_rest else None,
        robustness=robustness(
            task,
            controller,
            machines=comparison.perturbed,
            seed=comparison.seeds[0],
            disturbances=comparison.disturbances,
            tolerances=comparison.moved,
        ),
        standing=found,
        at_bounds=() if tuned is None else tuned.at_bounds,
        oscillation=None if swing is None else f"{swing} {task.reference.unit} in the run",
        limited_share=float(ran.command_limited[rows].mean()),
        open_loop=None if found.margins is None else _open_loop(task, controller),
        by_seed=_by_seed(comparison, compared, tuned),
        seeds_ranked=None if tuned is None else len(tuned.by_seed),
    )


def _open_loop(task: Task, controller: Controller) -> tuple[NDArray, NDArray]:
    f = np.geomspace(SLOWEST_Hz, 0.5 / controller.sample_time_s, PLOTTED)
    return f, open_loop_response(task.known_model or task.model, controller, task.loads[0], f)


def _step(ran: Trajectory, task: Task) -> StepShape | None:
    """None without a step, or with too few rows behind it."""
    try:
        return step_of(ran, task.reference) if task.reference.kind == "step" else None
    except InputError:
        return None


def _by_seed(comparison: Comparison, compared: ComparedController, tuned: Tuned | None) -> NDArray:
    """(seeds, machines) RMSE on the perturbed machines; one row for what is not tuned."""
    task = comparison.task
    drawn = comparison.perturbed, comparison.seeds[0], comparison.moved
    models = perturbed_models(task.model, *drawn)
    made = [compared.controller] if tuned is None else tuned.by_seed or [tuned.controller]
    return np.array([monte_carlo(agreeing_engine(task, c), c, models) for c in made])


def ranking(verdicts: Sequence[Verdict]) -> tuple[list[Verdict], list[Verdict]]:
    """Those with a rank, best first, and those without, in their order."""
    ranked = sorted((v for v in verdicts if not v.reasons), key=lambda v: v.expected_rmse)
    return ranked, [v for v in verdicts if v.reasons]


def order_probabilities(verdicts: Sequence[Verdict]) -> list[Paired]:
    """Each ranked controller against the next one; empty without perturbed machines."""
    ranked = ranking(verdicts)[0]
    if any(v.by_seed.shape[1] < 2 for v in ranked):
        return []
    return [paired((a.name, a.by_seed), (b.name, b.by_seed)) for a, b in pairwise(ranked)]


def pareto_front(verdicts: Sequence[Verdict]) -> list[str]:
    """Names of the ranked controllers that no other beats in error, effort, chatter and spread."""
    ranked = ranking(verdicts)[0]
    if not ranked:
        return []
    best = pareto(np.array([v.objectives for v in ranked]))
    return [v.name for v, is_best in zip(ranked, best, strict=True) if is_best]


def table(verdicts: Sequence[Verdict]) -> list[dict[str, float | str | None]]:
    """One row for each verdict."""
    return [verdict.as_row() for verdict in verdicts]


def tuned_values(verdict: Verdict) -> dict[str, float | str | bool]:
    """Every field of the tuned controller, as a scenario's [controller] table has it."""
    found: dict[str, float | str | bool] = {"kind": verdict.controller.kind}
    for f in fields(verdict.controller):
        found[f.name] = getattr(verdict.controller, f.name)
    return found
