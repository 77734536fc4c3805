"""Every effect of the registry is complete: parameters, candidates, figures, words, model file."""

import dataclasses

import pytest

import rsea_core.effects
from rsea_core.effects.base import Context, Port
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import LAWS
from rsea_core.machine.rig import Rig

KINDS = [kind for laws in LAWS.values() for kind in laws.values()]
VARIANTS = laws_by_key()
RIG = Rig.preset("rsea-bench")
CONTEXT = Context(
    spring_stiffness_Nm_per_rad=65.0, peak_winding_rise_K=20.0, ambient_C=25.0, recording="a.csv"
)
# what has no start of its own: parameters of the bench, a spring's file, tables of numbers
WITHOUT_CANDIDATES = {"spring-curve", "sensor-noise", "sensor-table", "load-position-torque"}


def values_of(law) -> dict[str, float]:
    return dict(zip((unknown.name for unknown in law.unknowns), law.starts[0], strict=True))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: f"{kind.effect}/{kind.law}")
def test_every_parameter_says_what_it_is(kind):
    for f in dataclasses.fields(kind):
        if "bounds" in f.metadata:
            low, high = f.metadata["bounds"]
            assert low < high
            assert f.metadata["unit"]
            assert f.metadata["source"]
            assert f.metadata["meaning"].endswith(".")
    assert kind.port in Port
    assert kind.__doc__


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_effect_can_be_had_by_its_name(kind):
    assert getattr(rsea_core.effects, kind.__name__) is kind


@pytest.mark.parametrize("effect", sorted(set(LAWS) - WITHOUT_CANDIDATES))
def test_every_effect_that_a_diagnosis_names_has_a_headline_and_variants(effect):
    kinds = LAWS[effect].values()
    assert all(kind.headline for kind in kinds if kind.candidates is not None and kind.figure_units)
    assert any(law.effect == effect for law in VARIANTS.values())


@pytest.mark.parametrize("key", sorted(VARIANTS))
def test_figures_of_a_variant_have_units_and_a_sentence(key):
    law = VARIANTS[key]
    if law.effect not in LAWS:  # tables of what no effect explains report none
        assert law.figures({}, RIG, CONTEXT) == {}
        return
    figures = law.figures(values_of(law), RIG, CONTEXT)
    assert figures
    for name in figures:
        assert isinstance(law.figure_unit(name), str)
    column = law.subsystem.partition(":")[2]
    assert law.kind.sentence(FigureText(figures, column, linear=False))


def test_the_onset_of_spring_contact_is_the_first_touch():
    """One definition for every variant: the onset less half the width of its knee."""
    values = {"onset_rad": 0.12, "stiffness_after_over_before": 2.0, "side": 0.0, "round_rad": 0.03}
    law = VARIANTS["spring-contact/rounded both ways"]
    figures = law.figures(values, RIG, CONTEXT)
    assert figures["onset_rad"] == pytest.approx(0.105, rel=1e-12)
    assert figures["onset_Nm"] == pytest.approx(65.0 * 0.105, rel=1e-12)
    assert law.term(values, RIG).comparable(CONTEXT) == figures
