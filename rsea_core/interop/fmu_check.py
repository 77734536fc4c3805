"""An FMU of a run's machine checked by fmpy: its description, and the run repeated.

Source: fmpy, https://github.com/CATIA-Systems/FMPy (validation after FMI 3.0.1).
"""

import tempfile
from pathlib import Path

import numpy as np

from rsea_core.interop.fmu import OUTPUTS, row_of
from rsea_core.simulation.trajectory import Trajectory

BOUND = 1e-6  # of each signal's largest value


def checked(content: bytes, ran: Trajectory) -> dict:
    """What fmpy finds in an FMU, and how far it is from a run with the run's commands.

    Returns
    -------
    dict
        `problems` of the description; `difference` of each output, relative to its largest value;
        `passed`: no problem and no difference above BOUND, None where fmpy is not installed.
    """
    try:
        import fmpy
        from fmpy.validation import validate_fmu
    except ImportError:
        return {"passed": None, "problems": [], "difference": {}}
    none = np.zeros_like(ran.time_s)
    names = ["time", ran.command_name, "load_torque_Nm"]
    given = np.rec.fromarrays([ran.time_s, ran.command, none], names=names)
    row_s = row_of(ran)
    with tempfile.TemporaryDirectory() as made:
        path = Path(made, "machine.fmu")
        path.write_bytes(content)
        problems = [str(problem) for problem in validate_fmu(str(path))]
        found = fmpy.simulate_fmu(
            str(path), input=given, output=list(OUTPUTS), stop_time=float(ran.time_s[-1]),
            step_size=row_s, output_interval=row_s, fmi_type="CoSimulation",
        )  # fmt: skip
    difference = {
        name: float(np.abs(found[name] - getattr(ran, name)).max())
        / max(float(np.abs(getattr(ran, name)).max()), 1e-12)
        for name in OUTPUTS
    }
    passed = not problems and max(difference.values()) <= BOUND
    return {"passed": passed, "problems": problems, "difference": difference}
