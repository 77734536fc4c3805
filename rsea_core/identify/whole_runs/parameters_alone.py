"""Parameters alone fitted to whole recordings, with steps of the engine that are short enough.

In windows the engine's error stays small. Over a whole recording of a machine without a restoring
torque it accumulates, and where sensors are precise it is mistaken for missing physics.
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.shape_search import shapes
from rsea_core.identify.multistep.criteria import (
    BRIEFLY_SOUND,
    LEAST_EXCESS,
    LEAST_FINENESS,
    SHAPE_SHARE,
    SOUND,
    STEP_ERROR,
    STEP_SHARE,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import in_steps
from rsea_core.identify.whole_runs.sensor_noise import (
    excess,
    in_sensor_noise,
    misfit,
    well_fitted,
)

BRIEF = 4  # iterations of that fit, from the values that windows ended with


def parameters_alone(own: Estimator, fit: Estimate, say) -> tuple[Estimator, Estimate, float]:
    """Parameters alone fitted to whole recordings, and their misfit.

    Parameters
    ----------
    own : Estimator
        Of whole recordings (`in_sensor_noise`). The one returned has shorter engine steps if half
        of a step changes the errors by more than `STEP_SHARE` of the misfit.
    """
    own, plain, left = _in_fine_steps(own, own.fit(fit.hypothesis, fit.x, iterations=12), say)
    if SOUND < left < np.inf:
        own, plain, left = _in_fine_steps(own, well_fitted(own, plain), say)
    return own, plain, left


def found_sound(found: Found, say) -> Found:
    """The search with the misfit of parameters alone over whole recordings, if they suffice.

    For `--quick`, which does not search whole recordings: the same search where they do not.
    """
    if found.base_horizon is not None:
        return found
    own = in_sensor_noise(found.base_estimator, found.base)
    h = found.base.hypothesis
    fit = own.fit(h, found.base.x, iterations=BRIEF)
    left, more = misfit(own, h, fit.x), excess(own, h, fit.x)
    if not left < (SOUND if more < LEAST_EXCESS else BRIEFLY_SOUND):
        return found
    say(f"whole recordings: parameters alone leave {left:.2f} deviations of the sensors' noise")
    return replace(found, left_by_parameters=left, excess=more)


def _in_fine_steps(own: Estimator, fit: Estimate, say) -> tuple[Estimator, Estimate, float]:
    """An estimator whose steps do not cause the misfit, the fit continued with it, its misfit."""
    h, left = fit.hypothesis, misfit(own, fit.hypothesis, fit.x)
    while SOUND < left < np.inf and own.problem.steps.fineness > LEAST_FINENESS:
        steps = own.problem.steps
        finer = in_steps(own, steps._replace(fineness=0.5 * steps.fineness))
        moved = step_error(own, finer, fit)
        if moved < max(STEP_ERROR, STEP_SHARE * left):
            break
        fit = finer.fit(h, fit.x, iterations=12)
        own, before, left = finer, left, misfit(finer, h, fit.x)
        say(
            f"  whole recordings: half of the engine's step changes errors by {moved:.2g}"
            f" deviations; with it parameters leave {left:.2f} instead of {before:.2f}"
        )
    return own, fit, left


def step_error(own: Estimator, finer: Estimator, fit: Estimate) -> float:
    """Largest root mean square [noise deviations] by which other steps change a reading's error."""
    trial = [(fit.hypothesis, fit.x)]
    pairs = zip(own.innovations(trial), finer.innovations(trial), strict=True)
    return max(float(np.sqrt(np.max(np.mean((e[0] - f[0]) ** 2, axis=0)))) for e, f in pairs)


def with_shape(found: Found, own: Estimator, say) -> Found:
    """What was found, and the torque of unknown shape that explains most of what parameters leave.

    In windows a slow torque can pass for noise that whole recordings do not have.
    """
    own, plain, _ = parameters_alone(own, found.base, say)
    best = next(iter(shapes(Projection(own, plain))), None)
    had = excess(own, plain.hypothesis, plain.x)
    if best is None or had == 0.0:
        return found
    share = best.held_out / had
    say(f"whole recordings: {best.sentence()}, explains {share:.2f} of the excess")
    if share < max(SHAPE_SHARE, found.explained_once):  # a torque that acts once explains more
        return found
    return replace(found, base_shapes=[best, *found.base_shapes])
