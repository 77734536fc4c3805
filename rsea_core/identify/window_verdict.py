"""What is said of a case by the multistep search: verdict, effects, confidence, values."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.identify.candidates.catalogue import indistinguishable, of_one_body, rivals_of
from rsea_core.identify.candidates.rig_parameters import place_of
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.criteria import UNBALANCE_TOLERANCES, UNBALANCE_OFFSET_rad
from rsea_core.identify.judgement.reported_values import shown, sizes_shown
from rsea_core.identify.judgement.unmodelled_gravity import gravity_entry
from rsea_core.identify.law_search.candidate_fits import count_values
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.hold_out import HeldOut, beyond_chance, free_run
from rsea_core.identify.law_search.shape_search import Shape
from rsea_core.identify.law_search.window_lengths import fails_in_longer_windows
from rsea_core.identify.multistep.criteria import (
    DEPENDENT,
    DOUBTED_ERROR,
    LEAST_RATIO,
    NO_PREDICTION,
    PER_VALUE,
    RIVAL_SCALE,
    RIVAL_SHARE,
    SHAPE_BETTER,
    SHAPE_GAIN,
    SHAPE_MORE,
    SHAPE_RATIO,
    UNCLAIMED,
    UNEVEN_GAIN,
    WORSE,
)
from rsea_core.identify.multistep.horizons import relative_error
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.known_values import moved_tolerances
from rsea_core.identify.window_confidence import step_confidence, step_presence
from rsea_core.identify.window_findings import stands
from rsea_core.identify.window_fit import (
    FoundFit,
    FoundSearch,
    explains_only_negligible_torque,
    fit_of,
    late_command,
    leaves_much_torque,
    leaves_some_torque,
    ranked_explanations,
    spread_of,
    strained_value,
    unknown_torque,
)
from rsea_core.identify.window_formula import (
    CommandFormula,
    gain_over_named,
    unnamed_formula,
)
from rsea_core.machine.rig import Rig
from rsea_core.machine.tolerances import TOLERANCES
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding


class WindowVerdict(Conclusion):
    """Everything that is said of one case, of a multistep search."""

    def __init__(self, found: Found, recorded: Case, say: Callable[[str], None] = lambda _: None):
        found, self.held_out, instead = with_evidence(found, say)
        self.found, self.problem = found, found.problem
        self.case, self.recorded = self.problem.case, recorded
        plain = fit_of(found.base_estimator, found.base)
        self.search = FoundSearch(parameters=plain)
        self.fit = fit_of(found.estimator, found.best) if found.steps else plain
        self.estimator = found.estimator if found.steps else found.base_estimator
        self.unknown = self.formula = None
        if not found.complete:
            self.unknown, self.formula = unnamed_formula(found, self._unknown_shape(), say, instead)
        if self.formula is not None:
            self.fit = fit_of(self.formula.estimator, self.formula.fit)
            self.estimator = self.formula.estimator
        self.nominal, self.laws = self.problem.values(self.fit.hypothesis, self.fit.x)
        self.spread = spread_of(self.estimator, self.fit)
        self.question, self.residual, self.nearest = None, None, ()
        doubted = not found.steps and not found.sound
        self.uneven = found.refused if _gains_much(found.refused) and doubted else None
        self.strained = strained_value(self.problem, self.fit) if doubted else None
        h = self.fit.hypothesis
        self.error = relative_error(self.estimator, h, self.fit.x)
        self.unknown_torque = unknown_torque(self.estimator, self.error)
        self.unpredicted = self.error > NO_PREDICTION and not (found.sound or found.complete)
        self.no_further = fails_in_longer_windows(found, self.held_out)
        self.unbalance = None if self.unknown is not None else self._moved_gravity()
        self.delayed = late_command(self)
        self.dependent = self.estimator.tempering < DEPENDENT and self.error > DOUBTED_ERROR
        known = found.sound or self.problem.timing.smooth
        self.dependent &= not known and leaves_some_torque(self.estimator)
        self.unaccounted = doubted and leaves_much_torque(self.estimator)
        self.reason = _reason_of(self)
        self.verdict = self._verdict()

    @property
    def refuted(self) -> bool:
        """Whether the laws do worse than parameters alone on recordings held out."""
        return self.held_out is not None and self.held_out.gain < WORSE

    @property
    def model_fit(self) -> FoundFit:
        """The fit that `model.toml` holds: parameters alone where the laws are refuted."""
        return self.search.parameters if self.refuted else self.fit

    def model_values(self) -> tuple[dict, list[dict]]:
        """Nominal values and laws' values of the model."""
        return self.problem.values(self.model_fit.hypothesis, self.model_fit.x)

    def rig(self) -> Rig:
        """The rig with the model's values."""
        nominal, _ = self.model_values()
        return replace(
            self.case.rig, **{k: v for k, v in nominal.items() if hasattr(self.case.rig, k)}
        )

    def predicted(self, prepared, hypothesis: Hypothesis, x: NDArray) -> NDArray:
        """Readings (n, p) of a whole recording; one that begins in motion from its readings."""
        return free_run(self.found, prepared, (hypothesis, x))

    # ---- judgement

    def _verdict(self) -> str:
        seen = (self.unknown, self.uneven, self.strained, self.formula)
        if self.refuted or self.unpredicted or self.no_further or any(s is not None for s in seen):
            return "unexplained"
        if self.found.steps:
            first = len(self.fit.hypothesis.laws) - len(self.found.steps)
            there = step_presence(self.found, 0, self.held_out) >= 0.5 and self._shown(first)
            if there or self.delayed is not None:
                return "missing-physics"
            return "unexplained" if any(map(_gains_much, self.found.steps)) else "insufficient-data"
        if self.unbalance is not None or self.delayed is not None:
            return "missing-physics"
        if self.dependent or self.unaccounted:
            return "unexplained"
        return "no-mismatch" if self._rig_is_right() else "parameters-only"

    def _shown(self, j: int) -> bool:
        law, first = self.fit.hypothesis.laws[j], self.index_of(j)
        return shown(self._figures(j)) or sizes_shown(law, first, self.fit.x, self.spread)

    def _rig_is_right(self) -> bool:
        return bool(np.all(np.abs(moved_tolerances(self)) < 0.5))

    def _unknown_shape(self) -> Shape | None:
        """A torque of unknown shape that says more than what has a name.

        One that parameters alone leave says nothing where laws predict for longer than these.
        """
        base = _convincing(self.found.base_shapes)
        if not self.found.steps:
            return base
        base = None if self.found.predicts_longer else base
        step = self.found.steps[0]
        named = SHAPE_BETTER * max(step.screened, _fall_in_base_noise(self.found), 0.0)
        named += SHAPE_MORE * self.found.base_estimator.tempering
        if base is not None and base.held_out > named and step.law.sensor is None:
            return base
        left = _convincing(self.found.shapes)
        named = sum(s.gain for s in self.found.steps)
        return left if left is not None and left.held_out > named else None

    def step_confidence(self, number: int) -> float:
        """Probability that a step's effect is there."""
        return step_confidence(self.found, number, self.held_out)

    def confidence(self) -> float:
        """Probability that the first effect is there."""
        return self.step_confidence(0) if self.found.steps else 0.0

    def effects(self) -> list[dict]:
        """The effects, most convincing first."""
        if self.verdict in ("no-mismatch", "parameters-only"):
            return []
        found = []
        first = len(self.fit.hypothesis.laws) - len(self.found.steps)
        for number, step in enumerate(self.found.steps):
            confidence, figures = self.step_confidence(number), self._figures(first + number)
            if self.verdict == "unexplained" or not self._shown(first + number):
                confidence = min(confidence, UNCLAIMED)
            scale = RIVAL_SCALE + RIVAL_SHARE * step.gain
            alike = [w.effect for w, g in rivals_of(step.law, step.rivals) if step.gain - g < scale]
            alike += indistinguishable(step.law, self.case.rig)
            found.append(
                {
                    "name": step.law.effect,
                    "subsystem": step.law.subsystem,
                    "confidence": round(confidence, 3),
                    "law": step.law.law,
                    "parameters": figures,
                    "class": list(dict.fromkeys([step.law.effect, *alike])),
                    "alternatives": [
                        {"name": law.effect, "delta_score": round(step.gain - gain, 2),
                         "se": round(scale, 2)}
                        for law, gain in step.rivals
                    ],
                }
            )  # fmt: skip
        if self.verdict != "unexplained":
            named = {e["name"] for e in found}
            extra = [e for e in (self.unbalance, self.delayed) if e is not None]
            if found and self.unbalance is not None:  # values that a law biases are no effect
                extra[0] = extra[0] | {"confidence": min(extra[0]["confidence"], UNCLAIMED)}
            if self.verdict == "insufficient-data":
                extra = []
            found += [e for e in extra if e["name"] not in named]
        elif not found:
            found += _nearest_names(unexplained_place(self), self.found.screened)
        return sorted(found, key=lambda e: -e["confidence"])

    def _moved_gravity(self) -> dict | None:
        """An unbalance that corrected values of gravity amount to."""
        if LoadUnbalance.effect in self.fit.hypothesis.effects:
            return None
        index = {p.key: j for j, p in enumerate(self.problem.nominals)}
        turn = index.get("gravity_angle_offset_rad")
        if turn is None or "load_mass_kg" not in index:
            return None
        x, std = self.fit.x, self.spread.std
        tolerance = self.problem.nominals[turn].tolerance
        moved, unsure = abs(x[turn]) * tolerance, max(std[turn] * tolerance, 1e-4)
        allowed = tolerance / TOLERANCES["gravity_angle_offset_rad"]  # 1 unless rig.toml states it
        sure = (moved - UNBALANCE_OFFSET_rad * allowed) / unsure
        # within tolerances it is a value of the rig's, and so is a mass alone
        if abs(x[turn]) < UNBALANCE_TOLERANCES or not sure > 2.0:
            return None
        return gravity_entry(self.problem, self.fit, self.spread, sure)

    def index_of(self, j: int) -> int:
        """Index of the first unknown of law j."""
        before = self.fit.hypothesis.laws[:j]
        return len(self.problem.nominals) + sum(map(count_values, before))

    # ---- what reports ask

    def rivals(self) -> list:
        """Explanations by one other law, or by none, and the units by which they gain less."""
        if len(self.found.steps) != 1 or self.refuted:
            return []
        step = self.found.steps[0]
        gains = {law.key: gain for law, gain in rivals_of(step.law, step.rivals)}
        one = of_one_body(self.case.rig)
        others = [
            (fit, step.gain - gains[c.law.key]) for c, _, fit in step.near
            if c.law.effect != step.law.effect and c.law.key in gains
            and not {c.law.effect, step.law.effect} <= one
        ]  # fmt: skip
        if self.verdict == "insufficient-data":
            others.append((self.search.parameters, step.gain))
        return sorted(others, key=lambda pair: pair[1])

    def _alike(self) -> list:
        return []

    @property
    def restored_constants(self) -> tuple[str, ...]:
        """None: no law is taken for what it does to constants alone."""
        return ()

    def data_errors(self) -> tuple[Finding, ...]:
        """What is wrong with the files: of their rows only what the model found does not explain.

        A smooth motion sampled ten times a cycle looks like jumps to whoever knows no model.
        """
        return tuple(f for f in super().data_errors() if self.stands(f))

    def stands(self, finding: Finding) -> bool:
        """Whether the model found confirms a finding (`window_findings.stands`)."""
        wrong = {law.sensor for law in self.fit.hypothesis.laws}
        return stands(
            finding, self.estimator.tracks, self._innovations, complete=self.found.complete,
            wrong_sensors=wrong,
        )  # fmt: skip

    @cached_property
    def _innovations(self) -> list[NDArray]:
        return self.estimator.innovations([(self.fit.hypothesis, self.fit.x)])

    def ranked_explanations(self) -> list[dict]:
        """What was considered, by gain over parameters alone."""
        return ranked_explanations(self.found.steps, self.search.parameters, self.fit)

    def explained_excess(self) -> float:
        """Share of what the parameters leave, in the noise of the chosen fit, that laws take."""
        own = self.found.estimator
        before = own.innovations([(self.found.base.hypothesis, self.found.base.x)])
        after = own.innovations([(self.fit.hypothesis, self.fit.x)])
        had = sum(float(np.sum(huber_squares(e) - 1.0)) for e in before)
        left = sum(float(np.sum(huber_squares(e) - 1.0)) for e in after)
        return float(np.clip(1.0 - max(left, 0.0) / had, 0.0, 1.0)) if had > 0.0 else 0.0

    def mismatched_recordings(self) -> str:
        """Phrase: which recordings carry the mismatch."""
        if not self.found.steps and self.verdict != "unexplained":
            return "nowhere"
        own = self.found.estimator
        before = own.innovations([(self.found.base.hypothesis, self.found.base.x)])
        power = [float(np.mean(huber_squares(e))) for e in before]
        order = np.argsort(power)[::-1][:3]
        named = [
            f"{own.tracks[b].experiment.recording.file} ({np.sqrt(power[b]):.1f} times the noise)"
            for b in order
        ]
        return "after re-estimating parameters, in " + ", ".join(named)


