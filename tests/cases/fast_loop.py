"""An axis in a position loop that runs faster than its log, with a coarse encoder."""

import numpy as np

from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import ROW_s, axis_rig

COUNTS = 1024


def fast_loop_rig() -> Rig:
    """The axis of `axis_rig` with the encoder of the loop."""
    return axis_rig(counts=COUNTS)


def fast_loop_recording(*, seed: int, per_row: int = 8, rows: int = 800) -> Recording:
    """A proportional-derivative loop around three sines, each row's first command in the log.

    Speed and angle of a tick follow exactly from its current and the wheel's inertia and damping.
    """
    rig = fast_loop_rig()
    inertia = rig.motor_inertia_kgm2 + rig.load_inertia_kgm2
    tick, count = ROW_s / per_row, 2.0 * np.pi / COUNTS
    rng = np.random.default_rng(seed)
    time = tick * np.arange(rows * per_row)
    goal = sum(0.4 * (1.0 - np.cos(2.0 * np.pi * f * time)) * np.sign(rng.uniform(-1.0, 1.0))
               for f in (0.23, 0.51, 0.94))  # fmt: skip
    corner = 15.0  # rad/s
    stiff = inertia * corner**2 / rig.torque_constant_Nm_per_A
    slope = 1.4 * inertia * corner / rig.torque_constant_Nm_per_A
    rate = rig.load_viscous_Nms_per_rad / inertia
    kept = np.exp(-rate * tick)
    reach = (1.0 - kept) / rate
    angle = speed = before = 0.0
    phase = rng.uniform()
    commands, read = np.empty(time.size), np.empty(time.size)
    for j, wanted in enumerate(goal):
        now = count * np.floor(angle / count + phase)
        current = stiff * (wanted - now) - slope * (now - before) / tick
        commands[j], read[j], before = current, now, now
        settled = rig.torque_constant_Nm_per_A * current / (rate * inertia)
        angle += settled * tick + (speed - settled) * reach
        speed = settled + (speed - settled) * kept
    columns = {"time_s": time[::per_row], "current_command_A": commands[::per_row],
               "motor_angle_rad": read[::per_row]}  # fmt: skip
    return Recording(
        file=f"loop{seed}.csv", role="identification", load=Load(kind="free"), columns=columns,
        sample_time_s=ROW_s,
    )  # fmt: skip
