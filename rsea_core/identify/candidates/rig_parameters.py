"""The nominal values that a fit may always move, each with its tolerance as prior.

Never a scale of everything at once: the bridge's supply and the sensors are trusted to their
tolerances, so that ratios have an anchor. What the owner trusts (`[anchor]`) does not move.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rsea_core.effects.variant import PLANT, TrialMachine
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.plant import RIGID_FREE
from rsea_core.machine.rig import Rig
from rsea_core.machine.tolerances import TOLERANCES
from rsea_core.recordings.case import Case

ANGLES = ("gravity_angle_offset_rad", "contact_angle_rad")
FIELD = {
    "terminal_resistance_ohm": "resistance",
    "terminal_inductance_H": "inductance",
    "torque_constant_Nm_per_A": "torque_per_ampere",
    "back_emf_constant_Vs_per_rad": "volts_per_speed",
    "load_mass_kg": "gravity",
    "load_inertia_kgm2": "load_inertia",
    "contact_stiffness_Nm_per_rad": "contact_stiffness",
    "contact_damping_Nms_per_rad": "contact_damping",
}
SERVO_FIELD = {
    "servo_proportional_Nm_per_rad": "volts_per_command",
    "servo_derivative_Nms_per_rad": "volts_per_speed",
    "servo_torque_limit_Nm": "current_limit",
    "servo_dead_band_rad": "goal_dead_band",
}
DISTANCE = 0.01  # relative, of the load's centre from the joint: three millimetres in thirty cm
ONE_BODY = (  # before and behind the gear: only their sum is seen
    ("motor_inertia_kgm2", "output_inertia_kgm2"),
    ("motor_viscous_Nms_per_rad", "output_viscous_Nms_per_rad"),
)
PARTNER = {own: other for pair in ONE_BODY for own, other in (pair, pair[::-1])}
DAMPINGS = (*ONE_BODY[1], "load_viscous_Nms_per_rad")
LITTLE = 0.02  # damping of a machine whose file names none: this share of what its motion needs
UNKNOWN_INERTIA = 1.0  # of the logarithm: a rigid train's inertia of which a part is left out
UNKNOWN = 5.0  # times as much where the file leaves the damping out


@dataclass(frozen=True, kw_only=True)
class Nominal:
    """One nominal value that may move.

    Attributes
    ----------
    value : float
        What the rig says.
    tolerance : float
        Of the logarithm; of the value where `additive`.
    """

    key: str
    value: float
    tolerance: float
    additive: bool = False

    def at(self, x: float) -> float:
        """The value x tolerances away."""
        if self.additive:
            return self.value + self.tolerance * x
        return self.value * float(np.exp(self.tolerance * x))


def place_of(key: str) -> str:
    """Part of the machine that a value of the rig file describes."""
    first = key.split("_")[0]
    places = {"load": "load", "gravity": "load", "contact": "environment", "spring": "spring",
              "motor": "gear", "output": "gear", "gear": "gear"}  # fmt: skip
    return places.get(first, "drive")


def nominals(case: Case) -> tuple[Nominal, ...]:
    """The nominal values that these recordings and this machine have."""
    rig, stated = case.rig, dict(case.rig.tolerances)
    kinds = {r.load.kind for r in case.identification}
    commands = {r.command_name for r in case.identification}
    keys = _drive_keys(commands)
    if rig.has("gear"):
        inertia, damping = ONE_BODY
        keys += [_less_certain(rig, inertia), _less_certain(rig, damping)]
        one_body = not rig.has("spring") and rig.load_viscous_Nms_per_rad is not None
        if keys[-1] is None and not one_body:  # absent is unknown, not none
            keys.append(damping[0])
        keys += _damping_left_out(rig, keys)
    if rig.has("spring"):
        keys.append("spring_stiffness_Nm_per_rad")
    if rig.has("load") and kinds - {"locked", "imposed"}:
        keys += ["load_inertia_kgm2", "load_viscous_Nms_per_rad"]
        if kinds & {"pendulum", "contact"} and rig.load_mass_kg and rig.load_distance_m:
            keys += ["load_mass_kg", "gravity_angle_offset_rad"]
    found = []
    for key in filter(None, keys):
        value = getattr(rig, key)
        tolerance = 0.0 if key in rig.anchors else stated.get(key, TOLERANCES[key])
        if key == "load_mass_kg" and "load_distance_m" not in rig.anchors:
            tolerance = float(np.hypot(tolerance, stated.get("load_distance_m", 0.0)))
        if tolerance == 0.0:
            continue
        if _shares_unstated_inertia(key, rig):
            tolerance = float(np.hypot(tolerance, UNKNOWN_INERTIA))
        if key == "load_viscous_Nms_per_rad" and value:
            tolerance = float(np.hypot(tolerance, np.log1p(_unstated_damping_std(rig) / value)))
        if key in ANGLES:
            found.append(Nominal(key=key, value=value or 0.0, tolerance=tolerance, additive=True))
        elif value:
            found.append(Nominal(key=key, value=value, tolerance=tolerance))
        elif not value and key.endswith("viscous_Nms_per_rad"):
            little = _little(rig, key) * (UNKNOWN if value is None else 1.0)
            found.append(Nominal(key=key, value=0.0, tolerance=little, additive=True))
    for r in case.identification:
        if r.load.kind == "contact":
            for key in ("contact_stiffness_Nm_per_rad", "contact_damping_Nms_per_rad"):
                value = getattr(r.load, key)
                if value:
                    found.append(Nominal(key=key, value=value, tolerance=TOLERANCES[key]))
            key = "contact_angle_rad"
            found.append(
                Nominal(
                    key=key, value=r.load.contact_angle_rad, tolerance=TOLERANCES[key],
                    additive=True,
                )
            )  # fmt: skip
            break
    return tuple(found)


def _damping_left_out(rig: Rig, keys: list) -> list[str]:
    """Dampings that the file does not state of a body that it states: unknown, not none."""
    bodies = (("motor_inertia_kgm2", "motor_viscous_Nms_per_rad"),
              ("output_inertia_kgm2", "output_viscous_Nms_per_rad"))  # fmt: skip
    return [
        damping for inertia, damping in bodies
        if getattr(rig, inertia) and getattr(rig, damping) is None and damping not in keys
    ] if rig.has("spring") else []  # fmt: skip


def _shares_unstated_inertia(key: str, rig: Rig) -> bool:
    """Whether a value is an inertia of a rigid train of which the file leaves another one out."""
    if not rig.has("gear") or not rig.has("load") or rig.has("spring"):
        return False
    if key in ONE_BODY[0]:
        return not rig.load_inertia_kgm2
    return key == "load_inertia_kgm2" and not any(getattr(rig, k) for k in ONE_BODY[0])


def _unstated_damping_std(rig: Rig) -> float:
    """Standard deviation, at the load, of a motor damping that a rigid train's file leaves out.

    Only its sum with the load's damping is identifiable: it widens the prior of the latter.
    """
    _, damping = ONE_BODY
    stated = any(getattr(rig, key) is not None for key in damping)
    if rig.has("spring") or not rig.has("gear") or stated or not rig.motor_inertia_kgm2:
        return 0.0
    return UNKNOWN * _little(rig, damping[0]) * (rig.gear_ratio or 1.0) ** 2


def _drive_keys(commands: set) -> list[str]:
    """The values of a drive that act under these commands."""
    keys = []
    electric = bool(commands & {"duty", "voltage_V"})
    if "duty" in commands:
        keys.append("supply_voltage_V")
    if electric:
        keys += ["terminal_resistance_ohm", "back_emf_constant_Vs_per_rad"]
        # held at a wrong value it would set the scale of voltage, resistance and back-EMF
        keys.append("terminal_inductance_H")
    if electric or commands & {"current_command_A", "current_A"}:
        keys.append("torque_constant_Nm_per_A")
    return keys + (list(SERVO_FIELD) if POSITION_COMMAND in commands else [])


def _less_certain(rig: Rig, keys: tuple[str, str]) -> str | None:
    """Of the values before and behind the gear the one that may err by more, seen at the output.

    The other is held. It alone could not take up their sum's error: neither falls below zero.
    """
    if all(getattr(rig, key) is None for key in keys):
        return None
    return max(keys, key=lambda key: _std(rig, key) * _at_output(rig, key))


def _std(rig: Rig, key: str) -> float:
    """Standard deviation of a value by its tolerance, in its unit."""
    return dict(rig.tolerances).get(key, TOLERANCES[key]) * (getattr(rig, key) or 0.0)


def _at_output(rig: Rig, key: str) -> float:
    """Inertia or damping at the output by one at its own side of the gear."""
    return (rig.gear_ratio or 1.0) ** 2 if key.startswith("motor") else 1.0


def _little(rig: Rig, key: str) -> float:
    """A damping worth trying where the rig says zero, from the drive's own damping."""
    N = rig.gear_ratio or 1.0
    k_t = rig.torque_constant_Nm_per_A or 0.0
    k_e = rig.back_emf_constant_Vs_per_rad or k_t
    electric = k_t * k_e / (rig.terminal_resistance_ohm or 1.0)
    motor = key.startswith("motor")
    if electric == 0.0 or key.startswith("load"):
        inertia = (rig.load_inertia_kgm2 or 0.0) or (rig.motor_inertia_kgm2 or 0.0) * N**2
        return LITTLE * 10.0 * max(inertia, 1e-6) / (N**2 if motor else 1.0)
    return LITTLE * electric * (1.0 if motor else N**2)


