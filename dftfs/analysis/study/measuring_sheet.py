"""The measuring sheet of a part, and what the dimensions found on a first article give for K.

Each arm is a rod of its own measured thickness (a line through its places, relative to nominal),
all of the measured width and fillet radius; the arms' stiffnesses add up. Rows left empty count
as nominal. The sheet states the nominal stiffness by 3D elements; a part's is the rod's, times 3D
over rod of the nominal dimensions. What stays unknown is the modulus, 2 % at two standard
deviations, and the gauge.
"""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dftfs.analysis.study.drawing_tolerance import DrawingTolerance
from dftfs.cad.fits import h7_m
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.spring.outline import build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import arm_rod
from rsea_core.files.bounded_text import read_bounded

COLUMNS = ("characteristic", "nominal_mm", "least_mm", "most_mm", "measured_mm")
PLACES = {"near the hub": 0.2, "in the middle": 0.5, "near the rim": 0.85}  # of the sweep
_WIDTH, _STIFFNESS = "axial width", "stiffness at rest, Nm/rad"
_SOLID = "computed: nominal stiffness by 3D elements, Nm/rad"  # nothing to measure
_FILLETS = tuple(f"fillet radius {detail}" for detail in "WXYZ")  # the drawing's details
_MODULUS = 0.02  # two standard deviations
_SLOPE = 3.0  # of K over the thickness, for the gauge's share
_FAR = 0.3  # of nominal: beyond, a number is a slip of the pen or of the unit
_MOST_BYTES = 1_000_000


@dataclass(frozen=True, kw_only=True)
class FirstArticle:
    """What a part's dimensions give. ``uncertainty`` is relative, at two standard deviations.

    ``over_rod`` is the 3D stiffness over the rod's that both stiffnesses contain, None where the
    sheet states none.

    ``arms_mm`` : mean thickness of each arm. ``measured_Nm_per_rad`` is None where the bench's row
    is empty; ``modulus_Pa`` is then what that stiffness says of the material.
    """

    nominal_Nm_per_rad: float
    predicted_Nm_per_rad: float
    uncertainty: float
    arms_mm: tuple[float, ...]
    width_mm: float
    fillet_mm: float
    outside: tuple[str, ...]
    not_measured: int
    measured_Nm_per_rad: float | None
    modulus_Pa: float | None
    required: tuple[float, float] | None
    over_rod: float | None = None


def strip_row(arm: int, place: str) -> str:
    """Name of a thickness row."""
    return f"strip thickness, arm {arm + 1}, {place}"


