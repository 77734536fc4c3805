"""Recordings in windows: where predictions start, what they err by, and what noise that shows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.effects.variant import TrialMachine
from rsea_core.identify.fitting.predictions import Windows
from rsea_core.identify.fitting.problem import Hypothesis, machine_of
from rsea_core.identify.multistep.criteria import START_ERROR
from rsea_core.identify.multistep.error_filter import (
    LinearErrors,
    Noise,
    Readings,
    Scale,
    free_inputs,
    linear_errors,
)
from rsea_core.identify.multistep.experiment import Experiment
from rsea_core.identify.multistep.kalman_filter import Filter, filter_gains, innovations, smoothed
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER

FIRST_SLOW = 1e-3  # of the rated torque: a slow torque before its size is known
FIRST_COMMAND = 0.01  # of its change over a row
WIDEST = 10.0  # typical magnitudes: a start's deviation at most
LOOSE = 4.0  # a start's variance in units of the smoother's: it serves the same rows twice
MOST_BLOCKS, LEAST_BLOCKS = 12000, 400  # of averaged rows: of all recordings, of each
ROWS_PER_CYCLE = 12.0  # of the fastest mode


@dataclass(frozen=True, kw_only=True)
class Track:
    """One recording, its windows and its noise.

    Attributes
    ----------
    motion, motion_std : (n, 5) arrays
        Smoothed current, wheel angle and speed, load angle and speed.
    plant, stiffness : Plant and float
        The machine and its spring [Nm/rad] that errors of predictions follow: the fit's, not the
        rig file's (`about`). Of a lightly damped machine whose stiffness errs by 5 %, the errors
        are out of phase after ten cycles.
    windows : Windows or None
        None: one run from the first row.
    zeros : tuple of int
        Readings whose zero differs in this recording alone (`whole_runs.single_zeros`).
    """

    experiment: Experiment
    scale: Scale
    noise: Noise
    motion: NDArray
    motion_std: NDArray
    plant: mp.Plant
    stiffness: float
    windows: Windows
    errors: LinearErrors
    gain: NDArray
    root: NDArray
    begins: NDArray
    log_det: float
    block: int  # rows averaged to one
    seen: float = 1.0  # share of the rows, from the first on, that count
    lead: int = 0  # first rows that do not count
    zeros: tuple[int, ...] = ()

    @property
    def blocks(self) -> int:
        """Averaged rows."""
        return self.experiment.rows // self.block

    def averaged(self, values: NDArray) -> NDArray:
        """Values (..., n, p) of rows averaged over blocks."""
        if self.block == 1:
            return values
        *lead, _, p = values.shape
        used = values[..., : self.blocks * self.block, :]
        # a sum by einsum takes a sixth of the time of `mean` over so short an axis
        return (
            np.einsum("...bkp->...bp", used.reshape(*lead, self.blocks, self.block, p)) / self.block
        )

    def innovations(self, residual: NDArray) -> NDArray:
        """Whitened innovations (m, blocks, p) of residuals (m, n, p)."""
        e = self.errors
        out = innovations(
            Filter(e.A, e.mode, e.C, self.gain, self.root, self.begins), self.averaged(residual)
        )
        out[:, int(np.ceil(self.seen * self.blocks)) :] = 0.0
        out[:, : self.lead // self.block] = 0.0
        return out


def windows_of(rows: int, length: int, motion: NDArray, block: int = 1) -> Windows:
    """Windows of about a length that cover all rows and begin with a block."""
    count = max(1, round(rows / max(length, 2 * block)))
    blocks = rows // block
    first = block * np.unique(np.linspace(0, blocks, count + 1)[:-1].astype(int))
    last = np.append(first[1:] - 1, rows - 1)
    rows = np.stack([first, last], axis=1)
    return Windows(rows=rows, motion=motion, link_carried=True)


def prepared(track: Track, **changes) -> Track:
    """The track with other noise, windows or motion, its filter made anew."""
    t = replace(track, **changes)
    e = t.experiment
    errors = linear_errors(
        t.plant, t.stiffness, Readings(e.channels, t.zeros), t.averaged(t.motion)[:, k.TL],
        t.averaged(e.command_change[:, None] ** 2)[:, 0] ** 0.5 / t.block**0.5,
        e.recording.sample_time_s * t.block, t.noise, t.scale.time_s,
    )  # fmt: skip
    begins = np.zeros(t.blocks, bool)
    begins[t.windows.rows[:, 0] // t.block] = True
    start = start_variances(t, errors)
    gain, root = filter_gains(
        errors.A, errors.Q, errors.mode, errors.C, t.noise.readings**2, start, begins
    )
    diagonal = np.diagonal(root, axis1=1, axis2=2)
    return replace(
        t, errors=errors, gain=gain, root=root, begins=begins,
        log_det=-2.0 * float(np.sum(np.log(diagonal))),
    )  # fmt: skip


def about(t: Track, machine: TrialMachine, h: Hypothesis) -> Track:
    """The track whose errors are those of the machine fitted.

    A gear's mesh stays the one that begins: made as soft as backlash would, it hides backlash.
    """
    if any(law.effect == MESH_DAMPER for law in h.laws):
        return t
    return prepared(t, plant=machine.machine_numbers, stiffness=machine.stiffness)


def start_variances(t: Track, errors: LinearErrors) -> NDArray:
    """(windows, d) variances of the errors at each window's start."""
    first = t.windows.rows[:, 0]
    start = np.zeros((first.size, errors.A.shape[1]))
    for j, state in enumerate(errors.states):
        start[:, j] = LOOSE * t.motion_std[first, state] ** 2
    if errors.slow >= 0:
        start[:, errors.slow] = t.noise.inputs[3] ** 2
    for j, at in enumerate(errors.constants):
        if at >= 0:
            own = np.std(t.experiment.measured[:, j])
            start[:, at] = (own if j in t.zeros else t.experiment.floor_of_each[j]) ** 2
    start[:, errors.colours] = t.noise.colours**2
    return np.maximum(start, 1e-30)


