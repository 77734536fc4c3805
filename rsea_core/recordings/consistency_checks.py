"""Consistency checks: what the readings of one recording say of each other.

Sign, unit, side of the gear, dead sensors. Each reading is compared with what the other columns
and the rig file make one expect of it (`expected_readings`). Where they go together, but with the
wrong sign or a factor that no tolerance covers, a column or the rig file has another sign or unit
than its name says. Where one of them moves and the other stands still, a sensor is dead, or the
load is another one than is listed.
"""

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import apparent_noise, noise_floor
from rsea_core.recordings.expected_readings import (
    ExpectedReading,
    averaging_rows,
    deflection,
    expected_readings,
    gear_output_angle,
    moving_means,
    slow_part,
    winding_voltage,
)
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.sample_faults import (
    CLEAR,
    PART,
    constant_value_cause,
    is_long_run,
    jumps,
    longest_constant_run,
)

TOGETHER = 0.8  # correlation from which two readings show the same motion
FACTOR = 4.0  # no missing physics of these machines makes slow readings differ by so much
WITH = 0.1  # of the work done there and back: clearly put in
AGAINST = -0.3  # of the work done there and back: a drive that gains it back has a wrong sign
BACK = 0.1  # of the range: as near as this to its start is back
HELD = 0.01  # of what it should follow: a load that moves less than this is held
KNOWN = (
    (180.0 / np.pi, "degrees"),
    (1000.0, "a thousandth of the unit"),
    (100.0, "a hundredth of the unit"),
    (1.0 / (2.0 * np.pi), "turns"),
)
NEAR = 0.12  # natural logarithm within which a factor is a known one's
CLOSE = 0.05  # and where one of the two moves less than its sensor resolves
ALIKE = 0.95  # correlation there
EMF_STD = 0.1  # relative standard deviation below which recordings show a motor's back-EMF
EMF_PART = 0.9  # of the volts' variance, that current and speed have to explain
LIMITED = 0.95  # of the current limit: above it the voltage is not what was commanded
FEWEST_ROWS = 10


def inconsistencies(rig: Rig, r: Recording) -> list[Finding]:
    """Readings that cannot be of one machine, worst first.

    Parameters
    ----------
    rig : Rig
        What its owner believes; factors below four and values that are missing say nothing.
    """
    if r.quasi_static or r.rows < FEWEST_ROWS:
        return []
    floors = noise_floor(rig, r)
    window = averaging_rows(rig, r)
    wraps = [f for f in _all_jumps(r, floors) if f.kind is Kind.WRAP]
    if wraps:  # all else follows
        return wraps
    found = []
    for pair in expected_readings(rig, r, floors):
        finding = _disagreement(rig, r, pair, window) or _constant_run(r, pair)
        if finding is None and pair.name == "torque_Nm":
            finding = _constant_angle(r, pair)
        if finding is not None:
            found.append(finding)
    for check in (_gains_work, _wrong_speed):
        finding = None if found else check(rig, r, window)
        found += [] if finding is None else [finding]
    return found + _open_bridge(r, floors)


def zeros_and_jumps(rig: Rig, r: Recording) -> list[Finding]:
    """Zeros that are apart and rows that jump: a wrong unit or sign makes both."""
    if r.quasi_static or r.rows < FEWEST_ROWS:
        return []
    floors = noise_floor(rig, r)
    far = None if inconsistencies(rig, r) else _far_apart(rig, r, floors)
    found = [] if far is None else [far]
    return found + [f for f in _all_jumps(r, floors) if f.kind is not Kind.WRAP]


def _all_jumps(r: Recording, floors: dict[str, float]) -> list[Finding]:
    return [f for name in r.responses for f in jumps(r, name, floors[name])]


def _disagreement(rig: Rig, r: Recording, pair: ExpectedReading, window: int) -> Finding | None:
    """The two go together by a wrong sign or factor, or only one of them moves."""
    y, x = slow_part(pair.reading, window), slow_part(pair.expected, window)
    y_moves, x_moves = np.ptp(y) > CLEAR * pair.floor, np.ptp(x) > CLEAR * pair.floor
    if not x_moves and not y_moves:
        return None
    if np.ptp(pair.reading) == 0.0:
        locked = ", or is the load locked" if pair.name == "load_angle_rad" else ""
        text = f"{pair.name} never moves although {pair.source} does: is the sensor dead{locked}"
        return _of(r, pair.name, Kind.SENSOR_DEAD, text, is_question=True)
    if np.ptp(pair.expected) == 0.0 and pair.name.endswith("velocity_rad_per_s"):
        text = f"{pair.name} moves although {pair.source} is none: is the sensor dead"
        return _of(r, pair.name, Kind.SENSOR_DEAD, text, is_question=True)
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    together = float(np.corrcoef(x, y)[0, 1])
    slope = float(np.std(y) / np.std(x))
    if not (x_moves and y_moves):
        small = (x, pair.expected) if y_moves else (y, pair.reading)
        return _beyond_resolution(rig, r, pair, small, together, slope)
    if abs(together) < TOGETHER:
        return None
    if together < 0.0:
        text = (
            f"{pair.name} runs against {pair.source} (correlation {together:.2f}): the sign of a"
            " column, or the unit of one, is wrong"
        )
        return _of(r, pair.name, Kind.SIGN, text)
    if 1.0 / FACTOR <= slope <= FACTOR:
        return None
    return _other_unit(rig, r, pair, slope)


