"""A result's curve as a CSV file that says its own sign, units and where it comes from.

`rsea_core.model.spring_curve_file.read_spring_curve` reads it, mirrored to the actuator's sign.
"""

from dftfs import __version__
from dftfs.analysis.torsion.result import UNWINDING, WINDING, StiffnessResult
from dftfs.design import SpringDesign

COLUMNS = ("deflection_rad", "torque_Nm", "tangent_Nm_per_rad")


def curve_csv(design: SpringDesign, result: StiffnessResult, command: str) -> str:
    """The text of ``curve.csv``: notes as ``# key: value``, the columns' names, one state a row."""
    p, onset = design.spiral, result.contact_onset
    notes = {
        "sign": "winding",
        "meaning": "+ turns the rim against the hub so that the arms tighten on the hub",
        "units": "deflection_rad rad, torque_Nm N m, tangent_Nm_per_rad N m/rad",
        "design": design.name,
        "material": f"{design.material.name}, E {design.material.youngs_modulus_Pa / 1e9:g} GPa",
        "geometry": f"{design.n_arms} arms, {p.turns:g} turns, thickness"
        f" {1e3 * p.thickness_m:g} mm, width {1e3 * design.width_m:g} mm",
        "model": f"{result.model}, {result.mesh.elements} elements",
        "made_by": f"dftfs {__version__}: {command}",
    }
    for key, direction in (("contact_negative_rad", UNWINDING), ("contact_positive_rad", WINDING)):
        touch = onset.get(direction)
        if touch is not None:
            notes[key] = repr(float(touch.deflection_rad))
    lines = [f"# {key}: {value}" for key, value in notes.items()]
    rows = zip(result.deflection_rad, result.torque_Nm, result.tangent_Nm_per_rad)
    numbers = [",".join(repr(float(value)) for value in row) for row in rows]
    return "\n".join([*lines, ",".join(COLUMNS), *numbers]) + "\n"
