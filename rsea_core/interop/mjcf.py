"""The actuator as MuJoCo's model text (MJCF): motor, gear, spring, link and dry friction.

The motor is a `dcmotor` with its inductance behind the gear, the wheel and the load are two hinges
about one axis, the spring is a fixed tendon on their difference, Coulomb friction is
`frictionloss` with the stiffest settings that stay stable at the step. MuJoCo's friction is a
soft constraint: a joint that should stick creeps, here by about 1e-5 rad in 10 s.

Source: MuJoCo documentation, XML reference (actuator/dcmotor, tendon/fixed, joint/frictionloss).
"""

from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.effects.registry import Port
from rsea_core.errors import SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import C1, SpringTable, spring_tangent_Nm_per_rad
from rsea_core.model.actuator_model import ActuatorModel, GRAVITY_m_per_s2

CARRIED = frozenset(
    (
        "any",
        "wheel_dry",
        "gear_coulomb_forward",
        "gear_coulomb_backward",
        "gear_stribeck_velocity",
        "load_dry",
        "load_coulomb",
        "load_stribeck_velocity",
        "parallel_stiffness",
        "parallel_rest_angle",
    )
)
"""The numbers of `effects` that the text carries in full."""
AXIS = "0 -1 0"  # a positive angle swings the hanging link towards +x


@dataclass(frozen=True, kw_only=True)
class MjcfModel:
    """A model's MJCF text.

    Attributes
    ----------
    text : str
        Joints "wheel" and "load", tendon "spring", actuator "motor" whose control is in volts
        (or A, or Nm at the motor where that drives).
    control_per_command : float
        What one unit of the command is on the actuator: a duty times the supply's volts.
    left_out : tuple of str
        What MJCF cannot carry, a sentence each.
    """

    text: str
    control_per_command: float
    left_out: tuple[str, ...]


def to_mjcf(
    model: ActuatorModel,
    load: Load = Load(),  # noqa: B008
    *,
    command_name: str = "duty",
    step_s: float = 1e-3,
) -> MjcfModel:
    """The actuator as MJCF.

    Parameters
    ----------
    load : Load
        "pendulum", "free", "locked" or "constant-torque"; the wall of "contact" is left out.
    command_name : str
        What the actuator's control is.
    step_s : float
        MuJoCo's time step; the stiffness of dry friction follows it.

    Raises
    ------
    SimulationError
        If wheel and load are one body, or the load's motion is imposed.
    RigError, TermError
        If the model cannot be simulated for this drive and load.
    """
    plant, spring = model.plant(command_name, load), model.spring_table(load)
    fx = model.effects(command_name, load)
    if plant.structure not in (mp.ELASTIC_FREE, mp.ELASTIC_HELD) or load.kind == "imposed":
        raise SimulationError(
            f"MJCF needs a spring between wheel and load and a load of its own motion, not the"
            f" load {load.kind!r} on rig {model.rig.name!r}"
        )
    held = plant.structure == mp.ELASTIC_HELD
    tangent = float(spring_tangent_Nm_per_rad(spring, 0.0))
    gear_level = 0.5 * (fx[e.GEAR_FORWARD] + fx[e.GEAR_BACKWARD])
    lines = [
        f"<mujoco model={quoteattr(model.rig.name)}>",
        f'  <option timestep="{_n(step_s)}" gravity="0 0 {_n(-GRAVITY_m_per_s2)}"'
        ' integrator="implicitfast"><flag contact="disable"/></option>',
        "  <worldbody>",
        '    <body name="wheel">',
        '      <inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>',
        f'      <joint name="wheel" type="hinge" axis="{AXIS}" armature="{_n(plant.inertia)}"'
        f' damping="{_n(plant.damping)}"{_friction(gear_level, step_s)}/>',
        '      <geom type="cylinder" size="0.06 0.01" euler="90 0 0" rgba=".6 .6 .65 1" mass="0"/>',
        "    </body>",
        *_link(plant, held, fx, step_s),
        "  </worldbody>",
        f'  <tendon><fixed name="spring" stiffness="{_n(tangent)}" springlength="0">',
        '    <joint joint="wheel" coef="1"/>'
        + ("" if held else '<joint joint="load" coef="-1"/>')
        + "</fixed></tendon>",
        f"  <actuator>{_actuator(plant)}</actuator>",
        "</mujoco>",
    ]
    return MjcfModel(
        text="\n".join(lines) + "\n",
        control_per_command=plant.volts_per_command,
        left_out=_left_out(model, plant, spring, fx, load),
    )


