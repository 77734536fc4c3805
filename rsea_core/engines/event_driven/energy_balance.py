"""From the log of the compiled loop to energies and to what only some terms have."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.memory as m
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.effects.gear_transmission_error import array_angle_error
from rsea_core.effects.registry import DriveThermal, Term
from rsea_core.engines.event_driven.energy_ledger import EnergyLedger
from rsea_core.machine.spring_table import SpringTable, spring_energy_J
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.uniform_spline import spline_integral


def one_less_cosine(angle: NDArray) -> NDArray:
    """1 - cos, with all its digits at small angles too [rad]."""
    return 2.0 * np.sin(0.5 * angle) ** 2


def stored_J(fx, wheel, load):
    """Energy that terms store [J] for arrays of wheel and load angle [rad]."""
    stored = 0.5 * fx[e.PARALLEL] * (load - fx[e.PARALLEL_REST]) ** 2
    stored = stored + fx[e.GEAR_OFFSET] * wheel
    stored = stored + fx[e.UNBALANCE] * one_less_cosine(load + fx[e.UNBALANCE_ANGLE])
    for wave in e.COGGING_WAVES:
        if fx[wave] != 0.0:
            angle = fx[wave + 1] * wheel + fx[wave + 2]
            stored = stored + fx[wave] / fx[wave + 1] * one_less_cosine(angle)
    if fx[e.POSITION_STEP] != 0.0:
        u = (np.asarray(load) - fx[e.POSITION_FIRST]) / fx[e.POSITION_STEP]
        for j in range(e.N_POSITIONS):
            node = fx[e.POSITION_TORQUE + j] * fx[e.POSITION_STEP]
            stored = stored - node * spline_integral(u - j)
    return stored


def contact_stored_J(fx, stiffness, depth):
    """Energy stored in a contact [J] for an array of depths [rad], none below zero."""
    if fx[e.EXPONENT] == 0.0:
        return 0.5 * stiffness * depth**2
    p, reference = fx[e.EXPONENT], fx[e.DEPTH]
    return stiffness * reference**2 * (depth / reference) ** (p + 1.0) / (p + 1.0)


def energy_ledger(
    plant: mp.Plant, spring: SpringTable, fx: NDArray, log: NDArray, memory: NDArray
) -> EnergyLedger:
    """The energies of a run, from its log (n, N_LOG) and memory ((n or 0), N_Y)."""

    def integral(index: int) -> NDArray:
        return read_only(np.ascontiguousarray(log[:, k.LOG_INTEGRALS + index]))

    current, motor, motor_speed, load, load_speed = log[:, : k.N_STATES].T
    winding = plant.inductance if plant.drive in (mp.DUTY, mp.VOLTAGE) else 0.0
    wheel, kinetic, stored, impact = motor, 0.0, stored_J(fx, motor, load), 0.0 * motor
    if memory.shape[0] > 0:
        impact = memory[:, k.IMPACT]
        kinetic = 0.5 * fx[e.LINK_INERTIA] * memory[:, k.WO] ** 2
        if fx[e.BACKLASH] > 0.0:
            wheel = memory[:, k.TB]
            behind = fx[e.BACKLASH_INERTIA]
            kinetic = kinetic + 0.5 * behind * (memory[:, k.WB] ** 2 - motor_speed**2)
    deflection = wheel + array_angle_error(fx, wheel, plant.gear_ratio) - load
    if memory.shape[0] > 0:
        stored = stored + _remembered_J(fx, memory, deflection)
    beyond = np.zeros(load.size)
    if np.isfinite(plant.contact_angle):
        beyond = np.maximum(load - plant.contact_angle, 0.0)
    kinetic = kinetic + 0.5 * plant.inertia * motor_speed**2
    return EnergyLedger(
        supplied_J=integral(k.SUPPLIED),
        load_work_J=integral(k.LOAD_WORK),
        constant_mismatch_J=integral(k.MISMATCH),
        joule_J=integral(k.JOULE),
        drive_viscous_J=integral(k.DRIVE_VISCOUS),
        load_viscous_J=integral(k.LOAD_VISCOUS),
        contact_loss_J=integral(k.CONTACT_LOSS),
        gear_friction_J=integral(k.GEAR_FRICTION),
        load_friction_J=integral(k.LOAD_FRICTION),
        drag_J=integral(k.DRAG_LOSS),
        spring_loss_J=integral(k.SPRING_LOSS),
        link_loss_J=integral(k.LINK_LOSS),
        impact_loss_J=read_only(np.array(impact)),
        magnetic_J=read_only(0.5 * winding * current**2),
        kinetic_J=read_only(kinetic + 0.5 * plant.load_inertia * load_speed**2),
        elastic_J=read_only(spring_energy_J(spring, deflection)),
        gravity_J=read_only(plant.gravity * one_less_cosine(load + plant.gravity_offset)),
        contact_elastic_J=read_only(contact_stored_J(fx, plant.contact_stiffness, beyond)),
        terms_J=read_only(stored),
    )


def _remembered_J(fx: NDArray, memory: NDArray, deflection: NDArray) -> NDArray:
    """Energy [J] in stop operators, Bouc-Wen stretch, Maxwell branches and link, (n,) array."""
    stored = 0.5 * fx[e.BOUC_WEN] * memory[:, k.BW] ** 2
    for i in range(e.N_BRANCHES):
        stored = stored + 0.5 * fx[e.BRANCH_STIFFNESS + i] * memory[:, k.BRANCH + i] ** 2
    if fx[e.LINK_STIFFNESS] > 0.0:
        twist = memory[:, k.TL] - memory[:, k.TO]
        stored = stored + 0.5 * fx[e.LINK_STIFFNESS] * twist**2
    for i in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + i] > 0.0:
            z = _stretch(memory, i, deflection, fx[e.SLIP_YIELD + i])
            stored = stored + 0.5 * fx[e.SLIP_STIFFNESS + i] * z**2
    if fx[e.GEAR_PRESLIDING] > 0.0:
        z = memory[:, k.GEAR_BENT]
        if fx[e.GEAR_BRISTLE] == 0.0:
            z = _stretch(memory, m.GEAR_STOP, memory[:, k.TW], fx[e.GEAR_PRESLIDING])
        level = np.where(z > 0.0, fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]) * (1 + fx[e.GEAR_RISE])
        stored = stored + 0.5 * level / fx[e.GEAR_PRESLIDING] * z**2
    if fx[e.LOAD_PRESLIDING] > 0.0:
        z = memory[:, k.LOAD_BENT]
        if fx[e.LOAD_BRISTLE] == 0.0:
            z = _stretch(memory, m.LOAD_STOP, memory[:, k.TL], fx[e.LOAD_PRESLIDING])
        level = fx[e.LOAD_COULOMB] * (1.0 + fx[e.LOAD_RISE])
        stored = stored + 0.5 * level / fx[e.LOAD_PRESLIDING] * z**2
    return stored


def _stretch(memory: NDArray, stop: int, coordinate: NDArray, limit: float) -> NDArray:
    way = memory[:, k.WAY + stop]
    return np.where(way == 0.0, coordinate - memory[:, k.ANCHOR + stop], way * limit)


def memory_signals(fx: NDArray, memory: NDArray, terms: Iterable[Term]) -> dict[str, NDArray]:
    """Columns of a run that its terms add or change: the wheel behind a play, heat, the link."""
    found = {}
    if memory.shape[0] == 0:
        return found
    if fx[e.BACKLASH] > 0.0:
        found["wheel_angle_rad"] = read_only(memory[:, k.TB].copy())
        found["wheel_velocity_rad_per_s"] = read_only(memory[:, k.WB].copy())
    if fx[e.LINK_STIFFNESS] > 0.0:
        found["link_angle_rad"] = read_only(memory[:, k.TO].copy())
        found["link_velocity_rad_per_s"] = read_only(memory[:, k.WO].copy())
    for term in terms:
        if isinstance(term, DriveThermal):
            found["winding_temperature_C"] = read_only(memory[:, k.WINDING] + term.ambient_C)
            found["case_temperature_C"] = read_only(memory[:, k.CASE] + term.ambient_C)
    return found
