"""All results of the study of one design, for the report."""

from collections.abc import Mapping
from dataclasses import dataclass

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.strength.friction_loop import FrictionLoop
from dftfs.analysis.structure.result import StructureResult, structure_checks
from dftfs.analysis.torsion.result import MeshErrorEstimate, StiffnessResult
from dftfs.design import SpringDesign
from dftfs.fem.mesh import TaggedMesh
from dftfs.spring.closed_forms import ClosedForm


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """What a result was made with: versions of the tools, hash of the design, time, command."""

    design_hash: str
    versions: Mapping[str, str]
    made_utc: str
    command: str
    solver: str
    wall_s: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """Everything that one study found.

    ``rod`` is a `dftfs.spring.rod.RodCurve` (with the root-compliance correction), ``export`` a
    `dftfs.cad.export.ExportResult`, ``actuator`` a `rsea_core.scenarios.scenario.ScenarioResult`;
    ``solid_vertices_m``/``solid_triangles`` the tessellated part, ``sector`` the planar mesh.
    ``stiffness_uncertainty_Nm_per_rad`` bounds discretisation only: material and manufacture are
    not in it. ``lateral_stiffness_N_per_m`` is the softest direction of the rim without a bearing.
    ``friction_loop`` is None where no friction was asked for.
    """

    design: SpringDesign
    checks: tuple[Check, ...]
    closed_forms: tuple[ClosedForm, ...]
    eq_2_1_Nm_per_rad: float
    rod: object
    rod_onset: Mapping[str, object]
    planar: StiffnessResult
    solid: StiffnessResult
    mesh_error: MeshErrorEstimate
    stiffness_uncertainty_Nm_per_rad: float
    lateral_stiffness_N_per_m: float
    sector: TaggedMesh
    export: object
    solid_vertices_m: object
    solid_triangles: object
    actuator: object
    provenance: Provenance
    friction_loop: FrictionLoop | None = None
    structure: StructureResult | None = None

    @property
    def judged(self) -> tuple[Check, ...]:
        """The requirements, and stability up to the operating torque where one is stated."""
        torque = self.design.requirements.operating_torque_Nm
        if self.structure is None or torque is None:
            return self.checks
        return (*self.checks, *structure_checks(self.structure, torque))
