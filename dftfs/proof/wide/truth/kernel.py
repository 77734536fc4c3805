"""The integrator: drift, kick, drift, with every internal state exact at a frozen speed.

Speeds are advanced by the implicit midpoint rule in three fixed-point iterations; the bristles,
the winding, the stops and the Maxwell branches take the midpoint speed and are exact there. Of
second order for smooth laws (`tests/dftfs/proof/wide/truth/test_kernel.py`).
"""

import math

import numpy as np
from numba import njit

from dftfs.proof.truth_laws import bristle, bristle_torque
from dftfs.proof.wide.truth.body import (
    BRANCHES,
    BY_CURRENT,
    LOCKED,
    NO_DRIVE,
    OUTPUTS,
    STOPS,
)

ITERATIONS = 3
COLUMNS = len(OUTPUTS)
CORNER = 0.03  # share of a gap, a dead zone or a contact's onset over which its corner is round


@njit(cache=True, error_model="numpy", forceinline=True)
def beyond(x, edge, corner):
    """max(|x| - edge, 0) with the sign of x; the corner is round."""
    y = abs(x) - edge
    e = corner * edge
    zero = 0.5 * (-edge + math.sqrt(edge * edge + e * e))
    return math.copysign(0.5 * (y + math.sqrt(y * y + e * e)) - zero, x)


@njit(cache=True, error_model="numpy", forceinline=True)
def elastic(b, x, d):
    """The spring without memory at deflection d."""
    if x.gap > 0.0:
        d = beyond(d, 0.5 * x.gap, CORNER)
    k, c = b.stiffness, x.hardening
    torque = k * d
    if c > 0.0:
        torque = k * math.sinh(c * d) / c
    elif c < 0.0:
        torque = k * math.atan(-c * d) / -c
    if x.touch_stiffness > 0.0 and x.touch_side * d >= 0.0:
        torque += x.touch_stiffness * beyond(d, x.touch_at, CORNER)
    return torque


@njit(cache=True, error_model="numpy", forceinline=True)
def winding(b, x, i, w, u, kelvin, dt):
    """Current after a time at a frozen speed of the motor and command. Exact."""
    if x.dead_zone > 0.0:
        u = beyond(u, x.dead_zone, CORNER)
    if u < 0.0:
        u *= 1.0 - x.gain_minus
    if b.drive == BY_CURRENT:
        return min(b.current_limit, max(-b.current_limit, u))
    ohm = b.resistance * (1.0 + x.copper_per_K * kelvin)
    volts = u * (b.supply - x.source_ohm * abs(u * i))
    emf = b.emf_constant * (1.0 + x.magnet_per_K * kelvin)
    end = (volts - emf * w) / ohm
    if b.inductance > 0.0:
        end += (i - end) * math.exp(-ohm * dt / b.inductance)
    return min(b.current_limit, max(-b.current_limit, end))


@njit(cache=True, error_model="numpy", forceinline=True)
def motor_torque(b, x, i, q, kelvin):
    """Torque of the motor at the output: current, iron, magnets and cogging."""
    torque = b.torque_constant * (1.0 + x.magnet_per_K * kelvin) * i
    torque /= 1.0 + (i / x.iron_A) ** 2
    if x.cogging != 0.0:
        torque += x.cogging * math.sin(
            x.cogging_cycles * b.gear_ratio * q + x.cogging_phase
        ) - x.cogging * math.sin(x.cogging_phase)
    return b.gear_ratio * torque


@njit(cache=True, error_model="numpy", forceinline=True)
def gear_loss(x, w, z, kelvin):
    """Dry friction of the gear, and the grease."""
    loss = 0.0
    if x.gear_plus > 0.0:
        loss += bristle_torque(
            z, w, x.gear_plus, x.gear_minus, x.gear_static, x.gear_stribeck, x.gear_bristle, 0.0
        )
    if x.grease > 0.0:
        y = w / x.grease_speed
        loss += x.grease * y * (y * y + 1e-4) ** -0.3
    return loss


