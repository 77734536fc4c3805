"""Every variant that a diagnosis tries on a case, its starts scaled by the machine."""

from collections.abc import Iterable

from rsea_core.effects.base import Port, Term
from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.load_friction_angle import LoadFrictionAngle
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.registry import LAWS
from rsea_core.effects.sensor_base import FITTED
from rsea_core.effects.variant import Law, candidates_of
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case

GEAR = GearFriction.effect
ONCE_A_TURN = (LoadUnbalance, LoadFrictionAngle)  # of the load; a linear axis has no turns


def catalogue(case: Case, *, relative: bool = False) -> dict[str, Law]:
    """The variants that this machine can have, by key."""
    s, rig = typical_magnitudes_of(case, relative=relative), case.rig
    moving = any(kind not in ("locked", "imposed") for kind in s.loads)
    there = {
        Port.DRIVE: rig.has("drive"),
        Port.GEAR: rig.has("gear"),
        Port.SPRING: rig.has("spring"),
        Port.LOAD: moving and (rig.has("load") or not rig.has("spring")),  # one body: a shaft's too
        Port.ENVIRONMENT: "contact" in s.loads,
        Port.SENSOR: True,
    }
    kinds = [kind for kind in _kinds() if there[kind.port]]
    if not rig.has("load"):
        kinds = [kind for kind in kinds if kind.effect not in of_one_body(rig) - {GEAR}]
    if rig.axis == "linear":
        kinds = [kind for kind in kinds if kind not in ONCE_A_TURN]
    laws = [law for kind in kinds for law in candidates_of(kind, s) if not _on_the_load(law, rig)]
    if rig.axis == "linear":
        laws = [law for law in laws if not any(p.name.startswith("wheel_") for p in law.unknowns)]
    return {law.key: law for law in sorted(laws, key=_column)}


def _on_the_load(law: Law, rig: Rig) -> bool:
    """Whether a wave once per turn of the motor is an eccentric mass on the load, to the letter."""
    direct = not rig.has("spring") and (rig.gear_ratio or 1.0) == 1.0 and rig.axis == "rotary"
    return direct and law.kind is MotorCogging and law.law == "1 per turn"


def of_one_body(rig: Rig) -> set[str]:
    """Effects that are one law where nothing bends between gear and load."""
    return set() if rig.has("spring") else {GEAR, LoadFriction.effect}


def indistinguishable(law: Law, rig: Rig) -> list[str]:
    """Other effects that are the same law on this machine: friction on either side of one body."""
    one = of_one_body(rig) if rig.has("gear") and rig.has("load") else set()
    return sorted(one - {law.effect}) if law.effect in one else []


def rivals_of(law: Law, others: Iterable[tuple[Law, float]]) -> list[tuple[Law, float]]:
    """Laws and their gains, without laws of an effect that generalises the law's own."""
    return [(w, gain) for w, gain in others if w.kind is None or w.kind.generalises != law.effect]


def known_laws(case: Case) -> tuple[Law, ...]:
    """The laws that the rig file states; a delay of the command is the log's nuisance."""
    known = [k for k in case.known if k.term.effect != DriveDelay.effect]
    typical = typical_magnitudes_of(case) if known else None
    return tuple(k.law(typical) for k in known)


def _kinds() -> list[type[Term]]:
    return [kind for laws in LAWS.values() for kind in laws.values()]


def _column(law: Law) -> int:
    """Machine first, then sensor by sensor."""
    return -1 if law.sensor is None else FITTED.index(law.sensor)
