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

from rsea_core.case import noise_floor
from rsea_core.recording import Recording
from rsea_core.rig import Rig

SLOWEST_MODE_s = 0.1  # averages last as long where the rig file does not say how slow it swings
PERIODS = 2.0  # of the slowest resonance that an average lasts
TOGETHER = 0.8  # correlation from which two readings show the same motion
FACTOR = 4.0  # no missing physics of these machines makes slow readings differ by so much
CLEAR = 20.0  # sensor deviations that a motion has to span, to be one here
HELD = 0.01  # of what it should follow: a load that moves less than this is held
PART = 0.3  # of all motion that passes while a reading stands still
STILL_s, STILL_SHARE = 0.3, 0.1  # a reading stands still for so long, and for this share of rows
AGAINST = -0.3  # of the work done there and back: a drive that gains it back has a wrong sign
BACK = 0.1  # of the range: as near as this to its start is back
JUMP = 30.0  # times the steps that nine of ten rows keep to: no inertia allows it
KNOWN = (
    (180.0 / np.pi, "degrees"),
    (1000.0, "a thousandth of the unit"),
    (1.0 / (2.0 * np.pi), "turns"),
)
NEAR = 0.12  # natural logarithm within which a factor is a known one's


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
    found = []
    for pair in pairs(rig, r, floors):
        said = _disagreement(rig, r, pair, window) or _standstill(r, pair)
        if said is None and pair.name == "torque_Nm":
            said = _angle_standstill(r, pair)
        if said is not None:
            found.append(said)
    gains = _gains_work(rig, r, window)
    if gains is not None and not found:
        found.append(gains)
    found += _open_bridge(r, floors)
    far = _far_apart(rig, r, floors)
    if far is not None and not found:
        found.append(far)
    for name in r.responses:
        found += _jumps(r, name, floors[name])
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
    sums = np.cumsum(np.concatenate(([0.0], values - values[0])))
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
    if not (x_moves and y_moves):
        return None
    together = float(np.corrcoef(x, y)[0, 1])
    slope = float(np.std(y) / np.std(x))
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


def _unit(rig: Rig, slope: float) -> str:
    known = [*KNOWN, (rig.gear_ratio or 1.0, "the other side of the gear")]
    for name in ("motor_encoder_counts_per_rev", "load_encoder_counts_per_rev"):
        if getattr(rig, name):
            known.append((getattr(rig, name) / (2.0 * np.pi), "encoder counts"))
    for factor, words in known:
        if factor != 1.0 and abs(abs(np.log(slope)) - abs(np.log(factor))) < NEAR:
            return f"{words} in one of them?"
    return "a unit, the side of the gear or a value of rig.toml is wrong"


def _standstill(r: Recording, pair: Pair) -> str | None:
    """A reading that keeps one value while what it should follow moves on."""
    first, last = longest_still(pair.reading)
    if not _lasts(r, first, last):
        return None
    passed = float(np.ptp(pair.expected[first:last]))
    if passed <= max(CLEAR * pair.floor, PART * float(np.ptp(pair.expected))):
        return None
    return (
        f"{pair.name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s while"
        f" {pair.source} moves: the sensor died, or the logger repeats it{_or_held(r, pair)}"
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
        if not _lasts(r, first, last) or made > PART * passed:
            continue
        if passed > max(CLEAR * pair.floor, PART * all_of_it):
            return (
                f"{name} stands still from {r.time_s[first]:.4g} to {r.time_s[last - 1]:.4g} s"
                " while torque_Nm moves: the sensor died, or the logger repeats it"
            )
    return None


def longest_still(values: NDArray) -> tuple[int, int]:
    """First row and the row after the last of the longest run of one value."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    edges = np.concatenate(([0], changes, [values.size]))
    k = int(np.argmax(np.diff(edges)))
    return int(edges[k]), int(edges[k + 1])


def _lasts(r: Recording, first: int, last: int) -> bool:
    rows = last - first
    return rows >= STILL_SHARE * r.rows and rows * r.sample_time_s >= STILL_s


def stuck(r: Recording, name: str, noise: float) -> str | None:
    """A sensor with noise whose noise stops, in words; None where it goes on.

    Parameters
    ----------
    noise : float
        Its standard deviation.
    """
    values = r[name]
    first, last = longest_still(values)
    rest = np.diff(np.delete(values, slice(first, last)))
    if not _lasts(r, first, last) or rest.size < 10 or np.mean(rest == 0.0) > PART:
        return None
    if np.median(np.abs(rest)) > CLEAR * noise:
        return None
    return (
        f"{name} repeats {values[first]:.5g} from {r.time_s[first]:.4g} to"
        f" {r.time_s[last - 1]:.4g} s without any noise: the sensor died, or the logger repeats it"
    )


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


def _jumps(r: Recording, name: str, floor: float) -> list[str]:
    """Steps or spikes of one row that no inertia allows."""
    steps = np.diff(r[name])
    usual = max(float(np.percentile(np.abs(steps), 90.0)), 2.0 * floor)
    limit = max(JUMP * usual, CLEAR * floor)
    alone = np.minimum(np.abs(steps[:-1]), np.abs(steps[1:])) * (steps[:-1] * steps[1:] < 0.0)
    spikes = np.flatnonzero(alone > limit)
    if spikes.size:
        k = int(spikes[0]) + 1
        times = "" if spikes.size == 1 else f", {spikes.size} rows in all"
        turn = _turn(name, float(alone[k - 1]))
        return [f"{name}: spike of {alone[k - 1]:.4g} at {r.time_s[k]:.6g} s{times}{turn}"]
    if not name.endswith("angle_rad"):
        return []
    far = np.flatnonzero(np.abs(steps) > limit)
    if not far.size:
        return []
    k = int(far[0])
    size = float(abs(steps[k]))
    times = "" if far.size == 1 else f", {far.size} times in all"
    return [f"{name} jumps by {size:.4g} rad at {r.time_s[k + 1]:.6g} s{times}{_turn(name, size)}"]


def _turn(name: str, size: float) -> str:
    full = name.endswith("angle_rad") and abs(size - 2.0 * np.pi) < 0.3 * np.pi
    return " (a full turn: the reading wraps)" if full else ""
