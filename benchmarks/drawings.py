"""Four toleranced drawings, the smallest and the largest among them, to be looked at.

    python -m benchmarks.drawings OUT

Al1 at 0.1, 1 and 5 times its size, and `ss` by water jet with bolt circles. Printed: sheet, scale,
the tolerances, and which share of 2000 parts drawn from them (other draws than those that chose
them) keeps the stiffness, each part by a fit through 25 outlines. OUT gets the DXF and SVG files
and, where Chromium or Chrome is installed, a PNG of each.
"""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from dftfs.analysis.strength.fkm import surface_left_by
from dftfs.analysis.study.drawing_tolerance import drawing_tolerance
from dftfs.analysis.study.tolerance import shifted
from dftfs.cad.drawing import write_drawing
from dftfs.cad.drawing_sheet import SHEETS_MM, BoltCircle, ShopData, chosen_sheet
from dftfs.design import SpringDesign, load_design
from dftfs.errors import DftfsError
from dftfs.process import find_process
from dftfs.report.pdf import browser
from dftfs.spring.outline import build_outline
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod

_LENGTHS = ("inner_radius", "outer_radius", "thickness", "fillet_radius", "tip_radius")
_LENGTHS += ("bore_radius", "hub_radius", "rim_inner_radius", "rim_outer_radius")
_PIXELS_PER_MM = 5


def scaled(factor: float, width_mm: float) -> SpringDesign:
    """Al1 with every length of the plane times a factor; its stiffness is then its own."""
    p = load_design("al1").spiral
    changes = {f"{name}_mm": repr(1e3 * factor * getattr(p, f"{name}_m")) for name in _LENGTHS}
    changes |= {"width_mm": repr(width_mm), "name": f"al1-x{factor:g}"}
    design = load_design("al1", changes)
    return replace(design, requirements=replace(design.requirements, stiffness_Nm_per_rad=None))


def kept_of_2000(design: SpringDesign, found, seed: int = 41) -> float:
    """Share of parts drawn from the tolerances that keep the stiffness."""
    elastic = design.material.youngs_modulus_Pa, design.material.poisson_ratio
    zone = np.linspace(-1, 1, 25)
    values = []
    for z in zone:
        outline = build_outline(shifted(design.spiral, 0.0, z * found.thickness_m / 2))
        values.append(twist_stiffness(arm_rod(outline, design.width_m, *elastic).rod))
    rng = np.random.default_rng(seed)
    drawn = design.n_arms * np.interp(rng.uniform(-1, 1, 2000), zone, values)
    drawn *= 1 + rng.uniform(-1, 1, 2000) * found.width_m / design.width_m
    drawn *= 1 + 0.01 * rng.standard_normal(2000)
    off = np.abs(drawn / found.stiffness_Nm_per_rad - 1)
    return float(np.mean(off <= found.stiffness_tolerance))


def main() -> None:
    """Draw, print a line for each."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    bolts = (BoltCircle(where="rim", count=8, hole_m=3.2e-3, circle_m=165.5e-3),)
    cases = (
        (scaled(0.1, 2.0), "wire-edm", ()),
        (load_design("al1"), "wire-edm", ()),
        (load_design("ss"), "water-jet", bolts),
        (scaled(5.0, 30.0), "water-jet", ()),
    )
    for design, process_name, holes in cases:
        process, sheet = find_process(process_name), chosen_sheet(design, None, None)
        found = drawing_tolerance(design, process)
        shop = ShopData(
            part_number=f"S-{design.name}", revision="A", date="2026-11-24", author="A. B.",
            process=process.name, temper="as delivered", thickness_tolerance_m=found.thickness_m,
            width_tolerance_m=found.width_m, profile_m=found.profile_m, stiffness=found.line(),
            roughness_um=surface_left_by(process.name).roughness_um,
            taper_m=(process.taper_least_m, process.taper_most_m), bolts=holes,
        )  # fmt: skip
        made = write_drawing(design, folder, design_hash="0" * 12, shop=shop, sheet=sheet)
        kept = 100 * kept_of_2000(design, found)
        print(
            f"{design.name}: {sheet.name} {sheet.scale:g}:1, thickness +-"
            f"{1e3 * found.thickness_m:g} mm, {kept:.2f} % of 2000 parts within"
            f" {100 * found.stiffness_tolerance:g} %; {found.line()}",
            flush=True,
        )
        _png(made.svg, SHEETS_MM[sheet.name])


def _png(svg: Path, side_mm: tuple[float, float]) -> None:
    try:
        program = browser()
    except DftfsError as error:
        print(f"  no picture: {error}")
        return
    size = ",".join(str(round(_PIXELS_PER_MM * side)) for side in side_mm)
    picture = svg.with_suffix(".png")
    arguments = [program, "--headless", "--no-sandbox", "--disable-gpu", f"--window-size={size}"]
    arguments += [f"--screenshot={picture.resolve()}", svg.resolve().as_uri()]
    subprocess.run(arguments, check=True, capture_output=True, timeout=300)


if __name__ == "__main__":
    main()
