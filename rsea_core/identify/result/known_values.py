"""The values of laws that the rig file states, as a diagnosis found them."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rsea_core.effects.base import Term
from rsea_core.identify.result.conclusion import Conclusion


class KnownValue(NamedTuple):
    """A stated value: name, value in the file, found value and deviation, moved tolerances."""

    key: str
    unit: str
    stated: float
    found: float
    std: float
    moved: float  # in tolerances, of the logarithm
    unsure: float  # deviation in tolerances


def known_values(conclusion: Conclusion) -> list[KnownValue]:
    """The stated values of known laws that no law found takes the place of."""
    problem, fit, found = conclusion.problem, conclusion.fit, []
    stated = {known.term.effect: known.stated for known in conclusion.case.known}
    at = len(problem.nominals)
    for law, values in zip(fit.hypothesis.laws, conclusion.laws, strict=True):
        for unknown, start in zip(law.unknowns, law.starts[0], strict=True):
            if unknown.scale == 0.0:
                continue
            is_stated = law.nuisance and unknown.name in stated.get(law.effect, ())
            if is_stated and problem.acts(law, fit.hypothesis):
                value, std = values[unknown.name], conclusion.spread.std[at] * unknown.scale
                found.append(
                    KnownValue(
                        f"{law.effect}.{unknown.name}", unknown.unit, start, value, std * value,
                        float(np.log(value / start)) / unknown.prior, std / unknown.prior,
                    )
                )  # fmt: skip
            at += 1
    return found


def moved_tolerances(conclusion: Conclusion) -> list[float]:
    """How many tolerances each value of the rig file moved, those of known laws last."""
    own = conclusion.fit.x[: len(conclusion.problem.nominals)]
    return [*own, *(v.moved for v in known_values(conclusion))]


def corrected_entries(conclusion: Conclusion) -> dict[str, Mapping]:
    """These values as `parameters_corrected` of `diagnosis.json` has them."""
    return {
        v.key: {"from": v.stated, "to": v.found, "std": v.std, "identifiable": v.unsure < 0.7}
        for v in known_values(conclusion)
    }


def known_as_terms(conclusion: Conclusion, hypothesis, laws: list[Mapping]) -> tuple[Term, ...]:
    """The known laws of a fit as terms of the model."""
    problem, rig = conclusion.problem, conclusion.case.rig
    return tuple(
        law.term(values, rig)
        for law, values in zip(hypothesis.laws, laws, strict=True)
        if law.known and problem.acts(law, hypothesis)
    )
