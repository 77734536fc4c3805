"""How warm the winding becomes in a case's recordings, the one that it is tested on included."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.variant import RunConditions
from rsea_core.engines.fixed_step.layout import WINDING_RISE
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.errors import RseaError
from rsea_core.identify.fitting.predictions import numbers_of
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording, Problem
from rsea_core.recordings.case import read_test

MOST_RISE_K = 300.0  # of a winding over ambient; the highest thermal class of IEC 60085 is 250 C


def recordings_with_test(problem: Problem, ambient_C: float) -> list[PreparedRecording]:
    """The recordings, and the test's inputs after them where the case holds some (contract)."""
    folder = Path(problem.case.folder) / "test"
    recordings = list(problem.prepared)
    if not recordings or not (folder / "test.toml").exists():
        return recordings
    try:
        tests = read_test(folder, problem.case.rig)
    except RseaError:  # for `dftfs predict` to refuse
        return recordings
    past = np.concatenate([problem.heat, [[-1.0, 0.0]]])
    for test in tests:
        inputs, last = test.inputs, recordings[-1]
        replay = Replay.of(
            inputs, supply_V=test.supply_V, drive_enabled=test.drive_enabled,
            step_s=problem.step_s,
        )  # fmt: skip
        warm = test.initial_temperature_C
        where = RunConditions(
            index=last.where.index + 1, file=test.file, kind=inputs.load.kind,
            ratio=last.where.ratio, session_s=last.where.session_s + np.ptp(last.where.time_s),
            case_rise_K=0.0 if warm is None else max(warm - ambient_C, 0.0),
            time_s=np.array(inputs.time_s), past=past,
        )  # fmt: skip
        base = replay.numbers(problem.model)
        recordings.append(replace(last, replay=replay, where=where, base=base, windows=None))
        past = np.concatenate([past, [[float(np.ptp(inputs.time_s)), 0.0], [-1.0, 0.0]]])
    return recordings


def peak_rise_K(
    problem: Problem, hypothesis: Hypothesis, x: NDArray, recordings: Sequence[PreparedRecording]
) -> float:
    """Largest rise of the winding above ambient in replays of recordings."""
    peak = 0.0
    for prepared in recordings:
        (numbers,) = numbers_of([problem.trial_machine(prepared, hypothesis, x)])
        _, states = prepared.replay.run(numbers, with_states=True)
        peak = max(peak, float(states[:, WINDING_RISE].max()))
    return peak


def reported_rise_K(
    problem: Problem, hypothesis: Hypothesis, x: NDArray, recordings: Sequence[PreparedRecording]
) -> float:
    """Peak rise over all recordings; without the test, where it would exceed the limit."""
    rise = peak_rise_K(problem, hypothesis, x, recordings)
    return rise if rise < MOST_RISE_K else peak_rise_K(problem, hypothesis, x, problem.prepared)
