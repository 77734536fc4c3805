"""How the actuator of a simulation moves and where its power goes, against time."""

import numpy as np

from dftfs.report.figures.actuator import decimated
from dftfs.report.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_DEG = 180.0 / np.pi


def motion_figure(actuator, encode=as_svg) -> ReportFigure:
    """Angles, spring deflection and power of a simulated scenario.

    ``actuator`` has ``trajectory`` as a simulated scenario has; ``encode`` is `as_svg` or
    `as_png`.
    """
    run = actuator.trajectory
    time = run.time_s
    with house_style():
        figure = new_figure(5.4)
        grid = figure.add_gridspec(3, 1, height_ratios=[1.2, 1.0, 1.2])
        angles = figure.add_subplot(grid[0])
        deflection = figure.add_subplot(grid[1], sharex=angles)
        power = figure.add_subplot(grid[2], sharex=angles)
        for values, colour, label in (
            (run.wheel_angle_rad, BLUE, "gear output"),
            (run.load_angle_rad, ORANGE, "load"),
        ):
            angles.plot(*decimated(time, values * _DEG), color=colour, lw=1.3, label=label)
        angles.set_ylabel("angle (deg)")
        deflection.plot(*decimated(time, run.spring_deflection_rad * _DEG), color=INK, lw=1.1)
        deflection.set_ylabel("deflection (deg)")
        flows = [(run.torque_Nm * run.load_velocity_rad_per_s, GREEN, "to the load")]
        if run.energy is not None:
            supplied = np.gradient(run.energy.supplied_J, time)
            heat = np.gradient(run.energy.joule_J, time)
            flows = [(supplied, BLUE, "supplied"), (heat, VERMILION, "heat of the winding"), *flows]
        for values, colour, label in flows:
            power.plot(*decimated(time, values), color=colour, lw=1.1, label=label)
        power.set_ylabel("power (W)")
        power.set_xlabel("time (s)")
        for axes in (angles, power):
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.25 * (high - low))
            axes.legend(loc="upper right", ncols=3)
        for axes in (angles, deflection):
            axes.tick_params(labelbottom=False)
        angles.set_xlim(time[0], time[-1])
        figure.align_ylabels()
        peak = float(np.abs(run.spring_deflection_rad).max()) * _DEG
        return encode(
            figure,
            name="motion",
            alt=f"Angles of gear output and load, deflection up to {peak:.3g} degrees, and power.",
            caption="From above: angles at the joint; gear output less load; power at the winding's"
            " terminals, heat in it, and power through the spring to the load.",
        )