def block_rows(experiments: Sequence[Experiment]) -> list[int]:
    """Rows that each recording averages to one: work is bounded, and every mode keeps its rows."""
    total = sum(e.rows for e in experiments)
    found = []
    for e in experiments:
        share = max(MOST_BLOCKS * e.rows / total, LEAST_BLOCKS)
        fastest = max(_fastest_rate(e), 1e-9)
        allowed = 2.0 * np.pi / fastest / ROWS_PER_CYCLE / e.recording.sample_time_s
        found.append(int(max(1, min(round(e.rows / share), allowed, e.rows // 20))))
    return found


def _fastest_rate(e: Experiment) -> float:
    """Angular frequency [rad/s] of the fastest swinging mode, or of the motion itself."""
    plant = machine_of(e.base)
    rates = [1.0 / scale_of(e).time_s]
    if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD) and e.stiffness > 0.0:
        inertia = 1.0 / plant.inertia
        if plant.structure == mp.ELASTIC_FREE and plant.load_inertia > 0.0:
            inertia += 1.0 / plant.load_inertia
        rates.append(float(np.sqrt(e.stiffness * inertia)))
    return max(rates)


def initial_track(e: Experiment, block: int = 1) -> Track:
    """A recording before anything is known of its noise: one run, a wide start."""
    scale, plant = scale_of(e), machine_of(e.base)
    free = dict(free_inputs(plant, e.channels))
    slow = FIRST_SLOW * scale.torque_Nm[0]
    first = np.array([*scale.torque_Nm, 0.3 * scale.voltage_V, slow, FIRST_COMMAND])
    noise = Noise(
        inputs=np.array([first[j] if j in free else 0.0 for j in range(5)]),
        readings=np.maximum(e.floor_of_each, 1e-12),
    )
    motion = crude_motion(e)
    if "current_A" in e.channels:
        at = e.channels.index("current_A")
        noise.readings[at] = max(noise.readings[at], _current_error(e, motion))
    spread = _without_common_angle(e, plant, scale, np.tile(_extent(scale, motion), (e.rows, 1)))
    empty = LinearErrors(*(np.zeros(0),) * 4, (), np.zeros(0), np.zeros(0), -1,
                         np.zeros(0, int))  # fmt: skip
    track = Track(
        experiment=e, scale=scale, noise=noise, motion=motion, motion_std=spread, plant=plant,
        stiffness=e.stiffness, windows=windows_of(e.rows, e.rows, motion, block), errors=empty,
        gain=np.zeros(0), root=np.zeros(0), begins=np.zeros(0), log_det=0.0, block=block,
    )  # fmt: skip
    return prepared(track)


def _current_error(e: Experiment, motion: NDArray) -> float:
    """Typical error [A] of a current that volts and speed give at once; 0 with an inductance.

    Such a current reads the speed. Taken at the sensor's noise, one that drifts gives a motion
    that no other reading shows, and windows that start with it predict nothing.
    """
    plant, r = machine_of(e.base), e.recording
    driven = plant.drive in (mp.DUTY, mp.VOLTAGE) and r.command_name is not None
    if not driven or plant.inductance > 0.0:
        return 0.0
    volts = r[r.command_name] * (plant.volts_per_command if plant.drive == mp.DUTY else 1.0)
    given = (volts - motion[:, k.WW] * plant.volts_per_speed) / plant.resistance
    return 1.48 * float(np.median(np.abs(r["current_A"] - given)))


def crude_motion(e: Experiment) -> NDArray:
    """(n, 5) motion by local differences of the readings, where no machine is trusted yet."""
    r, ratio = e.recording, e.where.ratio
    motion = np.zeros((e.rows, 5))
    motor = r.columns.get("motor_angle_rad")
    wheel = None if motor is None else motor / ratio
    load = r.columns.get("load_angle_rad")
    if load is None and wheel is None:
        wheel = _integrated(r, "motor_velocity_rad_per_s", 1.0 / ratio)
        load = _integrated(r, "load_velocity_rad_per_s", 1.0)
    if load is None:
        load = wheel
    if wheel is None:
        wheel = load
    if load is None:
        return motion
    motion[:, k.TW], motion[:, k.TL] = wheel, load
    motion[:, k.WW] = np.gradient(_local_mean(wheel), r.time_s)
    motion[:, k.WL] = np.gradient(_local_mean(load), r.time_s)
    if "current_A" in r:
        motion[:, k.IM] = r["current_A"]
    plant = machine_of(e.base)
    if plant.structure in (mp.ELASTIC_HELD, mp.RIGID_HELD):
        motion[:, k.TL], motion[:, k.WL] = r.held_angle_rad(), 0.0
    return motion


def _integrated(r, name: str, factor: float) -> NDArray | None:
    """The angle (n,) that a logged velocity amounts to, from zero; None where it is not logged."""
    if name not in r:
        return None
    speed = factor * r[name]
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(r.time_s)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _local_mean(values: NDArray) -> NDArray:
    wide = np.pad(values, 1, mode="reflect", reflect_type="odd")
    return 0.25 * wide[:-2] + 0.5 * wide[1:-1] + 0.25 * wide[2:]


def scale_of(e: Experiment) -> Scale:
    """Typical magnitudes of a recording, from its readings and the rig's values."""
    plant, r, motion = machine_of(e.base), e.recording, crude_motion(e)
    body = k.TL if plant.structure in (mp.ELASTIC_FREE, mp.RIGID_FREE) else k.TW
    angle = float(np.std(motion[:, body])) or float(np.std(motion[:, k.TW])) or 1e-9
    speed = float(np.sqrt(np.mean(motion[:, body + 1] ** 2)))
    speed = speed or float(np.sqrt(np.mean(motion[:, k.WW] ** 2))) or 1e-9
    time = float(np.clip(angle / speed, 2 * r.sample_time_s, r.time_s[-1] - r.time_s[0]))
    volts, drive = 0.0, 0.0
    if r.command_name is not None:
        command = r[r.command_name]
        if plant.drive in (mp.DUTY, mp.VOLTAGE):
            volts = float(np.std(command)) * (
                plant.volts_per_command if plant.drive == mp.DUTY else 1.0
            )
            motor = motion[:, k.WW] * plant.volts_per_speed
            given = command * (plant.volts_per_command if plant.drive == mp.DUTY else 1.0)
            current = r["current_A"] if "current_A" in r else (given - motor) / plant.resistance
            drive = float(np.std(current)) * plant.torque_per_ampere
        elif plant.drive == mp.POSITION:
            drive = float(np.std(command - motion[:, k.TW])) * plant.volts_per_command
        elif plant.drive == mp.CURRENT:
            drive = float(np.std(command)) * plant.torque_per_ampere
        else:
            drive = float(np.std(command)) * plant.torque_per_motor_torque
    inertia = plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0)
    swing = 0.3 * plant.gravity * min(angle, 1.0)
    gear = drive or max(inertia * speed / time, swing)
    load = max(swing, plant.load_inertia * speed / time)
    if "torque_Nm" in r:
        load = max(load, float(np.std(r["torque_Nm"])))
    if plant.structure not in (mp.ELASTIC_FREE, mp.RIGID_FREE):
        load = gear
    if plant.structure == mp.RIGID_FREE:  # one body: an external torque can be as large
        load = max(load, gear)
    return Scale(
        torque_Nm=np.array([gear or load or 1e-12, load or gear or 1e-12]),
        voltage_V=volts, speed_rad_per_s=speed, angle_rad=angle, time_s=time,
    )  # fmt: skip


def resmoothed(track: Track, run: NDArray, residual: NDArray) -> Track:
    """The track with the motion that a run and what it leaves of the readings show.

    Its windows keep their starts, which new ones (`with_windows`) take from that motion: starts
    that are smoothed with each law take up what the model lacks, and dry friction is not seen.

    Parameters
    ----------
    run : (n, 7) array
        In the track's windows.
    residual : (n, p) array
    """
    e, errors = track.experiment, track.errors
    motion, spread = e.states(run), np.zeros((e.rows, 5))
    wide = start_variances(track, errors)
    wide[:, : len(errors.states)] *= 100.0
    left, block = track.averaged(residual), track.block
    for (first, last), start in zip(track.windows.rows, wide, strict=True):
        part = slice(first // block, min((last + 1) // block, track.blocks))
        estimate, variance = smoothed(
            errors.A, errors.Q, errors.mode[part], errors.C, track.noise.readings**2,
            start[None], left[part],
        )  # fmt: skip
        rows = np.arange(first, last + 1)
        at = block * (np.arange(part.start, part.stop) + 0.5) - 0.5
        for j, state in enumerate(errors.states):
            motion[rows, state] += np.interp(rows, at, estimate[:, j])
            spread[rows, state] = np.interp(rows, at, np.sqrt(np.maximum(variance[:, j], 0.0)))
    plant = machine_of(e.base)
    if plant.structure == mp.RIGID_FREE:
        motion[:, k.TL : k.WL + 1] = motion[:, k.TW : k.WW + 1]
        spread[:, k.TL : k.WL + 1] = spread[:, k.TW : k.WW + 1]
    elif plant.structure in (mp.ELASTIC_HELD, mp.RIGID_HELD):
        motion[:, k.TL], motion[:, k.WL] = e.recording.held_angle_rad(), 0.0
    # what no reading shows, an angle where only speeds are logged, is not known ever less
    spread = np.minimum(spread, WIDEST * _extent(track.scale, track.motion))
    spread = _without_common_angle(e, plant, track.scale, spread)
    return replace(track, motion=motion, motion_std=spread)


def _without_common_angle(e: Experiment, plant: mp.Plant, scale: Scale, spread: NDArray) -> NDArray:
    """Deviations (n, 5) of a start where the angle that both bodies share has none.

    Where only speeds are logged and nothing depends on that angle, no reading and no prediction
    shows it. As a state of large variance it hides the spring's deflection in round-off, which is
    a difference of two such angles.
    """
    read = any("angle" in name or "deflection" in name for name in e.channels)
    if read or plant.structure != mp.ELASTIC_FREE or plant.gravity != 0.0 or not e.stiffness > 0.0:
        return spread
    spread[:, k.TW] = 0.0
    widest = WIDEST * float(np.max(scale.torque_Nm)) / e.stiffness
    spread[:, k.TL] = np.minimum(spread[:, k.TL], widest)
    return spread


def _extent(scale: Scale, motion: NDArray) -> NDArray:
    """(5,) typical magnitudes of the motion's current, angles and speeds."""
    current = max(float(np.std(motion[:, k.IM])), 1e-12)
    angle, speed = scale.angle_rad, scale.speed_rad_per_s
    return np.array([current, angle, speed, angle, speed])


def from_rest(track: Track, *, certain: bool = True) -> Track:
    """The track with a first window that starts without speed, where the recording says so.

    Parameters
    ----------
    certain : bool
        Whether the speed is exactly zero. If not, it keeps the deviation of the smoothed motion,
        and an angle that this motion misses by `START_ERROR` begins as it is read.
    """
    e = track.experiment
    if not e.at_rest:
        return track
    motion, spread = track.windows.motion.copy(), track.motion_std.copy()
    motion[0, [k.WW, k.WL]] = 0.0
    if certain:
        spread[0, [k.WW, k.WL]] = 0.0
    else:
        _begin_as_read(e, motion, spread)
    return prepared(track, windows=replace(track.windows, motion=motion), motion_std=spread)


def _begin_as_read(e: Experiment, motion: NDArray, spread: NDArray) -> None:
    """Replace angles of the first row by readings where smoothing with a wrong model moved them.

    The reference for the angle of a rigid body is the motor's sensor.
    """
    rigid = machine_of(e.base).structure == mp.RIGID_FREE
    for name, state, ratio in (
        ("load_angle_rad", k.TL, 1.0), ("motor_angle_rad", k.TW, e.where.ratio),
    ):  # fmt: skip
        if name not in e.channels or e.recording.load.is_held:
            continue
        read = e.recording[name] / ratio
        if abs(motion[0, state] - read[0]) > START_ERROR * np.std(read):
            states = [k.TW, k.TL] if rigid else [state]
            motion[0, states], spread[0, states] = read[0], e.floors[name] / ratio
