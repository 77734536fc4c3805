"""Every effect of the contract has a sentence with the figures that diagnoses report of it."""

import pytest

from rsea_core.effects.base import Context
from rsea_core.effects.figure_text import amount
from rsea_core.effects.registry import TERMS
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.sentences import effect_text
from tests.cases.planted import planted


@pytest.mark.parametrize(
    ("value", "unit", "linear", "expected"),
    [
        (0.01693, "Nm", False, "16.9 mNm"),
        (0.4945, "Nm", False, "0.494 Nm"),
        (2.2e-4, "rad", False, "0.22 mrad"),
        (2.2e-5, "rad", False, "22 µrad"),
        (22.09, "Nm", True, "22.1 N"),
        (0.002, "rad", True, "2 mm"),
        (1.16, "Nm/rad", True, "1.16 N/m"),
        (0.3, "Nms/rad", True, "0.3 Ns/m"),
        (0.0, "A", False, "0 A"),
        (-0.02, "s", False, "-20 ms"),
        (3.3, "ohm", False, "3.3 ohm"),
        (0.1, "Nm", False, "0.1 Nm"),
    ],
)
def test_sizes_are_printed_in_units_that_fit_them(value, unit, linear, expected):
    assert amount(value, unit, linear=linear) == expected


def test_a_law_with_a_sentence_of_its_own_is_described_by_it():
    figures = {"stiffness_Nm_per_rad": 2.0, "cubic_Nm_per_rad3": 30.0}
    plain = effect_text("spring-parallel", "load", figures)
    assert "stiffens" not in plain
    cubic = effect_text("spring-parallel", "load", figures, law="cubic")
    assert cubic == f"{plain} where it is unloaded, which stiffens (30 Nm/rad^3)"


def test_every_law_of_the_catalogue_is_described_with_its_figures(tmp_path):
    case = planted(tmp_path).case
    described = set()
    context = Context(
        spring_stiffness_Nm_per_rad=65.0, peak_winding_rise_K=20.0, ambient_C=25.0, recording=""
    )
    for law in catalogue(case).values():
        values = dict(zip((k.name for k in law.unknowns), law.starts[0], strict=True))
        figures = law.figures(values, case.rig, context)
        expected = effect_text(law.effect, law.subsystem, figures)
        assert expected is not None, law.key
        assert expected.isascii() or {c for c in expected if not c.isascii()} <= set("µ±°"), (
            expected
        )
        described.add(law.effect)
    named = {effect for effect, kind in TERMS.items() if kind.headline}
    # an amplifier's offset is part of every hypothesis, its nonlinear gain a formula: no candidates
    absent = {"load-disturbance", "contact-nonlinear", "drive-thermal", "drive-offset"}
    absent |= {"drive-nonlinear-gain", "load-inertia-variation"}
    assert named - described <= absent


@pytest.mark.parametrize(
    ("effect", "subsystem", "figures", "expected"),
    [
        (
            "load-disturbance", "load",
            {"recording": "rec4.csv", "start_s": 2.3971, "end_s": 3.1092, "peak_Nm": 0.7647},
            "an external torque of 0.765 Nm at its peak on the load, 2.397 to 3.109 s in rec4.csv",
        ),
        (
            "sensor-scale", "sensor:load_angle_rad", {"scale": 0.9834},
            "a load angle that reads 1.66 % too small",
        ),
        (
            "sensor-drift", "sensor:load_velocity_rad_per_s", {"rate_per_s": 0.5},
            "a load speed whose zero drifts by 0.5 rad/s a second",
        ),
        (
            "gear-load-friction", "gear", {"drive_efficiency": 0.7, "backdrive_efficiency": -0.2},
            "friction in the gear that grows with its load: efficiency 70 % driving,"
            " self-locking in backdriving",
        ),
    ],
)  # fmt: skip
def test_effects_are_described_as_a_person_would(effect, subsystem, figures, expected):
    assert effect_text(effect, subsystem, figures) == expected


@pytest.mark.parametrize(
    ("unit", "expected"), [("", "0.0139 of the largest command"), ("V", "0.0139 V")]
)
def test_a_dead_zone_has_the_unit_of_the_command_where_no_largest_one_is_stated(unit, expected):
    text = effect_text("drive-dead-zone", "drive", {"width_duty": 0.01386}, command_unit=unit)
    assert text == f"a dead zone of the drive, {expected}"


def test_what_the_figures_do_not_hold_is_not_stated():
    assert effect_text("gear-backlash", "gear", {}) is None
    assert effect_text("x-lost-counts", "sensor:motor_angle_rad", {}) is None
