"""What is reported of a fitted law: figures that mean the same for every law of the effect."""

from collections.abc import Mapping

import numpy as np

from rsea_core.identify.candidates.candidate import Law
from rsea_core.identify.candidates.writers import slips_of

LOOP_rad = 0.15  # amplitude of the loop by which hystereses are compared

UNITS = {
    "coulomb_Nm": "Nm",
    "drive_efficiency": "-",
    "backdrive_efficiency": "-",
    "width_rad": "rad",
    "wheel_amplitude_rad": "rad",
    "worm_amplitude_rad": "rad",
    "amplitude_Nm": "Nm",
    "cycles_per_rev": "-",
    "width_duty": "-",
    "source_resistance_ohm": "ohm",
    "current_limit_A": "A",
    "delay_s": "s",
    "loop_width_Nm": "Nm",
    "loop_energy_J": "J",
    "stiffness_ratio_at_0p15rad": "-",
    "onset_rad": "rad",
    "onset_Nm": "Nm",
    "stiffness_rise_fast_over_static": "-",
    "stiffness_Nm_per_rad": "Nm/rad",
    "torque_at_5_rad_per_s_Nm": "Nm",
    "torque_amplitude_Nm": "Nm",
    "angle_rad": "rad",
    "free_link_frequency_Hz": "Hz",
    "start_s": "s",
    "end_s": "s",
    "peak_Nm": "Nm",
    "exponent": "-",
    "scale": "-",
    "resistance_rise_fraction": "-",
    "peak_winding_C": "C",
}


def comparable(
    law: Law, v: Mapping[str, float], *, stiffness: float, peak_rise_K: float, ambient_C: float
) -> dict[str, float | str]:
    """The comparable figures of a law's values.

    Parameters
    ----------
    stiffness : float
        Of the spring as corrected [Nm/rad].
    peak_rise_K : float
        Of the winding above ambient, the largest in the recordings.
    """
    effect = law.effect
    if effect == "gear-transmission-error":
        found = {}
        for kind in ("wheel", "worm"):
            if f"{kind}_sin_rad" in v:
                pair = (v[f"{kind}_sin_rad"], v[f"{kind}_cos_rad"])
                found[f"{kind}_amplitude_rad"] = float(np.hypot(*pair))
        return found
    if effect == "motor-cogging":
        waves = [
            (float(np.hypot(v[f"sin_{k}Nm"], v[f"cos_{k}Nm"])), v[f"cycles_{k}per_rev"])
            for k in ("", "2_", "3_")
            if f"sin_{k}Nm" in v
        ]
        amplitude, cycles = max(waves)
        return {"amplitude_Nm": amplitude, "cycles_per_rev": cycles}
    if effect == "load-unbalance":
        angle = float(np.arctan2(v["cos_Nm"], v["sin_Nm"]))
        return {
            "torque_amplitude_Nm": float(np.hypot(v["sin_Nm"], v["cos_Nm"])),
            "angle_rad": angle,
        }
    if effect == "spring-hysteresis":
        width, energy = loop(law, v)
        return {"loop_width_Nm": width, "loop_energy_J": energy}
    if effect == "spring-contact":
        onset = min(v["onset_rad"], v.get("onset_backward_rad", np.inf))
        onset -= min(0.5 * v.get("round_rad", 0.0), 0.9 * onset)  # the first touch
        return {"onset_rad": onset, "onset_Nm": stiffness * onset}
    if effect == "spring-viscoelastic":
        extra = sum(value for name, value in v.items() if name.startswith("branch_stiffness"))
        return {"stiffness_rise_fast_over_static": 1.0 + extra / stiffness}
    if effect == "load-flexibility":
        return {"free_link_frequency_Hz": v["frequency_Hz"]}
    if effect == "load-disturbance":
        return {
            "recording": law.only or "",
            "start_s": v["start_s"],
            "end_s": v["start_s"] + v["width_s"],
            "peak_Nm": v["peak_Nm"],
        }
    if effect == "drive-thermal":
        rise = 0.00393 * peak_rise_K
        return {"resistance_rise_fraction": rise, "peak_winding_C": ambient_C + peak_rise_K}
    if effect in ("gear-friction", "load-friction"):
        return {"coulomb_Nm": v["coulomb_Nm"]}
    if effect == "sensor-drift":
        return {"rate_per_s": v["rate_per_s"]}
    keep = {knob.name for knob in law.knobs} & (UNITS.keys() | {"offset", "rate_per_s"})
    return {name: v[name] for name in v if name in keep}


def loop(law: Law, v: Mapping[str, float], amplitude_rad: float = LOOP_rad) -> tuple[float, float]:
    """Width at zero deflection [Nm] and energy [J] of a slow loop of the given amplitude."""
    sweep = np.linspace(-amplitude_rad, amplitude_rad, 401)
    path = np.concatenate([np.linspace(0.0, amplitude_rad, 201), sweep[::-1], sweep, sweep[::-1]])
    torque = np.zeros(path.size)
    if law.law == "bouc-wen":
        z, n, yield_ = 0.0, v["exponent"], v["yield_rad"]
        for i in range(1, path.size):
            way = path[i] - path[i - 1]
            sign = np.sign(way * z)
            z += way * (1.0 - (abs(z) / yield_) ** n * 0.5 * (1.0 + sign))
            torque[i] = v["stiffness_Nm_per_rad"] * z
    else:
        for stiffness, y in slips_of(v):
            z = 0.0
            for i in range(1, path.size):
                z = min(max(z + path[i] - path[i - 1], -y), y)
                torque[i] += stiffness * z
    up, down = torque[602:1003], torque[1003:1404]
    width = float(np.interp(0.0, sweep, up) - np.interp(0.0, sweep, down[::-1]))
    energy = float(np.trapezoid(up, sweep) + np.trapezoid(down, sweep[::-1]))
    return abs(width), abs(energy)


def unit_of(name: str, law: Law) -> str:
    """Unit of a comparable figure."""
    if name in UNITS:
        return UNITS[name]
    base = (law.sensor or "").rsplit("_", 1)[-1]
    return f"{base}/s" if name == "rate_per_s" else base
