"""A drift of the amplifier's offset: found in its recording, no effect, and part of no model."""

import numpy as np
import pytest

from rsea_core.effects.drive_offset import COMMAND_DRIFT
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.multistep.log_nuisances import offset_drifts
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

DRIFT_A_per_s = 0.004


def test_the_engine_adds_a_drift_to_the_command_of_each_row():
    since = 0.01 * np.arange(200)
    time, current = 5.0 + since, np.sin(3.0 * since)
    model = ActuatorModel(axis_rig())

    def angle(command, drift):
        inputs = Inputs(time_s=time, current_command_A=command, load=Load(kind="free"))
        replay = Replay.of(inputs, step_s=2e-3)
        numbers = replay.numbers(model)
        fx = numbers.fx.copy()
        fx[COMMAND_DRIFT] = drift
        return replay.run(numbers._replace(fx=fx))[:, 0]

    np.testing.assert_allclose(angle(current, 0.3), angle(current + 0.3 * since, 0.0), atol=1e-12)


def test_an_offset_that_drifts_is_no_missing_physics(tmp_path):
    drifts = (DRIFT_A_per_s, -DRIFT_A_per_s)
    made = [axis_recording(seed=s, drift_A_per_s=d) for s, d in zip((1, 2), drifts, strict=True)]
    found = diagnose_windows(axis_case(tmp_path, *made, rig=axis_rig(off=1.1)))
    assert found.document["verdict"] in ("parameters-only", "no-mismatch")
    assert not found.document["effects"]
    fit = found.conclusion.fit.hypothesis.laws
    values = {law.only: v for law, v in zip(fit, found.conclusion.laws, strict=True) if law.only}
    for r, drift in zip(made, drifts, strict=True):
        assert values[r.file]["drift_per_s"] == pytest.approx(drift, rel=0.1)
    assert any("drifts by" in f.text for f in found.findings)
    assert not any(law.only for law, _ in found.model.laws)


def test_each_recording_that_is_fitted_has_a_drift_of_its_own(tmp_path):
    made = [axis_recording(seed=s, role=r) for s, r in ((1, "identification"), (2, "validation"))]
    (law,) = offset_drifts(axis_case(tmp_path, *made, rig=axis_rig()))
    assert (law.only, law.nuisance) == ("axis1.csv", True)
