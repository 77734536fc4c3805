"""What a rival can answer with its nominal parameters, and what stays between two rivals."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.replay import Numbers, Replay
from rsea_core.identify.experiment.input_shapes import ROW_s

CORRELATED_s = 0.05  # rows closer than this tell one thing
ROUNDS = 6  # of Gauss-Newton
SHARES = (1.0, 0.3, 0.1)  # of a step, tried together
TOLERANCES = {
    "resistance": 0.15,
    "torque_per_ampere": 0.08,
    "volts_per_speed": 0.08,
    "volts_per_command": 0.02,
    "inertia": 0.15,
    "damping": 0.7,
    "load_inertia": 0.05,
    "load_damping": 0.7,
    "gravity": 0.03,
    "gravity_offset": 0.015,
    "contact_stiffness": 0.1,
    "contact_damping": 0.4,
    "contact_angle": 0.005,
}
"""What a rival may answer with: fields of `kernel.Plant`, relative; angles in rad."""
ANGLES = ("gravity_offset", "contact_angle")
STIFFNESS_TOLERANCE = 0.15
STEP = 0.1  # tolerances, of the finite differences


@dataclass(frozen=True, kw_only=True)
class RivalRun:
    """Both rivals on one scaled input, with their first-order answers."""

    amplitude: float
    replay: Replay
    command: NDArray
    numbers: tuple[Numbers, Numbers]
    outputs: tuple[NDArray, NDArray]  # (n, channels) each
    answers: tuple[NDArray, NDArray]  # (parameters, n, channels) per tolerance, each


def field_of(name: str) -> int:
    return mp.Plant._fields.index(name)


def free_parameters(numbers: Numbers) -> list[tuple[str, float]]:
    """What a rival may answer with: fields of its plant and the spring's factor."""
    found = []
    for name, tolerance in TOLERANCES.items():
        value = numbers.plant[field_of(name)]
        if np.isfinite(value) and (value != 0.0 or name in ANGLES):
            found.append((name, tolerance))
    if np.any(numbers.spring[:, 2:] != 0.0):
        found.append(("spring", STIFFNESS_TOLERANCE))
    return found


def moved(numbers: Numbers, size: NDArray) -> Numbers:
    """Numbers with each free parameter so many tolerances away."""
    plant, spring = {}, numbers.spring
    for (name, tolerance), x in zip(free_parameters(numbers), size, strict=True):
        if name == "spring":
            spring = spring.copy()
            spring[:, 2:] *= np.exp(tolerance * x)
        elif name in ANGLES:
            plant[name] = numbers.plant[field_of(name)] + tolerance * x
        else:
            plant[name] = numbers.plant[field_of(name)] * np.exp(tolerance * x)
    return numbers.with_plant(**plant)._replace(spring=spring)


def answers_of(replay: Replay, numbers: Numbers, output: NDArray, at: NDArray) -> NDArray:
    """(parameters, n, channels): change of the readings per tolerance of each parameter."""
    steps = STEP * np.eye(at.size)
    found = replay.run_many([moved(numbers, at + step) for step in steps], failures="nan")
    return np.nan_to_num(found - output) / STEP


def unanswered(
    run: RivalRun, loser: int, weights: Mapping[int, float]
) -> tuple[float, NDArray, NDArray]:
    """Separation, the loser's answered readings (n, channels) and squares by channel.

    The answer is to first order: what the parameters' sensitivities reach.
    """
    wanted, scale = _wanted(run, loser, run.outputs[loser], weights)
    channels, answers = list(weights), run.answers[loser]
    J = (answers[:, :, channels] * scale).reshape(len(answers), -1)
    size = np.linalg.solve(J @ J.T + np.eye(len(J)), J @ wanted.ravel())
    output = run.outputs[loser] + np.tensordot(size, answers, 1)
    left, _ = _wanted(run, loser, output, weights)
    return _separation(left, size), output, _by_channel(left, channels, output.shape[1])


def answered(
    run: RivalRun, loser: int, weights: Mapping[int, float]
) -> tuple[float, NDArray, NDArray]:
    """As `unanswered`, the answer simulated and improved (Gauss-Newton with a line search)."""
    channels, numbers = list(weights), run.numbers[loser]
    output, answers, at = run.outputs[loser], run.answers[loser], np.zeros(len(run.answers[loser]))
    left, scale = _wanted(run, loser, output, weights)
    best = _separation(left, at)
    for _ in range(ROUNDS):
        J = (answers[:, :, channels] * scale).reshape(at.size, -1)
        step = np.linalg.solve(J @ J.T + np.eye(at.size), J @ left.ravel() - at)
        tried = [at + share * step for share in SHARES]
        runs = run.replay.run_many([moved(numbers, x) for x in tried], failures="nan")
        remains = [_wanted(run, loser, y, weights)[0] for y in runs]
        powers = [_separation(e, x) for e, x in zip(remains, tried, strict=True)]
        k_best = int(np.argmin(np.nan_to_num(powers, nan=np.inf)))
        if not powers[k_best] < best:
            break
        settled = powers[k_best] > 0.97 * best
        best, at, output, left = powers[k_best], tried[k_best], runs[k_best], remains[k_best]
        if settled:
            break
        answers = answers_of(run.replay, numbers, output, at)
    return best, output, _by_channel(left, channels, output.shape[1])


def _wanted(
    run: RivalRun, loser: int, output: NDArray, weights: Mapping[int, float]
) -> tuple[NDArray, NDArray]:
    """What the loser still lacks, (n, readings) in standard errors, and the weights."""
    channels = list(weights)
    scale = np.array([weights[c] for c in channels]) * np.sqrt(ROW_s / CORRELATED_s)
    return (run.outputs[1 - loser] - output)[:, channels] * scale, scale


def _separation(left: NDArray, size: NDArray) -> float:
    return float(np.sqrt(np.sum(left**2) + size @ size))


def _by_channel(left: NDArray, channels: list[int], count: int) -> NDArray:
    squares = np.zeros(count)
    squares[channels] = np.sum(left**2, axis=0)
    return squares
