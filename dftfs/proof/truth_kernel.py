"""The compiled integrator of the true machine.

Drift, kick, drift (Strang 1968; Leimkuhler and Reich, Simulating Hamiltonian Dynamics, 2004,
chapter 4): positions move half a step, bristles, stops, Maxwell branches and the current are
advanced by their exact solution at frozen speed, the bodies get one kick by the explicit
mid-point rule, and the second halves follow in reverse order. Second order; nothing is set
valued, because every friction has a bristle with a length.
"""

import math

import numpy as np
from numba import njit

from dftfs.proof.machine import AMBIENT_C, CONTACT, COPPER_PER_K, FREE, LOCKED

OUTPUTS = (
    "motor_angle_rad",
    "load_angle_rad",
    "torque_Nm",
    "current_A",
    "motor_velocity_rad_per_s",
    "load_velocity_rad_per_s",
    "winding_C",
    "temperature_C",
)
LOOP, CURRENT, BEND, SLIP, WINDING, CASE, ERROR_ZERO = range(7)  # of a state's last array
FOOT_RAD = 1.0e-3  # the corner where coils start to touch is rounded over this
WORM_BRISTLE_S, WORM_FADE_RAD_PER_S = 2.0e-3, 1.0  # damping of the thread's bristles
DEAD_ZONE_FOOT = 0.05  # share of the half-width over which its corner is rounded


@njit(cache=True, error_model="numpy")
def bristle(z, w, step, length, ratio, stribeck):
    """The bristle's deflection a step later, speed frozen: exact for dz/dt = w - |w| z / g(w)."""
    if w == 0.0:
        return z
    limit = length
    if ratio != 1.0:
        limit *= 1.0 + (ratio - 1.0) * math.exp(-((w / stribeck) ** 2))
    end = math.copysign(limit, w)
    return end + (z - end) * math.exp(-abs(w) * step / limit)


@njit(cache=True, error_model="numpy")
def bristle_torque(z, w, plus, minus, ratio, stribeck, length, damping):
    """Torque that opposes the motion: bristle stiffness and the damping that fades with speed."""
    top = plus if z > 0.0 else minus
    if top == 0.0:
        return 0.0
    fade = math.exp(-((w / stribeck) ** 2))
    rate = w - abs(w) * z / (length * (1.0 + (ratio - 1.0) * fade))
    return top * z / length + damping * fade * rate


@njit(cache=True, error_model="numpy")
def elastic_torque(m, p, d):
    """The spring without memory: sinh or sine law, and the ramp where the coils touch."""
    k, b = m.spring_stiffness_Nm_per_rad, p.hardening_per_rad
    if b > 0.0:
        torque = k * math.sinh(b * d) / b
    elif b < 0.0:
        torque = k * math.sin(-b * d) / -b
    else:
        torque = k * d
    side = p.coils_touch_side
    if p.coils_touch_stiffness_Nm_per_rad > 0.0 and (side == 0.0 or side * d > 0.0):
        x = abs(d) - p.coils_touch_rad
        ramp = 0.5 * (x + math.sqrt(x * x + FOOT_RAD**2))
        x0 = -p.coils_touch_rad
        ramp -= 0.5 * (x0 + math.sqrt(x0 * x0 + FOOT_RAD**2))
        torque += math.copysign(p.coils_touch_stiffness_Nm_per_rad * ramp, d)
    return torque


@njit(cache=True, error_model="numpy")
def advance_memory(p, rows, change, stops, loop):
    """Stops and Bouc-Wen loop after a change of deflection; returns the loop's state in [-1, 1]."""
    for j in range(stops.size):
        top = rows[j, 1]
        stops[j] = min(top, max(-top, stops[j] + rows[j, 0] * change))
    if p.loop_torque_Nm > 0.0 and change != 0.0:
        grow = 1.0 if change * loop > 0.0 else 0.0
        loop += change / p.loop_yield_rad * (1.0 - grow * abs(loop) ** p.loop_exponent)
        loop = min(1.0, max(-1.0, loop))
    return loop


