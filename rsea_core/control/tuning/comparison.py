"""Controllers side by side: the same plant, reference, noise and tuning budget for each.

A comparison is a task, a list of controllers and a budget. Every controller is tuned from the same
seeds with the same number of runs (or taken as it is, where nothing of it is to be tuned), and
then judged on the event-driven engine: errors, step figures, effort, margins, limit cycle; and by
`robustness` on perturbed machines with noise, with a wrong compensator, under disturbances.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

import rsea_core.control.tuning.figures_of_merit as merit
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.margins import LoopMargins, loop_margins
from rsea_core.control.tuning.optimisers import Search, Starts
from rsea_core.control.tuning.robustness import Disturbance, Robustness, robustness
from rsea_core.control.tuning.tune import FOLLOWED, Task, tune
from rsea_core.errors import ControllerError, InputError, SimulationError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.trajectory import Trajectory


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

    Raises
    ------
    InputError
        If there is no controller, or two have one name.
    """

    name: str
    task: Task
    controllers: tuple[ComparedController, ...]
    method: str = "particle-swarm"
    seeds: tuple[int, ...] = (0,)
    population: int = 10
    generations: int = 40
    perturbed: int = 20
    disturbances: tuple[Disturbance, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        names = [compared.name for compared in self.controllers]
        if not names:
            raise InputError("a comparison needs a controller")
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two controllers are called {name!r}")


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
    step : merit.Step or None
        For a step reference.
    command_rms, command_change : float
        RMS, and mean absolute change from sample to sample.
    margins : LoopMargins or None
        None for a law without a gain at rest.
    cycle : merit.LimitCycle or None
        A steady oscillation about a reference at rest.
    robustness : Robustness
    """

    name: str
    controller: Controller
    starts: Starts | None
    trajectory: Trajectory
    following: merit.Following
    step: merit.Step | None
    command_rms: float
    command_change: float
    margins: LoopMargins | None
    cycle: merit.LimitCycle | None
    robustness: Robustness

    def as_row(self) -> dict[str, float | str | None]:
        """The figures as one flat row."""
        m, starts, r = self.margins, self.starts, self.robustness
        return {
            "controller": self.name,
            "kind": self.controller.kind,
            "rmse": self.following.rmse,
            "peak_error": self.following.peak_error,
            "steady_state_error": self.following.steady_state_error,
            "overshoot_percent": None if self.step is None else self.step.overshoot_percent,
            "settling_s": None if self.step is None else self.step.settling_s,
            "command_rms": self.command_rms,
            "command_change": self.command_change,
            "gain_margin_dB": None if m is None else m.gain_margin_dB,
            "phase_margin_deg": None if m is None else m.phase_margin_deg,
            "delay_margin_s": None if m is None else m.delay_margin_s,
            "modulus_margin": None if m is None else m.modulus_margin,
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
        controller, starts = compared.controller, None
        if compared.bounds:
            mine = {seed: s for (name, seed), s in (done or {}).items() if name == compared.name}
            tuned = tune(
                comparison.task,
                controller,
                compared.bounds,
                method=comparison.method,
                seeds=comparison.seeds,
                population=comparison.population,
                generations=comparison.generations,
                done=mine,
                on_search=None
                if on_search is None
                else lambda s, name=compared.name: on_search(name, s),
            )
            controller, starts = tuned.controller, tuned.starts
        verdicts.append(_judge(comparison, compared.name, controller, starts))
    return verdicts


def _judge(
    comparison: Comparison, name: str, controller: Controller, starts: Starts | None
) -> Verdict:
    task, load = comparison.task, comparison.task.loads[0]
    known = task.known_model or task.model
    try:
        ran = simulate_closed_loop(
            task.model,
            controller,
            task.reference,
            load,
            duration_s=task.duration_s,
            refuse_unstable=False,
            known_model=known,
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
    step = merit.step_response(time, response) if task.reference.kind == "step" else None
    smallest = 2.0 * abs(response).max() / 1000.0
    return Verdict(
        name=name,
        controller=controller,
        starts=starts,
        trajectory=ran,
        following=merit.following(time, wanted, response),
        step=step,
        command_rms=float(np.sqrt((command**2).mean())),
        command_change=float(np.abs(np.diff(command[::every])).mean()),
        margins=_margins(known, controller, task),
        cycle=merit.limit_cycle(time, response, smallest=smallest) if at_rest else None,
        robustness=robustness(
            task,
            controller,
            machines=comparison.perturbed,
            seed=comparison.seeds[0],
            disturbances=comparison.disturbances,
        ),
    )


def _margins(known: ActuatorModel, controller: Controller, task: Task) -> LoopMargins | None:
    if not controller.has_gain_at_rest or controller.reference_name != "reference_torque_Nm":
        return None
    return loop_margins(known, controller, task.loads[0])


def table(verdicts: Sequence[Verdict]) -> list[dict[str, float | str | None]]:
    """One row for each verdict."""
    return [verdict.as_row() for verdict in verdicts]


def tuned_values(verdict: Verdict) -> dict[str, float | str | bool]:
    """Every field of the tuned controller, as a scenario's [controller] table has it."""
    found: dict[str, float | str | bool] = {"kind": verdict.controller.kind}
    for f in fields(verdict.controller):
        found[f.name] = getattr(verdict.controller, f.name)
    return found
