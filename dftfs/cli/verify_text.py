"""What `dftfs verify` prints: its record as lines of text."""

from dftfs.analysis.torsion.result import ContactOnset
from dftfs.cli.common import table


def _knee(onset: ContactOnset | None) -> str:
    if onset is None:
        return "no contact"
    text = f"first contact at {onset.torque_Nm:+.3f} Nm, {onset.deflection_rad:+.4f} rad"
    if onset.stiffening is None:
        return text
    return (
        f"{text}, tangent {onset.tangent_before_Nm_per_rad:.2f} ->"
        f" {onset.tangent_after_Nm_per_rad:.2f} Nm/rad (x {onset.stiffening:.3f}), penetration up"
        f" to {onset.penetration_m * 1e6:.1f} um"
    )


def text_of(record: dict) -> str:
    """Stiffness, knees, the curve, error bars and strength."""
    error = record["mesh_error"]
    lines = [
        f"{record['design']} ({record['model']}): K = {record['stiffness_Nm_per_rad']:.4f} Nm/rad"
    ]
    if error is not None:
        lines.append(
            f"mesh: extrapolated {error.extrapolated_Nm_per_rad:.4f} Nm/rad, order"
            f" {error.observed_order:.1f}, error of this mesh {error.relative_error * 100:.3f} %:"
            f" {error.verdict}"
        )
    for direction, onset in record["contact_onset"].items():
        lines.append(
            f"{direction}: {_knee(onset)}; the curve ends: {record['ended_by'][direction]}"
        )
    header = ["deflection rad", "torque Nm", "tangent Nm/rad", "peak von Mises MPa", "gap mm"]
    rows = [
        [
            f"{p['deflection_rad']:+.5f}",
            f"{p['torque_Nm']:+.5f}",
            f"{p['tangent_Nm_per_rad']:.3f}",
            f"{p['peak_von_mises_Pa'] / 1e6:.1f}",
            f"{p['min_clearance_m'] * 1e3:.3f}",
        ]
        for p in record["curve"]
    ]
    series = [estimate.line() for estimate in record["mesh_series"]]
    strength = [check.line() for check in record["strength"]]
    size = record["mesh"]
    foot = f"{size.elements} elements, {size.nodes} nodes ({size.symmetry}), {size.solver}"
    return "\n".join(
        [
            *lines,
            "torque over deflection:",
            table(header, rows),
            *series,
            *strength,
            f"{foot}, {record['wall_s']:.1f} s",
        ]
    )