@njit(cache=True, error_model="numpy", forceinline=True)
def load_loss(b, x, q, w, z):
    """Torque that the load's joint takes: gravity, springs, friction, drag, magnet."""
    loss = b.load_viscous * w + x.parallel * q
    if b.gravity != 0.0:
        loss += b.gravity * math.sin(q + b.gravity_offset)
    if x.unbalance != 0.0:
        loss += x.unbalance * math.sin(q + x.unbalance_angle)
    if x.load_coulomb > 0.0:
        top = x.load_coulomb
        if x.angle_share > 0.0:
            top *= 1.0 + x.angle_share * math.sin(x.angle_cycles * q)
        loss += bristle_torque(z, w, top, top, x.load_static, x.load_stribeck, x.load_bristle, 0.0)
    if x.drag > 0.0:
        loss += x.drag * math.copysign(abs(w) ** x.drag_exponent, w)
    if x.magnet != 0.0:
        y = (q - x.magnet_angle) / x.magnet_reach
        loss += x.magnet * 2.33 * y * math.exp(-y * y)
    return loss


@njit(cache=True, error_model="numpy", forceinline=True)
def branch_torque(x, d, branches):
    """Torque of the Maxwell branches; ``branches``: the deflections of their dampers."""
    torque = 0.0
    for j in range(BRANCHES):
        if x.branch_stiffness[j] > 0.0:
            torque += x.branch_stiffness[j] * (d - branches[j])
    return torque


@njit(cache=True, error_model="numpy", forceinline=True)
def stop_torques(x, change, stops):
    """Torque of the elastic stops after a change of deflection from their state."""
    torque = 0.0
    for j in range(STOPS):
        if x.stop_stiffness[j] > 0.0:
            top = x.stop_torque[j]
            torque += min(top, max(-top, stops[j] + x.stop_stiffness[j] * change))
    return torque


@njit(cache=True, error_model="numpy", forceinline=True)
def advance_spring(x, d, d_end, stops):
    """Stops a step later."""
    for j in range(STOPS):
        if x.stop_stiffness[j] > 0.0:
            top = x.stop_torque[j]
            stops[j] = min(top, max(-top, stops[j] + x.stop_stiffness[j] * (d_end - d)))


@njit(cache=True, error_model="numpy", forceinline=True)
def relax(x, d, half, branches):
    """The Maxwell branches half a step later at a frozen deflection."""
    for j in range(BRANCHES):
        if x.branch_stiffness[j] > 0.0:
            branches[j] = d + (branches[j] - d) * math.exp(-half / x.branch_time[j])


@njit(cache=True, error_model="numpy", forceinline=True)
def transmitted(x, inertia_up, inertia_down, given, taken, z):
    """Acceleration of a rigid axis whose gear loses a share of the torque that it transmits.

    ``given``: torque at the gear without its loss; ``taken``: what the load takes beside its
    inertia. The share depends on the direction of power, the side on the bristle's.
    """
    side = z / x.gear_bristle
    for share in (x.share_driving, x.share_back):
        for sign in (1.0, -1.0):
            f = sign * side * share
            a = (given - taken * (1.0 + f)) / (inertia_up + inertia_down * (1.0 + f))
            torque = inertia_down * a + taken
            drives = torque * side >= 0.0
            if torque * sign >= 0.0 and drives == (share == x.share_driving):
                return a
    return (given - taken) / (inertia_up + inertia_down)


@njit(cache=True, error_model="numpy", forceinline=True)
def error_angle(b, x, q):
    """Transmission error at the output and its derivative by the output angle."""
    e, slope = 0.0, 0.0
    if x.wheel_error != 0.0:
        e += x.wheel_error * (math.sin(q + x.wheel_phase) - math.sin(x.wheel_phase))
        slope += x.wheel_error * math.cos(q + x.wheel_phase)
    if x.worm_error != 0.0:
        n = b.gear_ratio
        e += x.worm_error * (math.sin(n * q + x.worm_phase) - math.sin(x.worm_phase))
        slope += n * x.worm_error * math.cos(n * q + x.worm_phase)
    return e, slope


