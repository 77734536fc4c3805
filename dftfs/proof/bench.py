"""A session on the bench: recordings made one after the other on one true machine."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from dftfs.proof.effects_base import Applied, changed
from dftfs.proof.machine import AMBIENT_C, InternalStates, Machine, Physics
from dftfs.proof.readings import Sensors
from dftfs.proof.truth import FINE_STEP_S, Drive, Motion, Start, move
from dftfs.proof.waveforms import INTERVAL_S

PAUSE_S = 5.0  # the bench rests between recordings
BROWN_OUT_S = 1.0


@dataclass(frozen=True, kw_only=True)
class Planned:
    """One recording to be made: load, input, role and where the link starts."""

    load: str
    kind: str
    command: np.ndarray
    description: str
    role: str = "identification"
    motor_angle_rad: float = 0.0
    load_angle_rad: float = 0.0
    backlash_place: float = 0.0
    low_supply_s: tuple[float, ...] = ()

    @property
    def time_s(self) -> np.ndarray:
        return INTERVAL_S * np.arange(self.command.size)


@dataclass(frozen=True, kw_only=True)
class Bridge:
    """How a bridge fails to repeat itself: slow noise of its gain and of its zero."""

    gain: float
    volts: float
    time_s: float = 1.5

    def draw(self, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Relative gain about 1, and offset in volts. Ornstein-Uhlenbeck, shape (count,) each."""
        keep = np.exp(-INTERVAL_S / self.time_s)
        steps = rng.normal(size=(2, count)) * np.sqrt(1.0 - keep**2)
        steps[:, 0] = rng.normal(size=2)
        out = lfilter([1.0], [1.0, -keep], steps, axis=1)
        return 1.0 + self.gain * out[0], self.volts * out[1]


@dataclass(frozen=True, kw_only=True)
class Session:
    """A true machine with its effects and the recordings that are made on it, in order."""

    machine: Machine
    sensors: Sensors
    planned: tuple[Planned, ...]
    applied: tuple[Applied, ...] = ()
    pushed: int = 0
    bridge: Bridge = field(default_factory=lambda: Bridge(gain=4e-4, volts=1e-3))


def rested(internal: InternalStates, physics: Physics, seconds: float) -> InternalStates:
    """Two bodies cooling towards the air without heat. Exact."""
    a, b = physics.winding_capacity_J_per_K, physics.case_capacity_J_per_K
    inner, outer = 1.0 / physics.winding_to_case_K_per_W, 1.0 / physics.case_to_air_K_per_W
    rate = np.array([[-inner / a, inner / a], [inner / b, -(inner + outer) / b]])
    mean = 0.5 * (rate[0, 0] + rate[1, 1])  # Sylvester's formula: two real, distinct rates
    apart = np.sqrt(0.25 * (rate[0, 0] - rate[1, 1]) ** 2 + rate[0, 1] * rate[1, 0])
    fast, slow = mean - apart, mean + apart
    warm = np.array([internal.winding_C, internal.case_C]) - AMBIENT_C
    fast_part = (rate - slow * np.eye(2)) @ warm / (fast - slow)
    left = np.exp(fast * seconds) * fast_part + np.exp(slow * seconds) * (warm - fast_part)
    winding, case = AMBIENT_C + left
    return internal._replace(winding_C=float(winding), case_C=float(case))


def low_supply(planned: Planned, depth: float) -> np.ndarray:
    """Supply relative to its constant with the planned drops. Shape (samples,)."""
    gain = np.ones(planned.command.size)
    for start in planned.low_supply_s:
        gain[(planned.time_s >= start) & (planned.time_s < start + BROWN_OUT_S)] -= depth
    return gain


def motions(
    session: Session, *, step_s: float = FINE_STEP_S, noise: np.random.Generator | None = None
) -> list[Motion]:
    """Every planned recording's exact motion; ``noise`` switches the bridge's own drift on."""
    machine, physics, series, _ = changed(session.machine, session.applied)
    depth = sum(one.brown_out for one in session.applied)
    internal, out = InternalStates(), []
    for index, planned in enumerate(session.planned):
        gain, volts = low_supply(planned, depth), np.zeros(planned.command.size)
        if noise is not None:
            wander, volts = session.bridge.draw(noise, planned.command.size)
            gain = gain * wander
        outside = np.zeros(planned.command.size)
        for one in session.applied:
            if one.pulse is not None and index == session.pushed:
                outside = outside + one.pulse.torque(planned.time_s)
        motion = move(
            machine,
            physics,
            series,
            planned.load,
            Drive(
                interval_s=INTERVAL_S,
                command=planned.command,
                gain=gain,
                volts=volts,
                outside_Nm=outside,
            ),
            Start(
                motor_angle_rad=planned.motor_angle_rad,
                load_angle_rad=planned.load_angle_rad,
                backlash_place=planned.backlash_place,
                internal=internal,
            ),
            step_s=step_s,
        )
        out.append(motion)
        internal = rested(motion.internal, physics, PAUSE_S)
    return out
