"""The catalogue's effects on any axis: a size of 1 is about a tenth of the machine's own scale.

Each function returns what the effect changes at a size, and its comparable parameters; None
where the machine or its log has no place for it.
"""

from collections.abc import Callable

import numpy as np

from dftfs.proof.wide.machines import Drawn, logs
from dftfs.proof.wide.truth.applied import Applied
from dftfs.proof.wide.truth.body import BRANCHES, BY_VOLTAGE, COPPER_PER_K, STOPS
from dftfs.proof.wide.truth.simulate import Session

Effect = Callable[[float], Applied]
Draw = Callable[[np.random.Generator, Drawn, Session], Effect | None]


def deflection(m: Drawn) -> float:
    """Usual deflection of the spring, rad."""
    return m.torque / m.body.stiffness


def peak(session: Session, m: Drawn) -> float:
    return max(float(np.abs(p.command).max()) for p in session.planned if p.command.size)


def gear_friction(rng, m, session):
    if m.command is None:
        return None
    lean, static = rng.uniform(-0.25, 0.25), rng.choice([1.0, rng.uniform(1.05, 1.6)])
    slow, bristle = m.speed * logs(rng, (0.03, 0.2)), m.travel * logs(rng, (5e-4, 1e-2))

    def at(size):
        level = 0.1 * size * m.torque
        return Applied(name="gear-friction", subsystem="gear", extra={
            "gear_plus": level * (1 + lean), "gear_minus": level * (1 - lean),
            "gear_static": static, "gear_stribeck": slow, "gear_bristle": bristle},
            parameters={"coulomb_Nm": level / m.body.gear_ratio})  # fmt: skip

    return at


def load_friction(rng, m, session):
    if m.kind.load == "locked":
        return None
    static = rng.choice([1.0, rng.uniform(1.05, 1.5)])
    slow, bristle = m.speed * logs(rng, (0.03, 0.2)), m.travel * logs(rng, (5e-4, 1e-2))
    return lambda size: Applied(name="load-friction", subsystem="load", extra={
        "load_coulomb": 0.1 * size * m.torque, "load_static": static, "load_stribeck": slow,
        "load_bristle": bristle}, parameters={"coulomb_Nm": 0.1 * size * m.torque})  # fmt: skip


def gear_load_friction(rng, m, session):
    if m.command is None or m.body.gear_ratio < 3.0:
        return None
    more, bristle = rng.uniform(1.0, 2.5), m.travel * logs(rng, (5e-4, 5e-3))

    def at(size):
        drive = 0.15 * size
        back = min(0.9, more * drive / (1.0 + drive))
        return Applied(name="gear-load-friction", subsystem="gear", extra={
            "share_driving": drive, "share_back": back, "gear_bristle": bristle},
            parameters={"drive_efficiency": 1.0 / (1.0 + drive),
                        "backdrive_efficiency": 1.0 - back})  # fmt: skip

    return at


def gear_backlash(rng, m, session):
    if not m.body.stiffness or m.body.output_inertia > 0.0:
        return None
    return lambda size: Applied(
        name="gear-backlash", subsystem="gear", extra={"gap": 0.5 * size * deflection(m)},
        parameters={"width_rad": 0.5 * size * deflection(m)})  # fmt: skip


def gear_transmission_error(rng, m, session):
    if not m.body.stiffness:
        return None
    share = rng.uniform(0.2, 1.0) if m.travel * m.body.gear_ratio > 6.0 else 0.0
    a, b = rng.uniform(0.0, 2 * np.pi, 2)

    def at(size):
        wheel = 0.2 * size * deflection(m)
        worm = share * wheel / max(1.0, 0.05 * m.body.gear_ratio)
        return Applied(name="gear-transmission-error", subsystem="gear", extra={
            "wheel_error": wheel, "wheel_phase": a, "worm_error": worm, "worm_phase": b},
            parameters={"wheel_amplitude_rad": wheel, "worm_amplitude_rad": worm})  # fmt: skip

    return at


