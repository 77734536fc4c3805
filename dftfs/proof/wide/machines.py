"""Machines drawn over decades: class by class, in the machine's own scales, then in SI."""

from dataclasses import dataclass

import numpy as np

from dftfs.proof.wide.truth.body import BY_CURRENT, BY_VOLTAGE, NO_DRIVE, Body

GRAVITY = 9.80665


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A class of machines. Pairs are the ends of log-uniform draws, on the output side.

    ``rotor``: reflected inertia of the motor over the load's; ``travel``: amplitude in rad or m;
    ``modes``: frequency of the spring's mode over that of the motion; None without a spring.
    """

    load: str
    ratio: tuple[float, float] = (1.0, 1.0)
    inertia: tuple[float, float]
    rotor: tuple[float, float] = (0.05, 3.0)
    travel: tuple[float, float] = (0.15, 1.0)
    motion_Hz: tuple[float, float] = (0.3, 6.0)
    modes: tuple[float, float] | None = None
    commands: tuple[str, ...] = ("duty", "voltage_V", "current_command_A")
    columns: tuple[str, ...] = ("motor_angle_rad", "load_angle_rad")
    loop: float = 0.3
    linear: bool = False
    counts: tuple[int, ...] = (1024, 4096, 8192, 16384, 65536)


KINDS: dict[str, Kind] = {
    "bare-pendulum": Kind(load="pendulum", inertia=(1e-5, 30.0), commands=(), loop=0.0,
                          columns=("load_angle_rad",)),
    "horizontal-axis": Kind(load="free", ratio=(1.0, 50.0), inertia=(1e-6, 10.0),
                            travel=(0.3, 8.0), loop=0.5),
    "linear-stage": Kind(load="free", ratio=(20.0, 2000.0), inertia=(0.05, 200.0), linear=True,
                         travel=(0.005, 0.3), rotor=(0.1, 5.0), loop=0.6),
    "direct-drive": Kind(load="pendulum", inertia=(1e-6, 5.0), rotor=(0.02, 1.0),
                         columns=("load_angle_rad",)),
    "quasi-direct-drive": Kind(load="pendulum", ratio=(5.0, 10.0), inertia=(1e-4, 3.0),
                               commands=("current_command_A",), loop=0.5),
    "servo": Kind(load="pendulum", ratio=(80.0, 200.0), inertia=(1e-5, 0.3), commands=("duty",),
                  rotor=(0.3, 10.0), columns=("load_angle_rad",), loop=1.0, counts=(1024, 4096)),
    "geared-sea": Kind(load="pendulum", ratio=(10.0, 200.0), inertia=(1e-4, 20.0),
                       rotor=(0.5, 50.0), modes=(1.5, 6.0), loop=0.2),
    "strain-wave": Kind(load="pendulum", ratio=(50.0, 160.0), inertia=(1e-3, 20.0),
                        rotor=(0.5, 20.0), modes=(5.0, 15.0), loop=0.3),
    "locked-output": Kind(load="locked", ratio=(1.0, 200.0), inertia=(1e-4, 10.0),
                          rotor=(1.0, 30.0), modes=(2.0, 8.0), travel=(0.01, 0.3), loop=0.0,
                          columns=("motor_angle_rad", "load_angle_rad")),
    "velocity-log": Kind(load="free", ratio=(1.0, 20.0), inertia=(1e-6, 3.0), travel=(0.5, 8.0),
                         columns=("motor_velocity_rad_per_s",), loop=0.0),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A machine with the scales of its motion.

    ``torque``: the drive's usual torque at the output; ``fastest``: rad/s of the fastest mode;
    ``command``: the input column, None without a drive.
    """

    name: str
    kind: Kind
    body: Body
    command: str | None
    travel: float
    cycle_s: float
    torque: float
    fastest: float
    mass: float
    distance: float
    columns: tuple[str, ...]

    @property
    def speed(self) -> float:
        return 2 * np.pi / self.cycle_s * self.travel


