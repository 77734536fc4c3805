"""Requirements judged: each a line with value, limit and verdict.

After Capytaine's pre-flight checks: the computed number, the threshold and what would help, in a
module of their own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from dftfs.design import Requirements
from dftfs.material import Material

_SAME = 1e-3  # of a torque: a curve that ends so little short of it reaches it


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
    model: str,
) -> list[Check]:
    """No coil may touch below the required torque, in either direction.

    ``onset_Nm`` is the magnitude of the torque at first contact per direction, None where the
    curve ended before one; ``reached_Nm`` the largest magnitude that was computed by ``model``.
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
                source=model,
            )
        )
    return checks


def yield_check(
    requirements: Requirements,
    *,
    stress_per_torque: dict[str, float],
    material: Material,
    model: str,
    bar: float = 0.0,
    reached_Nm: Mapping[str, float] | None = None,
) -> list[Check]:
    """Safety factor to first yield at the operating torque, the worse of both directions.

    It passes if the stress with its error bar does; an extrapolated stress may fail or is open. The
    note has the strength's basis, typical or guaranteed, and the factor that the guarantee leaves.

    Parameters
    ----------
    stress_per_torque : mapping of direction to float
        Peak von Mises stress over the torque (Pa/Nm) at that torque, by ``model``.
    bar : float
        Relative error bar of the stress by its mesh series; infinite where it has no limit.
    reached_Nm : mapping of direction to float, optional
        The largest torque that was computed.
    """
    torque = requirements.operating_torque_Nm
    if torque is None:
        return []
    limit = f"at least {requirements.min_safety_factor_yield:g} at {torque:g} Nm"
    if material.yield_strength_Pa is None:
        return [
            Check(
                name="safety factor to yield",
                value=None,
                unit="",
                limit=limit,
                passed=None,
                note=f"the material has no strengths: {material.no_strengths}",
                source=model,
            )
        ]
    direction = max(stress_per_torque, key=lambda key: stress_per_torque[key])
    stress = stress_per_torque[direction] * torque
    factor = material.yield_strength_Pa / stress
    least, last = requirements.min_safety_factor_yield, (reached_Nm or {}).get(direction, torque)
    found = f"{stress / 1e6:.0f}" + (f" +- {bar * stress / 1e6:.2g}" if 0 < bar < inf else "")
    note = f"{found} MPa {direction} against {material.yield_strength_Pa / 1e6:.0f} MPa"
    note += f"; {basis}" if (basis := material.strength_note(stress)) else ""
    finite, doubt = bar if bar < inf else 0.0, _doubt(bar, torque, last)
    kept = factor >= least * (1 + finite)
    return [
        Check(
            name="safety factor to yield",
            value=factor,
            unit="",
            limit=limit,
            passed=None if kept and doubt else kept,
            note=note + doubt,
            source=model,
        )
    ]


def _doubt(bar: float, torque_Nm: float, last_Nm: float) -> str:
    """Why a stress at a torque cannot pass: no limit by the meshes, or beyond the last torque."""
    if bar == inf:
        return "; grows with every finer mesh"
    if last_Nm < torque_Nm * (1 - _SAME):
        return f"; extrapolated in proportion from {last_Nm:.3g} Nm"
    return ""
