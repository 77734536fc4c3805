"""The effects that the contract names, as the true machine has them.

Each function draws the shape of an effect and returns it as a function of strength: 1 is a plain
case, and the case maker turns it until the trace in the readings has the size wanted.
"""

import math

import numpy as np

from dftfs.proof.effects_base import Applied, Effect, Effects
from dftfs.proof.machine import AMBIENT_C, COPPER_PER_K, Machine

TEETH_NM_PER_RAD = 3.0e4  # steel worm on bronze worm wheel: 0.5 mrad at 15 Nm
DRIVE_AND_GEAR = Effects()


def critical(stiffness: float, inertia: float, share: float) -> float:
    """Damping that is this share of the critical one."""
    return 2.0 * share * math.sqrt(stiffness * inertia)


@DRIVE_AND_GEAR.add("gear-friction", "gear")
def gear_friction(rng: np.random.Generator, machine: Machine) -> Effect:
    coulomb, lean = rng.uniform(0.02, 0.05), 0.0
    ratio, stribeck, length = 1.0, 10.0, rng.uniform(1e-3, 3e-3)
    kind = rng.choice(["plain", "stribeck", "direction", "presliding"])
    if kind == "stribeck":
        ratio, stribeck = rng.uniform(1.2, 1.6), rng.uniform(3.0, 15.0)
    elif kind == "direction":
        lean = rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.35)
    elif kind == "presliding":
        length = rng.uniform(0.01, 0.03)

    def at(strength: float) -> Applied:
        level = coulomb * strength
        return Applied(
            description=str(kind),
            parameters={"coulomb_Nm": level},
            physics={
                "gear_coulomb_plus_Nm": level * (1 + lean),
                "gear_coulomb_minus_Nm": level * (1 - lean),
                "gear_static_ratio": ratio,
                "gear_stribeck_rad_per_s": stribeck,
                "gear_bristle_rad": length,
                "gear_bristle_damping_Nms_per_rad": critical(
                    level / length, machine.motor_inertia_kgm2, 0.3
                ),
            },
        )

    return at


@DRIVE_AND_GEAR.add("gear-load-friction", "gear")
def gear_load_friction(rng: np.random.Generator, machine: Machine) -> Effect:
    lead = rng.uniform(0.08, 0.2)
    share = rng.uniform(0.25, 0.6)

    def at(strength: float) -> Applied:
        friction = min(share * strength, 1.2) * lead
        ideal = math.tan(lead)
        return Applied(
            parameters={
                "drive_efficiency": ideal / math.tan(lead + friction),
                "backdrive_efficiency": math.tan(lead - friction) / ideal,
            },
            physics={"worm_lead_rad": lead, "worm_friction_rad": friction},
        )

    return at


@DRIVE_AND_GEAR.add("gear-backlash", "gear")
def gear_backlash(rng: np.random.Generator, machine: Machine) -> Effect:
    width = rng.uniform(0.004, 0.012)
    damping = critical(TEETH_NM_PER_RAD, machine.output_inertia_kgm2, rng.uniform(0.1, 0.4))
    return lambda strength: Applied(
        parameters={"width_rad": width * strength},
        physics={
            "backlash_rad": width * strength,
            "teeth_stiffness_Nm_per_rad": TEETH_NM_PER_RAD,
            "teeth_damping_Nms_per_rad": damping,
        },
    )


@DRIVE_AND_GEAR.add("gear-transmission-error", "gear")
def gear_transmission_error(rng: np.random.Generator, machine: Machine) -> Effect:
    worm, output = rng.uniform(0.5e-3, 1.5e-3), rng.uniform(1e-3, 4e-3)
    cycles = np.array([1.0, 2.0, 3.0, 1.0 / machine.gear_ratio, 2.0 / machine.gear_ratio])
    share = np.array([worm, rng.uniform(0.2, 0.6) * worm, 0.1 * worm, output, 0.3 * output])
    phase = rng.uniform(0, 2 * np.pi, cycles.size)

    def at(strength: float) -> Applied:
        rows = np.column_stack([share * strength, cycles, phase])
        return Applied(
            parameters={
                "wheel_amplitude_rad": output * strength,
                "worm_amplitude_rad": worm * strength,
            },
            series={"gear_error": rows},
        )

    return at


@DRIVE_AND_GEAR.add("motor-cogging", "gear")
def motor_cogging(rng: np.random.Generator, machine: Machine) -> Effect:
    first = float(rng.choice([8, 10, 12, 14, 18, 24]))
    top = rng.uniform(0.02, 0.05)
    cycles = first * np.array([1.0, 2.0, 3.0])
    share = top * np.array([1.0, rng.uniform(0.1, 0.4), rng.uniform(0.0, 0.15)])
    phase = rng.uniform(0, 2 * np.pi, 3)

    def at(strength: float) -> Applied:
        rows = np.column_stack([share * strength, cycles, phase])
        return Applied(
            parameters={"amplitude_Nm": top * strength, "cycles_per_rev": first},
            series={"cogging": rows},
        )

    return at


@DRIVE_AND_GEAR.add("drive-dead-zone", "drive")
def drive_dead_zone(rng: np.random.Generator, machine: Machine) -> Effect:
    width = rng.uniform(0.006, 0.015)
    return lambda strength: Applied(
        parameters={"width_duty": width * strength},
        physics={"dead_zone_duty": width * strength},
    )


@DRIVE_AND_GEAR.add("drive-saturation", "drive")
def drive_saturation(rng: np.random.Generator, machine: Machine) -> Effect:
    supply_sag = bool(rng.random() < 0.5)
    size = rng.uniform(0.8, 2.0) if supply_sag else rng.uniform(0.3, 0.5)

    def at(strength: float) -> Applied:
        if supply_sag:
            ohm = size * strength
            return Applied(
                description="sag",
                parameters={"source_resistance_ohm": ohm},
                physics={"source_resistance_ohm": ohm},
            )
        limit = machine.current_limit_A * max(0.2, 1.0 - size * strength)
        return Applied(
            description="limit",
            parameters={"current_limit_A": limit},
            machine={"current_limit_A": limit},
        )

    return at


@DRIVE_AND_GEAR.add("drive-thermal", "drive")
def drive_thermal(rng: np.random.Generator, machine: Machine) -> Effect:
    capacity, path = rng.uniform(8.0, 20.0), rng.uniform(1.0, 2.5)
    case, air = rng.uniform(60.0, 150.0), rng.uniform(2.0, 4.0)
    magnet = rng.uniform(0.0, 0.001)
    return lambda strength: Applied(
        # the peak itself is read off the motions: see cases.thermal_parameters
        parameters={},
        physics={
            "winding_capacity_J_per_K": capacity / strength,
            "winding_to_case_K_per_W": path * strength,
            "case_capacity_J_per_K": case / strength,
            "case_to_air_K_per_W": air * strength,
            "magnet_loss_per_K": magnet,
        },
    )


def thermal_parameters(peak_winding_C: float) -> dict[str, float]:
    """Parameters in the label of a thermal drift: copper at its hottest in the recordings."""
    return {
        "resistance_rise_fraction": COPPER_PER_K * (peak_winding_C - AMBIENT_C),
        "peak_winding_C": peak_winding_C,
    }


@DRIVE_AND_GEAR.add("drive-delay", "drive")
def drive_delay(rng: np.random.Generator, machine: Machine) -> Effect:
    delay = rng.uniform(4e-3, 12e-3)
    return lambda strength: Applied(
        parameters={"delay_s": delay * strength},
        physics={"delay_s": delay * strength},
    )
