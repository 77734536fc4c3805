"""Of laws that gain the same the plainest is taken: a scale factor of an encoder only as the last.

Encoders have whole counts, and every machine has friction: these explanations come first.
"""

from types import SimpleNamespace

import pytest

from rsea_core.effects.drive_dead_zone import DriveDeadZone
from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.whole_runs.search import WholeSearch, plainest
from rsea_core.identify.whole_runs.taken_laws import Trial

DOUBT = 8.0


def trial(effect, gain: float, *, sensor: str = "", values: int = 1, prior: float = 0.0) -> Trial:
    law = SimpleNamespace(
        effect=effect.effect, sensor=sensor, unknowns=(SimpleNamespace(scale=1.0),) * values,
        subsystem=effect.port.value[0],
    )  # fmt: skip
    return Trial(
        candidate=SimpleNamespace(law=law), fit=SimpleNamespace(prior_cost=prior), gain=gain,
        left=1.0,
    )  # fmt: skip


@pytest.mark.parametrize("sensor", ["motor_angle_rad", "load_angle_rad"])
def test_a_spring_of_two_values_comes_before_a_scale_factor_of_an_angle(sensor):
    factor, spring = (
        trial(SensorScale, 500.0, sensor=sensor),
        trial(SpringParallel, 498.0, values=2),
    )
    assert plainest([factor, spring], DOUBT) is spring


def test_a_scale_factor_that_explains_clearly_more_is_taken():
    factor = trial(SensorScale, 500.0, sensor="load_angle_rad")
    assert plainest([factor, trial(SpringParallel, 300.0)], DOUBT) is factor


def test_a_scale_factor_of_a_torque_is_not_put_last():
    factor = trial(SensorScale, 500.0, sensor="spring_torque_Nm")
    assert plainest([factor, trial(SpringParallel, 498.0, values=2)], DOUBT) is factor


def test_friction_comes_before_a_dead_zone_of_the_drive():
    dead_zone, friction = trial(DriveDeadZone, 500.0), trial(LoadFriction, 498.0, values=2)
    assert plainest([dead_zone, friction], DOUBT) is friction


def test_of_equally_plain_laws_the_one_nearest_to_the_rig_file_is_taken():
    far, near = trial(LoadFriction, 500.0, prior=9.0), trial(SpringParallel, 499.0, prior=1.0)
    assert plainest([far, near], DOUBT) is near


def test_a_move_of_the_rig_values_that_is_nearly_free_does_not_outweigh_the_fit():
    close, closer = (
        trial(LoadFriction, 2_400_714.0, prior=2.0),
        trial(SpringParallel, 2_400_000.0, prior=1.6),
    )
    assert plainest([closer, close], DOUBT) is close


def test_of_laws_that_fit_alike_the_one_at_the_load_is_taken():
    """Friction of a rigid train is the same in the gear and at the load."""
    gear, load = trial(GearFriction, 500.001), trial(LoadFriction, 500.0)
    assert plainest([gear, load], DOUBT) is load
    assert plainest([trial(GearFriction, 505.0), load], DOUBT).gain == 505.0


def test_no_small_law_is_taken_where_the_errors_cost_no_more_than_noise():
    """One reading errs by more than its noise, the others by less."""
    begun = SimpleNamespace(excess=lambda: 0.0, taken=[LoadFriction])
    assert not WholeSearch.add_small(begun, [trial(SpringParallel, 10.0)], print)
