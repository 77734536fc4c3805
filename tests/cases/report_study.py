"""A small study with made-up fields on a real design and mesh, for the report's tests."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import sector_mesh
from dftfs.analysis.strength.checks import Check
from dftfs.analysis.study.result import Provenance, StudyResult
from dftfs.analysis.torsion.result import (
    SIGN,
    ContactOnset,
    FieldSnapshot,
    MeshErrorEstimate,
    MeshSummary,
    StiffnessResult,
)
from dftfs.cad.export import ExportResult
from dftfs.cad.step import StepCheck
from dftfs.cad.stl import StlCheck
from dftfs.design import SpringDesign, load_design
from dftfs.spring.closed_forms import ClosedForm
from dftfs.spring.edges import rotate
from rsea_core.performance.limits import TrackingLimits
from rsea_core.simulation.tracking_metrics import TrackingMetrics

K = 66.09
ENDS_rad = {"winding": 0.37, "unwinding": -0.2}
COARSE = MeshSizing(across=2, along=1.5, fillet=2.0, growth=0.7, ring=0.9)
CHECKS = (
    Check(
        name="stiffness", value=K, unit="Nm/rad", limit="65 Nm/rad +- 5 %", passed=True, note="1"
    ),
    Check(
        name="contact-free torque, unwinding",
        value=13.6,
        unit="Nm",
        limit="at least 15.2 Nm",
        passed=False,
    ),
    Check(
        name="safety factor to yield",
        value=None,
        unit="",
        limit="at least 1.2 at 15.2 Nm",
        passed=None,
        note="the material has no strengths: <script>none</script>",
    ),
)


def turned(points: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Each point turned about the axis by its own angle."""
    c, s = np.cos(angles_rad), np.sin(angles_rad)
    return np.column_stack(
        [c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]]
    )


def snapshot(design: SpringDesign, sector, deflection_rad: float) -> FieldSnapshot:
    """Rings that turn in proportion to their radius, stress largest at the notch."""
    inner, outer = design.spiral.bore_radius_m, design.spiral.rim_outer_radius_m
    share = (np.hypot(*sector.nodes.T) - inner) / (outer - inner)
    moved = turned(sector.nodes, deflection_rad * share) - sector.nodes
    peak = int(sector.boundaries["notch_fillet"][0, 1])
    distance = np.linalg.norm(sector.nodes - sector.nodes[peak], axis=1)
    stress = abs(deflection_rad) * (5e8 * share * (1 - share) + 1e9 * 8 * np.exp(-distance / 4e-4))
    turns = [2 * np.pi * k / design.n_arms for k in range(design.n_arms)]
    return FieldSnapshot(
        deflection_rad=deflection_rad,
        torque_Nm=K * deflection_rad,
        nodes_m=np.concatenate([rotate(sector.nodes, a) for a in turns]),
        cells=np.concatenate([sector.cells + k * len(share) for k in range(design.n_arms)]),
        displacement_m=np.concatenate([rotate(moved, a) for a in turns]),
        von_mises_Pa=np.tile(stress, design.n_arms),
        peak_at_m=tuple(sector.nodes[peak].tolist()),
    )


def stiffness_result(design: SpringDesign, sector, model: str, factor: float) -> StiffnessResult:
    """A slightly bent curve of a model, ``factor`` times as stiff as K."""
    angle = np.array([-0.2, -0.1, 0.0, 0.15, 0.37])
    stiffness = factor * K
    onsets = {
        direction: ContactOnset(
            deflection_rad=end, torque_Nm=stiffness * end * (1 - 0.03 * end), at_m=(0.05, -0.045)
        )
        for direction, end in ENDS_rad.items()
    }
    return StiffnessResult(
        model=model,
        stiffness_Nm_per_rad=stiffness,
        deflection_rad=angle,
        torque_Nm=stiffness * angle * (1 - 0.03 * angle),
        tangent_Nm_per_rad=stiffness * (1 - 0.06 * angle),
        peak_von_mises_Pa=1.2e9 * np.abs(angle),
        min_clearance_m=np.array([0.0, 5e-4, 1.08e-3, 7e-4, 0.0]),
        strain_energy_J=0.5 * stiffness * angle**2,
        contact_onset=onsets,
        ended_by=dict.fromkeys(ENDS_rad, "first contact of the coils"),
        mesh=MeshSummary(
            dimension=3,
            nodes=12345,
            elements=678,
            unknowns=37035,
            min_corner_sine=0.41,
            symmetry="1 of 2 sectors",
            solver="superlu",
        ),
        snapshots={d: snapshot(design, sector, ENDS_rad[d]) for d in SIGN},
        wall_s=3.21,
    )


