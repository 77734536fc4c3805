"""Inertia, gravity and gear of one joint come from a robot model; what is none is one line."""

import pytest

from rsea_core.errors import RigError
from rsea_core.importing.robot_model import rig_values

URDF = """<robot name="a"><link name="b"/><link name="arm"><inertial><origin xyz="0 0 -0.2"/>
<mass value="0.5"/><inertia ixx="1e-3" iyy="2e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
</link><joint name="elbow" type="revolute"><parent link="b"/><child link="arm"/>
<axis xyz="0 1 0"/><dynamics damping="0.04"/></joint></robot>"""
MJCF = """<mujoco><worldbody><body name="arm"><inertial pos="0 0 -0.2" mass="0.5"
diaginertia="1e-3 2e-3 1e-3"/><joint name="elbow" axis="0 1 0" damping="0.04"/></body></worldbody>
<actuator><motor joint="elbow" gear="50"/></actuator></mujoco>"""


@pytest.mark.parametrize("text", [URDF, MJCF])
def test_a_joint_gives_the_same_values_in_both_formats(text, tmp_path):
    (tmp_path / "robot.xml").write_text(text)
    found = {key: value for key, (value, _) in rig_values(tmp_path / "robot.xml", "elbow").items()}
    assert found["load_mass_kg"] == 0.5
    assert found["load_distance_m"] == pytest.approx(0.2)
    assert found["load_inertia_kgm2"] == pytest.approx(2e-3 + 0.5 * 0.04)
    assert found["load_viscous_Nms_per_rad"] == 0.04
    assert found.get("gear_ratio") == (50.0 if text is MJCF else None)


@pytest.mark.parametrize(
    ("text", "joint", "message"),
    [(URDF, "elbo", "nearest: elbow"), ("<a/>", "x", "neither MJCF"), ("<rob", "x", "not XML"),
     (URDF.replace('"0.5"', '"x"'), "elbow", "not a number")],
)  # fmt: skip
def test_a_file_that_is_no_robot_model_is_one_line(text, joint, message, tmp_path):
    (tmp_path / "robot.xml").write_text(text)
    with pytest.raises(RigError, match=message):
        rig_values(tmp_path / "robot.xml", joint)