def measuring_sheet(
    design: SpringDesign, tolerance: DrawingTolerance, solid_Nm_per_rad: float | None = None
) -> str:
    """CSV of the dimensions to measure: nominal, limits, room for the finding, in mm.

    The bore is H7; what else is cut may lie anywhere in the zone of the profile.
    ``solid_Nm_per_rad`` is the stiffness by 3D elements, for `first_article`.
    """
    p, t = design.spiral, tolerance
    edge, bore = t.profile_m / 2, 2 * p.bore_radius_m
    rows = [
        *(
            (strip_row(arm, place), _thickness_m(p, share), -t.thickness_m, t.thickness_m)
            for arm in range(design.n_arms)
            for place, share in PLACES.items()
        ),
        (_WIDTH, design.width_m, -t.width_m, t.width_m),
        ("bore diameter, H7", bore, 0.0, h7_m(bore)),
        ("rim outside diameter", 2 * p.rim_outer_radius_m, -2 * edge, 2 * edge),
        ("slit width at its end", 2 * p.fillet_radius_m, -2 * edge, 2 * edge),
        *((name, p.fillet_radius_m, -edge, edge) for name in _FILLETS),
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, nominal, lower, upper in rows:
        values = (nominal, nominal + lower, nominal + upper)
        writer.writerow((name, *(f"{1e3 * value:.3f}" for value in values), ""))
    stiffness, share = t.stiffness_Nm_per_rad, t.stiffness_tolerance
    limits = (stiffness * (1 + sign * share) for sign in (0, -1, 1))
    writer.writerow((_STIFFNESS, *(f"{value:.3f}" for value in limits), ""))
    if solid_Nm_per_rad is not None:
        writer.writerow((_SOLID, f"{solid_Nm_per_rad:.5g}", "", "", ""))
    return text.getvalue()


def read_sheet(path: Path) -> tuple[dict[str, float], tuple[str, ...], int]:
    """Measured values by characteristic, those outside their limits, and how many are empty.

    The values include the 3D stiffness that the sheet states.

    Raises
    ------
    DesignError
        If the file is no measuring sheet, a value is no number, or nothing is measured.
    """
    text = read_bounded(path, DesignError, most_bytes=_MOST_BYTES)
    reader = csv.DictReader(io.StringIO(text))
    if tuple(reader.fieldnames or ()) != COLUMNS:
        raise DesignError(
            f"{path}: no measuring sheet: its first line must be {','.join(COLUMNS)}, as"
            " `dftfs deliver` writes it"
        )
    found, outside, empty, stated = {}, [], 0, {}
    for row in reader:
        name, value = row["characteristic"], (row["measured_mm"] or "").strip()
        if name == _SOLID:
            stated = {name: _positive(path, name, row["nominal_mm"])}
            continue
        if not value:
            empty += 1
            continue
        try:
            found[name], low, high = float(value), float(row["least_mm"]), float(row["most_mm"])
        except ValueError:
            raise DesignError(f"{path}: {name}: {value!r} is no number, e.g. 7.702") from None
        if not abs(found[name] / float(row["nominal_mm"]) - 1) <= _FAR:
            raise DesignError(f"{path}: {name} = {value} is far from {row['nominal_mm']}; in mm?")
        if not low <= found[name] <= high:
            outside.append(f"{name} {found[name]:g} is not {low:g} to {high:g}")
    if not found:
        raise DesignError(f"{path}: nothing is measured: fill in the column measured_mm")
    return found | stated, tuple(outside), empty


def _positive(path: Path, name: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = np.nan
    if not 0 < value < np.inf:
        raise DesignError(f"{path}: {name}: {text!r} is no stiffness, e.g. 66.08")
    return value


def first_article(design: SpringDesign, path: Path, *, gauge_mm: float = 0.003) -> FirstArticle:
    """Stiffness that the measured dimensions give.

    Raises
    ------
    DesignError
        If the sheet cannot be used, or the outline cannot be built with what was measured.
    """
    if not 0 <= gauge_mm < 1:
        raise DesignError(f"--gauge-mm {gauge_mm:g} must be 0 to below 1, for example 0.003")
    found, outside, empty = read_sheet(path)
    p, nominal = design.spiral, _stiffness(design, [design.spiral] * design.n_arms, design.width_m)
    over_rod = found[_SOLID] / nominal if _SOLID in found else None
    width_m = 1e-3 * found.get(_WIDTH, 1e3 * design.width_m)
    radii = [1e-3 * found[name] for name in _FILLETS if name in found]
    fillet_m = float(np.mean(radii)) if radii else p.fillet_radius_m
    arms = [_as_measured(p, found, arm, fillet_m) for arm in range(design.n_arms)]
    predicted = (over_rod or 1.0) * _stiffness(design, arms, width_m)
    count = max(1, sum(name.startswith("strip") for name in found))
    gauge = _SLOPE * 1e-3 * gauge_mm / p.thickness_m / np.sqrt(count)
    measured, asked = found.get(_STIFFNESS), design.requirements
    k, band = asked.stiffness_Nm_per_rad, asked.stiffness_tolerance
    modulus = design.material.youngs_modulus_Pa
    return FirstArticle(
        nominal_Nm_per_rad=(over_rod or 1.0) * nominal,
        over_rod=over_rod,
        predicted_Nm_per_rad=predicted,
        uncertainty=float(np.hypot(_MODULUS, gauge)),
        arms_mm=tuple(1e3 * float(np.mean(_strip(p, found, a))) for a in range(design.n_arms)),
        width_mm=1e3 * width_m,
        fillet_mm=1e3 * fillet_m,
        outside=outside,
        not_measured=empty,
        measured_Nm_per_rad=measured,
        modulus_Pa=None if measured is None else modulus * measured / predicted,
        required=None if k is None else (k * (1 - band), k * (1 + band)),
    )


def _thickness_m(p: SpiralParameters, share: float) -> float:
    line = p.centreline
    return float(p.thickness_at(line.start + share * (line.end - line.start)))


def _strip(p: SpiralParameters, found: Mapping[str, float], arm: int) -> list[float]:
    """Thickness (m) at the places of an arm, nominal where it is not measured."""
    return [
        1e-3 * found.get(strip_row(arm, place), 1e3 * _thickness_m(p, share))
        for place, share in PLACES.items()
    ]


def _as_measured(
    p: SpiralParameters, found: Mapping[str, float], arm: int, fillet_m: float
) -> SpiralParameters:
    """The outline of an arm: thickness at hub and rim from a line through its places."""
    shares = list(PLACES.values())
    nominal = [_thickness_m(p, share) for share in shares]
    off = np.array(_strip(p, found, arm)) / nominal - 1
    slope, start = np.polyfit(shares, off, 1)
    rim = p.thickness_at_rim_m * (1 + start + slope)
    same = p.rim_thickness_m is None and abs(slope) < 1e-12
    return replace(
        p,
        thickness_m=p.thickness_m * (1 + start),
        rim_thickness_m=None if same else rim,
        fillet_radius_m=fillet_m,
    )


def _stiffness(design: SpringDesign, arms: list[SpiralParameters], width_m: float) -> float:
    """Sum over the arms, each as a spring of arms like it has of one arm."""
    material, known = design.material, {}
    for p in arms:
        if p not in known:
            elastic = material.youngs_modulus_Pa, material.poisson_ratio
            known[p] = twist_stiffness(arm_rod(build_outline(p), width_m, *elastic, wide=True).rod)
    return float(sum(known[p] for p in arms))
