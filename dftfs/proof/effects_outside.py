"""Effects that no name of the contract fits: the right answer is `unexplained`, at the place."""

import math

import numpy as np

from dftfs.proof.effects_base import Applied, Effect, Effects
from dftfs.proof.effects_drive import TEETH_NM_PER_RAD, critical
from dftfs.proof.machine import Machine
from dftfs.proof.readings import Fault

NEAREST = {
    "x-gearbox-mount": ("load-flexibility", "spring-viscoelastic"),
    "x-load-detent": ("motor-cogging", "gear-transmission-error", "gear-load-friction"),
    "x-clamp-slip": ("spring-hysteresis", "gear-backlash", "sensor-drift"),
    "x-encoder-ripple": ("gear-transmission-error", "sensor-scale"),
    "x-torque-clipping": ("sensor-scale",),
    "x-brown-out": ("drive-saturation", "drive-thermal"),
    "x-lost-counts": ("sensor-scale", "gear-backlash"),
    "x-fading-current": ("sensor-scale", "drive-saturation"),
    "x-load-magnet": ("spring-parallel", "load-unbalance"),
}
OUTSIDE = Effects()


@OUTSIDE.add("x-gearbox-mount", "gear")
def gearbox_mount(rng: np.random.Generator, machine: Machine) -> Effect:
    frequency, share = rng.uniform(9.0, 20.0), rng.uniform(0.02, 0.06)
    inertia = rng.uniform(0.05, 0.15)

    def at(strength: float) -> Applied:
        stiffness = inertia * (2 * math.pi * frequency / math.sqrt(strength)) ** 2
        return Applied(
            description="the gearbox swings on a soft mount",
            physics={
                "mount_inertia_kgm2": inertia,
                "mount_stiffness_Nm_per_rad": stiffness,
                "mount_damping_Nms_per_rad": critical(stiffness, inertia, share),
                "teeth_stiffness_Nm_per_rad": TEETH_NM_PER_RAD,
                "teeth_damping_Nms_per_rad": critical(
                    TEETH_NM_PER_RAD, machine.output_inertia_kgm2, 0.3
                ),
            },
        )

    return at


@OUTSIDE.add("x-load-detent", "gear")
def load_detent(rng: np.random.Generator, machine: Machine) -> Effect:
    share, cycles = rng.uniform(0.3, 0.8), float(rng.integers(70, 190))
    return lambda strength: Applied(
        description="a detent over the wheel angle that grows with the transmitted torque",
        physics={"detent_share": share * strength, "detent_cycles": cycles},
    )


@OUTSIDE.add("x-clamp-slip", "spring")
def clamp_slip(rng: np.random.Generator, machine: Machine) -> Effect:
    torque = rng.uniform(8.0, 10.0)
    return lambda strength: Applied(
        description="the spring's clamp slips on its shaft above a torque",
        physics={"clamp_slip_Nm": torque / strength**0.1},
    )


@OUTSIDE.add("x-encoder-ripple", "sensor:load_angle_rad")
def encoder_ripple(rng: np.random.Generator, machine: Machine) -> Effect:
    size, cycles = rng.uniform(2e-3, 6e-3), float(rng.integers(24, 64))
    return lambda strength: Applied(
        description="the load encoder's interpolation error",
        faults={"load_angle_rad": Fault(ripple=size * strength, ripple_cycles=cycles)},
    )


@OUTSIDE.add("x-torque-clipping", "sensor:torque_Nm")
def torque_clipping(rng: np.random.Generator, machine: Machine) -> Effect:
    top = rng.uniform(4.0, 6.0)
    return lambda strength: Applied(
        description="the torque sensor's amplifier clips",
        faults={"torque_Nm": Fault(clip=top / math.sqrt(strength))},
    )


@OUTSIDE.add("x-brown-out", "drive")
def brown_out(rng: np.random.Generator, machine: Machine) -> Effect:
    depth = rng.uniform(0.06, 0.15)
    return lambda strength: Applied(
        description="the supply drops for a second now and then",
        brown_out=min(0.5, depth * strength),
    )


@OUTSIDE.add("x-lost-counts", "sensor:motor_angle_rad")
def lost_counts(rng: np.random.Generator, machine: Machine) -> Effect:
    share, above = rng.uniform(0.01, 0.04), rng.uniform(8.0, 25.0)

    def at(strength: float) -> Applied:
        fault = Fault(lost_share=min(0.3, share * strength), lost_above_per_s=above)
        return Applied(
            description="the motor encoder loses counts above a speed",
            faults={"motor_angle_rad": fault},
        )

    return at


@OUTSIDE.add("x-fading-current", "sensor:current_A")
def fading_current(rng: np.random.Generator, machine: Machine) -> Effect:
    fade = rng.uniform(1.5, 3.0)
    return lambda strength: Applied(
        description="the current sensor's amplifier fades at large currents",
        faults={"current_A": Fault(fade=fade / math.sqrt(strength))},
    )


@OUTSIDE.add("x-load-magnet", "load")
def load_magnet(rng: np.random.Generator, machine: Machine) -> Effect:
    magnet, reach = rng.uniform(0.05, 0.15), rng.uniform(0.03, 0.08)
    angle = rng.uniform(0.08, 0.25) * rng.choice([-1.0, 1.0])
    return lambda strength: Applied(
        description="a magnet beside the link draws it in",
        physics={
            "magnet_Nm": magnet * strength,
            "magnet_angle_rad": angle,
            "magnet_reach_rad": reach,
        },
    )