@njit(cache=True, error_model="numpy")
def spring_torque(m, p, rows, d, stops, loop, branches):
    torque = elastic_torque(m, p, d) + p.loop_torque_Nm * loop
    for j in range(stops.size):
        torque += stops[j]
    for j in range(branches.size):
        torque += rows[j, 0] * (d - branches[j])
    return torque


@njit(cache=True, error_model="numpy")
def gear_error(rows, theta_m):
    """Position error at the wheel and its first two derivatives by the motor angle."""
    e, e1, e2 = 0.0, 0.0, 0.0
    for j in range(rows.shape[0]):
        a, n = rows[j, 0], rows[j, 1]
        phase = n * theta_m + rows[j, 2]
        s, c = math.sin(phase), math.cos(phase)
        e += a * s
        e1 += a * n * c
        e2 -= a * n * n * s
    return e, e1, e2


@njit(cache=True, error_model="numpy")
def cone(p, torque_w, z, w):
    """Share of the ideal worm torque that the thread asks for: force on an inclined plane."""
    if p.worm_friction_rad == 0.0:
        return 1.0
    length = p.worm_bristle_rad
    rate = w - abs(w) * z / length
    bent = z + WORM_BRISTLE_S * math.exp(-((w / WORM_FADE_RAD_PER_S) ** 2)) * rate
    friction = p.worm_friction_rad * bent / length * (1.0 if torque_w > 0.0 else -1.0)
    return math.tan(p.worm_lead_rad + friction) / math.tan(p.worm_lead_rad)


@njit(cache=True, error_model="numpy")
def teeth_torque(p, lost, rate):
    """Torque through the teeth; ``lost`` is worm less wheel, free within half the backlash."""
    x = abs(lost) - 0.5 * p.backlash_rad
    if x <= 0.0:
        return 0.0
    side = math.copysign(1.0, lost)
    push = p.teeth_stiffness_Nm_per_rad * x + p.teeth_damping_Nms_per_rad * rate * side
    return side * max(0.0, push)  # teeth push, they never pull


@njit(cache=True, error_model="numpy")
def contact_torque(m, p, x, rate):
    if x <= 0.0:
        return 0.0
    if p.contact_exponent == 1.0:
        return m.contact_stiffness_Nm_per_rad * x + m.contact_damping_Nms_per_rad * rate
    bulk = x**p.contact_exponent  # Hunt and Crossley 1975: damping grows with the depth
    return p.contact_power_stiffness * bulk + p.contact_power_damping * bulk * rate


@njit(cache=True, error_model="numpy")
def applied_duty(p, duty):
    w = p.dead_zone_duty
    if w == 0.0:
        return duty
    x, f = abs(duty) - w, DEAD_ZONE_FOOT * w
    out = 0.5 * (x + math.sqrt(x * x + f * f)) - 0.5 * (-w + math.sqrt(w * w + f * f))
    return math.copysign(out, duty)


@njit(cache=True, error_model="numpy")
def current_after(m, p, i, w, duty, volts, resistance, emf, keep):
    """Winding current a step later at frozen speed, exact; ``keep`` is exp(-R step / L)."""
    drop = p.source_resistance_ohm * abs(duty * i)
    voltage = duty * (m.supply_voltage_V - drop) + volts
    end = (voltage - emf * w) / resistance
    i = end + (i - end) * keep
    return min(m.current_limit_A, max(-m.current_limit_A, i))


