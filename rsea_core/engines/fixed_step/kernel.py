"""The body of the fast engine's kernel, which `stepping` compiles by numba and explains."""

import numpy as np

import rsea_core.effects.layout as e
import rsea_core.engines.fixed_step.body_moves as s
import rsea_core.engines.fixed_step.control_sample as judge
import rsea_core.engines.fixed_step.step_inputs as p
import rsea_core.engines.fixed_step.winding as w
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import C0

DONE = -1  # how a run ends; else the row that was not finite
HUGE = 1e100


def kernel(full: bool, version: int):
    """The function to be compiled: with every effect, or for plain machines (`p.PLAIN`)."""

    def advance(
        numbers, spring, fx, on, time, steps, command, supply, enabled, load_angle, load_rate,
        wheel_angle, wheel_rate, first, last, kept, y, out, states, controller, loop, limits,
        parameters, memory_of_it, reference, signals, answers, metrics,
    ):  # fmt: skip
        looped, keeps, asked = reference.shape[0] > 0, out.shape[0] > 0, 0.0
        plant = p.as_plant(numbers)
        play, link = full and on[p.PLAY] != 0, full and on[p.LINK] != 0
        memory, bearing = full and on[p.MEMORY] != 0, full and fx[e.NORMAL_FRICTION] > 0.0
        rigid, error_on = full and on[p.RIGID] != 0, full and on[p.ERROR] != 0
        thermal, terms = full and on[p.THERMAL] != 0, full and on[p.TERMS] != 0
        load_given, wheel_given = full and on[p.LOAD_GIVEN] != 0, full and on[p.WHEEL_GIVEN] != 0
        wheel_dry, load_dry, linear = on[p.WHEEL_DRY] != 0, on[p.LOAD_DRY] != 0, on[p.LINEAR] != 0
        losses = fx[e.GEAR_DRIVE_LOSS], fx[e.GEAR_BACKDRIVE_LOSS]
        lossy = rigid and not wheel_given and fx[e.GEAR_PRESLIDING] == 0.0
        lossy = lossy and (losses[0] != 0.0 or losses[1] != 0.0)
        has_contact = full and plant.contact_angle < np.inf
        passes = on[p.PASSES] if full else 1 + version * 0
        foresees = full and on[p.SPEED] != 0
        wheel_rate_before, load_rate_before = kept[p.WHEEL_RATE], kept[p.LOAD_RATE]
        delay = fx[e.COMMAND_DELAY]
        wound = plant.drive == mp.DUTY or plant.drive == mp.VOLTAGE
        measured = supply.size > 0 and plant.drive == mp.DUTY
        limit, stiffness = plant.current_limit, spring[0, C0 + 1]
        # ---- bodies
        front, behind, damping = plant.inertia, fx[e.BACKLASH_INERTIA], plant.damping
        if play:
            front -= behind
            damping -= fx[e.BACKLASH_DAMPING]
        tip_inertia = fx[e.LINK_INERTIA] if link else 0.0
        near = plant.load_inertia
        current, wheel, speed = y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED]
        load, load_speed = y[s.LOAD], y[s.LOAD_SPEED]
        output, output_speed = wheel, speed
        if play:
            output, output_speed = y[s.OUTPUT], y[s.OUTPUT_SPEED]
        tip, tip_speed = y[s.LINK], y[s.LINK_SPEED]
        gear_stretch, load_stretch = y[s.GEAR_STRETCH], y[s.LOAD_STRETCH]
        latest, joint = int(kept[p.LATEST]), kept[p.JOINT]
        load_motion = wheel_motion = p.Motion(load, 0.0, 0.0, 0.0)
        # ---- the winding; without inductance the current follows at once
        changing = full and (thermal or fx[e.SOURCE_RESISTANCE] != 0.0)
        one_way = changing and fx[e.SOURCE_ONE_WAY] != 0.0
        copper, k_t, k_e = p.warm_winding(plant, fx, y)
        resistance, per_ohm = copper, 1.0 / copper if copper > 0.0 else 0.0
        per_henry = 1.0 / plant.inductance if plant.inductance > 0.0 else 0.0
        rate = resistance * per_henry
        drop = fx[e.DEAD_TIME] * plant.volts_per_command
        # exponentials are kept from step to step while what they depend on stays
        decay, lag, bend, last_bend, decay_of = 0.0, 0.0, 0.0, 0.0, -1.0
        gains_of, region, deflection = -1.0, 0, 0.0
        if memory:
            deflection = p.deflection_of(fx, plant.gear_ratio, output, load)
        row, status = first, DONE
        while True:
            # ---- what the row reads
            at = row - first
            torque = joint
            if not rigid:
                now = deflection if memory else output - load
                if error_on and not memory:
                    now = p.deflection_of(fx, plant.gear_ratio, output, load)
                if linear:
                    torque = stiffness * now
                else:
                    torque, region = p.torque_near(spring, now, region)
                if full:
                    if memory:
                        torque += s.remembered_torque(fx, y)
                    torque += fx[e.SPRING_DAMPING] * (output_speed - load_speed)
            if keeps:
                out[at, p.MOTOR_ANGLE] = wheel * plant.gear_ratio
                out[at, p.LOAD_ANGLE] = load
                out[at, p.TORQUE] = torque
                out[at, p.READ_CURRENT] = current
                out[at, p.TEMPERATURE] = y[s.CASE_RISE]
                out[at, p.MOTOR_SPEED] = speed * plant.gear_ratio
                out[at, p.LOAD_SPEED_READ] = load_speed
            size = abs(current) + abs(wheel) + abs(speed) + abs(load) + abs(load_speed)
            size += abs(y[s.WINDING_RISE]) + abs(asked)
            if not size < HUGE and row > first:
                out[at:] = np.nan
                status = row
                break
            if looped:
                read = (
                    wheel * plant.gear_ratio, load, torque, current, y[s.CASE_RISE],
                    speed * plant.gear_ratio, load_speed,
                )  # fmt: skip
                asked = command[row] = judge.closed_loop(
                    plant.motor_count, plant.load_count, row, time, read, asked, controller, loop,
                    limits, parameters, memory_of_it, reference, signals, answers, metrics,
                )  # fmt: skip
                if keeps:
                    out[at, p.N_CHANNELS] = asked
            if row == last or states.shape[0] > 0:
                y[s.CURRENT], y[s.WHEEL], y[s.WHEEL_SPEED] = current, wheel, speed
                y[s.LOAD], y[s.LOAD_SPEED] = load, load_speed
                y[s.OUTPUT], y[s.OUTPUT_SPEED] = output, output_speed
                y[s.LINK], y[s.LINK_SPEED] = (tip, tip_speed) if link else (load, load_speed)
                y[s.GEAR_STRETCH], y[s.LOAD_STRETCH] = gear_stretch, load_stretch
                if states.shape[0] > 0:
                    states[at] = y[: s.N_STEP_STATES]
                if row == last:
                    break
            # ---- what acts in it; it is cut where a late command begins to act
            row_length, offset = time[row + 1] - time[row], 0.0
            if full:
                if load_angle.size > 0:
                    load_motion = p.motion_of(load_angle, load_rate, row, row_length)
                    wheel_motion = load_motion
                if wheel_angle.size > 0:
                    wheel_motion = p.motion_of(wheel_angle, wheel_rate, row, row_length)
            source = supply[row] if measured else plant.volts_per_command
            closed = enabled.size == 0 or enabled[row] != 0.0
            while offset < row_length:
                acting, end, n = row, row_length, steps[row]
                if delay > 0.0:
                    latest, end = p.next_piece(time, row, delay, offset, latest)
                    acting = latest
                    n = max(int(np.ceil(n * (end - offset) / row_length - 1e-9)), 1)
                told = p.acting_command(fx, command[acting]) if acting >= 0 else 0.0
                length, begin = end - offset, time[row] + offset
                h = length / n if n > 1 else length
                per_h = 1.0 / h
                half = 0.5 * h
                offset = end
                # ---- the winding
                if changing:
                    copper, k_t, k_e = p.warm_winding(plant, fx, y)
                    resistance = copper + p.source_ohm(fx, told, told)
                    per_ohm, rate = 1.0 / resistance, resistance * per_henry
                given_torque, settled = 0.0, 0.0
                electric = wound and closed
                if wound:
                    x = s.rounded(h) * rate
                    if x != decay_of:
                        decay_of = x
                        decay, lag, bend, last_bend = w.winding_gains(x)
                elif plant.drive == mp.CURRENT:
                    current = s.clip(told, limit)
                elif plant.drive == mp.MOTOR_TORQUE:
                    given_torque = plant.torque_per_motor_torque * told
                if electric:
                    settled = told * source * per_ohm
                if not closed:
                    current, given_torque = 0.0, 0.0
                if memory:
                    x = s.rounded(half)
                    if x != gains_of:
                        gains_of = x
                        s.branch_gains(fx, x, kept)
                heat = 0.0
                for step in range(n):
                    start = step * h
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
                        if linear:
                            torque = stiffness * deflection_middle
                        else:
                            torque, region = p.torque_near(spring, deflection_middle, region)
                        if memory:
                            s.remember(fx, y, deflection_middle - deflection, kept)
                            torque += s.remembered_torque(fx, y)
                    push, load_push = 0.0, plant.load_torque
                    factor = 1.0
                    if terms:
                        push = p.wheel_torque(fx, wheel_middle)
                        if fx[e.RIPPLE] != 0.0:
                            factor += fx[e.RIPPLE] * np.sin(
                                fx[e.RIPPLE_CYCLES] * wheel_middle + fx[e.RIPPLE_PHASE]
                            )
                        load_push = e.load_torque_by_angle(
                            fx, load_middle, load_speed_middle, load_push
                        )
                        load_push += fx[e.PULSE] * p.pulse_share(fx, begin + start, h)
                    across, down = 0.0, 1.0  # of the weight, where the load hangs
                    if plant.gravity != 0.0:
                        across = np.sin(load_middle + plant.gravity_offset)
                        load_push -= plant.gravity * across
                    if bearing:
                        hanging = load_middle + plant.gravity_offset
                        across, down = np.sin(hanging), np.cos(hanging)
                    load_drag = plant.load_damping
                    if has_contact:
                        pressed, damped = p.mean_contact(
                            fx, plant.contact_stiffness, plant.contact_damping,
                            load - plant.contact_angle, load_speed, h,
                        )  # fmt: skip
                        load_push -= pressed
                        load_drag += damped
                    link_torque, tip_mean = 0.0, tip_speed
                    if link:
                        link_torque = fx[e.LINK_STIFFNESS] * (load_middle - tip - half * tip_speed)
                    # ---- laws of the speed are taken at its mean, foreseen by the last step
                    tries = passes
                    if foresees:
                        if wheel_rate_before == wheel_rate_before:
                            if not wheel_given:
                                mean += half * wheel_rate_before
                            if not load_given:
                                load_speed_middle += half * load_rate_before
                            if not play:
                                output_mean = mean
                        else:
                            tries = 2
                    if one_way and electric:
                        final = (told * source - k_e * factor * mean) / copper
                        heading = w.near_mean(current, final, h * copper * per_henry)
                        resistance = copper + p.source_ohm(fx, told, heading)
                        per_ohm, rate = 1.0 / resistance, resistance * per_henry
                        settled, decay_of = told * source * per_ohm, s.rounded(h) * rate
                        decay, lag, bend, last_bend = w.winding_gains(decay_of)
                    if full and electric and drop > 0.0:
                        # dead time of a bridge takes voltage against the current, softly about
                        # zero: a resistance that falls with the current, of the step's mean one
                        reached = current
                        for _ in range(p.DEAD_TIME_PASSES):
                            size = max(abs(reached), 1e-6 * fx[e.DEAD_TIME_CURRENT])
                            lost = drop * np.tanh(size / fx[e.DEAD_TIME_CURRENT]) / size
                            per_ohm = 1.0 / (resistance + lost)
                            settled = told * source * per_ohm
                            x, decay_of = h * (resistance + lost) * per_henry, -1.0
                            decay, lag, bend, last_bend = w.winding_gains(x)
                            final = settled - k_e * factor * per_ohm * mean
                            reached = final + (current - final) * lag
                    k_tf, k_ef = k_t * factor, k_e * factor * per_ohm
                    free_mean = settled + (current - settled) * lag
                    capped, held, done, after = False, current, 0, current
                    way, load_way, tip_after = 0.0, 0.0, tip_speed
                    stretch_after, load_stretch_after = gear_stretch, load_stretch
                    output_after, output_way = output_speed, 0.0
                    joint = 0.0
                    while True:
                        shaft, drag = push + given_torque, damping
                        if electric and not capped:
                            shaft += k_tf * (free_mean - 2.0 * bend * k_ef * speed)
                            drag += k_tf * k_ef * (1.0 - lag - 2.0 * bend)
                        else:
                            shaft += k_tf * held
                        joined, load_shaft, load_drag_now = torque, load_push, load_drag
                        if terms:
                            drag += fx[e.GEAR_VISCOUS]
                            drag += fx[e.VISCOUS_SKEW] if mean > 0.0 else -fx[e.VISCOUS_SKEW]
                            if fx[e.SPRING_DAMPING] != 0.0:
                                joined += fx[e.SPRING_DAMPING] * (
                                    lever * output_mean - load_speed_middle
                                )
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
                        if full and wheel_dry:
                            carried = joined
                            if lossy:
                                carried = 0.0
                            elif rigid:
                                carried = joint if done > 0 else -load_push
                            slip = p.gear_slip(fx, mean)
                            friction = free = p.gear_levels(fx, slip, carried, mean, gear_stretch)
                            if play:  # between the flanks the mesh carries nothing
                                free = p.gear_levels(fx, slip, 0.0, mean, gear_stretch)
                            if fx[e.GEAR_BRISTLE_DAMPING] > 0.0:
                                bent = s.bending(friction, gear_stretch, h * mean)
                                drag += fx[e.GEAR_BRISTLE_DAMPING] * bent
                        if full and load_dry:
                            load_friction = p.load_levels(fx, across, down, load_speed_middle)
                            if fx[e.LOAD_BRISTLE_DAMPING] > 0.0:
                                bent = s.bending(load_friction, load_stretch, h * load_speed_middle)
                                load_drag_now += fx[e.LOAD_BRISTLE_DAMPING] * bent
                        if not full:
                            if wheel_dry:
                                forward, backward = p.gear_losses(fx, joined)
                                forward += fx[e.GEAR_FORWARD]
                                backward += fx[e.GEAR_BACKWARD]
                                speed_after, way = s.dry_move(
                                    front, drag, shaft - joined, forward, backward, forward,
                                    backward, speed, h,
                                )  # fmt: skip
                            else:
                                speed_after = s.slid(front, drag, shaft - joined, speed, h)
                                way = half * (speed + speed_after)
                            if load_dry:
                                level = fx[e.LOAD_COULOMB]
                                load_speed_after, load_way = s.dry_move(
                                    near, load_drag, joined + load_push, level, level, level,
                                    level, load_speed, h,
                                )  # fmt: skip
                            else:
                                load_speed_after = s.slid(
                                    near, load_drag, joined + load_push, load_speed, h
                                )
                                load_way = half * (load_speed + load_speed_after)
                        elif lossy:
                            speed_after, way, joint = s.lossy_move(
                                front, near, drag, load_drag_now, shaft, load_shaft, losses,
                                s.both_levels(friction, load_friction), speed, h,
                            )  # fmt: skip
                            load_speed_after, load_way = speed_after, way
                        elif rigid and not wheel_given:
                            speed_after, way, stretch_after = s.move(
                                front + near, drag + load_drag_now, shaft + load_shaft,
                                s.both_levels(friction, load_friction), gear_stretch, speed, h,
                            )  # fmt: skip
                            load_speed_after, load_way = speed_after, way
                            load_stretch_after = stretch_after
                            slowed = load_shaft - load_drag_now * way * per_h
                            joint = near * (speed_after - speed) * per_h - slowed
                        elif not wheel_given:
                            pull = -lever * joined
                            if play:
                                speed_after, way, stretch_after, output_after, output_way = (
                                    s.play_move(
                                        front, behind, drag, fx[e.BACKLASH_DAMPING], shaft, pull,
                                        friction, free, gear_stretch,
                                        (0.5 * fx[e.BACKLASH], fx[e.BACKLASH_REBOUND]),
                                        (speed, output_speed, wheel - output), h,
                                    )
                                )  # fmt: skip
                            else:
                                speed_after, way, stretch_after = s.move(
                                    front, drag, shaft + pull, friction, gear_stretch, speed, h
                                )
                        if full and not (load_given or (rigid and not wheel_given)):
                            load_speed_after, load_way, load_stretch_after = s.move(
                                near, load_drag_now, joined + load_shaft, load_friction,
                                load_stretch, load_speed, h,
                            )  # fmt: skip
                        if rigid and wheel_given:
                            accelerating = front * (speed_after - speed) * per_h
                            joint = shaft - drag * 0.5 * (speed + speed_after) - accelerating
                        if link:
                            pulled = link_torque + fx[e.LINK_DAMPING] * (
                                load_speed_middle - tip_mean
                            )
                            tip_after = tip_speed + h * pulled / tip_inertia
                        if wheel_given:
                            way = wheel_after - wheel
                        mean = way * per_h
                        if electric and not capped:
                            final = settled - k_ef * mean
                            gained = k_ef * (speed_after - speed)
                            after = final + (current - final) * decay - last_bend * gained
                            if abs(after) > limit:
                                capped = True
                                edge = limit if after > 0.0 else -limit
                                held = w.mean_to_edge(current, final, edge, s.rounded(h) * rate)
                                done = 0
                                continue
                        done += 1
                        if done >= tries:
                            break
                        output_mean = output_way * per_h if play else mean
                        tip_mean = 0.5 * (tip_speed + tip_after)
                        if not load_given:
                            load_speed_middle = load_way * per_h
                    # ---- on to the end of the step
                    if electric:
                        mean_current = held
                        if capped:
                            current = limit if after > 0.0 else -limit
                        else:
                            final = settled - k_ef * mean
                            gained = k_ef * (speed_after - speed)
                            mean_current = final + (current - final) * lag + bend * gained
                            current = after
                        heat += mean_current * mean_current
                    else:
                        heat += current * current
                    wheel = wheel_after if wheel_given else wheel + way
                    load = load_after if load_given else load + load_way
                    if foresees:
                        wheel_rate_before = (speed_after - speed) * per_h
                        load_rate_before = (load_speed_after - load_speed) * per_h
                    speed, load_speed = speed_after, load_speed_after
                    gear_stretch, load_stretch = stretch_after, load_stretch_after
                    if play:
                        output, output_speed = output + output_way, output_after
                    else:
                        output, output_speed = wheel, speed
                    if link:
                        tip += 0.5 * h * (tip_speed + tip_after)
                        tip_speed = tip_after
                    if memory:
                        deflection = p.deflection_of(fx, plant.gear_ratio, output, load)
                        s.remember(fx, y, deflection - deflection_middle, kept)
                if wound and closed and plant.inductance == 0.0:
                    current = s.clip(settled - k_e * speed * per_ohm, limit)
                if thermal:
                    s.warm_up(fx, y, copper * heat / n, length)
                if full and offset < row_length:
                    load_motion = p.later(load_motion, length)
                    wheel_motion = p.later(wheel_motion, length)
            row += 1
        kept[p.LATEST], kept[p.JOINT] = latest, joint
        kept[p.WHEEL_RATE], kept[p.LOAD_RATE] = wheel_rate_before, load_rate_before
        return status

    return advance