def unstated_std(rig: Rig, key: str) -> float:
    """Standard deviation of a value from what is held fixed beside it and acts as one with it.

    Inertia and damping of the wheel are one with the motor's: the less certain take the errors of
    both; of mass and distance of the load only the product is seen, and the mass takes it.
    """
    if key == "load_mass_kg":
        if not rig.load_mass_kg or "load_distance_m" in rig.anchors:
            return 0.0
        return dict(rig.tolerances).get("load_distance_m", DISTANCE) * rig.load_mass_kg
    if key not in PARTNER:
        return 0.0
    other = PARTNER[key]
    return _std(rig, other) * _at_output(rig, other) / _at_output(rig, key)


def held_jointly(rig: Rig, key: str) -> float:
    """What is held fixed beside a value and acts as one with it, in its unit, on its side."""
    if key not in PARTNER:
        return 0.0
    other = PARTNER[key]
    return (getattr(rig, other) or 0.0) * _at_output(rig, other) / _at_output(rig, key)


def write_nominal(
    values: Mapping[str, float], base: Mapping[str, float], d: TrialMachine, rig: Rig
) -> None:
    """Put nominal values into a machine's numbers; `base` are the rig's own."""
    plant = d.plant
    N2 = (rig.gear_ratio or 1.0) ** 2
    for key, value in values.items():
        change = value - base[key]
        if key == "supply_voltage_V":
            plant[PLANT["volts_per_command"]] = value
        elif key in SERVO_FIELD:
            plant[PLANT[SERVO_FIELD[key]]] = value
        elif key == "spring_stiffness_Nm_per_rad":
            d.stiffness = value
        elif key == "gravity_angle_offset_rad":
            plant[PLANT["gravity_offset"]] = value
        elif key == "contact_angle_rad":
            if np.isfinite(plant[PLANT["contact_angle"]]):
                plant[PLANT["contact_angle"]] += change
        elif key == "motor_inertia_kgm2":
            plant[PLANT["inertia"]] += N2 * change
        elif key == "output_inertia_kgm2":
            plant[PLANT["inertia"]] += change
        elif key == "motor_viscous_Nms_per_rad":
            plant[PLANT["damping"]] = max(plant[PLANT["damping"]] + N2 * change, 0.0)
        elif key == "output_viscous_Nms_per_rad":
            plant[PLANT["damping"]] = max(plant[PLANT["damping"]] + change, 0.0)
        elif key == "load_viscous_Nms_per_rad":
            if plant[PLANT["load_inertia"]] > 0.0 or plant[PLANT["structure"]] == RIGID_FREE:
                plant[PLANT["load_damping"]] = max(value, 0.0)
        else:
            plant[PLANT[FIELD[key]]] *= value / base[key]
    if plant[PLANT["goal_rate_s"]] > 0.0:
        lead = plant[PLANT["volts_per_speed"]] / plant[PLANT["volts_per_command"]]
        plant[PLANT["goal_rate_s"]] = lead
