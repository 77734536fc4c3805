"""The actuator as URDF: two joints about one axis, wheel and load, with damping and friction.

URDF has no springs and no motors: what it cannot hold is listed, with its number. The wheel carries
the rotor behind the gear as inertia without mass. Source: URDF
specification (link/inertial, joint/dynamics, joint/limit, transmission).
"""

from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.errors import SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import spring_tangent_Nm_per_rad
from rsea_core.model.actuator_model import ActuatorModel, GRAVITY_m_per_s2

TINY_MASS_kg = 1e-6
LONGEST_ARM_m = 0.3


@dataclass(frozen=True, kw_only=True)
class UrdfModel:
    """A model's URDF text.

    Attributes
    ----------
    text : str
        Joints "wheel" and "load", links "base", "wheel" and "load".
    left_out : tuple of str
        What URDF cannot hold, a phrase each with its number.
    """

    text: str
    left_out: tuple[str, ...]


def to_urdf(model: ActuatorModel, load: Load = Load()) -> UrdfModel:  # noqa: B008
    """The actuator as URDF.

    Raises
    ------
    SimulationError
        If the machine has no load that moves by itself.
    RigError, TermError
        If the model cannot be simulated.
    """
    command = "duty" if model.rig.supply_voltage_V else "current_command_A"
    plant, spring = model.plant(command, load), model.spring_table(load)
    if plant.structure != mp.ELASTIC_FREE:
        raise SimulationError(
            f"URDF needs a spring between wheel and load and a load of its own motion: rig"
            f" {model.rig.name!r} has none"
        )
    fx = model.effects(command, load)
    mass, arm, about_centre = TINY_MASS_kg, 0.0, plant.load_inertia
    if plant.gravity > 0.0:  # a point mass one arm away, as far out as gravity and inertia allow
        arm = min(0.999 * plant.load_inertia * GRAVITY_m_per_s2 / plant.gravity, LONGEST_ARM_m)
        mass = plant.gravity / (GRAVITY_m_per_s2 * arm)
        about_centre = plant.load_inertia - mass * arm * arm
    x, z = arm * np.sin(plant.gravity_offset), -arm * np.cos(plant.gravity_offset)
    gear_friction = 0.5 * (fx[e.GEAR_FORWARD] + fx[e.GEAR_BACKWARD])
    most = plant.torque_per_ampere * plant.current_limit
    limit = most if np.isfinite(most) else 0.0
    lines = [
        '<?xml version="1.0"?>',
        f"<robot name={quoteattr(model.rig.name)}>",
        '  <link name="base"/>',
        *_link("wheel", TINY_MASS_kg, 0.0, 0.0, plant.inertia),
        *_joint("wheel", "base", plant.damping, gear_friction, limit),
        *_link("load", mass, x, z, about_centre),
        *_joint("load", "base", plant.load_damping, fx[e.LOAD_COULOMB], 0.0),
        '  <transmission name="motor">',
        "    <type>transmission_interface/SimpleTransmission</type>",
        '    <joint name="wheel"><hardwareInterface>hardware_interface/EffortJointInterface'
        "</hardwareInterface></joint>",
        '    <actuator name="motor"><mechanicalReduction>'
        f"{_n(plant.gear_ratio)}</mechanicalReduction></actuator>",
        "  </transmission>",
        "</robot>",
    ]
    tangent = float(spring_tangent_Nm_per_rad(spring, 0.0))
    left = [
        f"the spring between wheel and load: {tangent:.6g} Nm/rad, to be applied by the simulator",
        "the motor's winding: the joint's effort is the torque behind the gear",
    ]
    if fx[e.GEAR_FORWARD] != fx[e.GEAR_BACKWARD]:
        left.append("the direction of gear friction: both directions have the mean")
    left += [f"effect {term.key} beyond a Coulomb level of dry friction" for term in model.terms]
    return UrdfModel(text="\n".join(lines) + "\n", left_out=tuple(left))


def _link(name: str, mass: float, x: float, z: float, inertia: float) -> list[str]:
    about = " ".join(f'{k}="{_n(inertia)}"' for k in ("ixx", "iyy", "izz"))
    return [
        f'  <link name="{name}"><inertial><origin xyz="{_n(x)} 0 {_n(z)}"/>',
        f'    <mass value="{_n(mass)}"/><inertia {about} ixy="0" ixz="0" iyz="0"/>',
        "  </inertial></link>",
    ]


def _joint(name: str, parent: str, damping: float, friction: float, effort: float) -> list[str]:
    kind = "continuous"
    limit = f'<limit effort="{_n(effort)}" velocity="1e9"/>' if effort > 0.0 else ""
    return [
        f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>',
        f'    <axis xyz="0 -1 0"/><dynamics damping="{_n(damping)}" friction="{_n(friction)}"/>'
        f"{limit}",
        "  </joint>",
    ]


def _n(value: float) -> str:
    return repr(float(value))
