"""A certificate says up to where coils that do not touch were looked at."""

from dataclasses import replace

import pytest

from dftfs.analysis.study.delivery import certificate
from dftfs.analysis.study.drawing_tolerance import drawing_tolerance
from dftfs.design import load_design
from dftfs.process import find_process
from tests.cases.report_study import small_study

pytestmark = pytest.mark.needs_cad  # a study holds what its exported files measured


def test_a_direction_without_contact_says_how_far_it_was_followed(tmp_path):
    solid = small_study(tmp_path).solid
    end = solid.snapshots["winding"]
    free = replace(solid, contact_onset={**solid.contact_onset, "winding": None})
    design, wire = load_design("al1", {"width_mm": "8"}), find_process("wire-edm")
    found = certificate(
        design, free, wire, drawing_tolerance(design, wire), plane_Nm_per_rad=66.0, stress_errors={}
    )
    lines = dict(found.lines)
    far = f"{abs(end.torque_Nm):.2f} Nm at {abs(end.deflection_rad):.4f} rad"
    assert lines["first contact, winding"] == f"none up to {far}"
    assert not lines["first contact, unwinding"].startswith("none")
