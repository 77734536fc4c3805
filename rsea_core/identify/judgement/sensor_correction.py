"""Recordings with what a diagnosis found of their sensors taken away."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.variant import Law
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.case import Case


def correct_sensors(case: Case, laws: Sequence[tuple[Law, Mapping[str, float]]]) -> Case:
    """The case as right sensors would have read it, for scales and offsets.

    What follows from a sensor that is known to misread contradicts nothing.

    Parameters
    ----------
    laws : sequence of (law, values)
        Those of other effects change nothing.
    """
    recordings = list(case.recordings)
    for law, values in laws:
        if law.effect not in (SensorScale.effect, SensorOffset.effect):
            continue
        for j, r in enumerate(recordings):
            if law.sensor in r.columns:
                read = (r[law.sensor] - values.get("offset", 0.0)) / values.get("scale", 1.0)
                columns = dict(r.columns) | {law.sensor: read_only(read)}
                recordings[j] = replace(r, columns=columns)
    return replace(case, recordings=tuple(recordings))
