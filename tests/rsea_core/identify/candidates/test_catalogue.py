"""Which laws a machine can have follows from its parts: what turns on a bare shaft is its load."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import DriveThermal, LoadDrag
from rsea_core.identify.candidates.catalogue import catalogue, indistinguishable, of_one_body
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

SHAFT = replace(axis_rig(), parts=("drive", "gear"), load_inertia_kgm2=None,
                load_viscous_Nms_per_rad=None)  # fmt: skip


def effects(folder, rig) -> set[str]:
    case = axis_case(folder, axis_recording(seed=3), rig=rig)
    return {law.effect for law in catalogue(case, relative=True).values()}


def test_a_bare_shaft_can_drive_a_propeller_and_has_one_dry_friction(tmp_path):
    found = effects(tmp_path, SHAFT)
    assert "load-drag" in found
    assert "gear-friction" in found
    assert "load-friction" not in found


def test_an_axis_with_a_load_has_both_frictions_as_one_law_of_one_body(tmp_path):
    assert {"gear-friction", "load-friction"} <= effects(tmp_path, axis_rig())
    assert of_one_body(axis_rig()) == {"gear-friction", "load-friction"}


@pytest.mark.parametrize(
    ("effect", "parts", "same"),
    [
        ("load-friction", ("drive", "gear", "load"), ["gear-friction"]),
        ("gear-friction", ("drive", "gear", "load"), ["load-friction"]),
        ("load-drag", ("drive", "gear", "load"), []),
        ("gear-friction", ("drive", "gear"), []),
    ],
)
def test_friction_of_gear_and_load_is_stated_as_one_class_where_both_are_one_body(
    tmp_path, effect, parts, same
):
    rig = replace(axis_rig(), parts=parts)
    if "load" not in parts:
        rig = replace(rig, load_inertia_kgm2=None, load_viscous_Nms_per_rad=None)
    case = axis_case(tmp_path, axis_recording(seed=3), rig=rig)
    law = next(w for w in catalogue(case, relative=True).values() if w.effect == effect)
    assert indistinguishable(law, rig) == same


def test_nothing_happens_once_a_turn_of_a_load_that_moves_along_a_line(tmp_path):
    once_a_turn = {"load-unbalance", "load-friction-angle"}
    assert once_a_turn <= effects(tmp_path, replace(axis_rig(), axis="rotary"))
    assert not once_a_turn & effects(tmp_path, replace(axis_rig(), axis="linear"))


def test_a_transmission_error_on_a_linear_axis_is_the_screws(tmp_path):
    def parts(axis: str) -> set[str]:
        case = axis_case(tmp_path, axis_recording(seed=3), rig=replace(axis_rig(), axis=axis))
        laws = catalogue(case, relative=True).values()
        errors = [law for law in laws if law.effect == "gear-transmission-error"]
        return {p.name.split("_")[0] for law in errors for p in law.unknowns}

    assert "wheel" in parts("rotary")
    assert "worm" in parts("linear")
    assert "wheel" not in parts("linear")


def test_a_drag_on_a_bare_shaft_acts_in_the_model():
    drag = LoadDrag(torque_at_5_rad_per_s_Nm=0.1)
    plain, with_drag = (
        ActuatorModel(SHAFT, terms).effects("current_command_A", Load(kind="free"))
        for terms in ((), (drag,))
    )
    assert (plain != with_drag).any()


def test_a_temperature_that_weaker_magnets_alone_show_is_as_uncertain_as_these(tmp_path):
    """A regulated current hides the resistance; magnets lose 0.05 to 0.2 % per kelvin."""
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    law = catalogue(case, relative=True)["drive-thermal/winding, case and magnets"]
    assert law.form_spread == pytest.approx(np.log(0.2 / 0.05) / np.sqrt(12.0), abs=0.01)
    assert DriveThermal.form_spread < 0.1 < law.form_spread