def _link(plant: mp.Plant, held: bool, fx, step_s: float) -> list[str]:
    if held:
        return []
    # the mass as a point one arm away, as far out as gravity and inertia allow
    mass, arm, about_centre = 1e-6, 0.0, plant.load_inertia
    if plant.gravity > 0.0:
        arm = 0.999 * plant.load_inertia * GRAVITY_m_per_s2 / plant.gravity
        arm = min(arm, 0.3)
        mass = plant.gravity / (GRAVITY_m_per_s2 * arm)
        about_centre = plant.load_inertia - mass * arm * arm
    x, z = arm * np.sin(plant.gravity_offset), -arm * np.cos(plant.gravity_offset)
    inertia = " ".join([_n(about_centre)] * 3)
    parallel = ""
    if fx[e.PARALLEL] > 0.0:
        parallel = f' stiffness="{_n(fx[e.PARALLEL])}" springref="{_n(fx[e.PARALLEL_REST])}"'
    return [
        '    <body name="load">',
        f'      <inertial pos="{_n(x)} 0 {_n(z)}" mass="{_n(mass)}" diaginertia="{inertia}"/>',
        f'      <joint name="load" type="hinge" axis="{AXIS}" damping="{_n(plant.load_damping)}"'
        f"{parallel}{_friction(fx[e.LOAD_COULOMB], step_s)}/>",
        f'      <geom type="capsule" size="0.01" fromto="0 0 0 {_n(x)} 0 {_n(z or -0.1)}"'
        ' rgba=".2 .5 .7 1" mass="0"/>',
        "    </body>",
    ]


def _friction(level: float, step_s: float) -> str:
    if level == 0.0:
        return ""
    return (
        f' frictionloss="{_n(level)}" solreffriction="{_n(2.0 * step_s)} 1"'
        ' solimpfriction="0.999 0.9999 0.001"'
    )


def _actuator(plant: mp.Plant) -> str:
    if plant.drive == mp.MOTOR_TORQUE:
        gear = plant.torque_per_motor_torque
        return f'<motor name="motor" joint="wheel" gear="{_n(gear)}"/>'
    if plant.drive == mp.CURRENT:
        limit = ""
        if np.isfinite(plant.current_limit):
            limit = f' ctrllimited="true" ctrlrange="{_n(-plant.current_limit)} '
            limit += f'{_n(plant.current_limit)}"'
        return f'<motor name="motor" joint="wheel" gear="{_n(plant.torque_per_ampere)}"{limit}/>'
    constant = plant.torque_per_ampere / plant.gear_ratio
    inductance = f' inductance="{_n(plant.inductance)}"' if plant.inductance > 0.0 else ""
    return (
        f'<dcmotor name="motor" joint="wheel" gear="{_n(plant.gear_ratio)}"'
        f' motorconst="{_n(constant)}" resistance="{_n(plant.resistance)}"{inductance}/>'
    )


def _left_out(
    model: ActuatorModel, plant: mp.Plant, spring: SpringTable, fx, load: Load
) -> tuple[str, ...]:
    found = []
    if np.ptp(spring.regions[:, C1]) > 0.0 or np.any(spring.regions[:, C1 + 1 :] != 0.0):
        found.append("the spring's curve: replaced by its tangent at zero")
    forward, backward = fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]
    if forward != backward:
        found.append("the direction of gear friction: both directions have the mean")
    others = [e.EFFECTS[i] for i in np.flatnonzero(fx) if e.EFFECTS[i] not in CARRIED]
    if others:
        found.append(f"effects: {', '.join(others)}")
    if fx[e.WHEEL_DRY] != 0.0 or fx[e.LOAD_DRY] != 0.0:
        found.append("exact sticking: MuJoCo's friction creeps a little at rest")
    voltage = plant.drive in (mp.DUTY, mp.VOLTAGE)
    if voltage and np.isfinite(plant.current_limit):
        found.append(f"the current limit of {plant.current_limit:g} A")
    if voltage and plant.torque_per_ampere != plant.volts_per_speed:
        found.append("a back-EMF constant other than the torque constant")
    if load.kind == "contact":
        found.append("the contact's spring and damper")
    if plant.load_torque != 0.0:
        found.append(f"the load torque of {plant.load_torque:g} Nm: apply it as qfrc_applied")
    counted = (plant.motor_count, plant.load_count)
    sensors = [term.key for term in model.terms if term.port is Port.SENSOR]
    if sensors:
        found.append(f"what sensors misread: {', '.join(sensors)}")
    if any(counted):
        found.append("encoder counts: MuJoCo's readings are exact")
    return tuple(found)


def _n(value: float) -> str:
    return repr(float(value))
