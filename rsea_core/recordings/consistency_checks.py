"""What the readings of one recording say of each other: sign, unit, side of the gear, dead sensors.

Each pair is a reading and what the other columns and the rig file make of it, both slow (averaged
over more than the resonances last, where no missing physics turns a sign or makes a factor of
four). Where they go together, but with the wrong sign or a factor that no tolerance covers, a
column or the rig file has another sign or unit than its name says. Where one of them moves and
the other stands still, a sensor is dead, or the load is another one than is listed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import apparent_noise, noise_floor
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.sample_faults import (
    CLEAR,
    FULL_TURN,
    PART,
    jumps,
    lasts,
    longest_still,
    stopped,
)

SLOWEST_MODE_s = 0.1  # averages last as long where the rig file does not say how slow it swings
PERIODS = 2.0  # of the slowest resonance that an average lasts
TOGETHER = 0.8  # correlation from which two readings show the same motion
FACTOR = 4.0  # no missing physics of these machines makes slow readings differ by so much
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
LIMITED = 0.95  # of the current limit: above it the voltage is not what was told


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A reading and what the rest of the recording expects of it.

    Attributes
    ----------
    name, source : str
        The column, and the expectation in words.
    reading, expected : (n,) array
    floor : float
        Standard deviation of both together, unit of the reading.
    """

    name: str
    source: str
    reading: NDArray
    expected: NDArray
    floor: float


def contradictions(rig: Rig, r: Recording) -> list[str]:
    """Sentences about readings that cannot be of one machine, worst first.

    Parameters
    ----------
    rig : Rig
        What its owner believes; factors below four and values that are missing say nothing.
    """
    if r.quasi_static or r.rows < 10:
        return []
    floors = noise_floor(rig, r)
    window = _window(rig, r)
    wraps = [w for name in r.responses for w in jumps(r, name, floors[name]) if FULL_TURN in w]
    if wraps:  # all else follows
        return [f"{r.file}: {words}" for words in wraps]
    found = []
    for pair in pairs(rig, r, floors):
        said = _disagreement(rig, r, pair, window) or _standstill(r, pair)
        if said is None and pair.name == "torque_Nm":
            said = _angle_standstill(r, pair)
        if said is not None:
            found.append(said)
    for alone in (_gains_work, _wrong_speed):
        said = None if found else alone(rig, r, window)
        found += [] if said is None else [said]
    found += _open_bridge(r, floors)
    return [f"{r.file}: {words}" for words in found]


def zeros_and_jumps(rig: Rig, r: Recording) -> list[str]:
    """Sentences about zeros that are apart and rows that jump: a wrong unit or sign makes both."""
    if r.quasi_static or r.rows < 10:
        return []
    floors = noise_floor(rig, r)
    far = None if contradictions(rig, r) else _far_apart(rig, r, floors)
    found = [] if far is None else [far]
    for name in r.responses:
        found += [w for w in jumps(r, name, floors[name]) if FULL_TURN not in w]
    return [f"{r.file}: {words}" for words in found]