def _of(r: Recording, name: str, kind: Kind, text: str, *, is_question: bool = False) -> Finding:
    return Finding(kind=kind, text=text, file=r.file, column=name, is_question=is_question)


def _beyond_resolution(
    rig: Rig,
    r: Recording,
    pair: ExpectedReading,
    small: tuple[NDArray, NDArray],
    together: float,
    slope: float,
) -> Finding | None:
    """One of the two moves less than its sensor resolves, and yet as the other does.

    A load that swings on a motor at rest looks like this too: only a known factor counts.
    """
    slow, raw = small
    if together < ALIKE or np.ptp(slow) <= CLEAR * apparent_noise(raw):
        return None
    if abs(np.log(slope)) < np.log(FACTOR) or _known_unit(rig, slope, CLOSE) is None:
        return None
    return _other_unit(rig, r, pair, slope)


def _other_unit(rig: Rig, r: Recording, pair: ExpectedReading, slope: float) -> Finding:
    """A reading that is another multiple of the expected one than any tolerance allows."""
    known = _known_unit(rig, slope, NEAR)
    cause = "a unit, the side of the gear or a value of rig.toml is wrong"
    if known is not None:
        cause = f"{known} in one of them"
    text = f"{pair.name} is {slope:.4g} times {pair.source}: {cause}"
    return _of(r, pair.name, Kind.UNIT, text, is_question=known is not None)


def _known_unit(rig: Rig, slope: float, near: float) -> str | None:
    """Phrase for what is known to make about such a factor, either way."""
    known = [*KNOWN, (rig.gear_ratio or 1.0, "the other side of the gear")]
    for name in ("motor_encoder_counts_per_rev", "load_encoder_counts_per_rev"):
        if getattr(rig, name):
            known.append((getattr(rig, name) / (2.0 * np.pi), "encoder counts"))
    gaps = [
        (abs(abs(np.log(slope)) - abs(np.log(factor))), phrase)
        for factor, phrase in known
        if factor != 1.0
    ]
    gap, phrase = min(gaps)
    return phrase if gap < near else None


def _constant_run(r: Recording, pair: ExpectedReading) -> Finding | None:
    """A reading that keeps one value while what it should follow moves on."""
    first, last = longest_constant_run(pair.reading)
    if not is_long_run(r, first, last):
        return None
    passed = float(np.ptp(pair.expected[first:last]))
    if passed <= max(CLEAR * pair.floor, PART * float(np.ptp(pair.expected))):
        return None
    text = (
        f"{pair.name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s while"
        f" {pair.source} moves: {constant_value_cause(pair.reading, first)}{_or_locked(pair)}"
    )
    return _of(r, pair.name, Kind.CONSTANT_RUN, text)


def _or_locked(pair: ExpectedReading) -> str:
    """A load angle that never moves: the load was held, an easy slip of a hand-written rig file."""
    moved, expected = float(np.ptp(pair.reading)), float(np.ptp(pair.expected))
    if pair.name != "load_angle_rad" or moved > HELD * expected:
        return ""
    return ', or the load was held and its recording needs load = "locked"'


def _constant_angle(r: Recording, pair: ExpectedReading) -> Finding | None:
    """An angle that keeps one value while the spring's torque shows that it cannot."""
    for name in ("motor_angle_rad", "load_angle_rad", "spring_deflection_rad"):
        if name not in r.responses or (name.startswith("load") and r.load.is_held):
            continue
        first, last = longest_constant_run(r[name])
        still = slice(first, last)
        passed, made = float(np.ptp(pair.reading[still])), float(np.ptp(pair.expected[still]))
        all_of_it = float(np.ptp(pair.reading))
        if not is_long_run(r, first, last) or made > PART * passed:
            continue
        if passed > max(CLEAR * pair.floor, PART * all_of_it):
            text = (
                f"{name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s"
                f" while torque_Nm moves: {constant_value_cause(r[name], first)}"
            )
            return _of(r, name, Kind.CONSTANT_RUN, text)
    return None


def _gains_work(rig: Rig, r: Recording, window: int) -> Finding | None:
    """A command that takes work out of a motion there and back, where every loss takes it in."""
    share = work_share(rig, r, window)
    if share is None or share > AGAINST:
        return None
    name = _driven_angle(r)
    text = (
        f"{name} moves against {r.command_name}, as if the drive gained work there and back: one"
        " of the two has the wrong sign"
    )
    return _of(r, name, Kind.AGAINST, text)


