"""The equations that every model shares, compiled once: rates of the states, powers, torques.

A machine is a `Plant` of numbers, a controller a compiled function with the signature
`states.CONTROLLER`, so one compilation serves every machine, load and controller; the numbers of
the terms are one array (`effects.layout`). What switches (the current limit, the contact, stick
and slip of a dry joint, the sign of the transmitted torque, a pulse) is a `Mode`: with the mode
fixed the equations are smooth; `events` says where it must change and `integrator` steps.

Dry friction is set-valued. A stuck joint has no motion at all, its speed is zero and its angle
stays to the bit; it starts where what pushes it exceeds the breakaway level, and stops where
its speed crosses zero and the applied torque is within the level. The current goes on meanwhile.

    L i'      = u - R i - k_e w_m                      (|i| held at the limit while u pushes out)
    J w_w'    = N k_t i - B w_w - tau_s - tau_f        J = N^2 J_m + J_o, B = N^2 B_m + B_o
    J_l w_l'  = tau_s + tau_load - B_l w_l - G sin(theta_l + offset) - tau_contact - tau_fl
    tau_s     = f(theta_w - theta_l)
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.bristles as b
import rsea_core.engines.event_driven.flanks as flanks
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k
from rsea_core.effects.gear_transmission_error import angle_error
from rsea_core.machine.plant import (
    CURRENT,
    DUTY,
    ELASTIC_FREE,
    ELASTIC_HELD,
    MOTOR_TORQUE,
    POSITION,
    RIGID_FREE,
    VOLTAGE,
)
from rsea_core.machine.spring_table import table_torque


@njit(error_model="numpy", inline="always")
def winding(plant, fx, y):
    """Resistance [ohm] and the factor on k_t and k_e, by heat and the motor's angle."""
    if fx[e.ANY] == 0.0:
        return plant.resistance, 1.0
    resistance = plant.resistance * (1.0 + fx[e.RESISTANCE_RISE] * y[k.WINDING])
    return resistance, e.constant_factor(fx, y[k.TW], y[k.CASE], y[k.WINDING])


@njit(error_model="numpy", inline="always")
def current_and_voltage(plant, fx, mode, command, y):
    """Current and the voltage at the winding; the torque of a servo in the current's place."""
    resistance, factor = winding(plant, fx, y)
    emf = factor * plant.volts_per_speed * y[k.WW]
    if plant.drive == DUTY or plant.drive == VOLTAGE:
        volts = command * plant.volts_per_command
        if mode.limited != 0:
            current = mode.limited * plant.current_limit
            return current, resistance * current + emf
        if plant.inductance > 0.0:
            source = e.source_ohm(fx, command, y[k.IM])
            return y[k.IM], volts - source * y[k.IM] - e.dead_time_volts(fx, plant, y[k.IM])
        source = e.source_ohm(fx, command, volts - emf)
        current = e.dead_time_current(fx, plant, volts - emf, resistance + source)
        return current, volts - source * current - e.dead_time_volts(fx, plant, current)
    if plant.drive == POSITION:
        return e.servo_torque(plant, fx, mode.limited, command, y[k.TW], y[k.WW]), 0.0
    if plant.drive == CURRENT:
        current = min(max(command, -plant.current_limit), plant.current_limit)
        return current, resistance * current + emf
    return 0.0, 0.0


@njit(error_model="numpy", inline="always")
def _drive_torque(plant, command, current, factor):
    if plant.drive == MOTOR_TORQUE:
        return plant.torque_per_motor_torque * command
    return factor * plant.torque_per_ampere * current


@njit(error_model="numpy", inline="always")
def deflection_and_rate(plant, fx, y):
    """Deflection of the spring [rad], its rate [rad/s], lever of its torque on the wheel."""
    at = k.TB if fx[e.BACKLASH] > 0.0 else k.TW
    error, slope = angle_error(fx, y[at], plant.gear_ratio)
    return y[at] + error - y[k.TL], (1.0 + slope) * y[at + 1] - y[k.WL], 1.0 + slope


@njit(error_model="numpy", inline="always")
def stop_deflection(fx, y, stop, coordinate):
    """Stretch [rad] of a stop operator at its coordinate."""
    direction = y[k.DIRECTION + stop]
    return (
        coordinate - y[k.ANCHOR + stop] if direction == 0.0 else direction * m.stop_yield(fx, stop)
    )


