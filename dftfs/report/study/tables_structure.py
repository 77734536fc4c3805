"""Tables of what a study found beyond torsion: six directions, vibration, stability."""

import numpy as np

from dftfs.analysis.structure.result import StructureResult
from dftfs.analysis.torsion.result import SIGN
from dftfs.fem.linear_model import RIGID_MOTIONS
from dftfs.report.numbers import NOTHING, plain, signed
from dftfs.report.study.tables import Table

_NOTHING = 1e-6  # of two directions' own stiffness: a coupling that is round-off
_NAMES = {"rx": "θx", "ry": "θy", "rz": "θz"}


def structure_tables(result: StructureResult) -> tuple[Table, ...]:
    """All tables of the section, in their order."""
    return (
        _rim_table(result),
        _summary_table(result),
        _lateral_table(result),
        _modes_table(result),
        *((_stability_table(result),) if result.stability else ()),
    )


def _rim_table(result: StructureResult) -> Table:
    matrix = result.rim.matrix
    own = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    names = [_NAMES.get(name, name) for name in RIGID_MOTIONS]
    rows = [
        (
            name,
            *(
                "0" if abs(value) < _NOTHING * scale else plain(float(value), 4)
                for value, scale in zip(row, factors)
            ),
        )
        for name, row, factors in zip(names, matrix, own)
    ]
    return Table(
        caption="Stiffness of the rim against the hub at rest: force (N) and moment (Nm) on the"
        " rim per displacement (m) and turn (rad), about the axis in the mid-plane; z along the"
        " axis. Linear, 3D, bore clamped, rim rigid.",
        head=("", *names),
        rows=tuple(rows),
        numeric=tuple(range(1, 7)),
    )


def _summary_table(result: StructureResult) -> Table:
    rim, mass = result.rim, result.mass_kg
    low, high = rim.lateral_N_per_m
    tilt_low, tilt_high = rim.tilt_Nm_per_rad
    rows = [
        (
            "lateral, softest to stiffest",
            f"{plain(low / 1e3, 4)} to {plain(high / 1e3, 4)}",
            "N/mm",
        ),
        ("softest direction from x", plain(float(np.degrees(rim.softest_direction_rad)), 3), "°"),
        ("axial", plain(rim.axial_N_per_m / 1e3, 4), "N/mm"),
        ("tilt, softest to stiffest", f"{plain(tilt_low, 4)} to {plain(tilt_high, 4)}", "Nm/rad"),
        ("torsion", plain(rim.torsion_Nm_per_rad, 4), "Nm/rad"),
        ("mass", plain(1e3 * mass, 4), "g"),
        ("moment of inertia about the axis", plain(1e6 * result.inertia_kg_m2, 4), "kg mm²"),
    ]
    for name, energy in result.energy_J.items():
        share = result.energy_per_mass_J_per_kg[name]
        rows.append((f"energy at first contact, {name}", plain(energy, 3), "J"))
        rows.append((f"energy per mass at first contact, {name}", plain(share, 3), "J/kg"))
    return Table(
        caption="Figures for design; mass and energy.",
        head=("", "value", "unit"),
        rows=tuple(rows),
        numeric=(1,),
    )


def _lateral_table(result: StructureResult) -> Table:
    rows = [
        (
            signed(state.deflection_rad, 3),
            plain(state.softest_N_per_m / 1e3, 4),
            plain(state.stiffest_N_per_m / 1e3, 4),
            plain(state.force_N, 3),
            plain(state.stiffest_N_per_m * 1e-4 + state.force_N, 3),
        )
        for state in result.lateral
    ]
    return Table(
        caption="Lateral stiffness and bearing load against the angle, up to first contact (plane"
        " stress). With one arm a centred rim is pushed sideways; with more the forces balance.",
        head=(
            "deflection (rad)",
            "softest (N/mm)",
            "stiffest (N/mm)",
            "load, centred (N)",
            "load, 0.1 mm off (N), at most",
        ),
        rows=tuple(rows),
        numeric=(0, 1, 2, 3, 4),
    )


def _modes_table(result: StructureResult) -> Table:
    rows = [
        (
            found.boundary,
            plain(mode.frequency_Hz, 4),
            mode.parity,
            plain(100 * mode.turning, 2) if mode.turning > 1e-4 else NOTHING,
        )
        for found in result.modes
        for mode in found.modes
    ]
    return Table(
        caption="First natural frequencies (3D, consistent mass). Last column: share of the kinetic"
        " energy that the rigid rim, its load and a turning hub have.",
        head=("ends", "frequency (Hz)", "motion", "turning (%)"),
        rows=tuple(rows),
        numeric=(1, 3),
    )


def _stability_table(result: StructureResult) -> Table:
    rows = []
    for direction in (name for name in SIGN if name in result.stability):
        path = result.stability[direction]
        for state in path.states:
            rows.append(
                (
                    direction,
                    signed(state.deflection_rad, 3),
                    signed(state.torque_Nm, 3),
                    plain(state.frequency_Hz, 4),
                    str(state.unstable),
                )
            )
        if path.critical_rad is not None:
            how = "extrapolated" if path.extrapolated else "found"
            rows.append((direction, signed(path.critical_rad, 3), NOTHING, "0", how))
    return Table(
        caption="Out-of-plane stability of a strip that is not wider than thick: lowest"
        " out-of-plane frequency of the turned spring, rim and hub clamped; at 0 the flat spring"
        " buckles out of its plane.",
        head=("direction", "deflection (rad)", "torque (Nm)", "frequency (Hz)", "unstable modes"),
        rows=tuple(rows),
        numeric=(1, 2, 3, 4),
    )
