"""What makes a spring on its bench differ from its design is named with its size."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dftfs.analysis.study.actuator import spring_curve
from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import InputError
from rsea_core.identify.spring_bench.effects import figures_of
from rsea_core.identify.spring_bench.explanations import diagnose_spring
from rsea_core.identify.spring_bench.history_columns import fading, stop
from rsea_core.identify.spring_bench.loops import measure_spring, turns
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.finding import Kind, sentences
from rsea_core.recordings.recording import Recording

K = 65.0
BENCH = Rig(name="bench", parts=("spring",), spring_stiffness_Nm_per_rad=K)
TURN = np.linspace(-0.25, 0.25, 41)
DESIGN = SpringCurve(
    deflection_rad=TURN, torque_Nm=K * TURN, contact_onset_rad=(-0.12, 0.12), source="test"
)


def path(amplitude, seconds=20.0, row_s=0.02):
    """Up, down and back, as a bench turns a spring."""
    time = np.arange(0.0, seconds, row_s)
    corners = [0.0, 0.2 * seconds, 0.6 * seconds, seconds]
    return time, np.interp(time, corners, [0.0, amplitude, -amplitude, 0.6 * amplitude])


def loops(law, amplitudes=(0.06, 0.12, 0.2), *, seconds=20.0, sign=1.0, noise=0.01, role=None):
    """Recordings of a law torque(deflection, time) at several amplitudes."""
    rng = np.random.default_rng(7)
    found = []
    for k, amplitude in enumerate(amplitudes):
        time, deflection = path(amplitude, seconds * (1.0 + k))
        torque = sign * (law(deflection, time) + noise * rng.standard_normal(time.size))
        columns = {"time_s": time, "spring_deflection_rad": deflection, "torque_Nm": torque}
        found.append(
            Recording(
                file=f"loop{k}.csv", role=role or "identification", load=Load(kind="locked"),
                columns=columns, sample_time_s=0.02,
            )
        )  # fmt: skip
    return found


def slipping(deflection, _time):
    return 5.0 * deflection + (K - 5.0) * stop(deflection, 0.07)


def test_swings_of_a_linear_spring_have_one_stiffness_and_no_loop():
    found = measure_spring(BENCH, loops(lambda x, t: K * x))
    assert found.stiffness_Nm_per_rad == pytest.approx(K, abs=3.0 * found.stiffness_std)
    assert found.stiffness_std < 0.01 * K
    assert found.by_direction == pytest.approx((K, K), rel=0.01)
    assert found.width_Nm < 0.05
    assert np.isnan(found.slip_Nm)
    assert found.findings == ()


def test_a_slipping_spring_keeps_its_flanks_and_loses_its_swings():
    found = measure_spring(BENCH, loops(slipping))
    assert found.stiffness_Nm_per_rad == pytest.approx(K, rel=0.02)
    assert found.slip_Nm == pytest.approx((K - 5.0) * 0.07, rel=0.2)
    large, small = (found.secants[np.argmax(f * found.secants[:, 0]), 1] for f in (1, -1))
    assert large < 0.8 * small
    assert "something slips" in found.findings[0].text
    # a parallelogram: twice the slider's force wide
    assert found.width_Nm == pytest.approx(2.0 * (K - 5.0) * 0.07, rel=0.1)


def test_a_torque_of_the_other_sign_is_turned_and_reported():
    found = measure_spring(BENCH, loops(lambda x, t: K * x, sign=-1.0))
    assert found.sign == -1
    assert found.stiffness_Nm_per_rad == pytest.approx(K, rel=0.01)
    assert "other sign" in found.findings[0].text


def test_what_a_low_pass_leaves_of_a_ramp_is_its_closed_form():
    time, tau = np.linspace(0.0, 2.0, 41), 0.3
    # tau x' + x = 3 t from rest: what is left over of 3 t is 3 tau (1 - exp(-t/tau))
    exact = 3.0 * tau * (1.0 - np.exp(-time / tau))
    assert fading(3.0 * time, time, tau) == pytest.approx(exact, abs=1e-12)


def test_a_relaxing_spring_is_stiffer_the_faster_it_is_turned():
    found = diagnose_spring(BENCH, loops(lambda x, t: K * x + 0.2 * K * fading(x, t, 0.5)))
    assert "lag" in found.best.pieces
    assert found.best.parameters["lag_coefficient"] > 0.0
    assert "stiffer the faster" in found.sentence


@pytest.mark.parametrize("time_s", [0.9, 5.5])  # between the times that are tried first
def test_the_relaxation_time_and_the_rise_of_stiffness_err_by_what_is_stated(time_s):
    law = lambda x, t: K * x + 0.3 * K * fading(x, t, time_s)  # noqa: E731
    found = figures_of(diagnose_spring(BENCH, loops(law, (0.2, 0.12))), ("lag",))
    for name, true in (("time_s", time_s), ("stiffness_rise_fast_over_static", 1.3)):
        value, std = found[name]["value"], found[name]["std"]
        assert 0.0 < std < 0.03 * true
        # half of the finest step between the times that are tried, 0.25 %
        assert value == pytest.approx(true, abs=3.0 * std + 2.5e-3 * true)


def test_two_explanations_are_found_together():
    late = lambda x, t: slipping(x, t) - 0.9 * fading(slipping(x, t), t, 0.3)  # noqa: E731
    found = diagnose_spring(BENCH, loops(late, noise=0.005))
    assert set(found.best.pieces) == {"slip", "lag"}
    assert found.best.parameters["lag_coefficient"] < 0.0


def test_springs_that_are_not_one_are_reported():
    recordings = [
        *loops(lambda x, t: K * x, (0.1,)),
        *loops(lambda x, t: 1.6 * K * x, (0.12,)),
    ]
    found = diagnose_spring(BENCH, recordings)
    assert Kind.SEVERAL_SPRINGS in {f.kind for f in found.findings}
    alone = diagnose_spring(BENCH, recordings[:1])
    assert Kind.SEVERAL_SPRINGS not in {f.kind for f in alone.findings}


def test_a_hold_is_not_a_turn():
    deflection = np.concatenate([np.linspace(0, 1, 50), np.ones(50), np.linspace(1, -1, 100)])
    assert list(turns(deflection, 3.0 * deflection)[1:]) == pytest.approx([49, 199], abs=1)


def test_a_thicker_strip_is_read_from_the_scale_of_its_curve():
    thickness = 1.03
    found = diagnose_spring(BENCH, loops(lambda x, t: thickness**3 * K * x), DESIGN)
    assert found.best.name == "scale"
    assert found.thickness_ratio == pytest.approx(thickness, abs=2e-3)
    assert "+3.0" in found.sentence


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("slip", slipping),
        ("lag", lambda x, t: K * x + 8.0 * np.gradient(x, t)),
        (
            "contact friction",
            lambda x, t: K * x * (1.0 + 0.15 * np.sign(x * np.gradient(x, t)) * (np.abs(x) > 0.12)),
        ),
        ("hardening", lambda x, t: K * x + 500.0 * x**3),
        ("knee", lambda x, t: K * x + 40.0 * np.maximum(x - 0.1, 0.0)),
        ("knee both ways",
         lambda x, t: K * x + 40.0 * np.sign(x) * np.maximum(np.abs(x) - 0.1, 0.0)),
    ],
)  # fmt: skip
def test_what_was_planted_is_named(name, law):
    found = diagnose_spring(BENCH, loops(law), DESIGN)
    assert found.best.name == name, [(c.name, c.error) for c in found.candidates]
    assert found.best.error < 0.04


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coils_that_touch_in_one_direction_are_named_with_their_onset(side):
    found = diagnose_spring(
        BENCH, loops(lambda x, t: K * x + side * 40.0 * np.maximum(side * x - 0.1, 0.0)), DESIGN
    )
    figures = figures_of(found, found.best.pieces)
    assert figures["onset_rad"]["value"] == pytest.approx(0.1, rel=0.03)
    assert figures["onset_Nm"]["value"] == pytest.approx(0.1 * K, rel=0.03)
    assert "its coils touch beyond" in found.sentence


def test_a_spring_that_softens_beyond_a_deflection_has_no_contact():
    found = diagnose_spring(
        BENCH, loops(lambda x, t: K * x - 20.0 * np.maximum(x - 0.1, 0.0)), DESIGN
    )
    assert not any("knee" in piece for piece in found.best.pieces)


def test_a_clamp_that_slips_does_not_pass_for_a_thinner_strip():
    found = diagnose_spring(BENCH, loops(slipping), DESIGN)
    plain = next(c for c in found.candidates if c.name == "scale")
    assert plain.scale < 0.8
    assert found.thickness_ratio == pytest.approx(1.0, abs=0.01)
    assert "clamp slips" in found.sentence


def test_validation_recordings_are_reported_and_choose_nothing():
    fitted = loops(slipping)
    alone = diagnose_spring(BENCH, fitted)
    held = loops(slipping, (0.15,), role="validation")
    odd = loops(lambda x, t: 500.0 * x, (0.15,), role="validation")
    assert np.isnan(alone.held_out)
    assert diagnose_spring(BENCH, fitted + held).held_out < 0.05
    assert diagnose_spring(BENCH, fitted + odd).best == alone.best


def test_without_design_or_stiffness_no_thickness_is_claimed():
    found = diagnose_spring(Rig(name="b", parts=("spring",)), loops(lambda x, t: K * x))
    assert np.isnan(found.thickness_ratio)
    assert "65" in found.sentence


def test_a_design_is_compared_through_its_own_curve_with_both_signs():
    deflection = np.linspace(-0.2, 0.37, 12)  # stiffer when it unwinds, as a solve delivers it
    ends = {"winding": 0.37, "unwinding": -0.2}
    ends = {d: SimpleNamespace(deflection_rad=v) for d, v in ends.items()}
    result = SimpleNamespace(
        deflection_rad=deflection, torque_Nm=66.0 * deflection * (1 - 0.2 * deflection),
        tangent_Nm_per_rad=66.0 * (1 - 0.4 * deflection), contact_onset=ends,
    )  # fmt: skip
    curve = spring_curve(result, "made")
    rig = Rig(name="b", parts=("spring",))

    def law(x, _time):
        return 1.02**3 * np.interp(x, curve.deflection_rad, curve.torque_Nm)

    found = diagnose_spring(rig, loops(law, (0.08, 0.15)), curve)
    assert found.best.name == "scale"
    assert found.thickness_ratio == pytest.approx(1.02, abs=3e-3)


@given(
    reach=st.floats(0.01, 0.3),
    corners=st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=5),
    repeats=st.integers(2, 5),
)
@settings(max_examples=50, deadline=None)
def test_a_slider_answers_the_path_and_not_its_speed(reach, corners, repeats):
    legs = [np.linspace(a, b, 40) for a, b in pairwise([0.0, *corners])]
    slow = [np.linspace(a, b, 39 * repeats + 1) for a, b in pairwise([0.0, *corners])]
    fast_end = stop(np.concatenate(legs), reach)[-1]
    assert stop(np.concatenate(slow), reach)[-1] == pytest.approx(fast_end, abs=1e-9)
    assert np.abs(stop(np.concatenate(slow), reach)).max() <= reach


def test_recordings_without_torque_or_turns_are_refused():
    time, deflection = path(0.1)
    only = Recording(
        file="a.csv",
        columns={"time_s": time, "spring_deflection_rad": deflection},
        sample_time_s=0.02,
    )
    with pytest.raises(InputError, match="torque_Nm and spring_deflection_rad"):
        measure_spring(BENCH, [only])


def test_one_recording_whose_torque_has_the_other_sign_is_turned_and_named():
    straight = loops(lambda deflection, time: K * deflection)
    first = straight[0]
    flipped = Recording(
        file="other.csv", load=first.load, sample_time_s=first.sample_time_s,
        columns={**first.columns, "torque_Nm": -first["torque_Nm"]},
    )  # fmt: skip
    found = diagnose_spring(BENCH, [flipped, *straight[1:]])
    assert found.best.scale == pytest.approx(1.0, abs=0.01)
    (turned,) = (f.text for f in found.findings if f.kind is Kind.SIGN)
    assert "other.csv: torque_Nm has the other sign" in turned
    assert Kind.SIGN not in {f.kind for f in diagnose_spring(BENCH, straight).findings}


def test_a_bench_where_only_noise_is_read_is_refused():
    still = loops(lambda deflection, time: 0.0 * deflection)
    with pytest.raises(InputError, match="nothing moves"):
        diagnose_spring(BENCH, still)


@pytest.mark.parametrize("factor", [1e-3, 57.3])
def test_a_torque_of_another_unit_is_reported(factor):
    off = loops(lambda deflection, time: factor * K * deflection, noise=1e-4 * factor)
    reported = " ".join(sentences(diagnose_spring(BENCH, off).findings))
    assert "times as steeply as the given stiffness says" in reported
