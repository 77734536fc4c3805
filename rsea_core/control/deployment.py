"""A controller as a folder of C99 for a real machine: law, guard, log writer and test bench.

The bench replays a simulated run through the guard and injects faults; what it logs is a recording
that `diagnose` reads, so that design, deployment, recording and diagnosis form one circle.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.c_header import c_header, c_name, named, template
from rsea_core.control.closed_loop import ROW_s
from rsea_core.control.laws.base import Controller
from rsea_core.control.laws.torque_loop import command_scale
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.trajectory import Trajectory

BOUNDS = {"double": 1e-12, "float": 1e-3}  # of the replay, relative to the largest command
LEAST_SAMPLES = 30
MARGIN = 2.0  # of speeds and torque over what the run has


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What the guard allows; see `data/c/guard.h`.

    Attributes
    ----------
    dt_share : float
        Of the period, by which a measured one may be off.
    watchdog_s : float
        Without a call the command is zero after this time.
    motor_speed_rad_per_s, load_speed_rad_per_s : float
        Faster changes of a reading are a jump.
    rate_per_s : float
        Of the command.
    torque_Nm, lowest_rad, highest_rad : float
        Of the spring; of the load.
    blend_s : float
        Time in which the reference moves from what is measured to what is asked.
    most_held : int
        Bad samples in a row during which the command is held.
    continuous_A, thermal_s : float
        Current that the drive stands for ever, and the time constant of its heat (I2t): the
        command is zero where the filtered square of the estimated current exceeds that of the
        first. Infinite: no such limit.

    Raises
    ------
    ControllerError
        If a number is not above zero, the travel is empty, or one of the last two is stated alone.
    """

    dt_share: float = 0.5
    watchdog_s: float
    motor_speed_rad_per_s: float
    load_speed_rad_per_s: float
    rate_per_s: float
    torque_Nm: float
    lowest_rad: float = -math.inf
    highest_rad: float = math.inf
    blend_s: float = 0.2
    most_held: int = 5
    continuous_A: float = math.inf
    thermal_s: float = math.inf

    def __post_init__(self):
        for name in ("dt_share", "watchdog_s", "motor_speed_rad_per_s", "load_speed_rad_per_s",
                     "rate_per_s", "torque_Nm", "blend_s"):  # fmt: skip
            if not 0.0 < getattr(self, name) < math.inf:
                raise ControllerError(f"{name} = {getattr(self, name)} must be finite and above 0")
        if not self.lowest_rad < self.highest_rad:
            raise ControllerError(
                f"travel from {self.lowest_rad:g} to {self.highest_rad:g} rad: the first must be"
                " below the second"
            )
        for name in ("continuous_A", "thermal_s"):
            if not getattr(self, name) > 0.0:
                raise ControllerError(f"{name} = {getattr(self, name)} must be above 0")
        if math.isfinite(self.continuous_A) != math.isfinite(self.thermal_s):
            raise ControllerError(
                "continuous_A and thermal_s belong together: state both, e.g. 2 A and 10 s"
            )
        if not 0 <= self.most_held <= 1000:
            raise ControllerError(f"most_held = {self.most_held} must be from 0 to 1000")


def limits_of(run: Trajectory, controller: Controller) -> Limits:
    """Limits from a run: twice its speeds and torque, the command's range in four samples."""
    time = run.time_s
    wheel, load = (
        float(np.abs(np.gradient(angle, time)).max())
        for angle in (run.motor_angle_rad, run.load_angle_rad)
    )
    plant = run.model.rig
    count = 2.0 * math.pi / (plant.load_encoder_counts_per_rev or 1000)
    period = controller.sample_time_s
    free = command_range(controller, run)
    return Limits(
        watchdog_s=3.0 * period,
        motor_speed_rad_per_s=MARGIN * max(wheel, 1.0) + 2.0 * count / period,
        load_speed_rad_per_s=MARGIN * max(load, 1.0) + 2.0 * count / period,
        rate_per_s=0.5 * free / period,
        torque_Nm=MARGIN * float(np.abs(run.torque_Nm).max()),
    )


