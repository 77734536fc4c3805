"""Machines on one recording: machines in, runs and readings out, whole or in windows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as fx
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.layout import STATE_NAMES
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers, Replay

CARRIED = (
    fx.BACKLASH, fx.BOUC_WEN, fx.WINDING_CAPACITY, fx.GEAR_PRESLIDING, fx.LOAD_PRESLIDING,
    fx.LINK_STIFFNESS,
    *(fx.SLIP_STIFFNESS + j for j in range(fx.N_SLIPS)),
    *(fx.BRANCH_STIFFNESS + j for j in range(fx.N_BRANCHES)),
)  # fmt: skip
"""Numbers of effects that remember: their state at a window's start follows from the motion."""


def _states(*names: str) -> tuple[int, ...]:
    return tuple(j for j, name in enumerate(STATE_NAMES) if name in names)


LOAD_STATES = _states("load_angle_rad", "link_angle_rad")
LOAD_SPEEDS = _states("load_velocity_rad_per_s", "link_velocity_rad_per_s")
WHEEL_STATES = _states("wheel_angle_rad", "output_angle_rad")
WHEEL_SPEEDS = _states("wheel_velocity_rad_per_s", "output_velocity_rad_per_s")
SLIP_STATES = tuple(
    j for j, name in enumerate(STATE_NAMES) if name.startswith(("slip_", "bouc_wen_"))
)
OUTPUT, WHEEL = (STATE_NAMES.index(name) for name in ("output_angle_rad", "wheel_angle_rad"))


@dataclass(frozen=True, kw_only=True)
class Windows:
    """Short runs that cover a recording, each from the smoothed motion.

    Attributes
    ----------
    rows : (w, 2) int array
        First and last row of each; together all rows, each once.
    motion : (n, 5) array
        Current, wheel angle and speed, load angle and speed.
    link_carried : bool
        Whether a flexible link swings along the motion to each window's start, or starts
        undeflected (`undeflect_link`).
    """

    rows: NDArray
    motion: NDArray
    link_carried: bool = False


def predict_readings(
    replay: Replay,
    machines: Sequence[TrialMachine],
    channels: Sequence[str],
    where: RunConditions,
    windows: Windows | None = None,
) -> NDArray:
    """Readings (m, rows, channels) of several machines on one recording."""
    return readings_of(run_machines(replay, machines, where, windows), machines, channels, where)


def run_machines(
    replay: Replay,
    machines: Sequence[TrialMachine],
    where: RunConditions,
    windows: Windows | None = None,
) -> NDArray:
    """What several machines do on one recording: (m, rows, 7), columns `replay.CHANNELS`."""
    numbers = numbers_of(machines)
    starts, lost = starts_of(replay, numbers, machines, where, windows)
    if windows is None:
        out = replay.run_many(numbers, starts=starts, failures="nan")
    else:
        out = replay.run_cover(numbers, windows.rows, starts, failures="nan")
    out[lost] = np.nan
    for run, d in zip(out, machines, strict=True):
        restore_angles(run, d, where)
    return out


def numbers_of(machines: Sequence[TrialMachine]) -> list[Numbers]:
    """What the engine reads of machines."""
    return [Numbers(d.plant, d.regions, d.fx) for d in machines]


def starts_of(
    replay: Replay,
    numbers: Sequence[Numbers],
    machines: Sequence[TrialMachine],
    where: RunConditions,
    windows: Windows | None,
) -> tuple[NDArray, NDArray]:
    """Start states (m, N_STEP_STATES), or (m, w, N_STEP_STATES), and which (m,) have none.

    A machine with values so far out that it does not even start is set to rest.
    """
    if windows is not None:
        starts = _window_starts(replay, numbers, windows)
    else:
        starts = replay.start_states(numbers)
        for y, d in zip(starts, machines, strict=True):
            y[list(SLIP_STATES)] *= d.start_remembered
    for y, d in zip(starts, machines, strict=True):
        shift_starts(y, d, where)
        _rest(y if windows is None else y[0], d)
    return starts, _without_start(starts)


def reads_as_run(machine: TrialMachine, channels: Sequence[str]) -> bool:
    """Whether all channels read columns of a run as they are."""
    return not machine.reads and "spring_deflection_rad" not in channels


