"""Values that leave much of the torque unknown explain nothing, whatever they are."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.multistep.criteria import UNKNOWN_SHARE
from rsea_core.identify.multistep.noise_estimate import SLOW_INPUT
from rsea_core.identify.window_diagnosis import diagnose_windows, place_of_unknown
from rsea_core.identify.window_fit import explains_only_negligible_torque
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import ROW_s, axis_case, axis_rig


def shaken_recording(seed: int, share: float) -> Recording:
    """An axis on which random torques act that the log does not have.

    share : of their standard deviation over the command's amplitude
    """
    rng = np.random.default_rng(seed)
    time = ROW_s * np.arange(1200)
    command = 1.2 * np.sin(2.0 * np.pi * 0.8 * time + rng.uniform(0.0, 6.0))
    unlogged = 1.2 * share * rng.standard_normal(time.size)
    inputs = Inputs(time_s=time, current_command_A=command + unlogged, load=Load(kind="free"))
    angle = Replay.of(inputs, step_s=2e-3).run(ActuatorModel(axis_rig()))[:, 0]
    read = angle + 1e-4 * rng.standard_normal(time.size)
    columns = {"time_s": time, "current_command_A": command, "motor_angle_rad": read}
    return Recording(file=f"shaken{seed}.csv", role="identification", load=Load(kind="free"),
                     columns=columns, sample_time_s=ROW_s)  # fmt: skip


@pytest.mark.parametrize(("share", "verdict"), [(3.0, "unexplained"), (0.0, "no-mismatch")])
def test_values_of_the_rig_do_not_explain_large_random_torques(tmp_path, share, verdict):
    made = [shaken_recording(seed, share) for seed in (1, 2)]
    found = diagnose_windows(axis_case(tmp_path, *made, rig=axis_rig()), quick=True).document
    assert found["verdict"] == verdict
    if verdict == "unexplained":
        assert "leave an unknown torque" in found["remainder"]["words"]
        assert "of the usual torque" in found["remainder"]["words"]


@pytest.mark.parametrize(
    ("share", "complete", "sensor", "negligible"),
    [
        (0.5, False, None, True),
        (2.0, False, None, False),
        (0.5, True, None, False),  # whole recordings show it
        (0.5, False, "load_angle_rad", False),  # no torque
    ],
)
def test_laws_of_windows_explain_nothing_where_hardly_a_torque_is_unknown(
    share, complete, sensor, negligible
):
    """Cogging of 0.2 % of the torque was claimed for an offset that drifts (31001, u01)."""
    usual, torque = 3.0, share * UNKNOWN_SHARE * 3.0
    inputs = np.zeros(SLOW_INPUT + 1)
    inputs[SLOW_INPUT] = torque
    track = SimpleNamespace(
        noise=SimpleNamespace(inputs=inputs), scale=SimpleNamespace(torque_Nm=(usual,), time_s=1.0)
    )
    step = SimpleNamespace(law=SimpleNamespace(sensor=sensor))
    found = SimpleNamespace(
        complete=complete, steps=[step], base_estimator=SimpleNamespace(tracks=[track])
    )
    assert explains_only_negligible_torque(found) == negligible


@pytest.mark.parametrize(("gain", "place"), [(20.0, "drive"), (60.0, "sensor:current_A")])
def test_the_place_is_that_of_a_law_or_of_the_unknown_torque_whichever_gains_more(gain, place):
    """A gain that differs with the command's sign was placed in a sensor that drifts (u03)."""
    shape = SimpleNamespace(subsystem="drive", held_out=40.0)
    step = SimpleNamespace(gain=gain, law=SimpleNamespace(subsystem="sensor:current_A"))
    found = SimpleNamespace(steps=[step], shapes=[shape])
    assert place_of_unknown(found, shape) == place
