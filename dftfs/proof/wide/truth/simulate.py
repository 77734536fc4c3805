"""Recordings of one axis: the command as it acts, the motion, and the readings at the rows."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from dftfs.proof.wide.truth.body import SWINGING, Body, Extra, Loop, Start
from dftfs.proof.wide.truth.kernel import run

STEPS_PER_ROW = 4  # at least
PHASE_rad = 5e-5  # error of gravity's swing as long as it lasts
DECAYS = 3.0  # time constants that it lasts
MOST_STEPS = 4e4  # of a recording for the sake of its swing's phase
PER_RADIAN = 6.0  # steps per radian of the fastest mode's phase
PAUSE_KEEPS = 0.6  # share of the case's warmth that is left when the next recording starts


class UnstableError(Exception):
    """A simulation left every bound; the draw is thrown away."""


@dataclass(frozen=True, kw_only=True)
class Planned:
    """One recording as it was made.

    Attributes
    ----------
    rows_s : (n,) array
        True times of the rows; the first is 0.
    command : (m,) array
        What was commanded, at ``ticks_s``.
    linear : bool
        The amplifier interpolates between the commands; else it holds them.
    delay_s, offset : float
        The command acts late, and the amplifier adds this.
    wander : (m,) array
        Unlogged noise of the drive, at the ticks.
    mode : int
        `SWINGING` or `LOCKED`.
    free : bool
        Without gravity.
    loop : Loop or None
        The recording is made in feedback; ``command`` is then the reference, and `closed` makes
        of it the recording that replays what the loop commanded.
    pulse : (3,) tuple
        Start, end and peak of an external torque.
    """

    description: str
    role: str = "identification"
    rows_s: np.ndarray
    ticks_s: np.ndarray
    command: np.ndarray
    linear: bool = False
    delay_s: float = 0.0
    offset: float = 0.0
    wander: np.ndarray | None = None
    mode: int = SWINGING
    start: Start = Start()  # noqa: RUF009
    loop: Loop | None = None
    pulse: tuple[float, float, float] | None = None
    logged: np.ndarray | None = None

    def acting(self, time_s: np.ndarray) -> np.ndarray:
        """The command that acts at these times. (n,)"""
        late = time_s - self.delay_s
        values = self.command if self.wander is None else self.command + self.wander
        if self.linear:
            return np.interp(late, self.ticks_s, values) + self.offset
        place = np.searchsorted(self.ticks_s, late, side="right") - 1
        return np.where(place < 0, 0.0, values[np.maximum(place, 0)]) + self.offset

    def row_commands(self) -> np.ndarray:
        """The command as the log has it, a row's value being the last one told. (rows,)"""
        place = np.searchsorted(self.ticks_s, self.rows_s + 1e-9, side="right") - 1
        return self.command[np.clip(place, 0, self.command.size - 1)]

    def outside(self, time_s: np.ndarray) -> np.ndarray:
        """External torque on the load: a half sine of power 0.7 from start to end. (n,)"""
        if self.pulse is None:
            return np.zeros(time_s.size)
        start, end, peak = self.pulse
        share = np.clip((time_s - start) / (end - start), 0.0, 1.0)
        return peak * np.sin(np.pi * share).clip(0.0) ** 0.7


@dataclass(frozen=True, kw_only=True)
class Session:
    """A machine, its effects and the recordings made on it, in order."""

    body: Body
    extra: Extra = Extra()  # noqa: RUF009
    planned: tuple[Planned, ...] = ()
    fastest: float = 1.0
    sensors: dict = field(default_factory=dict)


def quickest(session: Session) -> float:
    """Fastest mode in rad/s, that of the effects included."""
    b, x = session.body, session.extra
    up = b.gear_ratio**2 * b.motor_inertia + b.output_inertia
    gear = up if b.sprung else up + b.load_inertia
    load = b.load_inertia if b.sprung else gear
    squares = [session.fastest**2]
    if x.gear_plus > 0.0:
        squares.append(1.3 * x.gear_plus * x.gear_static / (x.gear_bristle * gear))
    if x.load_coulomb > 0.0:
        squares.append(x.load_coulomb * x.load_static / (x.load_bristle * load))
    if x.tip_share > 0.0:
        tip = x.tip_share * b.load_inertia
        squares.append(x.link_stiffness * (1.0 / tip + 1.0 / (load - tip)))
    if x.clamp_stiffness > 0.0:
        squares.append((x.clamp_stiffness + b.stiffness) / b.load_inertia)
    if b.sprung:
        more = x.touch_stiffness + x.stop_stiffness.sum() + x.branch_stiffness.sum()
        squares.append((b.stiffness + more) * (1.0 / up + 1.0 / load))
    return float(np.sqrt(max(squares)))


