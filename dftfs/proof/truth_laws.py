"""The laws of the true machine, one compiled function each: friction, spring, gear, drive, load."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

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


@njit(cache=True, error_model="numpy", forceinline=True)
def advance_loop(p, rows, change, stops, loop):
    """Stops and Bouc-Wen loop after a change of deflection; returns the loop's state in [-1, 1]."""
    for j in range(stops.size):
        top = rows[j, 1]
        stops[j] = min(top, max(-top, stops[j] + rows[j, 0] * change))
    if p.loop_torque_Nm > 0.0 and change != 0.0:
        grow = 1.0 if change * loop > 0.0 else 0.0
        loop += change / p.loop_yield_rad * (1.0 - grow * abs(loop) ** p.loop_exponent)
        loop = min(1.0, max(-1.0, loop))
    return loop


@njit(cache=True, error_model="numpy", forceinline=True)
def spring_torque(m, p, rows, d, stops, loop, branches):
    """Torque of the whole spring at deflection d: elastic, stops, loop and Maxwell branches."""
    torque = elastic_torque(m, p, d) + p.loop_torque_Nm * loop
    for j in range(stops.size):
        torque += stops[j]
    for j in range(branches.size):
        torque += rows[j, 0] * (d - branches[j])
    return torque


@njit(cache=True, error_model="numpy", forceinline=True)
def gear_error(rows, theta_m):
    """Transmission error at the gear output and two derivatives by the motor angle."""
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
def thread_share(p, torque_w, z, w):
    """Torque on the worm over its value without friction: force on an inclined plane."""
    if p.worm_friction_rad == 0.0:
        return 1.0
    length = p.worm_bristle_rad
    rate = w - abs(w) * z / length
    deflection = z + WORM_BRISTLE_S * math.exp(-((w / WORM_FADE_RAD_PER_S) ** 2)) * rate
    friction = p.worm_friction_rad * deflection / length * (1.0 if torque_w > 0.0 else -1.0)
    return math.tan(p.worm_lead_rad + friction) / math.tan(p.worm_lead_rad)


@njit(cache=True, error_model="numpy")
def teeth_torque(p, lost, rate):
    """Torque through the teeth; ``lost``: worm less gear output, free within half the backlash."""
    x = abs(lost) - 0.5 * p.backlash_rad
    if x <= 0.0:
        return 0.0
    side = math.copysign(1.0, lost)
    torque = p.teeth_stiffness_Nm_per_rad * x + p.teeth_damping_Nms_per_rad * rate * side
    return side * max(0.0, torque)  # a tooth cannot pull


@njit(cache=True, error_model="numpy")
def contact_torque(m, p, x, rate):
    """Torque of the environment at depth x: a linear spring and damper, or Hunt and Crossley's."""
    if x <= 0.0:
        return 0.0
    if p.contact_exponent == 1.0:
        return m.contact_stiffness_Nm_per_rad * x + m.contact_damping_Nms_per_rad * rate
    bulk = x**p.contact_exponent  # 1975: damping grows with the depth
    return p.contact_power_stiffness * bulk + p.contact_power_damping * bulk * rate


@njit(cache=True, error_model="numpy")
def applied_duty(p, duty):
    """Duty behind the bridge's dead zone, whose corners are rounded."""
    w = p.dead_zone_duty
    if w == 0.0:
        return duty
    x, f = abs(duty) - w, DEAD_ZONE_FOOT * w
    out = 0.5 * (x + math.sqrt(x * x + f * f)) - 0.5 * (-w + math.sqrt(w * w + f * f))
    return math.copysign(out, duty)


class Winding(NamedTuple):
    """Of one sample: ohm, Vs/rad, and exp(-R step / L) of half a step."""

    resistance: float
    emf: float
    keep: float


@njit(cache=True, error_model="numpy", forceinline=True)
def current_after(m, p, i, w, duty, volts, winding):
    """Winding current a step later at frozen speed, exact."""
    drop = p.source_resistance_ohm * abs(duty * i)
    voltage = duty * (m.supply_voltage_V - drop) + volts
    end = (voltage - winding.emf * w) / winding.resistance
    i = end + (i - end) * winding.keep
    return min(m.current_limit_A, max(-m.current_limit_A, i))


@njit(cache=True, error_model="numpy")
def loop_torque(p, stop_rows, path):
    """Torque of stops and loop alone along a path of deflections."""
    stops = np.zeros(stop_rows.shape[0])
    loop, before = 0.0, 0.0
    out = np.empty(path.size)
    for k in range(path.size):
        loop = advance_loop(p, stop_rows, path[k] - before, stops, loop)
        before = path[k]
        out[k] = stops.sum() + p.loop_torque_Nm * loop
    return out
