"""Equations 2.1 to 2.7 of the thesis, as printed and as corrected, side by side.

Plain numbers in, a list of ``ClosedForm`` out; nothing is fixed in silence: each entry says
what differs and under which erratum. These are estimates of a strip in pure bending. The arms
of a flat spring also carry a force, and their ends are stiffened by hub and rim: the finite
elements decide.

Symbols: w1 thickness in the plane, w2 axial width, R_i and R_o inner and outer centreline
radius, n turns of one arm, a gap between coils, L length of one arm, tau torque on the spring.
Taken from PyBaMM: reference values keep the name of their publication, and say where they do
not represent it.
"""

import math
from dataclasses import dataclass
from numbers import Integral

from dftfs.errors import DesignError
from dftfs.spring.section import curvature_correction_factor, in_plane_inertia, section_area

# Eq. 2.7, a rule for power springs wound in a barrel.
_ARBOR_RATIO = (15.0, 25.0)
_SLENDERNESS = 1000.0


@dataclass(frozen=True, kw_only=True)
class ClosedForm:
    """One quantity of one equation; a side that does not exist is None, and ``note`` says why."""

    equation: str
    quantity: str
    unit: str
    as_printed: float | None
    corrected: float | None
    note: str
    erratum: str


@dataclass(frozen=True, kw_only=True)
class ClosedFormInput:
    """What the equations need; the geometry of one arm, the number of arms, the torque.

    Attributes
    ----------
    inner_radius_m, outer_radius_m : float
        Of an arm's centreline, at its ends.
    arc_length_m : float
        True length of one arm's centreline.
    gap_m : float
        a, between neighbouring coils.
    torque_Nm : float
        On the whole spring; its sign does not matter here.
    printed_length_m : float or None
        A length L that the source prints, as Table 2.3 its 115.13 mm. Without it the columns
        "as printed" use eq. 2.3's first form.

    Raises
    ------
    DesignError
        If a size is not positive, the radii do not grow or there is no arm.
    """

    youngs_modulus_Pa: float
    thickness_m: float
    width_m: float
    inner_radius_m: float
    outer_radius_m: float
    turns: float
    n_arms: int
    arc_length_m: float
    gap_m: float
    torque_Nm: float
    printed_length_m: float | None = None

    def __post_init__(self) -> None:
        for name in (
            "youngs_modulus_Pa",
            "thickness_m",
            "width_m",
            "inner_radius_m",
            "turns",
            "arc_length_m",
            "gap_m",
        ):
            _require_positive(name, getattr(self, name))
        if self.printed_length_m is not None:
            _require_positive("printed_length_m", self.printed_length_m)
        _require_arms(self.n_arms)
        if not math.isfinite(self.torque_Nm):
            raise DesignError(f"torque_Nm = {self.torque_Nm!r} must be finite")
        if not (math.isfinite(self.outer_radius_m) and self.outer_radius_m > self.inner_radius_m):
            raise DesignError(
                f"outer_radius_m = {self.outer_radius_m:g} must exceed"
                f" inner_radius_m = {self.inner_radius_m:g}"
            )
        shortest = self.outer_radius_m - self.inner_radius_m
        if self.arc_length_m < shortest:
            raise DesignError(
                f"arc_length_m = {self.arc_length_m:g} must be at least"
                f" outer_radius_m - inner_radius_m = {shortest:g}"
            )

    @property
    def length_as_printed_m(self) -> float:
        """L of the columns as printed: the source's own, else pi n (R_o + R_i)."""
        if self.printed_length_m is not None:
            return self.printed_length_m
        return math.pi * self.turns * (self.outer_radius_m + self.inner_radius_m)


def arm_stiffness(
    youngs_modulus_Pa: float, thickness_m: float, width_m: float, length_m: float
) -> float:
    """Torsional stiffness E w1^3 w2 / (12 L) of one strip in pure bending, in Nm/rad.

    Parameters
    ----------
    youngs_modulus_Pa : float
    thickness_m, width_m : float
        w1 in the plane of the spiral, w2 axial.
    length_m : float
        Of the strip's centreline.

    Raises
    ------
    DesignError
        If an argument is not positive.

    Source
    ------
    Thesis eq. 2.1; Wahl, Mechanical Springs, "Spiral springs", clamped outer end.
    """
    _require_positive("youngs_modulus_Pa", youngs_modulus_Pa)
    _require_positive("length_m", length_m)
    return youngs_modulus_Pa * in_plane_inertia(thickness_m, width_m) / length_m


def stiffness_eq_2_1(
    youngs_modulus_Pa: float, thickness_m: float, width_m: float, length_m: float, n_arms: int
) -> float:
    """Stiffness of ``n_arms`` equal strips side by side, in Nm/rad (eq. 2.1, errata S6).

    ``n_arms = 1`` is the equation as printed. Other parameters as ``arm_stiffness``.

    Raises
    ------
    DesignError
        If an argument is not positive, or ``n_arms`` is not a whole number of at least 1.
    """
    _require_arms(n_arms)
    return n_arms * arm_stiffness(youngs_modulus_Pa, thickness_m, width_m, length_m)


