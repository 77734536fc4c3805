"""Controllers side by side: the same plant, reference, noise and tuning budget for each.

A comparison is a task, a list of entrants and a budget. Every entrant is tuned from the same
seeds with the same number of runs (or taken as it is, where nothing of it is to be tuned), and
then judged on the precise engine: errors, step figures, effort, margins, limit cycle. Then on
perturbed machines with the controller still made for the nominal one, and, where it compensates
friction, with a compensator that is wrong by 30 %.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.control.judging as judging
from rsea_core.control.base import Controller
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.margins import LoopMargins, loop_margins
from rsea_core.control.optimisers import Search, Starts
from rsea_core.control.tuning import FOLLOWED, Task, run_all, tune
from rsea_core.errors import ControllerError, InputError, RseaError, SimulationError
from rsea_core.model import ActuatorModel
from rsea_core.trajectory import Trajectory

WRONG = 0.7  # share of the friction that a compensator wrong by 30 % takes out
PERTURBED = {
    "torque_constant_Nm_per_A": 0.05,
    "terminal_resistance_ohm": 0.10,
    "motor_inertia_kgm2": 0.10,
    "motor_viscous_Nms_per_rad": 0.50,
}
"""Relative standard deviations of the perturbed machines; k_e moves with k_t.

The spring is left as it is: torque is read through it, so that a wrong stiffness is a scale of the
sensor, the same for every controller.
"""


@dataclass(frozen=True, kw_only=True)
class Entrant:
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
    entrants : tuple of Entrant
    method : str
    seeds : tuple of int
    population, generations : int
    perturbed : int
        Number of perturbed machines; 0 leaves them out.
    notes : tuple of str
        What of a diagnosed rig's file the plant goes without, a sentence each.

    Raises
    ------
    InputError
        If there is no entrant, or two have one name.
    """

    name: str
    task: Task
    entrants: tuple[Entrant, ...]
    method: str = "particle-swarm"
    seeds: tuple[int, ...] = (0,)
    population: int = 10
    generations: int = 40
    perturbed: int = 20
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        names = [entrant.name for entrant in self.entrants]
        if not names:
            raise InputError("a comparison needs a controller")
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two controllers are called {name!r}")


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """How one entrant did.

    Attributes
    ----------
    name : str
    controller : Controller
        As tuned.
    starts : Starts or None
        One search for each seed; None where nothing was tuned.
    trajectory : Trajectory
        On the first load.
    following : judging.Following
    step : judging.Step or None
        For a step reference.
    command_rms, command_change : float
        RMS, and mean absolute change from sample to sample.
    margins : LoopMargins or None
        None for a law without a gain at rest.
    cycle : judging.LimitCycle or None
        A steady oscillation about a reference at rest.
    perturbed_rmse : (machines,) array
        On the perturbed machines.
    wrong_compensator_rmse : float or None
        With 70 % of the compensation; None where nothing is compensated.
    """

    name: str
    controller: Controller
    starts: Starts | None
    trajectory: Trajectory
    following: judging.Following
    step: judging.Step | None
    command_rms: float
    command_change: float
    margins: LoopMargins | None
    cycle: judging.LimitCycle | None
    perturbed_rmse: NDArray
    wrong_compensator_rmse: float | None

    def as_row(self) -> dict[str, float | str | None]:
        """The figures as one flat row."""
        m, starts = self.margins, self.starts
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
            "perturbed_rmse_mean": _mean(self.perturbed_rmse),
            "perturbed_rmse_worst": _worst(self.perturbed_rmse),
            "wrong_compensator_rmse": self.wrong_compensator_rmse,
            "tuned_cost_best": None if starts is None else starts.best.cost,
            "tuned_cost_median": None if starts is None else starts.median,
            "seeds_failed_share": None if starts is None else starts.failed_share,
        }


def _mean(values: NDArray) -> float | None:
    return float(values.mean()) if values.size else None


def _worst(values: NDArray) -> float | None:
    return float(values.max()) if values.size else None