def motor_cogging(rng, m, session):
    turns = m.travel * m.body.gear_ratio / (2 * np.pi)
    cycles = [n for n in (4, 6, 8, 12, 14, 24, 36) if 0.7 < n * turns < 60.0]
    if m.command is None or m.kind.linear or not cycles:
        return None
    n, phase = float(rng.choice(cycles)), rng.uniform(0.0, 2 * np.pi)

    def at(size):
        top = 0.15 * size * m.torque / m.body.gear_ratio
        return Applied(name="motor-cogging", subsystem="gear", extra={
            "cogging": top, "cogging_cycles": n, "cogging_phase": phase},
            parameters={"amplitude_Nm": top, "cycles_per_rev": n})  # fmt: skip

    return at


def drive_dead_zone(rng, m, session):
    if m.command is None:
        return None
    top = peak(session, m)
    full = {"duty": 1.0, "voltage_V": m.body.supply}.get(m.command, m.body.current_limit)
    return lambda size: Applied(
        name="drive-dead-zone", subsystem="drive", extra={"dead_zone": min(0.4, 0.08 * size) * top},
        parameters={"width_duty": min(0.4, 0.08 * size) * top / full})  # fmt: skip


def drive_saturation(rng, m, session):
    if m.body.drive != BY_VOLTAGE and m.command is None:
        return None
    if m.command == "duty" and rng.random() < 0.5:
        return lambda size: Applied(
            name="drive-saturation", subsystem="drive",
            extra={"source_ohm": 0.15 * size * m.body.resistance},
            parameters={"source_resistance_ohm": 0.15 * size * m.body.resistance})  # fmt: skip
    if m.command != "current_command_A":
        return None
    top = peak(session, m)
    return lambda size: Applied(
        name="drive-saturation", subsystem="drive",
        body={"current_limit": top * max(0.2, 1.0 - 0.3 * size)},
        parameters={"current_limit_A": top * max(0.2, 1.0 - 0.3 * size)})  # fmt: skip


def drive_thermal(rng, m, session):
    if m.command is None:
        return None
    end = sum(float(p.rows_s[-1]) for p in session.planned)
    heat = 0.2 * (m.torque / (m.body.gear_ratio * m.body.torque_constant)) ** 2 * m.body.resistance
    rise, fast_s = rng.uniform(60.0, 140.0), end * logs(rng, (0.1, 0.6))
    copper, magnet = COPPER_PER_K, -rng.uniform(0.0, 0.002)

    def at(size):
        out = size * rise / heat
        return Applied(name="drive-thermal", subsystem="drive", extra={
            "winding_to_case": 0.6 * out, "case_to_air": 0.4 * out,
            "winding_capacity": fast_s / (0.6 * out), "case_capacity": 8 * fast_s / (0.4 * out),
            "copper_per_K": copper, "magnet_per_K": magnet})  # fmt: skip

    return at


def drive_delay(rng, m, session):
    if m.command is None:
        return None
    row = float(np.median(np.diff(session.planned[0].rows_s)))
    return lambda size: Applied(
        name="drive-delay", subsystem="drive", delay_s=2.0 * row + 0.04 * size * m.cycle_s,
        parameters={"delay_s": 2.0 * row + 0.04 * size * m.cycle_s})  # fmt: skip


def spring_hysteresis(rng, m, session):
    if not m.body.stiffness:
        return None
    count = int(rng.integers(2, STOPS + 1))
    at_d = np.geomspace(0.05, rng.uniform(0.3, 1.0), count) * deflection(m)
    share = rng.dirichlet(np.ones(count))

    def at(size):
        torque = np.zeros(STOPS)
        torque[:count] = 0.1 * size * m.torque * share
        k = np.zeros(STOPS)
        k[:count] = torque[:count] / at_d
        lost = np.clip(k[:count] * 0.15, 0.0, torque[:count])
        energy = float(np.sum(np.where(k[:count] * 0.15 > torque[:count],
                                       4 * torque[:count] * (0.15 - at_d), 0.0)))  # fmt: skip
        return Applied(name="spring-hysteresis", subsystem="spring", extra={
            "stop_stiffness": k, "stop_torque": np.where(torque > 0, torque, 1.0)},
            parameters={"loop_width_Nm": 2 * float(lost.sum()), "loop_energy_J": energy}
            if at_d.max() < 0.075 else {})  # fmt: skip

    return at


