"""What is said of a case: verdict, effects and values of a search's fit, and what remains."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.base import Context
from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.peak_temperature import recordings_with_test, reported_rise_K
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording
from rsea_core.identify.judgement.alternatives import considered, listed_rivals, nearest
from rsea_core.identify.judgement.covariance import Spread, between_laws, covariance
from rsea_core.identify.judgement.criteria import (
    FURTHER_CONFIDENCE,
    UNCLAIMED_CONFIDENCE,
    UNDECIDED_CONFIDENCE,
)
from rsea_core.identify.judgement.insufficient_data import question_of
from rsea_core.identify.judgement.reported_values import figures_with_std, shown
from rsea_core.identify.judgement.residual import UnexplainedResidual, unexplained_residual
from rsea_core.identify.judgement.sensor_correction import correct_sensors
from rsea_core.identify.judgement.unmodelled_gravity import (
    gravity_moved,
    unmodelled_gravity,
)
from rsea_core.identify.judgement.verdict import confidence, rivals, verdict_of
from rsea_core.identify.locate.unknown_input_test import unmodelled_input_detected
from rsea_core.identify.selection.common_scale_factor import (
    constants_phrase,
    named_scale,
)
from rsea_core.identify.selection.criteria import NOISE_SPREAD, TEMPERATURE, Search, tempering_of
from rsea_core.identify.selection.final_refinement import has_smaller_free_run_errors
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding
from rsea_core.recordings.quality_checks import data_errors

AMBIENT_C = 25.0


class Conclusion:
    """Everything that is said of one case.

    Parameters
    ----------
    search : Search
    recorded : Case or None
        The case with all its rows, which findings are about; None: the one that was searched.
    """

    unknown_torque: str | None = None  # that the model leaves, in words

    def __init__(self, search: Search, recorded: Case | None = None):
        self.search, self.problem = search, search.problem
        self.case, self.recorded = search.problem.case, recorded or search.problem.case
        self.fit: Fit = search.best or search.parameters
        self.nominal, self.laws = self.problem.values(self.fit.hypothesis, self.fit.x)
        share = tempering_of(self.fit.msni)
        self.spread, self.hessian = covariance(search.fitter, self.fit, tempering=share)
        self.unbalance = unmodelled_gravity(self.search.fitter, self.fit, self.spread)
        self.verdict = verdict_of(search, self.fit, named_by_values=self.unbalance is not None)
        if self.verdict == "missing-physics" and self.laws and not self._shown(0):
            self.verdict = "unexplained"
        self.question = question_of(self, search)
        if self.question is not None:
            self.verdict = "insufficient-data"
            self.unbalance = None if self.question.too_short else self.unbalance
        if self._has_unmodelled_input():
            self.verdict = "unexplained"
        self.nearest, self.residual = (), None
        if self.verdict == "unexplained":
            self.nearest, self.residual = self.effects(), unexplained_residual(search)
        if self.residual is not None and not self._runs_by_laws(self.residual):
            self._fit_jointly(self.residual)

    def predicted(self, prepared, hypothesis: Hypothesis, x: NDArray) -> NDArray:
        """Readings (n, p) that unknowns (u,) of a hypothesis predict for a whole recording."""
        return self.problem.predict(prepared, hypothesis, x[None])[0]

    def _has_unmodelled_input(self) -> bool:
        """Whether values alone seem to explain what still has a place in the machine."""
        quiet = self.verdict in ("no-mismatch", "parameters-only")
        return (
            quiet and self.search.effort.ports and unmodelled_input_detected(self.problem, self.fit)
        )

    def _runs_by_laws(self, residual: UnexplainedResidual) -> bool:
        """Whether the nearest laws, though not the answer, still replay best.

        What is blamed does not count, unless a table says what it does. What acted in one
        recording alone says nothing of others.
        """
        if all(law.only is not None for law in self.fit.hypothesis.laws):
            return False
        if residual.table is not None:
            return has_smaller_free_run_errors(self.problem, self.fit, residual.table.fit)
        return has_smaller_free_run_errors(
            self.problem, self.fit, residual.fit, without=residual.column
        )

    def _fit_jointly(self, residual: UnexplainedResidual) -> None:
        """Report the rig's values as they are beside what nothing explains, and its table."""
        self.fit, self.spread = residual.fit, Spread(sources=(residual.covariance,))
        if residual.table is not None:
            self.fit = residual.table.fit
            more = self.fit.x.size - len(residual.covariance)
            wide = np.pad(residual.covariance, (0, more))
            self.spread = Spread(sources=(wide, residual.table.covariance))
        self.nominal, self.laws = self.problem.values(self.fit.hypothesis, self.fit.x)
        self.unbalance = None

    def _shown(self, j: int) -> bool:
        return shown(self._figures(j))

    def less(self) -> Fit | None:
        """The best known fit without a further law of which no figure is told from none."""
        laws = self.fit.hypothesis.laws
        for j in range(len(laws) - 1, 0, -1):
            rest = Hypothesis(laws=laws[:j] + laws[j + 1 :])
            if rest.key in self.search.fits and not self._shown(j):
                return self.search.fits[rest.key]
        return None

    def take(self, fit: Fit) -> None:
        """Report the values of another fit of the same laws; verdict and scores stay.

        What the two fits differ by is known no better than that: it joins the spread.
        """
        moved = fit.x - self.fit.x
        self.fit = fit
        self.nominal, self.laws = self.problem.values(fit.hypothesis, fit.x)
        self.spread = self.spread.with_move(moved)
        self.unbalance = unmodelled_gravity(self.search.fitter, self.fit, self.spread)

    # ---- judgement

    def rivals(self) -> list[tuple[Fit, float]]:
        """Fits that name other effects, with how many log-likelihood units they are behind."""
        return rivals(self.search, self.fit)

    def confidence(self) -> float:
        """Probability that the named effects are there."""
        return confidence(self.search, self.fit)

    def effects(self) -> list[dict]:
        """The effects, most convincing first."""
        if self.verdict in ("no-mismatch", "parameters-only"):
            return []
        if self.residual is not None:
            return list(self.nearest)
        found = []
        confidence = self.confidence()
        if self.verdict == "unexplained":
            confidence = min(confidence, UNCLAIMED_CONFIDENCE)
        if self.verdict == "insufficient-data":
            too_short = self.question is not None and self.question.too_short
            confidence = min(
                confidence, UNCLAIMED_CONFIDENCE if too_short else UNDECIDED_CONFIDENCE
            )
        mine = self.fit.hypothesis.effects
        others = considered(self.search, self.fit) if mine else []
        for j, law in enumerate(self.fit.hypothesis.laws):
            near = listed_rivals(nearest(self.search, self.fit, others, law.effect), mine)
            alike = [
                e["name"] for e in near if e["delta_score"] < TEMPERATURE and "screened" not in e
            ]
            figures = self._figures(j)
            own = confidence if j == 0 else FURTHER_CONFIDENCE * confidence
            if j > 0 and not shown(figures):  # its spread may have grown since the search
                own = min(own, UNCLAIMED_CONFIDENCE)
            found.append(
                {
                    "name": law.effect,
                    "subsystem": law.subsystem,
                    "confidence": round(own, 3),
                    "law": law.law,
                    "parameters": figures,
                    "class": [law.effect, *alike],
                    "alternatives": near,
                }
            )
        named = LoadUnbalance.effect in self.fit.hypothesis.effects
        if self.unbalance is not None and not named and self.verdict != "unexplained":
            found.append(self.unbalance)
        return sorted(found, key=lambda e: -e["confidence"])

    def _figures(self, j: int) -> dict:
        return figures_with_std(
            self.problem, self.fit, self.spread, j,
            lambda x: self.reported_figures(x, j), self._other_laws(j),
        )  # fmt: skip

    def _alike(self) -> list[tuple[Fit, float]]:
        """Fits of other laws of the same effects, and log-likelihood units behind the best."""
        mine, best = self.fit.hypothesis, self.search.score(self.fit)
        return [
            (f, best - self.search.score(f))
            for f in self.search.ranked()
            if mine.laws
            and f.hypothesis.places == mine.places
            and f.hypothesis.key != mine.key
            and np.isfinite(self.search.score(f))
        ]

    def _other_laws(self, j: int) -> list[tuple[dict, float]]:
        """Figures of effect j by other laws, and log-likelihood units behind the best."""
        return [(self.reported_figures(f.x, j, f.hypothesis), gap) for f, gap in self._alike()]

    def between(self, j: int) -> float:
        """Variance of nominal value j among other laws."""
        others = [(f.x[j], gap) for f, gap in self._alike()]
        return between_laws(self.fit.x[j], others, TEMPERATURE)

    def reported_figures(self, x: NDArray, j: int, hypothesis: Hypothesis | None = None) -> dict:
        hypothesis = hypothesis or self.fit.hypothesis
        nominal, laws = self.problem.values(hypothesis, x)
        law = hypothesis.laws[j]
        stiffness = nominal.get(
            "spring_stiffness_Nm_per_rad", self.case.rig.spring_stiffness_Nm_per_rad or 1.0
        )
        rise = 0.0
        if law.effect == DriveThermal.effect:
            rise = reported_rise_K(self.problem, hypothesis, x, self._warmed)
        values = laws[j]
        # what mass and offset have taken of an unbalance belongs to it
        if law.effect == LoadUnbalance.effect:
            moved = gravity_moved(self.problem, x)
            values = {k: v + float(moved[int(k == "cos_Nm")]) for k, v in values.items()}
        context = Context(
            spring_stiffness_Nm_per_rad=stiffness, peak_winding_rise_K=rise,
            ambient_C=self.ambient(), recording=law.only or "",
            full_command=self.case.rig.full_command(self.case.recordings[0].command_name),
        )  # fmt: skip
        return law.figures(values, self.case.rig, context)

    def ambient(self) -> float:
        """Temperature of the room: the case's before the first recording."""
        for r in self.case.recordings:
            if "temperature_C" in r:
                return float(np.mean(r["temperature_C"][: max(5, r.rows // 200)]))
        return AMBIENT_C

    @cached_property
    def _warmed(self) -> list[PreparedRecording]:
        return recordings_with_test(self.problem, self.ambient())

    def explained_excess(self) -> float:
        """Share of the MSNI above noise that the effects take away."""
        before = float(np.sum(np.maximum(self.search.parameters.msni - 1.0, 0.0)))
        after = float(np.sum(np.maximum(self.fit.msni - 1.0, 0.0)))
        return max(0.0, 1.0 - after / before) if before > 0.0 else 0.0

    def mismatched_recordings(self) -> str:
        """Phrase: which recordings carry the mismatch."""
        msni = self.search.parameters.msni
        order = np.argsort(-msni)
        named = [
            f"{self.problem.fitted[b].recording.file} ({np.sqrt(msni[b]):.1f} times the noise)"
            for b in order[:3]
            if msni[b] > 1.0 + NOISE_SPREAD
        ]
        if named:
            return "after re-estimating parameters, in " + ", ".join(named)
        return (
            f"in a common factor of {constants_phrase(self.restored_constants)}"
            if self.restored_constants
            else "nowhere"
        )

    @property
    def restored_constants(self) -> tuple[str, ...]:
        """Constants that a scale, named for them, brings home."""
        shared = named_scale(self.search, self.fit)
        return shared.constants if shared else ()

    def data_errors(self) -> tuple[Finding, ...]:
        """What is wrong with the files and explained by nothing that was found."""
        claimed = self.verdict == "missing-physics"
        found = zip(self.fit.hypothesis.laws, self.laws, strict=True) if claimed else ()
        return data_errors(correct_sensors(self.recorded, tuple(found)))

    # ---- the model

    def rig(self) -> Rig:
        """The rig with the values that were found."""
        known = {key: value for key, value in self.nominal.items() if hasattr(self.case.rig, key)}
        for key, value in known.items():
            if key.endswith("viscous_Nms_per_rad"):
                known[key] = max(value, 0.0)
        return replace(self.case.rig, **known)