def work_share(rig: Rig, r: Recording, window: int | None = None) -> float | None:
    """The work that a command puts in there and back, of all that it does on the way.

    None where nothing is driven, or nothing comes back.
    """
    name = _driven_angle(r)
    if name is None:
        return None
    window = averaging_rows(rig, r) if window is None else window
    angle, drive = slow_part(r[name], window), slow_part(r[r.command_name], window)
    span = float(np.ptp(angle))
    if span <= CLEAR * noise_floor(rig, r)[name]:
        return None
    last = int(np.flatnonzero(np.abs(angle - angle[0]) < BACK * span)[-1])
    work = drive[:-1] * np.diff(angle)
    total = float(np.sum(np.abs(work)))
    there = float(np.sum(np.abs(work[:last])))
    return float(np.sum(work[:last])) / there if total > 0.0 and there >= 0.5 * total else None


def _driven_angle(r: Recording) -> str | None:
    """The angle that a command moves, where there is a sensor of it."""
    if r.command_name is None or r.load.kind == "imposed" or r.quasi_static:
        return None
    if "motor_angle_rad" in r.responses:
        return "motor_angle_rad"
    free = "load_angle_rad" in r.responses and not r.load.is_held
    return "load_angle_rad" if free else None


def _wrong_speed(rig: Rig, r: Recording, window: int) -> Finding | None:
    """A back-EMF that the motor's speed cannot make: the clock, or the angle's unit, is wrong.

    The winding's voltage is fitted by current and speed together, whatever the resistance.
    """
    volts, k_e = winding_voltage(rig, r), rig.back_emf_constant_Vs_per_rad
    if volts is None or not k_e or not {"current_A", "motor_angle_rad"} <= set(r.responses):
        return None
    speed = np.gradient(r["motor_angle_rad"], r.sample_time_s)
    limit = LIMITED * (rig.current_limit_A or np.inf)
    rows = np.abs(r["current_A"][: r.rows + 1 - window]) < limit
    columns = [moving_means(r["current_A"], window)[rows], moving_means(speed, window)[rows]]
    volts = moving_means(volts, window)[rows]
    if volts.size < 5 * window or min(np.ptp(c) for c in columns) == 0.0:
        return None
    A = np.stack(columns, axis=1)
    normal = A.T @ A
    if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e8:
        return None
    found = np.linalg.solve(normal, A.T @ volts)
    left = float(np.mean((volts - A @ found) ** 2))
    std = np.sqrt(left * np.linalg.inv(normal)[1, 1] * window)  # means overlap
    if left > (1.0 - EMF_PART) * np.mean(volts**2) or not std < EMF_STD * found[1]:
        return None
    share = float(found[1] / k_e)
    if 1.0 / FACTOR <= share <= FACTOR:
        return None
    text = (
        f"the winding's voltage shows {share:.4g} times the speed that motor_angle_rad and time_s"
        " do: the clock, the angle's unit or back_emf_constant is wrong"
    )
    return _of(r, "motor_angle_rad", Kind.CLOCK, text)


def _open_bridge(r: Recording, floors: dict[str, float]) -> list[Finding]:
    """A current that flows where the bridge is said to be open."""
    if "drive_enabled" not in r or "current_A" not in r.responses:
        return []
    still_open = (r["drive_enabled"][1:] == 0.0) & (r["drive_enabled"][:-1] == 0.0)
    current = np.abs(r["current_A"][1:][still_open])
    if current.size < 10 or np.median(current) < CLEAR * floors["current_A"]:
        return []
    text = f"current_A is {np.median(current):.3g} A in the median where drive_enabled is 0"
    return [_of(r, "current_A", Kind.OPEN_BRIDGE, text)]


def _far_apart(rig: Rig, r: Recording, floors: dict[str, float]) -> Finding | None:
    """Angles whose zeros are further apart than any torque of this machine bends its spring."""
    stiffness = rig.spring_stiffness_Nm_per_rad
    deflected = deflection(r, gear_output_angle(rig, r, floors), floors)
    if deflected is None or not stiffness or not rig.has("spring"):
        return None
    middle = stiffness * float(np.median(deflected[0]))
    if "torque_Nm" in r.responses:
        most = float(np.max(np.abs(r["torque_Nm"])))
    elif rig.torque_constant_Nm_per_A and rig.current_limit_A:
        most = rig.torque_constant_Nm_per_A * rig.current_limit_A * (rig.gear_ratio or 1.0)
    else:
        return None
    if abs(middle) <= FACTOR * max(most, CLEAR * stiffness * deflected[1]):
        return None
    text = (
        f"the angles differ by {middle / stiffness:.4g} rad in the median, {abs(middle):.4g} Nm in"
        f" the spring, where no more than {most:.4g} Nm act: an angle's zero is off"
    )
    return Finding(kind=Kind.ZERO, text=text, file=r.file)