def readings_of(
    runs: NDArray, machines: Sequence[TrialMachine], channels: Sequence[str], where: RunConditions
) -> NDArray:
    """Readings (m, rows, channels) of runs (m, rows, 7), as the machines' sensors give them."""
    found = np.empty((len(machines), runs.shape[1], len(channels)))
    for j, name in enumerate(channels):
        if name == "spring_deflection_rad":
            motor, load = CHANNELS.index("motor_angle_rad"), CHANNELS.index("load_angle_rad")
            found[:, :, j] = runs[:, :, motor] / where.ratio - runs[:, :, load]
        else:
            found[:, :, j] = runs[:, :, CHANNELS.index(name)]
    for i, d in enumerate(machines):
        for column, change in d.reads:
            if column in channels:
                j = list(channels).index(column)
                found[i, :, j] = change(found[i, :, j])
    return found


def _without_start(starts: NDArray) -> NDArray:
    """Which machines (m,) have values so far out that they do not even start; set to rest."""
    lost = ~np.isfinite(starts).reshape(len(starts), -1).all(axis=1)
    starts[lost] = 0.0
    return lost


def shift_starts(y: NDArray, d: TrialMachine, where: RunConditions) -> None:
    """Bring start states (..., N_STEP_STATES) from what sensors misread to what is true.

    An imposed load moves as its sensor reads. If the sensor has an offset, the machine is simulated
    in angles that are shifted by it, and `restore_angles` shifts its run back.
    """
    if d.start_load_scale != 1.0:
        y[..., list(LOAD_STATES + LOAD_SPEEDS)] *= d.start_load_scale
    if d.start_motor_scale != 1.0:
        y[..., list(WHEEL_STATES + WHEEL_SPEEDS)] *= d.start_motor_scale
    if d.start_load_rad or d.start_motor_rad:
        shift = d.start_load_rad if where.kind == "imposed" else 0.0
        y[..., list(LOAD_STATES)] += d.start_load_rad - shift
        y[..., list(WHEEL_STATES)] += d.start_motor_rad / where.ratio - shift


def restore_angles(run: NDArray, d: TrialMachine, where: RunConditions) -> None:
    """Shift the angles of a run (n, 7) from those read of an imposed load to the true ones."""
    if where.kind == "imposed" and d.start_load_rad:
        run[:, CHANNELS.index("motor_angle_rad")] += where.ratio * d.start_load_rad
        run[:, CHANNELS.index("load_angle_rad")] += d.start_load_rad


def _rest(y: NDArray, d: TrialMachine) -> None:
    """Put the wheel of a start state (N_STEP_STATES,) where in its play it rests.

    Only where it could hang free: a spring that is bent further than the play pulls it to a flank.
    """
    half, load = 0.5 * d.fx[fx.BACKLASH], y[LOAD_STATES[0]]
    low, high = y[WHEEL] - half, y[WHEEL] + half
    if low < load < high:
        y[OUTPUT] = min(max(load + d.start_deflection_rad, low), high)


def _window_starts(replay: Replay, numbers: Sequence[Numbers], windows: Windows) -> NDArray:
    """Start states (m, w, N_STEP_STATES): the smoothed motion, memories carried along it."""
    motion, first = windows.motion, windows.rows[:, 0]
    y = np.repeat(replay.start_states(numbers)[:, None], first.size, axis=1)
    y[:, :, : motion.shape[1]] = motion[first]
    for state, like in ((5, 1), (6, 2), (7, 3), (8, 4)):
        y[:, :, state] = y[:, :, like]  # output with the wheel, link with the load
    carried = [j for j, n in enumerate(numbers) if n.fx[list(CARRIED)].any()]
    if carried:
        y[carried] = replay.warm_at([numbers[j] for j in carried], motion, first)
    if not windows.link_carried:
        undeflect_link(y)
    return y


def undeflect_link(y: NDArray) -> None:
    """Let the flexible link of start states (..., N_STEP_STATES) start with the load.

    Integrated along the smoothed motion, its swing takes up the errors of that motion. In the short
    runs of the free-run search a hysteresis of the spring was then taken for a link (practice-wide
    x32).
    """
    for load, link in (LOAD_STATES, LOAD_SPEEDS):
        y[..., link] = y[..., load]