@njit(cache=True, error_model="numpy")
def accelerations(m, p, g, cogging, mode, x, v, z, i_torque, torque_s, ext, lost):
    """Accelerations of motor, wheel, mount, load and tip. x, v: those five; z: three bristles.

    ``g``: derivatives of the gear's error by the motor angle.
    """
    n = m.gear_ratio
    wm = v[0]
    ratio = 1.0 / n + g[0]
    drive = i_torque - m.motor_viscous_Nms_per_rad * wm
    drive -= bristle_torque(
        z[0],
        wm,
        p.gear_coulomb_plus_Nm,
        p.gear_coulomb_minus_Nm,
        p.gear_static_ratio,
        p.gear_stribeck_rad_per_s,
        p.gear_bristle_rad,
        p.gear_bristle_damping_Nms_per_rad,
    )
    for j in range(cogging.shape[0]):
        drive -= cogging[j, 0] * math.sin(cogging[j, 1] * x[0] + cogging[j, 2])
    if p.detent_share > 0.0:
        drive -= p.detent_share * torque_s * math.sin(p.detent_cycles * x[0] / n) / n
    aw, ah = 0.0, 0.0
    if p.teeth_stiffness_Nm_per_rad > 0.0:
        rate = ratio * wm + v[2] - v[1]
        torque_w = teeth_torque(p, lost, rate)
        am = (drive - cone(p, torque_w, z[1], wm) * ratio * torque_w) / m.motor_inertia_kgm2
        aw = (torque_w - m.output_viscous_Nms_per_rad * v[1] - torque_s) / m.output_inertia_kgm2
        if p.mount_inertia_kgm2 > 0.0:
            ah = (
                -torque_w - p.mount_stiffness_Nm_per_rad * x[2] - p.mount_damping_Nms_per_rad * v[2]
            ) / p.mount_inertia_kgm2
    else:
        slow = torque_s + m.output_viscous_Nms_per_rad * ratio * wm
        slow += m.output_inertia_kgm2 * g[1] * wm * wm
        share = cone(p, slow, z[1], wm)
        inertia = m.motor_inertia_kgm2 + share * ratio * ratio * m.output_inertia_kgm2
        am = (drive - share * ratio * slow) / inertia
    if mode == LOCKED:
        return am, aw, ah, 0.0, 0.0
    gravity = m.load_mass_kg * 9.80665 * m.load_distance_m if mode != FREE else 0.0
    wl = v[3]
    push = torque_s - m.load_viscous_Nms_per_rad * wl + ext
    push -= bristle_torque(
        z[2],
        wl,
        p.load_coulomb_Nm,
        p.load_coulomb_Nm,
        p.load_static_ratio,
        p.load_stribeck_rad_per_s,
        p.load_bristle_rad,
        p.load_bristle_damping_Nms_per_rad,
    )
    if p.drag_coefficient > 0.0:
        push -= math.copysign(p.drag_coefficient * abs(wl) ** p.drag_exponent, wl)
    if mode != FREE:
        push -= p.unbalance_Nm * math.sin(x[3] + p.unbalance_angle_rad)
    push -= p.parallel_stiffness_Nm_per_rad * x[3]
    if p.magnet_Nm > 0.0:  # drawn to the magnet, most strongly one reach away from it
        away = (x[3] - p.magnet_angle_rad) / p.magnet_reach_rad
        push -= p.magnet_Nm * away * math.exp(0.5 * (1.0 - away * away))
    if mode == CONTACT:
        push -= contact_torque(m, p, x[3] - m.contact_angle_rad, wl)
    if p.tip_share == 0.0:
        push -= gravity * math.sin(x[3] + m.gravity_angle_offset_rad)
        return am, aw, ah, push / m.load_inertia_kgm2, 0.0
    link = p.link_stiffness_Nm_per_rad * (x[3] - x[4]) + p.link_damping_Nms_per_rad * (wl - v[4])
    al = (push - link) / ((1.0 - p.tip_share) * m.load_inertia_kgm2)
    tip = link - gravity * math.sin(x[4] + m.gravity_angle_offset_rad)
    return am, aw, ah, al, tip / (p.tip_share * m.load_inertia_kgm2)