def logs(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    """A log-uniform draw."""
    return float(np.exp(rng.uniform(*np.log(ends))))


def draw_machine(rng: np.random.Generator, name: str) -> Drawn:
    """A machine of a class, its true constants and the scales of its motion."""
    kind = KINDS[name]
    inertia, ratio = logs(rng, kind.inertia), logs(rng, kind.ratio)
    travel, mass, distance, gravity = logs(rng, kind.travel), 0.0, 0.0, 0.0
    cycle_s = 1.0 / logs(rng, kind.motion_Hz)
    if kind.load == "pendulum":
        shape = rng.uniform(1.05, 1.5)
        distance = float(np.clip(0.4 * inertia**0.22 * rng.uniform(0.6, 1.6), 0.01, 1.0))
        mass = inertia / (shape * distance**2)
        gravity = mass * GRAVITY * distance
        cycle_s = 2 * np.pi * np.sqrt(inertia / gravity) * rng.uniform(0.7, 3.0)
    elif not kind.linear and rng.random() < 0.5:
        cycle_s *= max(1.0, (inertia / 0.1) ** 0.2)
    omega = 2 * np.pi / cycle_s
    if not kind.commands:
        return undriven(rng, name, (inertia, gravity, cycle_s), (mass, distance))
    rotor = logs(rng, kind.rotor) * inertia
    whole = rotor + (0.0 if kind.load == "locked" else inertia)
    torque = float(np.hypot(whole * omega**2 * travel, gravity * np.sin(min(travel, 1.5))))
    stiffness, fastest = 0.0, max(omega, np.sqrt(gravity / whole))
    if kind.modes is not None:
        fastest = omega * logs(rng, kind.modes)
        reduced = rotor if kind.load == "locked" else 1.0 / (1.0 / rotor + 1.0 / inertia)
        stiffness = reduced * fastest**2
        torque = stiffness * travel if kind.load == "locked" else torque
    loss = torque / (omega * travel)
    command = str(rng.choice(kind.commands))
    amps, volts = logs(rng, (0.3, 30.0)), float(rng.choice([5.0, 12.0, 24.0, 48.0, 325.0]))
    power = torque * omega * travel
    amps = max(power / (0.35 * volts), 0.02 * amps) if command != "current_command_A" else amps
    ohm = volts / amps * rng.uniform(0.3, 0.5)
    share = rng.uniform(0.02, 0.25) if rng.random() < 0.6 else 0.0  # of the wheel
    constant = torque / (ratio * amps)
    body = Body(
        drive=BY_CURRENT if command == "current_command_A" else BY_VOLTAGE,
        sprung=int(kind.modes is not None),
        gear_ratio=ratio,
        resistance=ohm,
        inductance=ohm * logs(rng, (5e-5, 3e-3)) if rng.random() < 0.5 else 0.0,
        torque_constant=constant,
        emf_constant=constant,
        motor_inertia=rotor * (1.0 - share) / ratio**2,
        output_inertia=rotor * share if kind.modes is not None else 0.0,
        motor_viscous=loss * logs(rng, (0.005, 0.08)) / ratio**2,
        output_viscous=loss * logs(rng, (0.005, 0.05)) if kind.modes is not None else 0.0,
        stiffness=stiffness,
        load_inertia=inertia,
        load_viscous=loss * logs(rng, (0.005, 0.08)),
        gravity=gravity,
    )
    columns = draw_columns(rng, kind, body)
    return Drawn(name=name, kind=kind, body=body, command=command, travel=travel, cycle_s=cycle_s,
                 torque=torque, fastest=float(fastest), mass=mass, distance=distance,
                 columns=columns)  # fmt: skip


def undriven(
    rng: np.random.Generator,
    name: str,
    magnitudes: tuple[float, float, float],
    weight: tuple[float, float],
) -> Drawn:
    """A machine without a drive. ``scales``: inertia, m g d, cycle; ``weight``: mass, distance."""
    (inertia, gravity, cycle_s), (mass, distance), kind = magnitudes, weight, KINDS[name]
    omega = 2 * np.pi / cycle_s
    viscous = inertia * omega * logs(rng, (0.002, 0.05))
    body = Body(drive=NO_DRIVE, sprung=0, load_inertia=inertia, load_viscous=viscous,
                gravity=gravity)  # fmt: skip
    return Drawn(name=name, kind=kind, body=body, command=None, travel=rng.uniform(0.4, 2.2),
                 cycle_s=cycle_s, torque=gravity, fastest=np.sqrt(gravity / inertia),
                 mass=mass, distance=distance, columns=kind.columns)  # fmt: skip


def draw_columns(rng: np.random.Generator, kind: Kind, body: Body) -> tuple[str, ...]:
    """The columns of a log: angles, some dropped, and perhaps a torque or a current sensor."""
    columns = list(kind.columns)
    if len(columns) == 2 and kind.load != "locked" and rng.random() < 0.35:
        columns.pop(int(rng.integers(2)))
    if kind.modes is not None and rng.random() < 0.5:
        columns.append("torque_Nm")
    if body.drive == BY_VOLTAGE and rng.random() < 0.5:
        columns.append("current_A")
    return tuple(columns)
