"""Predictions start and move as the machine did, not as its sensors misread it."""

import numpy as np
import pytest

from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.predictions import Windows
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case

RATIO, ROW_s, ROWS, OFFSET_rad = 50.0, 0.005, 800, 0.01
RIG = Rig(
    name="joint", parts=("drive", "gear", "spring", "load"), torque_constant_Nm_per_A=0.08,
    current_limit_A=20.0, motor_inertia_kgm2=1e-5, motor_viscous_Nms_per_rad=5e-5,
    gear_ratio=RATIO, spring_stiffness_Nm_per_rad=300.0, load_inertia_kgm2=0.3,
    motor_encoder_counts_per_rev=4096, load_encoder_counts_per_rev=20000,
)  # fmt: skip


def moved_by_hand(folder, read_rad: np.ndarray) -> MultistepProblem:
    """A joint whose link is moved while its motor has no current."""
    columns = {
        "time_s": ROW_s * np.arange(ROWS),
        "current_command_A": np.zeros(ROWS),
        "motor_angle_rad": np.zeros(ROWS),
        "load_angle_rad": read_rad,
    }
    recording = Recording(
        file="hand.csv", load=Load(kind="imposed"), columns=columns, sample_time_s=ROW_s,
        initial_rest=True,
    )  # fmt: skip
    return MultistepProblem(axis_case(folder, recording, rig=RIG))


def predicted_motor_rad(problem: MultistepProblem, h: Hypothesis, x, windows) -> np.ndarray:
    prepared = problem.fitted[0]
    machine = [problem.trial_machine(prepared, h, x)]
    return prepared.readings(prepared.runs(machine, windows), machine, windows)[0][:, 0]


@pytest.mark.parametrize("cut", [False, True])
def test_a_link_moved_by_hand_moved_as_its_sensor_reads_less_the_offset(tmp_path, cut):
    """The motor follows the link: an offset of 0.01 rad was half a turn of it."""
    true = 0.1 * np.sin(0.8 * np.pi * ROW_s * np.arange(ROWS)) ** 2
    motion = np.zeros((ROWS, 5))
    motion[:, 1], motion[:, 3] = true, true
    plain = moved_by_hand(tmp_path, true)
    misread = moved_by_hand(tmp_path, true + OFFSET_rad)
    law = catalogue(misread.case)["sensor-offset/constant@load_angle_rad"]
    found = []
    for problem, h, values, off in (
        (plain, Hypothesis(), [], 0.0),
        (misread, Hypothesis(laws=(law,)), [(OFFSET_rad,)], OFFSET_rad),
    ):
        read = motion + off * np.array([0.0, 0.0, 0.0, 1.0, 0.0])
        rows = np.array([[0, 399], [400, ROWS - 1]])
        windows = Windows(rows=rows, motion=read) if cut else None
        found.append(predicted_motor_rad(problem, h, problem.start(h, values), windows))
    assert np.ptp(found[0]) > 0.5 * RATIO * np.ptp(true)
    assert found[1] == pytest.approx(found[0], abs=1e-8 * RATIO)
