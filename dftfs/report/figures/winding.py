"""The spring's shape while an actuator runs: what the animation of a simulation's page draws.

The arms are the rod model's (`dftfs.spring.rod`) at deflections between the extremes of the run;
the page interpolates between them. The hub turns with the gear output, the rim with the load.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from dftfs.design import SpringDesign
from dftfs.spring.rod import rod_curve

FRAMES_PER_s = 30
MOST_FRAMES = 900
SHAPES = 25
TRACE_POINTS = 1500
RIM_POINTS = 5  # of an arm where it has grown onto the rim


def winding_frames(design: SpringDesign, actuator) -> Mapping[str, object]:
    """Shapes and time series as plain numbers (mm, rad, Nm, s), rounded for the page.

    ``actuator`` has ``trajectory`` as a simulated scenario has. A deflection of the actuator is
    gear output less load and unwinds the arms when positive (`dftfs.analysis.study.actuator`).

    Raises
    ------
    SolveError
        If the rod has no equilibrium at a deflection of the run.
    """
    run = actuator.trajectory
    winds = -run.spring_deflection_rad
    low, high = min(float(winds.min()), -1e-4), max(float(winds.max()), 1e-4)
    grid = np.linspace(low, high, SHAPES)
    material = design.material
    rod = rod_curve(
        design.outline,
        design.width_m,
        material.youngs_modulus_Pa,
        material.poisson_ratio,
        grid,
    )
    rows = _rows(run.time_s)
    spiral = design.spiral
    found = {
        "arms": int(spiral.n_arms),
        "thickness": 1e3 * spiral.thickness_m,
        "bore": 1e3 * spiral.bore_radius_m,
        "hub": 1e3 * spiral.hub_radius_m,
        "rimInner": 1e3 * spiral.rim_inner_radius_m,
        "rimOuter": 1e3 * spiral.rim_outer_radius_m,
        "rimPoints": RIM_POINTS,
        "grid": _rounded(grid, 6),
        "shapes": [
            _rounded(1e3 * _whole_arm(design, shape, turn), 3)
            for shape, turn in zip(rod.centreline_m, grid, strict=True)
        ],
        "time": _rounded(run.time_s[rows], 4),
        "output": _rounded(run.wheel_angle_rad[rows], 6),
        "load": _rounded(run.load_angle_rad[rows], 6),
        "torque": _rounded(run.torque_Nm[rows], 4),
        "current": _rounded(run.current_A[rows], 4),
    }
    fine = np.unique(np.linspace(0, run.time_s.size - 1, TRACE_POINTS).astype(int))
    found["traceTime"] = _rounded(run.time_s[fine], 4)
    found["traceTorque"] = _rounded(run.torque_Nm[fine], 4)
    found["traceReference"] = _torque_reference(run, fine)
    return found


def _whole_arm(design: SpringDesign, free_m: NDArray, turn_rad: float) -> NDArray:
    """The bent arm with its roots: the hub's end stays, the rim's end turns with the rim."""
    line, feet = design.spiral.centreline, design.outline.feet
    inside = line.point(np.linspace(line.start, feet.notch_theta, 4)[:-1])
    outside = line.point(np.linspace(feet.slit_theta, line.end, RIM_POINTS + 1)[1:])
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    turned = outside @ np.array([[cosine, sine], [-sine, cosine]])
    return np.concatenate((inside, free_m, turned))


def _rows(time_s: NDArray) -> NDArray:
    """Rows nearest to the frames of a film."""
    duration = float(time_s[-1] - time_s[0])
    count = int(np.clip(round(duration * FRAMES_PER_s) + 1, 2, MOST_FRAMES))
    wanted = np.linspace(time_s[0], time_s[-1], count)
    return np.clip(np.searchsorted(time_s, wanted), 0, time_s.size - 1)


def _rounded(values: NDArray, digits: int) -> list:
    return np.round(np.asarray(values, dtype=float), digits).tolist()


def _torque_reference(run, rows):
    if run.reference is None or (run.reference_name or "").endswith("_rad"):
        return None
    return _rounded(run.reference[rows], 4)
