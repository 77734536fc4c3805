"""Which values of a rig file a fit may move."""

from dataclasses import replace

import pytest

from rsea_core.identify.candidates.rig_parameters import held_jointly, nominals, unstated_std
from rsea_core.machine.inputs import Load
from rsea_core.machine.tolerances import TOLERANCES
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

RATIO = 5.0


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return axis_case(tmp_path_factory.mktemp("axis"), axis_recording(seed=1), rig=axis_rig())


def keys(case, **values):
    rig = replace(axis_rig(), gear_ratio=RATIO, **values)
    return {p.key for p in nominals(replace(case, rig=rig))}


@pytest.mark.parametrize("quantity", ["inertia_kgm2", "viscous_Nms_per_rad"])
def test_of_both_sides_of_a_gear_the_value_that_may_err_by_more_at_the_output_is_free(
    case, quantity
):
    motor, output = f"motor_{quantity}", f"output_{quantity}"
    sides = {motor: 1e-3, output: 0.02}  # 0.025 at the output
    stated = ((motor, 0.1), (output, 0.1))
    assert {motor} == keys(case, **sides, tolerances=stated) & {*sides}
    stated = ((motor, 0.1), (output, 0.13))
    assert {output} == keys(case, **sides, tolerances=stated) & {*sides}
    assert {motor} == keys(case, **{motor: 1e-3, output: None}) & {*sides}
    assert {output} == keys(case, **{motor: None, output: 0.02}) & {*sides}


def test_what_is_held_jointly_with_a_free_value_counts_on_that_values_side_of_the_gear():
    rig = replace(
        axis_rig(), gear_ratio=RATIO, motor_inertia_kgm2=1e-3, output_inertia_kgm2=0.02,
        tolerances=(("motor_inertia_kgm2", 0.1), ("output_inertia_kgm2", 0.3)),
    )  # fmt: skip
    assert held_jointly(rig, "motor_inertia_kgm2") == pytest.approx(0.02 / RATIO**2)
    assert held_jointly(rig, "output_inertia_kgm2") == pytest.approx(1e-3 * RATIO**2)
    assert unstated_std(rig, "motor_inertia_kgm2") == pytest.approx(0.3 * 0.02 / RATIO**2)
    assert unstated_std(rig, "output_inertia_kgm2") == pytest.approx(0.1 * 1e-3 * RATIO**2)


def load_damping_tolerance(case, **values):
    rig = replace(axis_rig(), gear_ratio=RATIO, **values)
    found = {p.key: p.tolerance for p in nominals(replace(case, rig=rig))}
    return found["load_viscous_Nms_per_rad"]


def test_unstated_damping_of_a_rigid_train_widens_the_prior_of_the_loads_damping(case):
    stated = load_damping_tolerance(case, motor_viscous_Nms_per_rad=1e-4)
    assert stated == TOLERANCES["load_viscous_Nms_per_rad"]
    assert load_damping_tolerance(case) > 1.3 * stated
    assert load_damping_tolerance(case, motor_viscous_Nms_per_rad=0.0) == stated
    assert load_damping_tolerance(case, motor_inertia_kgm2=0.0) == stated  # no body, no damping
    spring = {"parts": ("drive", "gear", "spring", "load"), "spring_stiffness_Nm_per_rad": 5.0}
    assert load_damping_tolerance(case, **spring) == stated  # both bodies are seen


@pytest.mark.parametrize(
    ("anchors", "tolerances", "expected"),
    [
        ((), {}, TOLERANCES["load_mass_kg"]),
        ((), {"load_mass_kg": 0.003, "load_distance_m": 0.004}, 0.005),
        (("load_mass_kg",), {"load_mass_kg": 0.003, "load_distance_m": 0.004}, 0.004),
        (("load_mass_kg",), {}, None),
        (("load_distance_m",), {"load_mass_kg": 0.003, "load_distance_m": 0.004}, 0.003),
        (("load_mass_kg", "load_distance_m"), {"load_distance_m": 0.004}, None),
    ],
)
def test_a_weight_is_as_uncertain_as_mass_and_distance_together(
    tmp_path, anchors, tolerances, expected
):
    """A mass that was weighed does not settle the weight's torque where its distance is stated."""
    rig = replace(
        axis_rig(), load_mass_kg=2.0, load_distance_m=0.1, anchors=anchors,
        tolerances=tuple(tolerances.items()),
    )  # fmt: skip
    recording = replace(axis_recording(seed=1), load=Load(kind="pendulum"))
    found = {p.key: p.tolerance for p in nominals(axis_case(tmp_path, recording, rig=rig))}
    assert found.get("load_mass_kg") == (None if expected is None else pytest.approx(expected))


def tolerance(case, key, **values):
    rig = replace(axis_rig(), **values)
    return {p.key: p.tolerance for p in nominals(replace(case, rig=rig))}[key]


@pytest.mark.parametrize(
    ("key", "absent"),
    [("motor_inertia_kgm2", "load_inertia_kgm2"), ("load_inertia_kgm2", "motor_inertia_kgm2")],
)
def test_an_unstated_inertia_of_a_rigid_train_widens_the_prior_of_the_other(case, key, absent):
    assert tolerance(case, key) == TOLERANCES[key]
    assert tolerance(case, key, **{absent: None}) > 1.0
