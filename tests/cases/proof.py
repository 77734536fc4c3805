"""A bare true machine for the tests of the proof's simulator."""

import numpy as np

from dftfs.proof.machine import InternalStates, Machine, Physics, Series
from dftfs.proof.truth import Drive, Motion, Start, move

BARE = Machine(
    supply_voltage_V=48.0,
    terminal_resistance_ohm=3.78,
    terminal_inductance_H=4.56e-3,
    torque_constant_Nm_per_A=0.3056,
    back_emf_constant_Vs_per_rad=0.3056,
    current_limit_A=6.06,
    motor_inertia_kgm2=3.2e-4,
    motor_viscous_Nms_per_rad=1e-4,
    gear_ratio=60.0,
    output_inertia_kgm2=2e-3,
    output_viscous_Nms_per_rad=0.02,
    spring_stiffness_Nm_per_rad=65.8,
    load_mass_kg=0.3,
    load_distance_m=0.3,
    load_inertia_kgm2=0.03,
    load_viscous_Nms_per_rad=0.02,
    gravity_angle_offset_rad=0.0,
    contact_stiffness_Nm_per_rad=200.0,
    contact_angle_rad=0.1,
    contact_damping_Nms_per_rad=0.5,
)
LOSSLESS = BARE._replace(
    motor_viscous_Nms_per_rad=0.0, output_viscous_Nms_per_rad=0.0, load_viscous_Nms_per_rad=0.0
)


def run(
    machine: Machine,
    load: str,
    command: np.ndarray | float,
    *,
    physics: Physics | None = None,
    series: Series | None = None,
    seconds: float = 1.0,
    by_current: bool = False,
    outside_Nm: float = 0.0,
    load_angle_rad: float = 0.0,
    motor_angle_rad: float = 0.0,
    step_s: float = 20e-6,
) -> Motion:
    """A recording of 1 ms samples under a constant or given command."""
    count = round(seconds / 1e-3)
    values = np.full(count, command) if np.isscalar(command) else np.asarray(command)
    return move(
        machine,
        physics or Physics(),
        series or Series(),
        load,
        Drive(
            interval_s=1e-3,
            command=values,
            by_current=by_current,
            outside_Nm=np.full(values.size, outside_Nm),
        ),
        Start(
            load_angle_rad=load_angle_rad,
            motor_angle_rad=motor_angle_rad,
            internal=InternalStates(),
        ),
        step_s=step_s,
    )
