"""The summary states claimed effects first, likely ones as less sure, and no others as certain."""

from types import SimpleNamespace

import pytest

from rsea_core import Rig
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.result.summary import summary_of


def law(effect):
    return SimpleNamespace(effect=effect, law="of a test", subsystem="load", nuisance=False)


def conclusion(*confidences, more=()):
    """A diagnosis of two effects without a sentence of their own, and more that are no laws."""
    names = ("effect-a", "effect-b")
    laws = tuple(law(name) for name in names)
    effects = [{"name": n, "confidence": c, "class": [n, "effect-c"]}
               for n, c in zip(names, confidences, strict=True)] + [*more]  # fmt: skip
    return SimpleNamespace(
        verdict="missing-physics", question=None, residual=None, unbalance=None, nearest=(),
        restored_constants=(), fit=SimpleNamespace(hypothesis=Hypothesis(laws=laws), x=None),
        problem=SimpleNamespace(case=SimpleNamespace(
            rig=Rig(name="motor", parts=("drive",)),
            recordings=[SimpleNamespace(command_name="duty")],
        )),
        effects=lambda: effects, explained_excess=lambda: 0.9,
        reported_figures=lambda x, j: {"size": float(j + 1)},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("second", "more"),
    [
        (0.7, "effect-b (of a test: size 2); together they explain"),
        (0.3, "Less sure: effect-b (of a test: size 2)."),
    ],
)
def test_an_effect_is_mentioned_as_surely_as_it_is_known(second, more):
    text = summary_of(conclusion(0.9, second))
    assert text.startswith("Missing physics: effect-a (of a test: size 1)")
    assert more in text


def test_an_effect_that_hardly_counts_is_not_mentioned():
    text = summary_of(conclusion(0.9, 0.02))
    assert "effect-b" not in text
    assert "the laws found explain 90 %" in text


def test_effects_that_are_not_claimed_are_stated_with_the_names_that_explain_as_much():
    text = summary_of(conclusion(0.49, 0.3))
    assert text.startswith("Missing physics of uncertain name: effect-a (of a test: size 1) and ")
    assert ", or effect-c; together they explain 90 %" in text


def test_a_claimed_effect_without_a_law_is_stated_before_laws_of_uncertain_name():
    late = {"name": "drive-delay", "confidence": 0.95, "class": ["drive-delay"]}
    text = summary_of(conclusion(0.4, 0.3, more=[late]))
    assert text.startswith("Missing physics: drive-delay. Missing physics of uncertain name: ")
