"""Cogging along the recorded motion: order analysis of what a fit leaves.

A screening with the engine takes a wave's phase from the simulated angle. Where this errs by a part
of a cycle - a free axis, many cycles in a turn - almost any number of cycles seems to explain as
much as the right one. Here the phase is that of the smoothed readings, and the response that of the
linear errors' machine (`shape_search.response`): one linear regression for each number.
"""

from collections.abc import Sequence

import numpy as np

import rsea_core.engines.event_driven.states as k
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.screening import Candidate, Projection
from rsea_core.identify.law_search.shape_search import ports, response
from rsea_core.identify.whole_runs.forms import fixed_numbers

CYCLES = "cycles_per_rev"


def along_motion(projection: Projection, laws: Sequence[Law]) -> list[Candidate]:
    """Cogging of one wave of a fixed number of cycles, the largest held-out gain first.

    Start and gain of a candidate are those of the regression.
    """
    tracks, found = projection.estimator.tracks, []
    if "G" not in ports(tracks[0]):
        return []
    scale, ratio = float(tracks[0].scale.torque_Nm[0]), tracks[0].experiment.where.ratio
    for law in laws:
        if law.kind is not MotorCogging or [*fixed_numbers(law)] != [CYCLES]:
            continue
        if len(law.unknowns) != 3:  # with a second wave
            continue
        cycles, columns = fixed_numbers(law)[CYCLES], []
        for wave in (np.sin, np.cos):
            torques = [-scale * wave(cycles * ratio * t.motion[:, k.TW]) for t in tracks]
            moved = [
                e + response(t, "G", torque)
                for e, t, torque in zip(projection.level, tracks, torques, strict=True)
            ]
            columns.append(projection.column(moved))
        judged = projection.judged(np.array(columns))
        if judged is None:
            continue
        size, gain, held_out, deviation = judged
        amplitudes = dict(zip(("sin_Nm", "cos_Nm"), size * scale / ratio, strict=True))
        start = tuple(float(amplitudes.get(u.name, cycles)) for u in law.unknowns)
        found.append(Candidate(law=law, start=start, gain=gain, held_out=held_out,
                               deviation=deviation, size=1.0))  # fmt: skip
    return sorted(found, key=lambda c: -c.held_out)
