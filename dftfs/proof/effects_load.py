"""Effects of the load, the environment and the sensors as the true machine has them."""

import math

import numpy as np

from dftfs.proof.effects_base import Applied, Draw, Effect, Effects, Pulse
from dftfs.proof.effects_drive import critical
from dftfs.proof.machine import Machine
from dftfs.proof.readings import Fault

REFERENCE_DEPTH_RAD = 0.04  # where a nonlinear environment has the torque of the linear one
LOAD_AND_SENSORS = Effects()


@LOAD_AND_SENSORS.add("spring-parallel", "load")
def spring_parallel(rng: np.random.Generator, machine: Machine) -> Effect:
    stiffness = rng.uniform(0.4, 1.5)

    def at(strength: float) -> Applied:
        value = stiffness * strength
        return Applied(
            parameters={"stiffness_Nm_per_rad": value},
            physics={"parallel_stiffness_Nm_per_rad": value},
        )

    return at


@LOAD_AND_SENSORS.add("load-friction", "load")
def load_friction(rng: np.random.Generator, machine: Machine) -> Effect:
    coulomb, length = rng.uniform(0.03, 0.1), rng.uniform(2e-4, 8e-4)
    ratio, stribeck = (1.0, 0.1) if rng.random() < 0.6 else (rng.uniform(1.2, 1.6), 0.15)

    def at(strength: float) -> Applied:
        level = coulomb * strength
        return Applied(
            parameters={"coulomb_Nm": level},
            physics={
                "load_coulomb_Nm": level,
                "load_static_ratio": ratio,
                "load_stribeck_rad_per_s": stribeck,
                "load_bristle_rad": length,
                "load_bristle_damping_Nms_per_rad": critical(
                    level / length, machine.load_inertia_kgm2, 0.2
                ),
            },
        )

    return at


@LOAD_AND_SENSORS.add("load-drag", "load")
def load_drag(rng: np.random.Generator, machine: Machine) -> Effect:
    torque, exponent = rng.uniform(0.6, 2.5), rng.uniform(1.8, 2.2)

    def at(strength: float) -> Applied:
        value = torque * strength
        return Applied(
            parameters={"torque_at_5_rad_per_s_Nm": value},
            physics={"drag_coefficient": value / 5.0**exponent, "drag_exponent": exponent},
        )

    return at


@LOAD_AND_SENSORS.add("load-unbalance", "load")
def load_unbalance(rng: np.random.Generator, machine: Machine) -> Effect:
    torque = rng.uniform(0.1, 0.35)
    angle = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.2)
    return lambda strength: Applied(
        parameters={"torque_amplitude_Nm": torque * strength, "angle_rad": angle},
        physics={"unbalance_Nm": torque * strength, "unbalance_angle_rad": angle},
    )


@LOAD_AND_SENSORS.add("load-flexibility", "load")
def load_flexibility(rng: np.random.Generator, machine: Machine) -> Effect:
    tip, frequency = rng.uniform(0.5, 0.8), rng.uniform(8.0, 18.0)
    damping = rng.uniform(0.01, 0.04)
    inertia = machine.load_inertia_kgm2
    together = tip * (1.0 - tip) * inertia

    def at(strength: float) -> Applied:
        free = frequency * strength**-0.3
        stiffness = (2 * math.pi * free) ** 2 * together
        return Applied(
            parameters={"free_link_frequency_Hz": free},
            physics={
                "tip_share": tip,
                "link_stiffness_Nm_per_rad": stiffness,
                "link_damping_Nms_per_rad": critical(stiffness, together, damping),
            },
        )

    return at


@LOAD_AND_SENSORS.add("load-disturbance", "load")
def load_disturbance(rng: np.random.Generator, machine: Machine) -> Effect:
    start, width = rng.uniform(2.0, 4.5), rng.uniform(0.3, 1.0)
    peak = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0)
    corner = float(rng.choice([1.0, 0.3]))

    def at(strength: float) -> Applied:
        pulse = Pulse(start_s=start, end_s=start + width, peak_Nm=peak * strength, corner=corner)
        return Applied(
            parameters={"peak_Nm": pulse.peak_Nm, "start_s": pulse.start_s, "end_s": pulse.end_s},
            pulse=pulse,
        )

    return at


@LOAD_AND_SENSORS.add("contact-nonlinear", "environment")
def contact_nonlinear(rng: np.random.Generator, machine: Machine) -> Effect:
    rise = rng.uniform(0.35, 0.8)

    def at(strength: float) -> Applied:
        exponent = 1.0 + rise * min(strength, 1.5)
        match = REFERENCE_DEPTH_RAD ** (1.0 - exponent)
        loss = machine.contact_damping_Nms_per_rad / REFERENCE_DEPTH_RAD**exponent
        return Applied(
            parameters={"exponent": exponent},
            physics={
                "contact_exponent": exponent,
                "contact_power_stiffness": machine.contact_stiffness_Nm_per_rad * match,
                "contact_power_damping": loss,
            },
        )

    return at


def _sensor(name: str, field: str, columns: dict[str, tuple[float, float]], centre: float) -> Draw:
    """A sensor effect: per column the range of its size at strength 1."""

    def draw(rng: np.random.Generator, machine: Machine) -> Effect:
        column = str(rng.choice(list(columns)))
        size = rng.uniform(*columns[column])
        if field != "delay_s":
            size *= rng.choice([-1.0, 1.0])

        def at(strength: float) -> Applied:
            value = centre + size * strength
            return Applied(
                name=name,
                subsystem=f"sensor:{column}",
                parameters={field: value},
                faults={column: Fault(**{field: value})},
            )

        return at

    return draw


LOAD_AND_SENSORS |= {
    "sensor-offset": _sensor(
        "sensor-offset",
        "offset",
        {"load_angle_rad": (5e-3, 2e-2), "torque_Nm": (0.1, 0.4), "current_A": (0.03, 0.1)},
        0.0,
    ),
    "sensor-scale": _sensor(
        "sensor-scale",
        "scale",
        {"torque_Nm": (0.05, 0.12), "load_angle_rad": (0.03, 0.08), "current_A": (0.05, 0.12)},
        1.0,
    ),
    "sensor-delay": _sensor(
        "sensor-delay",
        "delay_s",
        {
            "torque_Nm": (4e-3, 1.2e-2),
            "load_angle_rad": (4e-3, 1.2e-2),
            "current_A": (3e-3, 8e-3),
        },
        0.0,
    ),
    "sensor-drift": _sensor(
        "sensor-drift",
        "rate_per_s",
        {
            "torque_Nm": (0.01, 0.05),
            "load_angle_rad": (3e-4, 1.5e-3),
            "current_A": (4e-3, 1.5e-2),
        },
        0.0,
    ),
}