def spring_hardening(rng, m, session):
    if not m.body.stiffness:
        return None
    sign = rng.choice([1.0, 1.0, -1.0])

    def at(size):
        b = sign * 0.8 * np.sqrt(min(size, 4.0)) / deflection(m)
        y = 0.15 * abs(b)
        ratio = np.cosh(min(y, 50.0)) if b > 0 else 1.0 / (1.0 + y * y)
        return Applied(name="spring-hardening", subsystem="spring", extra={"hardening": b},
            parameters={"stiffness_ratio_at_0p15rad": ratio} if y < 2.0 else {})  # fmt: skip

    return at


def spring_contact(rng, m, session):
    if not m.body.stiffness:
        return None
    onset, side = deflection(m) * rng.uniform(0.35, 0.8), rng.choice([0.0, 1.0, -1.0])
    return lambda size: Applied(name="spring-contact", subsystem="spring", extra={
        "touch_at": onset, "touch_side": side, "touch_stiffness": size * m.body.stiffness},
        parameters={"onset_rad": onset, "onset_Nm": m.body.stiffness * onset})  # fmt: skip


def spring_viscoelastic(rng, m, session):
    if not m.body.stiffness:
        return None
    times = np.array([logs(rng, (0.1, 1.0)), logs(rng, (1.0, 8.0))]) * m.cycle_s / (2 * np.pi)
    share = np.array([1.0, rng.choice([0.0, rng.uniform(0.2, 1.0)])])

    def at(size):
        k = 0.2 * size * m.body.stiffness * share / share.sum()
        return Applied(name="spring-viscoelastic", subsystem="spring", extra={
            "branch_stiffness": k[:BRANCHES], "branch_time": times},
            parameters={"stiffness_rise_fast_over_static": 1.0 + k.sum() / m.body.stiffness}
            )  # fmt: skip

    return at


def spring_parallel(rng, m, session):
    if m.kind.load == "locked":
        return None
    return lambda size: Applied(
        name="spring-parallel", subsystem="load",
        extra={"parallel": 0.2 * size * m.torque / m.travel},
        parameters={"stiffness_Nm_per_rad": 0.2 * size * m.torque / m.travel})  # fmt: skip


def load_drag(rng, m, session):
    if m.kind.load == "locked":
        return None
    power = rng.choice([2.0, rng.uniform(1.6, 2.6)])

    def at(size):
        c = 0.15 * size * m.torque / m.speed**power
        return Applied(name="load-drag", subsystem="load", extra={
            "drag": c, "drag_exponent": power},
            parameters={"torque_at_5_rad_per_s_Nm": c * 5.0**power})  # fmt: skip

    return at


def load_unbalance(rng, m, session):
    if m.kind.load == "locked" or m.kind.linear:
        return None
    angle = rng.uniform(-np.pi, np.pi) if m.kind.load == "free" else rng.choice([-1, 1]) * 1.2

    def at(size):
        top = 0.15 * size * (m.torque if m.kind.load == "free" else m.body.gravity)
        return Applied(name="load-unbalance", subsystem="load", extra={
            "unbalance": top, "unbalance_angle": angle},
            parameters={"torque_amplitude_Nm": top, "angle_rad": angle})  # fmt: skip

    return at


def load_flexibility(rng, m, session):
    if m.kind.load == "locked" or m.command is None or m.body.load_inertia <= 0.0:
        return None
    share = rng.uniform(0.2, 0.6)

    def at(size):
        tip = share * m.body.load_inertia
        omega = max(1.5, 4.0 / np.sqrt(max(size, 0.05))) * max(1.0 / m.cycle_s, 1e-9) * 2 * np.pi
        k = tip * (1.0 - share) * omega**2
        return Applied(name="load-flexibility", subsystem="load", extra={
            "tip_share": share, "link_stiffness": k,
            "link_damping": 0.04 * np.sqrt(k * tip)},
            parameters={"free_link_frequency_Hz": omega / (2 * np.pi)})  # fmt: skip

    return at


