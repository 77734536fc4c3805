"""What is wrong with a recording although its file is in order, a sentence each.

Nothing moves, a reading is cut off, the time is too short or its clock cannot be right, a torque
was computed from the deflection instead of sensed.
"""

import numpy as np
from numpy.typing import NDArray

from rsea_core.case import Case, noise_floor
from rsea_core.recording import Recording
from rsea_core.rig import Rig
from rsea_core.start_speed import LENGTHS, first_speed

STILL = 4.0  # sensor deviations of motion below which a channel does not move
FLAT_s = 0.02  # a noisy reading that stays at its extreme for this long is cut off
SHORT_s = 0.5
FEW = 200
FAST = 1.5  # times the no-load speed: no drive turns this fast
MOVING = 6.0  # standard deviations of the speed of the very first rows, and
MOVES = 0.02  # of the largest speed: above both the machine already moves
FINER = 0.3  # of the stated noise: what a sensed torque cannot follow deflection by


def findings(case: Case) -> tuple[str, ...]:
    """Sentences about the recordings of a case, in their order."""
    found = []
    for r in case.recordings:
        found += _of_one(case.rig, r)
    return tuple(found)


def _of_one(rig: Rig, r: Recording) -> list[str]:
    floors = noise_floor(rig, r)
    found = []
    moving = [n for n in r.responses if float(np.std(r[n])) > STILL * floors[n]]
    if not moving:
        found.append(f"{r.file}: silent: no reading moves beyond its noise; it says nothing")
    length = float(r.time_s[-1] - r.time_s[0])
    if not r.quasi_static and (length < SHORT_s or r.rows < FEW):
        found.append(f"{r.file}: too short: {r.rows} rows in {length:.3g} s")
    for name in moving:
        if not r.quasi_static and name != "load_angle_rad" and _is_cut_off(r, name):
            top = float(np.max(np.abs(r[name])))
            found.append(f"{r.file}: {name} is clipped at {top:.5g}: flat at its extreme")
    fast = _too_fast(rig, r)
    if fast is not None:
        found.append(fast)
    moves = _moves_already(r, floors)
    if moves is not None:
        found.append(moves)
    derived = _derived_torque(rig, r)
    if derived is not None:
        found.append(derived)
    return found


def _is_cut_off(r: Recording, name: str) -> bool:
    """Whether both noise and motion stop at the largest reading for a while."""
    values = np.abs(r[name])
    run = max(5, round(FLAT_s / r.sample_time_s))
    at_top = values >= values.max() - 1e-12 * max(float(values.max()), 1.0)
    if at_top.sum() < 3 * run or name == "motor_angle_rad":
        return False
    edges = np.flatnonzero(np.diff(np.concatenate(([0], at_top.astype(int), [0]))))
    lengths = edges[1::2] - edges[::2]
    moves = np.abs(np.diff(r[name])) > 0.0
    return bool(lengths.max() >= run and np.mean(moves) > 0.5)


def _too_fast(rig: Rig, r: Recording) -> str | None:
    """A motor faster than its supply allows: the clock, or the counts per turn, are wrong."""
    k_e, volts = rig.back_emf_constant_Vs_per_rad, rig.supply_voltage_V
    drives = r.command_name in ("duty", "voltage_V")
    if not (k_e and volts and drives) or "motor_angle_rad" not in r or r.quasi_static:
        return None
    window = max(2, min(round(0.05 / r.sample_time_s), r.rows // 10))
    if r.rows <= window:
        return None
    angle = r["motor_angle_rad"]
    speed = np.abs(angle[window:] - angle[:-window]) / (window * r.sample_time_s)
    fastest, no_load = float(speed.max()), volts / k_e
    if fastest <= FAST * no_load:
        return None
    return (
        f"{r.file}: clock or encoder wrong: the motor turns at {fastest:.4g} rad/s,"
        f" {fastest / no_load:.1f} times its no-load speed"
    )


def _moves_already(r: Recording, floors: dict[str, float]) -> str | None:
    """A machine that is said to start at rest and does not."""
    if not r.initial_rest or r.quasi_static or r.command_name is None or r.rows < FEW:
        return None
    for name in ("motor_angle_rad", "load_angle_rad"):
        if name not in r.responses or (name.startswith("load") and r.load.is_held):
            continue
        # the fewest rows: over more of them a drive that just came on looks like a speed
        first = first_speed(r[name][: LENGTHS[0]], r.sample_time_s, floors[name])
        if abs(first.speed) <= MOVING * first.std:
            continue
        window = max(2, min(round(0.05 / r.sample_time_s), r.rows // 10))
        angle = r[name]
        largest = np.max(np.abs(angle[window:] - angle[:-window])) / (window * r.sample_time_s)
        if abs(first.speed) > MOVES * largest:
            return (
                f"{r.file}: {name} already moves by {first.speed:.3g} rad/s at the first row, and a"
                " simulation starts at rest: say initial_rest = false"
            )
    return None


def _derived_torque(rig: Rig, r: Recording) -> str | None:
    """A torque that is a multiple of the deflection, closer than its sensor could read."""
    if "torque_Nm" not in r or not rig.torque_sensor_noise_Nm or "motor_angle_rad" not in r:
        return None
    deflection = r["motor_angle_rad"] / (rig.gear_ratio or 1.0)
    if "load_angle_rad" in r:
        deflection = deflection - r["load_angle_rad"]
    A = np.stack([deflection, np.ones(r.rows)], axis=1)
    torque = np.asarray(r["torque_Nm"])
    if np.ptp(torque) == 0.0 or np.ptp(deflection) == 0.0:
        return None
    slope, rest = _line(A, torque)
    if rest > FINER * rig.torque_sensor_noise_Nm:
        return None
    return (
        f"{r.file}: torque_Nm is {slope:.5g} Nm/rad times the deflection to {rest:.2g} Nm:"
        " computed, not sensed; it says nothing of the stiffness"
    )


def _line(A: NDArray, y: NDArray) -> tuple[float, float]:
    solution, *_ = np.linalg.lstsq(A, y, rcond=None)
    return float(solution[0]), float(np.std(y - A @ solution))
