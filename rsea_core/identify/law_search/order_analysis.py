"""Cogging along the recorded motion: order analysis of what a fit leaves.

A screening with the engine takes a wave's phase from the simulated angle. Where this errs by a part
of a cycle - a free axis, many cycles in a turn - almost any number of cycles seems to explain as
much as the right one, or none does. Here the phase is that of the smoothed readings, and the
response that of the linear errors' machine (`shape_search.responses`): one linear regression for
each number.
"""

from collections.abc import Sequence

import numpy as np

import rsea_core.engines.event_driven.states as k
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.screening import Candidate, Projection
from rsea_core.identify.law_search.shape_search import ports, responses

AMPLITUDES, CYCLES = ("sin_Nm", "cos_Nm"), "cycles_per_rev"


def along_motion(projection: Projection, laws: Sequence[Law]) -> list[Candidate]:
    """Cogging of one wave, the largest held-out gain first.

    Of a law with a free number of cycles, the start with the largest held-out gain is given. Start
    and gain of a candidate are those of the regression.
    """
    if "G" not in ports(projection.estimator.tracks[0]):
        return []
    found = []
    for law in laws:
        if law.kind is not MotorCogging or [u.name for u in law.unknowns] != [*AMPLITUDES, CYCLES]:
            continue
        tried = [_with_cycles(projection, law, c) for c in sorted({s[-1] for s in law.starts})]
        best = max(filter(None, tried), key=lambda c: c.held_out, default=None)
        found += [] if best is None else [best]
    return sorted(found, key=lambda c: -c.held_out)


def _with_cycles(projection: Projection, law: Law, cycles: float) -> Candidate | None:
    """A law of one wave with a number of cycles in a turn; None where it moves no reading."""
    tracks = projection.estimator.tracks
    scale, ratio = float(tracks[0].scale.torque_Nm[0]), tracks[0].experiment.where.ratio
    moved = []
    for t in tracks:
        angle = cycles * ratio * t.motion[:, k.TW]
        moved.append(responses(t, "G", -scale * np.array([np.sin(angle), np.cos(angle)])))
    judged = projection.judged(projection.columns(moved))
    if judged is None:
        return None
    size, gain, held_out, deviation = judged
    start = (*(float(a) for a in size * scale / ratio), cycles)
    return Candidate(
        law=law, start=start, gain=gain, held_out=held_out, deviation=deviation, size=1.0
    )
