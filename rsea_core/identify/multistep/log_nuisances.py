"""Free values of every hypothesis that belong to the log or the drive and are no physics.

The amplifier's offset, the delay of the command, clocks and filters of sensors, the rounding of the
stated gear ratio (docs/diagnosis-search.md 10.2).
"""

from dataclasses import replace
from decimal import Decimal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.effects.sensor_base import writes_reading
from rsea_core.effects.variant import Law, RunConditions, Unknown, writes_numbers
from rsea_core.identify.candidates.catalogue import known_laws
from rsea_core.identify.multistep.experiment import DELAY_STEP_ROWS, VELOCITIES
from rsea_core.machine.inputs import COMMANDS, POSITION_COMMAND
from rsea_core.machine.rig import Rig
from rsea_core.machine.tolerances import TOLERANCES
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

OFFSET_PRIOR = 0.03  # of the largest command: an amplifier's offset
OF_FULL_SCALE = 0.2  # smallest span of commands, for that offset
DELAY_PRIOR_ROWS = 1.0
SERVO_DELAY_ROWS = 5.0  # a goal passes a bus and the servo's own cycle
LONGEST_DELAY_ROWS = 60.0
CLOCK_PRIOR = 1e-4  # two quartz oscillators
CLOCK, FILTER, RATIO = (
    "sensor-clock",
    "sensor-filter",
    "gear-ratio-rounding",
)  # nuisances, no effects
MESH_DAMPER = "gear-mesh-damping"  # of a gear's mesh that stands for a spring: no effect either
LEAST_DIGIT = 1e-6  # of a gear ratio: no angle shows less
CLOCKS = ("motor_angle_rad", "load_angle_rad", "torque_Nm")


def nuisances(case: Case) -> tuple[Law, ...]:
    """What every hypothesis has: laws that the rig file states, the drive's offset and delay."""
    return (*known_laws(case), *_of_experiment(case))


def _of_experiment(case: Case) -> tuple[Law, ...]:
    """The experiment's own free values."""
    driven = [r for r in case.identification if r.command_name in COMMANDS]
    clocks = tuple(_clock(c) for c in CLOCKS if all(c in r.responses for r in case.identification))
    lags = (*_lags(case), *_ratio_rounding(case))
    if not driven:
        return (*clocks[1:], *lags)
    servo = any(r.command_name == POSITION_COMMAND for r in driven)
    span = max(_span(r) for r in driven)
    full = _least_span(driven[0], case.rig)
    row = max(r.sample_time_s for r in driven)
    if span == 0.0:
        offsets = (DriveOffset.nuisance(full, OFFSET_PRIOR),) if full else ()
        return (*offsets, *clocks[1:], *lags)
    delay = Unknown(
        name="delay_s", unit="s", low=0.0, high=LONGEST_DELAY_ROWS * row,
        scale=DELAY_STEP_ROWS * row, prior=(SERVO_DELAY_ROWS if servo else DELAY_PRIOR_ROWS) * row,
    )  # fmt: skip
    (stated, share), start = _stated_delay(case, servo), 0.0
    if stated:
        delay = replace(delay, log=True, low=1e-3 * row, scale=0.2 * share, prior=share)
        start = stated
    late = Law(
        effect=DriveDelay.effect, law="dead time", subsystem="drive", kind=DriveDelay,
        write=writes_numbers(DriveDelay), unknowns=(delay,), starts=((start,),), nuisance=True,
    )  # fmt: skip
    return (DriveOffset.nuisance(max(span, full), OFFSET_PRIOR), late, *clocks, *lags)


def _stated_delay(case: Case, servo: bool) -> tuple[float | None, float]:
    """The delay of commands that the rig file states, and its relative tolerance."""
    if servo and case.rig.servo_delay_s is not None:
        share = dict(case.rig.tolerances).get("servo_delay_s", TOLERANCES["servo_delay_s"])
        return case.rig.servo_delay_s, share
    known = (k for k in case.known if k.term.effect == DriveDelay.effect)
    return next(((k.term.delay_s, k.tolerance) for k in known), (None, 1.0))


def offset_drifts(case: Case) -> tuple[Law, ...]:
    """A drift of the amplifier's offset in each recording that is fitted; none of a servo."""
    driven = [r for r in case.identification if r.command_name in COMMANDS]
    if not driven or any(r.command_name == POSITION_COMMAND for r in driven):
        return ()
    span = max(_least_span(driven[0], case.rig), *map(_span, driven))
    return tuple(
        DriveOffset.drift(r.file, span, OFFSET_PRIOR, float(r.time_s[-1] - r.time_s[0]))
        for r in driven if span > 0.0
    )  # fmt: skip


def _least_span(r: Recording, rig: Rig) -> float:
    """An amplifier's offset is one of its range, however small its commands are."""
    return OF_FULL_SCALE * (_full_scale(r.command_name, rig) or 0.0)


def _span(r: Recording) -> float:
    """Largest command; of goals the largest distance from their mean: an angle has no zero."""
    command = r[r.command_name]
    if r.command_name == POSITION_COMMAND:
        command = command - np.mean(command)
    return float(np.max(np.abs(command)))