@njit(error_model="numpy", inline="always")
def pulse_share(fx, mode, y):
    """Share of the disturbance that acts."""
    share = y[k.RAMP] if fx[e.PULSE_RISE] > 0.0 else 1.0
    return share if mode.pulse else 0.0


@njit(error_model="numpy")
def spring_internal(fx, y, deflection, rate):
    """Torque [Nm] and heat [W] of all that the spring remembers, and of its damper."""
    torque = fx[e.SPRING_DAMPING] * rate
    lost = torque * rate
    for i in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + i] > 0.0:
            slip = fx[e.SLIP_STIFFNESS + i] * stop_deflection(fx, y, i, deflection)
            torque += slip
            lost += slip * rate if y[k.DIRECTION + i] != 0.0 else 0.0
    if fx[e.BOUC_WEN] > 0.0:
        part = fx[e.BOUC_WEN] * y[k.BW]
        torque += part
        same = y[k.RATE_SIGN] * y[k.BOUC_WEN_SIGN]
        lost += part * (rate - m.bouc_wen_rate(fx, y[k.BW], rate, same))
    for i in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + i] > 0.0:
            part = fx[e.BRANCH_STIFFNESS + i] * y[k.BRANCH + i]
            torque += part
            lost += part * y[k.BRANCH + i] / fx[e.BRANCH_TIME + i]
    return torque, lost


@njit(error_model="numpy")
def _with_internal_states(plant, fx, y):
    """What remembering terms add to the torques on motor side and load."""
    wheel, load = 0.0, 0.0
    if fx[e.GEAR_BRISTLE] > 0.0:
        wheel -= b.gear_torque(fx, y)
    elif fx[e.GEAR_PRESLIDING] > 0.0:
        z = stop_deflection(fx, y, m.GEAR_STOP, y[k.TW])
        wheel -= m.gear_presliding(fx, z, y[k.GEAR_SIDE], y[k.DIRECTION + m.GEAR_STOP], y[k.WW])
    if fx[e.LOAD_BRISTLE] > 0.0:
        load -= b.load_torque(fx, y)
    elif fx[e.LOAD_PRESLIDING] > 0.0:
        z = stop_deflection(fx, y, m.LOAD_STOP, y[k.TL])
        load -= m.load_presliding(fx, z, y[k.DIRECTION + m.LOAD_STOP], y[k.WL])
    if fx[e.LINK_STIFFNESS] > 0.0:
        twist, twist_rate = y[k.TL] - y[k.TO], y[k.WL] - y[k.WO]
        load -= fx[e.LINK_STIFFNESS] * twist + fx[e.LINK_DAMPING] * twist_rate
    if fx[e.BACKLASH] > 0.0:
        wheel += fx[e.BACKLASH_DAMPING] * y[k.WW]  # acts on the wheel behind the backlash
    return wheel, load


@njit(error_model="numpy", inline="always")
def torques(plant, spring, fx, mode, drive_torque, y):
    """Torque on the motor side, on the load, tau_s and its lever on the wheel, contact loss, drag.

    Motor side and load are without spring and set-valued friction.
    """
    wheel = drive_torque - plant.damping * y[k.WW]
    load = plant.load_torque - plant.load_damping * y[k.WL]
    lever, lost, drag, output = 1.0, 0.0, 0.0, 0.0
    if plant.gravity != 0.0:
        load -= plant.gravity * np.sin(y[k.TL] + plant.gravity_offset)
    if mode.contact:
        depth = y[k.TL] - plant.contact_angle
        lost = plant.contact_damping * y[k.WL]
        if fx[e.EXPONENT] == 0.0:
            load -= plant.contact_stiffness * depth
        else:
            elastic, damped = e.contact_torque(fx, plant.contact_stiffness, depth, y[k.WL])
            load -= elastic
            lost += damped
        load -= lost
    elastic_joint = plant.structure == ELASTIC_FREE or plant.structure == ELASTIC_HELD
    if fx[e.ANY] == 0.0:
        if elastic_joint:
            output = table_torque(spring, y[k.TW] - y[k.TL])
        return wheel, load, output, lever, lost, drag
    wheel += e.wheel_torque(fx, y[k.TW], y[k.WW]) - e.gear_smooth_friction(fx, y[k.WW])
    added, drag = e.load_torque(fx, y[k.TL], y[k.WL], pulse_share(fx, mode, y))
    load += added
    _, slope = e.inertia_factor(fx, y[k.TL])
    load -= 0.5 * plant.load_inertia * slope * y[k.WL] * y[k.WL]
    deflection, rate, lever = deflection_and_rate(plant, fx, y)
    if elastic_joint:
        output = table_torque(spring, deflection)
    if fx[e.INTERNAL_STATES] != 0.0:
        at_wheel, at_load = _with_internal_states(plant, fx, y)
        wheel += at_wheel
        load += at_load
        if elastic_joint:
            remembered, _ = spring_internal(fx, y, deflection, rate)
            output += remembered
    return wheel, load, output, lever, lost, drag


