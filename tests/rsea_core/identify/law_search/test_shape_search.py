"""A torque of unknown shape is seen where it acts, also in a narrow range of the angle."""

import numpy as np
import pytest

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.shape_search import Shape, shapes
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.machine.inputs import Load
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import COUNTS, axis_case, axis_rig

ROW_s, ROWS, PARTS = 0.01, 2000, 10
FRICTION_Nm, FRICTION_AT_rad, FRICTION_WIDTH_rad = 0.06, 0.4, 0.2


def axis_with_local_friction(friction_Nm: float, size: float = 1.0) -> Recording:
    """An axis with friction in one range of its angle, in steps of 1 ms; size of the motion."""
    rig = axis_rig()
    inertia = rig.motor_inertia_kgm2 + rig.load_inertia_kgm2
    tau = ROW_s * np.arange(ROWS)
    goal = size * (0.7 * np.sin(1.9 * tau) + 0.4 * np.sin(4.3 * tau + 1.0))
    current, angle = np.zeros(ROWS), np.zeros(ROWS)
    theta = omega = 0.0
    for row in range(ROWS):
        angle[row] = theta
        current[row] = 1.5 * (goal[row] - theta) - 0.15 * omega
        for _ in range(PARTS):
            friction = (
                friction_Nm
                * (abs(theta - FRICTION_AT_rad) < FRICTION_WIDTH_rad)
                * np.tanh(omega / 0.01)
            )
            torque = rig.torque_constant_Nm_per_A * current[row] - friction
            torque -= rig.load_viscous_Nms_per_rad * omega
            omega += torque / inertia * ROW_s / PARTS
            theta += omega * ROW_s / PARTS
    count = 2.0 * np.pi / COUNTS
    columns = {
        "time_s": tau, "current_command_A": current,
        "motor_angle_rad": np.floor(angle / count) * count,
    }  # fmt: skip
    return Recording(
        file=f"local{size}.csv", load=Load(kind="free"), columns=columns, sample_time_s=ROW_s,
        initial_rest=True,
    )  # fmt: skip


def best_shape(folder, friction_Nm: float, sizes=(1.0,)):
    recordings = [axis_with_local_friction(friction_Nm, size) for size in sizes]
    case = axis_case(folder, *recordings, rig=axis_rig())
    estimator, base, _ = parameters(MultistepProblem(case), Hypothesis(), lambda text: None)
    return shapes(Projection(estimator, base))[0]


def test_friction_in_a_narrow_range_of_the_angle_is_a_shape_of_friction(tmp_path):
    best = best_shape(tmp_path, FRICTION_Nm)
    assert best.friction
    assert best.sentence().startswith("friction at the gear that follows the wheel angle")
    assert best.held_out > 60.0
    where = best.nodes[int(np.argmax(best.values))]
    assert abs(where - FRICTION_AT_rad) < FRICTION_WIDTH_rad


def test_an_axis_without_it_shows_no_shape(tmp_path):
    assert best_shape(tmp_path, 0.0).held_out < 20.0


def test_a_shape_is_one_function_for_recordings_of_small_and_of_large_motion(tmp_path):
    best = best_shape(tmp_path, FRICTION_Nm, (0.6, 2.0))
    assert best.friction
    assert best.signal == "wheel angle"
    inside = np.abs(best.nodes - FRICTION_AT_rad) < 0.75 * FRICTION_WIDTH_rad
    assert np.mean(best.values[inside]) == pytest.approx(FRICTION_Nm, rel=0.1)


@pytest.mark.parametrize(
    ("port", "linear", "expected"),
    [("G", False, "3.5 Nm"), ("G", True, "3.5 N "), ("V", True, "3.5 V")],
)
def test_a_shape_states_its_size_in_the_unit_of_its_axis(port, linear, expected):
    size = np.array([0.0, 3.5, 1.0, 2.0])
    found = Shape(port=port, signal="wheel angle", nodes=np.arange(4.0), values=size, gain=1.0,
                  held_out=1.0, deviation=1.0, is_linear=linear)  # fmt: skip
    assert expected in found.sentence()