def pairs(rig: Rig, r: Recording, floors: dict[str, float]) -> list[Pair]:
    """The pairs that a rig and the columns of a recording allow."""
    found = []
    turned = _wheel(rig, r, floors)
    read = "load_angle_rad" in r.responses
    if turned is not None and read and r.load.kind in ("pendulum", "free", "constant-torque"):
        wheel, floor = turned
        both = float(np.hypot(floor, floors["load_angle_rad"]))
        found.append(_pair("load_angle_rad", "motor_angle_rad / gear_ratio", r, wheel, both))
    bent = _deflection(r, turned, floors)
    if bent is not None and "spring_deflection_rad" in r.responses:
        both = float(np.hypot(bent[1], floors["spring_deflection_rad"]))
        found.append(_pair("spring_deflection_rad", "the angles' difference", r, bent[0], both))
    stiffness = rig.spring_stiffness_Nm_per_rad
    if stiffness and rig.has("spring") and "torque_Nm" in r.responses:
        source = "the angles' difference"
        if bent is None and "spring_deflection_rad" in r.responses:
            source = "spring_deflection_rad"
            bent = r[source], floors[source]
        if bent is not None:
            both = float(np.hypot(stiffness * bent[1], floors["torque_Nm"]))
            words = f"spring_stiffness_Nm_per_rad times {source}"
            found.append(_pair("torque_Nm", words, r, stiffness * bent[0], both))
    volts = _volts(rig, r)
    if volts is not None and rig.terminal_resistance_ohm and "current_A" in r.responses:
        speed = 0.0
        if turned is not None:
            speed = np.gradient(r["motor_angle_rad"], r.sample_time_s)
        volts = volts - (rig.back_emf_constant_Vs_per_rad or 0.0) * speed
        limit = rig.current_limit_A or np.inf
        current = np.clip(volts / rig.terminal_resistance_ohm, -limit, limit)
        words = "the current that the winding's voltage drives"
        found.append(_pair("current_A", words, r, current, floors["current_A"]))
    for side in ("motor", "load"):
        angle, speed = f"{side}_angle_rad", f"{side}_velocity_rad_per_s"
        if {angle, speed} <= set(r.responses):
            turned = np.gradient(r[angle], r.sample_time_s)
            floor = float(np.hypot(floors[speed], floors[angle] / SLOWEST_MODE_s))
            found.append(_pair(speed, f"the speed of {angle}", r, turned, floor))
    return found


def _wheel(rig: Rig, r: Recording, floors: dict[str, float]) -> tuple[NDArray, float] | None:
    """The motor's angle behind the gear, and its floor."""
    if "motor_angle_rad" not in r.responses:
        return None
    ratio = rig.gear_ratio or 1.0
    return r["motor_angle_rad"] / ratio, floors["motor_angle_rad"] / ratio


def _deflection(
    r: Recording, turned: tuple[NDArray, float] | None, floors: dict[str, float]
) -> tuple[NDArray, float] | None:
    """The angles' difference, and its floor; a locked load stays where it starts."""
    if turned is None:
        return None
    wheel, floor = turned
    if r.load.kind == "locked":
        return wheel - r.first("load_angle_rad"), floor
    if "load_angle_rad" not in r:
        return None
    return wheel - r["load_angle_rad"], float(np.hypot(floor, floors.get("load_angle_rad", 0.0)))


def _pair(name: str, source: str, r: Recording, expected: NDArray, floor: float) -> Pair:
    return Pair(name=name, source=source, reading=r[name], expected=expected, floor=floor)


def _volts(rig: Rig, r: Recording) -> NDArray | None:
    """Volts that the bridge was told to put on the winding; none while it is open."""
    if r.command_name == "voltage_V":
        volts = r["voltage_V"]
    elif r.command_name == "duty" and ("supply_V" in r or rig.supply_voltage_V):
        supply = r["supply_V"] if "supply_V" in r else rig.supply_voltage_V  # noqa: SIM401
        volts = r["duty"] * supply
    else:
        return None
    if "drive_enabled" in r and np.any(r["drive_enabled"] == 0.0):
        return None  # an open bridge's current is none whatever the speed
    return volts