@njit(cache=True, error_model="numpy")
def at_rest(m, p, gear_rows, stop_rows, branch_rows, start, memory):
    """The state before the first sample.

    ``start``: motor, wheel's place in its play (-1..1) and load angle; ``memory``: winding and
    case temperature. Returns positions and speeds of motor, wheel, mount, load and tip; bristles;
    stops; branches; and by `LOOP` to `ERROR_ZERO` the rest.
    """
    x, v, z, rest = np.zeros(5), np.zeros(5), np.zeros(3), np.zeros(7)
    stops, branches = np.zeros(stop_rows.shape[0]), np.zeros(branch_rows.shape[0])
    x[0], x[3], x[4] = start[0], start[2], start[2]
    rest[WINDING], rest[CASE] = memory[0], memory[1]
    # the gear's error is counted from where the encoders were zeroed
    rest[ERROR_ZERO], _, _ = gear_error(gear_rows, x[0])
    wheel = x[0] / m.gear_ratio
    if p.teeth_stiffness_Nm_per_rad > 0.0:
        x[1] = x[0] / m.gear_ratio + 0.5 * p.backlash_rad * start[1]
        wheel = x[1]
    rest[BEND] = wheel - x[3]
    branches[:] = rest[BEND]
    return x, v, z, stops, branches, rest


@njit(cache=True, error_model="numpy")
def read(m, p, branch_rows, state, row):
    """The exact readings of a state, by `OUTPUTS`."""
    x, v, _, stops, branches, rest = state
    row[0], row[1], row[3] = x[0], x[3], rest[CURRENT]
    row[2] = spring_torque(m, p, branch_rows, rest[BEND], stops, rest[LOOP], branches)
    row[4], row[5], row[6], row[7] = v[0], v[3], rest[WINDING], rest[CASE]


@njit(cache=True, error_model="numpy")
def advance(
    m, p, tables, mode, by_current, interval, substeps, now_at, command, gain, volts, ext, state
):
    """One sample: ``now_at`` is its number in ``command``; the rest of its inputs are its own."""
    gear_rows, cogging, stop_rows, branch_rows = tables
    x, v, z, stops, branches, rest = state
    v_mid = np.zeros(5)
    step = interval / substeps
    half = 0.5 * step
    compliant = p.teeth_stiffness_Nm_per_rad > 0.0
    decay = np.exp(-half / branch_rows[:, 1])
    loop, i, d, slip = rest[LOOP], rest[CURRENT], rest[BEND], rest[SLIP]
    winding, case = rest[WINDING], rest[CASE]
    resistance = m.terminal_resistance_ohm * (1.0 + COPPER_PER_K * (winding - AMBIENT_C))
    magnet = 1.0 - p.magnet_loss_per_K * (case - AMBIENT_C)
    emf = m.back_emf_constant_Vs_per_rad * magnet
    keep = math.exp(-resistance * half / m.terminal_inductance_H)
    heat = 0.0
    for s in range(substeps):
        late = now_at
        if p.delay_s > 0.0:
            late = math.floor((now_at * interval + s * step - p.delay_s) / interval + 1e-9)
        u = command[late] if late >= 0 else 0.0
        duty = applied_duty(p, u) * gain
        if by_current:
            i = min(m.current_limit_A, max(-m.current_limit_A, u * gain))
        else:
            i = current_after(m, p, i, v[0], duty, volts, resistance, emf, keep)
        for j in range(5):
            x[j] += half * v[j]
        for turn in range(2):  # the two halves of the inner states around the kick
            if p.gear_coulomb_plus_Nm > 0.0:
                z[0] = bristle(
                    z[0],
                    v[0],
                    half,
                    p.gear_bristle_rad,
                    p.gear_static_ratio,
                    p.gear_stribeck_rad_per_s,
                )
            if p.worm_friction_rad > 0.0:
                z[1] = bristle(z[1], v[0], half, p.worm_bristle_rad, 1.0, 1.0)
            if p.load_coulomb_Nm > 0.0:
                z[2] = bristle(
                    z[2],
                    v[3],
                    half,
                    p.load_bristle_rad,
                    p.load_static_ratio,
                    p.load_stribeck_rad_per_s,
                )
            if turn == 1:
                for j in range(5):
                    x[j] += half * v[j]
            e, e1, e2 = gear_error(gear_rows, x[0])
            path = x[0] / m.gear_ratio + e - rest[ERROR_ZERO] + x[2]
            wheel = x[1] if compliant else path
            now = wheel - x[3] - slip
            loop = advance_memory(p, stop_rows, now - d, stops, loop)
            for j in range(branches.size):
                branches[j] = now + (branches[j] - now) * decay[j]
            d = now
            torque_s = spring_torque(m, p, branch_rows, d, stops, loop, branches)
            if abs(torque_s) > p.clamp_slip_Nm:
                over = math.copysign(abs(torque_s) - p.clamp_slip_Nm, torque_s)
                slip += over / m.spring_stiffness_Nm_per_rad
                d -= over / m.spring_stiffness_Nm_per_rad
                torque_s -= over
            if turn == 0:
                push = m.torque_constant_Nm_per_A * magnet * i
                lost = path - wheel
                a = accelerations(m, p, (e1, e2), cogging, mode, x, v, z, push, torque_s, ext, lost)
                for j in range(5):
                    v_mid[j] = v[j] + half * a[j]
                a = accelerations(
                    m, p, (e1, e2), cogging, mode, x, v_mid, z, push, torque_s, ext, lost
                )
                for j in range(5):
                    v[j] += step * a[j]
        if not by_current:
            i = current_after(m, p, i, v[0], duty, volts, resistance, emf, keep)
        heat += i * i * resistance
    rest[LOOP], rest[CURRENT], rest[BEND], rest[SLIP] = loop, i, d, slip
    flow = (winding - case) / p.winding_to_case_K_per_W
    winding += interval * (heat / substeps - flow) / p.winding_capacity_J_per_K
    rest[WINDING] = winding
    air = (case - AMBIENT_C) / p.case_to_air_K_per_W
    rest[CASE] = case + interval * (flow - air) / p.case_capacity_J_per_K