def deployment(
    controller: Controller,
    run: Trajectory,
    reference: Reference | AngleReference,
    limits: Limits,
    *,
    name: str = "controller",
    real: str = "double",
) -> dict[str, str]:
    """Texts by file name: three headers, the bench, what it replays, and a case for `diagnose`.

    Parameters
    ----------
    run : Trajectory
        Of this controller, in closed loop, with the reference.
    real : "double" or "float"

    Raises
    ------
    ControllerError
        If the law has no C form, or the run is shorter than LEAST_SAMPLES samples.
    """
    stem = c_name(name)
    header = c_header(controller, run.model, run.load, prefix=stem, real=real)
    rows = _replayed(controller, run, reference)
    scale = command_range(controller, run)
    replacements = {
        "PERIOD_s": repr(float(controller.sample_time_s)),
        "MEASURED": "rsea_spring_torque_read(&y)"
        if controller.reference_name.endswith("_Nm")
        else "y.load_angle_rad",
        "COMMAND_NAME": run.command_name,
        "LATE": str(controller.delay_samples),
        "BOUND": f"{BOUNDS[real] * scale:.3g}",
        "ROWS": str(len(rows)),
        "STEM": stem,
        "REAL": real,
        **_currents(run, limits),
    }
    table = "\n".join(",".join(f"{x:.17g}" for x in row) for row in rows)
    case = run.model.rig.to_toml() + (
        f'\n[[recording]]\nfile = "log.csv"\nload = "{run.load.kind}"\n'
        f'description = "{stem}, closed loop"\ninitial_rest = true\n' + _contact(run)
    )
    guard = (
        "#ifndef RSEA_CONTROLLER_GUARD\n#define RSEA_CONTROLLER_GUARD\n"
        f'#include "{stem}.h"\n{template("guard.h")}{_defaults(limits)}#endif\n'
    )
    opening = "#ifndef RSEA_CONTROLLER_LOG\n#define RSEA_CONTROLLER_LOG\n#include <stdio.h>\n"
    log = f"{opening}{template('log.h')}#endif\n"
    return {
        f"{stem}.h": header,
        f"{stem}_guard.h": filled(guard, replacements, stem, real),
        f"{stem}_log.h": filled(log, replacements, stem, "double"),
        f"{stem}_bench.c": filled(template("bench.c"), replacements, stem, "double"),
        "replay.csv": "time_s,reference,rate,acceleration,motor_angle_rad,load_angle_rad,"
        f"{run.command_name}\n{table}\n",
        "rig.toml": case,
    }


def _currents(run: Trajectory, limits: Limits) -> dict[str, str]:
    """What the guard estimates the motor's current by: per command, per motor speed, its limit."""
    name, rig = run.command_name, run.model.rig
    if not math.isfinite(limits.continuous_A):
        return {"AMPS_PER_COMMAND": "0.0", "AMPS_PER_SPEED": "0.0", "MOST_A": "HUGE_VAL"}
    plant = run.model.plant(name, run.load)
    most = rig.current_limit_A or math.inf
    if name == POSITION_COMMAND or not plant.torque_per_ampere > 0.0:
        raise ControllerError(f"continuous_A: {name} says nothing of the motor's current")
    per_torque, per_speed, _ = command_scale(plant, name, run.model)
    amps = 1.0 / (per_torque * plant.torque_per_ampere)
    return {
        "AMPS_PER_COMMAND": repr(float(amps)),
        "AMPS_PER_SPEED": repr(float(amps * per_speed / plant.gear_ratio)),
        "MOST_A": repr(float(most)) if math.isfinite(most) else "HUGE_VAL",
    }


def command_range(controller: Controller, run: Trajectory) -> float:
    """Largest command: the law's limit, or the run's largest where it has none."""
    limit = controller.compile(run.model, run.load).command_limit
    return limit if math.isfinite(limit) else float(np.abs(run.command).max())


def filled(text: str, replacements: dict[str, str], prefix: str, real: str) -> str:
    """A template with its words filled in, and every name of C with its prefix."""
    for word, value in replacements.items():
        text = re.sub(rf"(?<![A-Za-z]){word}(?![A-Za-z])", lambda _, v=value: v, text)
    return named(text, ("SPRING", "REGIONS", "GEAR"), prefix, real)


def _replayed(
    controller: Controller, run: Trajectory, reference: Reference | AngleReference
) -> NDArray:
    """(n, 7): time, reference and derivatives, readings, the command that answers them."""
    row = float(np.median(np.diff(run.time_s))) if run.time_s.size > 1 else ROW_s
    samples = slice(0, None, max(round(controller.sample_time_s / row), 1))
    time, command = run.time_s[samples], run.command[samples]
    late = controller.delay_samples
    if time.size - late < LEAST_SAMPLES:
        raise ControllerError(
            f"the run has {time.size} samples; the bench needs at least {LEAST_SAMPLES + late}"
        )
    parts = (
        time,
        reference.sample(run.time_s)[samples],
        run.encoder_motor_angle_rad[samples],
        run.encoder_load_angle_rad[samples],
    )
    return np.column_stack((*(p[: time.size - late] for p in parts), command[late:]))


def _contact(run: Trajectory) -> str:
    """The keys of a contact or of a constant torque, for the case."""
    names = (
        "contact_stiffness_Nm_per_rad", "contact_angle_rad", "contact_damping_Nms_per_rad",
        "load_torque_Nm",
    )  # fmt: skip
    given = ((name, getattr(run.load, name)) for name in names)
    return "".join(f"{name} = {float(value)!r}\n" for name, value in given if value is not None)


def _defaults(limits: Limits) -> str:
    def real(value: float) -> str:
        if math.isinf(value):
            return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
        return repr(float(value))

    numbers = [
        limits.dt_share, limits.watchdog_s, limits.motor_speed_rad_per_s,
        limits.load_speed_rad_per_s, limits.rate_per_s, limits.torque_Nm, limits.lowest_rad,
        limits.highest_rad, limits.blend_s, limits.continuous_A, limits.thermal_s,
    ]  # fmt: skip
    return (
        "static const rsea_limits rsea_default_limits = {\n    "
        + ", ".join(map(real, numbers))
        + f", {limits.most_held}\n}};\n"
    )
