"""The compiled integrator of the true machine.

Drift, kick, drift (Strang 1968; Leimkuhler and Reich, Simulating Hamiltonian Dynamics, 2004,
chapter 4): positions move half a step, bristles, stops, Maxwell branches and the current are
advanced by their exact solution at frozen speed, the bodies get one kick by the explicit
mid-point rule, and the second halves follow in reverse order. Second order; nothing is set
valued, because every friction has a bristle with a length.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from dftfs.proof.machine import AMBIENT_C, CONTACT, COPPER_PER_K, FREE, LOCKED
from dftfs.proof.truth_laws import (
    Winding,
    advance_loop,
    applied_duty,
    bristle,
    bristle_torque,
    contact_torque,
    current_after,
    gear_error,
    spring_torque,
    teeth_torque,
    thread_share,
)

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
LOOP, CURRENT, DEFLECTION, SLIP, WINDING, CASE, ERROR_ZERO = range(7)  # of `State.rest`


class State(NamedTuple):
    """Of the machine between two steps.

    ``x``, ``v``: positions and speeds of motor, gear output, mount, load and tip; ``z``: bristles
    of gear, thread and load; ``stops``, ``branches``: of the spring; ``rest``: by `LOOP` to
    `ERROR_ZERO`.
    """

    x: np.ndarray
    v: np.ndarray
    z: np.ndarray
    stops: np.ndarray
    branches: np.ndarray
    rest: np.ndarray


class Inputs(NamedTuple):
    """One value per sample.

    ``command``: duty or ampere, held; ``gain`` and ``volts``: supply relative to its nominal and
    offset of the bridge; ``ext``: torque on the load in Nm.
    """

    command: np.ndarray
    gain: np.ndarray
    volts: np.ndarray
    ext: np.ndarray


class Run(NamedTuple):
    """How a recording is made: load by `machine.LOAD_MODES`, kind of command, s and steps."""

    mode: int
    by_current: bool
    interval: float
    substeps: int


class Acting(NamedTuple):
    """What acts on the bodies at one instant.

    ``e1``, ``e2``: derivatives of the transmission error by the motor angle; ``motor_Nm``,
    ``spring_Nm``, ``load_Nm``: torques of winding, spring and surroundings; ``lost``: worm less
    gear output in rad.
    """

    e1: float
    e2: float
    motor_Nm: float
    spring_Nm: float
    load_Nm: float
    lost: float


@njit(cache=True, error_model="numpy", forceinline=True)
def drive_torque(m, p, cogging, x, v, z, acting):
    """Torque on the motor but for the gear's: winding, losses, friction, cogging, detent."""
    wm = v[0]
    drive = acting.motor_Nm - m.motor_viscous_Nms_per_rad * wm
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
        n = m.gear_ratio
        drive -= p.detent_share * acting.spring_Nm * math.sin(p.detent_cycles * x[0] / n) / n
    return drive


@njit(cache=True, error_model="numpy", forceinline=True)
def drive_accelerations(m, p, cogging, x, v, z, acting):
    """Accelerations of motor, gear output and mount."""
    wm, torque_s = v[0], acting.spring_Nm
    ratio = 1.0 / m.gear_ratio + acting.e1
    drive = drive_torque(m, p, cogging, x, v, z, acting)
    aw, ah = 0.0, 0.0
    if p.teeth_stiffness_Nm_per_rad > 0.0:
        rate = ratio * wm + v[2] - v[1]
        torque_w = teeth_torque(p, acting.lost, rate)
        share = thread_share(p, torque_w, z[1], wm)
        am = (drive - share * ratio * torque_w) / m.motor_inertia_kgm2
        aw = (torque_w - m.output_viscous_Nms_per_rad * v[1] - torque_s) / m.output_inertia_kgm2
        if p.mount_inertia_kgm2 > 0.0:
            ah = (
                -torque_w - p.mount_stiffness_Nm_per_rad * x[2] - p.mount_damping_Nms_per_rad * v[2]
            ) / p.mount_inertia_kgm2
    else:
        slow = torque_s + m.output_viscous_Nms_per_rad * ratio * wm
        slow += m.output_inertia_kgm2 * acting.e2 * wm * wm
        share = thread_share(p, slow, z[1], wm)
        inertia = m.motor_inertia_kgm2 + share * ratio * ratio * m.output_inertia_kgm2
        am = (drive - share * ratio * slow) / inertia
    return am, aw, ah


