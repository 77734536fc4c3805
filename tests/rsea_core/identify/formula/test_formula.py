"""A torque that no named law has is given as a formula: terms, sizes, a model that simulates."""

import numpy as np
import pytest

from rsea_core.effects.formula_torque import FormulaTerm, FormulaTorque, formula_law
from rsea_core.effects.hooks import summed
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.slots import place_of
from rsea_core.errors import TermError
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.window_diagnosis import diagnose_windows
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

WAVE = FormulaTorque(usual_speed_rad_per_s=1.0, coefficient_1_Nm=0.015, angle_function_1=11.0,
                     speed_function_1=2.0)  # fmt: skip


def test_a_damping_that_changes_its_sign_over_the_turn_is_found_and_simulates(tmp_path):
    made = [axis_recording(WAVE, seed=s) for s in (1, 2)]
    found = diagnose_windows(axis_case(tmp_path, *made, rig=axis_rig()), quick=True)
    assert found.document["verdict"] == "unexplained"
    formula = found.document["remainder"]["formula"]
    (term,) = formula["terms"]
    assert term["function"] == "sin(theta) omega"
    usual = formula["usual_speed_rad_per_s"]
    assert abs(term["coefficient_Nm"] / usual - 0.015) < 3.0 * term["std_Nm"] / usual
    assert term["std_Nm"] < 0.1 * term["coefficient_Nm"]
    path = tmp_path / "model.toml"
    path.write_text(found.model.to_toml(), encoding="utf-8")
    assert "sin(theta) omega" in path.read_text(encoding="utf-8")
    again = FoundModel.from_toml(path)
    assert FormulaTorque.effect in {law.effect for law, _ in again.laws}
    assert again.to_toml() == found.model.to_toml()


def test_a_sound_axis_gets_no_formula(tmp_path):
    found = diagnose_windows(
        axis_case(tmp_path, axis_recording(seed=4), rig=axis_rig()), quick=True
    )
    assert found.document["verdict"] in ("parameters-only", "no-mismatch")
    assert found.document["remainder"] is None


def test_a_term_in_the_engine_is_its_value_by_numbers():
    angle, speed = np.linspace(-2.0, 2.0, 9), np.linspace(-3.0, 4.0, 9)
    for kind in (FormulaTerm(angle=3, speed=2), FormulaTerm(angle=22, speed=3)):
        law = formula_law("L", [kind], 1.5, 1.0)
        fx = np.zeros(N_EFFECTS)
        for name, value in law.term(dict(zip(
            [u.name for u in law.unknowns], [0.3, 1.5, kind.angle, kind.speed], strict=True
        )), axis_rig()).numbers(None).items():  # fmt: skip
            fx[place_of(name)] = value
        expected = 0.3 * kind.values(angle, speed, 1.5)
        np.testing.assert_allclose(summed("load_torque", fx, angle, speed), expected, atol=1e-12)


def test_an_unknown_function_is_refused_in_one_line():
    with pytest.raises(TermError, match="angle_function_1 = 7 is none of"):
        FormulaTorque(usual_speed_rad_per_s=1.0, coefficient_1_Nm=1.0, angle_function_1=7.0)


def test_coefficients_are_written_in_si_units():
    assert WAVE.equation() == "(0.015) Nms/rad sin(theta) omega on the load"
    drag = FormulaTorque(usual_speed_rad_per_s=2.0, coefficient_1_Nm=-0.4, speed_function_1=3.0)
    assert drag.equation() == "(-0.1) Nms^2/rad^2 omega |omega| on the load"
