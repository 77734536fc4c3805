"""A session on a machine: inputs of the size of its motion, feedback, and a log with dirt."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from dftfs.proof.wide.inputs import KINDS, shape
from dftfs.proof.wide.machines import Drawn, logs
from dftfs.proof.wide.truth.body import BY_CURRENT, LOCKED, SWINGING, Loop, Start
from dftfs.proof.wide.truth.sensors import Sensor
from dftfs.proof.wide.truth.simulate import Planned, Session, UnstableError, closed, motion

FASTEST_ROW_S, SLOWEST_ROW_S = 1e-4, 0.04
MOST_ROWS = 5000


@dataclass(frozen=True, kw_only=True)
class Dirt:
    """What the inputs and the log add of themselves. Shares of a row, or of the full command."""

    linear: bool = False
    delay_rows: float = 0.0
    offset: float = 0.0
    wander: float = 0.0
    jitter: float = 0.0
    missing: float = 0.0
    clock: tuple[str, float] | None = None
    colour: float = 0.0
    moving: bool = False
    per_row: int = 1


def draw_dirt(rng: np.random.Generator, m: Drawn, feedback: bool) -> Dirt:
    """Each kind of dirt for about a third of the cases."""
    driven = m.command is not None
    jitter = logs(rng, (0.005, 0.1)) if rng.random() < 0.35 and not feedback else 0.0
    columns = [c for c in m.columns if c.endswith("angle_rad")]
    clock = None
    if columns and len(m.columns) > 1 and rng.random() < 0.15:
        clock = (str(rng.choice(columns)), float(rng.choice([-1, 1]) * rng.uniform(5e-5, 3e-4)))
    return Dirt(
        linear=bool(driven and not feedback and rng.random() < 0.25),
        delay_rows=float(rng.uniform(0.2, 1.5)) if driven and rng.random() < 0.45 else 0.0,
        offset=float(rng.uniform(-0.01, 0.01)) if driven and rng.random() < 0.5 else 0.0,
        wander=logs(rng, (1e-4, 2e-3)) if driven and rng.random() < 0.35 else 0.0,
        jitter=jitter,
        missing=float(rng.uniform(0.001, 0.006)) if jitter > 0.03 and rng.random() < 0.5 else 0.0,
        clock=clock,
        colour=float(rng.uniform(0.4, 0.9)) if rng.random() < 0.3 else 0.0,
        moving=bool(not m.body.sprung and not feedback and rng.random() < 0.2),
        per_row=int(rng.choice([1, 1, 1, 2, 4])),
    )


def draw_rows(rng: np.random.Generator, m: Drawn) -> float:
    """Time between two rows: 8 to 50 a cycle of the fastest mode that the motion excites."""
    slowest = m.cycle_s / 3.0
    mode = 2 * np.pi / m.fastest
    cycle = mode if mode > 0.1 * m.cycle_s else slowest
    row = min(min(cycle, slowest) / logs(rng, (8.0, 50.0)), SLOWEST_ROW_S)
    return float(f"{max(row, FASTEST_ROW_S):.2g}")


def draw_sensors(rng: np.random.Generator, m: Drawn, dirt: Dirt) -> dict[str, Sensor]:
    """A sensor for each column of the machine's log."""
    out = {}
    amps = m.torque / (m.body.gear_ratio * m.body.torque_constant or 1.0)
    for column in m.columns:
        if column.endswith("angle_rad"):
            ratio = m.body.gear_ratio if column.startswith("motor") else 1.0
            finest = 2 * np.pi / (m.travel * ratio)  # counts of a turn that are 1 in the travel
            counts = int(rng.choice(m.kind.counts))
            while counts < 150.0 * finest:
                counts *= 4
            sensor = Sensor(count=2 * np.pi / counts)
            if rng.random() < 0.25:  # an analogue or interpolated sensor
                sensor = Sensor(noise=m.travel * ratio * logs(rng, (1e-4, 3e-3)),
                                colour=dirt.colour)  # fmt: skip
        else:
            usual = {"torque_Nm": m.torque, "current_A": amps}.get(column, m.speed)
            usual *= m.body.gear_ratio if column.startswith("motor_v") else 1.0
            sensor = Sensor(noise=float(f"{usual * logs(rng, (1e-3, 1e-2)):.2g}"),
                            colour=dirt.colour)  # fmt: skip
            if column.endswith("per_s"):
                sensor = replace(sensor, filter_s=m.cycle_s / rng.uniform(60.0, 300.0))
        if dirt.clock and dirt.clock[0] == column:
            sensor = replace(sensor, clock=dirt.clock[1])
        out[column] = sensor
    return out


