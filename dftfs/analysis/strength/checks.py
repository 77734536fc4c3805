"""Requirements judged: each a line with value, limit and verdict.

After Capytaine's pre-flight checks: the computed number, the threshold and what would help, in a
module of their own.
"""

from dataclasses import dataclass

from dftfs.design import Requirements
from dftfs.material import Material


@dataclass(frozen=True, kw_only=True)
class Check:
    """One judged requirement. ``passed`` is None where it cannot be judged; ``note`` says why.

    ``source`` names where the value or its limit comes from.
    """

    name: str
    value: float | None
    unit: str
    limit: str
    passed: bool | None
    note: str = ""
    source: str = ""

    def line(self) -> str:
        """The check as one line of text."""
        verdict = {True: "pass", False: "FAIL", None: "open"}[self.passed]
        value = "-" if self.value is None else f"{self.value:.4g} {self.unit}".rstrip()
        note = f"  ({self.note})" if self.note else ""
        source = f"  [{self.source}]" if self.source else ""
        required = "" if self.limit == "-" else f", required {self.limit}"
        return f"{verdict}  {self.name}: {value}{required}{note}{source}"


def stiffness_check(
    requirements: Requirements, stiffness_Nm_per_rad: float, model: str
) -> list[Check]:
    """Tangent stiffness at rest within the required band; nothing where none is stated.

    ``model`` is what it was computed by.
    """
    asked = requirements.stiffness_Nm_per_rad
    if asked is None:
        return []
    band = requirements.stiffness_tolerance
    return [
        Check(
            name="stiffness",
            value=stiffness_Nm_per_rad,
            unit="Nm/rad",
            limit=f"{asked:g} Nm/rad +- {band * 100:g} %",
            passed=abs(stiffness_Nm_per_rad / asked - 1) <= band,
            note=f"{(stiffness_Nm_per_rad / asked - 1) * 100:+.1f} %",
            source=model,
        )
    ]


def contact_checks(
    requirements: Requirements,
    onset_Nm: dict[str, float | None],
    reached_Nm: dict[str, float],
) -> list[Check]:
    """No coil may touch below the required torque, in either direction.

    ``onset_Nm`` is the magnitude of the torque at first contact per direction, None where the
    curve ended before one; ``reached_Nm`` the largest magnitude that was computed.
    """
    asked = requirements.contact_free_torque_Nm
    if asked is None:
        return []
    checks = []
    for direction, onset in onset_Nm.items():
        reached = reached_Nm[direction]
        passed = onset >= asked if onset is not None else (True if reached >= asked else None)
        checks.append(
            Check(
                name=f"contact-free torque, {direction}",
                value=onset,
                unit="Nm",
                limit=f"at least {asked:g} Nm",
                passed=passed,
                note="" if onset is not None else f"no contact up to {reached:.3g} Nm",
            )
        )
    return checks


def yield_check(
    requirements: Requirements,
    *,
    stress_per_torque: dict[str, float],
    yield_strength_Pa: float | None,
    no_strengths: str,
    material: Material | None = None,
) -> list[Check]:
    """Safety factor to first yield at the operating torque, the worse of both directions.

    ``stress_per_torque`` is the peak von Mises stress over the torque (Pa/Nm) at that torque. Of a
    ``material`` the note says whether its strength is typical or guaranteed, and the factor that
    the guaranteed one leaves; the verdict is by the strength given.
    """
    torque = requirements.operating_torque_Nm
    if torque is None:
        return []
    limit = f"at least {requirements.min_safety_factor_yield:g} at {torque:g} Nm"
    if yield_strength_Pa is None:
        return [
            Check(
                name="safety factor to yield",
                value=None,
                unit="",
                limit=limit,
                passed=None,
                note=f"the material has no strengths: {no_strengths}",
            )
        ]
    direction = max(stress_per_torque, key=lambda key: stress_per_torque[key])
    stress = stress_per_torque[direction] * torque
    factor = yield_strength_Pa / stress
    note = f"{stress / 1e6:.0f} MPa {direction} against {yield_strength_Pa / 1e6:.0f} MPa"
    basis = "" if material is None else material.strength_note(stress)
    return [
        Check(
            name="safety factor to yield",
            value=factor,
            unit="",
            limit=limit,
            passed=factor >= requirements.min_safety_factor_yield,
            note=f"{note}; {basis}" if basis else note,
        )
    ]
