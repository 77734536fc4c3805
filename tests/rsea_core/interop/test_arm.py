"""Joints on a chain of MuJoCo: error of the exchange, energy books, callback, URDF."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

from benchmarks.arm import JOINTS, WALL, chain, judged, law  # noqa: E402
from rsea_core.errors import InputError  # noqa: E402
from rsea_core.interop.arm import Arm  # noqa: E402

URDF = """<robot name="arm"><link name="base"/>
<link name="link"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="link"/>
<axis xyz="0 -1 0"/><limit lower="-3" upper="3" effort="100" velocity="10"/></joint></robot>"""


def test_a_free_arm_is_as_its_joints_alone_and_its_energy_books_close():
    ran = Arm(chain(1e-3, integrator="RK4"), JOINTS).run(law, duration_s=0.25)
    torque, work = judged(ran)
    assert torque < 1e-4
    assert work < 1e-4
    assert abs(ran.lost_in_chain_J()).max() < 1e-9
    alone = ran.precise("elbow")
    assert abs(alone.energy.imbalance_J()).max() < 1e-9


def test_halving_the_step_quarters_the_error():
    coarse, fine = (
        judged(Arm(chain(step), JOINTS).run(law, duration_s=0.2))[0] for step in (2e-3, 1e-3)
    )
    assert 3.0 < coarse / fine < 5.0


def test_a_wall_at_the_tip_takes_energy_and_the_torque_shows_it():
    made = chain(1e-3, wall_m=0.5 * WALL)
    data = mujoco.MjData(made)
    ran = Arm(made, JOINTS).run(law, duration_s=0.6, data=data)
    assert data.ncon > 0
    assert ran.lost_in_chain_J()[-1] > 0.0
    assert judged(ran)[0] < 0.01


def test_the_callback_is_the_run():
    made = chain(1e-3)
    ran = Arm(made, JOINTS).run(law, duration_s=0.1)
    arm, data = Arm(made, JOINTS, law), mujoco.MjData(made)
    try:
        mujoco.set_mjcb_control(arm.control)
        for _ in range(100):
            mujoco.mj_step(made, data)
    finally:
        mujoco.set_mjcb_control(None)
    assert data.qpos == pytest.approx(ran.load_angle_rad[-1], abs=1e-9)


def test_a_urdf_chain_runs():
    made = mujoco.MjModel.from_xml_string(URDF)
    ran = Arm(made, {"shoulder": JOINTS["shoulder"]}).run(
        lambda t, y: 0.2 * np.sin(6.0 * t), duration_s=0.2
    )
    assert np.ptp(ran.load_angle_rad) > 1e-3


def test_what_cannot_run_is_refused():
    made = chain(1e-3)
    with pytest.raises(InputError, match="no hinge 'wrist' in the chain; it has shoulder, elbow"):
        Arm(made, {"wrist": JOINTS["elbow"]})
    with pytest.raises(InputError, match="not finite"):
        Arm(made, JOINTS).run(lambda t, y: [np.nan, 0.0], duration_s=0.1)
    with pytest.raises(InputError, match="not RK4"):
        Arm(chain(1e-3, integrator="RK4"), JOINTS, law)