@njit(error_model="numpy")
def _internal_rates(plant, fx, mode, y, derivatives, row):
    """Rates of the states that only some terms have, and losses; not of the wheel in `flanks`."""
    deflection, rate, _ = deflection_and_rate(plant, fx, y)
    _, derivatives[row, k.POWER + k.SPRING_LOSS] = spring_internal(fx, y, deflection, rate)
    derivatives[row, k.BW] = 0.0
    if fx[e.BOUC_WEN] > 0.0:
        same = y[k.RATE_SIGN] * y[k.BOUC_WEN_SIGN]
        derivatives[row, k.BW] = m.bouc_wen_rate(fx, y[k.BW], rate, same)
    for i in range(e.N_BRANCHES):
        derivatives[row, k.BRANCH + i] = m.branch_rate(fx, i, y[k.BRANCH + i], rate)
    joule = derivatives[row, k.POWER + k.JOULE]
    derivatives[row, k.WINDING], derivatives[row, k.CASE] = m.heat_rates(
        fx, y[k.WINDING], y[k.CASE], joule
    )
    derivatives[row, k.RAMP] = 0.0
    if mode.pulse and y[k.RISEN] == 0.0 and fx[e.PULSE_RISE] > 0.0:
        derivatives[row, k.RAMP] = 1.0 / fx[e.PULSE_RISE]
    derivatives[row, k.TO] = derivatives[row, k.WO] = 0.0
    if fx[e.LINK_STIFFNESS] > 0.0:
        twist_rate = y[k.WL] - y[k.WO]
        carried = fx[e.LINK_STIFFNESS] * (y[k.TL] - y[k.TO]) + fx[e.LINK_DAMPING] * twist_rate
        derivatives[row, k.TO], derivatives[row, k.WO] = y[k.WO], carried / fx[e.LINK_INERTIA]
        derivatives[row, k.POWER + k.LINK_LOSS] = fx[e.LINK_DAMPING] * twist_rate * twist_rate
    if b.there_are(fx):
        b.rates(fx, mode, y, derivatives, row)
    slides = fx[e.GEAR_PRESLIDING] > 0.0 and fx[e.GEAR_BRISTLE] == 0.0
    if slides and y[k.DIRECTION + m.GEAR_STOP] != 0.0:
        direction = y[k.DIRECTION + m.GEAR_STOP]
        level = m.gear_presliding(fx, 0.0, 1.0, direction, y[k.WW])
        derivatives[row, k.POWER + k.GEAR_FRICTION] += level * y[k.WW]
    slides = fx[e.LOAD_PRESLIDING] > 0.0 and fx[e.LOAD_BRISTLE] == 0.0
    if slides and y[k.DIRECTION + m.LOAD_STOP] != 0.0:
        direction = y[k.DIRECTION + m.LOAD_STOP]
        level = m.load_presliding(fx, 0.0, direction, y[k.WL])
        derivatives[row, k.POWER + k.LOAD_FRICTION] += level * y[k.WL]


class Torques(NamedTuple):
    """What moves the bodies [Nm]; motor side and load without spring and set-valued friction."""

    wheel: float
    load: float
    output: float  # of the spring, tau_s
    lever: float  # of the spring's torque on the wheel
    wheel_dry: float  # friction (`_dry_friction`) against positive motion
    load_dry: float