def needed(m: Drawn) -> float:
    """Command, in volts or amperes, that the usual motion takes."""
    amps = m.torque / (m.body.gear_ratio * m.body.torque_constant)
    if m.body.drive == BY_CURRENT:
        return amps
    return m.body.resistance * amps + m.body.emf_constant * m.body.gear_ratio * m.speed


def moved(session: Session, planned: Planned) -> float:
    out = motion(session, planned)
    column = 0 if planned.mode == LOCKED else 2
    return float(np.abs(out[:, column] - out[0, column]).max())


def sized(session: Session, planned: Planned, travel: float) -> Planned:
    """The open-loop recording with the amplitude that moves the machine so far.

    Raises
    ------
    UnstableError
        If no amplitude does.
    """
    for _ in range(14):
        ratio = travel / max(moved(session, planned), 1e-12)
        if 0.8 < ratio < 1.25:
            return planned
        planned = replace(planned, command=planned.command * np.clip(ratio, 0.2, 5.0) ** 0.8)
    raise UnstableError


def draw_times(
    rng: np.random.Generator, m: Drawn, row: float, dirt: Dirt
) -> tuple[np.ndarray, np.ndarray]:
    """Times of the ticks and of the rows that were logged."""
    n = int(np.clip(rng.uniform(8.0, 40.0) * m.cycle_s / row, 250, MOST_ROWS))
    ticks = row * np.arange(n)
    if dirt.jitter:
        ticks[1:] += row * dirt.jitter * rng.normal(size=n - 1).clip(-2.5, 2.5)
    keep = np.ones(n, dtype=bool)
    if dirt.missing:
        keep[rng.choice(np.arange(5, n - 5), max(1, round(dirt.missing * n)), replace=False)] = 0
    return ticks, ticks[keep]


def draw_recording(
    rng: np.random.Generator, m: Drawn, session: Session, dirt: Dirt, row: float, loop: bool
) -> Planned:
    """One recording, its input in volts or amperes and as large as the machine's motion."""
    ticks, rows = draw_times(rng, m, row, dirt)
    mode = LOCKED if m.kind.load == "locked" else SWINGING
    if m.command is None:
        start = Start(angle=rng.choice([-1, 1]) * m.travel * rng.uniform(0.4, 1.0))
        if dirt.moving:
            start = start._replace(speed=rng.uniform(-0.5, 0.5) * m.speed * 0.3)
        return Planned(description="released, no command", rows_s=rows, ticks_s=ticks,
                       command=np.zeros(ticks.size), start=start)  # fmt: skip
    kind = str(rng.choice(KINDS))
    if loop:
        return in_feedback(rng, m, session, dirt, row, rows[-1], kind)
    values, description = shape(rng, kind, ticks, m.cycle_s)
    speed = rng.uniform(-0.5, 0.5) * m.speed if dirt.moving else 0.0
    planned = Planned(description=description, rows_s=rows, ticks_s=ticks,
                      command=needed(m) * values, linear=dirt.linear, delay_s=dirt.delay_rows * row,
                      mode=mode, start=Start(speed=speed))  # fmt: skip
    return sized(session, planned, m.travel * rng.uniform(0.35, 1.0))


