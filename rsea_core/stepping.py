"""The fast engine: one compiled fixed-step kernel for every effect, switched by its numbers.

A step of length h, of second order with its events:

    positions go half a step with the speeds so far; position torques are taken there
    current      exact exponential under the mean speed of the step, its mean acts on the wheel
    each body    J (w+ - w) = h (push - drag (w+ + w)/2 - dry friction), solved in closed form
                 with the stop inside the step (`step_laws`): a stuck body has speed zero
    positions    go on with the mean of both speeds, spring memory follows the deflection

Laws of the speed (Stribeck, arctangent, quadratic drag, damping between bodies) are evaluated
at the mean speed in a second pass. The precise engine (`integrator`) is the oracle; the error
of this one is measured by `benchmarks/step_halving.py`.
"""

import numpy as np
from numba import njit

import rsea_core.effects as e
import rsea_core.kernel as k
import rsea_core.step_laws as s
import rsea_core.step_parts as p
from rsea_core.terms.table import C0


def _advance(full):
    """The stepping with every effect, or the plain machine of the same equations.

    The plain one, in which `full` is a constant, keeps its numbers in registers.
    """

    def advance(plant, spring, fx, on, given, load_motion, wheel_motion, h, n, y):
        """Take n steps of length h from the state y; the joint torque of a rigid machine."""
        play, link, memory = full and on.play, full and on.link, full and on.memory
        rigid, error_on, thermal = full and on.rigid, full and on.error, full and on.thermal
        load_given, wheel_given = full and on.load_given, full and on.wheel_given
        terms, has_contact = full and on.any, full and plant.contact_angle < np.inf
        passes = on.passes if full else 1
        current, wheel, speed = y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED]
        load, load_speed = y[s.LOAD], y[s.LOAD_SPEED]
        output, output_speed = wheel, speed
        if play:
            output, output_speed = y[s.OUTPUT], y[s.OUTPUT_SPEED]
        # ---- the winding
        resistance, k_t, k_e = plant.resistance, plant.torque_per_ampere, plant.volts_per_speed
        if thermal:
            resistance *= 1.0 + fx[e.RESISTANCE_RISE] * y[s.WINDING_RISE]
            factor = 1.0 - fx[e.CONSTANT_FALL] * y[s.CASE_RISE]
            k_t, k_e = k_t * factor, k_e * factor
        electric = plant.drive == k.DUTY or plant.drive == k.VOLTAGE
        decay, lag, given_torque = 0.0, 0.0, 0.0
        copper = resistance
        if electric:
            resistance += given.command * given.command * fx[e.SOURCE_RESISTANCE]
            if plant.inductance > 0.0:
                x = h * resistance / plant.inductance
                decay = np.exp(-x)
                lag = (1.0 - decay) / x
            electric = given.enabled
        elif plant.drive == k.CURRENT:
            current = s.clip(given.command, plant.current_limit)
        elif plant.drive == k.MOTOR_TORQUE:
            given_torque = plant.torque_per_motor_torque * given.command
        if not given.enabled:
            current, given_torque = 0.0, 0.0
        settled = given.volts / resistance if electric else 0.0
        limit = plant.current_limit
        # dead time of a bridge takes voltage against the current, softly about zero: a resistance
        # that falls with the current, taken at the step's start (stiff, hence implicit)
        drop = 0.0
        if electric and fx[e.DEAD_TIME] != 0.0:
            drop = fx[e.DEAD_TIME] * plant.volts_per_command
        winding = resistance
        # ---- bodies
        front, behind, damping = plant.inertia, fx[e.BACKLASH_INERTIA], plant.damping
        if play:
            front -= behind
            damping -= fx[e.BACKLASH_DAMPING]
        tip_inertia = fx[e.LINK_INERTIA] if link else 0.0
        near = plant.load_inertia
        tip, tip_speed = y[s.LINK], y[s.LINK_SPEED]
        gear_stretch, load_stretch = y[s.GEAR_STRETCH], y[s.LOAD_STRETCH]
        heat, joint, deflection, stiffness = 0.0, 0.0, 0.0, spring[0, C0 + 1]
        if memory:
            deflection = p.deflection_of(plant, fx, output, load)
        for step in range(n):
            start = step * h
            half = 0.5 * h
            # ---- positions in the middle, and what depends on them
            load_after, load_speed_after = load, load_speed
            if load_given:
                load_middle, load_speed_middle = p.motion_at(load_motion, start + half)
                load_after, load_speed_after = p.motion_at(load_motion, start + h)
            else:
                load_middle, load_speed_middle = load + half * load_speed, load_speed
            wheel_after, speed_after = wheel, speed
            if wheel_given:
                wheel_middle, mean = p.motion_at(wheel_motion, start + half)
                wheel_after, speed_after = p.motion_at(wheel_motion, start + h)
            else:
                wheel_middle, mean = wheel + half * speed, speed
            output_middle, output_mean = wheel_middle, mean
            if play:
                output_middle, output_mean = output + half * output_speed, output_speed
            torque, lever = 0.0, 1.0
            deflection_middle = output_middle - load_middle
            if error_on:
                error, slope = p.angle_error(fx, output_middle, plant.gear_ratio)
                deflection_middle += error
                lever += slope
            if not rigid:
                if on.linear:
                    torque = stiffness * deflection_middle
                else:
                    torque = p.table_torque(spring, deflection_middle)
                if memory:
                    s.remember(fx, y, deflection_middle - deflection, half)
                    torque += s.remembered_torque(fx, y)
            push, load_push = 0.0, plant.load_torque
            factor = 1.0
            if terms:
                push = p.wheel_torque(fx, wheel_middle)
                if fx[e.RIPPLE] != 0.0:
                    factor += fx[e.RIPPLE] * np.sin(
                        fx[e.RIPPLE_CYCLES] * wheel_middle + fx[e.RIPPLE_PHASE]
                    )
                load_push -= fx[e.PARALLEL] * (load_middle - fx[e.PARALLEL_REST])
                if fx[e.UNBALANCE] != 0.0:
                    load_push -= fx[e.UNBALANCE] * np.sin(load_middle + fx[e.UNBALANCE_ANGLE])
                load_push += fx[e.PULSE] * p.pulse_share(fx, given.start + start, h)
            if plant.gravity != 0.0:
                load_push -= plant.gravity * np.sin(load_middle + plant.gravity_offset)
            load_drag = plant.load_damping
            if has_contact:
                pressed, damped = p.mean_contact(plant, fx, load, load_speed, h)
                load_push -= pressed
                load_drag += damped
            link_torque, tip_mean = 0.0, tip_speed
            if link:
                link_torque = fx[e.LINK_STIFFNESS] * (load_middle - tip - half * tip_speed)
            k_tf, k_ef = k_t * factor, k_e * factor
            if drop > 0.0:
                soft = fx[e.DEAD_TIME_CURRENT]
                size = max(abs(current), 1e-6 * soft)
                resistance = winding + drop * np.tanh(size / soft) / size
                settled = given.volts / resistance
                if plant.inductance > 0.0:
                    x = h * resistance / plant.inductance
                    decay = np.exp(-x)
                    lag = (1.0 - decay) / x
            free_mean = settled + (current - settled) * lag
            # ---- speeds, once with the old ones in the laws of the speed, then with their mean
            capped, held, done, after = False, current, 0, current
            way, load_way, tip_after = 0.0, 0.0, tip_speed
            stretch_after, load_stretch_after = gear_stretch, load_stretch
            output_after, output_way = output_speed, 0.0
            joint = 0.0
            while True:
                shaft, drag = push + given_torque, damping
                if electric and not capped:
                    shaft += k_tf * free_mean
                    drag += k_tf * k_ef / resistance * (1.0 - lag)
                else:
                    shaft += k_tf * held
                joined, load_shaft, load_drag_now = torque, load_push, load_drag
                if terms:
                    drag += fx[e.GEAR_VISCOUS]
                    if fx[e.SPRING_DAMPING] != 0.0:
                        joined += fx[e.SPRING_DAMPING] * (lever * output_mean - load_speed_middle)
                    if fx[e.ATAN_LEVEL] != 0.0:  # linear around the mean, implicit
                        x = mean / fx[e.ATAN_VELOCITY]
                        steep = fx[e.ATAN_LEVEL] / (fx[e.ATAN_VELOCITY] * (1.0 + x * x))
                        shaft -= fx[e.ATAN_LEVEL] * np.arctan(x) - steep * mean
                        drag += steep
                    if fx[e.DRAG] != 0.0:
                        load_drag_now += fx[e.DRAG] * abs(load_speed_middle)
                    if link:
                        twist = load_speed_middle - tip_mean
                        load_shaft -= link_torque + fx[e.LINK_DAMPING] * twist
                friction = free = load_friction = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                if on.wheel_dry:
                    carried = joined
                    if rigid:
                        carried = joint if done > 0 else -load_push
                    friction = free = p.gear_levels(fx, carried, mean, gear_stretch)
                    if play:  # between the flanks the mesh carries nothing
                        free = p.gear_levels(fx, 0.0, mean, gear_stretch)
                if on.load_dry:
                    load_friction = p.load_levels(plant, fx, load_middle, load_speed_middle)
                if rigid and not wheel_given:
                    both = (
                        friction[0] + load_friction[0], friction[1] + load_friction[1],
                        friction[2] + load_friction[2], friction[3] + load_friction[3],
                        friction[4] + load_friction[4], friction[5] + load_friction[5],
                    max(friction[6], load_friction[6]),
                    )  # fmt: skip
                    speed_after, way, stretch_after = s.move(
                        plant.inertia + near, drag + load_drag_now, shaft + load_shaft, both,
                        gear_stretch, speed, h,
                    )  # fmt: skip
                    load_speed_after, load_way, load_stretch_after = speed_after, way, stretch_after
                    slowed = load_shaft - load_drag_now * way / h
                    joint = near * (speed_after - speed) / h - slowed
                else:
                    if not wheel_given:
                        if play:
                            speed_after, way, stretch_after, output_after, output_way = s.play_move(
                                front, behind, drag, fx[e.BACKLASH_DAMPING], shaft,
                                -lever * joined, friction, free, gear_stretch, 0.5 * fx[e.BACKLASH],
                                (speed, output_speed, wheel - output), h,
                            )  # fmt: skip
                        else:
                            speed_after, way, stretch_after = s.move(
                                front,
                                drag,
                                shaft - lever * joined,
                                friction,
                                gear_stretch,
                                speed,
                                h,
                            )
                    if not load_given:
                        load_speed_after, load_way, load_stretch_after = s.move(
                            near, load_drag_now, joined + load_shaft, load_friction, load_stretch,
                            load_speed, h,
                        )  # fmt: skip
                    if rigid:
                        accelerating = plant.inertia * (speed_after - speed) / h
                        joint = shaft - drag * 0.5 * (speed + speed_after) - accelerating
                if link:
                    pulled = link_torque + fx[e.LINK_DAMPING] * (load_speed_middle - tip_mean)
                    tip_after = tip_speed + h * pulled / tip_inertia
                if wheel_given:
                    way = wheel_after - wheel
                mean = way / h
                if electric and not capped:
                    end = settled - k_ef * mean / resistance
                    after = end + (current - end) * decay
                    if abs(after) > limit:
                        capped = True
                        edge = limit if after > 0.0 else -limit
                        share = 0.0
                        if decay > 0.0 and after != current:
                            share = min(max((edge - current) / (after - current), 0.0), 1.0)
                        held = edge - 0.5 * share * (edge - current)
                        done = 0
                        continue
                done += 1
                if done >= passes:
                    break
                output_mean = output_way / h if play else mean
                tip_mean = 0.5 * (tip_speed + tip_after)
                if not load_given:
                    load_speed_middle = load_way / h
            # ---- on to the end of the step
            if electric:
                mean_current = held
                if capped:
                    current = limit if after > 0.0 else -limit
                else:
                    end = settled - k_ef * mean / resistance
                    mean_current = end + (current - end) * lag
                    current = end + (current - end) * decay
                heat += mean_current * mean_current
            else:
                heat += current * current
            wheel = wheel_after if wheel_given else wheel + way
            load = load_after if load_given else load + load_way
            speed, load_speed = speed_after, load_speed_after
            gear_stretch, load_stretch = stretch_after, load_stretch_after
            if play:
                output, output_speed = output + output_way, output_after
            else:
                output = wheel
            if link:
                tip += 0.5 * h * (tip_speed + tip_after)
                tip_speed = tip_after
            if memory:
                deflection = p.deflection_of(plant, fx, output, load)
                s.remember(fx, y, deflection - deflection_middle, half)
        if electric and plant.inductance == 0.0:
            current = s.clip(settled - k_e * speed / resistance, limit)
        y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED] = current, wheel, speed
        y[s.LOAD], y[s.LOAD_SPEED] = load, load_speed
        y[s.OUTPUT], y[s.OUTPUT_SPEED] = output, output_speed if play else speed
        y[s.LINK], y[s.LINK_SPEED] = (tip, tip_speed) if link else (load, load_speed)
        y[s.GEAR_STRETCH], y[s.LOAD_STRETCH] = gear_stretch, load_stretch
        if thermal:
            s.warm_up(fx, y, copper * heat / n, n * h)
        return joint

    return njit(error_model="numpy")(advance)


advance = _advance(True)
advance_plain = _advance(False)
