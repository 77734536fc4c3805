"""A law that changes the machine's frequency is found in short windows, where it stays in phase."""

from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.whole_runs.sensor_noise import converged, in_sensor_noise, misfit
from rsea_core.identify.whole_runs.short_rivals import rivals_of_short_windows
from tests.cases.one_axis import pendulum_case


def test_a_spring_parallel_to_gravity_is_a_rival_of_what_whole_recordings_suggest(tmp_path):
    case = pendulum_case(tmp_path, SpringParallel(stiffness_Nm_per_rad=0.2), seed=2)
    found = begun(case, None, lambda text: None)
    own = in_sensor_noise(found.base_estimator, found.base)
    plain = converged(own, found.base.hypothesis, found.base.x)
    rivals = rivals_of_short_windows(own, plain, plain, laws_of(found))
    best = max(rivals, key=lambda t: t.gain)
    assert best.law.effect == SpringParallel.effect
    assert best.left < 1.2 < misfit(own, plain.hypothesis, plain.x)