def step_of(session: Session, planned: Planned, fine: float = 1.0) -> tuple[float, int]:
    """Length and number of the integrator's steps: a whole number of them between two ticks."""
    row = float(np.median(np.diff(planned.rows_s)))
    tick = float(np.median(np.diff(planned.ticks_s))) if planned.ticks_s.size > 1 else row
    longest = min(1.0 / (PER_RADIAN * quickest(session)), row / STEPS_PER_ROW)
    swing = _swing_step_s(session, planned)
    if swing > 0.0:
        longest = min(longest, max(swing, planned.rows_s[-1] / MOST_STEPS))
    longest /= fine
    step = tick / max(1, int(np.ceil(tick / longest)))
    return step, int(np.ceil(planned.rows_s[-1] / step)) + 1


def _swing_step_s(session: Session, planned: Planned) -> float:
    """Step with which gravity's swing keeps its phase within `PHASE_rad` as long as it lasts.

    A step of second order slows a swing by (rate step)^2 / 12 at most; a light pendulum keeps
    every error of phase, and a fine encoder shows it as physics that nobody planted.
    """
    b = session.body
    if not b.gravity > 0.0:
        return 0.0
    up = b.gear_ratio**2 * b.motor_inertia + b.output_inertia
    moving = b.load_inertia if b.sprung else b.load_inertia + up
    loss = b.load_viscous
    if not b.sprung:
        loss += b.gear_ratio**2 * b.motor_viscous + b.output_viscous
    lasting = min(planned.rows_s[-1], DECAYS * 2.0 * moving / max(loss, 1e-30))
    rate = np.sqrt(b.gravity / moving)
    return float(np.sqrt(12.0 * PHASE_rad / (rate * lasting)) / rate)


def motion(session: Session, planned: Planned, fine: float = 1.0) -> np.ndarray:
    """Exact outputs at the steps' ends. (n + 1, 7)

    Raises
    ------
    UnstableError
        If a value is not finite or enormous.
    """
    if planned.loop is not None:
        raise ValueError("a recording in feedback is made by `closed`")
    step, n = step_of(session, planned, fine)
    middle = step * (np.arange(n) + 0.5)
    out, _ = run(
        session.body, session.extra, Loop(), planned.mode, step,
        planned.acting(middle), planned.outside(middle), planned.start,
    )  # fmt: skip
    if not np.isfinite(out).all() or np.abs(out[:, :4]).max() > 1e9:
        raise UnstableError
    return out


def closed(session: Session, planned: Planned) -> Planned:
    """The same recording with the command that the feedback gave, ready to be replayed."""
    loop = planned.loop
    step, n = step_of(session, planned)
    tick = round(float(np.median(np.diff(planned.ticks_s))) / step)
    ends = step * np.arange(n)
    place = np.clip(np.searchsorted(planned.ticks_s, ends + 1e-9, "right") - 1, 0, None)
    reference = planned.command[place]
    added = np.full(n, planned.offset)
    if planned.wander is not None:
        added = added + planned.wander[place]
    loop = loop._replace(tick=tick, delay=round(planned.delay_s / step))
    out, commanded = run(
        session.body, session.extra, loop, planned.mode, step,
        np.concatenate([reference, added]), planned.outside(ends + 0.5 * step), planned.start,
    )  # fmt: skip
    if not np.isfinite(out).all():
        raise UnstableError
    commands = commanded[::tick][: planned.ticks_s.size]
    size = commands.size
    wander = None if planned.wander is None else planned.wander[:size]
    return replace(
        planned, command=commands, ticks_s=planned.ticks_s[:size], wander=wander, loop=None
    )


def at_rows(out: np.ndarray, step: float, times_s: np.ndarray, ratio: float) -> dict:
    """Exact readings at these times, by Hermite's cubic for what has a known rate."""
    ends = step * np.arange(out.shape[0])
    times_s = np.clip(times_s, 0.0, ends[-1])
    gear = CubicHermiteSpline(ends, out[:, 0], out[:, 1])(times_s)
    load = CubicHermiteSpline(ends, out[:, 2], out[:, 3])(times_s)
    between = {k: np.interp(times_s, ends, out[:, j]) for k, j in
               (("gear_speed", 1), ("load_speed", 3), ("torque", 5), ("case_K", 6))}  # fmt: skip
    held = np.clip(np.searchsorted(ends, times_s + 1e-12, "right") - 1, 0, None)
    return {
        "motor_angle_rad": ratio * gear,
        "load_angle_rad": load,
        "motor_velocity_rad_per_s": ratio * between["gear_speed"],
        "load_velocity_rad_per_s": between["load_speed"],
        "current_A": out[held, 4],
        "torque_Nm": between["torque"],
        "temperature_C": 22.0 + between["case_K"],
    }


def readings(session: Session, fine: float = 1.0) -> list[dict[str, np.ndarray]]:
    """Readings without noise of every recording, through the sensors' faults."""
    out, warm = [], 0.0
    for planned in session.planned:
        start = planned.start._replace(winding_K=warm, case_K=warm)
        made = motion(session, replace(planned, start=start), fine)
        step = step_of(session, planned, fine)[0]
        warm = PAUSE_KEEPS * float(made[-1, 6])
        values = {}
        for column, sensor in session.sensors.items():
            values[column] = sensor.exact(made, step, planned.rows_s, session.body, column)
        out.append(values)
    return out
