"""The committed parts of `cad_out/` are the geometry that the built-in designs have now."""

from pathlib import Path

import pytest

from dftfs.cad.dxf import check_dxf
from dftfs.cad.step import check_step
from dftfs.cad.stl import check_stl
from dftfs.design import load_design

PARTS = Path(__file__).resolve().parents[2] / "cad_out"


@pytest.mark.parametrize("name", ["al1", "al2", "ss", "ti"])
def test_committed_files_are_the_present_design(name):
    design = load_design(name)
    outline, width = design.outline, design.width_m
    step = check_step(PARTS / f"{name}.step", outline=outline, width_m=width, name=name)
    assert step.volume_error < 1e-6
    check_stl(PARTS / f"{name}.stl", volume_m3=outline.area_m2 * width, chord_tolerance_mm=0.01)
    for suffix, variant in ((".dxf", "arcs"), ("-polyline.dxf", "polyline")):
        path = PARTS / f"{name}{suffix}"
        found = check_dxf(path, outline=outline, variant=variant, tolerance_m=2e-6)
        assert found.deviation_m <= 2e-6