@njit(cache=True, error_model="numpy", forceinline=True)
def accelerations(b, x, mode, motion, i, internal, out):
    """Accelerations of gear output, load and tip at a midpoint, and the spring's torque.

    ``motion``: three angles, three speeds; ``i``: current, kelvin, push, the angle at which the
    load is clamped and the deflection before the step; ``internal``: the two bristles, the stops
    and the branches. Writes ``out`` (4,).
    """
    q, w = motion
    z, stops, branches = internal
    n = b.gear_ratio
    inertia = n * n * b.motor_inertia + b.output_inertia
    up = 0.0
    if b.drive != NO_DRIVE:
        up = motor_torque(b, x, i[0], q[0], i[1]) - gear_loss(x, w[0], z[0], i[1])
        up -= (n * n * b.motor_viscous + b.output_viscous) * w[0]
    down = load_loss(b, x, q[1], w[1], z[1]) - i[2]
    bulk, tip = b.load_inertia, 0.0
    if x.tip_share > 0.0:
        tip = x.tip_share * bulk
        bulk -= tip
        link_torque = x.link_stiffness * (q[2] - q[1]) + x.link_damping * (w[2] - w[1])
        out[2] = -link_torque / tip
        down -= link_torque
    if x.clamp_stiffness > 0.0:
        down += x.clamp_stiffness * (q[1] - i[3]) + x.clamp_damping * w[1]
    out[3] = 0.0
    if b.sprung == 0:
        if x.share_driving > 0.0:
            out[0] = transmitted(x, inertia, bulk, up, down, z[0])
        else:
            out[0] = (up - down) / (inertia + bulk)
        out[1] = out[0]
        return
    e, slope = error_angle(b, x, q[0])
    d = q[0] + e - q[1]
    torque = elastic(b, x, d) + branch_torque(x, d, branches) + stop_torques(x, d - i[4], stops)
    lost = 0.0
    if x.share_driving > 0.0:
        side = z[0] / x.gear_bristle
        share = x.share_driving if torque * side >= 0.0 else x.share_back
        lost = share * abs(torque) * side
    out[0] = (up - torque * (1.0 + slope) - lost) / inertia
    out[1] = 0.0 if mode == LOCKED and x.clamp_stiffness == 0.0 else (torque - down) / bulk
    out[3] = torque


@njit(cache=True, error_model="numpy", forceinline=True)
def warm(b, x, i, step, state):
    """Winding and case a step later, in place. Explicit: a step is short against both."""
    heat = i * i * b.resistance * (1.0 + x.copper_per_K * state[1])
    flow = (state[1] - state[2]) / x.winding_to_case
    state[1] += step * (heat - flow) / x.winding_capacity
    state[2] += step * (flow - state[2] / x.case_to_air) / x.case_capacity


