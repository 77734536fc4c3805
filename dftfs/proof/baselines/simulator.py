"""A free run of the contract's nominal machine with learned torques at its three ports."""

import math

import numpy as np
from numba import njit

from dftfs.proof.machine import CONTACT, FREE, LOCKED, Machine

SUBSTEPS = 4
STRIBECK_RAD_PER_S = (0.05, 0.15, 0.5)
UNITS = np.array([0.1, 1.0, 1.0, 0.3])  # deflection, output speed, link speed, link angle
PORTS = 3  # gear output, spring, link
CREEP_RAD_PER_S = 0.02  # below this speed a learned dry friction fades


def _names() -> list[str]:
    x = ("deflection", "output-speed", "link-speed", "link-angle")
    names = ["one", *x]
    names += [f"{x[i]} {x[j]}" for i in range(4) for j in range(i, 4)]
    names += [f"{x[i]} {x[j]} {x[k]}" for i in range(4) for j in range(i, 4) for k in range(j, 4)]
    names += ["output-sign", "link-sign"]
    names += [f"output-stribeck-{v:g}" for v in STRIBECK_RAD_PER_S]
    names += ["load-sign", "load-stribeck", "output-square", "link-square", "direction"]
    return [*names, "sin 1", "cos 1", "sin 2", "cos 2"]


NAMES = _names()


@njit(cache=True, error_model="numpy")
def fill(x, motor_angle, out):
    """The dictionary at one state; x: deflection, output speed, link speed and angle, scaled."""
    n = 0
    out[n] = 1.0
    n += 1
    for i in range(4):
        out[n] = x[i]
        n += 1
    for i in range(4):
        for j in range(i, 4):
            out[n] = x[i] * x[j]
            n += 1
    for i in range(4):
        for j in range(i, 4):
            for k in range(j, 4):
                out[n] = x[i] * x[j] * x[k]
                n += 1
    output, link = math.tanh(x[1] / CREEP_RAD_PER_S), math.tanh(x[2] / CREEP_RAD_PER_S)
    out[n], out[n + 1] = output, link
    out[n + 2] = output * math.exp(-((x[1] / 0.05) ** 2))
    out[n + 3] = output * math.exp(-((x[1] / 0.15) ** 2))
    out[n + 4] = output * math.exp(-((x[1] / 0.5) ** 2))
    out[n + 5] = abs(x[0]) * output
    out[n + 6] = abs(x[0]) * output * math.exp(-((x[1] / 0.15) ** 2))
    out[n + 7], out[n + 8] = x[1] * abs(x[1]), x[2] * abs(x[2])
    out[n + 9] = abs(output)
    for k in range(2):
        out[n + 10 + 2 * k] = math.sin((k + 1) * motor_angle)
        out[n + 11 + 2 * k] = math.cos((k + 1) * motor_angle)


@njit(cache=True, error_model="numpy")
def dictionary(x, motor_angle, size):
    """`fill` at every sample. Shapes (samples, 4) and (samples,) to (samples, size)."""
    out = np.empty((x.shape[0], size))
    for k in range(x.shape[0]):
        fill(x[k], motor_angle[k], out[k])
    return out


@njit(cache=True, error_model="numpy")
def torques(x, motor_angle, weights, centres, inverse_length, features, out):
    """Learned torques at the ports: a dictionary, or kernels about centres where there are any."""
    size = weights.shape[1]
    if centres.shape[0] == 0:
        fill(x, motor_angle, features)
    else:
        for j in range(size):
            square = 0.0
            for i in range(4):
                square += ((x[i] - centres[j, i]) * inverse_length) ** 2
            features[j] = math.exp(-0.5 * square)
    for port in range(3):
        out[port] = 0.0
        for j in range(size):
            out[port] += weights[port, j] * features[j]


@njit(cache=True, error_model="numpy")
def free_run(m, mode, interval, duty, start, weights, centres, inverse_length):
    """Motor angle, link angle and spring torque per sample; NaN from where the run explodes."""
    out = np.empty((duty.size, 3))
    step = interval / SUBSTEPS
    n = m.gear_ratio
    inertia = m.motor_inertia_kgm2 + m.output_inertia_kgm2 / n**2
    damping = m.motor_viscous_Nms_per_rad + m.output_viscous_Nms_per_rad / n**2
    gravity = 0.0 if mode == FREE else m.load_mass_kg * 9.80665 * m.load_distance_m
    keep = math.exp(-m.terminal_resistance_ohm * step / m.terminal_inductance_H)
    xm, xl, wm, wl, i = start[0], start[1], 0.0, 0.0, 0.0
    x, features, port_Nm = np.zeros(4), np.zeros(weights.shape[1]), np.zeros(3)
    for k in range(duty.size):
        x[0], x[1], x[2], x[3] = xm / n - xl, wm / n, wl, xl
        x /= UNITS
        torques(x, xm, weights, centres, inverse_length, features, port_Nm)
        torque = m.spring_stiffness_Nm_per_rad * (xm / n - xl) + port_Nm[1]
        out[k, 0], out[k, 1], out[k, 2] = xm, xl, torque
        for _ in range(SUBSTEPS):  # the learned torques are held over a sample
            xm += 0.5 * step * wm
            xl += 0.5 * step * wl
            end = duty[k] * m.supply_voltage_V - m.back_emf_constant_Vs_per_rad * wm
            end /= m.terminal_resistance_ohm
            i = end + (i - end) * keep
            i = min(m.current_limit_A, max(-m.current_limit_A, i))
            torque = m.spring_stiffness_Nm_per_rad * (xm / n - xl) + port_Nm[1]
            drive = m.torque_constant_Nm_per_A * i - (torque + port_Nm[0]) / n
            wm = (wm + step * drive / inertia) / (1.0 + step * damping / inertia)
            if mode != LOCKED:
                load_Nm = torque - gravity * math.sin(xl + m.gravity_angle_offset_rad) - port_Nm[2]
                deep = xl - m.contact_angle_rad
                if mode == CONTACT and deep > 0.0:
                    load_Nm -= m.contact_stiffness_Nm_per_rad * deep
                    load_Nm -= m.contact_damping_Nms_per_rad * wl
                loss = m.load_viscous_Nms_per_rad / m.load_inertia_kgm2
                wl = (wl + step * load_Nm / m.load_inertia_kgm2) / (1.0 + step * loss)
            xm += 0.5 * step * wm
            xl += 0.5 * step * wl
        if not (abs(xm) < 1e5 and abs(xl) < 1e3 and abs(wm) < 1e5):
            out[k:] = np.nan
            break
    return out


def predict(
    machine: Machine,
    mode: int,
    interval_s: float,
    duty: np.ndarray,
    start: np.ndarray,
    weights: np.ndarray,
    centres: np.ndarray | None = None,
    length: float = 1.0,
) -> dict[str, np.ndarray]:
    """Readings of a free run with learned torques; ``weights``: (ports, features or centres)."""
    out = free_run(
        machine,
        mode,
        interval_s,
        duty,
        start,
        np.ascontiguousarray(weights),
        np.zeros((0, 4)) if centres is None else centres,
        1.0 / length,
    )
    return {"motor_angle_rad": out[:, 0], "load_angle_rad": out[:, 1], "torque_Nm": out[:, 2]}
