"""A found model predicts unseen inputs as the simulator replays them."""

import numpy as np
import pytest

from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import read_test

TIME_s = np.arange(800) / 1000.0
DUTY = np.where(TIME_s > 0.05, 0.2, 0.0)
COLUMNS = {
    "supply_V": 24.0 - 8.0 * (TIME_s > 0.4),
    "drive_enabled": (TIME_s < 0.6).astype(float),
}


def _test_folder(folder, columns):
    table = np.column_stack([TIME_s, DUTY, *columns.values()])
    header = ",".join(("time_s", "duty", *columns))
    np.savetxt(folder / "input.csv", table, delimiter=",", header=header, comments="")
    (folder / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "locked"\n')
    return folder


@pytest.mark.parametrize("names", [(), ("supply_V",), ("drive_enabled",), tuple(COLUMNS)])
def test_prediction_follows_the_measured_supply_and_the_open_bridge(tmp_path, names):
    rig, columns = Rig.preset("rsea-bench"), {name: COLUMNS[name] for name in names}
    (test,) = read_test(_test_folder(tmp_path, columns), rig)
    found = FoundModel(rig=rig, contact={}, laws=(), ambient_C=25.0).predict(test)
    inputs = Inputs(time_s=TIME_s, duty=DUTY, load=Load(kind="locked"))
    rows = Replay.of(inputs, **columns).run(ActuatorModel(rig))
    plain = Replay.of(inputs).run(ActuatorModel(rig))
    torque = CHANNELS.index("torque_Nm")
    assert found["torque_Nm"] == pytest.approx(rows[:, torque], rel=1e-9, abs=1e-9)
    apart = np.max(np.abs(found["torque_Nm"] - plain[:, torque]))
    assert (apart > 0.01 * np.ptp(plain[:, torque])) == bool(names)


def test_a_spring_alone_is_predicted_from_the_deflection_that_its_test_gives(tmp_path):
    stiffness, branch, time = 50.0, 10.0, 0.5
    turned = 0.1 * np.sin(2.0 * np.pi * TIME_s)
    table = np.column_stack([TIME_s, turned])
    names = "time_s,spring_deflection_rad"
    np.savetxt(tmp_path / "input.csv", table, delimiter=",", header=names, comments="")
    (tmp_path / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "imposed"\n')
    rig = Rig(name="bench", parts=("spring",), spring_stiffness_Nm_per_rad=stiffness)
    (test,) = read_test(tmp_path, rig)
    term = SpringViscoelastic(branch_stiffness_1_Nm_per_rad=branch, branch_time_1_s=time)
    model = FoundModel(rig=rig, contact={}, laws=(), ambient_C=25.0, terms=(term,))
    found = model.predict(test)
    assert set(found) == {"time_s", "torque_Nm"}
    # one Maxwell branch under a sine from rest: q' = d' - q/T in closed form
    w, a = 2.0 * np.pi, 0.1 * 2.0 * np.pi
    q = a * (w * np.sin(w * TIME_s) + np.cos(w * TIME_s) / time - np.exp(-TIME_s / time) / time)
    q /= w**2 + 1.0 / time**2
    assert found["torque_Nm"] == pytest.approx(stiffness * turned + branch * q, abs=1e-3)