def _window(rig: Rig, r: Recording) -> int:
    """Rows of an average that no resonance outlives."""
    period = SLOWEST_MODE_s
    if rig.has("spring") and rig.spring_stiffness_Nm_per_rad and rig.load_inertia_kgm2:
        own = np.sqrt(rig.load_inertia_kgm2 / rig.spring_stiffness_Nm_per_rad)
        period = max(period, PERIODS * 2.0 * np.pi * float(own))
    return min(max(1, round(period / r.sample_time_s)), max(1, r.rows // 5))


def _slow(values: NDArray, window: int) -> NDArray:
    """Means over a window at every row that has a whole one."""
    return _means(values - values[0], window)


def _means(values: NDArray, window: int) -> NDArray:
    sums = np.cumsum(np.concatenate(([0.0], values)))
    return (sums[window:] - sums[:-window]) / window


def _disagreement(rig: Rig, r: Recording, pair: Pair, window: int) -> str | None:
    """The two go together by a wrong sign or factor, or only one of them moves."""
    y, x = _slow(pair.reading, window), _slow(pair.expected, window)
    y_moves, x_moves = np.ptp(y) > CLEAR * pair.floor, np.ptp(x) > CLEAR * pair.floor
    if not x_moves and not y_moves:
        return None
    if np.ptp(pair.reading) == 0.0:
        other = ", or is the load locked?" if pair.name == "load_angle_rad" else "?"
        return f"{pair.name} never moves although {pair.source} does: is the sensor dead{other}"
    if np.ptp(pair.expected) == 0.0 and pair.name.endswith("velocity_rad_per_s"):
        return f"{pair.name} moves although {pair.source} is none: is the sensor dead?"
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    together = float(np.corrcoef(x, y)[0, 1])
    slope = float(np.std(y) / np.std(x))
    if not (x_moves and y_moves):
        small = (x, pair.expected) if y_moves else (y, pair.reading)
        return _beyond_resolution(rig, pair, small, together, slope)
    if abs(together) < TOGETHER:
        return None
    if together < 0.0:
        return (
            f"{pair.name} runs against {pair.source} (correlation {together:.2f}): the sign of a"
            " column, or the unit of one, is wrong"
        )
    if 1.0 / FACTOR <= slope <= FACTOR:
        return None
    return f"{pair.name} is {slope:.4g} times {pair.source}: {_unit(rig, slope)}"


def _beyond_resolution(
    rig: Rig, pair: Pair, small: tuple[NDArray, NDArray], together: float, slope: float
) -> str | None:
    """One of the two moves less than its sensor resolves, and yet as the other does.

    A load that swings on a motor at rest looks like this too: only a known factor counts.
    """
    slow, raw = small
    if together < ALIKE or np.ptp(slow) <= CLEAR * apparent_noise(raw):
        return None
    if abs(np.log(slope)) < np.log(FACTOR) or _known_unit(rig, slope, CLOSE) is None:
        return None
    return f"{pair.name} is {slope:.4g} times {pair.source}: {_unit(rig, slope)}"


def _unit(rig: Rig, slope: float) -> str:
    known = _known_unit(rig, slope, NEAR)
    if known is not None:
        return f"{known} in one of them?"
    return "a unit, the side of the gear or a value of rig.toml is wrong"


def _known_unit(rig: Rig, slope: float, near: float) -> str | None:
    """What is known to make about such a factor, either way."""
    known = [*KNOWN, (rig.gear_ratio or 1.0, "the other side of the gear")]
    for name in ("motor_encoder_counts_per_rev", "load_encoder_counts_per_rev"):
        if getattr(rig, name):
            known.append((getattr(rig, name) / (2.0 * np.pi), "encoder counts"))
    gaps = [
        (abs(abs(np.log(slope)) - abs(np.log(factor))), words)
        for factor, words in known
        if factor != 1.0
    ]
    gap, words = min(gaps)
    return words if gap < near else None


def _standstill(r: Recording, pair: Pair) -> str | None:
    """A reading that keeps one value while what it should follow moves on."""
    first, last = longest_still(pair.reading)
    if not lasts(r, first, last):
        return None
    passed = float(np.ptp(pair.expected[first:last]))
    if passed <= max(CLEAR * pair.floor, PART * float(np.ptp(pair.expected))):
        return None
    return (
        f"{pair.name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s while"
        f" {pair.source} moves: {stopped(pair.reading, first)}{_or_held(r, pair)}"
    )


def _or_held(r: Recording, pair: Pair) -> str:
    """A load angle that never moves: the load was held, an easy slip of a hand-written rig file."""
    moved, expected = float(np.ptp(pair.reading)), float(np.ptp(pair.expected))
    if pair.name != "load_angle_rad" or moved > HELD * expected:
        return ""
    return ', or the load was held and its recording needs load = "locked"'


def _angle_standstill(r: Recording, pair: Pair) -> str | None:
    """An angle that keeps one value while the spring's torque shows that it cannot."""
    for name in ("motor_angle_rad", "load_angle_rad", "spring_deflection_rad"):
        if name not in r.responses or (name.startswith("load") and r.load.is_held):
            continue
        first, last = longest_still(r[name])
        still = slice(first, last)
        passed, made = float(np.ptp(pair.reading[still])), float(np.ptp(pair.expected[still]))
        all_of_it = float(np.ptp(pair.reading))
        if not lasts(r, first, last) or made > PART * passed:
            continue
        if passed > max(CLEAR * pair.floor, PART * all_of_it):
            return (
                f"{name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s"
                f" while torque_Nm moves: {stopped(r[name], first)}"
            )
    return None


def _gains_work(rig: Rig, r: Recording, window: int) -> str | None:
    """A command that takes work out of a motion there and back, where every loss takes it in."""
    command = r.command_name
    if command is None or command == "current_A" or r.load.kind == "imposed":
        return None
    name = "motor_angle_rad"
    if name not in r.responses:
        name = "load_angle_rad"
        if name not in r.responses or r.load.is_held:
            return None
    angle, drive = _slow(r[name], window), _slow(r[command], window)
    span = float(np.ptp(angle))
    if span <= CLEAR * noise_floor(rig, r)[name]:
        return None
    last = int(np.flatnonzero(np.abs(angle - angle[0]) < BACK * span)[-1])
    work = drive[:-1] * np.diff(angle)
    total = float(np.sum(np.abs(work)))
    there = float(np.sum(np.abs(work[:last])))
    if not total > 0.0 or there < 0.5 * total or float(np.sum(work[:last])) > AGAINST * there:
        return None
    return (
        f"{name} moves against {command}, as if the drive gained work there and back: one of the"
        " two has the wrong sign"
    )


def _wrong_speed(rig: Rig, r: Recording, window: int) -> str | None:
    """A back-EMF that the motor's speed cannot make: the clock, or the angle's unit, is wrong.

    The winding's voltage is fitted by current and speed together, whatever the resistance.
    """
    volts, k_e = _volts(rig, r), rig.back_emf_constant_Vs_per_rad
    if volts is None or not k_e or not {"current_A", "motor_angle_rad"} <= set(r.responses):
        return None
    speed = np.gradient(r["motor_angle_rad"], r.sample_time_s)
    limit = LIMITED * (rig.current_limit_A or np.inf)
    rows = np.abs(r["current_A"][: r.rows + 1 - window]) < limit
    columns = [_means(r["current_A"], window)[rows], _means(speed, window)[rows]]
    volts = _means(volts, window)[rows]
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
    return (
        f"the winding's voltage shows {share:.4g} times the speed that motor_angle_rad and time_s"
        " do: the clock, the angle's unit or back_emf_constant is wrong"
    )


def _open_bridge(r: Recording, floors: dict[str, float]) -> list[str]:
    """A current that flows where the bridge is said to be open."""
    if "drive_enabled" not in r or "current_A" not in r.responses:
        return []
    still_open = (r["drive_enabled"][1:] == 0.0) & (r["drive_enabled"][:-1] == 0.0)
    current = np.abs(r["current_A"][1:][still_open])
    if current.size < 10 or np.median(current) < CLEAR * floors["current_A"]:
        return []
    return [f"current_A is {np.median(current):.3g} A in the median where drive_enabled is 0"]


def _far_apart(rig: Rig, r: Recording, floors: dict[str, float]) -> str | None:
    """Angles whose zeros are further apart than any torque of this machine bends its spring."""
    stiffness = rig.spring_stiffness_Nm_per_rad
    bent = _deflection(r, _wheel(rig, r, floors), floors)
    if bent is None or not stiffness or not rig.has("spring"):
        return None
    middle = stiffness * float(np.median(bent[0]))
    if "torque_Nm" in r.responses:
        most = float(np.max(np.abs(r["torque_Nm"])))
    elif rig.torque_constant_Nm_per_A and rig.current_limit_A:
        most = rig.torque_constant_Nm_per_A * rig.current_limit_A * (rig.gear_ratio or 1.0)
    else:
        return None
    if abs(middle) <= FACTOR * max(most, CLEAR * stiffness * bent[1]):
        return None
    return (
        f"the angles differ by {middle / stiffness:.4g} rad in the median, {abs(middle):.4g} Nm in"
        f" the spring, where no more than {most:.4g} Nm act: an angle's zero is off"
    )
