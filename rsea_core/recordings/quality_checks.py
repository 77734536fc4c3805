"""What is wrong with a recording although its file is in order.

Nothing moves, a reading is cut off or stuck, the time is too short or its clock cannot be right, a
torque was computed from the deflection instead of sensed, readings contradict each other.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, apparent_noise, noise_floor
from rsea_core.recordings.consistency_checks import (
    FACTOR,
    WITH,
    inconsistencies,
    work_share,
    zeros_and_jumps,
)
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.initial_speed import ANGLES, MOVES, MOVING, initial_motion
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.sample_faults import (
    FEW,
    angle_clipping_levels,
    clipping_levels,
    stopped_noise,
)

STILL = 4.0  # sensor deviations of motion below which a channel does not move
SHORT_s = 0.5
SLOW_s = 0.1
NOISY = ("torque_Nm", "current_A")
FAST = 1.5  # times the no-load speed: no drive turns this fast
CLEARLY = 0.2  # of the largest speed: such a first one is no doubt
RESOLVED = {
    "motor_angle_rad": "motor_encoder_counts_per_rev",
    "load_angle_rad": "load_encoder_counts_per_rev",
    "torque_Nm": "torque_sensor_noise_Nm",
    "current_A": "current_sensor_noise_A",
}
OFF = 10.0  # times, from which a resolution is another one; its cube: a noise (motion is in it)
ALONE = 20  # rows that step between rows that rest: a resolution
WINDING_s = 0.5  # time constant that no motor's winding has; theirs are milliseconds
EASY = 0.5  # of the load's mass at its distance: less inertia no value's tolerance explains
STARTED = 100.0  # standard deviations of its sensor that a motor which started has moved
FINER = 0.3  # of the stated noise: what a sensed torque cannot follow deflection by


def data_warnings(case: Case, *, pairs: bool = True) -> tuple[Finding, ...]:
    """What is notable about the recordings of a case, in their order.

    Parameters
    ----------
    pairs : bool
        Also what readings say of each other; a spring's bench judges its two itself.
    """
    found = []
    for r in case.recordings:
        found += _of_one(case.rig, r, pairs)
    if _is_pushed(case, found):
        found = [_as_pushed(f) for f in found]
    return (*_rig_values(case.rig), *found, *_duplicates(case.recordings), *_no_command(case))


def data_errors(case: Case) -> tuple[Finding, ...]:
    """Of those, what has to be mended in the files before any diagnosis is to be believed."""
    clipped = [f for r in case.recordings for f in _clipped(r, noise_floor(case.rig, r))]
    angles = [f for f in clipped if f.column in ANGLES]  # contradict all other readings
    found = [*_motor_constants(case.rig), *angles]
    if all(_is_silent(case.rig, r) for r in case.identification):
        text = f"nothing moves in {case.identification[0].file} nor in any other recording"
        found.append(Finding(kind=Kind.SILENT, text=text))
    wrong = [f for r in case.recordings for f in _wrong(case.rig, r)]
    is_pushed = _is_pushed(case, wrong)
    found += [f for f in wrong if not (is_pushed and f.kind is Kind.AGAINST)]
    found += _no_command(case, unless_moving=False)
    found += [f for f in clipped if f.column not in ANGLES]
    for r in case.recordings:
        found += _initial_motion(r, noise_floor(case.rig, r), CLEARLY)
    found += [f for r in case.recordings for f in zeros_and_jumps(case.rig, r)]
    return tuple(found)


def _is_pushed(case: Case, found: list[Finding]) -> bool:
    """Whether more recordings move with their command than those that move against it.

    A wrong sign would be one of all of them: somebody pushes.
    """
    against = sum(f.kind is Kind.AGAINST for f in found)
    if not against:
        return False
    shares = [work_share(case.rig, r) for r in case.recordings if r.rows >= FEW]
    return sum(s is not None and s > WITH for s in shares) > against


def _as_pushed(f: Finding) -> Finding:
    if f.kind is not Kind.AGAINST:
        return f
    text = f"{f.text.split(',')[0]}, in other recordings with it: does something else push here"
    return replace(f, text=text, is_question=True)


def _rig_values(rig: Rig) -> list[Finding]:
    """Values that cannot be true together, whatever was recorded: slips of a unit."""
    found = []
    inductance, resistance = rig.terminal_inductance_H, rig.terminal_resistance_ohm
    if inductance and resistance and inductance > WINDING_s * resistance:
        text = (
            f"terminal_inductance_H over terminal_resistance_ohm is {inductance / resistance:.3g}"
            " s, of a motor's winding some milliseconds: mH or mohm in the rig file"
        )
        found.append(Finding(kind=Kind.RIG_VALUES, text=text, is_question=True))
    mass, distance, inertia = rig.load_mass_kg, rig.load_distance_m, rig.load_inertia_kgm2
    if mass and distance and inertia and inertia < EASY * mass * distance**2:
        text = (
            f"load_inertia_kgm2 = {inertia:.4g} about the joint is less than its mass at its"
            f" distance has ({mass * distance**2:.4g}): g, mm or an inertia about another axis"
        )
        found.append(Finding(kind=Kind.RIG_VALUES, text=text, is_question=True))
    return found


def _motor_constants(rig: Rig) -> list[Finding]:
    """Values of the rig file that cannot both be in their unit."""
    k_t, k_e = rig.torque_constant_Nm_per_A, rig.back_emf_constant_Vs_per_rad
    if not (rig.has("drive") and k_t and k_e) or 1.0 / FACTOR < k_t / k_e < FACTOR:
        return []
    text = (
        f"torque_constant_Nm_per_A is {k_t / k_e:.4g} times back_emf_constant_Vs_per_rad;"
        " in these units a motor has one number for both"
    )
    return [Finding(kind=Kind.RIG_VALUES, text=text, file="rig.toml")]


def _of_one(rig: Rig, r: Recording, pairs: bool) -> list[Finding]:
    floors = noise_floor(rig, r)
    found = []
    if _is_silent(rig, r):
        text = "silent: no reading moves beyond its noise; it says nothing"
        found.append(Finding(kind=Kind.SILENT, text=text, file=r.file))
    length = float(r.time_s[-1] - r.time_s[0])
    if not r.quasi_static and (length < SHORT_s or r.rows < FEW):
        text = f"too short: {r.rows} rows in {length:.3g} s"
        found.append(Finding(kind=Kind.TOO_SHORT, text=text, file=r.file))
    found += _clipped(r, floors)
    found += _wrong(rig, r, pairs)
    found += zeros_and_jumps(rig, r) if pairs else []
    return found + _initial_motion(r, floors) + _derived_torque(rig, r)


def _is_silent(rig: Rig, r: Recording) -> bool:
    if r.quasi_static:  # a point of a map rests
        return False
    return not _moving_columns(r, noise_floor(rig, r))


def _resolution(rig: Rig, r: Recording) -> list[Finding]:
    """A finer resolution or a smaller noise in the rig file than the readings have.

    Readings that are better than stated may be a simulation's: they are none.
    """
    found = []
    if r.quasi_static or r.rows < FEW:
        return found
    for name, key in RESOLVED.items():
        stated = getattr(rig, key)
        if not stated or name not in r.responses or np.ptp(r[name]) == 0.0:
            continue
        if name in ANGLES:
            count, moved = 2.0 * np.pi / stated, np.abs(np.diff(r[name]))
            alone = moved[1:-1][(moved[:-2] == 0.0) & (moved[1:-1] > 0.0) & (moved[2:] == 0.0)]
            if alone.size < ALONE or alone.min() <= OFF * count:
                continue
            text = (
                f"{name} moves in steps of {alone.min():.3g} rad, one count of"
                f" rig.toml's {key} = {stated:g} is {count:.3g} rad"
            )
        else:
            noise = apparent_noise(r[name])
            if noise <= OFF**3 * stated:
                continue
            text = f"{name} scatters by {noise:.3g} from row to row, {key} = {stated:g} in rig.toml"
        found.append(Finding(kind=Kind.RESOLUTION, text=text, file=r.file, column=name))
    return found


def _moving_columns(r: Recording, floors: dict[str, float]) -> list[str]:
    return [name for name in r.responses if float(np.std(r[name])) > STILL * floors[name]]


def _clipped(r: Recording, floors: dict[str, float]) -> list[Finding]:
    """Readings that are cut off at an extreme."""
    moving = _moving_columns(r, floors)
    levels = _levels(r, moving)
    levels |= {n: angle_clipping_levels(r, n, floors[n]) for n in moving if n in ANGLES}
    return [
        Finding(
            kind=Kind.CLIPPED, text=f"{name} is clipped at {level:.5g}: flat at its extreme",
            file=r.file, column=name,
        )
        for name, extremes in levels.items()
        for level in extremes
    ]  # fmt: skip


def _wrong(rig: Rig, r: Recording, pairs: bool = True) -> list[Finding]:
    """A clock, a unit, a sign or a sensor that cannot be right."""
    found = [*_too_fast(rig, r), *_too_slow(r), *_supply(rig, r)]
    if pairs:
        found += [*inconsistencies(rig, r), *_resolution(rig, r)]
    if not r.quasi_static and r.rows >= FEW:
        constant = {f.column for f in found if f.kind is Kind.CONSTANT_RUN}
        floors = noise_floor(rig, r)
        for name, extremes in _levels(r, [n for n in NOISY if n in r.responses]).items():
            stopped = None if extremes else stopped_noise(r, name, floors[name])
            if stopped is not None and name not in constant:
                found.append(stopped)
    return found


def _levels(r: Recording, names: list[str]) -> dict[str, list[float]]:
    """Extremes at which readings are clipped; angles stop at ends and by stiction."""
    if r.quasi_static:
        return {}
    return {name: clipping_levels(r, name) for name in names if name not in ANGLES}


def _no_command(case: Case, *, unless_moving: bool = True) -> list[Finding]:
    """A command that is none in all recordings was not logged: surely where a motor starts.

    Parameters
    ----------
    unless_moving : bool
        Also where nothing shows that something drives the machine.
    """
    driven = [r for r in case.recordings if r.command_name not in (None, "current_A")]
    if not driven or any(np.any(r[r.command_name] != 0.0) for r in driven):
        return []
    starts = [r.file for r in driven if _starts_by_itself(case.rig, r)]
    if not starts and (len(driven) < 2 or not unless_moving):
        return []
    name = driven[0].command_name
    but = f" although the motor of {starts[0]} starts from rest" if starts else ""
    what = f"all {len(driven)} recordings" if len(driven) > 1 else driven[0].file
    text = f"{name} is 0 in {what}{but}: was it logged"
    return [Finding(kind=Kind.NO_COMMAND, text=text, column=name, is_question=True)]


def _starts_by_itself(rig: Rig, r: Recording) -> bool:
    """Whether motor and load rest at first and the motor moves later."""
    if "motor_angle_rad" not in r.responses or r.load.kind == "imposed" or r.quasi_static:
        return False  # what moves a load alone may be a hand
    few = max(5, r.rows // 100)
    floors = noise_floor(rig, r)
    rest = all(float(np.ptp(r[n][:few])) <= MOVING * floors[n] for n in ANGLES if n in r.responses)
    return rest and float(np.ptp(r["motor_angle_rad"])) > STARTED * floors["motor_angle_rad"]


def _duplicates(recordings: tuple[Recording, ...]) -> list[Finding]:
    """Two files with the same readings are one experiment; a copy holds nothing out."""
    found = []
    for k, r in enumerate(recordings):
        for other in recordings[:k]:
            same = r.responses and r.responses == other.responses and r.rows == other.rows
            moving = same and any(np.ptp(r[n]) > 0.0 for n in r.responses)
            if moving and all(np.array_equal(r[n], other[n]) for n in r.responses):
                text = f"{r.file} has the same readings as {other.file}: a copy"
                found.append(Finding(kind=Kind.DUPLICATE, text=text))
    return found


def _too_slow(r: Recording) -> list[Finding]:
    """Rows so far apart that a motor starts and stops between them."""
    if r.quasi_static or r.sample_time_s < SLOW_s or r.command_name is None:
        return []
    text = (
        f"clock wrong? rows are {r.sample_time_s:.3g} s apart; what the machine does"
        " between them is not recorded"
    )
    return [Finding(kind=Kind.CLOCK, text=text, file=r.file, column="time_s")]


def _supply(rig: Rig, r: Recording) -> list[Finding]:
    """A measured supply in millivolts; one far below its rating may be a bench's choice."""
    if not rig.supply_voltage_V or "supply_V" not in r:
        return []
    middle = float(np.median(r["supply_V"]))
    if middle <= FACTOR * rig.supply_voltage_V:
        return []
    text = (
        f"supply_V is {middle:.4g} in the median, {middle / rig.supply_voltage_V:.4g}"
        f" times rig.toml's supply_voltage_V = {rig.supply_voltage_V:g}: mV"
    )
    return [Finding(kind=Kind.SUPPLY, text=text, file=r.file, column="supply_V", is_question=True)]


