"""What follows from a sensor known to misread is no inconsistency of the files."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.judgement.sensor_correction import correct_sensors
from rsea_core.recordings.quality_checks import data_errors
from tests.cases.planted import planted


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("sensor-scale/factor@load_angle_rad", {"scale": 1.3}),
        ("sensor-offset/constant@current_A", {"offset": 0.4}),
    ],
)
def test_a_sensor_known_to_misread_is_read_right(tmp_path, key, values):
    case = planted(tmp_path).case
    law = catalogue(case)[key]
    misread = [
        replace(r, columns=dict(r.columns) | {law.sensor: _read(r[law.sensor], **values)})
        for r in case.recordings
    ]
    found = correct_sensors(replace(case, recordings=tuple(misread)), [(law, values)])
    for right, true in zip(found.recordings, case.recordings, strict=True):
        np.testing.assert_allclose(right[law.sensor], true[law.sensor], rtol=1e-12, atol=1e-15)
        assert set(right.columns) == set(true.columns)


def test_errors_that_follow_from_a_known_scale_are_none(tmp_path):
    case = planted(tmp_path).case
    law = catalogue(case)["sensor-scale/factor@torque_Nm"]
    wrong = {"scale": 6.0}
    misread = tuple(
        replace(r, columns=dict(r.columns) | {law.sensor: _read(r[law.sensor], **wrong)})
        for r in case.recordings
    )
    case = replace(case, recordings=misread)
    assert any("torque_Nm is 6" in f.text for f in data_errors(case))
    assert not data_errors(correct_sensors(case, [(law, wrong)]))


def _read(true, scale=1.0, offset=0.0):
    return scale * true + offset