@njit(cache=True, error_model="numpy", forceinline=True)
def step_once(b, x, mode, inputs, motion, internal):
    """One step in place.

    ``inputs``: step, command and external torque; ``motion``: three angles, three speeds;
    ``internal``: current, winding and case warmth, clamp angle, torque; bristles; stops;
    branches; room (5, 5).
    """
    step, u, pulse = inputs
    q, w = motion
    state, z, stops, branches, room = internal
    wm, qm, zm, acc, given = room[0], room[1], room[2], room[3], room[4]
    given[1], given[2], given[3] = state[1], pulse, state[3]
    half, d_start = 0.5 * step, 0.0
    if b.sprung == 1:
        d_start = q[0] + error_angle(b, x, q[0])[0] - q[1]
        relax(x, d_start, half, branches)
    given[4] = d_start
    for j in range(3):
        wm[j] = w[j]
    for _ in range(ITERATIONS):
        for j in range(3):
            qm[j] = q[j] + half * wm[j]
        if b.drive != NO_DRIVE:
            given[0] = winding(b, x, state[0], b.gear_ratio * wm[0], u, state[1], half)
        if x.gear_plus > 0.0 or x.share_driving > 0.0:
            zm[0] = bristle(z[0], wm[0], half, x.gear_bristle, x.gear_static, x.gear_stribeck)
        if x.load_coulomb > 0.0:
            zm[1] = bristle(z[1], wm[1], half, x.load_bristle, x.load_static, x.load_stribeck)
        accelerations(b, x, mode, (qm, wm), given, (zm, stops, branches), acc)
        for j in range(3):
            wm[j] = w[j] + half * acc[j]
    z[0] = bristle(z[0], wm[0], step, x.gear_bristle, x.gear_static, x.gear_stribeck)
    z[1] = bristle(z[1], wm[1], step, x.load_bristle, x.load_static, x.load_stribeck)
    if b.drive != NO_DRIVE:
        state[0] = winding(b, x, state[0], b.gear_ratio * wm[0], u, state[1], step)
        warm(b, x, given[0], step, state)
    for j in range(3):
        q[j] += step * wm[j]
        w[j] = 2.0 * wm[j] - w[j]
    if b.sprung == 1:
        d_end = q[0] + error_angle(b, x, q[0])[0] - q[1]
        advance_spring(x, d_start, d_end, stops)
        relax(x, d_end, half, branches)
        state[4] = elastic(b, x, d_end) + branch_torque(x, d_end, branches)
        state[4] += stop_torques(x, 0.0, stops)
    else:
        q[1], w[1] = q[0], w[0]


@njit(cache=True, error_model="numpy", forceinline=True)
def next_command(loop, reference, angle, before):
    """A PD's command of a counted angle; ``before``: last count and filtered speed, in place."""
    if loop.count > 0.0:
        angle = loop.count * math.floor(angle / loop.count + 0.5)
    before[1] += 0.4 * (angle - before[0] - before[1])
    before[0] = angle
    u = loop.proportional * (reference - angle) - loop.derivative * before[1]
    return min(loop.limit, max(-loop.limit, u))


@njit(cache=True, error_model="numpy", nogil=True)
def run(b, x, loop, mode, step, u, pulse, start):
    """Integrate one recording.

    ``u``: the command acting in the middle of each step (n,), or, with a loop, reference at each
    step and an added command (n, 2) handed in as two halves of one array (2 n,). Returns the
    outputs at the n + 1 ends of the steps (n + 1, 7) and the loop's command at every step (n,).
    """
    n = pulse.size
    closed = loop.proportional > 0.0
    q, w = np.full(3, start.angle), np.full(3, start.speed)
    if mode == LOCKED:
        w[:] = 0.0
    state = np.array([0.0, start.winding_K, start.case_K, start.angle, 0.0])
    z, stops, branches = np.zeros(2), np.zeros(STOPS), np.zeros(BRANCHES)
    room, out, commanded = np.zeros((5, 5)), np.empty((n + 1, COLUMNS)), np.zeros(n)
    before, internal = np.array([start.angle, 0.0]), (state, z, stops, branches, room)
    command = 0.0
    for k in range(n + 1):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = q[0], w[0], q[1], w[1]
        out[k, 4], out[k, 5], out[k, 6] = state[0], state[4], state[2]
        if k == n:
            break
        acting = u[k]
        if closed:
            if k % loop.tick == 0:
                command = next_command(loop, u[k], q[0], before)
            commanded[k] = command
            acting = u[n + k] + (commanded[k - loop.delay] if k >= loop.delay else 0.0)
        step_once(b, x, mode, (step, acting, pulse[k]), (q, w), internal)
        if b.inductance == 0.0 or b.drive == BY_CURRENT:
            out[k, 4] = state[0]  # a current without memory answers to the row's own command
    return out, commanded
