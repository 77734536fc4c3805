"""A linear axis of known mass and drag, driven by a force in proportion to its current."""

from rsea_core.machine.rig import Rig

MASS, DRAG, FORCE = 95.0, 200.0, 35.0  # kg, N s/m, N/A
AXIS = Rig(
    name="axis",
    axis="linear",
    parts=("drive", "gear", "load"),
    gear_ratio=1.0,
    torque_constant_Nm_per_A=FORCE,
    current_limit_A=10.0,
    motor_inertia_kgm2=0.0,
    output_inertia_kgm2=0.0,
    load_inertia_kgm2=MASS,
    load_viscous_Nms_per_rad=DRAG,
    load_encoder_counts_per_rev=60_000_000,  # 0.1 um
)