def closed_forms(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    """Evaluate equations 2.1 to 2.7 as printed and as corrected.

    Raises
    ------
    DesignError
        If the strip is too thick to be bent to ``inner_radius_m``.
    """
    return (*_stiffness(given), *_length(given), *_stress(given), *_proportions(given))


def _stiffness(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    strip = (given.youngs_modulus_Pa, given.thickness_m, given.width_m)
    printed = arm_stiffness(*strip, given.length_as_printed_m)
    corrected = stiffness_eq_2_1(*strip, given.arc_length_m, given.n_arms)
    source = "printed L" if given.printed_length_m is not None else "L of eq. 2.3"
    return (
        ClosedForm(
            equation="2.1",
            quantity="stiffness",
            unit="Nm/rad",
            as_printed=printed,
            corrected=corrected,
            note=f"printed: one strip and the {source}; corrected: {given.n_arms} arms side by"
            " side, each of its true arc length",
            erratum="S6, S8",
        ),
        ClosedForm(
            equation="2.2",
            quantity="deflection under the torque",
            unit="rad",
            as_printed=given.torque_Nm / printed,
            corrected=given.torque_Nm / corrected,
            note="torque over the stiffness of eq. 2.1, as printed and corrected",
            erratum="S6, S11",
        ),
    )


def _length(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    sum_of_radii = given.outer_radius_m + given.inner_radius_m
    first_form = ClosedForm(
        equation="2.3 first form",
        quantity="length of one arm",
        unit="m",
        as_printed=math.pi * given.turns * sum_of_radii,
        corrected=given.arc_length_m,
        note="pi n (R_o + R_i) holds for a constant pitch; corrected: the arc length given",
        erratum="S7",
    )
    printed_value = ClosedForm(
        equation="2.3 printed L",
        quantity="length of one arm",
        unit="m",
        as_printed=given.printed_length_m,
        corrected=given.arc_length_m,
        note="the L that the source prints beside R_i, R_o and n, against the arc length given",
        erratum="S8",
    )
    forms = (first_form, *_constant_pitch(given))
    return forms if given.printed_length_m is None else (*forms, printed_value)


def _constant_pitch(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    sum_of_radii = given.outer_radius_m + given.inner_radius_m
    difference = given.outer_radius_m - given.inner_radius_m
    pitch = given.gap_m + given.thickness_m
    barrel = 4.0 * sum_of_radii * difference / (2.55 * given.thickness_m)
    return (
        ClosedForm(
            equation="2.3 second form",
            quantity="pi (R_o + R_i) / (a + w1)",
            unit="1",
            as_printed=math.pi * sum_of_radii / pitch,
            corrected=None,
            note="a ratio, not a length: the factor R_o - R_i is missing",
            erratum="S7",
        ),
        ClosedForm(
            equation="2.3 second form",
            quantity="length of one strip wound with the pitch a + w1",
            unit="m",
            as_printed=None,
            corrected=math.pi * sum_of_radii * difference / pitch,
            note="pi (R_o^2 - R_i^2) / (a + w1); the strips of all arms, interleaved, share it",
            erratum="S7, S9",
        ),
        ClosedForm(
            equation="2.3",
            quantity="turns of one strip wound with the pitch a + w1",
            unit="1",
            as_printed=given.turns,
            corrected=difference / pitch,
            note="the n printed beside this gap against (R_o - R_i) / (a + w1); a spiral with"
            " fewer turns has a larger gap, which varies along the arm",
            erratum="S9",
        ),
        ClosedForm(
            equation="2.4",
            quantity="maximum length",
            unit="m",
            as_printed=barrel,
            corrected=None,
            note="right for a power spring that fills half of its barrel; no bound here",
            erratum="S14",
        ),
    )


def _stress(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    beta = given.inner_radius_m / given.thickness_m
    factor = float(curvature_correction_factor(beta)[0])
    area = section_area(given.thickness_m, given.width_m)
    straight_Pa = 6.0 * abs(given.torque_Nm) / (area * given.thickness_m)
    return (
        ClosedForm(
            equation="2.5",
            quantity="bending stress",
            unit="Pa",
            as_printed=straight_Pa,
            corrected=factor * straight_Pa / given.n_arms,
            note="printed: the whole torque on one arm, K_b = 1 as its graph is missing;"
            " corrected: the torque of one arm and K_b of eq. 2.6. The moment along a real arm"
            " exceeds this mean, and the fillets add to it",
            erratum="S12",
        ),
        ClosedForm(
            equation="2.6",
            quantity="curvature correction factor K_b",
            unit="1",
            as_printed=None,
            corrected=factor,
            note=f"no graph printed; Winkler's factor at R_i / w1 = {beta:.4g}, R_i to mid-strip",
            erratum="S13",
        ),
    )


def _proportions(given: ClosedFormInput) -> tuple[ClosedForm, ...]:
    arbor = 2.0 * given.inner_radius_m / given.thickness_m
    printed = given.length_as_printed_m / given.thickness_m
    true = given.arc_length_m / given.thickness_m
    low, high = _ARBOR_RATIO
    return (
        ClosedForm(
            equation="2.7",
            quantity="d / t",
            unit="1",
            as_printed=arbor,
            corrected=arbor,
            note=f"printed rule {low:g} < d / t < {high:g}: {_kept(low < arbor < high)}; for power"
            " springs, informational",
            erratum="S15",
        ),
        ClosedForm(
            equation="2.7",
            quantity="L / t",
            unit="1",
            as_printed=printed,
            corrected=true,
            note=f"printed rule L / t > {_SLENDERNESS:g}: {_kept(true > _SLENDERNESS)}; for power"
            " springs, informational",
            erratum="S15",
        ),
    )


def _kept(holds: bool) -> str:
    return "kept" if holds else "not met"


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise DesignError(f"{name} = {value!r} must be positive and finite")


def _require_arms(n_arms: int) -> None:
    if isinstance(n_arms, bool) or not isinstance(n_arms, Integral) or n_arms < 1:
        raise DesignError(f"n_arms = {n_arms!r} must be a whole number of at least 1")