@njit(cache=True, error_model="numpy", forceinline=True)
def load_accelerations(m, p, mode, x, v, z, acting):
    """Accelerations of load and tip."""
    if mode == LOCKED:
        return 0.0, 0.0
    gravity = m.load_mass_kg * 9.80665 * m.load_distance_m if mode != FREE else 0.0
    wl = v[3]
    torque = acting.spring_Nm - m.load_viscous_Nms_per_rad * wl + acting.load_Nm
    torque -= bristle_torque(
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
        torque -= math.copysign(p.drag_coefficient * abs(wl) ** p.drag_exponent, wl)
    if mode != FREE:
        torque -= p.unbalance_Nm * math.sin(x[3] + p.unbalance_angle_rad)
    torque -= p.parallel_stiffness_Nm_per_rad * x[3]
    if p.magnet_Nm > 0.0:  # towards the magnet, most strongly one reach from it
        away = (x[3] - p.magnet_angle_rad) / p.magnet_reach_rad
        torque -= p.magnet_Nm * away * math.exp(0.5 * (1.0 - away * away))
    if mode == CONTACT:
        torque -= contact_torque(m, p, x[3] - m.contact_angle_rad, wl)
    if p.tip_share == 0.0:
        torque -= gravity * math.sin(x[3] + m.gravity_angle_offset_rad)
        return torque / m.load_inertia_kgm2, 0.0
    link = p.link_stiffness_Nm_per_rad * (x[3] - x[4]) + p.link_damping_Nms_per_rad * (wl - v[4])
    al = (torque - link) / ((1.0 - p.tip_share) * m.load_inertia_kgm2)
    tip = link - gravity * math.sin(x[4] + m.gravity_angle_offset_rad)
    return al, tip / (p.tip_share * m.load_inertia_kgm2)


@njit(cache=True, error_model="numpy")
def at_rest(m, p, series, start, internal):
    """The state before the first sample.

    ``start``: motor angle, place of the gear output in its backlash (-1 to 1) and load angle;
    ``internal``: winding and case temperature.
    """
    x, v, z, rest = np.zeros(5), np.zeros(5), np.zeros(3), np.zeros(7)
    stops, branches = np.zeros(series.stops.shape[0]), np.zeros(series.branches.shape[0])
    x[0], x[3], x[4] = start[0], start[2], start[2]
    rest[WINDING], rest[CASE] = internal[0], internal[1]
    # the gear's error is counted from where the encoders were zeroed
    rest[ERROR_ZERO], _, _ = gear_error(series.gear_error, x[0])
    output = x[0] / m.gear_ratio
    if p.teeth_stiffness_Nm_per_rad > 0.0:
        x[1] = x[0] / m.gear_ratio + 0.5 * p.backlash_rad * start[1]
        output = x[1]
    rest[DEFLECTION] = output - x[3]
    branches[:] = rest[DEFLECTION]
    return State(x, v, z, stops, branches, rest)


@njit(cache=True, error_model="numpy")
def read(m, p, series, state, row):
    """The exact readings of a state, by `OUTPUTS`."""
    x, v, rest = state.x, state.v, state.rest
    row[0], row[1], row[3] = x[0], x[3], rest[CURRENT]
    row[2] = spring_torque(
        m, p, series.branches, rest[DEFLECTION], state.stops, rest[LOOP], state.branches
    )
    row[4], row[5], row[6], row[7] = v[0], v[3], rest[WINDING], rest[CASE]


@njit(cache=True, error_model="numpy", forceinline=True)
def move_bristles(p, state, half):
    """The bristles of gear, thread and load half a step later, speeds frozen."""
    v, z = state.v, state.z
    if p.gear_coulomb_plus_Nm > 0.0:
        ratio, stribeck = p.gear_static_ratio, p.gear_stribeck_rad_per_s
        z[0] = bristle(z[0], v[0], half, p.gear_bristle_rad, ratio, stribeck)
    if p.worm_friction_rad > 0.0:
        z[1] = bristle(z[1], v[0], half, p.worm_bristle_rad, 1.0, 1.0)
    if p.load_coulomb_Nm > 0.0:
        ratio, stribeck = p.load_static_ratio, p.load_stribeck_rad_per_s
        z[2] = bristle(z[2], v[3], half, p.load_bristle_rad, ratio, stribeck)


@njit(cache=True, error_model="numpy", forceinline=True)
def strain(m, p, series, state, decay):
    """Move the spring's inner states to the present positions.

    Returns the derivatives of the transmission error, the spring's torque, and worm less gear
    output.
    """
    x, rest, branches = state.x, state.rest, state.branches
    e, e1, e2 = gear_error(series.gear_error, x[0])
    path = x[0] / m.gear_ratio + e - rest[ERROR_ZERO] + x[2]
    output = x[1] if p.teeth_stiffness_Nm_per_rad > 0.0 else path
    now = output - x[3] - rest[SLIP]
    change = now - rest[DEFLECTION]
    rest[LOOP] = advance_loop(p, series.stops, change, state.stops, rest[LOOP])
    for j in range(branches.size):
        branches[j] = now + (branches[j] - now) * decay[j]
    torque = spring_torque(m, p, series.branches, now, state.stops, rest[LOOP], branches)
    if abs(torque) > p.clamp_slip_Nm:
        over = math.copysign(abs(torque) - p.clamp_slip_Nm, torque)
        rest[SLIP] += over / m.spring_stiffness_Nm_per_rad
        now -= over / m.spring_stiffness_Nm_per_rad
        torque -= over
    rest[DEFLECTION] = now
    return e1, e2, torque, path - output


@njit(cache=True, error_model="numpy", forceinline=True)
def kick(m, p, series, mode, state, v_mid, acting, step):
    """Change the speeds over a step, by the explicit mid-point rule; v_mid (5,) is scratch."""
    x, v, z = state.x, state.v, state.z
    half = 0.5 * step
    am, aw, ah = drive_accelerations(m, p, series.cogging, x, v, z, acting)
    al, at = load_accelerations(m, p, mode, x, v, z, acting)
    v_mid[0], v_mid[1], v_mid[2] = v[0] + half * am, v[1] + half * aw, v[2] + half * ah
    v_mid[3], v_mid[4] = v[3] + half * al, v[4] + half * at
    am, aw, ah = drive_accelerations(m, p, series.cogging, x, v_mid, z, acting)
    al, at = load_accelerations(m, p, mode, x, v_mid, z, acting)
    v[0] += step * am
    v[1] += step * aw
    v[2] += step * ah
    v[3] += step * al
    v[4] += step * at


@njit(cache=True, error_model="numpy")
def warm(p, rest, heat_W, interval):
    """Temperatures of winding and case after a sample."""
    winding, case = rest[WINDING], rest[CASE]
    flow = (winding - case) / p.winding_to_case_K_per_W
    winding += interval * (heat_W - flow) / p.winding_capacity_J_per_K
    rest[WINDING] = winding
    air = (case - AMBIENT_C) / p.case_to_air_K_per_W
    rest[CASE] = case + interval * (flow - air) / p.case_capacity_J_per_K


@njit(cache=True, error_model="numpy")
def advance(m, p, series, run, k, inputs, state):
    """One sample, the k-th of ``inputs``."""
    x, v, rest = state.x, state.v, state.rest
    v_mid = np.zeros(5)
    step = run.interval / run.substeps
    half = 0.5 * step
    decay = np.exp(-half / series.branches[:, 1])
    gain, volts, i = inputs.gain[k], inputs.volts[k], rest[CURRENT]
    resistance = m.terminal_resistance_ohm * (1.0 + COPPER_PER_K * (rest[WINDING] - AMBIENT_C))
    magnet = 1.0 - p.magnet_loss_per_K * (rest[CASE] - AMBIENT_C)
    keep = math.exp(-resistance * half / m.terminal_inductance_H)
    winding = Winding(resistance, m.back_emf_constant_Vs_per_rad * magnet, keep)
    heat = 0.0
    for s in range(run.substeps):
        late = k
        if p.delay_s > 0.0:
            late = math.floor((k * run.interval + s * step - p.delay_s) / run.interval + 1e-9)
        u = inputs.command[late] if late >= 0 else 0.0
        duty = applied_duty(p, u) * gain
        if run.by_current:
            i = min(m.current_limit_A, max(-m.current_limit_A, u * gain))
        else:
            i = current_after(m, p, i, v[0], duty, volts, winding)
        for j in range(5):
            x[j] += half * v[j]
        move_bristles(p, state, half)
        e1, e2, torque, lost = strain(m, p, series, state, decay)
        motor_Nm = m.torque_constant_Nm_per_A * magnet * i
        acting = Acting(e1, e2, motor_Nm, torque, inputs.ext[k], lost)
        kick(m, p, series, run.mode, state, v_mid, acting, step)
        move_bristles(p, state, half)
        for j in range(5):
            x[j] += half * v[j]
        strain(m, p, series, state, decay)
        if not run.by_current:
            i = current_after(m, p, i, v[0], duty, volts, winding)
        heat += i * i * resistance
    rest[CURRENT] = i
    warm(p, rest, heat / run.substeps, run.interval)


@njit(cache=True, error_model="numpy")
def integrate(m, p, series, run, inputs, start, internal):
    """Run one recording of machine ``m`` with effects ``p`` and `Series`.

    ``start``, ``internal``: as `at_rest`. Returns readings (samples x `OUTPUTS`) and the internal
    states at the end; NaN from where the motion leaves every bound.
    """
    out = np.empty((inputs.command.size, 8))
    state = at_rest(m, p, series, start, internal)
    motor, rest = state.x, state.rest
    for k in range(inputs.command.size):
        read(m, p, series, state, out[k])
        advance(m, p, series, run, k, inputs, state)
        if abs(motor[0]) > 1e6 or motor[0] != motor[0]:
            out[k:] = np.nan
            break
    return out, np.array([rest[WINDING], rest[CASE]])