def _too_fast(rig: Rig, r: Recording) -> list[Finding]:
    """A motor faster than its supply allows: the clock, or the counts per turn, are wrong."""
    k_e, volts = rig.back_emf_constant_Vs_per_rad, rig.supply_voltage_V
    drives = r.command_name in ("duty", "voltage_V")
    if not (k_e and volts and drives) or "motor_angle_rad" not in r or r.quasi_static:
        return []
    window = max(2, min(round(0.05 / r.sample_time_s), r.rows // 10))
    if r.rows <= window:
        return []
    angle = r["motor_angle_rad"]
    speed = np.abs(angle[window:] - angle[:-window]) / (window * r.sample_time_s)
    fastest, no_load = float(speed.max()), volts / k_e
    if fastest <= FAST * no_load:
        return []
    text = (
        f"clock or encoder wrong: the motor turns at {fastest:.4g} rad/s,"
        f" {fastest / no_load:.1f} times its no-load speed"
    )
    return [Finding(kind=Kind.CLOCK, text=text, file=r.file, column="motor_angle_rad")]


def _initial_motion(r: Recording, floors: dict[str, float], least: float = MOVES) -> list[Finding]:
    """A machine that is said to start at rest and does not."""
    if not r.initial_rest or r.quasi_static or r.command_name is None or r.rows < FEW:
        return []
    for name in ANGLES:
        if name not in r.responses or (name.startswith("load") and r.load.is_held):
            continue
        first = initial_motion(r, name, floors[name], least)
        if first is not None:
            text = (
                f"{name} already moves by {first.speed:.3g} rad/s at the first row, and a"
                " simulation starts at rest: say initial_rest = false"
            )
            return [Finding(kind=Kind.INITIAL_MOTION, text=text, file=r.file, column=name)]
    return []


def _derived_torque(rig: Rig, r: Recording) -> list[Finding]:
    """A torque that is a multiple of the deflection, closer than its sensor could read."""
    if "torque_Nm" not in r or not rig.torque_sensor_noise_Nm or "motor_angle_rad" not in r:
        return []
    deflection = r["motor_angle_rad"] / (rig.gear_ratio or 1.0)
    if "load_angle_rad" in r:
        deflection = deflection - r["load_angle_rad"]
    A = np.stack([deflection, np.ones(r.rows)], axis=1)
    torque = np.asarray(r["torque_Nm"])
    if np.ptp(torque) == 0.0 or np.ptp(deflection) == 0.0:
        return []
    slope, rest = _line(A, torque)
    if rest > FINER * rig.torque_sensor_noise_Nm:
        return []
    text = (
        f"torque_Nm is {slope:.5g} Nm/rad times the deflection to {rest:.2g} Nm:"
        " computed, not sensed; it says nothing of the stiffness"
    )
    return [Finding(kind=Kind.DERIVED_TORQUE, text=text, file=r.file, column="torque_Nm")]


def _line(A: NDArray, y: NDArray) -> tuple[float, float]:
    solution, *_ = np.linalg.lstsq(A, y, rcond=None)
    return float(solution[0]), float(np.std(y - A @ solution))