def with_evidence(
    found: Found, say: Callable[[str], None]
) -> tuple[Found, HeldOut | None, CommandFormula | None]:
    """The laws that there is evidence of, their gain held out, and a formula instead of a law.

    Dropped are laws that explain a negligible torque, and laws that fail in longer windows where
    commands are smoothed: they may describe commands that the log lacks.
    """
    found, unseen = beyond_chance(found)
    instead = None if found.complete else gain_over_named(found, say)
    fails = found.problem.timing.smooth and fails_in_longer_windows(found, unseen)
    if instead is not None or fails or explains_only_negligible_torque(found):
        found, unseen = found.parameters_alone(), None
    return found, unseen, instead


def _reason_of(judged: WindowVerdict) -> str | None:
    """Why values of the rig alone are no explanation; None where something else says more."""
    others = (judged.unknown, judged.uneven, judged.formula)
    if judged.found.steps or any(s is not None for s in others):
        return None
    if judged.strained is not None:
        return (
            f"no law fits, and {judged.strained.key} would have to move far outside of its"
            " tolerance"
        )
    if judged.dependent:
        return (
            "no law fits; the rig's values alone predict with an error of"
            f" {100 * judged.error:.1f} % of the spread, and the innovations are dependent"
        )
    if judged.unaccounted:
        return f"no law fits; the rig's values alone leave {judged.unknown_torque}"
    return None


