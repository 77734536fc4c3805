"""Laws that leave more than noise stand together if they explain nearly all of it."""

import numpy as np

from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.search import begun
from rsea_core.identify.multistep.criteria import COMPLETE, EXPLAINED_TOGETHER
from rsea_core.identify.whole_runs.complete import with_whole_runs
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

SPRING = SpringParallel(stiffness_Nm_per_rad=0.004)


def searched(folder, *terms) -> tuple[Found, Found | None]:
    """The search of an axis whose reading has an error that no law describes."""
    recording = axis_recording(*terms, seed=1)
    white = np.random.default_rng(5).standard_normal(recording.rows + 40)
    slow = 6e-3 * np.convolve(white, np.ones(41) / 41, mode="valid")
    read = recording["motor_angle_rad"] + slow
    disturbed = Recording(
        file=recording.file, load=recording.load, sample_time_s=ROW_s,
        columns={**recording.columns, "motor_angle_rad": read},
    )  # fmt: skip
    case = axis_case(folder, disturbed, rig=axis_rig())
    return with_whole_runs(begun(case, None, lambda _: None), lambda _: None)


def test_two_laws_that_explain_nearly_all_stand_despite_an_error_of_the_log(tmp_path):
    found, nearly = searched(tmp_path, SPRING, LoadFriction(coulomb_Nm=0.01))
    assert not found.complete
    spring, friction = sorted((step.law.effect for step in nearly.steps), reverse=True)
    assert spring == "spring-parallel"
    assert friction in ("gear-friction", "load-friction")  # one rigid body: the same friction
    assert EXPLAINED_TOGETHER < nearly.explained < 1.0
    left = nearly.estimator.innovations([(nearly.best.hypothesis, nearly.best.x)])
    assert np.sqrt(np.mean(left[0][0] ** 2)) > COMPLETE


def test_no_second_law_stands_where_the_rest_is_an_error_of_the_log(tmp_path):
    found, nearly = searched(tmp_path, SPRING)
    best = found if found.complete else nearly
    assert [step.law.effect for step in best.steps] == ["spring-parallel"]
