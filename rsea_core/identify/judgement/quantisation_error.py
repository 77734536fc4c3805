"""What moves every fit and no innovation shows: the counts of encoders, the step of the replay.

An encoder counts from somewhere between two counts: all readings of a recording are off by the
same part of a count, and thousands of rows do not average it. A load's angle of 18 counts knows
its gravity no better than that. Where the motion repeats itself, the rounding repeats itself too
and has a part in step with the motion, which looks like a little damping. (Noise of counts is
white only where the signal is busy: Widrow and Kollar, Quantization Noise (2008), ch. 20.) So the
readings of the fitted machine are counted again from several places. And a replay in steps stands
for a machine without steps: where a resonance is known to a millionth, the step decides the next
digits. Both are held fixed in the fit and pass into its values by the derivatives at hand:
consider covariance (Schmidt, Advances in Control Systems 3 (1966) 293; Bierman, Factorization
Methods for Discrete Sequential Estimation (1977), ch. VIII).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.engines.fixed_step.replay import Numbers
from rsea_core.engines.fixed_step.step_length import DEFAULT_STEP_s, longest_step_s
from rsea_core.identify.fitting.jacobian import Jacobian
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import PreparedRecording, Problem, predict_readings, prepare

COUNTED = {
    "motor_angle_rad": ("motor_encoder_counts_per_rev", "start_motor_rad"),
    "load_angle_rad": ("load_encoder_counts_per_rev", "start_load_rad"),
}
HELD = ("locked", "imposed")
PLACES, PLACES_STRIDE = 8, 3  # within a count, from which an encoder may have begun
STEP_LEFT = 4.0 / 3.0
"""All that the step does over what half of it takes away, in an engine of second order."""


def counts_of(problem: Problem, fit: Fit) -> list[tuple[int, NDArray]]:
    """Innovations (blocks, channels) by counting the fitted readings from several places.

    Each over the root of the number of places, so that their squares add to a variance. Where a
    recording begins away from zero, the replay begins within a count of the machine.

    Returns
    -------
    list of (index of the fitted recording, innovations)
    """
    found = []
    for b, prepared in enumerate(problem.fitted):
        machine = problem.trial_machine(prepared, fit.hypothesis, fit.x)
        for j, name in enumerate(prepared.channels):
            field, start = COUNTED.get(name, ("", ""))
            counts = getattr(problem.case.rig, field, None)
            if not counts:
                continue
            count = 2.0 * np.pi / counts
            began, place = places()
            off = np.zeros(PLACES)
            held = name == "load_angle_rad" and prepared.recording.load.kind in HELD
            if not held and abs(prepared.measured[0, j]) > 0.5 * count:
                off = count * (place - np.floor(place + began))
            machines = [
                replace(machine, **{start: getattr(machine, start) + o}) for o in (0.0, *off)
            ]
            read = predict_readings(prepared.replay, machines, prepared.channels, prepared.where)
            error = read[1:] - read[0]
            error[:, :, j] += rounding(read[1:, :, j], count, began)
            if np.all(np.isfinite(error)):
                found += [(b, e / np.sqrt(PLACES)) for e in prepared.whitener(error)]
    return found


def places() -> tuple[NDArray, NDArray]:
    """Where counters began and where machines stood, within a count: an even lattice (PLACES,)."""
    k = np.arange(PLACES)
    return (k + 0.5) / PLACES, (PLACES_STRIDE * k % PLACES + 0.5) / PLACES


def rounding(values: NDArray, count: float, began: NDArray) -> NDArray:
    """Errors (m, n) of counted values (m, n) whose counters began within a count (m,)."""
    return count * np.floor(values / count + began[:, None]) - values


def finer_of(problem: Problem, fit: Fit, derivatives: Jacobian) -> list[tuple[int, NDArray]]:
    """Changes of the innovations (blocks, channels) of each recording by half the step."""
    fine = [_finer(problem, prepared, fit) for prepared in problem.fitted]
    found = problem.innovations(fit.hypothesis, fit.x[None], fine)
    changes = [e[0] - old for e, old in zip(found, derivatives.innovations, strict=True)]
    return [(b, c) for b, c in enumerate(changes) if np.all(np.isfinite(c))]


def pulls_of(derivatives: Jacobian, innovations: list[tuple[int, NDArray]]) -> list[NDArray]:
    """What given innovations of recordings pull at the unknowns, (n,) each: J' W e."""
    return [
        np.einsum("itc,tc->i", derivatives.columns[b], derivatives.weights[b] * e, optimize=True)
        for b, e in innovations
    ]


def _finer(problem: Problem, prepared: PreparedRecording, fit: Fit) -> PreparedRecording:
    """The recording replayed in half its steps."""
    step = problem.step_s
    if step is None:
        d = problem.trial_machine(prepared, fit.hypothesis, fit.x)
        n = Numbers(d.plant, d.regions, d.fx)
        step = min(longest_step_s(n.plant, n.spring, n.fx), DEFAULT_STEP_s)
    step = min(step, prepared.recording.sample_time_s)
    replay, _ = prepare(problem.model, prepared.recording, step_s=0.5 * step)
    return replace(prepared, replay=replay)