def compare(
    comparison: Comparison,
    *,
    done: Mapping[tuple[str, int], Search] | None = None,
    on_search: Callable[[str, Search], None] | None = None,
) -> list[Verdict]:
    """Tune and judge every entrant, in their order.

    Parameters
    ----------
    done : mapping or None
        Searches of an interrupted run by entrant and seed.
    on_search : callable or None
        Called with the entrant's name and each finished search.

    Raises
    ------
    RseaError
        If an entrant cannot run on the task.
    """
    verdicts = []
    for entrant in comparison.entrants:
        controller, starts = entrant.controller, None
        if entrant.bounds:
            mine = {seed: s for (name, seed), s in (done or {}).items() if name == entrant.name}
            tuned = tune(
                comparison.task,
                controller,
                entrant.bounds,
                method=comparison.method,
                seeds=comparison.seeds,
                population=comparison.population,
                generations=comparison.generations,
                done=mine,
                on_search=None
                if on_search is None
                else lambda s, name=entrant.name: on_search(name, s),
            )
            controller, starts = tuned.controller, tuned.starts
        verdicts.append(_judge(comparison, entrant.name, controller, starts))
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
    step = judging.step_response(time, response) if task.reference.kind == "step" else None
    compensates = getattr(controller, "friction_compensation", 0.0) > 0.0
    wrong = None
    if compensates:
        share = WRONG * controller.friction_compensation
        worse = replace(controller, friction_compensation=share)
        wrong = float(run_all(task, [worse], load).metric("rmse")[0])
    smallest = 2.0 * abs(response).max() / 1000.0
    return Verdict(
        name=name,
        controller=controller,
        starts=starts,
        trajectory=ran,
        following=judging.following(time, wanted, response),
        step=step,
        command_rms=float(np.sqrt((command**2).mean())),
        command_change=float(np.abs(np.diff(command[::every])).mean()),
        margins=_margins(known, controller, task),
        cycle=judging.limit_cycle(time, response, smallest=smallest) if at_rest else None,
        perturbed_rmse=_perturbed(comparison, controller),
        wrong_compensator_rmse=wrong,
    )


def _margins(known: ActuatorModel, controller: Controller, task: Task) -> LoopMargins | None:
    if not controller.has_gain_at_rest or controller.reference_name != "reference_torque_Nm":
        return None
    return loop_margins(known, controller, task.loads[0])


def perturbed_models(model: ActuatorModel, count: int, seed: int) -> list[ActuatorModel]:
    """The model with values moved at random (`PERTURBED`), the same for the same seed."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        moved = {}
        for key, spread in PERTURBED.items():
            value, shift = getattr(model.rig, key), np.clip(rng.standard_normal(), -2.0, 2.0)
            if value is not None:
                moved[key] = value * (1.0 + spread * shift)
        k_t, k_e = model.rig.torque_constant_Nm_per_A, model.rig.back_emf_constant_Vs_per_rad
        if k_e is not None and "torque_constant_Nm_per_A" in moved:
            ratio = moved["torque_constant_Nm_per_A"] / k_t
            moved["back_emf_constant_Vs_per_rad"] = k_e * ratio
        found.append(replace(model, rig=replace(model.rig, **moved)))
    return found


def _perturbed(comparison: Comparison, controller: Controller) -> NDArray:
    """RMSE on the perturbed machines, inf where a loop runs away."""
    task, found = comparison.task, []
    if not comparison.perturbed:
        return np.zeros(0)
    known = task.known_model or task.model
    for model in perturbed_models(task.model, comparison.perturbed, comparison.seeds[0]):
        one = replace(task, model=model, known_model=known)
        try:
            rmse = float(run_all(one, [controller], task.loads[0]).metric("rmse")[0])
        except RseaError:
            rmse = np.inf
        found.append(rmse if np.isfinite(rmse) else np.inf)
    return np.array(found)


def table(verdicts: Sequence[Verdict]) -> list[dict[str, float | str | None]]:
    """One row for each verdict."""
    return [verdict.as_row() for verdict in verdicts]


def tuned_values(verdict: Verdict) -> dict[str, float | str | bool]:
    """Every field of the tuned controller, as a scenario's [controller] table has it."""
    found: dict[str, float | str | bool] = {"kind": verdict.controller.kind}
    for f in fields(verdict.controller):
        found[f.name] = getattr(verdict.controller, f.name)
    return found
