"""How much torque each part of a torque controller's command carries, sample by sample.

The parts are those of `laws.torque_loop`: the reference itself, the wheel's inertia and damping
along the wanted motion, the friction that the model expects, the back-EMF. What is left of the
command is feedback: the law's own gains, its integral, an observer's estimate. The load's motion
goes through the law's own filters once more, so that the parts are those of the run, to round-off.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

import rsea_core.control.laws.torque_loop as loop
from rsea_core.control.laws.base import Controller
from rsea_core.errors import ControllerError
from rsea_core.machine.spring_table import spring_tangent_Nm_per_rad
from rsea_core.numeric.arrays import read_only
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.trajectory import Trajectory

PARTS = ("reference", "inertia", "damping", "friction", "back-EMF", "feedback")


@dataclass(frozen=True, kw_only=True)
class CompensationTrace:
    """Parts of the command as torques at the wheel.

    Attributes
    ----------
    time_s : (n,) array
        Of the samples, when the readings were taken.
    parts : mapping
        A (n,) array [Nm] for each of PARTS; their sum is the command before it was limited.
    """

    time_s: NDArray
    parts: dict[str, NDArray]

    def rms_Nm(self, from_s: float) -> dict[str, float]:
        """Root mean square of each part from a time on."""
        rows = self.time_s >= from_s
        return {name: float(np.sqrt((part[rows] ** 2).mean())) for name, part in self.parts.items()}


def compensation_trace(
    controller: Controller, run: Trajectory, reference: Reference | AngleReference
) -> CompensationTrace:
    """The parts of a run's command.

    Parameters
    ----------
    controller : Controller
        That the run was made with, for the run's own machine.
    run : Trajectory
    reference : Reference or AngleReference
        That the run followed.

    Raises
    ------
    ControllerError
        If the law has no such parts, or the run has no row for every sample.
    """
    if not isinstance(controller, loop.TorqueLoop):
        raise ControllerError(f"{controller.kind} has no parts that add up to a torque")
    every = round(controller.sample_time_s / float(np.median(np.diff(run.time_s))))
    late = controller.delay_samples
    if every < 1 or run.time_s[::every].size <= late:
        raise ControllerError("a compensation trace needs a row for each sample of the controller")
    n = run.time_s[::every].size - late  # the command that answers the last readings never acts
    p = controller.compile(run.model, run.load).parameters[: loop.N_SHARED]
    spring = run.model.spring_table(run.load)
    target, rate, acceleration = reference.sample(run.time_s)[::every][:n].T
    motor_w, load_w, load_a = (values[:n] for values in _speeds(p, run, every))
    deflection = np.array([loop.table_deflection.py_func(spring.regions, t) for t in target])
    stiffness = spring_tangent_Nm_per_rad(spring, deflection)
    wanted_w = rate / stiffness + (load_w if p[loop.FOLLOW_LOAD] >= 1.0 else 0.0)
    wanted_a = acceleration / stiffness + (load_a if p[loop.FOLLOW_LOAD] == 2.0 else 0.0)
    forward = p[loop.FEEDFORWARD]
    pairs = zip(wanted_w, target, strict=True)
    friction = np.zeros(n)
    if p[loop.COMPENSATION] != 0.0:
        friction = np.array([loop.friction_estimate.py_func(p, w, t) for w, t in pairs])
    emf_w = (0.0, wanted_w, motor_w / p[loop.GEAR])[int(p[loop.EMF])]
    known = (
        forward * target,
        forward * p[loop.INERTIA] * wanted_a,
        forward * p[loop.DAMPING] * wanted_w,
        p[loop.COMPENSATION] * friction,
        p[loop.PER_SPEED] / p[loop.PER_TORQUE] * emf_w * np.ones(n),
    )
    asked = run.unsaturated_command[::every][late:] / p[loop.PER_TORQUE]
    parts = zip(PARTS, (*known, asked - sum(known)), strict=True)
    return CompensationTrace(
        time_s=read_only(run.time_s[::every][:n].copy()),
        parts={name: read_only(part) for name, part in parts},
    )


def _speeds(p: NDArray, run: Trajectory, every: int) -> tuple[NDArray, NDArray, NDArray]:
    """Motor speed, load speed and acceleration as `torque_loop.sense` filters them."""
    keep, period = p[loop.LOAD_KEEP], p[loop.T]
    if p[loop.IDEAL] == 0.0:
        load_w = _slope(run.encoder_load_angle_rad[::every], keep, period)
        motor_w = _slope(run.encoder_motor_angle_rad[::every], p[loop.D_KEEP], period)
        return motor_w, load_w, _slope(load_w, keep, period)
    load, load_w = run.load_angle_rad[::every], run.load_velocity_rad_per_s[::every]
    last_w = np.concatenate(([0.0], load_w[:-1]))
    change = (1.0 - keep) * (np.diff(load, prepend=load[0]) / period - last_w)
    load_a = lfilter([(1.0 - keep) / period], [1.0, -keep], change)
    return run.motor_velocity_rad_per_s[::every], load_w, load_a


def _slope(values: NDArray, keep: float, period_s: float) -> NDArray:
    """The filtered backward difference of a signal that begins at rest."""
    steps = np.diff(values, prepend=values[0]) / period_s
    return lfilter([1.0 - keep], [1.0, -keep], steps)
