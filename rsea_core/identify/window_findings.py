"""Findings about the files that the model found confirms, or refutes."""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.multistep.criteria import COMPLETE, OUTLIER
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import Track
from rsea_core.recordings.finding import Finding, Kind

ROWS = (Kind.JUMP, Kind.SPIKE)  # findings about single rows
INCONSISTENT = (
    Kind.SIGN,
    Kind.AGAINST,
    Kind.UNIT,
)  # about a reading that others or the rig file contradict


def stands(
    finding: Finding, tracks: Sequence[Track], innovations: Sequence[NDArray], *,
    complete: bool, wrong_sensors: Collection[str | None],
) -> bool:  # fmt: skip
    """Whether a finding is confirmed by the innovations of the model found.

    A reading is not inconsistent if a complete model without an error of its sensor predicts it
    to the noise: with a dead zone of the drive, a correct current disagrees with the voltage.

    Parameters
    ----------
    innovations : sequence of (1, n, p) array
        Of each track.
    complete : bool
        Whether laws leave nothing but noise of whole recordings.
    wrong_sensors : collection of str
        Columns to which laws attribute an error.
    """
    if finding.kind is Kind.INITIAL_MOTION:
        return False  # starts are estimated here
    if finding.kind not in (*ROWS, *INCONSISTENT):
        return True
    for t, e in zip(tracks, innovations, strict=True):
        r = t.experiment
        if r.recording.file == finding.file and finding.column in r.channels:
            own = e[0][:, r.channels.index(finding.column)]
            if finding.kind in ROWS:
                return bool(np.max(np.abs(own)) > OUTLIER)
            predicted = np.sqrt(np.mean(huber_squares(own))) < COMPLETE
            return not (complete and predicted and finding.column not in wrong_sensors)
    return finding.kind in INCONSISTENT
