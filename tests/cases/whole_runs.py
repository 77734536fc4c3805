"""A search of whole recordings before its first law, of an axis whose rig file lacks something."""

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.command_timing import CommandTiming
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case, axis_rig


def found_by_parameters(
    estimator: Estimator, base: Estimate, horizon: float | None = None
) -> Found:
    """A search without laws so far."""
    return Found(problem=estimator.problem, base_estimator=estimator, base=base,
                 estimator=estimator, best=base, horizon=horizon)  # fmt: skip


def searched_axis(
    folder, *recordings: Recording, timing: CommandTiming | None = None
) -> tuple[Found, Estimator, Estimate]:
    """Parameters alone by windows; whole recordings in the sensors' noise, and parameters there."""
    case = axis_case(folder, *recordings, rig=axis_rig())
    h = Hypothesis(laws=nuisances(case))
    estimator, base, horizon = parameters_with_timing(case, h, lambda text: None, timing=timing)
    found = found_by_parameters(estimator, base, horizon)
    own = in_sensor_noise(estimator)
    return found, own, own.fit(base.hypothesis, base.x, iterations=12)
