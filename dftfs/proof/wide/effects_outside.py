"""Laws that the catalogue has no name for, each with the right place and its nearest names."""

import numpy as np

from dftfs.proof.wide.effects import Draw
from dftfs.proof.wide.truth.applied import Applied


def outside(name: str, subsystem: str, description: str, build) -> Draw:
    """A law that the catalogue has no name for.

    ``build(rng, m)``: size to changes, or nothing where the machine cannot have it.
    """

    def draw(rng, m, session):
        changes = build(rng, m)
        if not changes:
            return None
        return lambda size: Applied(name=name, subsystem=subsystem, description=description,
                                    extra=changes(size))  # fmt: skip

    return draw


def _iron(rng, m):
    amps = m.torque / (m.body.gear_ratio * m.body.torque_constant or 1.0)
    return m.command and (lambda s: {"iron_A": 3.0 * amps / np.sqrt(s)})


def _grease(rng, m):
    return m.command and (lambda s: {"grease": 0.1 * s * m.torque, "grease_speed": m.speed})


def _magnet(rng, m):
    at, reach = rng.uniform(-0.6, 0.6) * m.travel, rng.uniform(0.1, 0.4) * m.travel
    return m.kind.load != "locked" and (lambda s: {
        "magnet": 0.2 * s * m.torque, "magnet_angle": at, "magnet_reach": reach})  # fmt: skip


def _angle(rng, m):
    turns = 1.0 if not m.kind.linear else 2 * np.pi / (2.5 * m.travel)
    return m.kind.load != "locked" and (lambda s: {
        "load_coulomb": 0.1 * s * m.torque, "angle_share": 0.9, "angle_cycles": turns,
        "load_bristle": 2e-3 * m.travel})  # fmt: skip


def _clamp(rng, m):
    k = m.body.stiffness
    return m.kind.load == "locked" and (lambda s: {
        "clamp_stiffness": 8.0 * k / s,
        "clamp_damping": 0.1 * np.sqrt(8.0 * k / s * m.body.load_inertia)})  # fmt: skip


OUTSIDE: dict[str, Draw] = {
    "x-iron": outside("x-iron", "drive", "torque constant that falls with the current", _iron),
    "x-one-sided-amplifier": outside(
        "x-one-sided-amplifier", "drive", "amplifier that gives less in one direction",
        lambda rng, m: m.command and (lambda s: {"gain_minus": min(0.5, 0.1 * s)})),
    "x-grease": outside("x-grease", "gear", "friction as the speed to the power 0.4", _grease),
    "x-magnet": outside("x-magnet", "load", "a magnet beside the link, short of reach", _magnet),
    "x-friction-of-angle": outside(
        "x-friction-of-angle", "load", "load friction that depends on the angle", _angle),
    "x-soft-clamp": outside("x-soft-clamp", "load", "the clamp of the load gives", _clamp),
}  # fmt: skip
NEAREST = {
    "x-iron": ("drive-saturation", "drive-thermal"),
    "x-one-sided-amplifier": ("gear-friction", "drive-dead-zone", "load-disturbance"),
    "x-grease": ("gear-friction", "load-drag", "load-friction"),
    "x-magnet": ("spring-parallel", "load-unbalance", "load-disturbance", "spring-contact"),
    "x-friction-of-angle": ("load-friction", "gear-friction"),
    "x-soft-clamp": ("spring-parallel", "load-flexibility", "spring-viscoelastic"),
}