def load_disturbance(rng, m, session):
    if m.kind.load == "locked":
        return None
    chosen = [k for k, p in enumerate(session.planned) if p.role == "identification"]
    k = int(rng.choice(chosen))
    end, sign = float(session.planned[k].rows_s[-1]), rng.choice([-1.0, 1.0])
    a = rng.uniform(0.15, 0.6) * end
    b = a + min(rng.uniform(0.1, 0.3) * end, m.cycle_s * rng.uniform(0.5, 3.0))
    return lambda size: Applied(
        name="load-disturbance", subsystem="load", pulse=(a, b, sign * 0.3 * size * m.torque),
        pushed=k, parameters={"start_s": a, "end_s": b, "peak_Nm": sign * 0.3 * size * m.torque}
        )  # fmt: skip


def faulty(rng, m, kind):
    """A column that such a fault shows in, and the usual size of its reading."""
    shown = [c for c in m.columns if not (m.kind.load == "locked" and c == "load_angle_rad")]
    if len(shown) < 2:
        return None
    angles = [c for c in shown if c.endswith("angle_rad")]
    analogue = [c for c in shown if c in ("torque_Nm", "current_A")]
    fit = {"offset": analogue + (["load_angle_rad"] if len(angles) > 1 else []),
           "scale": analogue + (["load_angle_rad"] if len(angles) > 1 else []),
           "delay": [c for c in shown if c != "motor_angle_rad"],
           "drift": [c for c in shown if c != "motor_angle_rad"]}[kind]  # fmt: skip
    if not fit:
        return None
    column = str(rng.choice(fit))
    usual = {"torque_Nm": m.torque, "load_angle_rad": m.travel}.get(
        column, m.torque / (m.body.gear_ratio * m.body.torque_constant or 1.0)
    )
    return column, float(usual)


def sensor_fault(kind: str) -> Draw:
    def draw(rng, m, session):
        found = faulty(rng, m, kind)
        if found is None:
            return None
        column, usual = found
        sign = rng.choice([-1.0, 1.0])
        end = max(float(p.rows_s[-1]) for p in session.planned)
        row = float(np.median(np.diff(session.planned[0].rows_s)))

        def at(size):
            change, shown = {
                "offset": ({"offset": sign * 0.1 * size * usual}, "offset"),
                "scale": ({"scale": 1.0 + sign * min(0.6, 0.1 * size)}, "scale"),
                "delay": ({"delay_s": 2.0 * row + 0.03 * size * m.cycle_s}, "delay_s"),
                "drift": ({"rate_per_s": sign * 0.2 * size * usual / end}, "rate_per_s"),
            }[kind]
            return Applied(name=f"sensor-{kind}", subsystem=f"sensor:{column}",
                           faults={column: change},
                           parameters={shown: float(next(iter(change.values())))})  # fmt: skip

        return at

    return draw


EFFECTS: dict[str, Draw] = {
    "gear-friction": gear_friction,
    "load-friction": load_friction,
    "gear-load-friction": gear_load_friction,
    "gear-backlash": gear_backlash,
    "gear-transmission-error": gear_transmission_error,
    "motor-cogging": motor_cogging,
    "drive-dead-zone": drive_dead_zone,
    "drive-saturation": drive_saturation,
    "drive-thermal": drive_thermal,
    "drive-delay": drive_delay,
    "spring-hysteresis": spring_hysteresis,
    "spring-hardening": spring_hardening,
    "spring-contact": spring_contact,
    "spring-viscoelastic": spring_viscoelastic,
    "spring-parallel": spring_parallel,
    "load-drag": load_drag,
    "load-unbalance": load_unbalance,
    "load-flexibility": load_flexibility,
    "load-disturbance": load_disturbance,
    **{f"sensor-{kind}": sensor_fault(kind) for kind in ("offset", "scale", "delay", "drift")},
}
