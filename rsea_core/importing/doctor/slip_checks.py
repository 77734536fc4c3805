"""Slips of a log or of a rig file: what its readings say of each other, closer than any physics.

The laws of `unit_evidence` hold within some percent on machines with friction, backlash, a loop
or heat (all practice cases); the thresholds here are several times that. Where one is missed by a
factor that a slip makes, the slip is named.
"""

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.unit_evidence import (
    Law,
    derivative_laws,
    gear_laws,
    sensor_laws,
    spring_laws,
    volts_of,
    winding_laws,
)
from rsea_core.machine.rig import Rig
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

FACTOR = {
    derivative_laws: 1.3,
    gear_laws: 1.5,
    winding_laws: 1.6,
    spring_laws: 1.5,
}
COUNTS_FACTOR, NOISE_FACTORS = 1.1, (0.3, 6.0)
KNOWN = (
    (180.0 / np.pi, "degrees for radians"),
    (1000.0, "a thousandth for the unit, or milliseconds for seconds"),
    (100.0, "percent for a fraction"),
    (2.0 * np.pi, "turns for radians"),
    (4.0, "lines for counts of an encoder"),
    (2.0, "a clock, a count or a ratio twice as large"),
)
NEAR = 0.10  # natural logarithm
LATE_s, LATE_ROWS = 0.03, 3  # no bridge, sensor or filter of such a rig is as late
MOST_LATE_s = 0.5
SHARP = 0.9  # correlation that a delay has to reach, and
GAIN = 1.15  # times that without it, in what is left
HELD_LOADS = ("locked", "imposed", "contact")


def slips(rig: Rig, r: Recording) -> list[Finding]:
    """Inconsistent scales, signs and clocks of one recording, with the likely slip.

    Parameters
    ----------
    rig : Rig
        Values that are missing say nothing.
    """
    if r.quasi_static or r.rows < 50:
        return []
    columns = {n: np.asarray(v) for n, v in r.columns.items()}
    ratio = rig.gear_ratio or 1.0
    found = []
    for function, factor in FACTOR.items():
        if function is gear_laws and r.load.kind in HELD_LOADS:
            continue
        if function is spring_laws and "load_angle_rad" not in r and r.load.kind != "locked":
            continue
        for law in function(rig, columns, ratio):
            if not 1.0 / factor < law.ratio < factor:
                found.append(_finding(r, law))
    for law in sensor_laws(rig, columns, ratio):
        is_count = law.columns[0].endswith("angle_rad")
        low, high = (1 / COUNTS_FACTOR, COUNTS_FACTOR) if is_count else NOISE_FACTORS
        if not low < law.ratio < high:
            found.append(_finding(r, law))
    return found + _late(rig, r, columns)


def _finding(r: Recording, law: Law) -> Finding:
    column = next(c for c in reversed(law.columns) if c != "time_s")
    text = f"{law.text}: {_slip(law.ratio)}"
    kind = Kind.SIGN if law.ratio < 0.0 else Kind.UNIT
    return Finding(kind=kind, text=text, file=r.file, column=column)


def _slip(ratio: float) -> str:
    if ratio < 0.0:
        return "a sign is wrong in one of them"
    size = abs(np.log(ratio))
    gap, phrase = min((abs(size - np.log(f)), phrase) for f, phrase in KNOWN)
    return f"{phrase}?" if gap < NEAR else "a unit, a side of the gear or a rig value is wrong"


def delay_s(x: NDArray, y: NDArray, step_s: float) -> tuple[float, float, float]:
    """By how much y is later than x, the correlation there and without a delay."""
    longest = min(round(MOST_LATE_s / step_s), x.size // 4)
    x, y = (v - v.mean() for v in (x, y))
    size = 1 << (2 * x.size - 1).bit_length()
    spectrum = np.conj(np.fft.rfft(x, size)) * np.fft.rfft(y, size)
    product = np.fft.irfft(spectrum, size)
    lags = np.arange(-longest, longest + 1)
    scale = np.sqrt(np.sum(x**2) * np.sum(y**2))
    together = product[lags] / scale if scale > 0.0 else np.zeros(lags.size)
    k = int(np.argmax(together))
    return float(lags[k] * step_s), float(together[k]), float(together[longest])


def _late(rig: Rig, r: Recording, c: dict[str, NDArray]) -> list[Finding]:
    """A column of another clock: what it should follow at once comes earlier or later."""
    found = []
    for name, source, x, y in followed(rig, r, c):
        late, best, now = delay_s(x, y, r.sample_time_s)
        if best < SHARP or abs(late) < max(LATE_s, LATE_ROWS * r.sample_time_s):
            continue
        if abs(late) >= 0.98 * MOST_LATE_s or 1.0 - now < GAIN * (1.0 - best):
            continue
        text = (
            f"{name} comes {abs(late) * 1e3:.0f} ms {'after' if late > 0 else 'before'} {source}:"
            " are two clocks apart?"
        )
        found.append(Finding(kind=Kind.CLOCK, text=text, file=r.file, column=name))
    return found


def followed(rig: Rig, r: Recording, c: dict[str, NDArray]):
    """Columns that follow others without delay: (name, phrase of the other, other, column)."""
    ratio, pairs = rig.gear_ratio or 1.0, []
    step = r.sample_time_s
    held = r.load.kind == "locked"
    if "torque_Nm" in c and "motor_angle_rad" in c and ("load_angle_rad" in c or held):
        load = 0.0 if held or "load_angle_rad" not in c else c["load_angle_rad"]
        deflection = c["motor_angle_rad"] / ratio - load
        pairs.append(("torque_Nm", "the spring's deflection", deflection, c["torque_Nm"]))
    volts = volts_of(rig, c)
    R, k_e = rig.terminal_resistance_ohm, rig.back_emf_constant_Vs_per_rad
    if volts is not None and R and k_e and "current_A" in c and "motor_angle_rad" in c:
        speed = np.gradient(c["motor_angle_rad"], step)
        rows = int(np.clip(round(0.01 / step), 1, speed.size // 4))
        smooth = np.convolve(speed, np.ones(rows) / rows, mode="same")
        back = volts[1] - R * c["current_A"]
        pairs.append(("motor_angle_rad", "the back-EMF", k_e * smooth, back))
        pairs.append(("current_A", "the voltage", (volts[1] - k_e * smooth), c["current_A"]))
    for side in ("motor", "load"):
        names = (f"{side}_angle_rad", f"{side}_velocity_rad_per_s")
        if all(n in c for n in names):
            pairs.append((names[1], f"the speed of {names[0]}", np.gradient(c[names[0]], step),
                          c[names[1]]))  # fmt: skip
    return [p for p in pairs if np.std(p[2]) > 0.0 and np.std(p[3]) > 0.0]
