"""Health of a recording: clock, resolution, noise, delays, and what it excites."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.doctor.slip_checks import SHARP, delay_s, followed
from rsea_core.importing.unit_evidence import correlation_of, scatter_of, step_of, volts_of
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import noise_floor
from rsea_core.recordings.recording import RESPONSES, Recording
from rsea_core.recordings.sample_faults import clipping_levels

ENOUGH = 10.0  # times the noise of the equation: a parameter's part is seen
WHITE = -0.667  # lag-one correlation of second differences of white noise
COLOURED = 0.15


@dataclass(frozen=True, kw_only=True)
class HealthLine:
    """One measure of one column.

    Attributes
    ----------
    file, column, measure, text : str
    """

    file: str
    column: str
    measure: str
    text: str

    def sentence(self) -> str:
        """The line for a person."""
        return f"{self.file}: {self.column}: {self.measure}: {self.text}"


def health(rig: Rig, r: Recording) -> tuple[HealthLine, ...]:
    """Rate, jitter, resolution, noise and its colour, clipping, delays and excitation."""
    lines = [("time_s", "clock", _clock(r))]
    floors = noise_floor(rig, r)
    for name in RESPONSES:
        if name in r:
            lines.append((name, "range", _range(r, name, floors.get(name))))
            lines.append((name, "noise", _noise(rig, r, name)))
            levels = clipping_levels(r, name)
            if levels and not r.quasi_static:
                lines.append((name, "clipping", f"flat at {', '.join(f'{v:.4g}' for v in levels)}"))
    if not r.quasi_static and r.rows >= 50:
        columns = {n: np.asarray(v) for n, v in r.columns.items()}
        for name, source, x, y in followed(rig, r, columns):
            late, best, _ = delay_s(x, y, r.sample_time_s)
            if best >= SHARP:
                text = f"{late * 1e3:+.1f} ms after {source} (correlation {best:.3f})"
                lines.append((name, "delay", text))
        lines += [(name, "excitation", text) for name, text in _excitation(rig, r, columns)]
    return tuple(
        HealthLine(file=r.file, column=c, measure=m, text=t) for c, m, t in lines if t is not None
    )


def _clock(r: Recording) -> str:
    time = r.time_s if r.logged is None else r.logged["time_s"]
    steps = np.diff(time)
    jitter = 100.0 * float(np.std(steps) / np.mean(steps))
    return (
        f"{r.rows} rows in {time[-1] - time[0]:.4g} s, {1.0 / np.mean(steps):.5g} Hz, jitter"
        f" {jitter:.2g} %, longest step {1e3 * steps.max():.4g} ms"
    )


def _range(r: Recording, name: str, floor: float | None) -> str:
    values = r[name]
    span = float(np.ptp(values))
    held = "" if not floor else f", {span / floor:.3g} times its noise"
    return f"{values.min():.5g} to {values.max():.5g}{held}"


def _noise(rig: Rig, r: Recording, name: str) -> str | None:
    step = step_of(r[name])
    if step is not None and name.endswith("angle_rad"):
        side = name.split("_")[0]
        counts = getattr(rig, f"{side}_encoder_counts_per_rev", None)
        of = "" if not counts else f", {step * counts / (2 * np.pi):.3g} counts of the rig file"
        return f"steps of {step:.4g}{of}"
    if r.rows < 50 or np.ptp(r[name]) == 0.0:
        return None
    second = np.diff(r[name], 2)
    colour = correlation_of(second[1:], second[:-1]) if np.std(second) > 0 else WHITE
    kind = "white" if abs(colour - WHITE) < COLOURED else "filtered or coloured"
    return f"{scatter_of(np.asarray(r[name])):.3g} from row to row, {kind}"


def _excitation(rig: Rig, r: Recording, c: dict[str, NDArray]) -> list[tuple[str, str]]:
    """How far the part of each parameter in its equation stands out of that equation's noise."""
    found = []
    rows = int(np.clip(round(0.02 / r.sample_time_s), 2, r.rows // 4))
    motor = c.get("motor_angle_rad")
    speed = None if motor is None else _smooth(np.gradient(motor, r.sample_time_s), rows)
    volts = volts_of(rig, c)
    R, k_e = rig.terminal_resistance_ohm, rig.back_emf_constant_Vs_per_rad
    if volts is not None and R and k_e and "current_A" in c and speed is not None:
        left = volts[1] - R * c["current_A"] - k_e * speed
        noise = float(np.std(left)) / np.sqrt(r.rows)
        parts = {
            "terminal_resistance_ohm": R * c["current_A"],
            "back_emf_constant_Vs_per_rad": k_e * speed,
        }
        found += [(key, _seen(float(np.std(p)), noise, "V")) for key, p in parts.items()]
    K, ratio = rig.spring_stiffness_Nm_per_rad, rig.gear_ratio or 1.0
    if K and motor is not None and "torque_Nm" in c and ("load_angle_rad" in c):
        deflection = motor / ratio - c["load_angle_rad"]
        left = c["torque_Nm"] - K * deflection
        noise = float(np.std(left)) / np.sqrt(r.rows)
        part = K * float(np.std(deflection))
        found.append(("spring_stiffness_Nm_per_rad", _seen(part, noise, "Nm")))
    J = rig.load_inertia_kgm2
    if J and "load_angle_rad" in c and "torque_Nm" in c and not r.load.is_held:
        speed = _smooth(np.gradient(c["load_angle_rad"], r.sample_time_s), rows)
        part = J * float(np.std(_smooth(np.gradient(speed, r.sample_time_s), rows)))
        noise = float(np.std(c["torque_Nm"])) / np.sqrt(r.rows)
        found.append(("load_inertia_kgm2", _seen(part, noise, "Nm")))
    return found


def _smooth(values: NDArray, rows: int) -> NDArray:
    return np.convolve(values, np.ones(rows) / rows, mode="same")


def _seen(part: float, noise: float, unit: str) -> str:
    share = part / noise if noise > 0.0 else np.inf
    verdict = "seen" if share > ENOUGH else "hardly identifiable: excite it more"
    return f"its part is {part:.3g} {unit} rms, {share:.3g} times what is left: {verdict}"