def _full_scale(command: str, rig: Rig) -> float | None:
    """Largest command that the drive takes, as far as the rig file states it."""
    return {
        "duty": 1.0, "voltage_V": rig.supply_voltage_V, "current_command_A": rig.current_limit_A,
    }.get(command)  # fmt: skip


def _lags(case: Case) -> tuple[Law, ...]:
    """The filters of logged velocities that stand for an angle."""
    row = max(r.sample_time_s for r in case.identification)
    found = []
    for angle, column in VELOCITIES.items():
        if all(column in r.responses and angle not in r for r in case.identification):
            lag = Unknown(
                name="time_s", unit="s", low=1e-3 * row, high=50.0 * row, scale=0.2 * row,
                prior=5.0 * row,
            )  # fmt: skip
            second = replace(lag, name="second_time_s", low=0.0)
            found.append(
                Law(
                    effect=FILTER,
                    law="nuisance",
                    subsystem=f"sensor:{column}",
                    sensor=column,
                    write=writes_reading(column, _filtered),
                    unknowns=(lag, second),
                    starts=((row, 0.0),),
                    nuisance=True,
                )
            )
    return tuple(found)


def _filtered(v, signal: NDArray, w: RunConditions) -> NDArray:
    """A signal, linear between rows, behind two filters of first order, settled at its first row.

    Drives filter a speed that they differentiate, and many filter it once more for the log. The
    equations are exact for such a signal (ramp-invariant: Franklin, Powell and Workman, Digital
    Control of Dynamic Systems (1998), section 6.3.2).
    """
    from scipy.signal import lfilter  # takes a second to import, rarely needed

    row_s = float(np.mean(np.diff(w.time_s)))
    for time_s in (v["time_s"], v["second_time_s"]):
        if time_s > 0.0:
            kept = np.exp(-row_s / time_s)
            mean = time_s / row_s * (1.0 - kept)
            start = [mean * signal[0]]
            signal = lfilter([1.0 - mean, mean - kept], [1.0, -kept], signal, zi=start)[0]
    return signal


def _ratio_rounding(case: Case) -> tuple[Law, ...]:
    """The rounding of the stated gear ratio, seen between the two angles."""
    ratio = case.rig.gear_ratio or 1.0
    both = all(
        {"motor_angle_rad", "load_angle_rad"} <= set(r.responses) for r in case.identification
    )
    half = half_digit(ratio)
    if not both or not half:
        return ()
    share = Unknown(name="share", unit="-", low=-3.0 * half, high=3.0 * half, scale=0.1 * half,
                    prior=half)  # fmt: skip
    return (
        Law(effect=RATIO, law="nuisance", subsystem="sensor:load_angle_rad",
            sensor="load_angle_rad", write=writes_reading("load_angle_rad", _by_share),
            unknowns=(share,), starts=((0.0,),), nuisance=True),
    )  # fmt: skip


def half_digit(ratio: float) -> float:
    """Half a unit of the last digit of a stated gear ratio, as a share of it; 0: of no weight.

    At least four digits are taken for stated: 60 and 7.5 may be exact. 1 is no rounded number.
    """
    last = 0 if ratio == round(ratio) else Decimal(repr(ratio)).as_tuple().exponent
    unit = 10.0 ** min(last, int(np.floor(np.log10(ratio))) - 3)
    half = 0.5 * unit / ratio
    return 0.0 if ratio == 1.0 or half < LEAST_DIGIT else float(half)


def _by_share(v, signal: NDArray, w: RunConditions) -> NDArray:
    return signal * (1.0 + v["share"])


def _clock(column: str) -> Law:
    """A sensor whose clock runs off the command's, by a share of the time."""
    rate = Unknown(name="rate", unit="-", low=-2e-3, high=2e-3, scale=2e-5, prior=CLOCK_PRIOR)
    return Law(
        effect=CLOCK, law="nuisance", subsystem=f"sensor:{column}", sensor=column,
        write=writes_reading(column, _on_own_clock), unknowns=(rate,), starts=((0.0,),),
        nuisance=True,
    )  # fmt: skip


def _on_own_clock(v, signal: NDArray, w: RunConditions) -> NDArray:
    return _drifted(w.time_s, np.ascontiguousarray(signal), v["rate"])


@njit(cache=True, nogil=True, error_model="numpy")
def _drifted(time, signal, rate):
    """Signal (n,) at times that run off by a share `rate` from time 0 on, to first order."""
    n, out = len(time), np.empty(len(time))
    for i in range(n):
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        left, right = time[i] - time[before], time[after] - time[i]
        if before == i or after == i:
            slope = (signal[after] - signal[before]) / (time[after] - time[before])
        else:  # of the parabola through three rows
            up, down = (signal[after] - signal[i]) / right, (signal[i] - signal[before]) / left
            slope = (left * up + right * down) / (left + right)
        out[i] = signal[i] + rate * time[i] * slope
    return out