@njit(cache=True, error_model="numpy")
def integrate(
    m,
    p,
    gear_rows,
    cogging,
    stop_rows,
    branch_rows,
    mode,
    by_current,
    interval,
    substeps,
    start,
    memory,
    command,
    gain,
    volts,
    ext,
):
    """Run one recording of machine ``m``, effects ``p`` and the four tables of `Series`.

    ``start``, ``memory``: as `at_rest`; ``command``: duty or ampere per sample, held; ``gain`` and
    ``volts``: supply relative to its nominal and offset of the bridge per sample; ``ext``: torque
    on the load per sample. Returns readings (samples x `OUTPUTS`) and the memory at the end.
    """
    out = np.empty((command.size, 8))
    tables = (gear_rows, cogging, stop_rows, branch_rows)
    state = at_rest(m, p, gear_rows, stop_rows, branch_rows, start, memory)
    motor, rest = state[0], state[5]
    for k in range(command.size):
        read(m, p, branch_rows, state, out[k])
        advance(
            m, p, tables, mode, by_current, interval, substeps, k, command, gain[k], volts[k],
            ext[k], state,
        )  # fmt: skip
        if abs(motor[0]) > 1e6 or motor[0] != motor[0]:
            out[k:] = np.nan
            break
    return out, np.array([rest[WINDING], rest[CASE]])


@njit(cache=True, error_model="numpy")
def loop_torque(p, stop_rows, path):
    """Torque of stops and loop alone along a path of deflections."""
    stops = np.zeros(stop_rows.shape[0])
    loop, before = 0.0, 0.0
    out = np.empty(path.size)
    for k in range(path.size):
        loop = advance_memory(p, stop_rows, path[k] - before, stops, loop)
        before = path[k]
        out[k] = stops.sum() + p.loop_torque_Nm * loop
    return out
