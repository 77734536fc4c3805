"""Results of a torsion analysis: the curve, where it ends, its error, fields to draw.

After Capytaine: a result keeps what it was computed from, so that every number can be traced.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import DesignError

WINDING, UNWINDING = "winding", "unwinding"
SIGN = {WINDING: +1.0, UNWINDING: -1.0}


@dataclass(frozen=True, kw_only=True)
class ContactOnset:
    """First touch of the coils in one direction: the knee of the curve.

    ``at_m`` is where, in the deformed plane, for coil gap 0. The tangents are those up to the touch
    and beyond it (with the contact past its smoothing), ``penetration_m`` the deepest that
    the contact's penalty lets the surfaces overlap to the end of the curve; None where the curve
    ends at the touch.
    """

    deflection_rad: float
    torque_Nm: float
    at_m: tuple[float, float]
    tangent_before_Nm_per_rad: float | None = None
    tangent_after_Nm_per_rad: float | None = None
    penetration_m: float | None = None

    @property
    def stiffening(self) -> float | None:
        """Tangent beyond the knee over that before it."""
        before, after = self.tangent_before_Nm_per_rad, self.tangent_after_Nm_per_rad
        return None if before is None or after is None else after / before


@dataclass(frozen=True, kw_only=True)
class MeshSummary:
    """Size and quality of the mesh that was solved on."""

    dimension: int
    nodes: int
    elements: int
    unknowns: int
    min_corner_sine: float
    symmetry: str
    solver: str


@dataclass(frozen=True, kw_only=True)
class FieldSnapshot:
    """The mid-plane of the whole spring at one state, to be drawn.

    nodes_m (n, 2) undeformed, cells (m, 8), displacement_m (n, 2), von_mises_Pa (n,).
    """

    deflection_rad: float
    torque_Nm: float
    nodes_m: NDArray
    cells: NDArray
    displacement_m: NDArray
    von_mises_Pa: NDArray
    peak_at_m: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class StepFields:
    """The mid-plane of one sector at every state of a curve, with 32 bits.

    nodes_m (n, 2) undeformed, cells (m, 8), displacement_m (s, n, 2), von_mises_Pa (s, n); the
    whole spring is ``copies`` sectors, each turned by a full turn over ``copies``.
    """

    copies: int
    nodes_m: NDArray
    cells: NDArray
    displacement_m: NDArray
    von_mises_Pa: NDArray


@dataclass(frozen=True, kw_only=True)
class StiffnessResult:
    """Torque against deflection of one model (rod, 2D or 3D), both directions.

    The arrays are sorted by deflection and hold the state at rest and, per direction, the first
    contact; a direction's curve ends there or continues with its coils in contact (``ended_by``).
    The snapshots show the first contact, or the end where there is none.

    Attributes
    ----------
    model : str
        ``"3D hex20"`` or ``"2D plane stress quad8"``.
    stiffness_Nm_per_rad : float
        Tangent at rest, from one linear solve on the undeformed mesh.
    deflection_rad, torque_Nm, tangent_Nm_per_rad, peak_von_mises_Pa, min_clearance_m : (n,)
        ``min_clearance_m`` is the smallest gap between facing coils, micrometres off 0 in contact
        (measured on the deformed edges, not by the contact itself).
    strain_energy_J : (n,)
    contact_onset : mapping of direction to `ContactOnset` or None
    regional_peak_Pa : mapping of region (`regions.REGIONS`) to (n,)
        Peak von Mises stress there; empty where it was not split.
    regional_principal_Pa : mapping of region to (n,)
        Largest principal stress by magnitude there, without its sign.
    fields : StepFields or None
        One row a state.
    """

    model: str
    stiffness_Nm_per_rad: float
    deflection_rad: NDArray
    torque_Nm: NDArray
    tangent_Nm_per_rad: NDArray
    peak_von_mises_Pa: NDArray
    min_clearance_m: NDArray
    strain_energy_J: NDArray
    contact_onset: Mapping[str, ContactOnset | None]
    ended_by: Mapping[str, str]
    mesh: MeshSummary
    snapshots: Mapping[str, FieldSnapshot]
    wall_s: float
    regional_peak_Pa: Mapping[str, NDArray] = field(default_factory=dict)
    fields: StepFields | None = None
    regional_principal_Pa: Mapping[str, NDArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        if np.any(np.diff(self.deflection_rad) <= 0):
            raise DesignError("a stiffness curve must be sorted by deflection, without repeats")

    def reached_Nm(self) -> dict[str, float]:
        """The largest torque (magnitude) that was computed in each direction."""
        return {name: float(np.max(sign * self.torque_Nm)) for name, sign in SIGN.items()}

    def secant_Nm_per_rad(self, deflection_rad: float) -> float:
        """Torque over deflection at a deflection inside the curve."""
        return self.torque_at_Nm(deflection_rad) / deflection_rad

    def torque_at_Nm(self, deflection_rad: float) -> float:
        """Torque at a deflection inside the curve (cubic Hermite on the exact tangents).

        Raises
        ------
        DesignError
            Outside the computed range.
        """
        low, high = self.deflection_rad[[0, -1]]
        if not low <= deflection_rad <= high:
            raise DesignError(
                f"deflection {deflection_rad:.4g} rad is outside the computed curve,"
                f" {low:.4g} to {high:.4g} rad"
            )
        return float(
            hermite(deflection_rad, self.deflection_rad, self.torque_Nm, self.tangent_Nm_per_rad)
        )

    def stress_at_torque_Pa(
        self, torque_Nm: float, region: str | None = None, *, principal: bool = False
    ) -> float:
        """Peak von Mises stress at a torque, linear between states and beyond the last one.

        Of the whole body or of one region; of a region also the largest ``principal`` stress.
        """
        if torque_Nm == 0:
            return 0.0
        side = self.torque_Nm * np.sign(torque_Nm) > 0
        regional = self.regional_principal_Pa if principal else self.regional_peak_Pa
        peaks = self.peak_von_mises_Pa if region is None else regional[region]
        torque, stress = np.abs(self.torque_Nm[side]), peaks[side]
        order = np.argsort(torque)
        ratio = np.interp(abs(torque_Nm), torque[order], (stress / torque)[order])
        return float(ratio * abs(torque_Nm))


def hermite(x: float | NDArray, xp: NDArray, fp: NDArray, slope: NDArray) -> NDArray:
    """Piecewise cubic through values and slopes at ``xp`` (increasing)."""
    k = np.clip(np.searchsorted(xp, x, side="right") - 1, 0, len(xp) - 2)
    h = xp[k + 1] - xp[k]
    s = (x - xp[k]) / h
    value = fp[k] * (1 + 2 * s) * (1 - s) ** 2 + fp[k + 1] * s**2 * (3 - 2 * s)
    return value + h * s * (1 - s) * (slope[k] * (1 - s) - slope[k + 1] * s)


@dataclass(frozen=True, kw_only=True)
class MeshErrorEstimate:
    """Stiffness on a series of meshes, its extrapolation, and the default mesh's own error.

    ``sizes`` are relative element sizes (1 is the default mesh). ``relative_error`` is the
    default 3D mesh's distance to the extrapolated value; ``verdict`` is ``converged``,
    ``converging`` or ``not converging``.
    """

    sizes: tuple[float, ...]
    stiffness_Nm_per_rad: tuple[float, ...]
    extrapolated_Nm_per_rad: float
    observed_order: float
    relative_error: float
    verdict: str


def verification_record(
    design_name: str,
    material_name: str,
    result: StiffnessResult,
    error: MeshErrorEstimate | None,
    *,
    wall_s: float,
) -> dict:
    """What `dftfs verify --json` prints: the result as a mapping, its curve as a list of states."""
    columns = {
        "deflection_rad": result.deflection_rad,
        "torque_Nm": result.torque_Nm,
        "tangent_Nm_per_rad": result.tangent_Nm_per_rad,
        "peak_von_mises_Pa": result.peak_von_mises_Pa,
        "min_clearance_m": result.min_clearance_m,
        **{
            f"peak_{region.replace(' ', '_')}_Pa": values
            for region, values in result.regional_peak_Pa.items()
        },
    }
    return {
        "design": design_name,
        "material": material_name,
        "model": result.model,
        "stiffness_Nm_per_rad": result.stiffness_Nm_per_rad,
        "curve": [
            {name: float(values[k]) for name, values in columns.items()}
            for k in range(len(result.deflection_rad))
        ],
        "contact_onset": result.contact_onset,
        "ended_by": result.ended_by,
        "mesh": result.mesh,
        "mesh_error": error,
        "wall_s": wall_s,
    }