@njit(error_model="numpy")
def derivative(plant, spring, fx, mode, command, stage, y, derivatives):
    """The torque tau_s; puts rates of the states and powers into the stage's row of slopes.

    `spring` is the `regions` of a `SpringTable`, `fx` the array of `effects`, `derivatives` has
    N_SLOPES columns. Arrays are arguments of their own, not fields of a tuple, because taking one
    out of a tuple counts references each time.
    """
    row = stage.row
    torque = _drive(plant, fx, mode, command, y, derivatives, row)
    wheel, load, output, lever, lost, drag = torques(plant, spring, fx, mode, torque, y)
    derivatives[row, k.TW], derivatives[row, k.TL] = y[k.WW], y[k.WL]
    derivatives[row, k.POWER + k.CONTACT_LOSS] = lost * y[k.WL]
    derivatives[row, k.POWER + k.DRAG_LOSS] = drag * y[k.WL]
    _losses(plant, fx, mode, y, derivatives, row)
    if fx[e.INTERNAL_STATES] != 0.0:
        _internal_rates(plant, fx, mode, y, derivatives, row)
    wheel_dry, load_dry = _dry_friction(plant, fx, mode, y, output, derivatives, row)
    moving = Torques(wheel, load, output, lever, wheel_dry, load_dry)
    held = mode.acceleration + mode.jerk * stage.time
    return _accelerate(plant, fx, mode, y, moving, held, derivatives, row)


@njit(error_model="numpy", inline="always")
def _drive(plant, fx, mode, command, y, derivatives, row):
    """Torque of the motor at the wheel; fills in the current's rate and the drive's powers."""
    current, volts = current_and_voltage(plant, fx, mode, command, y)
    resistance, factor = winding(plant, fx, y)
    torque = _drive_torque(plant, command, current, factor)
    derivatives[row, k.POWER + k.SUPPLIED] = volts * current
    derivatives[row, k.POWER + k.JOULE] = resistance * current * current
    mismatch = factor * (plant.torque_per_ampere - plant.volts_per_speed)
    derivatives[row, k.POWER + k.MISMATCH] = mismatch * current * y[k.WW]
    if plant.drive == MOTOR_TORQUE or plant.drive == POSITION:
        derivatives[row, k.POWER + k.SUPPLIED] = torque * y[k.WW]
        derivatives[row, k.POWER + k.JOULE] = derivatives[row, k.POWER + k.MISMATCH] = 0.0
    derivatives[row, k.IM] = 0.0
    if plant.inductance > 0.0 and mode.limited == 0 and plant.drive in (DUTY, VOLTAGE):
        emf = factor * plant.volts_per_speed * y[k.WW]
        derivatives[row, k.IM] = (volts - resistance * current - emf) / plant.inductance
    return torque


@njit(error_model="numpy", inline="always")
def _losses(plant, fx, mode, y, derivatives, row):
    """Powers of smooth friction, and of what acts on the load from outside."""
    derivatives[row, k.POWER + k.DRIVE_VISCOUS] = plant.damping * y[k.WW] * y[k.WW]
    derivatives[row, k.POWER + k.LOAD_VISCOUS] = plant.load_damping * y[k.WL] * y[k.WL]
    derivatives[row, k.POWER + k.LOAD_WORK] = plant.load_torque * y[k.WL]
    derivatives[row, k.POWER + k.LOAD_WORK] += pulse_share(fx, mode, y) * fx[e.PULSE] * y[k.WL]
    derivatives[row, k.POWER + k.GEAR_FRICTION] = derivatives[row, k.POWER + k.LOAD_FRICTION] = 0.0
    if fx[e.ANY] != 0.0:
        derivatives[row, k.POWER + k.GEAR_FRICTION] = e.gear_smooth_friction(fx, y[k.WW]) * y[k.WW]
    if fx[e.BACKLASH] > 0.0:
        moved = fx[e.BACKLASH_DAMPING] * (y[k.WB] * y[k.WB] - y[k.WW] * y[k.WW])
        derivatives[row, k.POWER + k.DRIVE_VISCOUS] += moved


@njit(error_model="numpy", inline="always")
def _dry_friction(plant, fx, mode, y, output, derivatives, row):
    """Friction of wheel and load that slide [Nm], but its smooth part; fills in its powers.

    It is set-valued, or that which a loaded thread's bristles make of the transmitted torque.
    """
    wheel_dry, load_dry = 0.0, 0.0
    if fx[e.WHEEL_DRY] != 0.0 and mode.wheel != 0:
        carried = flanks.meshing(fx, y, output)
        level = e.gear_friction(fx, mode.wheel, y[k.WW], carried, mode.torque_sign)
        wheel_dry = mode.wheel * level
    elif b.carry_the_load(fx):
        wheel_dry = b.thread_loss(fx, y, mode.torque_sign) * flanks.meshing(fx, y, output)
    derivatives[row, k.POWER + k.GEAR_FRICTION] += wheel_dry * y[k.WW]
    if fx[e.LOAD_DRY] != 0.0 and mode.load != 0:
        load_dry = mode.load * e.load_friction(fx, y[k.WL], y[k.TL] + plant.gravity_offset)
        derivatives[row, k.POWER + k.LOAD_FRICTION] += load_dry * y[k.WL]
    return wheel_dry, load_dry


