"""The simulated machine in C beside a deployed law: the loop closed without the machine.

The machine is that of the FMU (`fmu.plant_header`), in a file of its own, so that its names meet no
others; it advances in steps of 0.1 ms, as a bench in hardware would.
"""

import math

import numpy as np

from rsea_core.control.c_header import c_name, template
from rsea_core.control.deployment import filled
from rsea_core.control.laws.base import Controller
from rsea_core.interop.fmu import plant_header
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.simulation.trajectory import Trajectory

SHARES = {"double": 1e-6, "float": 1e-3}  # of the angles' range, beside two encoder counts


def machine_in_c(
    controller: Controller, run: Trajectory, *, name: str, real: str = "double"
) -> dict[str, str]:
    """Texts by file name: the machine of a run, its header, and the program that closes the loop.

    Parameters
    ----------
    run : Trajectory
        As `deployment` takes it; its `replay.csv` is what the program reads.

    Raises
    ------
    SimulationError
        If the machine has what the C has not; the message names it.
    """
    stem, rig = c_name(name), run.model.rig
    replacements = {
        "PERIOD_s": repr(float(controller.sample_time_s)),
        "LATE": str(controller.delay_samples),
        "STEM": stem,
        "REAL": real,
    }
    for part in ("motor", "load"):
        angle = getattr(run, f"{part}_angle_rad")
        counts = getattr(rig, f"{part}_encoder_counts_per_rev")
        count = count_angle_rad(counts) if counts else 0.0
        count = count if math.isfinite(count) else 0.0
        replacements[f"{part.upper()}_COUNT"] = repr(float(count))
        replacements[f"{part.upper()}_START"] = repr(float(angle[0]))
        replacements[f"{part.upper()}_BOUND"] = (
            f"{2.0 * count + SHARES[real] * np.ptp(angle) + 1e-12:.6g}"
        )
    header = plant_header(run.model, run.load, run.command_name)
    machine = template("machine.c").replace("PLANT_HEADER", header).replace("STEM", stem)
    guard = f"#ifndef RSEA_CONTROLLER_PLANT\n#define RSEA_CONTROLLER_PLANT\n{template('machine.h')}"
    return {
        f"{stem}_plant.h": filled(f"{guard}#endif\n", replacements, stem, "double"),
        f"{stem}_plant.c": machine.replace("rsea_machine_", f"{stem}_machine_"),
        f"{stem}_loop.c": filled(template("loop.c"), replacements, stem, "double"),
    }
