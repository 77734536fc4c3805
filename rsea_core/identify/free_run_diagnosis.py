"""The diagnosis of a bench: free runs of whole recordings are fitted, ranked and judged."""

from collections.abc import Callable, Mapping
from copy import copy

from rsea_core.identify.fitting.decimation import decimate
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.fitting.truncation import MOST_STEPS, MOST_STEPS_QUICK, truncate
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.corrected_model import FoundModel, heat_left, rest_of
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.result.diagnosis_json import document_of, findings_of
from rsea_core.identify.selection.criteria import Search
from rsea_core.identify.selection.final_refinement import (
    final_refinement,
    restore_prior,
    window_refinement,
    worsens_free_runs,
)
from rsea_core.identify.selection.search import investigate
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind

QUICK_STEP_s, STEP_s = 2e-3, 1e-3
QUICK_LOOK = Finding(
    kind=Kind.METHOD,
    text="a quick look: few fits on rows of 2 ms; run without --quick before acting on it",
)
MISLEADING = Finding(
    kind=Kind.METHOD,
    text="the effects found make free runs of the recordings worse than parameters alone do:"
    " model.toml holds the parameters alone",
)


def diagnose_free_runs(
    case: Case,
    *,
    quick: bool = False,
    thorough: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Locate, name and fit what a case's recordings show and its rig file does not.

    Raises
    ------
    RecordingError
        If nothing in the recordings can be replayed.
    """
    step = None if thorough else QUICK_STEP_s if quick else STEP_s
    rows = decimate(case, QUICK_STEP_s) if quick else case
    fitted, cut = (rows, ()) if thorough else truncate(
        rows, step, MOST_STEPS_QUICK if quick else MOST_STEPS
    )  # fmt: skip
    problem = Problem(fitted, step_s=step)
    search = investigate(problem, quick=quick, say=say)
    conclusion = _conclusion(search, search.best or search.parameters, case, quick=quick)
    while (less := conclusion.less()) is not None:
        conclusion = _conclusion(search, less, case, quick=quick)
    if not quick and conclusion.fit is search.best:
        values = window_refinement(search)
        if values is not conclusion.fit:
            conclusion.take(values)
    shown, findings = conclusion, [*findings_of(conclusion), *cut, *([QUICK_LOOK] if quick else [])]
    if conclusion.residual is None and worsens_free_runs(search, conclusion.fit):
        shown = _parameters_of(conclusion)
        findings.append(MISLEADING)
    laws = tuple(zip(shown.fit.hypothesis.laws, shown.laws, strict=True))
    if conclusion.verdict in ("no-mismatch", "parameters-only"):
        laws = ()
    rig = shown.rig()
    model = FoundModel(
        rig=rig,
        contact=_contact_changes(shown),
        laws=laws,
        ambient_C=conclusion.ambient(),
        initial_rises_K=heat_left(problem, laws, rig.terminal_resistance_ohm or 0.0),
        rest_rad=rest_of(problem, laws, rig.spring_stiffness_Nm_per_rad or 0.0),
    )
    return Diagnosis(
        document=document_of(conclusion, findings),
        model=model,
        conclusion=conclusion,
        findings=tuple(findings),
    )


def _conclusion(search: Search, fit: Fit, case: Case, *, quick: bool) -> Conclusion:
    """The conclusion of a fit, free directions at their priors; refined but in a quick look."""
    search.best = restore_prior(search.fitter, fit)
    if not quick:
        search.best = final_refinement(search.fitter, search.best)
    return Conclusion(search, case)


def _parameters_of(conclusion: Conclusion) -> Conclusion:
    """The conclusion with the fit of parameters alone in place of the chosen one."""
    plain = copy(conclusion)
    plain.fit = conclusion.search.parameters
    plain.nominal, plain.laws = plain.problem.values(plain.fit.hypothesis, plain.fit.x)
    return plain


def _contact_changes(conclusion: Conclusion) -> Mapping[str, float]:
    """Corrections of the contact's numbers: factors of stiffness and damping, shift of angle."""
    found = {}
    for p in conclusion.problem.nominals:
        if p.key.startswith("contact_"):
            value = conclusion.nominal[p.key]
            found[p.key] = value - p.value if p.additive else value / p.value
    return found