def actuator() -> SimpleNamespace:
    """A run that lags its reference, with the report's part of a scenario's result."""
    time = np.linspace(0, 2, 4001)
    reference, torque = 10 * np.sin(2 * np.pi * time), 10 * np.sin(2 * np.pi * (time - 2e-3))
    trajectory = SimpleNamespace(
        time_s=time,
        reference=reference,
        reference_name="reference_torque_Nm",
        torque_Nm=torque,
        command=0.6 * np.cos(2 * np.pi * time),
        command_name="duty",
        current_A=4.0 * np.cos(2 * np.pi * time),
        model=SimpleNamespace(rig=SimpleNamespace(current_limit_A=6.06)),
    )
    metrics = TrackingMetrics(
        from_s=0.5,
        rmse_Nm=0.0888,
        peak_error_Nm=0.126,
        amplitude_ratio=1.0,
        phase_deg=-0.72,
        overshoot_percent=None,
        command_rms=0.424,
        command_peak=0.6,
        current_rms_A=2.83,
        current_peak_A=4.0,
        motor_speed_peak_rad_per_s=57.1,
    )
    limits = TrackingLimits(
        binding="loop",
        sentence="No drive limit was reached; the tracking error is 0.0888 Nm rms.",
        share_command_limited=0.25,
        share_current_limited=0.0,
        share_outside_spring_range=0.0,
        torque_rate_needed_Nm_per_s=62.8,
        torque_rate_available_Nm_per_s=None,
        encoder_step_Nm=0.0507,
        encoder_error_Nm=0.0002,
        loop_error_Nm=0.08,
        largest_amplitude_Nm=13.4,
        largest_by_voltage_Nm=27.4,
        largest_by_current_Nm=355.0,
        largest_by_spring_Nm=13.4,
    )
    return SimpleNamespace(trajectory=trajectory, metrics=metrics, limits=limits)


def export_result(design: SpringDesign, folder: Path) -> ExportResult:
    """Two small files, of which one exists."""
    step = folder / "the part.step"
    step.write_bytes(b"x" * 2345)
    across = 2 * design.spiral.rim_outer_radius_m
    return ExportResult(
        name="the part",
        files={"step": step, "stl": folder / "gone.stl"},
        volume_m3=design.outline.area_m2 * design.width_m,
        mass_kg=design.mass_kg,
        bounding_box_m=(across, across, design.width_m),
        step=StepCheck(volume_error=1.6e-9, bounding_box_error=1e-12, faces=24),
        stl=StlCheck(chord_tolerance_m=1e-5, triangles=7236, volume_error=-1.2e-4),
        dxf_arcs=None,
        dxf_polyline=None,
    )


def box(size_m: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of a box."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) * size_m
    squares = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    return corners, np.array(triangles)


def small_study(folder: Path) -> StudyResult:
    """One study of the design al1 under a name that must be escaped."""
    design = replace(load_design("al1"), name="a<b>&c")
    sector = sector_mesh(design.outline, COARSE)
    angle = np.linspace(-0.2, 0.37, 12)
    vertices, triangles = box((0.17, 0.12, 0.00734))
    return StudyResult(
        design=design,
        checks=CHECKS,
        closed_forms=(
            ClosedForm(
                equation="2.1",
                quantity="stiffness",
                unit="Nm/rad",
                as_printed=34.04,
                corrected=60.22,
                note="pi n (R_o + R_i) < 3",
                erratum="S6, S8",
            ),
            ClosedForm(
                equation="2.4",
                quantity="maximum length",
                unit="m",
                as_printed=1.079,
                corrected=None,
                note="",
                erratum="S14",
            ),
        ),
        eq_2_1_Nm_per_rad=60.22,
        rod=SimpleNamespace(
            deflection_rad=angle,
            torque_Nm=1.004 * K * angle * (1 - 0.03 * angle),
            tangent_Nm_per_rad=1.004 * K * (1 - 0.06 * angle),
            stiffness_Nm_per_rad=1.004 * K,
        ),
        rod_onset={"winding": None, "unwinding": None},
        planar=stiffness_result(design, sector, "2D plane stress quad8", 0.9995),
        solid=stiffness_result(design, sector, "3D hex20", 1.0),
        mesh_error=MeshErrorEstimate(
            sizes=(1.0, 0.667, 0.444),
            stiffness_Nm_per_rad=(66.09, 66.07, 66.067),
            extrapolated_Nm_per_rad=66.066,
            observed_order=4.7,
            relative_error=4.5e-4,
            verdict="converged",
        ),
        stiffness_uncertainty_Nm_per_rad=0.03,
        lateral_stiffness_N_per_m=34.3e3,
        sector=sector,
        export=export_result(design, folder),
        solid_vertices_m=vertices,
        solid_triangles=triangles,
        actuator=actuator(),
        provenance=Provenance(
            design_hash="3f9a",
            versions={"dftfs": "0.1.0"},
            made_utc="2026-01-02T03:04:05Z",
            command="dftfs study al1",
            solver="superlu",
            wall_s={"rod": 0.02},
        ),
    )
