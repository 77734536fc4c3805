"""The predicted detectable size is that of planted effects, and blind data is called so."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import GearFriction, SpringHardening
from rsea_core.identify.experiment.experiment_file import decisive_experiment
from rsea_core.identify.experiment.next_experiment import DECIDES
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.criteria import DETECTED_GAIN, UNDECIDED_CONFIDENCE
from rsea_core.identify.judgement.detectability import (
    DetectableSize,
    minimum_detectable_sizes,
    sizes_that_matter,
)
from rsea_core.identify.judgement.insufficient_data import undetectable, undetectable_sentence
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.diagnosis_json import document_of, location_of, summary
from tests.cases.bench_recordings import (
    LOCKED,
    PENDULUM,
    SLOW,
    TIME,
    WITHOUT_ANCHORS,
    multisine,
    search_of,
)


def chosen(search, effect, *, times=1.0):
    """One effect of `sizes_that_matter`, its size multiplied."""
    case = search.problem.case
    sizes = sizes_that_matter(case.rig, case.identification)
    law, text = next((law, text) for law, text in sizes if law.effect == effect)
    return replace(law, starts=(law.scaled(law.starts[0], times),)), text


def with_effect(search, law):
    """The search with the law fitted, as its best."""
    start = search.problem.start(Hypothesis(laws=(law,)))
    start[: search.parameters.x.size] = search.parameters.x
    fit = search.fitter.fit(Hypothesis(laws=(law,)), start, iterations=10)
    search.best = search.keep(fit)
    return search


@pytest.fixture(scope="module")
def clamped(tmp_path_factory):
    return search_of((LOCKED, SLOW), folder=tmp_path_factory.mktemp("clamped"))


@pytest.fixture(scope="module")
def thorough(tmp_path_factory):
    return search_of(
        (LOCKED, SLOW), (PENDULUM, multisine(TIME)), (PENDULUM, SLOW),
        sensors=("torque_Nm", "current_A"), folder=tmp_path_factory.mktemp("thorough"),
    )  # fmt: skip


@pytest.mark.parametrize("effect", ["gear-friction", "spring-hardening"])
def test_least_amount_brings_just_as_much_as_is_seen(clamped, effect):
    (whole,) = minimum_detectable_sizes(clamped, [chosen(clamped, effect)])
    (least,) = minimum_detectable_sizes(clamped, [chosen(clamped, effect, times=whole.least)])
    assert 0.0 < whole.least < 3.0
    assert least.gain == pytest.approx(DETECTED_GAIN, rel=0.2)  # dry friction is not quite linear


@pytest.mark.parametrize(
    ("effect", "times", "term"),
    [
        ("gear-friction", 0.5, lambda law: GearFriction(coulomb_Nm=law.starts[0][0])),
        (
            "spring-hardening",
            1.5,
            lambda law: SpringHardening(stiffness_ratio_at_0p15rad=law.starts[0][0]),
        ),
    ],
)
def test_predicted_gain_is_what_a_fit_of_the_planted_effect_gains(
    clamped, tmp_path, effect, times, term
):
    law, text = chosen(clamped, effect, times=times)
    (predicted,) = minimum_detectable_sizes(clamped, [(law, text)])
    planted = search_of((LOCKED, SLOW), terms=(term(law),), folder=tmp_path)
    gained = with_effect(planted, law)
    gain = gained.score(gained.best) - gained.score(gained.parameters)
    assert predicted.gain > DETECTED_GAIN
    assert gain == pytest.approx(predicted.gain, rel=0.35)


def test_clamped_output_shows_nothing_of_the_load(clamped):
    found = minimum_detectable_sizes(clamped)
    load = [a for a in found if a.law.subsystem == "load"]
    assert len(load) == 4
    assert all(np.isinf(a.least) and a.gain <= 0.0 for a in load)
    assert [a.law.effect for a in undetectable(found)] == [a.law.effect for a in load]
    assert "load-friction, at any size" in undetectable_sentence(found)


def test_clamped_recording_of_a_good_machine_is_insufficient_data_with_an_experiment(clamped):
    conclusion = Conclusion(clamped)
    document, experiment = document_of(conclusion), decisive_experiment(conclusion)
    assert document["verdict"] == "insufficient-data"
    assert document["location"] is None
    assert document["effects"] == []
    assert "joint friction" in document["summary"]
    assert any("load-friction" in line for line in document["findings"])
    assert experiment.best.separation > DECIDES
    assert experiment.load.kind == "pendulum"
    assert [f.hypothesis.effects for f in conclusion.question.pair] == [("load-friction",), ()]


def test_thorough_recordings_of_a_good_machine_settle_it(thorough):
    conclusion = Conclusion(thorough)
    assert conclusion.verdict in ("no-mismatch", "parameters-only")
    assert conclusion.question is None
    assert not undetectable(minimum_detectable_sizes(thorough))


def test_sizes_that_matter_do_not_depend_on_how_far_recordings_went(clamped, thorough):
    moved, held = minimum_detectable_sizes(thorough), minimum_detectable_sizes(clamped)
    assert [a.law.starts for a in moved] == [a.law.starts for a in held]
    assert all(a.least < b.least for a, b in zip(moved, held, strict=True))


def test_only_what_a_machine_and_its_command_can_have_is_asked_for(clamped):
    (r,) = clamped.problem.case.identification
    columns = {("current_command_A" if k == "duty" else k): v for k, v in r.columns.items()}
    commanded = replace(r, columns=columns)
    stiff = replace(WITHOUT_ANCHORS, parts=("drive", "gear"))

    def asked(rig, recording):
        return {law.effect for law, _ in sizes_that_matter(rig, [recording])}

    assert {"drive-dead-zone", "drive-delay", "load-friction"} <= asked(WITHOUT_ANCHORS, r)
    assert {e for e in asked(WITHOUT_ANCHORS, commanded) if e.startswith("drive")} == {
        "drive-delay"
    }
    assert not any(e.startswith(("spring", "load")) for e in asked(stiff, r))


def test_part_whose_effects_are_undetectable_is_untested(clamped):
    law, _ = chosen(clamped, "gear-friction")

    def amount(part, *, seen):
        return DetectableSize(
            law=replace(law, subsystem=part),
            description=part,
            gain=2 * DETECTED_GAIN * seen,
            least=0.5 + seen,
        )

    seen = [amount(part, seen=True) for part in ("drive", "gear", "spring", "load") * 2]
    assert undetectable(seen) == []
    assert undetectable_sentence(seen) is None
    some = [amount("gear", seen=False), *seen]
    assert undetectable(some) == []
    most = [amount(part, seen=False) for part in ("drive", "gear", "spring") * 3] + seen
    assert len(undetectable(most)) == 9
    silent = [amount("load", seen=False)] * 2
    assert undetectable([*seen[:3], *silent]) == silent
    assert undetectable([*seen[:3], *silent[:1]]) == []


def test_faint_effect_of_one_recording_waits_for_another(clamped, tmp_path):
    friction, _ = chosen(clamped, "gear-friction")
    faint = GearFriction(coulomb_Nm=0.15 * friction.starts[0][0])
    one = with_effect(search_of((LOCKED, SLOW), terms=(faint,), folder=tmp_path), friction)
    assert np.sqrt(one.parameters.msni[0]) < DECIDES
    conclusion = Conclusion(one)
    assert conclusion.verdict == "insufficient-data"
    assert "another one has to confirm it" in summary(conclusion)
    assert conclusion.effects()[0]["confidence"] <= UNDECIDED_CONFIDENCE
    assert location_of(conclusion)["subsystem"] == "gear"
    assert decisive_experiment(conclusion).best.separation > DECIDES


def test_effect_of_one_recording_that_is_many_standard_errors_ahead_is_claimed(clamped, tmp_path):
    friction, _ = chosen(clamped, "gear-friction")
    small = GearFriction(coulomb_Nm=0.4 * friction.starts[0][0])
    one = with_effect(search_of((LOCKED, SLOW), terms=(small,), folder=tmp_path), friction)
    assert np.sqrt(one.parameters.msni[0]) < DECIDES  # parameters alone leave little
    conclusion = Conclusion(one)
    assert conclusion.verdict == "missing-physics"
    assert conclusion.question is None


@pytest.mark.parametrize("made", [((LOCKED, SLOW),), ((LOCKED, SLOW), (LOCKED, 1.4 * SLOW))])
def test_clear_or_confirmed_effect_is_missing_physics(clamped, tmp_path, made):
    friction, _ = chosen(clamped, "gear-friction")
    size = (4.0 if len(made) == 1 else 0.4) * friction.starts[0][0]
    found = with_effect(
        search_of(*made, terms=(GearFriction(coulomb_Nm=size),), folder=tmp_path), friction
    )
    assert (np.sqrt(found.parameters.msni.max()) < DECIDES) == (len(made) == 2)
    assert Conclusion(found).verdict == "missing-physics"
