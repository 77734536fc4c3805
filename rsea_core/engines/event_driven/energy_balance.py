"""From the log of the compiled loop to energies and to what only some terms have."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.effects.gear_transmission_error import angle_error, array_angle_error
from rsea_core.effects.load_inertia_variation import array_inertia_factor
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
    stored = e.parallel_energy_J(fx, load)
    stored = stored + fx[e.GEAR_OFFSET] * wheel
    stored = stored + fx[e.UNBALANCE] * one_less_cosine(load + fx[e.UNBALANCE_ANGLE])
    for wave in e.COGGING_HARMONICS:
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


def _moved_load(plant, fx, motor, load, load_speed):
    """Angle and speed with which a rigid train's load stores energy: without transmission error.

    The log holds them with that error, whose torques the equations of motion neglect.
    """
    error, slope = angle_error.py_func(fx, motor, plant.gear_ratio)
    return load - error, load_speed / (1.0 + slope)


def energy_ledger(
    plant: mp.Plant, spring: SpringTable, fx: NDArray, log: NDArray, internal_states: NDArray
) -> EnergyLedger:
    """The energies of a run, from its log (n, N_LOG) and memory ((n or 0), N_Y)."""

    def integral(index: int) -> NDArray:
        return read_only(np.ascontiguousarray(log[:, k.LOG_INTEGRALS + index]))

    current, motor, motor_speed, load, load_speed = log[:, : k.N_STATES].T
    if plant.structure == mp.RIGID_FREE:
        load, load_speed = _moved_load(plant, fx, motor, load, load_speed)
    winding = plant.inductance if plant.drive in (mp.DUTY, mp.VOLTAGE) else 0.0
    wheel, kinetic, stored, impact = motor, 0.0, stored_J(fx, motor, load), 0.0 * motor
    if internal_states.shape[0] > 0:
        impact = internal_states[:, k.IMPACT]
        kinetic = 0.5 * fx[e.LINK_INERTIA] * internal_states[:, k.WO] ** 2
        if fx[e.BACKLASH] > 0.0:
            wheel = internal_states[:, k.TB]
            behind = fx[e.BACKLASH_INERTIA]
            kinetic = kinetic + 0.5 * behind * (internal_states[:, k.WB] ** 2 - motor_speed**2)
    deflection = wheel - load
    if plant.structure != mp.RIGID_FREE:
        deflection = deflection + array_angle_error(fx, wheel, plant.gear_ratio)
    if internal_states.shape[0] > 0:
        stored = stored + _remembered_J(fx, internal_states, deflection)
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
        kinetic_J=read_only(
            kinetic + 0.5 * plant.load_inertia * array_inertia_factor(fx, load) * load_speed**2
        ),
        elastic_J=read_only(spring_energy_J(spring, deflection)),
        gravity_J=read_only(plant.gravity * one_less_cosine(load + plant.gravity_offset)),
        contact_elastic_J=read_only(contact_stored_J(fx, plant.contact_stiffness, beyond)),
        terms_J=read_only(stored),
    )


def _remembered_J(fx: NDArray, internal_states: NDArray, deflection: NDArray) -> NDArray:
    """Energy [J] in stop operators, Bouc-Wen stretch, Maxwell branches and link, (n,) array."""
    stored = 0.5 * fx[e.BOUC_WEN] * internal_states[:, k.BW] ** 2
    for i in range(e.N_BRANCHES):
        stored = stored + 0.5 * fx[e.BRANCH_STIFFNESS + i] * internal_states[:, k.BRANCH + i] ** 2
    if fx[e.LINK_STIFFNESS] > 0.0:
        twist = internal_states[:, k.TL] - internal_states[:, k.TO]
        stored = stored + 0.5 * fx[e.LINK_STIFFNESS] * twist**2
    for i in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + i] > 0.0:
            z = _stop_deflection(internal_states, i, deflection, fx[e.SLIP_YIELD + i])
            stored = stored + 0.5 * fx[e.SLIP_STIFFNESS + i] * z**2
    if fx[e.GEAR_PRESLIDING] > 0.0:
        z = internal_states[:, k.GEAR_BRISTLE_DEFLECTION]
        if fx[e.GEAR_BRISTLE] == 0.0:
            z = _stop_deflection(
                internal_states, m.GEAR_STOP, internal_states[:, k.TW], fx[e.GEAR_PRESLIDING]
            )
        level = np.where(z > 0.0, fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]) * (1 + fx[e.GEAR_RISE])
        stored = stored + 0.5 * level / fx[e.GEAR_PRESLIDING] * z**2
    if fx[e.LOAD_PRESLIDING] > 0.0:
        z = internal_states[:, k.LOAD_BRISTLE_DEFLECTION]
        if fx[e.LOAD_BRISTLE] == 0.0:
            z = _stop_deflection(
                internal_states, m.LOAD_STOP, internal_states[:, k.TL], fx[e.LOAD_PRESLIDING]
            )
        level = fx[e.LOAD_COULOMB] * (1.0 + fx[e.LOAD_RISE])
        stored = stored + 0.5 * level / fx[e.LOAD_PRESLIDING] * z**2
    return stored


def _stop_deflection(
    internal_states: NDArray, stop: int, coordinate: NDArray, limit: float
) -> NDArray:
    direction = internal_states[:, k.DIRECTION + stop]
    return np.where(
        direction == 0.0, coordinate - internal_states[:, k.ANCHOR + stop], direction * limit
    )


def internal_signals(
    fx: NDArray, internal_states: NDArray, terms: Iterable[Term]
) -> dict[str, NDArray]:
    """Columns of a run that its terms add or change: the wheel behind a play, heat, the link."""
    found = {}
    if internal_states.shape[0] == 0:
        return found
    if fx[e.BACKLASH] > 0.0:
        found["wheel_angle_rad"] = read_only(internal_states[:, k.TB].copy())
        found["wheel_velocity_rad_per_s"] = read_only(internal_states[:, k.WB].copy())
    if fx[e.LINK_STIFFNESS] > 0.0:
        found["link_angle_rad"] = read_only(internal_states[:, k.TO].copy())
        found["link_velocity_rad_per_s"] = read_only(internal_states[:, k.WO].copy())
    for term in terms:
        if isinstance(term, DriveThermal):
            found["winding_temperature_C"] = read_only(
                internal_states[:, k.WINDING] + term.ambient_C
            )
            found["case_temperature_C"] = read_only(internal_states[:, k.CASE] + term.ambient_C)
    return found
