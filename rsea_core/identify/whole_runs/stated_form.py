"""Whether friction that the rig file states holds rigidly at rest or by an elastic stretch.

A data sheet states the level alone. A fit moves the stretch slowly towards none, where the engine's
steps are too long for it; so both forms are fitted before the search, and whole recordings decide.
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import first_growth
from rsea_core.identify.whole_runs.sensor_noise import converged, in_sensor_noise, misfit
from rsea_core.recordings.case import Case

ALIKE = 1.02  # misfit of the rigid form over the other's, up to which it is taken


def with_stated_form(case: Case, say, *, quick: bool = False) -> Case:
    """The case with stated terms in the form that leaves least of whole recordings."""
    if not case.known:
        return case
    typical = typical_magnitudes_of(case)
    plain = replace(case, known=tuple(k.without_form(typical) for k in case.known))
    if plain.known == case.known:
        return case
    rigid, elastic = (_left(c, say, quick=quick) for c in (plain, case))
    say(f"stated friction: rigid it leaves {rigid:.2f} deviations, else {elastic:.2f}")
    return plain if np.isfinite(rigid) and rigid <= ALIKE * elastic else case


def _left(case: Case, say, *, quick: bool) -> float:
    own, fit, _ = first_growth(case, Hypothesis(laws=nuisances(case)), say, quick=quick)
    own = in_sensor_noise(own, fit)
    end = converged(own, fit.hypothesis, fit.x)
    return misfit(own, end.hypothesis, end.x)
