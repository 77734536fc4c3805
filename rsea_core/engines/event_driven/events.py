"""What switches: current limit, contact, stick and slip, flanks of the play, stop operators.

`switch_value` says, for a state, how far a switch is from acting (negative) or beyond it;
`switched` gives the mode after it. What a switch of the memory changes (anchors, ways, the
flank in mesh) is carried behind the states in `y` and changed there.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.bristles as b
import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.flanks as flanks
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp

# a stop that has just stuck must not slip again by the rounding of its anchor, nor flanks that
# have just parted meet again
SLACK_rad = 1e-13
# flanks that would part by less stay in mesh: a bouncing wheel comes to rest in a finite time by
# bounces without number
LOWEST_BOUNCE_rad = 1e-11


@njit(error_model="numpy")
def first_mode(plant, fx, y, time):
    """The mode of a machine at rest: what is dry sticks until `mode_at_start` looks.

    Puts what remembers at its start: the spring has come once from zero to its deflection and
    relaxed there, friction is unstretched, the wheel is in mesh on the side that carries it.
    """
    pulse = fx[e.PULSE] != 0.0 and fx[e.PULSE_START] <= time < fx[e.PULSE_END]
    if pulse and fx[e.PULSE_RISE] > 0.0:
        y[k.RAMP] = min((time - fx[e.PULSE_START]) / fx[e.PULSE_RISE], 1.0)
        y[k.RISEN] = 1.0 if y[k.RAMP] == 1.0 else 0.0
    if fx[e.INTERNAL_STATES] != 0.0:
        _first_internal_states(plant, fx, y)
    return k.Mode(0, y[k.TL] > plant.contact_angle, 0.0, 0.0, 0, 0, 1, pulse, time)


@njit(error_model="numpy")
def _first_internal_states(plant, fx, y):
    y[k.TB], y[k.TO] = y[k.TW], y[k.TL]
    if fx[e.BACKLASH] > 0.0:
        y[k.FLANK] = 1.0 if y[k.TW] >= y[k.TL] else -1.0
        y[k.TB] = y[k.TW] - 0.5 * y[k.FLANK] * fx[e.BACKLASH]
        if (y[k.TB] - y[k.TL]) * y[k.FLANK] < 0.0:  # slack: the unloaded spring turns the wheel
            y[k.TB], y[k.FLANK] = y[k.TL], 0.0
    deflection, _, _ = eq.deflection_and_rate(plant, fx, y)
    for stop in range(m.N_STOPS):
        limit = m.stop_yield(fx, stop)
        if limit == 0.0:
            continue
        if stop == m.GEAR_STOP:
            y[k.ANCHOR + stop] = y[k.TW]
        elif stop == m.LOAD_STOP:
            y[k.ANCHOR + stop] = y[k.TL]
        elif abs(deflection) > limit:
            y[k.ANCHOR + stop] = deflection - limit if deflection > 0.0 else deflection + limit
    if b.there_are(fx):
        b.start(y)
    y[k.BW] = m.virgin_bouc_wen(fx, deflection)
    y[k.RATE_SIGN] = y[k.GEAR_SIDE] = 1.0
    y[k.BOUC_WEN_SIGN] = -1.0 if y[k.BW] < 0.0 else 1.0
    y[k.WINDING], y[k.CASE] = fx[e.START_WINDING], fx[e.START_CASE]
    if fx[e.KNEE + 1] != 0.0:
        y[k.KNEE] = 0.0
        for i in range(4):
            y[k.KNEE] += 1.0 if deflection >= fx[e.KNEE + i] else 0.0


@njit(error_model="numpy")
def _excess(plant, spring, fx, mode, command, y, switch):
    """How far the torque on a stuck joint exceeds its breakaway level, and its direction."""
    wheel, load, output, load_torque = eq.pushes(plant, spring, fx, mode, command, y)
    if switch == k.LOAD_SWITCH:
        level = e.load_friction(fx, 0.0, y[k.TL] + plant.gravity_offset)
        return abs(load) - level, 1 if load > 0.0 else -1
    carried = flanks.meshing(fx, y, output)
    wheel -= flanks.meshing(fx, y, load_torque)
    direction = 1 if wheel > 0.0 else -1
    level = e.gear_friction(fx, direction, 0.0, carried, 1 if carried > 0.0 else -1)
    return abs(wheel) - level, direction


@njit(error_model="numpy")
def _released(plant, spring, fx, mode, command, y):
    """The mode with every stuck joint let go whose torque exceeds its breakaway level."""
    if b.there_are(fx):
        b.set_signs(fx, mode, y)
    if fx[e.BACKLASH] > 0.0:
        _settle_flank(plant, spring, fx, mode, command, y)
    wheel, load = mode.wheel, mode.load
    if fx[e.WHEEL_DRY] != 0.0 and wheel == 0:
        excess, direction = _excess(plant, spring, fx, mode, command, y, k.WHEEL_SWITCH)
        wheel = direction if excess > 0.0 else 0
    if fx[e.LOAD_DRY] != 0.0 and load == 0:
        excess, direction = _excess(plant, spring, fx, mode, command, y, k.LOAD_SWITCH)
        load = direction if excess > 0.0 else 0
    starts, mode = wheel != mode.wheel, k.with_sliding(mode, wheel, load)
    if starts and fx[e.BACKLASH] > 0.0:
        _settle_flank(plant, spring, fx, mode, command, y)
    if b.there_are(fx):
        b.set_signs(fx, mode, y)
    return mode


@njit(error_model="numpy")
def _settle_flank(plant, spring, fx, mode, command, y):
    """Flanks in mesh press, touch or part, as their torque says."""
    if y[k.FLANK] != 0.0:
        loaded = _flank_torque(plant, spring, fx, mode, command, y, 1.0)
        unloaded = _flank_torque(plant, spring, fx, mode, command, y, 0.0)
        y[k.FLANK] = flanks.settled(np.sign(y[k.FLANK]), loaded, unloaded)


@njit(error_model="numpy")
def _flank_torque(plant, spring, fx, mode, command, y, share):
    """Torque [Nm] that the motor side passes to a wheel in mesh.

    `share` is that of the friction which the transmitted torque causes.
    """
    wheel, _, output, load_torque = eq.pushes(plant, spring, fx, mode, command, y)
    load_torque += fx[e.BACKLASH_DAMPING] * y[k.WB]
    if fx[e.WHEEL_DRY] != 0.0:
        if mode.wheel == 0:
            return load_torque
        carried, direction = share * output, mode.wheel
        wheel -= direction * e.gear_friction(fx, direction, y[k.WW], carried, mode.torque_sign)
    elif b.carry_the_load(fx):
        wheel -= share * b.thread_loss(fx, y, mode.torque_sign) * output
    return load_torque + fx[e.BACKLASH_INERTIA] * (wheel - load_torque) / plant.inertia


@njit(error_model="numpy")
def switch_value(plant, spring, fx, mode, command, time, y, switch):
    """Negative while the mode holds, above zero where this switch must change it.

    `time` counts from the row's start.
    """
    if switch == k.CONTACT_SWITCH:
        if not plant.contact_angle < np.inf:
            return -1.0
        beyond = y[k.TL] - plant.contact_angle
        return -beyond if mode.contact else beyond
    if switch == k.CURRENT_SWITCH:
        if not _limits(plant):
            return -1.0
        if mode.limited == 0:
            current, _ = eq.current_and_voltage(plant, fx, mode, command, y)
            return abs(current) - plant.current_limit
        return -mode.limited * _current_tendency(plant, fx, mode.limited, command, y)
    if switch >= k.N_TERM_EVENTS:
        return _internal_event(plant, spring, fx, mode, command, y, switch)
    return _term_switch(plant, spring, fx, mode, command, time, y, switch)


@njit(error_model="numpy")
def _term_switch(plant, spring, fx, mode, command, time, y, switch):
    if switch == k.PULSE_SWITCH:
        if fx[e.PULSE] == 0.0:
            return -1.0
        now = mode.row_time + time
        if mode.pulse:
            return now - fx[e.PULSE_END]
        return now - fx[e.PULSE_START] if now < fx[e.PULSE_END] else -1.0
    if switch == k.TORQUE_SWITCH:
        if fx[e.GEAR_DRIVE_LOSS] == 0.0 and fx[e.GEAR_BACKDRIVE_LOSS] == 0.0:
            return -1.0
        wheel, _, output, _ = eq.pushes(plant, spring, fx, mode, command, y)
        if plant.structure == mp.RIGID_FREE and (mode.wheel != 0 or b.carry_the_load(fx)):
            # of what it transmits while it moves, whose sign no friction changes
            wheel += output - mode.wheel * e.gear_friction(fx, mode.wheel, y[k.WW], 0.0, 1)
            inertia = plant.load_inertia * e.inertia_factor(fx, y[k.TL])[0]
            output = inertia * wheel + plant.inertia * output
        return -mode.torque_sign * output
    dry, direction, speed = fx[e.WHEEL_DRY], mode.wheel, y[k.WW]
    if switch == k.LOAD_SWITCH:
        dry, direction, speed = fx[e.LOAD_DRY], mode.load, y[k.WL]
    if dry == 0.0:
        return -1.0
    if direction != 0:
        return -direction * speed
    excess, _ = _excess(plant, spring, fx, mode, command, y, switch)
    return excess


@njit(error_model="numpy")
def _internal_event(plant, spring, fx, mode, command, y, switch):
    if switch == k.FLANK_SWITCH:
        if fx[e.BACKLASH] == 0.0:
            return -1.0
        if y[k.FLANK] == 0.0:
            return abs(y[k.TW] - y[k.TB]) - 0.5 * fx[e.BACKLASH] - SLACK_rad
        side = np.sign(y[k.FLANK])
        loaded = side * _flank_torque(plant, spring, fx, mode, command, y, 1.0)
        if abs(y[k.FLANK]) != flanks.TOUCHING:
            return -loaded
        return max(loaded, -side * _flank_torque(plant, spring, fx, mode, command, y, 0.0))
    if switch == k.RISEN_SWITCH:
        return y[k.RAMP] - 1.0 if mode.pulse and y[k.RISEN] == 0.0 else -1.0
    if switch == k.SIDE_SWITCH:
        if fx[e.GEAR_PRESLIDING] == 0.0 or fx[e.GEAR_FORWARD] == fx[e.GEAR_BACKWARD]:
            return -1.0
        if fx[e.GEAR_BRISTLE] > 0.0:
            return -1.0
        return -y[k.GEAR_SIDE] * eq.stop_deflection(fx, y, m.GEAR_STOP, y[k.TW])
    deflection, rate, _ = eq.deflection_and_rate(plant, fx, y)
    if switch == k.RATE_SWITCH:
        return -y[k.RATE_SIGN] * rate if fx[e.BOUC_WEN] > 0.0 else -1.0
    if switch == k.BOUC_WEN_SWITCH:
        return -y[k.BOUC_WEN_SIGN] * y[k.BW] if fx[e.BOUC_WEN] > 0.0 else -1.0
    if switch == k.KNEE_SWITCH:
        if fx[e.KNEE + 1] == 0.0:
            return -1.0
        passed = int(y[k.KNEE])
        above = deflection - fx[e.KNEE + passed] if passed < 4 else -1.0
        below = fx[e.KNEE + passed - 1] - deflection if passed > 0 else -1.0
        return max(above, below)
    stop = switch - k.STOP_SWITCH
    limit = m.stop_yield(fx, stop)
    if limit == 0.0:
        return -1.0
    if b.are_at(fx, stop):
        return b.switch_value(fx, y, stop)
    coordinate, speed = _at_stop(y, stop, deflection, rate)
    direction = y[k.DIRECTION + stop]
    return (
        -direction * speed
        if direction != 0.0
        else abs(coordinate - y[k.ANCHOR + stop]) - limit - SLACK_rad
    )


@njit(error_model="numpy", inline="always")
def _at_stop(y, stop, deflection, rate):
    """Coordinate and speed that a stop operator follows."""
    if stop == m.GEAR_STOP:
        return y[k.TW], y[k.WW]
    if stop == m.LOAD_STOP:
        return y[k.TL], y[k.WL]
    return deflection, rate


@njit(error_model="numpy", inline="always")
def _limits(plant):
    """Whether a current (the torque of a servo) meets a limit as the states move."""
    follows = plant.drive == mp.DUTY or plant.drive == mp.VOLTAGE or plant.drive == mp.POSITION
    return follows and plant.current_limit < np.inf


@njit(error_model="numpy")
def _current_tendency(plant, fx, side, command, y):
    """Voltage left to raise the current when it is at the limit on this side."""
    if plant.drive == mp.POSITION:
        torque = e.servo_torque(plant, fx, 0, command, y[k.TW], y[k.WW])
        return torque - side * plant.current_limit
    resistance, factor = eq.winding(plant, fx, y)
    emf = factor * plant.volts_per_speed * y[k.WW]
    at_limit = side * plant.current_limit
    resistance += e.source_ohm(fx, command, at_limit)
    volts = command * plant.volts_per_command - e.dead_time_volts(fx, plant, at_limit)
    return volts - resistance * at_limit - emf


@njit(error_model="numpy")
def switched(plant, spring, fx, mode, y, command, switch):
    """The mode after this switch; a current at its limit or a speed at zero is put there."""
    if switch == k.CONTACT_SWITCH:
        mode = k.with_contact(mode, not mode.contact)
    elif switch == k.PULSE_SWITCH:
        if fx[e.PULSE_RISE] > 0.0:
            y[k.RAMP] = y[k.RISEN] = 0.0
        mode = k.with_pulse(mode, not mode.pulse)
    elif switch == k.TORQUE_SWITCH:
        mode = k.with_torque_sign(mode, -mode.torque_sign)
    elif switch == k.CURRENT_SWITCH:
        side = 0
        if mode.limited == 0:
            current, _ = eq.current_and_voltage(plant, fx, mode, command, y)
            side = 1 if current > 0.0 else -1
            y[k.IM] = side * plant.current_limit
        mode = k.with_limit(mode, side)
    elif switch == k.FLANK_SWITCH:
        mode = _flank_switched(plant, spring, fx, mode, command, y)
    elif switch > k.FLANK_SWITCH:
        _remember(plant, fx, y, switch)
    else:
        rigid = plant.structure == mp.RIGID_FREE
        if switch == k.WHEEL_SWITCH and mode.wheel != 0:
            y[k.WW] = 0.0
            if fx[e.BACKLASH] > 0.0 and y[k.FLANK] != 0.0:
                y[k.WB] = 0.0
            mode = k.with_sliding(mode, 0, mode.load)
        if switch == k.LOAD_SWITCH and mode.load != 0:
            y[k.WL] = 0.0
            mode = k.with_sliding(mode, mode.wheel, 0)
        if rigid:
            y[k.WW] = y[k.WL] = 0.0
    return _released(plant, spring, fx, mode, command, y)


@njit(error_model="numpy")
def _remember(plant, fx, y, switch):
    """Stick and slip of a stop operator, signs of the Bouc-Wen law, a knee of the spring."""
    deflection, rate, _ = eq.deflection_and_rate(plant, fx, y)
    if switch == k.RATE_SWITCH:
        y[k.RATE_SIGN] *= -1.0
    elif switch == k.BOUC_WEN_SWITCH:
        y[k.BOUC_WEN_SIGN] *= -1.0
    elif switch == k.SIDE_SWITCH:
        y[k.GEAR_SIDE] *= -1.0
    elif switch == k.RISEN_SWITCH:
        y[k.RAMP] = y[k.RISEN] = 1.0
    elif switch == k.KNEE_SWITCH:
        passed = int(y[k.KNEE])
        up = passed < 4 and deflection > fx[e.KNEE + passed]
        y[k.KNEE] += 1.0 if up else -1.0
    elif not b.are_at(fx, switch - k.STOP_SWITCH):
        stop = switch - k.STOP_SWITCH
        coordinate, _ = _at_stop(y, stop, deflection, rate)
        direction = y[k.DIRECTION + stop]
        if direction == 0.0:
            y[k.DIRECTION + stop] = 1.0 if coordinate > y[k.ANCHOR + stop] else -1.0
        else:
            y[k.ANCHOR + stop] = coordinate - direction * m.stop_yield(fx, stop)
            y[k.DIRECTION + stop] = 0.0


@njit(error_model="numpy")
def _flank_switched(plant, spring, fx, mode, command, y):
    """Mesh lost, or an impact of the flanks; what it loses goes to y[IMPACT].

    They part with the share `backlash_rebound` of the speed at which they met (Newton's law of
    impact), or go on in mesh.
    """
    if y[k.FLANK] != 0.0:
        _settle_flank(plant, spring, fx, mode, command, y)
        return mode
    side = 1.0 if y[k.TW] > y[k.TB] else -1.0
    behind = fx[e.BACKLASH_INERTIA]
    front, before, at = plant.inertia - behind, y[k.WW], y[k.WB]
    parting = fx[e.BACKLASH_RESTITUTION] * max(side * (before - at), 0.0)
    if parting > 0.0:
        pressed = side * _flank_torque(plant, spring, fx, mode, command, y, 0.0)
        pressed *= 1.0 / front + 1.0 / behind
        if parting**2 < 2.0 * pressed * LOWEST_BOUNCE_rad:
            parting = 0.0
    if b.carry_the_load(fx):  # bristles do not bend within an impact
        seen = max(behind * (1.0 + b.thread_loss(fx, y, side)), 0.0)
        y[k.WW] = (front * before + seen * (at - side * parting)) / (front + seen)
        y[k.WB] = y[k.WW] + side * parting
    else:
        y[k.WW], y[k.WB] = flanks.after_impact(fx, front, behind, before, at, side, parting)
    y[k.IMPACT] += 0.5 * (front * (before**2 - y[k.WW] ** 2) + behind * (at**2 - y[k.WB] ** 2))
    if parting > 0.0:
        y[k.TB] = y[k.TW] - side * (0.5 * fx[e.BACKLASH] - SLACK_rad)
    else:
        y[k.TB], y[k.FLANK] = y[k.TW] - 0.5 * side * fx[e.BACKLASH], side
    return k.with_sliding(mode, int(np.sign(y[k.WW])), mode.load)


@njit(error_model="numpy")
def mode_at_start(plant, spring, fx, mode, command, y):
    """The mode once a new command acts: a jump of it can switch limit and friction."""
    return _released(plant, spring, fx, _limit_at_start(plant, fx, mode, command, y), command, y)


@njit(error_model="numpy")
def _limit_at_start(plant, fx, mode, command, y):
    if plant.drive == mp.CURRENT:
        side = 1 if command > plant.current_limit else -1 if command < -plant.current_limit else 0
        return k.with_limit(mode, side)
    if not _limits(plant):
        return mode
    side = mode.limited
    if side != 0 and side * _current_tendency(plant, fx, side, command, y) < 0.0:
        side = 0
    if side == 0:
        free = k.with_limit(mode, 0)
        current, _ = eq.current_and_voltage(plant, fx, free, command, y)
        toward = 1 if current > 0.0 else -1
        applied_torque = toward * _current_tendency(plant, fx, toward, command, y)
        if abs(current) >= plant.current_limit and applied_torque > 0.0:
            side = toward
    return k.with_limit(mode, side)
