"""Which recordings a bench makes of a rig: families of plans, and amplitudes that it can stand."""

from dataclasses import dataclass, replace

import numpy as np

from dftfs.proof.bench import Planned, Session, motions
from dftfs.proof.machine import Machine
from dftfs.proof.readings import Sensors
from dftfs.proof.waveforms import WAVEFORMS

COARSE_STEP_S = 500e-6
DESCRIPTIONS = {
    "locked": "output clamped",
    "pendulum": "pendulum free",
    "contact": "pendulum against the stop",
}

Slot = tuple[str, str]


@dataclass(frozen=True, kw_only=True)
class Family:
    """Slots (load, waveform) for identification, validation and the hidden test."""

    identification: tuple[Slot, ...]
    validation: tuple[Slot, ...]
    test: tuple[Slot, ...]


FAMILIES = {
    "spring": Family(
        identification=(
            ("locked", "triangle"),
            ("locked", "two-rates"),
            ("pendulum", "chirp"),
            ("pendulum", "let-go"),
        ),
        validation=(("locked", "steps"), ("locked", "sine")),
        test=(("locked", "ramps"), ("locked", "switching")),
    ),
    "gear": Family(
        identification=(
            ("locked", "triangle"),
            ("locked", "sine"),
            ("pendulum", "multisine"),
            ("pendulum", "sine"),
        ),
        validation=(("pendulum", "steps"), ("locked", "ramps")),
        test=(("pendulum", "switching"), ("locked", "switching")),
    ),
    "slow": Family(
        identification=(
            ("locked", "triangle"),
            ("pendulum", "slow-sine"),
            ("pendulum", "multisine"),
        ),
        validation=(("locked", "slow-sine"), ("pendulum", "sine")),
        test=(("locked", "ramps"), ("pendulum", "ramps")),
    ),
    "load": Family(
        identification=(
            ("locked", "triangle"),
            ("pendulum", "let-go"),
            ("pendulum", "slow-sine"),
            ("pendulum", "multisine"),
        ),
        validation=(("pendulum", "sine"), ("pendulum", "steps")),
        test=(("pendulum", "switching"), ("pendulum", "ramps")),
    ),
    "strong": Family(
        identification=(
            ("locked", "triangle"),
            ("pendulum", "square"),
            ("pendulum", "multisine"),
            ("pendulum", "sine"),
        ),
        validation=(("pendulum", "square"),),
        test=(("pendulum", "switching"), ("pendulum", "fast-sine")),
    ),
    "warm": Family(
        identification=(
            ("pendulum", "shaking"),
            ("locked", "triangle"),
            ("pendulum", "square"),
            ("pendulum", "multisine"),
        ),
        validation=(("pendulum", "square"),),
        test=(("pendulum", "shaking"),),
    ),
    "contact": Family(
        identification=(
            ("contact", "sine"),
            ("contact", "press"),
            ("pendulum", "multisine"),
            ("locked", "triangle"),
        ),
        validation=(("contact", "fast-sine"),),
        test=(("contact", "two-tones"),),
    ),
}

# The families that excite an effect; the others of the list make the plan say less about it.
EXCITING = {
    "gear-friction": ("gear", "spring", "slow", "load"),
    "gear-load-friction": ("gear", "spring", "strong"),
    "gear-backlash": ("gear", "spring", "slow"),
    "gear-transmission-error": ("gear", "spring", "slow"),
    "motor-cogging": ("gear", "spring", "slow"),
    "drive-dead-zone": ("gear", "slow", "load"),
    "drive-saturation": ("strong", "warm"),
    "drive-thermal": ("warm",),
    "drive-delay": ("gear", "spring", "load"),
    "spring-hysteresis": ("spring", "gear"),
    "spring-hardening": ("spring", "gear"),
    "spring-contact": ("spring", "gear"),
    "spring-viscoelastic": ("spring",),
    "spring-parallel": ("load", "slow", "strong"),
    "load-friction": ("load", "slow"),
    "load-drag": ("load", "spring"),
    "load-unbalance": ("load", "slow", "gear"),
    "load-flexibility": ("load", "spring"),
    "load-disturbance": ("gear", "load", "slow"),
    "contact-nonlinear": ("contact",),
    "x-brown-out": ("strong", "gear"),
    "x-lost-counts": ("strong", "load"),
    "x-fading-current": ("strong", "warm"),
    "x-load-magnet": ("load", "slow"),
}
ANY = ("gear", "spring", "load", "slow", "contact", "strong")


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How far the bench goes: deflection, link angle and duty at the peak."""

    deflection_rad: float
    link_rad: float
    duty: float


def draw_limits(rng: np.random.Generator) -> Limits:
    return Limits(deflection_rad=rng.uniform(0.17, 0.21), link_rad=rng.uniform(0.35, 0.6), duty=0.8)


def scaled(machine: Machine, slot: Slot, limits: Limits, rng: np.random.Generator) -> Planned:
    """One recording with the largest amplitude that the nominal machine stands."""
    load, kind = slot
    wave = WAVEFORMS[kind](rng)
    where = DESCRIPTIONS[load]
    if kind == "let-go":
        angle = round(float(rng.uniform(0.12, 0.2)), 2)
        description = f"let go from {angle:.2f} rad, no drive, {where}"
        return Planned(
            load=load, kind=kind, command=wave.values, description=description, load_angle_rad=angle
        )
    probe = Planned(
        load="pendulum" if load == "contact" else load,
        kind=kind,
        command=0.05 * wave.values,
        description="",
    )
    session = Session(machine=machine, sensors=Sensors(), planned=(probe,))
    motion = motions(session, step_s=COARSE_STEP_S)[0].values
    deflection = motion["motor_angle_rad"] / machine.gear_ratio - motion["load_angle_rad"]
    used = [0.05 / limits.duty, np.abs(deflection).max() / limits.deflection_rad]
    if load != "locked":
        used.append(np.abs(motion["load_angle_rad"]).max() / limits.link_rad)
    command = np.round(0.05 / max(used) * wave.values, 5)
    return Planned(
        load=load, kind=kind, command=command, description=f"{wave.description}, {where}"
    )


def draw_plan(
    machine: Machine, family: Family, limits: Limits, rng: np.random.Generator
) -> tuple[Planned, ...]:
    """Identification and validation recordings in the order made, the hidden test last."""
    slots = [(s, "identification") for s in family.identification]
    rng.shuffle(slots)
    slots.append((family.validation[rng.integers(len(family.validation))], "validation"))
    slots.append((family.test[rng.integers(len(family.test))], "test"))
    out = []
    for slot, role in slots:
        one = scaled(machine, (str(slot[0]), str(slot[1])), limits, rng)
        end = one.command.size * 1e-3
        drops = tuple(rng.uniform(0.5, max(0.6, end - 1.5), 2))
        out.append(replace(one, role=role, backlash_place=rng.uniform(-1, 1), low_supply_s=drops))
    return tuple(out)