def _gains_much(step) -> bool:
    """Whether a law gained far more than any does by chance, in however few stretches."""
    return step is not None and step.law.only is None and step.gain > UNEVEN_GAIN


def _nearest_names(place: str, screened: Sequence) -> list[dict]:
    """The best screened law at the place of an unknown torque, at a confidence of 0.1."""
    near = [c for c in screened if c.law.subsystem == place and c.held_out > 0.0]
    return [
        {"name": c.law.effect, "subsystem": place, "confidence": 0.1, "law": c.law.law,
         "parameters": {}, "class": [c.law.effect], "alternatives": []}
        for c in near[:1]
    ]  # fmt: skip


def _fall_in_base_noise(found: Found) -> float:
    """Fall of the cost by all laws in the noise that parameters alone need, as a shape's is."""
    own, base, best = found.base_estimator, found.base, found.best
    values = sum(count_values(s.law) for s in found.steps)
    fall = base.cost - float(own.costs([(best.hypothesis, best.x)])[0])
    return fall - PER_VALUE * values


def unexplained_place(judged: WindowVerdict) -> str:
    """Part of the machine where something acts that has no name."""
    if judged.unknown is not None:
        return judged.unknown.subsystem
    if judged.formula is not None:
        return judged.formula.side
    if judged.uneven is not None:
        return judged.uneven.law.subsystem
    if judged.strained is not None:
        return place_of(judged.strained.key)
    if judged.found.steps and not (judged.no_further and judged.found.steps[0].law.sensor):
        return judged.found.steps[0].law.subsystem
    return next((s.subsystem for s in judged.found.base_shapes), "load")


def _convincing(shapes: Sequence[Shape]) -> Shape | None:
    """The best shape, where its gain is beyond chance.

    Friction in a narrow range of the angle gains only where the machine passes it.
    """
    best = next(iter(shapes), None)
    if best is None or best.held_out < SHAPE_GAIN:
        return None
    ratio = LEAST_RATIO if best.friction and best.held_out > UNEVEN_GAIN else SHAPE_RATIO
    return best if best.held_out > ratio * best.deviation else None