def in_feedback(rng, m, session, dirt, row, end, kind) -> Planned:
    """A recording around a reference; its command is the reference until `closed` plays it."""
    tick = row / dirt.per_row
    ticks = tick * np.arange(int(end / tick) + 1)
    values, description = shape(rng, kind, ticks, 1.5 * m.cycle_s)
    b = m.body
    whole = b.gear_ratio**2 * b.motor_inertia + b.output_inertia + b.load_inertia
    delay = dirt.delay_rows * tick
    corner = min(rng.uniform(2.0, 4.0) * 2 * np.pi / m.cycle_s, 0.2 / (delay + 2.0 * tick))
    gain = whole / (b.gear_ratio * b.torque_constant)
    gain *= 1.0 if b.drive == BY_CURRENT else b.resistance
    sensor = session.sensors.get("load_angle_rad") or session.sensors.get("motor_angle_rad")
    count = sensor.count if "load_angle_rad" in session.sensors else sensor.count / b.gear_ratio
    loop = Loop(proportional=gain * corner**2, derivative=1.3 * gain * corner / tick,
                count=count, limit=1e12)  # fmt: skip
    keep = lfilter([0.3], [1.0, -0.7], values)  # what follows a corner of the reference is finite
    return Planned(description=f"feedback around a reference: {description}",
                   rows_s=ticks[:: dirt.per_row], ticks_s=ticks,
                   command=m.travel * rng.uniform(0.3, 0.8) * keep,
                   delay_s=delay, mode=SWINGING, loop=loop)  # fmt: skip


def in_units(m: Drawn, session: Session, rng: np.random.Generator, dirt: Dirt) -> Session:
    """The session with supply and current limit above what it needs, commands in their column's
    unit, and the amplifier's offset and wander, which are shares of the full command."""
    if m.command is None:
        return session
    base = replace(session, planned=tuple(
        closed(session, p) if p.loop else p for p in session.planned))  # fmt: skip
    top = max(float(np.abs(p.command).max()) for p in base.planned)
    amps = max(float(np.abs(motion(base, p)[:, 4]).max()) for p in base.planned)
    full = top / rng.uniform(0.5, 0.92)
    body = session.body._replace(current_limit=amps / rng.uniform(0.5, 0.85))
    unit = 1.0
    if m.command == "duty":
        unit, body = full, body._replace(supply=float(f"{full:.4g}"))
        unit = body.supply
    planned = []
    for p in session.planned:
        noise = lfilter([1.0], [1.0, -0.9], rng.normal(size=p.ticks_s.size)) * np.sqrt(0.19)
        change = {"offset": dirt.offset * full / unit,
                  "wander": dirt.wander * full / unit * noise if dirt.wander else None}  # fmt: skip
        if p.loop:
            loop = p.loop._replace(proportional=p.loop.proportional / unit,
                                   derivative=p.loop.derivative / unit,
                                   limit=full / unit)  # fmt: skip
            planned.append(replace(p, loop=loop, **change))
        else:
            planned.append(replace(p, command=p.command / unit, **change))
    return replace(session, body=body, planned=tuple(planned))


def draw_session(rng: np.random.Generator, m: Drawn) -> tuple[Drawn, Session, Dirt]:
    """A machine's recordings: 1 to 4 to identify, one to validate, and the hidden test last.

    Raises
    ------
    UnstableError
        If an input drives the machine out of every bound.
    """
    feedback = bool(rng.random() < m.kind.loop)
    dirt = draw_dirt(rng, m, feedback)
    row = draw_rows(rng, m)
    session = Session(body=m.body, fastest=m.fastest, sensors=draw_sensors(rng, m, dirt))
    count = int(rng.choice([1, 2, 3, 4], p=[0.25, 0.3, 0.25, 0.2]))
    roles = ["identification"] * count
    roles += ["validation"] * int(rng.random() < 0.75) + ["test"]
    planned = []
    for role in roles:
        still = replace(dirt, moving=dirt.moving and role != "test", jitter=dirt.jitter)
        still = still if role != "test" else replace(still, jitter=0.0, missing=0.0)
        one = draw_recording(rng, m, session, still, row, feedback and role != "test")
        planned.append(replace(one, role=role))
    session = in_units(m, replace(session, planned=tuple(planned)), rng, dirt)
    return replace(m, body=session.body), session, dirt


def played(session: Session) -> Session:
    """The session with every feedback played: commands that can be replayed."""
    planned = tuple(closed(session, p) if p.loop else p for p in session.planned)
    return replace(session, planned=planned)
