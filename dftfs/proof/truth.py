"""One recording of the true machine: inputs in, exact motion out."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dftfs.errors import DftfsError
from dftfs.proof.machine import LOAD_MODES, InternalStates, Machine, Physics, Series
from dftfs.proof.truth_kernel import OUTPUTS, Inputs, Run, advance, at_rest, integrate, read

FINE_STEP_S = 20e-6


class TruthError(DftfsError):
    """The true machine cannot do what is required."""

    exit_status = 3


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What acts on the machine during one recording, one value per sample.

    ``command``: duty (-1..1), or amperes where ``by_current``; ``gain``: supply relative to its
    own constant; ``volts``: offset of the bridge; ``outside_Nm``: torque on the load.
    """

    interval_s: float
    command: np.ndarray
    by_current: bool = False
    gain: np.ndarray | None = None
    volts: np.ndarray | None = None
    outside_Nm: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class Start:
    """The machine at rest; ``backlash_place`` is where the gear output lies in it, -1 to 1."""

    motor_angle_rad: float = 0.0
    load_angle_rad: float = 0.0
    backlash_place: float = 0.0
    internal: InternalStates = field(default_factory=InternalStates)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Exact motion: ``values[name]`` per sample, and what the machine remembers of it."""

    values: dict[str, np.ndarray]
    internal: InternalStates


def move(
    machine: Machine,
    physics: Physics,
    series: Series,
    load: str,
    drive: Drive,
    start: Start,
    *,
    step_s: float = FINE_STEP_S,
) -> Motion:
    """Integrate one recording.

    Raises
    ------
    TruthError
        If the motion leaves every bound: the numbers of this machine are unphysical.
    """
    count = drive.command.size
    substeps = max(1, round(drive.interval_s / step_s))
    run = Run(LOAD_MODES[load], drive.by_current, drive.interval_s, substeps)
    ones, zeros = np.ones(count), np.zeros(count)
    inputs = Inputs(
        command=np.ascontiguousarray(drive.command, dtype=float),
        gain=ones if drive.gain is None else drive.gain,
        volts=zeros if drive.volts is None else drive.volts,
        ext=zeros if drive.outside_Nm is None else drive.outside_Nm,
    )
    begin = np.array([start.motor_angle_rad, start.backlash_place, start.load_angle_rad])
    out, left = integrate(machine, physics, series, run, inputs, begin, np.array(start.internal))
    if not np.isfinite(out[-1, 0]):
        raise TruthError(f"the true machine ran away under load {load!r}")
    return Motion(
        values={name: out[:, j] for j, name in enumerate(OUTPUTS)},
        internal=InternalStates(*map(float, left)),
    )


def follow(
    machine: Machine,
    physics: Physics,
    series: Series,
    load: str,
    act: Callable[[int, np.ndarray], float],
    *,
    samples: int,
    interval_s: float,
    start: Start | None = None,
    step_s: float = FINE_STEP_S,
) -> tuple[Motion, np.ndarray]:
    """The machine under a controller.

    Parameters
    ----------
    act : function of (sample, exact readings by `OUTPUTS`)
        The duty from this sample to the next.

    Returns
    -------
    Motion, and the duty of every sample.

    Raises
    ------
    TruthError
        If the loop leaves every bound.
    """
    start = start or Start()
    substeps = max(1, round(interval_s / step_s))
    begin = np.array([start.motor_angle_rad, start.backlash_place, start.load_angle_rad])
    internal = np.array(start.internal, dtype=float)
    state = at_rest(machine, physics, series, begin, internal)
    run = Run(LOAD_MODES[load], False, interval_s, substeps)
    out, duty, zeros = np.empty((samples, len(OUTPUTS))), np.zeros(samples), np.zeros(samples)
    inputs = Inputs(command=duty, gain=np.ones(samples), volts=zeros, ext=zeros)
    for k in range(samples):
        read(machine, physics, series, state, out[k])
        if not abs(out[k, 0]) < 1e6:
            raise TruthError(f"the loop ran away after {k * interval_s:.3g} s, load {load!r}")
        duty[k] = act(k, out[k])
        advance(machine, physics, series, run, k, inputs, state)
    values = {name: out[:, j] for j, name in enumerate(OUTPUTS)}
    return Motion(values=values, internal=InternalStates(*map(float, out[-1, 6:8]))), duty
