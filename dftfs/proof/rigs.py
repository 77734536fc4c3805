"""Random rigs: what the owner believes, and what is true."""

from dataclasses import dataclass

import numpy as np

from dftfs.proof.machine import Machine
from dftfs.proof.readings import Sensors

# The nominal values' ranges: the bench of `recordings.md` and its siblings.
RANGES: dict[str, tuple[float, float]] = {
    "supply_voltage_V": (48.0, 48.0),
    "terminal_resistance_ohm": (3.3, 4.4),
    "terminal_inductance_H": (4.0e-3, 5.3e-3),
    "torque_constant_Nm_per_A": (0.29, 0.40),
    "current_limit_A": (4.5, 6.0),
    "motor_inertia_kgm2": (2.8e-4, 3.6e-4),
    "motor_viscous_Nms_per_rad": (6e-5, 1.5e-4),
    "output_inertia_kgm2": (1.6e-3, 2.6e-3),
    "output_viscous_Nms_per_rad": (0.012, 0.028),
    "spring_stiffness_Nm_per_rad": (55.0, 78.0),
    "load_mass_kg": (0.25, 0.36),
    "load_distance_m": (0.27, 0.33),
    "load_inertia_kgm2": (0.026, 0.037),
    "load_viscous_Nms_per_rad": (0.012, 0.035),
    "contact_stiffness_Nm_per_rad": (110.0, 260.0),
    "contact_angle_rad": (0.08, 0.16),
    "contact_damping_Nms_per_rad": (0.3, 0.9),
}

# How far the truth is from the rig file, relative, one standard deviation; the offset in rad.
SPREAD: dict[str, float] = {
    "supply_voltage_V": 0.003,
    "terminal_resistance_ohm": 0.012,
    "terminal_inductance_H": 0.015,
    "torque_constant_Nm_per_A": 0.015,
    "back_emf_constant_Vs_per_rad": 0.01,
    "motor_inertia_kgm2": 0.012,
    "motor_viscous_Nms_per_rad": 0.05,
    "output_inertia_kgm2": 0.012,
    "output_viscous_Nms_per_rad": 0.05,
    "spring_stiffness_Nm_per_rad": 0.015,
    "load_mass_kg": 0.01,
    "load_distance_m": 0.004,
    "load_inertia_kgm2": 0.012,
    "load_viscous_Nms_per_rad": 0.06,
    "contact_stiffness_Nm_per_rad": 0.03,
    "contact_damping_Nms_per_rad": 0.05,
}
OFFSET_SPREAD_RAD = 0.003
ANGLE_SPREAD_RAD = 0.001

# A wrong rig file: factors that an owner's error may have, inside the contract's tolerances.
WRONG: dict[str, float] = {
    "terminal_resistance_ohm": 0.12,
    "torque_constant_Nm_per_A": 0.08,
    "back_emf_constant_Vs_per_rad": 0.06,
    "motor_inertia_kgm2": 0.12,
    "motor_viscous_Nms_per_rad": 0.5,
    "output_viscous_Nms_per_rad": 0.4,
    "spring_stiffness_Nm_per_rad": 0.12,
    "load_inertia_kgm2": 0.08,
    "load_viscous_Nms_per_rad": 0.5,
}


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Nominal and true machine of one case, its sensors, and the owner's tolerances if stated."""

    nominal: Machine
    true: Machine
    sensors: Sensors
    tolerances: dict[str, float]
    anchored: tuple[str, ...]
    wrong: tuple[str, ...]


def three_digits(value: float) -> float:
    return float(f"{value:.3g}")


def draw_rig(
    rng: np.random.Generator, columns: tuple[str, ...], *, wrong: int = 0, exact: bool = False
) -> Rig:
    """A rig whose file is off by `SPREAD`; ``wrong`` values are off by up to `WRONG` besides.

    ``exact``: the rig file is the truth to the last digit.
    """
    values = {name: three_digits(rng.uniform(*span)) for name, span in RANGES.items()}
    one_constant = rng.random() < 0.5  # half of the owners use one convention for both constants
    torque = values["torque_constant_Nm_per_A"]
    share = 1.0 if one_constant else rng.uniform(0.74, 0.9)
    values |= {
        "back_emf_constant_Vs_per_rad": three_digits(torque * share),
        "gear_ratio": 60.0,
        "gravity_angle_offset_rad": 0.0,
    }
    nominal = Machine(**values)
    true = dict(values)
    bad: tuple[str, ...] = ()
    if not exact:
        for name, spread in SPREAD.items():
            true[name] *= 1.0 + spread * np.clip(rng.normal(), -2.5, 2.5)
        true["gravity_angle_offset_rad"] = OFFSET_SPREAD_RAD * rng.normal()
        true["contact_angle_rad"] += ANGLE_SPREAD_RAD * rng.normal()
        bad = tuple(rng.choice(list(WRONG), size=wrong, replace=False))
        for name in bad:
            true[name] *= 1.0 + rng.choice([-1.0, 1.0]) * WRONG[name] * rng.uniform(0.5, 1.0)
    tolerances = {}
    if rng.random() < 0.3:
        for name in rng.choice(list(SPREAD)[:14], size=3, replace=False):
            tolerances[str(name)] = three_digits(1.5 * max(SPREAD[name], WRONG.get(name, 0.0)))
    return Rig(
        nominal=nominal,
        true=Machine(**{k: float(v) for k, v in true.items()}),
        sensors=Sensors(
            columns=columns,
            motor_counts_per_rev=int(rng.choice([4096, 8192, 16384])),
            load_counts_per_rev=int(rng.choice([8192, 16384])),
            torque_noise_Nm=float(rng.choice([0.015, 0.02, 0.03])),
            current_noise_A=float(rng.choice([0.005, 0.01])),
        ),
        tolerances=tolerances,
        anchored=("load_mass_kg",) if rng.random() < 0.3 else (),
        wrong=tuple(str(b) for b in bad),
    )
