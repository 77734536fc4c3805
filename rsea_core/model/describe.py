"""The equations of a model in words: what `ActuatorModel.describe` prints."""

import math
from collections.abc import Iterable

import rsea_core.machine.plant as mp
from rsea_core.effects.base import Term
from rsea_core.machine.inputs import Load
from rsea_core.machine.plant import Plant
from rsea_core.machine.rig import QUANTITIES, Rig

LEFT_OUT = {
    "back_emf_constant_Vs_per_rad": "where a current drives, taken equal to the torque constant",
    "terminal_inductance_H": "the current follows the voltage at once",
    "current_limit_A": "the current is not limited",
    "output_inertia_kgm2": "taken as zero",
    "motor_viscous_Nms_per_rad": "taken as zero",
    "output_viscous_Nms_per_rad": "taken as zero",
    "load_viscous_Nms_per_rad": "taken as zero",
    "gravity_angle_offset_rad": "taken as zero",
    "motor_encoder_counts_per_rev": "a controller reads the angle exactly",
    "load_encoder_counts_per_rev": "a controller reads the angle exactly",
}


def describe(
    rig: Rig, terms: Iterable[Term], plant: Plant, command_name: str | None, load: Load
) -> str:
    """Equations, values with units and sources, and what is left out; lines of plain text."""
    terms = tuple(terms)
    unit_note = " (linear axis: rad stands for m, Nm for N)" if rig.axis == "linear" else ""
    lines = [f"rig {rig.name}: {', '.join(rig.parts)}; load {load.kind}{unit_note}", ""]
    lines += [f"  {line}" for line in (*_drive(plant, command_name), *_mechanics(plant, load))]
    lines += ["", f"values (source: rig {rig.name} unless said)"]
    lines += [
        f"  {key} = {getattr(rig, key):g} {info['unit']}"
        for key, info in QUANTITIES.items()
        if getattr(rig, key) is not None
    ]
    lines += [f"  {name} = {value:g} {unit}" for name, value, unit in _derived(plant)]
    for term in terms:
        lines.append(f"term {term.effect} at {term.port.value[0]}: {term.equation()}")
        if term.replaces is not None:
            lines.append(f"  in place of {term.replaces}")
        for name, p in term.parameters().items():
            lines.append(f"  {name} = {p.value:g} {p.unit} in {list(p.bounds)} ({p.source})")
            lines.append(f"    {p.meaning}")
    absent = [(key, why) for key, why in LEFT_OUT.items() if getattr(rig, key) is None]
    if absent:
        lines += ["not given in the rig", *(f"  {key}: {why}" for key, why in absent)]
    lines += [f"finding: {text}" for text in rig.findings()]
    return "\n".join(lines)


def _drive(plant: Plant, command_name: str | None) -> list[str]:
    if plant.drive == mp.NO_DRIVE:
        return []
    if plant.drive == mp.MOTOR_TORQUE:
        return ["tau_drive = N motor_torque"]
    if plant.drive == mp.POSITION:
        goal = f"{command_name}" + (" + (k_d/k_p) its rate" if plant.goal_rate_s > 0.0 else "")
        band = f",  e without {plant.goal_dead_band:g} rad" if plant.goal_dead_band > 0.0 else ""
        most = f",  |tau_drive| <= {plant.current_limit:g} Nm"
        limit = most if math.isfinite(plant.current_limit) else ""
        return [f"tau_drive = k_p e - k_d w_w,  e = {goal} - theta_w{band}{limit}"]
    if plant.drive == mp.CURRENT:
        return [f"tau_drive = N k_t i,  i = {command_name}{_limit(plant)}"]
    volts = "supply_voltage duty" if plant.drive == mp.DUTY else command_name
    law = f"L di/dt = {volts} - R i - k_e N w_w"
    if not plant.inductance > 0.0:
        law = f"i = ({volts} - k_e N w_w) / R"
    return ["tau_drive = N k_t i", law + _limit(plant)]


def _limit(plant: Plant) -> str:
    return f",  |i| <= {plant.current_limit:g} A" if math.isfinite(plant.current_limit) else ""


def _mechanics(plant: Plant, load: Load) -> list[str]:
    drive = "tau_drive" if plant.drive != mp.NO_DRIVE else "0"
    forces = _load_torques(plant)
    held = f"theta_l, w_l given ({load.kind})"
    if plant.structure == mp.RIGID_HELD:
        return [
            "theta_w = theta_l + constant (rigid)",
            held,
            "tau_s = tau_drive - B w_w - J dw_w/dt",
        ]
    if plant.structure == mp.RIGID_FREE:
        return [
            f"(J + J_l) dw/dt = {drive} - B w{forces},  wheel and link are one rigid body",
            "tau_s is the torque that the wheel passes to the link",
        ]
    moving = held if plant.structure == mp.ELASTIC_HELD else f"J_l dw_l/dt = tau_s{forces}"
    return [
        f"J dw_w/dt = {drive} - B w_w - tau_s",
        "tau_s = f(theta_w - theta_l)",
        moving,
        "theta_w = theta_m / N,  J = N^2 J_m + J_o,  B = N^2 B_m + B_o",
    ]


def _load_torques(plant: Plant) -> str:
    text = " - B_l w_l" if plant.load_damping > 0.0 else ""
    if plant.gravity > 0.0:
        text += " - m g d sin(theta_l + offset)"
    if plant.load_torque != 0.0:
        text += " + load_torque"
    if math.isfinite(plant.contact_angle):
        text += " - [K_e (theta_l - theta_e) + B_e w_l where theta_l > theta_e]"
    return text


def _derived(plant: Plant) -> list[tuple[str, float, str]]:
    found = [
        ("J at the output", plant.inertia, "kg m^2"),
        ("B at the output", plant.damping, "Nms/rad"),
    ]
    if plant.drive == mp.POSITION:
        found.append(("gain k_p of the servo", plant.volts_per_command, "Nm/rad"))
        found.append(("gain k_d of the servo", plant.volts_per_speed, "Nms/rad"))
    elif plant.resistance > 0.0:
        braking = plant.torque_per_ampere * plant.volts_per_speed / plant.resistance
        found.append(("back-EMF damping at the output N^2 k_t k_e / R", braking, "Nms/rad"))
    if plant.gravity > 0.0:
        found.append(("m g d", plant.gravity, "Nm"))
    if math.isfinite(plant.contact_angle):
        found += [
            ("contact K_e", plant.contact_stiffness, "Nm/rad"),
            ("contact B_e", plant.contact_damping, "Nms/rad"),
            ("contact theta_e", plant.contact_angle, "rad"),
        ]
    if plant.load_torque != 0.0:
        found.append(("load_torque", plant.load_torque, "Nm"))
    return found