@njit(error_model="numpy", inline="always")
def _accelerate(plant, fx, mode, y, moving, held, derivatives, row):
    """Fills in the accelerations; `moving` is a `Torques`, `held` what a held load does.

    Returns tau_s: of a rigid body the torque in the joint.
    """
    wheel, load, output, lever, wheel_dry, load_dry = moving
    inertia = plant.load_inertia * e.inertia_factor(fx, y[k.TL])[0]
    wheel_stuck = fx[e.WHEEL_DRY] != 0.0 and mode.wheel == 0
    load_stuck = fx[e.LOAD_DRY] != 0.0 and mode.load == 0
    if fx[e.BACKLASH] > 0.0 and abs(y[k.FLANK]) == flanks.TOUCHING:
        least = flanks.friction_without_pressing(plant, fx, y, wheel, lever * output)
        derivatives[row, k.POWER + k.GEAR_FRICTION] += (least - wheel_dry) * y[k.WW]
        wheel_dry = least
    if plant.structure == ELASTIC_FREE:
        flanks.wheel_rates(
            plant, fx, y, wheel - wheel_dry, lever * output, wheel_stuck, derivatives, row
        )
        derivatives[row, k.WL] = (load + output - load_dry) / inertia
    elif plant.structure == ELASTIC_HELD:
        flanks.wheel_rates(
            plant, fx, y, wheel - wheel_dry, lever * output, wheel_stuck, derivatives, row
        )
        derivatives[row, k.WL] = held
        derivatives[row, k.POWER + k.LOAD_WORK] = -output * y[k.WL]
        derivatives[row, k.POWER + k.LOAD_VISCOUS] = 0.0
    elif plant.structure == RIGID_FREE:
        share = 1.0
        if mode.wheel != 0 and fx[e.WHEEL_DRY] != 0.0:
            share = e.rigid_share(fx, mode.wheel, mode.torque_sign)
        elif b.carry_the_load(fx):
            share = 1.0 + b.thread_loss(fx, y, mode.torque_sign)
        whole = plant.inertia + share * inertia
        derivatives[row, k.WW] = (wheel - wheel_dry + share * (load - load_dry)) / whole
        if wheel_stuck or load_stuck:
            derivatives[row, k.WW] = 0.0
        derivatives[row, k.WL] = derivatives[row, k.WW]
        # of a stuck body the joint carries what the side without dry friction needs
        output = inertia * derivatives[row, k.WW] - load + load_dry
        if load_stuck:
            output = wheel
        derivatives[row, k.POWER + k.GEAR_FRICTION] += (share - 1.0) * output * y[k.WW]
    else:
        derivatives[row, k.WW], derivatives[row, k.WL] = held, held
        output = wheel - plant.inertia * held
        derivatives[row, k.POWER + k.LOAD_WORK] = -output * y[k.WL]
        derivatives[row, k.POWER + k.LOAD_VISCOUS] = 0.0
    if wheel_stuck or load_stuck:
        _hold(plant, wheel_stuck, load_stuck, derivatives, row)
    return output


@njit(error_model="numpy")
def _hold(plant, wheel_stuck, load_stuck, derivatives, row):
    rigid = plant.structure == RIGID_FREE
    if wheel_stuck or rigid:
        derivatives[row, k.TW] = derivatives[row, k.WW] = 0.0
    if load_stuck or rigid:
        derivatives[row, k.TL] = derivatives[row, k.WL] = 0.0


@njit(error_model="numpy")
def pushes(plant, spring, fx, mode, command, y):
    """Torques [Nm] on wheel and load at rest, tau_s (rigid: of the gear), that on the wheel."""
    current, _ = current_and_voltage(plant, fx, mode, command, y)
    drive = _drive_torque(plant, command, current, winding(plant, fx, y)[1])
    wheel, load, output, lever, _, _ = torques(plant, spring, fx, mode, drive, y)
    if plant.structure == RIGID_FREE:
        return wheel + load, wheel + load, -load, 0.0
    return wheel, load + output, output, lever * output
