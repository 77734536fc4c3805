"""Two joints of this package on a chain of MuJoCo, free and against a wall: error, books, time.

    python -m benchmarks.arm

Both joints are the bench's (motor, gear 60, 20 mNm of dry friction at the motor, spring 65.8
Nm/rad) under a PD law of the motor's angle, 2 s. "torque error" is the rms difference of the
joints' spring torque from each joint alone on the engine that locates every event, under the same
commands and the same motion of its load; "books" is the largest difference between the work that
the chain received and what the joint alone gave; "chain" is what the chain has lost, which without
damping and contact is MuJoCo's own error. Exit status 1 where the free arm with RK4 at 1 ms is off
by more than 1e-4 of the span of its torque, or its books by more than 1e-4 of the work.
"""

import sys
import time
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from rsea_core import ActuatorModel, Rig
from rsea_core.effects import GearFriction
from rsea_core.interop.arm import Arm, ArmRun, JointReadings

GEAR, DURATION_s = 60.0, 2.0
RIG = replace(
    Rig.preset("rsea-bench"), motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None
)
JOINT = ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.02),))
JOINTS = {"shoulder": JOINT, "elbow": JOINT}
FREE, WALL = 10.0, 0.2  # where the wall stands [m]
LIMIT = 1e-4


def chain(
    step_s: float, *, integrator: str = "implicitfast", wall_m: float = FREE, damping: float = 0.0
) -> mujoco.MjModel:
    """Two links that hang, 0.3 and 0.25 m, and a wall before the tip."""
    link = 'contype="0" conaffinity="0"'
    hinge = f'type="hinge" axis="0 -1 0" damping="{damping}"'
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step_s}" integrator="{integrator}"/>
<compiler angle="radian"/><worldbody>
<geom name="wall" type="plane" size="2 2 .1" pos="{wall_m} 0 0" euler="0 -1.5707963 0"/>
<body><joint name="shoulder" {hinge}/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3" mass="1" {link}/>
<body pos="0 0 -.3"><joint name="elbow" {hinge}/>
<geom type="capsule" size=".015" fromto="0 0 0 0 0 -.25" mass=".5" {link}/>
<geom name="tip" type="sphere" size=".02" pos="0 0 -.25" mass=".1"/>
</body></body></worldbody></mujoco>"""
    )


def law(time_s: float, y: JointReadings) -> NDArray:
    """Duty of a PD law of the motor's angle; both joints swing out and back at 0.5 Hz."""
    goal = np.array([0.5, -0.3]) * (1.0 - np.cos(np.pi * time_s))
    lag = goal - y.motor_angle_rad / GEAR
    return np.clip(3.0 * lag - 0.002 * y.motor_velocity_rad_per_s, -1.0, 1.0)


def judged(ran: ArmRun) -> tuple[float, float]:
    """Torque error and difference of the books, of the worst joint, as shares of their spans."""
    torque, work = 0.0, 0.0
    for j, name in enumerate(ran.names):
        alone = ran.precise(name)
        apart = np.sqrt(np.mean((alone.torque_Nm - ran.torque_Nm[:, j]) ** 2))
        torque = max(torque, apart / np.ptp(ran.torque_Nm[:, j]))
        books = np.abs(alone.energy.load_work_J + ran.work_J[:, j]).max()
        work = max(work, books / np.ptp(ran.work_J[:, j]))
    return float(torque), float(work)


def main() -> int:
    """Print the table."""
    print("arm         integrator    step    torque error  books    chain      CPU for 2 s")
    met = True
    for name, wall, damping in (("free", FREE, 0.0), ("wall", WALL, 0.02)):
        for integrator in ("implicitfast", "RK4"):
            for step_s in (2e-3, 1e-3, 5e-4):
                made = chain(step_s, integrator=integrator, wall_m=wall, damping=damping)
                arm, begun = Arm(made, JOINTS), time.process_time()
                ran = arm.run(law, duration_s=DURATION_s)
                spent = time.process_time() - begun
                torque, work = judged(ran)
                lost = ran.lost_in_chain_J()[-1]
                print(
                    f"{name:11} {integrator:13} {step_s * 1e3:3g} ms {torque:12.2g}"
                    f"  {work:7.2g}  {lost:9.2g} J  {spent:.2f} s"
                )
                if (name, integrator, step_s) == ("free", "RK4", 1e-3):
                    met = max(torque, work) <= LIMIT
    print("met" if met else "MISSED")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
